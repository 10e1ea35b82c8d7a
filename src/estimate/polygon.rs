//! The Silverman kernel integrated over polygons in closed form.
//!
//! With `u = x² + y²` and `g(u) = (3 - 3u + u²)/6` the field `g(u) (x, y)` has divergence `(1 - u)²`, so the integral
//! over polygon ∩ disc is a sum over the polygon's edges: inside the disc three Gauss points are exact, outside it the
//! part of the circle below the edge counts with a sixth of its angle (`docs/theory.md`, the integrated estimator).

use crate::math::angle::angle;
use glam::{DVec2, DVec3, Vec3};
use std::f64::consts::{PI, TAU};

/// Width (in radii of the photon) below which a parallelogram counts as a segment; the error is of its square.
const THIN: f64 = 1e-4;
/// Length below which a segment counts as a point.
const SHORT: f64 = 1e-8;

/// Sum of angles known by sine and cosine, with its full turns.
struct AngleSum {
    z: DVec2,
    turns: i32,
}

impl AngleSum {
    fn new() -> Self {
        Self { z: DVec2::X, turns: 0 }
    }

    /// Adds the angle from `p` to `q`, in (-π, π). Both lie outside the disc, so lengths never vanish.
    fn add(&mut self, p: DVec2, q: DVec2) {
        let w = DVec2::new(p.dot(q), p.perp_dot(q));
        let mut z = DVec2::new(self.z.x * w.x - self.z.y * w.y, self.z.x * w.y + self.z.y * w.x);
        let size = z.x.abs().max(z.y.abs());
        if size > 1e100 {
            z /= size;
        }
        // The sum crosses the cut of atan2 at π upwards or downwards.
        if w.y > 0.0 && self.z.y >= 0.0 && z.y < 0.0 {
            self.turns += 1;
        } else if w.y < 0.0 && self.z.y < 0.0 && z.y >= 0.0 {
            self.turns -= 1;
        }
        self.z = z;
    }

    fn value(&self) -> f64 {
        if self.turns == 0 && self.z == DVec2::X {
            return 0.0;
        }
        libm::atan2(self.z.y, self.z.x) + TAU * f64::from(self.turns)
    }
}

/// `∫₋₁¹` nodes and weights of the three-point Gauss rule.
const GAUSS: [(f64, f64); 3] =
    [(-0.774_596_669_241_483_4, 5.0 / 9.0), (0.0, 8.0 / 9.0), (0.774_596_669_241_483_4, 5.0 / 9.0)];

/// Integral of `(1 - u)²` over the part of a convex or simple polygon inside the unit disc.
///
/// * `vertices`: in order, either way round; fewer than three give 0.
///
/// Returns a value in `[0, π/3]`; π/3 if the polygon holds the disc.
pub fn integral_over_polygon(vertices: &[DVec2]) -> f64 {
    let mut inside = 0.0;
    let mut outside = AngleSum::new();
    let mut doubled_area = 0.0;
    let Some(&last) = vertices.last() else { return 0.0 };
    let mut p = last;
    for &q in vertices {
        doubled_area += p.perp_dot(q);
        inside += edge(p, q, &mut outside);
        p = q;
    }
    let sum = inside + outside.value() / 6.0;
    (sum * doubled_area.signum()).clamp(0.0, PI / 3.0)
}

/// The inside part of the edge p → q; its outside parts go to `outside`.
fn edge(p: DVec2, q: DVec2, outside: &mut AngleSum) -> f64 {
    let d = q - p;
    let squared = d.length_squared();
    if squared == 0.0 {
        return 0.0;
    }
    let cross = p.perp_dot(d);
    let nearest = -p.dot(d) / squared;
    let height2 = cross * cross / squared;
    let half = ((1.0 - height2).max(0.0) / squared).sqrt();
    let (from, to) = ((nearest - half).max(0.0), (nearest + half).min(1.0));
    if from >= to {
        outside.add(p, q);
        return 0.0;
    }
    if from > 0.0 {
        outside.add(p, p + d * from);
    }
    if to < 1.0 {
        outside.add(p + d * to, q);
    }
    let (middle, radius) = ((from + to) / 2.0, (to - from) / 2.0);
    let mut sum = 0.0;
    for (x, w) in GAUSS {
        let t = middle + radius * x - nearest;
        let u = height2 + squared * t * t;
        sum += w * (3.0 - 3.0 * u + u * u);
    }
    cross * radius * sum / 6.0
}

