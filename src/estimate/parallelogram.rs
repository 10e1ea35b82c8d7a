//! The mean of the Silverman kernel over a parallelogram in closed form.
//!
//! As an integral over a polygon, but for four edges that come in pairs; and without a branch, so that many parallelograms
//! are integrated at once in lanes. Whatever a case needs is computed for all, and what does not hold is not taken. The
//! compiler makes lanes of it only where all ends up in one function: nothing on the way is a closure or a `map` of an array,
//! which may stay functions of their own.

use crate::estimate::batch::{BATCH, Parallelograms};
use crate::estimate::polygon::{GAUSS, SHORT, THIN};
use crate::math::angle::angle;
use crate::math::eights::{LANES, vector};
use glam::{DVec2, DVec3, Vec3};
use pulp::{Arch, Simd, WithSimd};
use std::f64::consts::{PI, TAU};

/// Mean of `(1 - u)²` over a view footprint that lies anywhere in the photon's filter space, in closed form.
///
/// The limit N → ∞ of Pedersen 2011, eq. 71, over three.
///
/// * `c`, `a`, `b`: centre and half-edges of the parallelogram in filter space (the photon is the unit ball; no unit).
///
/// Returns a value in `[0, 1]`. One axis vanishing, or parallel axes, give the mean over the segment, both the kernel
/// at `c`.
pub fn mean_over_parallelogram(c: Vec3, a: Vec3, b: Vec3) -> f64 {
    let [c, a, b] = [c, a, b].map(|v| v.as_dvec3());
    with_width(mean(c, a, b), c, a, b)
}

/// [`mean_over_parallelogram`] of each, to the bit.
pub(super) fn means_over_parallelograms(of: &Parallelograms, means: &mut [f64; BATCH]) {
    Arch::new().dispatch(Means { of, means });
    for (i, m) in means.iter_mut().enumerate().take(of.len()) {
        if *m < 0.0 {
            let [c, a, b] = of.at(i).map(|v| v.as_dvec3());
            *m = with_width(*m, c, a, b);
        }
    }
}

struct Means<'a> {
    of: &'a Parallelograms,
    means: &'a mut [f64; BATCH],
}

impl WithSimd for Means<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<I: Simd>(self, _: I) {
        for (means, [c, a, b]) in self.means.as_chunks_mut::<LANES>().0.iter_mut().zip(self.of.groups()) {
            let mut own = [0.0; LANES];
            for (lane, own) in own.iter_mut().enumerate() {
                let [c, a, b] = [vector(c, lane), vector(a, lane), vector(b, lane)];
                *own = mean(c.as_dvec3(), a.as_dvec3(), b.as_dvec3());
            }
            *means = own;
        }
    }
}

/// What [`mean`] gives for a parallelogram of no width.
const EDGE_ON: f64 = -1.0;

/// A mean, or that of a parallelogram of no width where it is [`EDGE_ON`].
#[inline]
fn with_width(mean: f64, c: DVec3, a: DVec3, b: DVec3) -> f64 {
    if mean >= 0.0 {
        mean
    } else if a.length_squared() >= b.length_squared() {
        mean_seen_edge_on(c, a, b)
    } else {
        mean_seen_edge_on(c, b, a)
    }
}

