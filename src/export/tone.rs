//! From radiance to eight bits: exposure, then the sRGB curve.

use crate::math::elementary::pow;
use crate::math::rgb::luminance;
use crate::render::film::Image;

/// Part of the pixels that may be brighter than white: a lamp in view should not darken what it lights.
const CLIPPED: f64 = 0.02;

/// Factor that brings the brightest pixels, but for the top two per cent, to white. 1 for a black image.
///
/// The same factor serves all images that are compared; take it from one of them.
pub fn auto_exposure(image: &Image) -> f32 {
    let mut values: Vec<f32> = image.pixels.iter().map(|p| luminance(*p)).collect();
    if values.is_empty() {
        return 1.0;
    }
    let last = values.len() - 1;
    let at = ((1.0 - CLIPPED) * last as f64) as usize;
    let (_, value, _) = values.select_nth_unstable_by(at, f32::total_cmp);
    if *value > 0.0 && value.is_finite() { 1.0 / *value } else { 1.0 }
}

/// The image times `exposure` through the sRGB curve (IEC 61966-2-1), three bytes for each pixel.
pub fn to_srgb(image: &Image, exposure: f32) -> Vec<u8> {
    image.pixels.iter().flat_map(|p| (*p * exposure).to_array().map(srgb_byte)).collect()
}

/// A linear value as an sRGB byte; below 0 black, above 1 and NaN white.
fn srgb_byte(x: f32) -> u8 {
    let x = if x.is_nan() { 1.0 } else { x.clamp(0.0, 1.0) };
    let curved = if x <= 0.003_130_8 { 12.92 * x } else { 1.055 * pow(x, 1.0 / 2.4) - 0.055 };
    (curved * 255.0 + 0.5) as u8
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::texture::srgb_to_linear;
    use glam::Vec3;

    #[test]
    fn curve_is_the_inverse_of_the_decoder() {
        for byte in 0..=255u8 {
            assert_eq!(srgb_byte(srgb_to_linear(f32::from(byte) / 255.0)), byte);
        }
        assert_eq!((srgb_byte(f32::NAN), srgb_byte(-1.0), srgb_byte(f32::INFINITY)), (255, 0, 255));
    }

    #[test]
    fn exposure_ignores_a_few_fireflies() {
        let mut image = Image::black([100, 100]);
        image.pixels.fill(Vec3::splat(0.5));
        image.pixels[3] = Vec3::splat(1e6);
        assert_eq!(auto_exposure(&image), 2.0);
        assert_eq!(auto_exposure(&Image::black([2, 2])), 1.0);
    }
}
