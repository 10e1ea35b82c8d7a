//! Photon maps: photons made ready for a footprint scale, with the structures that look them up.

use crate::math::eights::vector;
use crate::math::rgb::Rgb;
use crate::photons::ellipsoid::meets_unit_ball;
use crate::photons::footprint::FilterTransform;
use crate::photons::kd_tree::{self, KdTree, Nearest, NearestQuery};
use crate::photons::overlap::{self, Block, LANES, OverlapTree, packing_order};
use crate::photons::photon::Footprinted;
use crate::photons::together::Together;
use glam::{DVec2, Vec2, Vec3};
use prefetch_index::prefetch_index;
use rayon::prelude::*;
use std::sync::atomic::{AtomicU64, Ordering};

/// Smallest cosine between the normals of a photon's surface and the view hit's for the photon to count.
///
/// Keeps photons of the far side of an edge out of a hit, and lets a smooth surface bend within a footprint.
pub const NORMAL_AGREEMENT: f32 = 0.5;

/// A photon of a map, ready to be evaluated. What a gather looks at comes first, in 64 bytes.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub struct MapPhoton {
    /// Where it arrived, metres.
    pub position: Vec3,
    /// Inverse of the longest semi-axis, 1/metre.
    pub inverse_reach: f32,
    /// First two rows of the filter transform, 1/metre, as [`FilterTransform`] has them; the third is the normal over the
    /// longest semi-axis.
    pub rows: [Vec3; 2],
    /// Unit normal of its surface.
    pub normal: Vec3,
    /// Unit direction in which it travelled.
    pub direction: Vec3,
    /// Power, W.
    pub power: Rgb,
    /// 1/A, 1/m².
    pub inverse_area: f32,
    /// Cosine and sine of the turn from filter coordinates to those in `dα` and `dβ`.
    pub turn: Vec2,
}

impl MapPhoton {
    /// A place for a photon.
    pub(crate) const NONE: Self = Self {
        position: Vec3::ZERO,
        inverse_reach: 0.0,
        rows: [Vec3::ZERO; 2],
        normal: Vec3::ZERO,
        direction: Vec3::ZERO,
        power: Rgb::ZERO,
        inverse_area: 0.0,
        turn: Vec2::ZERO,
    };

    /// Filter coordinates of a world vector.
    #[inline]
    pub fn to_filter(&self, v: Vec3) -> Vec3 {
        Vec3::new(self.rows[0].dot(v), self.rows[1].dot(v), self.normal.dot(v) * self.inverse_reach)
    }

    /// Coordinates in `dα` and `dβ` of filter coordinates in the photon's plane.
    #[inline]
    pub fn to_own(&self, filter: DVec2) -> DVec2 {
        self.turn.as_dvec2().rotate(filter)
    }

    /// Half-axes `(dα, dβ)` of its footprint in its tangent plane, metres: scaled, and after floor and ceiling.
    pub fn axes(&self) -> [Vec3; 2] {
        // A row is its semi-axis over the square of its length.
        let [long, short] = self.rows.map(|r| r.as_dvec3() / r.as_dvec3().length_squared());
        let turn = self.turn.as_dvec2();
        [long * turn.x - short * turn.y, long * turn.y + short * turn.x].map(|c| c.as_vec3())
    }

    /// Longest semi-axis, metres: the radius of the ball that holds its ellipsoid.
    #[inline]
    pub fn reach(&self) -> f32 {
        1.0 / self.inverse_reach
    }

    /// Area of its ellipse, `π ‖dα × dβ‖`, m².
    pub fn area(&self) -> f32 {
        (1.0 / f64::from(self.inverse_area)) as f32
    }

    /// Longest over shortest semi-axis of its ellipse, at least 1: the condition of its filter transform in the plane.
    pub fn condition(&self) -> f64 {
        let long = f64::from(self.inverse_reach);
        (std::f64::consts::PI * f64::from(self.inverse_area) / (long * long)).max(1.0)
    }

    /// Whether it lights the side of a surface that has this unit normal.
    #[inline]
    pub fn lights(&self, normal: Vec3) -> bool {
        (self.normal.dot(normal) >= NORMAL_AGREEMENT) & (self.direction.dot(normal) < 0.0)
    }
}

