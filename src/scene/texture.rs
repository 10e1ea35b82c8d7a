//! Image textures.

use crate::math::elementary::pow;
use crate::math::rgb::Rgb;
use crate::scene::memory;
use glam::Vec2;
use image::{ImageFormat, ImageReader};
use std::io::Cursor;

/// An image of linear reflectances, repeated over the plane.
#[derive(Clone, Debug, PartialEq)]
pub struct Texture {
    size: [u32; 2],
    texels: Vec<Rgb>,
    average: Rgb,
}

impl Texture {
    /// Decodes a PNG; its values are taken as sRGB and made linear.
    ///
    /// # Errors
    /// The reason, if the bytes are no PNG or the picture is too large.
    pub fn decode(png: &[u8]) -> Result<Self, String> {
        Self::decode_as(png, ImageFormat::Png)
    }

    /// As [`Texture::decode`], of an image of that format: PNG, JPEG or TGA.
    ///
    /// # Errors
    /// The reason, if the bytes are no such image or the picture is too large.
    pub fn decode_as(bytes: &[u8], format: ImageFormat) -> Result<Self, String> {
        let one_line = |e: image::ImageError| e.to_string().split_whitespace().collect::<Vec<_>>().join(" ");
        let reader = || ImageReader::with_format(Cursor::new(bytes), format);
        let (width, height) = reader().into_dimensions().map_err(one_line)?;
        let pixels = u64::from(width) * u64::from(height);
        // Up to 16 bits in four channels as they are decoded, beside eight bits in three and the texels.
        let needed = memory::bytes(pixels, 8 + 3 + size_of::<Rgb>());
        memory::check(format!("a picture of {width}x{height} pixels"), needed, "make it smaller")
            .map_err(|e| e.to_string())?;
        let mut reader = reader();
        reader.no_limits();
        let image = reader.decode().map_err(one_line)?.to_rgb8();
        let table: Vec<f32> = (0..256).map(|i| srgb_to_linear(i as f32 / 255.0)).collect();
        let texels = image.pixels().map(|p| Rgb::from_array(p.0.map(|c| table[c as usize]))).collect();
        Ok(Self::new([image.width(), image.height()], texels))
    }

    fn new(size: [u32; 2], texels: Vec<Rgb>) -> Self {
        let sum: glam::DVec3 = texels.iter().map(|t| t.as_dvec3()).sum();
        let average = if texels.is_empty() { Rgb::ONE } else { (sum / texels.len() as f64).as_vec3() };
        Self { size, texels, average }
    }

    /// Mean of all texels.
    pub fn average(&self) -> Rgb {
        self.average
    }

    /// Bilinear sample; `v` grows upwards, both coordinates repeat with period 1.
    pub fn sample(&self, uv: Vec2) -> Rgb {
        if self.texels.is_empty() || !uv.is_finite() {
            return Rgb::ONE;
        }
        let [w, h] = self.size;
        let x = (uv.x - uv.x.floor()) * w as f32 - 0.5;
        let y = (1.0 - (uv.y - uv.y.floor())) * h as f32 - 0.5;
        let (fx, fy) = (x - x.floor(), y - y.floor());
        let at = |i: f32, j: f32| {
            let i = (i as i64).rem_euclid(i64::from(w)) as usize;
            let j = (j as i64).rem_euclid(i64::from(h)) as usize;
            self.texels[j * w as usize + i]
        };
        let (x, y) = (x.floor(), y.floor());
        let top = at(x, y).lerp(at(x + 1.0, y), fx);
        let bottom = at(x, y + 1.0).lerp(at(x + 1.0, y + 1.0), fx);
        top.lerp(bottom, fy)
    }
}

/// Inverse of the sRGB transfer curve (IEC 61966-2-1).
pub fn srgb_to_linear(c: f32) -> f32 {
    if c <= 0.04045 { c / 12.92 } else { pow((c + 0.055) / 1.055, 2.4) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn samples_texel_centres_and_repeats() {
        let t = Texture::new([2, 2], vec![Rgb::X, Rgb::Y, Rgb::Z, Rgb::ONE]);
        assert_eq!(t.average(), Rgb::splat(0.5));
        assert_eq!(t.sample(Vec2::new(0.25, 0.75)), Rgb::X);
        assert_eq!(t.sample(Vec2::new(0.75, 0.75)), Rgb::Y);
        assert_eq!(t.sample(Vec2::new(0.25, 0.25)), Rgb::Z);
        assert_eq!(t.sample(Vec2::new(-0.25, 1.25)), Rgb::ONE);
        assert_eq!(t.sample(Vec2::new(0.5, 0.5)), (Rgb::X + Rgb::Y + Rgb::Z + Rgb::ONE) / 4.0);
    }
}