/// The mean, in `[0, 1]`, or [`EDGE_ON`].
#[inline(always)]
fn mean(c: DVec3, a: DVec3, b: DVec3) -> f64 {
    let (aa, bb, cc) = (a.length_squared(), b.length_squared(), c.length_squared());
    let (ca, cb, ab) = (c.dot(a), c.dot(b), a.dot(b));
    let spread = 2.0 * (aa + bb);
    let gap = larger(cc - 1.0 - spread, 0.0);
    // |a| + |b| is at most √(2 (aa + bb)).
    let is_far = (cc > 1.0) & (gap * gap > 4.0 * spread);
    let farthest = cc + aa + bb + 2.0 * larger(ab + (ca + cb).abs(), (ca - cb).abs() - ab);
    let normal = a.cross(b);
    let area2 = normal.length_squared();
    let longest = larger(aa, bb);
    let is_thin = (area2 < THIN * THIN * longest) | (longest < SHORT * SHORT);
    let area = area2.sqrt();
    let normal = normal * (1.0 / area);
    let off = c.dot(normal);
    let rho2 = 1.0 - off * off;
    let frame = Frame { aa, bb, ab, ca, cb, area, cxa: c.cross(a).dot(normal), cxb: c.cross(b).dot(normal) };
    let across = within(frame.integral(cc - off * off, rho2) * (rho2 * rho2 * rho2) / (4.0 * area), 0.0, 1.0);
    // Each overrules those before it.
    let mean = if rho2 <= 0.0 { 0.0 } else { across };
    let mean = if is_thin { EDGE_ON } else { mean };
    let mean = if farthest <= 1.0 { mean_inside(cc, ca, cb, aa, bb, ab) } else { mean };
    if is_far { 0.0 } else { mean }
}

/// Of two numbers, as the processor's own instruction has it: the second if one is no number.
#[inline(always)]
fn larger(a: f64, b: f64) -> f64 {
    if a > b { a } else { b }
}

/// A number kept between two others; the lower of these if it is none.
#[inline(always)]
pub(super) fn within(x: f64, low: f64, high: f64) -> f64 {
    let x = if x > low { x } else { low };
    if x < high { x } else { high }
}

/// A parallelogram by the products of its centre `c` and half-edges `a`, `b` in its own plane.
struct Frame {
    aa: f64,
    bb: f64,
    ab: f64,
    ca: f64,
    cb: f64,
    /// `a × b`, positive.
    area: f64,
    /// `c × a`.
    cxa: f64,
    /// `c × b`.
    cxb: f64,
}

/// An edge `m + s e`, `-1 ≤ s ≤ 1`, as it lies to the disc.
struct Edge {
    /// `m × e`: its distance times its half-length, positive if the centre of the disc lies on the side of the polygon.
    cross: f64,
    /// `m · e`.
    dot: f64,
    /// `e · e`.
    ee: f64,
    /// 1 over that.
    per_ee: f64,
    /// Whether it starts inside the disc.
    from_inside: bool,
    /// Whether it ends there.
    to_inside: bool,
    /// `((m + s e) · a, a × (m + s e))`, its point at `s` turned by the same angle for all edges, at 0 and for each `s`.
    point: (DVec2, DVec2),
}

/// What edges add up to.
struct Sum {
    inner: f64,
    /// The angle of the circle's arcs inside the polygon, as a complex number.
    turn: DVec2,
}

impl Sum {
    /// Adds the inside part of an edge, and the points where it enters and leaves the disc.
    #[inline(always)]
    fn add(self, e: &Edge, rho2: f64, per_rho2: f64) -> Self {
        let height2 = e.cross * e.cross * e.per_ee;
        let nearest = -e.dot * e.per_ee;
        let half2 = (rho2 - height2) * e.per_ee;
        let is_outside = !e.from_inside & !e.to_inside & ((half2 <= 0.0) | (nearest.abs() >= 1.0));
        let half = larger(half2, 0.0).sqrt();
        let enters = within(nearest - half, -1.0, 1.0);
        let leaves = within(nearest + half, -1.0, 1.0);
        let from = if e.from_inside { -1.0 } else { enters };
        let to = if e.to_inside { 1.0 } else { leaves };
        let (middle, radius) = ((from + to) / 2.0 - nearest, (to - from) / 2.0);
        // ∫ 3 - 3u + u² with u = h + e x²: moments of x about 0 over [middle - radius, middle + radius].
        let (h, ee) = (height2 * per_rho2, e.ee * per_rho2);
        let (m2, r2) = (middle * middle, radius * radius);
        // A division costs as much as ten of these products.
        let second = ee * (m2 + r2 * (1.0 / 3.0));
        let fourth = ee * ee * (m2 * m2 + r2 * (2.0 * m2 + r2 * (1.0 / 5.0)));
        let mean = (3.0 - 3.0 * h + h * h) + (2.0 * h - 3.0) * second + fourth;
        let inner = self.inner + e.cross * (to - from) * mean;
        let (p, q) = e.point;
        let entered = self.turn.rotate(p + q * from);
        let turn = if e.from_inside { self.turn } else { entered };
        let end = p + q * to;
        let left = turn.rotate(DVec2::new(end.x, -end.y));
        let turn = if e.to_inside { turn } else { left };
        Self { inner: if is_outside { self.inner } else { inner }, turn: if is_outside { self.turn } else { turn } }
    }
}