/// Which structures a map needs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MapParts {
    /// The kd-tree, for the k nearest.
    pub kd_tree: bool,
    /// The footprint hierarchy, for overlap.
    pub overlap: bool,
}

/// Limits on footprints and the factor on their axes.
#[derive(Clone, Copy, Debug)]
pub struct FootprintLimits {
    /// Factor on both axes.
    pub scale: f32,
    /// Smallest semi-axis, metres, positive.
    pub floor: f32,
    /// Largest semi-axis, metres.
    pub ceiling: f32,
}

/// The photons of one kind in one pass.
pub struct PhotonMap {
    photons: Vec<MapPhoton>,
    kd_tree: Option<KdTree>,
    overlap: Option<OverlapTree>,
    longest_reach: f32,
    floored: u64,
    capped: u64,
}

/// A place where photons are looked up.
#[derive(Clone, Copy, Debug)]
pub struct Query {
    /// Centre, metres.
    pub center: Vec3,
    /// Unit normal of the surface, on the side that is seen.
    pub normal: Vec3,
    /// Half-edges of the view parallelogram, metres; zero for a point.
    pub axes: [Vec3; 2],
}

/// Memory of a stored photon of a map with those structures, bytes.
pub fn map_bytes(parts: MapParts) -> usize {
    let structures = [(parts.kd_tree, kd_tree::BYTES_PER_ENTRY), (parts.overlap, overlap::BYTES_PER_ENTRY)];
    size_of::<MapPhoton>() + structures.iter().filter(|(on, _)| *on).map(|(_, bytes)| bytes).sum::<usize>()
}

/// Memory of a stored photon while a map with those structures is built, beyond that of the map, bytes: places on the curve
/// before the photons are made ready, the kd-tree's entries after that.
pub fn built_bytes(parts: MapParts) -> usize {
    if parts.kd_tree { kd_tree::BYTES_PER_BUILT_ENTRY } else { overlap::BYTES_PER_BUILT_ENTRY }
}

impl PhotonMap {
    /// Prepares photons; the same photons give the same map.
    pub fn new<P: Footprinted>(photons: &[P], limits: FootprintLimits, parts: MapParts) -> Self {
        let FootprintLimits { scale, floor, ceiling } = limits;
        let count = photons.len();
        // In the order of the overlap structure, so that those that are gathered together lie together.
        let order = parts.overlap.then(|| {
            let size = |p: &P| (p.size() * scale).max(floor).min(ceiling);
            packing_order(photons, |p| (p.position(), size(p)))
        });
        let (floored, capped) = (AtomicU64::new(0), AtomicU64::new(0));
        // A group that is not full has its last photon more than once.
        let place = |group: usize, lane: usize| {
            let i = (group * LANES + lane).min(count - 1);
            order.as_ref().map_or(i, |order| order[i] as usize)
        };
        let group = |group: usize| {
            // They lie anywhere in memory: what the next group needs is asked for while this one is made.
            for lane in 0..LANES {
                let next = place(group + 1, lane);
                prefetch_index(photons, next);
                // Its end lies before the start of the one behind it.
                prefetch_index(photons, next + 1);
            }
            let stored: [P; LANES] = std::array::from_fn(|lane| photons[place(group, lane)]);
            let mut ready = [MapPhoton::NONE; LANES];
            let mut boxes = [(Vec3::ZERO, Vec3::ZERO); LANES];
            let mut bounded = (0, 0);
            let own = LANES.min(count - group * LANES);
            let [a, b, normals, directions] = P::group(&stored);
            let transforms = FilterTransform::of_group(&[a, b, normals], scale, floor, ceiling);
            for (lane, p) in stored[..own].iter().enumerate() {
                let t = transforms.at(lane);
                bounded = (bounded.0 + u64::from(t.floored), bounded.1 + u64::from(t.capped));
                ready[lane] = MapPhoton {
                    position: p.position(),
                    inverse_reach: 1.0 / t.reach,
                    rows: [t.rows[0], t.rows[1]],
                    normal: vector(&normals, lane),
                    direction: vector(&directions, lane),
                    power: p.power(),
                    inverse_area: t.inverse_area,
                    turn: t.turn,
                };
                boxes[lane] = (p.position(), t.half_extent);
            }
            // Sums of whole numbers do not depend on the order; most groups have none.
            for (sum, own) in [(&floored, bounded.0), (&capped, bounded.1)] {
                if own > 0 {
                    sum.fetch_add(own, Ordering::Relaxed);
                }
            }
            (ready, Block::of(boxes.into_iter().take(own)))
        };
        let groups = (0..count.div_ceil(LANES)).into_par_iter();
        let mut ready: Vec<[MapPhoton; LANES]> = Vec::new();
        let overlap = match &order {
            Some(_) => {
                let mut blocks = OverlapTree::room(count);
                groups.map(group).unzip_into_vecs(&mut ready, &mut blocks);
                Some(blocks)
            }
            None => {
                groups.map(|g| group(g).0).collect_into_vec(&mut ready);
                None
            }
        };
        let overlap = order.zip(overlap).map(|(order, blocks)| OverlapTree::over(order, blocks));
        let mut ready = ready.into_flattened();
        ready.truncate(count);
        let kd_tree = parts
            .kd_tree
            .then(|| KdTree::of(ready.par_iter().zip(0..count as u32).map(|(p, i)| (p.position, i)).collect()));
        // Not less than any, although inverses are rounded.
        let least = ready.par_iter().map(|p| p.inverse_reach).reduce(|| f32::INFINITY, f32::min);
        let longest_reach = if count > 0 { (1.0 + 2.0 * f32::EPSILON) / least } else { 0.0 };
        let (floored, capped) = (floored.into_inner(), capped.into_inner());
        Self { photons: ready, kd_tree, overlap, longest_reach, floored, capped }
    }

