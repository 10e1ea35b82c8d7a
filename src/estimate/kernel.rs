//! Kernels on the unit disc, each normalised so that `∫ K/π = 1`.

use serde::{Deserialize, Serialize};

/// The Silverman (biweight) kernel `K = 3 (1 - u)²` of the squared distance `u`; 0 outside the unit disc.
#[inline]
pub fn silverman(u: f64) -> f64 {
    let v = (1.0 - u).max(0.0);
    3.0 * v * v
}

/// Kernels of density estimation, functions of distance over radius.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Kernel {
    /// Constant (Jensen 2001).
    None,
    /// Falls linearly to the rim (Jensen 2001 with k = 1).
    Cone,
    /// Jensen's truncated Gaussian, β = 1.953.
    Gaussian,
    /// `1 - r²`.
    Epanechnikov,
    /// `(1 - r²)²`.
    Silverman,
}

/// Jensen's β.
const BETA: f64 = 1.953;

impl Kernel {
    /// All kernels with their names.
    pub const ALL: [(&'static str, Self); 5] = [
        ("none", Self::None),
        ("cone", Self::Cone),
        ("gaussian", Self::Gaussian),
        ("epanechnikov", Self::Epanechnikov),
        ("silverman", Self::Silverman),
    ];

    /// The kernel's name.
    pub fn name(self) -> &'static str {
        Self::ALL.iter().find(|(_, k)| *k == self).map_or("", |(n, _)| n)
    }

    /// Value at the squared relative distance `u`; 0 for `u > 1`.
    pub fn value(self, u: f64) -> f64 {
        // The photon that sets the radius lies on the rim, up to rounding.
        if u > 1.0 + 1e-5 {
            return 0.0;
        }
        let u = u.min(1.0);
        match self {
            Self::None => 1.0,
            Self::Cone => 3.0 * (1.0 - u.sqrt()),
            Self::Gaussian => {
                let span = 1.0 - libm::exp(-BETA);
                let shape = 1.0 - (1.0 - libm::exp(-BETA * u / 2.0)) / span;
                // Integral of the shape over u in [0, 1].
                let whole = 1.0 - (1.0 - 2.0 / BETA * (1.0 - libm::exp(-BETA / 2.0))) / span;
                shape / whole
            }
            Self::Epanechnikov => 2.0 * (1.0 - u),
            Self::Silverman => silverman(u),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn kernels_integrate_to_the_area_of_the_disc() {
        for (name, k) in Kernel::ALL {
            let n = 200_000;
            // ∫ K dA/π = ∫₀¹ K du.
            let sum: f64 = (0..n).map(|i| k.value((f64::from(i) + 0.5) / f64::from(n))).sum();
            assert!((sum / f64::from(n) - 1.0).abs() < 1e-5, "{name}");
            assert_eq!(k.value(1.1), 0.0);
        }
    }
}