/// Angles nearer to none or to a full turn than this are told apart by what lies inside the disc.
const CLOSE: f64 = 1e-9;
/// Integral along the edges below which nearly nothing of them lies inside: a polygon as wide as [`THIN`] that reaches
/// from the centre to the circle has more, chords that cut off an angle of [`CLOSE`] have less.
const HAIR: f64 = 1e-7;

impl Frame {
    /// Integral of `(1 - u)²` over the part inside the disc of squared radius `rho2`, in units of that disc.
    ///
    /// * `cc`: squared length of the centre.
    ///
    /// The outside parts add up to the arcs of the circle inside the polygon, whose angle lies in [0, 2π]; each run
    /// outside is known by the points where it leaves and enters the disc, which are multiplied as complex numbers.
    #[inline(always)]
    fn integral(&self, cc: f64, rho2: f64) -> f64 {
        let Self { aa, bb, ab, ca, cb, area, cxa, cxb } = *self;
        let [k, l, m, n] = [cxa + area, cxb + area, area - cxa, area - cxb];
        let (clear_k, clear_l) = (k * k >= rho2 * aa, l * l >= rho2 * bb);
        let (clear_m, clear_n) = (m * m >= rho2 * aa, n * n >= rho2 * bb);
        let is_apart = clear_k & (k < 0.0) | clear_l & (l < 0.0) | clear_m & (m < 0.0) | clear_n & (n < 0.0);
        let is_whole = clear_k & clear_l & clear_m & clear_n;
        let (per_aa, per_bb, per_rho2) = (1.0 / aa, 1.0 / bb, 1.0 / rho2);
        // Squared length of the vertices: c - a - b, c + a - b, c + a + b, c - a + b.
        let all = cc + aa + bb;
        let (sum, difference) = (2.0 * (ca + cb), 2.0 * (ca - cb));
        let in_0 = all + 2.0 * ab - sum < rho2;
        let in_1 = all - 2.0 * ab + difference < rho2;
        let in_2 = all + 2.0 * ab + sum < rho2;
        let in_3 = all - 2.0 * ab - difference < rho2;
        let edge_0 = Edge {
            cross: k,
            dot: ca - ab,
            ee: aa,
            per_ee: per_aa,
            from_inside: in_0,
            to_inside: in_1,
            point: (DVec2::new(ca - ab, -cxa - area), DVec2::new(aa, 0.0)),
        };
        let edge_1 = Edge {
            cross: l,
            dot: cb + ab,
            ee: bb,
            per_ee: per_bb,
            from_inside: in_1,
            to_inside: in_2,
            point: (DVec2::new(ca + aa, -cxa), DVec2::new(ab, area)),
        };
        let edge_2 = Edge {
            cross: m,
            dot: -(ca + ab),
            ee: aa,
            per_ee: per_aa,
            from_inside: in_2,
            to_inside: in_3,
            point: (DVec2::new(ca + ab, area - cxa), DVec2::new(-aa, 0.0)),
        };
        let edge_3 = Edge {
            cross: n,
            dot: ab - cb,
            ee: bb,
            per_ee: per_bb,
            from_inside: in_3,
            to_inside: in_0,
            point: (DVec2::new(ca - aa, -cxa), DVec2::new(-ab, -area)),
        };
        let sum = Sum { inner: 0.0, turn: DVec2::X }
            .add(&edge_0, rho2, per_rho2)
            .add(&edge_1, rho2, per_rho2)
            .add(&edge_2, rho2, per_rho2)
            .add(&edge_3, rho2, per_rho2);
        let inner = sum.inner * per_rho2 * (1.0 / 6.0);
        let arcs = angle(sum.turn);
        // Either the polygon leaves out a hair of the circle, and nearly nothing of its edges lies inside; or it reaches
        // out of the disc by a hair.
        let least = larger(larger(-k, -l), larger(-m, -n));
        let holds = (least <= 0.0) & (inner < HAIR);
        let (short, long) = (larger(arcs, 0.0), TAU + if arcs < 0.0 { arcs } else { 0.0 });
        let hair = if holds { long } else { short };
        let turned = if arcs < 0.0 { arcs + TAU } else { arcs };
        let arcs = if arcs.abs() <= CLOSE { hair } else { turned };
        let integral = within(inner + arcs * (1.0 / 6.0), 0.0, PI / 3.0);
        let integral = if is_whole { PI / 3.0 } else { integral };
        if is_apart { 0.0 } else { integral }
    }
}

