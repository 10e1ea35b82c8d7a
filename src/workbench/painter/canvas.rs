//! The image being painted, and how a colour goes onto it.

use egui::Color32;
use image::RgbaImage;
use std::ops::Range;

/// Premultiplied RGBA in gamma space, eight bits per channel, row 0 on top.
#[derive(Debug)]
pub struct Canvas {
    size: [u32; 2],
    pixels: Vec<[u8; 4]>,
}

impl Canvas {
    /// A canvas of `size` pixels, all of them `clear`.
    pub fn new(size: [u32; 2], clear: Color32) -> Self {
        Self { size, pixels: vec![clear.to_array(); size[0] as usize * size[1] as usize] }
    }

    /// The pixels of row `y` in the columns `columns`; none if that leaves the canvas.
    pub fn span(&mut self, y: u32, columns: Range<u32>) -> &mut [[u8; 4]] {
        if y >= self.size[1] || columns.end > self.size[0] {
            return &mut [];
        }
        let row = y as usize * self.size[0] as usize;
        self.pixels.get_mut(row + columns.start as usize..row + columns.end as usize).unwrap_or_default()
    }

    /// The image with straight alpha. What was added to a fully transparent pixel is lost.
    pub fn into_image(mut self) -> RgbaImage {
        for pixel in self.pixels.iter_mut().filter(|pixel| pixel[3] != 255) {
            *pixel = straight(*pixel);
        }
        RgbaImage::from_raw(self.size[0], self.size[1], self.pixels.into_flattened()).unwrap_or_default()
    }
}

/// Divides colour by alpha, rounded, at most 255.
fn straight(premultiplied: [u8; 4]) -> [u8; 4] {
    let [r, g, b, alpha] = premultiplied;
    match alpha {
        0 => [0; 4],
        255 => premultiplied,
        _ => {
            let a = u32::from(alpha);
            let divided = |c: u8| ((u32::from(c) * 255 + a / 2) / a).min(255) as u8;
            [divided(r), divided(g), divided(b), alpha]
        }
    }
}

/// Puts a premultiplied colour with channels in `[0, 255]` over a pixel, rounded to the nearest level.
///
/// Colour brighter than its alpha adds light; the sum is cut at 255.
#[inline]
pub fn blend(pixel: &mut [u8; 4], source: [f32; 4]) {
    let keep = (255.0 - source[3]) * (1.0 / 255.0);
    *pixel = std::array::from_fn(|c| level(source[c] + f32::from(pixel[c]) * keep));
}

/// The nearest of the 256 levels, a tie to the even one.
#[inline]
fn level(value: f32) -> u8 {
    // Branches and casts that become one vector instruction each: above 2²³ the last bits of a float count ones.
    const ONES: f32 = 8_388_608.0;
    let cut = if value < 255.0 { value } else { 255.0 };
    let cut = if cut > 0.0 { cut } else { 0.0 };
    (cut + ONES).to_bits() as u8
}

/// Puts one premultiplied colour over all pixels of a span.
pub fn blend_span(span: &mut [[u8; 4]], source: [f32; 4]) {
    if source[3] >= 255.0 {
        span.fill(source.map(level));
    } else if source != [0.0; 4] {
        for pixel in span {
            blend(pixel, source);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn blended(mut pixel: [u8; 4], source: [f32; 4]) -> [u8; 4] {
        blend(&mut pixel, source);
        pixel
    }

    #[test]
    fn translucent_over_opaque() {
        // keep = 1 − 128/255 = 0.498; 200·0.498 = 99.6; 100·0.498 + 64 = 113.8; 0 + 32 = 32.
        assert_eq!(blended([200, 100, 0, 255], [0.0, 64.0, 32.0, 128.0]), [100, 114, 32, 255]);
    }

    #[test]
    fn opaque_replaces_transparent_keeps_and_additive_adds() {
        let under = [12, 34, 56, 255];
        assert_eq!(blended(under, [9.0, 8.0, 7.0, 255.0]), [9, 8, 7, 255]);
        assert_eq!(blended(under, [0.0; 4]), under);
        assert_eq!(blended([12, 250, 56, 255], [10.0, 10.0, 0.0, 0.0]), [22, 255, 56, 255]);
    }

    #[test]
    fn alpha_gathers_over_a_translucent_ground() {
        // 128 + 128·(1 − 128/255) = 191.7.
        assert_eq!(blended([0, 0, 0, 128], [0.0, 0.0, 0.0, 128.0])[3], 192);
    }

    #[test]
    fn the_span_blends_as_the_pixel_does() {
        for source in [[5.0, 6.0, 7.0, 255.0], [5.5, 60.0, 0.0, 99.0], [0.0; 4], [9.0, 0.0, 0.0, 0.0]] {
            let mut span = [[40, 50, 60, 255]; 3];
            blend_span(&mut span, source);
            assert_eq!(span, [blended([40, 50, 60, 255], source); 3]);
        }
    }

    #[test]
    fn alpha_comes_out_straight() {
        assert_eq!(straight([64, 32, 0, 128]), [128, 64, 0, 128]);
        assert_eq!(straight([200, 0, 0, 100]), [255, 0, 0, 100]);
        assert_eq!(straight([9, 9, 9, 0]), [0; 4]);
        assert_eq!(straight([9, 8, 7, 255]), [9, 8, 7, 255]);
    }

    #[test]
    fn levels_are_rounded_and_cut() {
        let values = [0.0, 0.49, 0.51, 113.8, 254.4, 254.6, 255.0, 300.0, 1e30, f32::INFINITY, -0.3, -7.0, -1e30];
        assert_eq!(values.map(level), [0, 0, 1, 114, 254, 255, 255, 255, 255, 255, 0, 0, 0]);
        assert!((0..=255).all(|n| level(f32::from(n)) == n));
    }

    #[test]
    fn spans_outside_are_empty() {
        let mut canvas = Canvas::new([4, 2], Color32::BLACK);
        assert_eq!(canvas.span(1, 1..4).len(), 3);
        assert_eq!(canvas.span(2, 0..4).len(), 0);
        assert_eq!(canvas.span(0, 2..5).len(), 0);
    }
}
