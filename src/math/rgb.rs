//! Linear RGB quantities.

use glam::Vec3;

/// A linear RGB triple: reflectance (no unit), flux (W), irradiance (W/m²) or radiance (W/(m² sr)).
pub type Rgb = Vec3;

/// Mean of the three channels, the scalar by which photons are shared and terminated.
pub fn mean(c: Rgb) -> f32 {
    (c.x + c.y + c.z) / 3.0
}

/// Relative luminance with the Rec. 709 primaries.
pub fn luminance(c: Rgb) -> f32 {
    0.2126 * c.x + 0.7152 * c.y + 0.0722 * c.z
}