/// Mean of `(1 - u)²` over a view footprint that lies anywhere in the photon's filter space, in closed form.
///
/// The limit N → ∞ of Pedersen 2011, eq. 71, over three.
///
/// * `c`, `a`, `b`: centre and half-edges of the parallelogram in filter space (the photon is the unit ball; no unit).
///
/// Returns a value in `[0, 1]`. One axis vanishing, or parallel axes, give the mean over the segment, both the kernel
/// at `c`.
pub fn mean_over_parallelogram(c: Vec3, a: Vec3, b: Vec3) -> f64 {
    let (c, a, b) = (c.as_dvec3(), a.as_dvec3(), b.as_dvec3());
    let (aa, bb, cc) = (a.length_squared(), b.length_squared(), c.length_squared());
    // No square root yet: |a| + |b| is at most √(2 (aa + bb)).
    let spread = 2.0 * (aa + bb);
    if cc > 1.0 && (cc - 1.0 - spread).max(0.0).powi(2) > 4.0 * spread {
        return 0.0;
    }
    let (ca, cb, ab) = (c.dot(a), c.dot(b), a.dot(b));
    let farthest = cc + aa + bb + 2.0 * (ab + (ca + cb).abs()).max((ca - cb).abs() - ab);
    if farthest <= 1.0 {
        return mean_inside(cc, ca, cb, aa, bb, ab);
    }
    let normal = a.cross(b);
    let area2 = normal.length_squared();
    if area2 < THIN * THIN * aa.max(bb) || aa.max(bb) < SHORT * SHORT {
        return if aa >= bb { mean_seen_edge_on(c, a, b) } else { mean_seen_edge_on(c, b, a) };
    }
    let area = area2.sqrt();
    let normal = normal * (1.0 / area);
    let off = c.dot(normal);
    let rho2 = 1.0 - off * off;
    if rho2 <= 0.0 {
        return 0.0;
    }
    let frame = Frame { aa, bb, ab, ca, cb, area, cxa: c.cross(a).dot(normal), cxb: c.cross(b).dot(normal) };
    (frame.integral(cc - off * off, rho2) * rho2.powi(3) / (4.0 * area)).clamp(0.0, 1.0)
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
    /// As [`integral_over_polygon`], but for four edges that come in pairs. The outside parts add up to the arcs of the
    /// circle inside the polygon, whose angle lies in [0, 2π]; each run outside is known by the points where it leaves
    /// and enters the disc, which are multiplied as complex numbers.
    #[inline]
    fn integral(&self, cc: f64, rho2: f64) -> f64 {
        let Self { aa, bb, ab, ca, cb, area, cxa, cxb } = *self;
        // Each edge m + s e, -1 <= s <= 1, by m × e: its distance times its half-length, positive if the centre of the
        // disc lies on the side of the polygon.
        let crosses = [cxa + area, cxb + area, area - cxa, area - cxb];
        let clear = |k: usize, ee: f64| crosses[k] * crosses[k] >= rho2 * ee;
        let clear = [clear(0, aa), clear(1, bb), clear(2, aa), clear(3, bb)];
        if (0..4).any(|k| clear[k] && crosses[k] < 0.0) {
            return 0.0;
        }
        if clear == [true; 4] {
            return PI / 3.0;
        }
        let (per_aa, per_bb, per_rho2) = (1.0 / aa, 1.0 / bb, 1.0 / rho2);
        // Squared length of the vertices: c - a - b, c + a - b, c + a + b, c - a + b.
        let all = cc + aa + bb;
        let (sum, difference) = (2.0 * (ca + cb), 2.0 * (ca - cb));
        let inside = [
            all + 2.0 * ab - sum < rho2,
            all - 2.0 * ab + difference < rho2,
            all + 2.0 * ab + sum < rho2,
            all - 2.0 * ab - difference < rho2,
        ];
        // For each edge: m · e, e · e and its inverse.
        let edges = [(ca - ab, aa, per_aa), (cb + ab, bb, per_bb), (-(ca + ab), aa, per_aa), (ab - cb, bb, per_bb)];
        // The point at s, turned by the same angle for all edges: ((m + s e) · a, a × (m + s e)).
        let points = [
            (ca - ab, aa, -cxa - area, 0.0),
            (ca + aa, ab, -cxa, area),
            (ca + ab, -aa, area - cxa, 0.0),
            (ca - aa, -ab, -cxa, -area),
        ];
        let mut inner = 0.0;
        let mut turn = DVec2::X;
        for k in 0..4 {
            let (cross, (dot, ee, per_ee)) = (crosses[k], edges[k]);
            let (from_inside, to_inside) = (inside[k], inside[(k + 1) % 4]);
            let height2 = cross * cross * per_ee;
            let nearest = -dot * per_ee;
            let half2 = (rho2 - height2) * per_ee;
            if !from_inside && !to_inside && (half2 <= 0.0 || nearest.abs() >= 1.0) {
                continue;
            }
            let half = half2.max(0.0).sqrt();
            let from = if from_inside { -1.0 } else { (nearest - half).clamp(-1.0, 1.0) };
            let to = if to_inside { 1.0 } else { (nearest + half).clamp(-1.0, 1.0) };
            let (middle, radius) = ((from + to) / 2.0 - nearest, (to - from) / 2.0);
            // ∫ 3 - 3u + u² with u = h + e x²: moments of x about 0 over [middle - radius, middle + radius].
            let (h, e) = (height2 * per_rho2, ee * per_rho2);
            let (m2, r2) = (middle * middle, radius * radius);
            // A division costs as much as ten of these products.
            let second = e * (m2 + r2 * (1.0 / 3.0));
            let fourth = e * e * (m2 * m2 + r2 * (2.0 * m2 + r2 * (1.0 / 5.0)));
            let mean = (3.0 - 3.0 * h + h * h) + (2.0 * h - 3.0) * second + fourth;
            inner += cross * (to - from) * mean;
            let (px, qx, py, qy) = points[k];
            let at = |s: f64| DVec2::new(px + s * qx, py + s * qy);
            if !from_inside {
                turn = turn.rotate(at(from));
            }
            if !to_inside {
                let p = at(to);
                turn = turn.rotate(DVec2::new(p.x, -p.y));
            }
        }
        let inner = inner * per_rho2 * (1.0 / 6.0);
        let mut arcs = angle(turn);
        if arcs.abs() <= CLOSE {
            // Either the polygon leaves out a hair of the circle, and nearly nothing of its edges lies inside; or it
            // reaches out of the disc by a hair.
            let holds = crosses.iter().all(|c| *c >= 0.0) && inner < HAIR;
            arcs = if holds { TAU + arcs.min(0.0) } else { arcs.max(0.0) };
        } else if arcs < 0.0 {
            arcs += TAU;
        }
        (inner + arcs * (1.0 / 6.0)).clamp(0.0, PI / 3.0)
    }
}