    /// The photons, in the map's order.
    pub fn photons(&self) -> &[MapPhoton] {
        &self.photons
    }

    /// Index among the photons that the map was made of, of the photon at `index` of [`PhotonMap::photons`].
    pub fn stored_index(&self, index: u32) -> Option<u32> {
        match &self.overlap {
            Some(tree) => tree.order().get(index as usize).copied(),
            None => ((index as usize) < self.photons.len()).then_some(index),
        }
    }

    /// Footprints raised to the floor and lowered to the ceiling.
    pub fn limited(&self) -> (u64, u64) {
        (self.floored, self.capped)
    }

    /// Appends to `out` the `k` photons nearest to the query's centre whose ball can reach its footprint:
    /// the radii of both add up before they are squared.
    ///
    /// Nothing is found in a map without kd-tree.
    pub fn nearest(&self, query: &Query, k: usize, heap: &mut Nearest, out: &mut Vec<u32>) {
        let [a, b] = query.axes;
        let view_radius = (a + b).length().max((a - b).length());
        // A photon farther than its reach from the view plane has no weight on it: the slice is exact.
        self.nearest_in(query, k, view_radius + self.longest_reach, self.longest_reach, heap);
        out.extend(heap.iter().map(|(_, i)| i));
    }

    /// Leaves in `heap` the `k` photons nearest to the query's centre, however far, for density estimation.
    pub fn nearest_anywhere(&self, query: &Query, k: usize, heap: &mut Nearest) {
        self.nearest_in(query, k, f32::INFINITY, f32::INFINITY, heap);
    }

    fn nearest_in(&self, query: &Query, k: usize, radius: f32, slice: f32, heap: &mut Nearest) {
        heap.clear();
        let Some(tree) = &self.kd_tree else { return };
        let nearest = NearestQuery { center: query.center, radius, k, normal: query.normal, slice };
        tree.nearest(&nearest, heap, |i| self.photons[i as usize].lights(query.normal));
    }

    /// Does several of the look-ups below at once, for points: neighbours, numbered from `first`. They find the same.
    pub fn points_together(&self, first: usize, queries: impl Iterator<Item = Query>, together: &mut Together) {
        if let Some(tree) = &self.overlap {
            let points = queries.map(|query| (query, (query.center, Vec3::ZERO)));
            together.find::<true>(&self.photons, tree, first, points);
        }
    }

