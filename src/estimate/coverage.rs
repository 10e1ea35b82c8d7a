//! The part of a view footprint that a photon's parallelogram covers, and the kernel at its centroid.
//!
//! A loop around the view footprint whose points are moved to the nearest of the photon's square `[-1, 1]²` winds around
//! the same part of the square as before. So area and first moments of what both have in common are sums over four
//! edges (Green's theorem), without a branch and without a list of vertices: many pairs are computed at once in lanes, as
//! long as nothing on the way is a closure or a `map` of an array, which may stay functions of their own.
//! Every term is a continuous function of the vertices, so that edges that touch or coincide need no case of their own.

use super::View;
use crate::estimate::batch::{self, BATCH, Vectors};
use crate::estimate::parallelogram::within;
use crate::math::eights::{Group, LANES, vector};
use crate::photons::MapPhoton;
use glam::{DVec2, DVec3};
use pulp::{Arch, Simd, WithSimd};

/// Cosine below which a photon's plane seen along the ray has no area that f32 could tell.
const EDGE_ON: f64 = 1e-12;
/// Width over length below which a view footprint is left to the polygon, which needs no width.
const NARROW: f64 = 1e-6;
/// What stands for the kernel of a view footprint that is [`NARROW`].
const UNKNOWN: f64 = -1.0;

/// A photon and a view footprint.
pub(super) struct Pair {
    /// First two rows of the photon's filter transform, 1/metre, as [`MapPhoton`] has what follows too.
    rows: [DVec3; 2],
    /// Unit normal of the photon's surface.
    normal: DVec3,
    /// Inverse of the photon's longest semi-axis, 1/metre.
    inverse_reach: f64,
    /// Cosine and sine of the turn from filter coordinates to those in `dα` and `dβ`.
    turn: DVec2,
    /// From the photon to the centre of the view footprint, and its half-edges, metres.
    corners: [DVec3; 3],
    /// Unit direction of the view ray.
    direction: DVec3,
}

/// Centre and half-edges of a view footprint as a photon sees them.
struct Seen {
    /// In its filter space, unprojected; the third coordinate along its normal, metres.
    filter: [(DVec2, f64); 3],
    /// In its footprint, along the view ray.
    own: [DVec2; 3],
    /// Whether the ray meets the photon's plane.
    meets: bool,
}

impl Pair {
    #[inline]
    pub fn new(photon: &MapPhoton, view: &View) -> Self {
        let [a, b] = view.query.axes;
        Self {
            rows: photon.rows.map(|r| r.as_dvec3()),
            normal: photon.normal.as_dvec3(),
            inverse_reach: f64::from(photon.inverse_reach),
            turn: photon.turn.as_dvec2(),
            corners: [view.query.center - photon.position, a, b].map(|v| v.as_dvec3()),
            direction: view.direction.as_dvec3(),
        }
    }

    /// As [`Pairs`] keep it.
    #[inline(always)]
    fn of_lane(group: &Group<VECTORS>, lane: usize) -> Self {
        let [x, y, normal, turn, c, a, b, direction] = group;
        let turn = vector(turn, lane).as_dvec3();
        Self {
            rows: [vector(x, lane).as_dvec3(), vector(y, lane).as_dvec3()],
            normal: vector(normal, lane).as_dvec3(),
            inverse_reach: turn.z,
            turn: turn.truncate(),
            corners: [vector(c, lane).as_dvec3(), vector(a, lane).as_dvec3(), vector(b, lane).as_dvec3()],
            direction: vector(direction, lane).as_dvec3(),
        }
    }

    // In f64: along a grazing ray the projection divides by next to nothing.
    #[inline(always)]
    fn seen(&self) -> Seen {
        let (ray, across) = self.along(self.direction);
        let slope = ray * (1.0 / across);
        let [c, a, b] = self.corners;
        let filter = [self.along(c), self.along(a), self.along(b)];
        let own = [self.own(filter[0], slope), self.own(filter[1], slope), self.own(filter[2], slope)];
        Seen { filter, own, meets: across.abs() >= EDGE_ON }
    }

