//! Singular values of two vectors by Jacobi's one-sided method, which keeps the digits of the smaller one.

use glam::DVec3;

/// Longest and shortest semi-axis of the ellipse with conjugate half-axes `a`, `b`, with their directions.
pub struct Ellipse {
    /// Lengths, the longest first.
    pub lengths: [f64; 2],
    /// The semi-axes themselves.
    pub axes: [DVec3; 2],
}

impl Ellipse {
    /// Turns the two vectors until they are at right angles.
    pub fn of(mut a: DVec3, mut b: DVec3) -> Self {
        for _ in 0..60 {
            let (aa, bb, ab) = (a.length_squared(), b.length_squared(), a.dot(b));
            if ab == 0.0 || ab.abs() <= 1e-17 * (aa * bb).sqrt() {
                break;
            }
            let zeta = (bb - aa) / (2.0 * ab);
            let t = 1f64.copysign(zeta) / (zeta.abs() + (1.0 + zeta * zeta).sqrt());
            let c = 1.0 / (1.0 + t * t).sqrt();
            let s = c * t;
            (a, b) = (a * c - b * s, a * s + b * c);
        }
        let (a, b) = if a.length_squared() < b.length_squared() { (b, a) } else { (a, b) };
        Self { lengths: [a.length(), b.length()], axes: [a, b] }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_shear_has_its_singular_values() {
        let e = Ellipse::of(DVec3::X, DVec3::new(1.0, 1.0, 0.0));
        assert!((e.lengths[0] - (5f64.sqrt() + 1.0) / 2.0).abs() < 1e-15);
        assert!((e.lengths[1] - (5f64.sqrt() - 1.0) / 2.0).abs() < 1e-15);
        assert!(e.axes[0].dot(e.axes[1]).abs() < 1e-15);
    }
}