/// The mean where the whole parallelogram lies inside the ball: a polynomial in the dot products.
fn mean_inside(cc: f64, ca: f64, cb: f64, aa: f64, bb: f64, ab: f64) -> f64 {
    let first = cc + (aa + bb) * (1.0 / 3.0);
    let second = cc * cc
        + (4.0 * (ca * ca + cb * cb) + 2.0 * cc * (aa + bb)) * (1.0 / 3.0)
        + (aa * aa + bb * bb) * (1.0 / 5.0)
        + (4.0 * ab * ab + 2.0 * aa * bb) * (1.0 / 9.0);
    (1.0 - 2.0 * first + second).clamp(0.0, 1.0)
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

/// Mean of `(1 - u)²` over a polygon given by its parameters in the view footprint: vertex i is
/// `c + sᵢ a + tᵢ b` in filter space. Only for footprints with area; see [`mean_over_parallelogram`] for the others.
///
/// Returns the integral over the polygon, over the area of the whole parallelogram. `buffer` must hold as many
/// entries as `parameters`.
pub fn mean_over_part(c: Vec3, a: Vec3, b: Vec3, parameters: &[DVec2], buffer: &mut [DVec2]) -> Option<f64> {
    let (c, a, b) = (c.as_dvec3(), a.as_dvec3(), b.as_dvec3());
    let length = a.length();
    if length < SHORT {
        return None;
    }
    let e1 = a / length;
    let along = b.dot(e1);
    let across: DVec3 = b - e1 * along;
    let width = across.length();
    if width < THIN {
        return None;
    }
    let e2 = across / width;
    let (x, y) = (c.dot(e1), c.dot(e2));
    let rho2 = 1.0 - (c - e1 * x - e2 * y).length_squared();
    if rho2 <= 0.0 {
        return Some(0.0);
    }
    let scale = 1.0 / rho2.sqrt();
    let polygon = &mut buffer[..parameters.len()];
    for (q, p) in polygon.iter_mut().zip(parameters) {
        *q = DVec2::new(x + length * p.x + along * p.y, y + width * p.y) * scale;
    }
    Some(rho2.powi(3) * integral_over_polygon(polygon) / (4.0 * length * width))
}

#[cfg(test)]
mod tests {
    use super::*;
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

        /// Moving the polygon's vertices by a hair changes the integral by a hair, on and near the circle too.
        #[test]
        fn integral_is_continuous(
            v in prop::collection::vec((0.0f64..TAU, -3.0f64..3.0), 3), shift in -1e-9f64..1e-9,
        ) {
            let at = |e: f64| -> Vec<DVec2> {
                v.iter().map(|(phi, k)| DVec2::from_angle(*phi) * (1.0 + k.signum() * 10f64.powf(-4.0 * k.abs()) + e)).collect()
            };
            let (p, q) = (integral_over_polygon(&at(0.0)), integral_over_polygon(&at(shift)));
            prop_assert!((p - q).abs() < 1e-7);
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
    fn known_polygons() {
        let square = |r: f64| [DVec2::new(-r, -r), DVec2::new(r, -r), DVec2::new(r, r), DVec2::new(-r, r)];
        assert!((integral_over_polygon(&square(5.0)) - PI / 3.0).abs() < 1e-12);
        assert!((integral_over_polygon(&square(1.0)) - PI / 3.0).abs() < 1e-12, "edges tangent to the circle");
        let turned: Vec<DVec2> = square(5.0).into_iter().rev().collect();
        assert!((integral_over_polygon(&turned) - PI / 3.0).abs() < 1e-12, "clockwise");
        // ∫ over the small square [-r, r]²: (1-x²-y²)² term by term.
        let r: f64 = 0.3;
        let (m2, m4) = (2.0 * r.powi(3) / 3.0, 2.0 * r.powi(5) / 5.0);
        let whole = 4.0 * r * r - 4.0 * (2.0 * r) * m2 + 2.0 * (2.0 * r) * m4 + 2.0 * m2 * m2;
        assert!((integral_over_polygon(&square(r)) - whole).abs() < 1e-13);
        // A half plane through the centre, and triangles whose vertices lie on the circle.
        let half = [DVec2::new(-9.0, 0.0), DVec2::new(9.0, 0.0), DVec2::new(9.0, 9.0), DVec2::new(-9.0, 9.0)];
        assert!((integral_over_polygon(&half) - PI / 6.0).abs() < 1e-12);
        let far = [DVec2::new(2.0, 0.0), DVec2::new(3.0, 0.0), DVec2::new(3.0, 1.0)];
        assert!(integral_over_polygon(&far).abs() < 1e-12);
        assert_eq!(integral_over_polygon(&[]), 0.0);
    }

    #[test]
    fn pieces_add_up_to_the_whole() {
        let (p, q) = (DVec2::new(-2.0, -0.4), DVec2::new(1.5, 0.9));
        let n = DVec2::new(-1.3, 2.0);
        let m = DVec2::new(0.7, -1.8);
        let whole = integral_over_polygon(&[p, m, q, n]);
        let parts = integral_over_polygon(&[p, m, q]) + integral_over_polygon(&[p, q, n]);
        assert!((whole - parts).abs() < 1e-12);
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
}