/// The mean where the whole parallelogram lies inside the ball: a polynomial in the dot products.
#[inline(always)]
fn mean_inside(cc: f64, ca: f64, cb: f64, aa: f64, bb: f64, ab: f64) -> f64 {
    let first = cc + (aa + bb) * (1.0 / 3.0);
    let second = cc * cc
        + (4.0 * (ca * ca + cb * cb) + 2.0 * cc * (aa + bb)) * (1.0 / 3.0)
        + (aa * aa + bb * bb) * (1.0 / 5.0)
        + (4.0 * ab * ab + 2.0 * aa * bb) * (1.0 / 9.0);
    within(1.0 - 2.0 * first + second, 0.0, 1.0)
}

/// The mean over a parallelogram of no width, `a` its longer half-edge: over a segment, or at a point.
fn mean_seen_edge_on(c: DVec3, a: DVec3, b: DVec3) -> f64 {
    let length = a.length();
    if length < SHORT {
        return (1.0 - c.length_squared()).max(0.0).powi(2);
    }
    let e1 = a / length;
    let (x, along) = (c.dot(e1), b.dot(e1));
    let across = c - e1 * x;
    let slope = 2.0 * across.dot(b - e1 * along) * 1f64.copysign(along);
    mean_over_segment(x, across.length_squared(), slope, length, along.abs())
}

