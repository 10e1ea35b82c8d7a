//! The Silverman kernel integrated over polygons in closed form.
//!
//! With `u = x² + y²` and `g(u) = (3 - 3u + u²)/6` the field `g(u) (x, y)` has divergence `(1 - u)²`, so the integral
//! over polygon ∩ disc is a sum over the polygon's edges: inside the disc three Gauss points are exact, outside it the
//! part of the circle below the edge counts with a sixth of its angle (`docs/theory.md`, the integrated estimator).

use glam::{DVec2, DVec3, Vec3};
use std::f64::consts::{PI, TAU};

/// Width (in radii of the photon) below which a parallelogram counts as a segment; the error is of its square.
pub(super) const THIN: f64 = 1e-4;
/// Length below which a segment counts as a point.
pub(super) const SHORT: f64 = 1e-8;

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
pub(super) const GAUSS: [(f64, f64); 3] =
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

    proptest! {
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
}
