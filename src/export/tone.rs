//! From radiance to eight bits: exposure, then the sRGB curve.

use crate::math::elementary::pow;
use crate::math::rgb::{Rgb, luminance};
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

/// The sRGB curve as a table, for many pixels: the same bytes as the exact curve gives.
pub struct SrgbTable {
    /// Byte at the start of each of equal steps of the linear value.
    start: Vec<u8>,
    /// Least linear value that gives each byte.
    least: [f32; 256],
}

/// Steps of [`SrgbTable`], more than the steepest part of the curve has bytes.
const STEPS: usize = 4096;

impl SrgbTable {
    /// Computes the table.
    pub fn new() -> Self {
        let mut least = [0.0; 256];
        for (byte, value) in least.iter_mut().enumerate().skip(1) {
            // Bisection over the bits of positive floats, which are in order.
            let (mut low, mut high) = (0u32, 1f32.to_bits());
            while low < high {
                let middle = low + (high - low) / 2;
                if usize::from(srgb_byte(f32::from_bits(middle))) >= byte { high = middle } else { low = middle + 1 }
            }
            *value = f32::from_bits(low);
        }
        Self { start: (0..=STEPS).map(|i| srgb_byte(i as f32 / STEPS as f32)).collect(), least }
    }

    /// A linear value as an sRGB byte; below 0 black, above 1 and NaN white.
    #[inline]
    pub fn byte(&self, x: f32) -> u8 {
        if x.is_nan() || x >= 1.0 {
            return 255;
        }
        let x = x.max(0.0);
        let mut byte = self.start[(x * STEPS as f32) as usize];
        while byte < 255 && x >= self.least[usize::from(byte) + 1] {
            byte += 1;
        }
        byte
    }
}

impl Default for SrgbTable {
    fn default() -> Self {
        Self::new()
    }
}

/// The curve x/(1 + x) on the luminance, colours kept (Reinhard et al. 2002, eq. 3). Negative values stay as they are.
pub fn reinhard(x: Rgb) -> Rgb {
    let l = luminance(x);
    if l > 0.0 { x / (1.0 + l) } else { x }
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
    fn table_gives_the_bytes_of_the_curve() {
        let table = SrgbTable::new();
        for i in 0..200_000u32 {
            let x = i as f32 / 199_000.0;
            assert_eq!(table.byte(x), srgb_byte(x), "{x}");
        }
        for x in [f32::NAN, -1.0, f32::INFINITY, f32::MIN_POSITIVE, 1.0] {
            assert_eq!(table.byte(x), srgb_byte(x), "{x}");
        }
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
