//! What look-ups near each other have in common: the photons that any of them may find, as a structure of arrays.
//!
//! The way down through the tree is gone once for all of them, and then each tests these photons in lanes.

use super::ellipsoid::{Verdict, exactly_meets, verdicts_of};
use super::map::{MapPhoton, NORMAL_AGREEMENT, Query};
use super::overlap::corners;
use crate::math::lanes::{Lanes, Vec3Lanes};
use glam::Vec3;
use pulp::{Arch, Simd, WithSimd};

/// Photons of a [`Chunk`].
const CHUNK: usize = 64;
/// Photons beyond which look-ups have too many in common for a list of them to be of use.
const CROWDED: usize = 2048;

/// What queries near each other have in common: copies of the photons whose boxes meet the box around all of them.
#[derive(Clone, Debug)]
pub struct Near {
    /// The box around them.
    low: Vec3,
    high: Vec3,
    chunks: Vec<Chunk>,
    count: usize,
    is_crowded: bool,
}

impl Default for Near {
    fn default() -> Self {
        Self { low: Vec3::INFINITY, high: Vec3::NEG_INFINITY, chunks: Vec::new(), count: 0, is_crowded: false }
    }
}

impl Near {
    /// Forgets for what it was gathered: it must not be used for another map.
    pub fn clear(&mut self) {
        (self.low, self.high) = (Vec3::INFINITY, Vec3::NEG_INFINITY);
    }

    /// Corners of the box around these, given by centre and half-size, if it is to be filled for them: it is not yet what
    /// the first of them needs.
    pub(super) fn starts(&mut self, mut boxes: impl Iterator<Item = (Vec3, Vec3)>) -> Option<(Vec3, Vec3)> {
        let (low, high) = corners(boxes.next()?);
        if self.holds(low, high) {
            return None;
        }
        let around = |all: (Vec3, Vec3), b: (Vec3, Vec3)| (all.0.min(b.0), all.1.max(b.1));
        (self.low, self.high) = boxes.map(corners).fold((low, high), around);
        self.count = 0;
        self.is_crowded = false;
        Some((self.low, self.high))
    }

    /// Adds a photon of the map with the corners of its box; whether there is room for more.
    #[inline]
    pub(super) fn push(&mut self, index: u32, photon: &MapPhoton, (low, high): (Vec3, Vec3)) -> bool {
        self.is_crowded = self.count == CROWDED;
        if self.is_crowded {
            return false;
        }
        let (chunk, at) = (self.count / CHUNK, self.count % CHUNK);
        if chunk == self.chunks.len() {
            self.chunks.push(Chunk::default());
        }
        if let Some(chunk) = self.chunks.get_mut(chunk) {
            let MapPhoton { position, rows, normal, direction, inverse_reach, .. } = *photon;
            let vectors = [low, high, position, rows[0], rows[1], normal, direction];
            for (numbers, v) in chunk.vectors.iter_mut().zip(vectors) {
                for (numbers, x) in numbers.iter_mut().zip(v.to_array()) {
                    numbers[at] = x;
                }
            }
            chunk.inverse_reach[at] = inverse_reach;
            chunk.index[at] = index;
            self.count += 1;
        }
        true
    }

    /// Whether it was gathered for that box.
    fn holds(&self, low: Vec3, high: Vec3) -> bool {
        self.low.cmple(low).all() && self.high.cmpge(high).all()
    }

    /// Appends to `out` the photons whose box meets the query's and whose ellipsoid meets its parallelogram, or, if it has
    /// none, its point, in the order in which they were added; false if it was not gathered for this query.
    #[inline]
    pub(super) fn find<const POINT: bool>(&self, query: &Query, bounds: (Vec3, Vec3), out: &mut Vec<u32>) -> bool {
        let (low, high) = corners(bounds);
        if self.is_crowded || !self.holds(low, high) {
            return false;
        }
        if self.count > 0 {
            Arch::new().dispatch(Find::<POINT> { near: self, query, low, high, out });
        }
        true
    }
}

