//! Linear RGB quantities.

use glam::{DVec3, Vec3};

/// A linear RGB triple: reflectance (no unit), flux (W), irradiance (W/m²) or radiance (W/(m² sr)).
pub type Rgb = Vec3;

/// Mean of the three channels, the scalar by which photons are shared and terminated.
///
/// In f64, so that channels near f32's largest number have a mean.
pub fn mean(c: Rgb) -> f32 {
    ((f64::from(c.x) + f64::from(c.y) + f64::from(c.z)) / 3.0) as f32
}

/// A sum in f32, and whether a channel was beyond its largest number, which then takes its place; no number is 0.
pub fn in_f32(sum: DVec3) -> (Rgb, bool) {
    let largest = f64::from(f32::MAX);
    if sum.abs().max_element() <= largest {
        return (sum.as_vec3(), false);
    }
    let bounded = sum.to_array().map(|c| if c.is_nan() { 0.0 } else { c.clamp(-largest, largest) as f32 });
    (Rgb::from_array(bounded), true)
}

/// Relative luminance with the Rec. 709 primaries.
pub fn luminance(c: Rgb) -> f32 {
    0.2126 * c.x + 0.7152 * c.y + 0.0722 * c.z
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sums_beyond_f32_are_bounded_and_told() {
        assert_eq!(in_f32(DVec3::new(1.0, 2.0, 3.0)), (Rgb::new(1.0, 2.0, 3.0), false));
        let (c, bounded) = in_f32(DVec3::new(1e39, f64::INFINITY, -1e300));
        assert!(bounded && c == Rgb::new(f32::MAX, f32::MAX, -f32::MAX));
        assert_eq!(in_f32(DVec3::new(f64::NAN, 1.0, f64::NAN)), (Rgb::Y, true));
        assert_eq!(mean(Rgb::splat(f32::MAX)), f32::MAX);
    }
}