/// Mean over points `x + s l + t w` of a line, `|s|, |t| ≤ 1`, whose squared distance from the origin is `off + t slope`:
/// the parallelogram seen edge-on, whose points lie on the line with a trapezoid density.
///
/// * `l`: positive, at least `w`.
fn mean_over_segment(x: f64, off: f64, slope: f64, l: f64, w: f64) -> f64 {
    let widest = 1.0 - off + slope.abs();
    if widest <= 0.0 {
        return 0.0;
    }
    let (flat, end) = (l - w, l + w);
    let top = 0.5 / l;
    let rho = widest.sqrt();
    let mut sum = 0.0;
    for (from, to) in [(-end, -flat), (-flat, flat), (flat, end)] {
        let (low, high) = (from.max(-rho - x), to.min(rho - x));
        if low >= high {
            continue;
        }
        let (middle, radius) = ((low + high) / 2.0, (high - low) / 2.0);
        for (node, weight) in GAUSS {
            let at = middle + radius * node;
            // Where s has reached its end, t is no longer as often negative as positive: to first order in the width
            // its mean decides how far off the points lie.
            let past = ((at.abs() - flat) / (end - flat)).clamp(0.0, 1.0);
            let (density, t) = if at.abs() <= flat { (top, 0.0) } else { (top * (1.0 - past), past.copysign(at)) };
            let k = (1.0 - off - slope * t - (x + at) * (x + at)).max(0.0);
            sum += weight * radius * density * k * k;
        }
    }
    sum.clamp(0.0, 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::estimate::polygon::integral_over_polygon;
    use proptest::prelude::*;

    /// Mean by brute force: a fine midpoint grid over the parallelogram, f64.
    fn brute(c: DVec3, a: DVec3, b: DVec3, n: i32) -> f64 {
        let at = |i: i32| (2.0 * f64::from(i) + 1.0) / f64::from(n) - 1.0;
        let mut sum = 0.0;
        for i in 0..n {
            for j in 0..n {
                let u = (c + a * at(i) + b * at(j)).length_squared();
                sum += (1.0 - u).max(0.0).powi(2);
            }
        }
        sum / f64::from(n * n)
    }

    fn vec() -> impl Strategy<Value = Vec3> {
        prop::array::uniform3(-1.0f32..1.0).prop_map(Vec3::from)
    }

    proptest! {
        #[test]
        fn mean_equals_brute_force(c in vec(), a in vec(), b in vec(), size in 0.01f32..3.0, far in 0.0f32..2.0) {
            let (c, a, b) = (c * far, a * size, b * size);
            let exact = mean_over_parallelogram(c, a, b);
            let n = 400;
            let grid = brute(c.as_dvec3(), a.as_dvec3(), b.as_dvec3(), n);
            prop_assert!((exact - grid).abs() < 3e-4 * (1.0 + f64::from(size)), "{exact} {grid}");
        }

        #[test]
        fn mean_is_bounded_for_any_size(c in vec(), a in vec(), b in vec(), p in -13i32..13, q in -13i32..13, r in -13i32..13) {
            let m = mean_over_parallelogram(c * 10f32.powi(p), a * 10f32.powi(q), b * 10f32.powi(r));
            prop_assert!((0.0..=1.0).contains(&m));
        }
    }

    /// Four edges in pairs are the general polygon, wherever vertices and edges lie to the circle.
    fn general(c: DVec2, a: DVec2, b: DVec2) -> f64 {
        integral_over_polygon(&[c - a - b, c + a - b, c + a + b, c - a + b]) / (4.0 * a.perp_dot(b).abs())
    }

    fn flat(v: DVec2) -> Vec3 {
        v.extend(0.0).as_vec3()
    }

    proptest! {
        #[test]
        fn pairs_of_edges_equal_the_general_polygon(
            phi in 0.0f64..TAU, psi in 0.05f64..3.0, p in -3.0f64..3.0, q in -3.0f64..3.0, radius in 0.0f64..3.0, at in 0.0f64..TAU,
        ) {
            let axis = |angle: f64, size: f64| flat(DVec2::from_angle(angle) * 10f64.powf(size));
            let (a, b, c) = (axis(phi, p), axis(phi + psi, q), flat(DVec2::from_angle(at) * radius));
            let plane = |v: Vec3| v.truncate().as_dvec2();
            let expected = general(plane(c), plane(a), plane(b));
            let mean = mean_over_parallelogram(c, a, b);
            prop_assert!((mean - expected).abs() < 1e-9 + 1e-6 * expected, "{mean} {expected}");
        }

        /// A vertex or an edge on the circle, or a hair inside or outside it.
        #[test]
        fn touching_the_circle_does_not_matter(
            phi in 0.0f64..TAU, s in 0.01f64..3.0, t in 0.01f64..3.0, hair in -1i32..2, kind in 0usize..3,
        ) {
            let (x, y) = (DVec2::from_angle(phi), DVec2::from_angle(phi).perp());
            let (a, b) = (x * s, y * t);
            let reach = 1.0 + f64::from(hair) * 1e-7;
            let c = match kind {
                // The middle of an edge from outside, the same edge from inside, a vertex.
                0 => x * (reach + s),
                1 => x * (reach - s),
                _ => (x + y).normalize() * reach + a + b,
            };
            let mean = mean_over_parallelogram(flat(c), flat(a), flat(b));
            let n = 300;
            let grid = brute(flat(c).as_dvec3(), flat(a).as_dvec3(), flat(b).as_dvec3(), n);
            prop_assert!((mean - grid).abs() < 1e-3, "{mean} {grid}");
        }
    }

    #[test]
    fn a_disc_that_fits_the_square_is_whole() {
        // All four edges touch the circle, just cut it, or just miss it.
        for r in [1.0f32, 1.0 - 1e-7, 1.0 + 1e-7, 0.999_999, 1.000_001] {
            for turn in 0..40 {
                let x = DVec2::from_angle(f64::from(turn) * 0.157_3);
                let mean = mean_over_parallelogram(Vec3::ZERO, flat(x) * r, flat(x.perp()) * r);
                assert!((mean * 4.0 * f64::from(r * r) / (PI / 3.0) - 1.0).abs() < 1e-5, "{r} {turn} {mean}");
            }
        }
    }

    #[test]
    fn degenerate_footprints_have_their_limits() {
        let c = Vec3::new(0.4, 0.3, 0.1);
        let point = (1.0f64 - 0.26).powi(2);
        assert!((mean_over_parallelogram(c, Vec3::ZERO, Vec3::ZERO) - point).abs() < 1e-7);
        let a = Vec3::new(1.7, 0.2, 0.0);
        let segment: f64 = {
            let n = 200_000;
            (0..n)
                .map(|i| {
                    let s = (2.0 * f64::from(i) + 1.0) / f64::from(n) - 1.0;
                    (1.0 - (c.as_dvec3() + a.as_dvec3() * s).length_squared()).max(0.0).powi(2)
                })
                .sum::<f64>()
                / f64::from(n)
        };
        for b in [Vec3::ZERO, Vec3::Y * 1e-6, Vec3::Z * 3e-5] {
            assert!((mean_over_parallelogram(c, a, b) - segment).abs() < 1e-6);
            assert!((mean_over_parallelogram(c, b, a) - segment).abs() < 1e-6);
        }
        // Parallel axes: against the grid, which needs no case of its own.
        let b = a * 0.6;
        let grid = brute(c.as_dvec3(), a.as_dvec3(), b.as_dvec3(), 1000);
        assert!((mean_over_parallelogram(c, a, b) - grid).abs() < 1e-5);
        // The seam between segment and polygon.
        for w in [0.99e-4f32, 1.01e-4] {
            assert!((mean_over_parallelogram(c, a, Vec3::Y * w) - segment).abs() < 1e-6);
        }
    }

    #[test]
    fn a_large_footprint_sees_the_whole_disc() {
        let m = mean_over_parallelogram(Vec3::new(2.0, -3.0, 0.0), Vec3::X * 1e5, Vec3::Y * 1e5);
        assert!((m * 4e10 / (PI / 3.0) - 1.0).abs() < 1e-6);
    }

    /// Many at once are each alone, to the bit: all cases beside each other, and groups that are not full.
    #[test]
    fn lanes_are_each_alone() {
        let sequence = crate::math::sequence::Sequence::new(crate::math::sequence::Sampling::Random, 12);
        let (mut all, mut means) = (Parallelograms::default(), [0.0; BATCH]);
        let mut thin = 0;
        for group in 0..3000u64 {
            let own: Vec<[Vec3; 3]> = (0..group % (BATCH as u64 + 1))
                .map(|i| {
                    let v = |set| Vec3::from_slice(&sequence.four(group * 64 + i, set)[..3]) * 2.0 - 1.0;
                    let scale = sequence.four(group * 64 + i, 3).map(|x| 10f32.powf(3.0 * x - 2.0));
                    let (c, a) = (v(0) * 2.0, v(1) * scale[0]);
                    let b = match i % 7 {
                        0 => a * 0.3,
                        1 => Vec3::ZERO,
                        2 => Vec3::splat(f32::MAX),
                        _ => v(2) * scale[1],
                    };
                    if i % 3 == 0 { [c, a, b].map(|v| v * Vec3::new(1.0, 1.0, 0.0)) } else { [c, a, b] }
                })
                .collect();
            all.clear();
            own.iter().for_each(|corners| all.push(*corners));
            assert_eq!(all.len(), own.len());
            means_over_parallelograms(&all, &mut means);
            for ([c, a, b], m) in own.iter().zip(means) {
                thin += u32::from(mean(c.as_dvec3(), a.as_dvec3(), b.as_dvec3()) < 0.0);
                assert_eq!(m.to_bits(), mean_over_parallelogram(*c, *a, *b).to_bits(), "{c} {a} {b}");
            }
        }
        assert!(thin > 1000);
    }
}
