//! From radiance to eight bits: exposure and offset, then a curve or false colour.

use crate::export::false_color::{ColorMap, FalseColor, ValueRange};
use crate::export::session::{Curve, Tone};
use crate::math::elementary::pow;
use crate::math::rgb::{Rgb, luminance};
use crate::render::film::Image;
use std::sync::LazyLock;

/// Part of the pixels that may be brighter than white: a lamp in view should not darken what it lights.
const CLIPPED: f64 = 0.02;

/// Factor that brings the brightest pixels, but for the top two per cent, to white. 1 for a black image. Pixels that are
/// not finite have no say.
///
/// The same factor serves all images that are compared; take it from one of them.
pub fn auto_exposure(image: &Image) -> f32 {
    let mut values: Vec<f32> = image.pixels.iter().map(|p| luminance(*p)).filter(|l| l.is_finite()).collect();
    if values.is_empty() {
        return 1.0;
    }
    let last = values.len() - 1;
    let at = ((1.0 - CLIPPED) * last as f64) as usize;
    let (_, value, _) = values.select_nth_unstable_by(at, f32::total_cmp);
    // The reciprocal of a denormal is beyond 32 bits.
    if *value > 0.0 { (1.0 / *value).min(f32::MAX) } else { 1.0 }
}

/// The image times `exposure` through the sRGB curve (IEC 61966-2-1), three bytes for each pixel.
pub fn to_srgb(image: &Image, exposure: f32) -> Vec<u8> {
    image.pixels.iter().flat_map(|p| (*p * exposure).to_array().map(|x| SRGB.byte(x))).collect()
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

static SRGB: LazyLock<SrgbTable> = LazyLock::new(SrgbTable::new);

impl Default for SrgbTable {
    fn default() -> Self {
        Self::new()
    }
}

/// The curve x/(1 + x) on the luminance, colours kept (Reinhard et al. 2002, eq. 3). Negative values stay as they are; of
/// infinite ones only these count, and become 1.
pub fn reinhard(x: Rgb) -> Rgb {
    if x.max_element() == f32::INFINITY {
        return Rgb::from_array(x.to_array().map(|v| if v == f32::INFINITY { 1.0 } else { v.min(0.0) }));
    }
    let wide = x.as_dvec3();
    // In 64 bits, where the luminance of the largest numbers is one.
    let l = 0.2126 * wide.x + 0.7152 * wide.y + 0.0722 * wide.z;
    if l > 0.0 { (wide / (1.0 + l)).as_vec3() } else { x }
}

/// The colour map of that name; the first for a name that is none.
pub fn color_map(name: Option<&str>) -> ColorMap {
    ColorMap::ALL.into_iter().find(|m| Some(m.name()) == name).unwrap_or_default()
}

/// The scale of false colour for luminance: the tone's range, or from 0 to what is white at that exposure.
pub fn luminance_scale(tone: &Tone, exposure: f32) -> Option<FalseColor> {
    let map = color_map(Some(tone.false_color.as_deref()?));
    let white = libm::exp2f(-exposure);
    let range = tone.range.filter(|_| !tone.auto);
    Some(FalseColor::new(map, range.map_or(ValueRange::up_to(white), |[low, high]| ValueRange { low, high })))
}

/// A tone made ready for many pixels. The window's textures and exported PNG files have their bytes from here.
#[derive(Clone, Debug)]
pub struct ToneMap {
    scale: Option<FalseColor>,
    factor: f32,
    offset: f32,
    curve: Curve,
}

impl ToneMap {
    /// That of a tone whose exposure is `exposure` stops.
    pub fn new(tone: &Tone, exposure: f32) -> Self {
        Self {
            scale: luminance_scale(tone, exposure),
            factor: libm::exp2f(exposure),
            offset: tone.offset,
            curve: tone.curve,
        }
    }

    /// Radiance times `factor`, then the sRGB curve.
    pub fn srgb(factor: f32) -> Self {
        Self { scale: None, factor, offset: 0.0, curve: Curve::Srgb }
    }

    /// The scale of false colour, if it is on.
    pub fn scale(&self) -> Option<&FalseColor> {
        self.scale.as_ref()
    }

    /// The three bytes of a radiance. Below 0 is black, above 1 and NaN white, under every curve; false colour shows NaN
    /// as the low end.
    pub fn bytes(&self, table: &SrgbTable, radiance: Rgb) -> [u8; 3] {
        if let Some(scale) = &self.scale {
            return scale.color(luminance(radiance));
        }
        let mut x = radiance * self.factor + Rgb::splat(self.offset);
        if self.curve == Curve::Reinhard {
            x = reinhard(x);
        }
        let unit = |v: f32| if v.is_nan() { 1.0 } else { v.clamp(0.0, 1.0) };
        let byte = |v: f32| match self.curve {
            Curve::Srgb | Curve::Reinhard => table.byte(v),
            Curve::Gamma => (libm::powf(unit(v), 1.0 / 2.2) * 255.0 + 0.5) as u8,
            Curve::Linear => (unit(v) * 255.0 + 0.5) as u8,
        };
        x.to_array().map(byte)
    }
}

/// How an image becomes bytes.
#[derive(Clone, Debug)]
pub enum Look {
    /// It holds radiance.
    Tone(ToneMap),
    /// It holds the same value in all channels.
    Values(FalseColor),
}

impl Look {
    /// Three bytes for each pixel.
    pub fn bytes(&self, image: &Image) -> Vec<u8> {
        match self {
            Self::Tone(tone) => image.pixels.iter().flat_map(|p| tone.bytes(&SRGB, *p)).collect(),
            Self::Values(scale) => image.pixels.iter().flat_map(|p| scale.color(p.x)).collect(),
        }
    }

    /// The scale of colours, where colours stand for values.
    pub fn scale(&self) -> Option<&FalseColor> {
        match self {
            Self::Tone(tone) => tone.scale(),
            Self::Values(scale) => Some(scale),
        }
    }
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
    #[test]
    fn a_plain_tone_is_the_srgb_curve() {
        let pixels: Vec<Vec3> = (0..1000).map(|i| Vec3::new(i as f32, 3.0 * i as f32, -1.0) / 900.0).collect();
        let image = Image { size: [100, 10], pixels };
        let plain = ToneMap::new(&Tone::default(), 1.0);
        assert_eq!(Look::Tone(plain).bytes(&image), to_srgb(&image, 2.0));
        assert_eq!(Look::Tone(ToneMap::srgb(0.7)).bytes(&image), to_srgb(&image, 0.7));
    }

    #[test]
    fn offset_curve_and_false_colour_count() {
        let table = SrgbTable::new();
        let of = |tone: Tone| ToneMap::new(&tone, 0.0).bytes(&table, Vec3::splat(0.25));
        let plain = Tone::default();
        assert_eq!(of(Tone { offset: 0.25, curve: Curve::Linear, ..plain.clone() }), [128; 3]);
        assert_eq!(of(Tone { curve: Curve::Reinhard, ..plain.clone() }), [table.byte(0.2); 3]);
        let false_color = Some("viridis".to_owned());
        let scale = FalseColor::new(ColorMap::Viridis, ValueRange { low: 0.0, high: 0.5 });
        let fixed = Tone { auto: false, range: Some([0.0, 0.5]), false_color, ..plain };
        assert_eq!(of(fixed), scale.color(0.25));
    }
}
