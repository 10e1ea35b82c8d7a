//! The angle of a vector, without a branch.

use glam::DVec2;
use std::f64::consts::{FRAC_PI_2, FRAC_PI_4, PI};

/// Tangent of an eighth of a half turn.
const TAN_PI_8: f64 = std::f64::consts::SQRT_2 - 1.0;

/// `atan(z)/z` as a polynomial in `z²`, for `z` up to `tan π/8`: its interpolation in Chebyshev's nodes, by rising power.
/// The relative error is `7·10⁻¹⁷`.
const ATAN: [f64; 11] = [
    1.0,
    -0.333_333_333_333_284_4,
    0.199_999_999_988_551_1,
    -0.142_857_141_809_764_67,
    0.111_111_061_804_559_46,
    -0.090_907_730_748_084_14,
    0.076_899_534_963_068_57,
    -0.066_402_339_309_294_08,
    0.056_883_492_268_090_106,
    -0.043_480_522_157_164_62,
    0.021_135_373_157_693_246,
];

/// Angle of `v` from the x axis, in [-π, π], to `10⁻¹⁵`; 0 for no vector.
///
/// As `atan2(v.y, v.x)` of a library, which decides by branches that a processor cannot foresee where angles are
/// scattered. Here octants are selected, not jumped to. Coordinates must be finite. Always inlined, to be of use in lanes.
#[inline(always)]
pub fn angle(v: DVec2) -> f64 {
    let (x, y) = (v.x.abs(), v.y.abs());
    let (low, high) = if x < y { (x, y) } else { (y, x) };
    // Beyond π/8 the angle to the diagonal is taken, whose tangent is (low - high)/(low + high).
    let far = low > TAN_PI_8 * high;
    let (p, q, base) = if far { (low - high, low + high, FRAC_PI_4) } else { (low, high, 0.0) };
    let z = p / if q > 0.0 { q } else { 1.0 };
    let w = z * z;
    // Pairs, and pairs of pairs: less depth than one product after another.
    let (w2, c) = (w * w, &ATAN);
    let w4 = w2 * w2;
    let low4 = (c[0] + c[1] * w) + (c[2] + c[3] * w) * w2;
    let high4 = (c[4] + c[5] * w) + (c[6] + c[7] * w) * w2;
    let top = (c[8] + c[9] * w) + c[10] * w2;
    let octant = base + z * (low4 + (high4 + top * w4) * w4);
    let quadrant = if x < y { FRAC_PI_2 - octant } else { octant };
    let half = if v.x < 0.0 { PI - quadrant } else { quadrant };
    half.copysign(v.y)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn angles_are_those_of_the_library() {
        let mut worst = 0.0f64;
        for i in 0..200_000 {
            let phi = f64::from(i) * 7.3e-4 - 70.0;
            let v = DVec2::from_angle(phi) * libm::exp2(f64::from(i % 400 - 200));
            worst = worst.max((angle(v) - libm::atan2(v.y, v.x)).abs());
        }
        assert!(worst < 1e-15, "{worst:e}");
    }

    #[test]
    fn axes_and_nothing_have_their_angles() {
        for (v, expected) in [
            (DVec2::X, 0.0),
            (DVec2::Y, FRAC_PI_2),
            (DVec2::NEG_X, PI),
            (DVec2::NEG_Y, -FRAC_PI_2),
            (DVec2::ONE, FRAC_PI_4),
            (DVec2::new(-1.0, -1.0), -3.0 * FRAC_PI_4),
            (DVec2::ZERO, 0.0),
            (DVec2::new(1.0, 1e-300), 1e-300),
            (DVec2::new(1e-320, 0.0), 0.0),
        ] {
            assert!((angle(v) - expected).abs() < 1e-15, "{v} {}", angle(v));
        }
    }
}
