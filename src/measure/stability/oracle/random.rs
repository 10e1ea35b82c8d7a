//! Inputs of cases: the same on every machine and in every order.

use crate::math::hash::mix;

/// A stream of numbers that is made from its number alone.
pub struct Random(u64);

impl Random {
    /// Stream number `n` of the case of that name.
    pub fn new(case: &str, n: u64) -> Self {
        Self(mix(crate::math::hash::fnv1a(crate::math::hash::FNV_START, case.as_bytes()), n))
    }

    /// In `[0, 1)`, 53 bits.
    pub fn unit(&mut self) -> f64 {
        self.0 = mix(self.0, 0x5eed);
        (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }

    /// In `[low, high)`.
    pub fn range(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }

    /// `10^x` with x in `[low, high)`.
    pub fn decade(&mut self, low: f64, high: f64) -> f64 {
        libm::exp10(self.range(low, high))
    }

    /// A direction on the unit sphere, f64.
    pub fn direction(&mut self) -> glam::DVec3 {
        let z = self.range(-1.0, 1.0);
        let (s, c) = libm::sincos(self.range(0.0, std::f64::consts::TAU));
        let r = (1.0 - z * z).sqrt();
        glam::DVec3::new(r * c, r * s, z)
    }
}
