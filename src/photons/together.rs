//! Look-ups near each other, done at once: the way down through the tree is gone once for all of them, and each photon on
//! it is tested by all in lanes.

use super::ellipsoid::{exactly_meets, reach_in_lanes};
use super::map::{MapPhoton, NORMAL_AGREEMENT, Query};
use super::overlap::{OverlapTree, Visit, Walk, corners};
use crate::math::lanes::{Lanes, Vec3Lanes, bits, dispatch_in_eights};
use glam::Vec3;
use pulp::{Simd, WithSimd};
use std::ops::Range;

/// Look-ups that are done at once, at most.
pub const TOGETHER: usize = 8;
/// Photons after which it is seen whether the look-ups have enough in common.
const TRIAL: u64 = 256;

/// What look-ups have found that were done at once.
#[derive(Clone, Debug, Default)]
pub struct Together {
    found: [Vec<u32>; TOGETHER],
    /// Numbers of the look-ups.
    numbers: Range<usize>,
    is_apart: bool,
}

impl Together {
    /// Forgets what was found.
    pub fn clear(&mut self) {
        self.numbers = 0..0;
    }

    /// Whether look-up `number` was among the last that were tried.
    pub fn holds(&self, number: usize) -> bool {
        self.numbers.contains(&number)
    }

    /// What that look-up has found, in the map's order; None if they lie too far apart, so that each is better off alone.
    pub fn of(&self, number: usize) -> Option<&[u32]> {
        let own = self.numbers.contains(&number) && !self.is_apart;
        own.then(|| self.found[number - self.numbers.start].as_slice())
    }

    /// Does the look-ups with these queries, [`TOGETHER`] at most, whose numbers start at `first`.
    pub(super) fn find<const POINT: bool>(
        &mut self,
        photons: &[MapPhoton],
        tree: &OverlapTree,
        first: usize,
        queries: impl Iterator<Item = (Query, (Vec3, Vec3))>,
    ) {
        let mut lanes = Queries::default();
        let mut count = 0;
        for (query, bounds) in queries.take(TOGETHER) {
            lanes.put(count, query, bounds);
            self.found[count].clear();
            count += 1;
        }
        self.numbers = first..first + count;
        self.is_apart = false;
        let finding = Finding::<POINT> { photons, tree, queries: &lanes, count, together: self, seen: 0, met: 0 };
        if count > 0 && !tree.is_empty() {
            dispatch_in_eights(finding);
        }
    }
}

/// Queries by coordinate.
struct Queries {
    /// Corners of the box, centre, half-edges and normal. The box of a lane without query is met by nothing.
    vectors: [[[f32; TOGETHER]; 3]; 6],
    low: Vec3,
    high: Vec3,
}

impl Default for Queries {
    fn default() -> Self {
        let mut vectors = [[[0.0; TOGETHER]; 3]; 6];
        vectors[0] = [[f32::INFINITY; TOGETHER]; 3];
        vectors[1] = [[f32::NEG_INFINITY; TOGETHER]; 3];
        Self { vectors, low: Vec3::INFINITY, high: Vec3::NEG_INFINITY }
    }
}

impl Queries {
    fn put(&mut self, lane: usize, query: Query, bounds: (Vec3, Vec3)) {
        let (low, high) = corners(bounds);
        (self.low, self.high) = (self.low.min(low), self.high.max(high));
        let [a, b] = query.axes;
        for (lanes, v) in self.vectors.iter_mut().zip([low, high, query.center, a, b, query.normal]) {
            for (lanes, x) in lanes.iter_mut().zip(v.to_array()) {
                lanes[lane] = x;
            }
        }
    }

    /// The query of a lane.
    fn query(&self, lane: usize) -> Query {
        let of = |which: usize| Vec3::from_array(self.vectors[which].each_ref().map(|x| x[lane]));
        Query { center: of(2), normal: of(5), axes: [of(3), of(4)] }
    }

    #[inline(always)]
    fn vectors<S: Simd>(&self, simd: S, which: usize, group: usize) -> Vec3Lanes<S> {
        Vec3Lanes::of(simd, &self.vectors[which], group)
    }

    /// Which of a group's boxes meet that box, as bits.
    #[inline(always)]
    fn meet<S: Simd>(&self, simd: S, group: usize, (low, high): (Vec3, Vec3)) -> u32 {
        let (l, h) = (self.vectors(simd, 0, group), self.vectors(simd, 1, group));
        let (low, high) = (Vec3Lanes::splat(simd, low), Vec3Lanes::splat(simd, high));
        bits(simd, Vec3Lanes::boxes_meet(simd, (l, h), (low, high)))
    }
}

struct Finding<'a, const POINT: bool> {
    photons: &'a [MapPhoton],
    tree: &'a OverlapTree,
    queries: &'a Queries,
    count: usize,
    together: &'a mut Together,
    /// Photons that were looked at, and the queries whose boxes theirs met.
    seen: u64,
    met: u64,
}

impl<const POINT: bool> WithSimd for Finding<'_, POINT> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let (tree, low, high) = (self.tree, self.queries.low, self.queries.high);
        Walk { tree, low, high, visit: self }.with_simd(simd);
    }
}

