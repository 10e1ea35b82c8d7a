//! Transcendental functions that give the same bits on every machine.
//!
//! The standard library calls the platform's; these call `libm`, in f64, so that an image does not depend on it.

/// Sine and cosine of an angle in radians.
pub fn sin_cos(angle: f32) -> (f32, f32) {
    let (s, c) = libm::sincos(f64::from(angle));
    (s as f32, c as f32)
}

/// `base` to the power `exponent`; `base` must not be negative.
pub fn pow(base: f32, exponent: f32) -> f32 {
    libm::pow(f64::from(base), f64::from(exponent)) as f32
}

/// Tangent of an angle in radians.
pub fn tan(angle: f64) -> f64 {
    libm::tan(angle)
}