/// Photons by coordinate.
#[derive(Clone, Debug)]
struct Chunk {
    /// Corners of the box, position, rows of the filter transform, normal and direction.
    vectors: [[[f32; CHUNK]; 3]; 7],
    inverse_reach: [f32; CHUNK],
    /// Places in the map.
    index: [u32; CHUNK],
}

impl Default for Chunk {
    fn default() -> Self {
        Self { vectors: [[[0.0; CHUNK]; 3]; 7], inverse_reach: [0.0; CHUNK], index: [0; CHUNK] }
    }
}

impl Chunk {
    #[inline(always)]
    fn vectors<S: Simd>(&self, simd: S, which: usize, group: usize) -> Vec3Lanes<S> {
        Vec3Lanes::of(simd, &self.vectors[which], group)
    }

    /// Where boxes meet that box.
    #[inline(always)]
    fn meet<S: Simd>(&self, simd: S, group: usize, low: Vec3Lanes<S>, high: Vec3Lanes<S>) -> S::m32s {
        let (l, h) = (self.vectors(simd, 0, group), self.vectors(simd, 1, group));
        let along =
            |l: Lanes<S>, h: Lanes<S>, low: Lanes<S>, high: Lanes<S>| simd.and_m32s(l.at_most(high), low.at_most(h));
        let (x, y) = (along(l.x, h.x, low.x, high.x), along(l.y, h.y, low.y, high.y));
        simd.and_m32s(simd.and_m32s(x, y), along(l.z, h.z, low.z, high.z))
    }

    /// Filter coordinates, as [`MapPhoton::to_filter`] has them.
    #[inline(always)]
    fn to_filter<S: Simd>(&self, simd: S, group: usize, v: Vec3Lanes<S>) -> Vec3Lanes<S> {
        let along = |which| self.vectors(simd, which, group).dot(v);
        let inverse_reach = Lanes::of(simd, &self.inverse_reach, group);
        Vec3Lanes { x: along(3), y: along(4), z: along(5) * inverse_reach }
    }

    /// Where photons light that side of a surface, as [`MapPhoton::lights`].
    #[inline(always)]
    fn light<S: Simd>(&self, simd: S, group: usize, normal: Vec3Lanes<S>) -> S::m32s {
        let agree = self.vectors(simd, 5, group).dot(normal);
        let against = self.vectors(simd, 6, group).dot(normal);
        let least = Lanes::splat(simd, NORMAL_AGREEMENT);
        simd.and_m32s(least.at_most(agree), against.less(Lanes::splat(simd, 0.0)))
    }
}

struct Find<'a, const POINT: bool> {
    near: &'a Near,
    query: &'a Query,
    low: Vec3,
    high: Vec3,
    out: &'a mut Vec<u32>,
}

impl<const POINT: bool> WithSimd for Find<'_, POINT> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { near, query, low, high, out } = self;
        let splat = |v| Vec3Lanes::splat(simd, v);
        let ([a, b], center, normal) = (query.axes.map(splat), splat(query.center), splat(query.normal));
        let (low, high) = (splat(low), splat(high));
        let none = simd.splat_u32s(0);
        for (number, chunk) in near.chunks[..near.count.div_ceil(CHUNK)].iter().enumerate() {
            let count = (near.count - number * CHUNK).min(CHUNK);
            let mut verdicts = [0u32; CHUNK];
            for (group, own) in S::as_mut_simd_u32s(&mut verdicts).0.iter_mut().enumerate() {
                if group * S::F32_LANES >= count {
                    break;
                }
                let c = chunk.to_filter(simd, group, center - chunk.vectors(simd, 2, group));
                let told = if POINT {
                    simd.select_u32s(c.dot(c).less(Lanes::splat(simd, 1.0)), simd.splat_u32s(1), none)
                } else {
                    verdicts_of(simd, c, chunk.to_filter(simd, group, a), chunk.to_filter(simd, group, b))
                };
                let counts = simd.and_m32s(chunk.meet(simd, group, low, high), chunk.light(simd, group, normal));
                *own = simd.select_u32s(counts, told, none);
            }
            // Which are found is hard to foresee: all are written, and those that are not are written over.
            let (mut kept, mut length) = ([0; CHUNK], 0);
            for (i, &index) in chunk.index.iter().enumerate().take(count) {
                kept[length] = index;
                let mut verdict = verdicts[i];
                if verdict == Verdict::Unsure as u32 {
                    verdict = u32::from(near.exactly_meets(chunk, i, query));
                }
                length += verdict as usize;
            }
            out.extend_from_slice(&kept[..length]);
        }
    }
}

