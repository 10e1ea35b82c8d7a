//! Orthonormal frames and the maps from the unit square to directions and discs.

use crate::math::elementary::sin_cos;
use glam::{DVec3, Vec3};
use std::f32::consts::{PI, TAU};

/// Two unit vectors that make a right-handed frame with the unit vector `n`: `(t, b)` with `t × b = n`.
///
/// Continuous except at a `n.z` just below 0 (Duff et al. 2017). Not at 0 itself: there walls along the axes have their
/// normals, and rounding must not turn their frames.
#[inline(always)]
pub fn tangents(n: Vec3) -> (Vec3, Vec3) {
    let sign = if n.z < -1e-5 { -1.0 } else { 1.0 };
    let a = -1.0 / (sign + n.z);
    let b = n.x * n.y * a;
    (Vec3::new(1.0 + sign * n.x * n.x * a, sign * b, -sign * n.x), Vec3::new(b, sign + n.y * n.y * a, -n.y))
}

/// Direction with `cos` to the axis `n`, turned by `phi` radians about it. `n` must be a unit vector.
pub fn direction(n: Vec3, cos: f32, phi: f32) -> Vec3 {
    let (t, b) = tangents(n);
    let (s, c) = sin_cos(phi);
    let sin = (1.0 - cos * cos).max(0.0).sqrt();
    (t * (c * sin) + b * (s * sin) + n * cos).normalize()
}

/// Uniform direction on the unit sphere from two numbers in `[0, 1)`. Density `1/(4π)`.
pub fn uniform_sphere(u: f32, v: f32) -> Vec3 {
    let (s, c) = sin_cos(TAU * v);
    on_sphere(u, s, c)
}

/// The direction of [`uniform_sphere`] for a number and the sine and cosine of its turn.
#[inline(always)]
pub fn on_sphere(u: f32, sin: f32, cos: f32) -> Vec3 {
    let z = 1.0 - 2.0 * u;
    let r = (1.0 - z * z).max(0.0).sqrt();
    Vec3::new(r * cos, r * sin, z)
}

/// Cosine-weighted direction about the unit vector `n`. Density `cos θ/π`.
pub fn cosine_hemisphere(n: Vec3, u: f32, v: f32) -> Vec3 {
    direction(n, (1.0 - u).max(0.0).sqrt(), TAU * v)
}

/// Point of the unit disc by the concentric map (Shirley and Chiu 1997). Density `1/π`.
pub fn concentric_disc(u: f32, v: f32) -> (f32, f32) {
    let (a, b) = (2.0 * u - 1.0, 2.0 * v - 1.0);
    if a == 0.0 && b == 0.0 {
        return (0.0, 0.0);
    }
    let (r, phi) = if a.abs() > b.abs() { (a, PI / 4.0 * (b / a)) } else { (b, PI / 2.0 - PI / 4.0 * (a / b)) };
    let (s, c) = sin_cos(phi);
    (r * c, r * s)
}

/// The unit vector along `v`, or `fallback` if `v` has no direction (zero, or not finite).
pub fn unit_or(v: Vec3, fallback: Vec3) -> Vec3 {
    let m = v.abs().max_element();
    if m > 0.0 && m.is_finite() { (v / m).normalize() } else { fallback }
}

/// The unit vector along `v` however long or short it is; None if `v` has no direction (zero, or not finite).
pub fn unit(v: DVec3) -> Option<DVec3> {
    let m = v.abs().max_element();
    (m > 0.0 && m.is_finite()).then(|| (v / m).normalize())
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn tangents_are_orthonormal_and_right_handed(u in 0.0f32..1.0, v in 0.0f32..1.0) {
            let n = uniform_sphere(u, v).normalize();
            let (t, b) = tangents(n);
            prop_assert!((t.length() - 1.0).abs() < 1e-5 && (b.length() - 1.0).abs() < 1e-5);
            prop_assert!(t.dot(n).abs() < 1e-5 && b.dot(n).abs() < 1e-5 && t.dot(b).abs() < 1e-5);
            prop_assert!((t.cross(b) - n).length() < 1e-5);
        }
    }

    #[test]
    fn walls_along_the_axes_keep_their_frames_under_rounding() {
        for n in [Vec3::X, Vec3::Y, Vec3::NEG_X, Vec3::NEG_Y] {
            let (t, b) = tangents(n);
            for z in [-0.0, 1e-7, -1e-7, 1e-40, -1e-40] {
                let (u, v) = tangents(Vec3::new(n.x, n.y, z));
                assert!((t - u).length() < 1e-6 && (b - v).length() < 1e-6);
            }
        }
    }

    /// Means of powers of the cosine against the integrals over the declared densities.
    #[test]
    fn samples_follow_their_densities() {
        let n = 512;
        let axis = Vec3::new(0.3, -0.5, 0.8).normalize();
        let (mut sphere, mut hemisphere, mut disc) = (0.0, 0.0, 0.0);
        for i in 0..n {
            for j in 0..n {
                let (u, v) = ((i as f32 + 0.5) / n as f32, (j as f32 + 0.5) / n as f32);
                sphere += f64::from(uniform_sphere(u, v).dot(axis).powi(2));
                hemisphere += f64::from(cosine_hemisphere(axis, u, v).dot(axis));
                let (x, y) = concentric_disc(u, v);
                disc += f64::from(x * x + y * y);
            }
        }
        let count = f64::from(n * n);
        assert!((sphere / count - 1.0 / 3.0).abs() < 1e-4);
        assert!((hemisphere / count - 2.0 / 3.0).abs() < 1e-4);
        assert!((disc / count - 0.5).abs() < 1e-4);
    }

    #[test]
    fn unit_or_survives_extreme_lengths() {
        assert_eq!(unit_or(Vec3::ZERO, Vec3::Y), Vec3::Y);
        assert_eq!(unit_or(Vec3::splat(f32::NAN), Vec3::Y), Vec3::Y);
        assert_eq!(unit_or(Vec3::new(1e-38, 0.0, 0.0), Vec3::Y), Vec3::X);
        assert_eq!(unit_or(Vec3::new(0.0, 0.0, -3e38), Vec3::Y), Vec3::NEG_Z);
        assert_eq!(unit(DVec3::X * 5e-324), Some(DVec3::X));
        assert_eq!(unit(DVec3::Z * -1e308), Some(DVec3::NEG_Z));
        assert!(unit(DVec3::ZERO).is_none() && unit(DVec3::splat(f64::INFINITY)).is_none());
    }
}
