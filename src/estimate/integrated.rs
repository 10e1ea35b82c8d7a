//! `integrated`: the exact mean of the kernel over the view footprint (`docs/theory.md`).

use super::{Estimator, Gathered, Lookup, View};
use crate::estimate::parallelogram::{BATCH, Parallelograms, mean_over_parallelogram};
use crate::estimate::settings::{Spec, SpecError};
use crate::photons::MapPhoton;
use glam::{DVec3, Vec3};

/// The closed form; it has no settings.
pub struct Integrated;

impl Integrated {
    /// `integrated`, which has no settings.
    ///
    /// # Errors
    /// Any setting.
    pub fn parse(spec: &Spec) -> Result<Box<dyn Estimator>, SpecError> {
        spec.only(&[])?;
        Ok(Box::new(Self))
    }
}

/// Centre and half-edges of the view footprint in the photon's filter space.
#[inline(always)]
fn in_filter_space(photon: &MapPhoton, view: &View) -> [Vec3; 3] {
    let [a, b] = view.query.axes;
    [view.query.center - photon.position, a, b].map(|v| photon.to_filter(v))
}

/// The weight of a photon by the mean of the kernel.
#[inline(always)]
fn over_area(mean: f64, photon: &MapPhoton) -> f64 {
    3.0 * mean * f64::from(photon.inverse_area)
}

/// Photons of one hit after the other, whose means are computed together.
struct Batch<'a> {
    parallelograms: Parallelograms,
    means: [f64; BATCH],
    photons: [Option<&'a MapPhoton>; BATCH],
    /// Where hits end whose photons are all there.
    ends: [usize; BATCH],
    hits: usize,
    /// What photons before these add up to, of the hit that the first of these belongs to.
    sum: DVec3,
}

impl<'a> Batch<'a> {
    fn new() -> Self {
        Self {
            parallelograms: Parallelograms::default(),
            means: [0.0; BATCH],
            photons: [None; BATCH],
            ends: [0; BATCH],
            hits: 0,
            sum: DVec3::ZERO,
        }
    }

    /// Adds a hit.
    fn add(&mut self, gathered: &Gathered<'a>, view: &View, put: &mut dyn FnMut(DVec3)) {
        for &i in gathered.indices {
            let photon = &gathered.photons[i as usize];
            let [c, a, b] = in_filter_space(photon, view);
            self.photons[self.parallelograms.len()] = Some(photon);
            self.parallelograms.push(c, a, b);
            if self.parallelograms.len() == BATCH {
                self.finish(put);
            }
        }
        self.ends[self.hits] = self.parallelograms.len();
        self.hits += 1;
        if self.hits == BATCH {
            self.finish(put);
        }
    }

    /// Hands over what all hits that have ended add up to.
    fn finish(&mut self, put: &mut dyn FnMut(DVec3)) {
        self.parallelograms.means(&mut self.means);
        let mut ends = self.ends[..self.hits].iter().peekable();
        let pairs = self.photons.iter().zip(&self.means).take(self.parallelograms.len());
        for (i, (photon, mean)) in pairs.enumerate() {
            while ends.next_if_eq(&&i).is_some() {
                put(std::mem::take(&mut self.sum));
            }
            if let Some(photon) = photon {
                let weight = over_area(*mean, photon);
                if weight != 0.0 {
                    self.sum += photon.power.as_dvec3() * weight;
                }
            }
        }
        for _ in ends {
            put(std::mem::take(&mut self.sum));
        }
        self.parallelograms.clear();
        self.hits = 0;
    }
}

impl Estimator for Integrated {
    fn id(&self) -> &'static str {
        "integrated"
    }

    fn settings(&self) -> String {
        String::new()
    }

    fn lookup(&self) -> Lookup {
        Lookup::Parallelogram
    }

    fn is_consistent(&self) -> bool {
        true
    }

    fn is_exact_mean(&self) -> bool {
        true
    }

    fn weight(&self, photon: &MapPhoton, view: &View, _radius: f32) -> f64 {
        let [c, a, b] = in_filter_space(photon, view);
        over_area(mean_over_parallelogram(c, a, b), photon)
    }

    fn irradiance(&self, gathered: &Gathered, view: &View) -> DVec3 {
        let mut irradiance = DVec3::ZERO;
        self.irradiances(&mut std::iter::once((*gathered, *view)), &mut |sum| irradiance = sum);
        irradiance
    }

    fn irradiances<'a>(&self, hits: &mut dyn Iterator<Item = (Gathered<'a>, View)>, put: &mut dyn FnMut(DVec3)) {
        let mut batch = Batch::new();
        for (gathered, view) in hits {
            batch.add(&gathered, &view, put);
        }
        batch.finish(put);
    }
}