    /// The same for parallelograms.
    pub fn parallelograms_together(&self, first: usize, queries: impl Iterator<Item = Query>, together: &mut Together) {
        if let Some(tree) = &self.overlap {
            together.find::<false>(&self.photons, tree, first, queries.map(|query| (query, bounds(query))));
        }
    }

    /// Appends to `out` exactly the photons whose ellipsoid meets the query's point, in the map's order.
    ///
    /// Nothing is found in a map without footprint hierarchy.
    pub fn overlapping_point(&self, query: &Query, out: &mut Vec<u32>) {
        let Some(tree) = &self.overlap else { return };
        tree.in_box(query.center, Vec3::ZERO, |i| {
            let p = &self.photons[i as usize];
            if p.to_filter(query.center - p.position).length_squared() < 1.0 && p.lights(query.normal) {
                out.push(i);
            }
        });
    }

    /// Appends to `out` exactly the photons whose ellipsoid meets the query's parallelogram, in the map's order.
    ///
    /// Nothing is found in a map without footprint hierarchy.
    pub fn overlapping_parallelogram(&self, query: &Query, out: &mut Vec<u32>) {
        let Some(tree) = &self.overlap else { return };
        let (center, half) = bounds(*query);
        tree.in_box(center, half, |i| {
            let p = &self.photons[i as usize];
            if p.lights(query.normal) && meets_unit_ball(p, query) {
                out.push(i);
            }
        });
    }
}

