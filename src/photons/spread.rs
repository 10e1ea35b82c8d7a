//! What a diffuse bounce does to a photon's differential.

use crate::math::frame::tangents;
use crate::photons::emission::{cone_radius, cosine_solid_angle};
use crate::trace::Differential;
use glam::Vec3;
use serde::{Deserialize, Serialize};

/// The rule for a diffuse bounce.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum DiffuseSpread {
    /// `dP` is kept; `dV` becomes a disc of the solid angle `π/(N cos θ)` of one of N cosine-weighted photons, turned
    /// to `dP` by its polar factor, so that the footprint grows with distance along all its axes.
    #[default]
    Polar,
    /// `trace_cosine_weighted` of the thesis's listing: `dV` turned with the ray, `dP` times 2√2.
    AsPublished,
}

/// The differential after a diffuse bounce from direction `v` to `w` (unit), and whether its angle was bounded.
///
/// * `d`: transferred to the surface.
/// * `cos`: of `w` to the surface's normal.
/// * `count`: photons that the light has sent out.
pub fn bounce(rule: DiffuseSpread, d: &Differential, v: Vec3, w: Vec3, cos: f32, count: u64) -> (Differential, bool) {
    match rule {
        DiffuseSpread::Polar => {
            let (solid_angle, bounded) = cosine_solid_angle(count as f32, cos);
            let r = cone_radius(solid_angle);
            (Differential { dp: d.dp, dv: polar_factor(d.dp, w).map(|c| c * r) }, bounded)
        }
        DiffuseSpread::AsPublished => {
            let grow = 2.0 * std::f32::consts::SQRT_2;
            (Differential { dp: d.dp.map(|c| c * grow), dv: d.dv.map(|c| turned(c, v, w)) }, false)
        }
    }
}

/// `x` under the shortest rotation that takes the unit vector `v` to `w`; a half turn if they are opposite.
fn turned(x: Vec3, v: Vec3, w: Vec3) -> Vec3 {
    let cos = v.dot(w);
    if cos < -0.999_999 {
        let (axis, _) = tangents(v);
        return axis * (2.0 * axis.dot(x)) - x;
    }
    let axis = v.cross(w);
    x * cos + axis.cross(x) + axis * (axis.dot(x) / (1.0 + cos))
}

/// Orthonormal columns across `w` that are nearest to `dp` seen along `w`; any if `dp` vanishes.
///
/// For a 2×2 matrix M, `M ± cof M` is the polar factor up to a positive scale, with the sign of `det M`.
fn polar_factor(dp: [Vec3; 2], w: Vec3) -> [Vec3; 2] {
    // f64: the determinant of a footprint far below a metre vanishes in f32, and with it the sign.
    let (t, b) = tangents(w);
    let (t, b) = (t.as_dvec3(), b.as_dvec3());
    let m = dp.map(|c| [t.dot(c.as_dvec3()), b.dot(c.as_dvec3())]);
    let sign = if m[0][0] * m[1][1] - m[0][1] * m[1][0] >= 0.0 { 1.0 } else { -1.0 };
    let (c, s) = (m[0][0] + sign * m[1][1], m[0][1] - sign * m[1][0]);
    let l = (c * c + s * s).sqrt();
    let (c, s) = if l > 0.0 && l.is_finite() { (c / l, s / l) } else { (1.0, 0.0) };
    [(t * c + b * s).as_vec3(), ((b * c - t * s) * sign).as_vec3()]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::frame::uniform_sphere;
    use proptest::prelude::*;

    proptest! {
        /// The area of `dP + s dV` seen along the ray grows with s from `|dP|` and never shrinks.
        #[test]
        fn footprints_never_fold(
            a in prop::array::uniform3(-1.0f32..1.0), b in prop::array::uniform3(-1.0f32..1.0),
            u in 0.0f32..1.0, v in 0.0f32..1.0, s in 0.01f32..10.0,
        ) {
            let w = uniform_sphere(u, v).normalize();
            let d = Differential { dp: [a.into(), b.into()], dv: [Vec3::ZERO; 2] };
            let (out, _) = bounce(DiffuseSpread::Polar, &d, Vec3::X, w, 0.5, 1000);
            let area = |s: f32| {
                let c = [0, 1].map(|i| { let c = out.dp[i] + out.dv[i] * s; c - w * w.dot(c) });
                c[0].cross(c[1]).length()
            };
            let own = (s * out.dv[0].length()).powi(2);
            prop_assert!(area(s) >= 0.999 * (area(0.0) + own));
        }
    }

    #[test]
    fn a_vanishing_footprint_spreads_as_a_disc() {
        let (out, bounded) = bounce(DiffuseSpread::Polar, &Differential::default(), Vec3::NEG_Y, Vec3::Y, 1.0, 100);
        assert!(!bounded);
        assert!((out.dv[0].length() - 0.1).abs() < 1e-6 && out.dv[0].dot(out.dv[1]).abs() < 1e-8);
    }

    /// A mirrored footprint stays mirrored whatever its size.
    #[test]
    fn small_footprints_keep_their_sense() {
        for size in [1.0f32, 1e-12, 1e-24, 1e24] {
            let d = Differential { dp: [Vec3::X * size, Vec3::Z * size], dv: [Vec3::ZERO; 2] };
            let (out, _) = bounce(DiffuseSpread::Polar, &d, Vec3::NEG_Y, Vec3::Y, 1.0, 100);
            assert!((out.dv[0] - Vec3::X * 0.1).length() < 1e-7 && (out.dv[1] - Vec3::Z * 0.1).length() < 1e-7);
        }
    }

    #[test]
    fn turning_takes_one_direction_to_the_other() {
        let v = Vec3::new(0.36, -0.48, 0.8);
        for w in [Vec3::X, Vec3::NEG_Z, v, -v] {
            assert!((turned(v, v, w) - w).length() < 1e-5);
            let (t, _) = tangents(v);
            let across = turned(t, v, w);
            assert!(across.dot(w).abs() < 1e-5 && (across.length() - 1.0).abs() < 1e-5);
        }
    }

    #[test]
    fn published_rule_keeps_lengths_and_grows_the_footprint() {
        let d = Differential { dp: [Vec3::X, Vec3::Z], dv: [Vec3::X * 0.1, Vec3::Z * 0.1] };
        let w = Vec3::new(0.6, 0.8, 0.0);
        let (out, _) = bounce(DiffuseSpread::AsPublished, &d, Vec3::NEG_Y, w, 0.8, 10);
        assert!((out.dp[0].length() - 8f32.sqrt()).abs() < 1e-6);
        assert!((out.dv[0].length() - 0.1).abs() < 1e-6 && out.dv[0].dot(w).abs() < 1e-6);
    }
}