impl Near {
    /// Whether a photon meets the parallelogram where 32 bits cannot tell; rare.
    #[inline(never)]
    fn exactly_meets(&self, chunk: &Chunk, i: usize, query: &Query) -> bool {
        let vector = |which: usize| Vec3::from_array(chunk.vectors[which].each_ref().map(|x| x[i]));
        let photon = MapPhoton {
            position: vector(2),
            rows: [vector(3), vector(4)],
            normal: vector(5),
            inverse_reach: chunk.inverse_reach[i],
            ..MapPhoton::NONE
        };
        exactly_meets(&photon, query)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::frame::{tangents, uniform_sphere};
    use crate::math::rgb::Rgb;
    use crate::math::sequence::{Sampling, Sequence};
    use crate::photons::map::{FootprintLimits, MapParts};
    use crate::photons::{Photon, PhotonMap};

    /// Queries that were looked up together find what each finds alone, in the same order: those near each other, those far
    /// apart, which have too much in common for a list, and one that nothing was gathered for.
    #[test]
    fn queries_near_each_other_find_what_each_finds_alone() {
        let (mut crowded, mut found) = (0, 0);
        for n in [0u64, 1, 8, 9, 500, 3000, 40_000] {
            let sequence = Sequence::new(Sampling::Random, n);
            let turned = |i: u64, set: u32| {
                let (x, y) = (sequence.four(i, set), sequence.four(i, set + 1));
                let normal = if i % 3 == 0 { Vec3::Y } else { uniform_sphere(y[0], y[1]).normalize() };
                let (t, b) = tangents(normal);
                let size = 0.05 * x[3] * x[3];
                (Vec3::new(x[0], x[1] * 0.1, x[2]), normal, [t * size + b * (size * y[2]), b * (size * y[3])])
            };
            let photons: Vec<Photon> = (0..n)
                .map(|i| {
                    let (position, normal, footprint) = turned(i, 0);
                    Photon { position, direction: -normal, normal, power: Rgb::ONE, footprint }
                })
                .collect();
            let limits = FootprintLimits { scale: 1.0, floor: 1e-6, ceiling: 10.0 };
            let map = PhotonMap::new(&photons, limits, MapParts { kd_tree: false, overlap: true });
            let mut near = Near::default();
            for group in 0..60 {
                let spread = [0.02, 0.2, 1.0][group as usize % 3];
                let own = |i: u64| {
                    let (place, normal, axes) = turned(group * 8 + i, 2);
                    let center = turned(group, 4).0 * (1.0 - spread) + place * spread;
                    Query { center, normal, axes: if group % 2 == 0 { axes } else { [Vec3::ZERO; 2] } }
                };
                near.clear();
                map.gather_near((0..7).map(own), &mut near);
                crowded += u32::from(near.is_crowded);
                for query in (0..8).map(own) {
                    let (mut together, mut alone) = (Vec::new(), Vec::new());
                    if group % 2 == 0 {
                        map.overlapping_parallelogram(&query, &near, &mut together);
                        map.overlapping_parallelogram(&query, &Near::default(), &mut alone);
                    } else {
                        map.overlapping_point(&query, &near, &mut together);
                        map.overlapping_point(&query, &Near::default(), &mut alone);
                    }
                    assert_eq!(together, alone, "{n} photons, group {group}");
                    found += alone.len();
                }
            }
        }
        assert!(crowded > 10 && found > 10_000, "{crowded} {found}");
    }
}
