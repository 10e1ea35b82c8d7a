//! The kernel over polygon ∩ disc, and footprints clipped by polygons, where shapes touch.

use super::case::{F32, many};
use super::oracle::footprint::{largest_mean, mean_over};
use super::oracle::random::Random;
use super::oracle::scan::kernel_over;
use super::{Case, Outcome};
use crate::estimate::parallelogram::mean_over_parallelogram;
use crate::estimate::polygon::integral_over_polygon;
use glam::{DVec2, DVec3, Vec3};

/// The group.
pub const CASES: &[Case] = &[
    Case {
        group: "clipping",
        name: "polygon-disc",
        what: "integral of the kernel over polygon ∩ disc; error relative to the kernel's whole",
        range: "vertices on, 1e-16 to 1e-1 inside and outside the circle; tangent edges; either shape inside the other",
        oracle: "scan lines, f64",
        limit: 1e-12,
        run: polygon_disc,
    },
    Case {
        group: "clipping",
        name: "parallelogram-disc",
        what: "mean of the kernel over a view footprint; error relative to the footprint's largest mean",
        range: "touching as above; half-edges 1e-6 to 1e6 photon radii; tilted to 90°",
        oracle: "closed form along one axis, quadrature along the other, f64",
        limit: F32,
        run: parallelogram_disc,
    },
    Case {
        group: "clipping",
        name: "parallelogram-sliver",
        what: "mean of the kernel over a view footprint; error relative to the footprint's largest mean",
        range: "aspect ratios 1 to 1e8, one axis vanishing, axes parallel to 1e-7, no extent",
        oracle: "closed form along one axis, quadrature along the other, f64",
        limit: F32,
        run: parallelogram_sliver,
    },
];

/// Radius of a vertex that lies on the unit circle, or a hair inside or outside.
fn hair(random: &mut Random) -> f64 {
    match (random.unit() * 5.0) as u32 {
        0 => 1.0,
        1 | 2 => 1.0 - random.decade(-16.0, -1.0),
        _ => 1.0 + random.decade(-16.0, -1.0),
    }
}

fn polygon_disc() -> Outcome {
    let whole = std::f64::consts::PI / 3.0;
    many("polygon-disc", 20_000, |i, random, outcome| {
        let corners = 3 + (random.unit() * 6.0) as usize;
        let mut angles: Vec<f64> = (0..corners).map(|_| random.range(0.0, std::f64::consts::TAU)).collect();
        angles.sort_by(f64::total_cmp);
        let polygon: Vec<DVec2> = match i % 4 {
            // Inscribed but for hairs. Convex, as hairs of 0.1 between near angles would not be.
            0 => {
                let scale = hair(random);
                angles.iter().map(|a| DVec2::from_angle(*a) * scale).collect()
            }
            // A triangle with each vertex at its own hair.
            1 => angles[..3].iter().map(|a| DVec2::from_angle(*a) * hair(random)).collect(),
            // A square whose edges are tangent, or nearly, and which lies anywhere along them.
            2 => {
                let (h, x) = (hair(random), DVec2::from_angle(angles[0]));
                let size = random.decade(-3.0, 2.0);
                let along = random.range(-2.0, 2.0);
                let from = x * h + x.perp() * along;
                vec![from, from + x.perp() * size, from + (x.perp() + x) * size, from + x * size]
            }
            // The disc inside, or the polygon inside, or neither.
            _ => {
                let (size, center) = (random.decade(-4.0, 2.0), DVec2::from_angle(angles[1]) * random.range(0.0, 1.5));
                angles.iter().map(|a| center + DVec2::from_angle(*a) * size).collect()
            }
        };
        let (found, exact) = (integral_over_polygon(&polygon), kernel_over(&polygon));
        outcome.see((found - exact).abs() / whole, || format!("{polygon:?}: {found:e} for {exact:e}"));
    })
}

fn judged(c: Vec3, a: Vec3, b: Vec3, outcome: &mut Outcome) {
    let found = mean_over_parallelogram(c, a, b);
    let (c, a, b) = (c.as_dvec3(), a.as_dvec3(), b.as_dvec3());
    let exact = mean_over(c, a, b);
    outcome.see((found - exact).abs() / largest_mean(a, b), || format!("c {c} a {a} b {b}: {found:e} for {exact:e}"));
}

/// Two directions at right angles and the normal of both.
fn frame(random: &mut Random) -> [DVec3; 3] {
    let n = random.direction();
    let (s, c) = libm::sincos(random.range(0.0, std::f64::consts::TAU));
    let (t, b) = n.any_orthonormal_pair();
    [t * c + b * s, b * c - t * s, n]
}

fn parallelogram_disc() -> Outcome {
    many("parallelogram-disc", 40_000, |i, random, outcome| {
        let [x, y, n] = frame(random);
        let (p, q) = (random.decade(-6.0, 6.0), random.decade(-6.0, 6.0));
        let skew = random.range(-1.0, 1.0);
        let (a, b) = (x * p, (y + x * skew) * q);
        let reach = hair(random);
        let off = n * if i % 5 == 0 { hair(random) } else { random.range(-1.1, 1.1) * (i % 2) as f64 };
        let c = match i % 3 {
            // A vertex at a hair from the circle; an edge nearly tangent; anywhere.
            0 => a + b + (x + y * random.range(-1.0, 1.0)).normalize() * reach,
            1 => b + y * reach + x * random.range(-1.0, 1.0) * p,
            _ => a * random.range(-1.2, 1.2) + b * random.range(-1.2, 1.2),
        };
        judged((c + off).as_vec3(), a.as_vec3(), b.as_vec3(), outcome);
    })
}

fn parallelogram_sliver() -> Outcome {
    many("parallelogram-sliver", 40_000, |i, random, outcome| {
        let [x, y, n] = frame(random);
        let long = random.decade(-3.0, 3.0);
        let a = x * long;
        let b = match i % 4 {
            0 => y * (long * random.decade(-8.0, 0.0)),
            1 => DVec3::ZERO,
            // Parallel but for an angle.
            2 => (x + y * random.decade(-8.0, -3.0)) * (long * random.range(-1.0, 1.0)),
            _ => y * (long * random.decade(-8.0, -3.0)) + n * (long * random.decade(-8.0, -3.0)),
        };
        let a = if i % 16 == 1 { DVec3::ZERO } else { a };
        let c = a * random.range(-1.2, 1.2) + y * random.range(-1.1, 1.1) + n * random.range(-0.5, 0.5);
        judged(c.as_vec3(), a.as_vec3(), b.as_vec3(), outcome);
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A kernel that is wrong by a little is found out: the case itself can fail.
    #[test]
    fn a_wrong_kernel_would_be_seen() {
        let (a, b) = (DVec3::X * 0.7, DVec3::Y * 0.4);
        let exact = mean_over(DVec3::ZERO, a, b);
        assert!((mean_over_parallelogram(Vec3::ZERO, a.as_vec3(), b.as_vec3()) * 1.000_1 - exact).abs() / exact > 1e-5);
    }
}
