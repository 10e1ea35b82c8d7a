//! Directions and places from numbers in `[0, 1)`, in 64 bits.

use glam::DVec3;
use std::f64::consts::{PI, TAU};

/// Direction with `cos` to the unit vector `axis`, turned about it by `turn` of a full turn.
pub fn around(axis: DVec3, cos: f64, turn: f64) -> DVec3 {
    let (t, b) = axis.any_orthonormal_pair();
    let sin = (1.0 - cos * cos).max(0.0).sqrt();
    let (s, c) = libm::sincos(TAU * turn);
    (t * (sin * c) + b * (sin * s) + axis * cos).normalize()
}

/// Uniform over the sphere; density `1/(4π)`.
pub fn sphere(u: f64, v: f64) -> DVec3 {
    around(DVec3::Z, 1.0 - 2.0 * u, v)
}

/// Cosine-weighted over the hemisphere about `n`; density `cos θ/π`.
pub fn cosine(n: DVec3, u: f64, v: f64) -> DVec3 {
    around(n, (1.0 - u).max(0.0).sqrt(), v)
}

/// Uniform over the unit disc, along two axes; density `1/π`.
pub fn disc(u: f64, v: f64) -> [f64; 2] {
    let (s, c) = libm::sincos(TAU * v);
    let r = u.max(0.0).sqrt();
    [r * c, r * s]
}

/// The directions from a point to a sphere.
#[derive(Clone, Copy, Debug)]
pub struct Cone {
    /// Unit vector to the sphere's centre.
    pub axis: DVec3,
    /// One minus the cosine of half its angle, without cancellation; positive.
    pub rest: f64,
}

impl Cone {
    /// The cone that a sphere fills; None from inside, or if it can't be told.
    pub fn of(from: DVec3, center: DVec3, radius: f64) -> Option<Self> {
        let to = center - from;
        let sin2 = radius * radius / to.length_squared();
        let rest = sin2 / (1.0 + (1.0 - sin2).max(0.0).sqrt());
        (sin2 < 1.0 && rest > 0.0).then(|| Self { axis: to.normalize(), rest })
    }

    /// Uniform over its solid angle.
    pub fn sample(&self, u: f64, v: f64) -> DVec3 {
        let (t, b) = self.axis.any_orthonormal_pair();
        let away = self.rest * u;
        let sin = (away * (2.0 - away)).max(0.0).sqrt();
        let (s, c) = libm::sincos(TAU * v);
        (t * (sin * c) + b * (sin * s) + self.axis * (1.0 - away)).normalize()
    }

    /// Whether it holds a unit direction.
    pub fn holds(&self, w: DVec3) -> bool {
        // 1 - cos by the chord: |w - axis|² = 2 (1 - cos).
        (w - self.axis).length_squared() <= 2.0 * self.rest
    }

    /// Its solid angle, sr.
    pub fn solid_angle(&self) -> f64 {
        TAU * self.rest
    }
}

/// `1/π`, the density of [`cosine`] at its axis.
pub const FRAC_1_PI: f64 = 1.0 / PI;

#[cfg(test)]
mod tests {
    use super::*;

    /// Means of powers of the cosine against the integrals over the declared densities.
    #[test]
    fn samples_follow_their_densities() {
        let n = 400;
        let axis = DVec3::new(0.3, -0.5, 0.8).normalize();
        let from = DVec3::new(1.0, 2.0, -0.5);
        let cone = Cone::of(from, from + axis * 5.0, 3.0).expect("outside");
        let (mut ball, mut half, mut narrow, mut radius) = (0.0, 0.0, 0.0, 0.0);
        for i in 0..n {
            for j in 0..n {
                let (u, v) = ((f64::from(i) + 0.5) / f64::from(n), (f64::from(j) + 0.5) / f64::from(n));
                ball += sphere(u, v).dot(axis).powi(2);
                half += cosine(axis, u, v).dot(axis);
                let w = cone.sample(u, v);
                assert!(cone.holds(w));
                narrow += w.dot(axis);
                let [x, y] = disc(u, v);
                radius += x * x + y * y;
            }
        }
        let count = f64::from(n * n);
        assert!((ball / count - 1.0 / 3.0).abs() < 1e-4);
        assert!((half / count - 2.0 / 3.0).abs() < 1e-4);
        // Sine 0.6, cosine 0.8: uniform in the cosine over [0.8, 1].
        assert!((narrow / count - 0.9).abs() < 1e-6 && (cone.solid_angle() - TAU * 0.2).abs() < 1e-12);
        assert!((radius / count - 0.5).abs() < 1e-4);
        assert!(!cone.holds(around(axis, 0.799, 0.3)) && cone.holds(around(axis, 0.801, 0.7)));
        assert!(Cone::of(from, from, 1.0).is_none() && Cone::of(from, from + axis, 1.0).is_none());
    }
}
