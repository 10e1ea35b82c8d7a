//! Photons of one hit after the other as a structure of arrays, whose weights are computed together in lanes.

use super::{Gathered, View};
use crate::math::eights::{Group, LANES, set, vector};
use crate::photons::MapPhoton;
use glam::{DVec3, Vec3};
use std::ops::Range;

/// Photons whose weights are computed at once.
pub(super) const BATCH: usize = 64;

/// Photons with the hits that see them, [`BATCH`] at most, as a structure of arrays.
pub(super) trait Pairs: Default {
    /// Number of them.
    fn len(&self) -> usize;

    /// Adds one, unless there are [`BATCH`] of them.
    fn push(&mut self, photon: &MapPhoton, view: &View);

    /// Forgets them.
    fn clear(&mut self);
}

/// `V` vectors of each of [`BATCH`] pairs at most, in groups of [`LANES`].
pub(super) struct Vectors<const V: usize> {
    groups: [Group<V>; BATCH / LANES],
    count: usize,
}

impl<const V: usize> Default for Vectors<V> {
    fn default() -> Self {
        Self { groups: [[[[0.0; LANES]; 3]; V]; BATCH / LANES], count: 0 }
    }
}

impl<const V: usize> Vectors<V> {
    /// Number of pairs.
    #[inline(always)]
    pub fn len(&self) -> usize {
        self.count
    }

    /// Adds those of one pair, unless there are [`BATCH`] of them.
    #[inline(always)]
    pub fn push(&mut self, vectors: [Vec3; V]) {
        if let Some(group) = self.groups.get_mut(self.count / LANES) {
            for (of, v) in group.iter_mut().zip(vectors) {
                set(of, self.count % LANES, v);
            }
            self.count += 1;
        }
    }

    /// Forgets all pairs.
    #[inline(always)]
    pub fn clear(&mut self) {
        self.count = 0;
    }

    /// The groups that pairs are in; the last lanes hold what was there before.
    #[inline(always)]
    pub fn groups(&self) -> &[Group<V>] {
        &self.groups[..self.count.div_ceil(LANES).min(BATCH / LANES)]
    }

    /// Those of one pair, below [`BATCH`].
    pub fn at(&self, i: usize) -> [Vec3; V] {
        self.groups[i / LANES].map(|of| vector(&of, i % LANES))
    }
}

/// View footprints in the filter space of a photon each: centres and half-edges.
pub(super) type Parallelograms = Vectors<3>;

impl Pairs for Parallelograms {
    fn len(&self) -> usize {
        self.len()
    }

    #[inline(always)]
    fn push(&mut self, photon: &MapPhoton, view: &View) {
        self.push(in_filter_space(photon, view));
    }

    fn clear(&mut self) {
        self.clear();
    }
}

/// Centre and half-edges of the view footprint in the photon's filter space.
#[inline(always)]
pub(super) fn in_filter_space(photon: &MapPhoton, view: &View) -> [Vec3; 3] {
    let [a, b] = view.query.axes;
    [photon.to_filter(view.query.center - photon.position), photon.to_filter(a), photon.to_filter(b)]
}

/// Whether the view footprint is farther from the photon's ball than rounding may tell, so that the photon has no weight:
/// most of many nearest photons.
#[inline(always)]
fn is_far([c, a, b]: &[Vec3; 3]) -> bool {
    let cc = c.length_squared();
    // |a| + |b| is at most √(2 (aa + bb)).
    let spread = 2.0 * (a.length_squared() + b.length_squared());
    let gap = cc - 1.0 - spread;
    (gap > 1e-4 * cc) & (gap * gap > 4.001 * spread)
}

/// Weight of a photon, 1/m², by the mean of `(1 - u)²` over the view footprint.
#[inline(always)]
pub(super) fn weight_by_mean(mean: f64, photon: &MapPhoton) -> f64 {
    3.0 * mean * f64::from(photon.inverse_area)
}

/// Irradiance at each hit, as [`super::Estimator::irradiances`] has it, of an estimator whose weights come from means over
/// the view footprint: `means` computes those of a batch.
pub(super) fn irradiances<'a, P: Pairs>(
    hits: &mut dyn Iterator<Item = (Gathered<'a>, View)>,
    put: &mut dyn FnMut(DVec3),
    means: impl Fn(&P, &mut [f64; BATCH]),
) {
    let mut batch =
        Batch { pairs: P::default(), photons: [None; BATCH], ends: [0; BATCH], hits: 0, sum: DVec3::ZERO, means, put };
    for (gathered, view) in hits {
        batch.add(&gathered, &view);
    }
    batch.finish();
}

/// The same at one hit, W/m².
pub(super) fn irradiance<P: Pairs>(gathered: &Gathered, view: &View, means: impl Fn(&P, &mut [f64; BATCH])) -> DVec3 {
    let mut irradiance = DVec3::ZERO;
    irradiances(&mut std::iter::once((*gathered, *view)), &mut |sum| irradiance = sum, means);
    irradiance
}

struct Batch<'a, 'b, P, M> {
    pairs: P,
    photons: [Option<&'a MapPhoton>; BATCH],
    /// Where hits end whose photons are all there.
    ends: [usize; BATCH],
    hits: usize,
    /// What photons before these add up to, of the hit that the first of these belongs to.
    sum: DVec3,
    means: M,
    put: &'b mut dyn FnMut(DVec3),
}

impl<'a, P: Pairs, M: Fn(&P, &mut [f64; BATCH])> Batch<'a, '_, P, M> {
    /// Adds a hit.
    fn add(&mut self, gathered: &Gathered<'a>, view: &View) {
        // Of many nearest photons most are far; of few each is computed with less than it takes to find out.
        let are_many = gathered.indices.len() > BATCH;
        for &i in gathered.indices {
            let photon = &gathered.photons[i as usize];
            if are_many && is_far(&in_filter_space(photon, view)) {
                continue;
            }
            self.photons[self.pairs.len()] = Some(photon);
            self.pairs.push(photon, view);
            if self.pairs.len() == BATCH {
                self.finish();
            }
        }
        self.ends[self.hits] = self.pairs.len();
        self.hits += 1;
        if self.hits == BATCH {
            self.finish();
        }
    }

    /// Hands over what the hits that have ended add up to, and keeps the sum of one that goes on.
    fn finish(&mut self) {
        let mut means = [0.0; BATCH];
        (self.means)(&self.pairs, &mut means);
        let mut from = 0;
        for hit in 0..self.hits {
            let to = self.ends[hit];
            self.add_up(from..to, &means);
            (self.put)(std::mem::take(&mut self.sum));
            from = to;
        }
        self.add_up(from..self.pairs.len(), &means);
        self.pairs.clear();
        self.hits = 0;
    }

    /// Adds the photons at these places to the sum of their hit.
    fn add_up(&mut self, places: Range<usize>, means: &[f64; BATCH]) {
        for (photon, mean) in self.photons[places.clone()].iter().zip(&means[places]) {
            if let Some(photon) = photon {
                self.sum += photon.power.as_dvec3() * weight_by_mean(*mean, photon);
            }
        }
    }
}