/// Centre and half-size of the box around a query.
fn bounds(query: Query) -> (Vec3, Vec3) {
    let [a, b] = query.axes;
    (query.center, a.abs() + b.abs())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::frame::{tangents, uniform_sphere};
    use crate::math::sequence::{Sampling, Sequence};
    use crate::photons::Photon;

    const LIMITS: FootprintLimits = FootprintLimits { scale: 1.0, floor: 1e-6, ceiling: 10.0 };

    fn random_photons(n: u64) -> Vec<Photon> {
        let sequence = Sequence::new(Sampling::Random, 8);
        (0..n)
            .map(|i| {
                let (x, y, z) = (sequence.four(i, 0), sequence.four(i, 1), sequence.four(i, 2));
                let normal = if i % 3 == 0 { Vec3::Y } else { uniform_sphere(y[0], y[1]).normalize() };
                let (t, b) = tangents(normal);
                let size = 0.3 * y[2] * y[2];
                Photon {
                    position: Vec3::new(x[0], x[1] * 0.2, x[2]),
                    direction: -normal,
                    normal,
                    power: Rgb::ONE,
                    footprint: [t * size + b * (size * z[0]), b * (size * z[1]) - t * (size * z[2])],
                }
            })
            .collect()
    }

    fn queries(n: u64) -> impl Iterator<Item = Query> {
        let sequence = Sequence::new(Sampling::Random, 9);
        (0..n).map(move |i| {
            let (x, y) = (sequence.four(i, 0), sequence.four(i, 1));
            let normal = if i % 2 == 0 { Vec3::Y } else { uniform_sphere(y[0], y[1]).normalize() };
            let (t, b) = tangents(normal);
            let size = 0.2 * y[2];
            Query {
                center: Vec3::new(x[0], x[1] * 0.2, x[2]),
                normal,
                axes: [t * size, (b + t * y[3]) * (size * x[3])],
            }
        })
    }

    /// The overlap structure returns exactly what brute force over all photons returns.
    #[test]
    fn overlap_is_exact() {
        let photons = random_photons(700);
        let map = PhotonMap::new(&photons, LIMITS, MapParts { kd_tree: false, overlap: true });
        let mut found = Vec::new();
        let mut total = 0;
        for q in queries(300) {
            for point in [true, false] {
                let q = if point { Query { axes: [Vec3::ZERO; 2], ..q } } else { q };
                found.clear();
                if point {
                    map.overlapping_point(&q, &mut found);
                } else {
                    map.overlapping_parallelogram(&q, &mut found);
                }
                found.sort_unstable();
                // A fine grid over the parallelogram in f64, away from the boundary by the grid's own spacing.
                let brute: Vec<(u32, f64)> = map
                    .photons()
                    .iter()
                    .zip(0u32..)
                    .filter(|(p, _)| p.lights(q.normal))
                    .map(|(p, i)| {
                        let n = if point { 0 } else { 60 };
                        let mut least = f64::INFINITY;
                        for s in 0..=n {
                            for t in 0..=n {
                                let at = |k: i32| if n == 0 { 0.0 } else { f64::from(k) / f64::from(n) * 2.0 - 1.0 };
                                let x =
                                    q.center.as_dvec3() + q.axes[0].as_dvec3() * at(s) + q.axes[1].as_dvec3() * at(t)
                                        - p.position.as_dvec3();
                                let f = [p.rows[0], p.rows[1], p.normal * p.inverse_reach].map(|r| r.as_dvec3().dot(x));
                                least = least.min(f[0] * f[0] + f[1] * f[1] + f[2] * f[2]);
                            }
                        }
                        (i, least)
                    })
                    .collect();
                for (i, d2) in brute {
                    let inside = found.binary_search(&i).is_ok();
                    if d2 < 0.9999 {
                        assert!(inside, "photon {i} at {d2} missed");
                    }
                    let step = if point {
                        0.0
                    } else {
                        let p = &map.photons()[i as usize];
                        q.axes.iter().map(|a| f64::from(p.to_filter(*a).length()) / 60.0).sum()
                    };
                    if d2.sqrt() > 1.0001 + step {
                        assert!(!inside, "photon {i} at {d2} should not be there");
                    }
                    total += usize::from(inside);
                }
            }
        }
        assert!(total > 2000, "{total}");
    }

    /// With k above the map's size `knn` finds every photon that overlaps.
    #[test]
    fn nearest_with_a_large_k_contains_the_overlap() {
        let photons = random_photons(500);
        let map = PhotonMap::new(&photons, LIMITS, MapParts { kd_tree: true, overlap: true });
        let mut heap = Nearest::new();
        for q in queries(200) {
            let (mut by_k, mut by_overlap) = (Vec::new(), Vec::new());
            map.nearest(&q, 10_000, &mut heap, &mut by_k);
            map.overlapping_parallelogram(&q, &mut by_overlap);
            by_k.sort_unstable();
            for i in by_overlap {
                assert!(by_k.binary_search(&i).is_ok());
            }
        }
    }

    /// A map's photons give back the footprints that they were made of, also when they are skew.
    #[test]
    fn axes_and_order_come_back() {
        let photons = random_photons(300);
        for overlap in [false, true] {
            let map = PhotonMap::new(&photons, LIMITS, MapParts { kd_tree: true, overlap });
            for (i, p) in map.photons().iter().enumerate() {
                let stored = &photons[map.stored_index(i as u32).expect("an index") as usize];
                assert_eq!(p.position, stored.position);
                let t = FilterTransform::new(stored.footprint, stored.normal, 1.0, LIMITS.floor, LIMITS.ceiling);
                if !t.floored {
                    let given = stored.footprint.map(|c| c - stored.normal * stored.normal.dot(c));
                    for (axis, given) in p.axes().into_iter().zip(given) {
                        assert!((axis - given).length() < 2e-6 * p.reach(), "{axis} {given}");
                    }
                }
                let [a, b] = p.axes();
                let area = std::f32::consts::PI * a.cross(b).length();
                assert!((area / p.area() - 1.0).abs() < 1e-5 * p.condition() as f32);
            }
            assert_eq!(map.stored_index(300), None);
        }
    }

    #[test]
    fn empty_and_single_maps_work() {
        for n in [0, 1, 2] {
            let map = PhotonMap::new(&random_photons(n), LIMITS, MapParts { kd_tree: true, overlap: true });
            let mut heap = Nearest::new();
            for q in queries(20) {
                let mut out = Vec::new();
                map.nearest(&q, 5, &mut heap, &mut out);
                map.overlapping_point(&q, &mut out);
                map.overlapping_parallelogram(&q, &mut out);
                assert!(out.iter().all(|&i| u64::from(i) < n));
            }
        }
    }
}
