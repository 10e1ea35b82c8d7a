//! Irradiance where photons have arrived, and its pyramid: estimates over discs of growing radius (Gjøl, Larsen and
//! Christensen, *Final Gathering using Ray Differentials*).

pub mod global_photons;
pub mod layer;
pub mod pyramid;
pub mod surface_area;

#[cfg(test)]
mod tests;

pub use global_photons::GlobalPhotons;
pub use layer::{IrradianceEstimate, Layer};
pub use pyramid::{IrradiancePyramid, PyramidMemory, PyramidSeconds, PyramidSettings};

use glam::Vec3;

/// Smallest dot product of two unit normals whose surfaces are related (Christensen 1999; Gjøl et al., section 3).
pub const SURFACE_AGREEMENT: f32 = 0.9;

/// Whether two places lie on related surfaces, by their unit normals.
#[inline]
pub fn agree(a: Vec3, b: Vec3) -> bool {
    a.dot(b) >= SURFACE_AGREEMENT
}