    /// A vector in the photon's filter space, its third coordinate along the normal in metres.
    #[inline(always)]
    fn along(&self, v: DVec3) -> (DVec2, f64) {
        (DVec2::new(self.rows[0].dot(v), self.rows[1].dot(v)), self.normal.dot(v))
    }

    /// The same moved into the photon's plane, in its footprint.
    #[inline(always)]
    fn own(&self, (flat, height): (DVec2, f64), slope: DVec2) -> DVec2 {
        self.turn.rotate(flat - slope * height)
    }

    /// Centre and half-edges of the view footprint in the photon's footprint, along the view ray; None if it is far off.
    #[inline]
    pub fn projected(&self) -> Option<[DVec2; 3]> {
        let seen = self.seen();
        let [p, a, b] = seen.own;
        let reach = a.abs() + b.abs();
        (seen.meets && p.x.abs() - reach.x < 1.0 && p.y.abs() - reach.y < 1.0).then_some(seen.own)
    }

    /// `(1 - u)²` of the point of the view footprint with those parameters, in `[0, 1]`.
    #[inline(always)]
    pub fn kernel_at(&self, parameter: DVec2) -> f64 {
        let Seen { filter, .. } = self.seen();
        self.kernel(&filter, parameter)
    }

    #[inline(always)]
    fn kernel(&self, [(c, h), (a, i), (b, k)]: &[(DVec2, f64); 3], parameter: DVec2) -> f64 {
        let flat = *c + *a * parameter.x + *b * parameter.y;
        let height = (h + i * parameter.x + k * parameter.y) * self.inverse_reach;
        let left = 1.0 - flat.length_squared() - height * height;
        let left = if left > 0.0 { left } else { 0.0 };
        left * left
    }

    /// Share of the view footprint that the photon's parallelogram covers, times `(1 - u)²` at the centroid of that part
    /// (Pedersen 2011, eq. 63 to 67), in `[0, 1]`; or [`UNKNOWN`].
    #[inline(always)]
    fn covered_kernel(&self) -> f64 {
        let seen = self.seen();
        let (coverage, parameter) = coverage_and_centroid(&seen.own);
        let kernel = coverage * self.kernel(&seen.filter, parameter);
        let kernel = if coverage < 0.0 { UNKNOWN } else { within(kernel, 0.0, 1.0) };
        if seen.meets { kernel } else { 0.0 }
    }

    /// The same, if necessary by `polygon`, which gives share and centroid of a view footprint in the photon's.
    #[inline]
    pub fn weighed(&self, polygon: impl Fn([DVec2; 3]) -> (f64, DVec2)) -> f64 {
        self.or_polygon(self.covered_kernel(), polygon)
    }

    fn or_polygon(&self, kernel: f64, polygon: impl Fn([DVec2; 3]) -> (f64, DVec2)) -> f64 {
        if kernel >= 0.0 {
            return kernel;
        }
        let Some(projected) = self.projected() else { return 0.0 };
        let (coverage, centroid) = polygon(projected);
        if coverage > 0.0 { coverage * self.kernel_at(centroid) } else { 0.0 }
    }
}

