//! Text drawn into images, in the fonts that the workbench uses.

use ab_glyph::{Font, FontRef, PxScale, ScaleFont, point};

/// Eight-bit RGB, row 0 on top.
#[derive(Clone, Debug)]
pub struct Canvas {
    /// Pixels across and down.
    pub size: [u32; 2],
    /// Three bytes for each pixel.
    pub rgb: Vec<u8>,
}

/// Which face.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Face {
    /// For words.
    Proportional,
    /// For numbers.
    Monospace,
}

impl Canvas {
    /// A canvas of one colour.
    pub fn new(size: [u32; 2], color: [u8; 3]) -> Self {
        Self { size, rgb: color.repeat(size[0] as usize * size[1] as usize) }
    }

    /// Fills a rectangle; what lies outside the canvas is left out.
    pub fn fill(&mut self, x: u32, y: u32, width: u32, height: u32, color: [u8; 3]) {
        for j in y..y.saturating_add(height).min(self.size[1]) {
            for i in x..x.saturating_add(width).min(self.size[0]) {
                self.set(i, j, color);
            }
        }
    }

    /// Copies an image of `size` pixels, each enlarged to `factor`×`factor` without smoothing.
    pub fn paste(&mut self, x: u32, y: u32, size: [u32; 2], rgb: &[u8], factor: u32) {
        for j in 0..size[1] * factor {
            for i in 0..size[0] * factor {
                let from = 3 * ((j / factor) as usize * size[0] as usize + (i / factor) as usize);
                if x + i < self.size[0] && y + j < self.size[1] {
                    self.set(x + i, y + j, [rgb[from], rgb[from + 1], rgb[from + 2]]);
                }
            }
        }
    }

    /// This canvas with `other` below it; the narrower one is filled up with its own first pixel's colour.
    pub fn above(self, other: &Self) -> Self {
        let width = self.size[0].max(other.size[0]);
        let widened = |c: &Self| {
            let ground = c.rgb.get(..3).map_or([0; 3], |p| [p[0], p[1], p[2]]);
            let mut wide = Self::new([width, c.size[1]], ground);
            wide.paste(0, 0, c.size, &c.rgb, 1);
            wide.rgb
        };
        let mut rgb = widened(&self);
        rgb.extend(widened(other));
        Self { size: [width, self.size[1] + other.size[1]], rgb }
    }

    /// Where the bytes of a pixel begin.
    fn place(&self, x: u32, y: u32) -> usize {
        3 * (y as usize * self.size[0] as usize + x as usize)
    }

    fn set(&mut self, x: u32, y: u32, color: [u8; 3]) {
        let at = self.place(x, y);
        self.rgb[at..at + 3].copy_from_slice(&color);
    }

    /// Draws one line of text whose top left corner is `(x, y)`, `height` pixels high, cut off at `width` pixels.
    #[expect(clippy::too_many_arguments, reason = "a place, a size and a style")]
    pub fn text(&mut self, x: u32, y: u32, width: u32, height: f32, color: [u8; 3], face: Face, text: &str) {
        let Some(font) = font(face) else { return };
        let scaled = font.as_scaled(PxScale::from(height));
        let mut pen = 0.0f32;
        for c in text.chars() {
            let id = font.glyph_id(c);
            let advance = scaled.h_advance(id);
            if pen + advance > width as f32 {
                return;
            }
            let origin = point(x as f32 + pen, y as f32 + scaled.ascent());
            if let Some(outline) = font.outline_glyph(id.with_scale_and_position(height, origin)) {
                let bounds = outline.px_bounds();
                outline.draw(|gx, gy, coverage| {
                    let (px, py) = (bounds.min.x as i64 + i64::from(gx), bounds.min.y as i64 + i64::from(gy));
                    if px >= 0 && py >= 0 && px < i64::from(self.size[0]) && py < i64::from(self.size[1]) {
                        self.blend(px as u32, py as u32, color, coverage);
                    }
                });
            }
            pen += advance;
        }
    }

    /// Lays a colour over a pixel, which must be inside, as far as it covers it, 0 to 1.
    pub fn blend(&mut self, x: u32, y: u32, color: [u8; 3], coverage: f32) {
        let at = self.place(x, y);
        let c = coverage.clamp(0.0, 1.0);
        for (under, over) in self.rgb[at..at + 3].iter_mut().zip(color) {
            *under = (f32::from(*under) * (1.0 - c) + f32::from(over) * c + 0.5) as u8;
        }
    }
}

fn font(face: Face) -> Option<FontRef<'static>> {
    let bytes = match face {
        Face::Proportional => epaint_default_fonts::UBUNTU_LIGHT,
        Face::Monospace => epaint_default_fonts::HACK_REGULAR,
    };
    FontRef::try_from_slice(bytes).ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_leaves_ink_inside_its_box_only() {
        let mut canvas = Canvas::new([120, 40], [0; 3]);
        canvas.text(10, 10, 60, 16.0, [255; 3], Face::Monospace, "integrated and much more");
        let ink = |x: u32, y: u32| canvas.rgb[3 * (y * 120 + x) as usize] > 0;
        assert!((10..70).any(|x| (10..28).any(|y| ink(x, y))));
        assert!((72..120).all(|x| (0..40).all(|y| !ink(x, y))));
    }

    #[test]
    fn canvases_stand_above_each_other() {
        let both = Canvas::new([2, 1], [1; 3]).above(&Canvas::new([3, 2], [2; 3]));
        assert_eq!((both.size, both.rgb), ([3, 3], [[1u8; 9], [2; 9], [2; 9]].concat()));
    }

    #[test]
    fn pasting_enlarges_without_smoothing() {
        let mut canvas = Canvas::new([5, 4], [9; 3]);
        canvas.paste(1, 0, [2, 1], &[1, 1, 1, 2, 2, 2], 2);
        let row: Vec<u8> = (0..5).map(|x| canvas.rgb[3 * (5 + x)]).collect();
        assert_eq!(row, [9, 1, 1, 2, 2]);
        assert_eq!(canvas.rgb[3 * 10], 9);
    }
}