impl<const POINT: bool> Visit for Finding<'_, POINT> {
    #[inline(always)]
    fn visit<S: Simd>(&mut self, simd: S, entry: u32) -> bool {
        let Self { photons, queries, .. } = *self;
        let (Some(photon), corners) = (photons.get(entry as usize), self.tree.corners_of(entry)) else { return true };
        for group in 0..self.count.div_ceil(S::F32_LANES).min(TOGETHER / S::F32_LANES) {
            let boxed = queries.meet(simd, group, corners);
            self.met += u64::from(boxed.count_ones());
            if boxed == 0 {
                continue;
            }
            let mut found = boxed & tested::<S, POINT>(simd, photon, queries, group, boxed);
            while found != 0 {
                let lane = group * S::F32_LANES + found.trailing_zeros() as usize;
                if let Some(list) = self.together.found.get_mut(lane) {
                    list.push(entry);
                }
                found &= found - 1;
            }
        }
        self.seen += 1;
        self.together.is_apart = self.seen.is_multiple_of(TRIAL) && 2 * self.met < self.seen;
        !self.together.is_apart
    }
}

/// The filter transform of one photon for all lanes.
struct Transform<S: Simd> {
    rows: [Vec3Lanes<S>; 3],
    inverse_reach: Lanes<S>,
}

impl<S: Simd> Transform<S> {
    /// As [`MapPhoton::to_filter`] has it.
    #[inline(always)]
    fn of(&self, v: Vec3Lanes<S>) -> Vec3Lanes<S> {
        let [x, y, z] = &self.rows;
        Vec3Lanes { x: x.dot(v), y: y.dot(v), z: z.dot(v) * self.inverse_reach }
    }
}

/// Which queries of a group the photon lights and meets, as bits, where they are `among` these.
#[inline(always)]
fn tested<S: Simd, const POINT: bool>(simd: S, photon: &MapPhoton, queries: &Queries, group: usize, among: u32) -> u32 {
    let normal = queries.vectors(simd, 5, group);
    let own = Vec3Lanes::splat(simd, photon.normal);
    let agree = Lanes::splat(simd, NORMAL_AGREEMENT).at_most(own.dot(normal));
    let against = Vec3Lanes::splat(simd, photon.direction).dot(normal).less(Lanes::splat(simd, 0.0));
    let lit = among & bits(simd, simd.and_m32s(agree, against));
    let transform = Transform {
        rows: [Vec3Lanes::splat(simd, photon.rows[0]), Vec3Lanes::splat(simd, photon.rows[1]), own],
        inverse_reach: Lanes::splat(simd, photon.inverse_reach),
    };
    let c = transform.of(queries.vectors(simd, 2, group) - Vec3Lanes::splat(simd, photon.position));
    if POINT {
        return lit & bits(simd, c.dot(c).less(Lanes::splat(simd, 1.0)));
    }
    let (a, b) = (transform.of(queries.vectors(simd, 3, group)), transform.of(queries.vectors(simd, 4, group)));
    let reach = reach_in_lanes(simd, c, a, b, lit);
    let mut found = lit & reach.meets;
    let mut unsure = lit & reach.unsure;
    while unsure != 0 {
        let lane = unsure.trailing_zeros();
        if exactly_meets(photon, &queries.query(group * S::F32_LANES + lane as usize)) {
            found |= 1 << lane;
        }
        unsure &= unsure - 1;
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::frame::{tangents, uniform_sphere};
    use crate::math::rgb::Rgb;
    use crate::math::sequence::{Sampling, Sequence};
    use crate::photons::map::{FootprintLimits, MapParts};
    use crate::photons::{Photon, PhotonMap};

    /// Look-ups that are done together find what each finds alone, in the same order: those near each other, those far
    /// apart, and fewer than there are lanes.
    #[test]
    fn look_ups_together_find_what_each_finds_alone() {
        let (mut apart, mut found) = (0, 0);
        for n in [0u64, 1, 8, 9, 500, 3000, 40_000] {
            let sequence = Sequence::new(Sampling::Random, n);
            let turned = |i: u64, set: u32| {
                let (x, y) = (sequence.four(i, set), sequence.four(i, set + 1));
                let normal = if i.is_multiple_of(4) { uniform_sphere(y[0], y[1]).normalize() } else { Vec3::Y };
                let (t, b) = tangents(normal);
                let size = 0.1 * x[3] * x[3];
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
            let mut together = Together::default();
            for group in 0..60u64 {
                let spread = [0.02, 0.2, 1.0][group as usize % 3];
                let query = |i: u64| {
                    let (place, normal, axes) = turned(group * 8 + i, 2);
                    let center = turned(group, 4).0 * (1.0 - spread) + place * spread;
                    Query { center, normal, axes: if group % 2 == 0 { axes } else { [Vec3::ZERO; 2] } }
                };
                let count = 1 + group % 8;
                if group % 2 == 0 {
                    map.parallelograms_together(5, (0..count).map(query), &mut together);
                } else {
                    map.points_together(5, (0..count).map(query), &mut together);
                }
                assert!(!together.holds(4) && !together.holds(5 + count as usize));
                for i in 0..count {
                    let mut alone = Vec::new();
                    if group % 2 == 0 {
                        map.overlapping_parallelogram(&query(i), &mut alone);
                    } else {
                        map.overlapping_point(&query(i), &mut alone);
                    }
                    let number = 5 + i as usize;
                    assert!(together.holds(number));
                    match together.of(number) {
                        Some(list) => assert_eq!(list, alone, "{n} photons, group {group}"),
                        None => apart += 1,
                    }
                    found += alone.len();
                }
            }
        }
        assert!(apart > 10 && found > 5_000, "{apart} {found}");
    }
}