/// Share of a view footprint, given by centre and half-edges, that lies in the square `[-1, 1]²`, and the centroid of that
/// part in the view footprint's parameters; [`UNKNOWN`] for a share if it is narrow and not all inside.
#[inline(always)]
fn coverage_and_centroid([p, a, b]: &[DVec2; 3]) -> (f64, DVec2) {
    let (p, a, b) = (*p, *a, *b);
    let reach = a.abs() + b.abs();
    let is_whole = (p.x.abs() + reach.x <= 1.0) & (p.y.abs() + reach.y <= 1.0);
    let doubled = a.perp_dot(b);
    let is_narrow = doubled.abs() <= NARROW * ((a.x.abs() + a.y.abs()) * (b.x.abs() + b.y.abs()));
    // About the point of the square that is nearest to the centre no number is larger than what it stands for.
    let origin = DVec2::new(within(p.x, -1.0, 1.0), within(p.y, -1.0, 1.0));
    let window = Window { low: DVec2::NEG_ONE - origin, high: DVec2::ONE - origin };
    let c = p - origin;
    let (per_a, per_b) = (DVec2::ONE / a, DVec2::ONE / b);
    let sum = Moments::default()
        .add(&window, c - b, a, per_a)
        .add(&window, c + a, b, per_b)
        .add(&window, c + b, -a, -per_a)
        .add(&window, c - a, -b, -per_b);
    let share = sum.area / (4.0 * doubled);
    let centroid = sum.moment * (1.0 / sum.area) - c;
    let inverse = 1.0 / doubled;
    let s = within(centroid.perp_dot(b) * inverse, -1.0, 1.0);
    let t = within(a.perp_dot(centroid) * inverse, -1.0, 1.0);
    let share = within(share, 0.0, 1.0);
    let share = if is_narrow { UNKNOWN } else { share };
    if is_whole { (1.0, DVec2::ZERO) } else { (share, DVec2::new(s, t)) }
}

/// The photon's square about another origin.
struct Window {
    low: DVec2,
    high: DVec2,
}

/// What edges add up to: `∮ x dy`, and `∮ x (x/2, y) dy`.
#[derive(Default)]
struct Moments {
    area: f64,
    moment: DVec2,
}

impl Moments {
    /// Adds the edge `m + u e`, `-1 ≤ u ≤ 1`, moved into the window. `per_e` is one over `e`.
    #[inline(always)]
    fn add(self, window: &Window, m: DVec2, e: DVec2, per_e: DVec2) -> Self {
        let Window { low, high } = window;
        // The heights change between these, and on the way there from `enters` to `leaves` the widths do.
        let (from, to) = between((low.y - m.y) * per_e.y, (high.y - m.y) * per_e.y, -1.0, 1.0);
        let (enters, leaves) = between((low.x - m.x) * per_e.x, (high.x - m.x) * per_e.x, from, to);
        let x0 = within(m.x + e.x * enters, low.x, high.x);
        let x1 = within(m.x + e.x * leaves, low.x, high.x);
        let y0 = within(m.y + e.y * enters, low.y, high.y);
        let y1 = within(m.y + e.y * leaves, low.y, high.y);
        let first = within(m.y + e.y * from, low.y, high.y);
        let last = within(m.y + e.y * to, low.y, high.y);
        let (before, along, after) = (y0 - first, y1 - y0, last - y1);
        let area = x0 * before + (x0 + x1) * (0.5 * along) + x1 * after;
        let wide = x0 * x0 * before + (x0 * x0 + x0 * x1 + x1 * x1) * (along * (1.0 / 3.0)) + x1 * x1 * after;
        let sloped = ((x0 + x1) * (y0 + y1) + x0 * y0 + x1 * y1) * (along * (1.0 / 3.0));
        let high = x0 * (before * (y0 + first)) + sloped + x1 * (after * (y1 + last));
        Self { area: self.area + area, moment: self.moment + DVec2::new(wide, high) * 0.5 }
    }
}

/// Two numbers in order, kept between two others.
#[inline(always)]
fn between(a: f64, b: f64, low: f64, high: f64) -> (f64, f64) {
    let (less, more) = (if a < b { a } else { b }, if a > b { a } else { b });
    (within(less, low, high), within(more, low, high))
}

/// Vectors of a [`Pair`].
const VECTORS: usize = 8;

/// Pairs by their vectors.
#[derive(Default)]
pub(super) struct Pairs(Vectors<VECTORS>);

impl batch::Pairs for Pairs {
    fn len(&self) -> usize {
        self.0.len()
    }

    #[inline(always)]
    fn push(&mut self, photon: &MapPhoton, view: &View) {
        let [a, b] = view.query.axes;
        self.0.push([
            photon.rows[0],
            photon.rows[1],
            photon.normal,
            photon.turn.extend(photon.inverse_reach),
            view.query.center - photon.position,
            a,
            b,
            view.direction,
        ]);
    }

    fn clear(&mut self) {
        self.0.clear();
    }
}

impl Pairs {
    /// [`Pair::weighed`] of each, to the bit.
    pub fn weighed(&self, kernels: &mut [f64; BATCH], polygon: impl Fn([DVec2; 3]) -> (f64, DVec2)) {
        Arch::new().dispatch(Weighed { pairs: self, kernels });
        for (i, kernel) in kernels.iter_mut().enumerate().take(self.0.len()) {
            if *kernel < 0.0 {
                let group = &self.0.groups()[i / LANES];
                *kernel = Pair::of_lane(group, i % LANES).or_polygon(*kernel, &polygon);
            }
        }
    }
}

/// A batch as one function, compiled for each set of instructions; all round alike.
struct Weighed<'a> {
    pairs: &'a Pairs,
    kernels: &'a mut [f64; BATCH],
}

impl WithSimd for Weighed<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<I: Simd>(self, _: I) {
        for (kernels, group) in self.kernels.as_chunks_mut::<LANES>().0.iter_mut().zip(self.pairs.0.groups()) {
            let mut own = [0.0; LANES];
            for (lane, own) in own.iter_mut().enumerate() {
                *own = Pair::of_lane(group, lane).covered_kernel();
            }
            *kernels = own;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::estimate::clip::{self, ClippedPolygon, SQUARE_VERTICES};
    use crate::math::sequence::{Sampling, Sequence};
    use batch::Pairs as _;
    use glam::{Vec2, Vec3};
    use std::f64::consts::TAU;

    fn clipped([p, a, b]: [DVec2; 3]) -> (f64, DVec2) {
        let mut polygon = ClippedPolygon::<SQUARE_VERTICES>::whole(p, a, b);
        clip::square().iter().for_each(|plane| polygon.clip(plane));
        polygon.coverage_and_centroid()
    }

    /// Against the clipped polygon: of any size, turned to any side, along the square's edges, on them and next to them.
    #[test]
    fn part_and_centroid_are_those_of_the_clipped_polygon() {
        let sequence = Sequence::new(Sampling::Random, 21);
        let (mut whole, mut parts, mut none, mut narrow) = (0, 0, 0, 0);
        for i in 0..200_000u64 {
            let x = sequence.four(i, 0).map(f64::from);
            let y = sequence.four(i, 1).map(f64::from);
            let size = |x: f64| 10f64.powf(8.0 * x - 5.0);
            let mut a = DVec2::from_angle(x[0] * TAU) * size(x[1]);
            let mut b = DVec2::from_angle(x[2] * TAU) * size(x[3]);
            let reach = DVec2::ONE + a.abs() + b.abs();
            let mut p = reach * (DVec2::new(y[0], y[1]) * 2.4 - 1.2);
            // Edges along those of the square, which may lie on them or a hair beside.
            if i % 4 > 0 {
                (a, b) = (DVec2::X * size(x[1]), DVec2::Y * size(x[3]));
                let hair = [0.0, 1e-15, -1e-15, 1e-9][i as usize / 4 % 4];
                p.x = (1.0 + hair) * 1f64.copysign(y[2] - 0.5) + a.x * (2.0 * y[3] - 1.0).signum();
            }
            if i % 4 == 2 {
                (a, b) = (b, -a);
            }
            if i % 4 == 3 {
                b += a * (4.0 * x[0] - 2.0);
            }
            let (coverage, centroid) = coverage_and_centroid(&[p, a, b]);
            let (expected, middle) = clipped([p, a, b]);
            if coverage == UNKNOWN {
                assert!(a.perp_dot(b).abs() < 2.1e-6 * a.length() * b.length());
                narrow += 1;
                continue;
            }
            // What the vertices are rounded by, over the width.
            let (long, short) = (a.length().max(b.length()), a.perp_dot(b).abs() / a.length().max(b.length()));
            let slack = 1e-14 * (1.0 + long) / short.min(1.0);
            assert!((coverage - expected).abs() < slack + 1e-12, "{p} {a} {b}: {coverage} {expected}");
            if expected > 1e-3 && slack < 1e-6 {
                let d = centroid - middle;
                let off = (a * d.x + b * d.y).length();
                assert!(off < 1e-9 + slack / expected, "{p} {a} {b}: {centroid} {middle}");
            }
            match expected {
                1.0 => whole += 1,
                0.0 => none += 1,
                _ => parts += 1,
            }
        }
        assert!(whole > 10_000 && none > 10_000 && parts > 30_000 && narrow > 100, "{whole} {none} {parts} {narrow}");
    }

    #[test]
    fn equal_parallelograms_cover_each_other() {
        for a in [DVec2::X, DVec2::Y, DVec2::NEG_X, DVec2::NEG_Y] {
            for b in [a.perp(), -a.perp()] {
                let (coverage, centroid) = coverage_and_centroid(&[DVec2::ZERO, a, b]);
                assert_eq!((coverage, centroid.abs()), (1.0, DVec2::ZERO));
                let (half, centroid) = coverage_and_centroid(&[a, a, b]);
                assert!((half - 0.5).abs() < 1e-15 && (centroid - DVec2::new(-0.5, 0.0)).length() < 1e-15);
            }
        }
    }

    /// Many at once are each alone, to the bit, and finite: narrow ones, rays along the photon's plane, groups that are not
    /// full.
    #[test]
    fn lanes_are_each_alone() {
        let sequence = Sequence::new(Sampling::Random, 22);
        let (mut pairs, mut kernels) = (Pairs::default(), [0.0; BATCH]);
        let (mut unknown, mut some) = (0, 0);
        for group in 0..3000u64 {
            pairs.clear();
            let own: Vec<Pair> = (0..group % (BATCH as u64 + 1))
                .map(|i| {
                    let v = |set| Vec3::from_slice(&sequence.four(group * 64 + i, set)[..3]) * 2.0 - 1.0;
                    let scale = sequence.four(group * 64 + i, 6).map(|x| 10f32.powf(4.0 * x - 3.0));
                    let normal = if i % 5 == 0 { Vec3::Y } else { v(0).normalize() };
                    let along = normal.any_orthonormal_vector();
                    let photon = MapPhoton {
                        position: v(1),
                        rows: [along, normal.cross(along) * (1.0 + scale[0])],
                        normal,
                        inverse_reach: 1.0,
                        turn: Vec2::from_angle(scale[1]),
                        ..MapPhoton::NONE
                    };
                    let a = v(2) * scale[2];
                    let b = match i % 7 {
                        0 => a * 0.3,
                        1 => Vec3::ZERO,
                        2 => Vec3::splat(1e30),
                        _ => v(3) * scale[3],
                    };
                    let query = crate::photons::map::Query { center: v(4), normal, axes: [a, b] };
                    let direction = if i % 11 == 0 { along } else { v(5).normalize() };
                    let view = View { query, direction };
                    pairs.push(&photon, &view);
                    Pair::new(&photon, &view)
                })
                .collect();
            assert_eq!(pairs.len(), own.len());
            pairs.weighed(&mut kernels, clipped);
            for (pair, kernel) in own.iter().zip(kernels) {
                let alone = pair.weighed(clipped);
                unknown += u32::from(pair.covered_kernel() < 0.0);
                some += u32::from(kernel > 0.0);
                assert_eq!(kernel.to_bits(), alone.to_bits());
                assert!((0.0..=1.0).contains(&kernel));
            }
        }
        assert!(unknown > 1000 && some > 1000, "{unknown} {some}");
    }
}
