//! The files of one panel of the window: its image and its numbers, whole and cropped, as EXR and as PNG.

use crate::export::false_color::{LABEL, color_bar};
use crate::export::text::{Canvas, Face};
use crate::export::tone::Look;
use crate::export::whole_file::WriteError;
use crate::export::{Provenance, exr_file, png_file};
use crate::render::film::{Image, Rect};
use std::path::Path;

/// Something that is written as EXR and PNG.
pub struct Picture {
    /// Lines of the label, the title first.
    pub label: Vec<String>,
    /// The pixels: radiance, or one value in all channels.
    pub image: Image,
    /// How they become bytes.
    pub look: Look,
    /// Facts for the header.
    pub facts: Vec<(&'static str, String)>,
}

/// The part that is cut out of all pictures.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Cut {
    /// Where.
    pub crop: Rect,
    /// Factor of enlargement, at least 1.
    pub enlarge: u32,
}

/// Longest side of a PNG, pixels: more than this is slow to write and few programs show it.
pub const LONGEST: u32 = 16_384;

impl Cut {
    /// A crop enlarged by `enlarge`, or by less if `columns` of it side by side would be longer than [`LONGEST`].
    pub fn new(crop: Rect, enlarge: u32, columns: u32) -> Self {
        let length = crop.width.saturating_mul(columns.max(1)).max(crop.height).max(1);
        Self { crop, enlarge: enlarge.clamp(1, (LONGEST / length).max(1)) }
    }
}

const GROUND: [u8; 3] = [40; 3];
const INK: [u8; 3] = [235; 3];
const FAINT: [u8; 3] = [175; 3];
/// Height of a line of a label, pixels.
const LINE: u32 = 16;
/// Height of its letters, pixels.
const LETTER: f32 = 13.0;
/// A letter of the fixed-width face is no wider, pixels.
const ADVANCE: u32 = 8;
const MARGIN: u32 = 4;
const BAR: u32 = 8;
/// Least width of a picture with a label, pixels.
pub const LEAST_WIDTH: u32 = 160;

impl Picture {
    /// Writes `NAME.exr`, `NAME.png`, `NAME_crop.exr` and `NAME_crop.png`; the crops only where the cut meets the
    /// image. Returns the names of the files.
    ///
    /// The PNG of the whole has the image's size, and a bar below if colours stand for values; that of the crop is
    /// enlarged and labelled.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn write(
        &self,
        folder: &Path,
        name: &str,
        cut: Cut,
        provenance: &Provenance,
    ) -> Result<Vec<String>, WriteError> {
        let facts: Vec<_> = provenance.pairs().into_iter().chain(self.facts.iter().cloned()).collect();
        let both = |name: &str, image: &Image, png: &Canvas| -> Result<[String; 2], WriteError> {
            let names = [format!("{name}.exr"), format!("{name}.png")];
            exr_file::write_with(&folder.join(&names[0]), image, &facts)?;
            png_file::write_with(&folder.join(&names[1]), png.size, &png.rgb, &facts)?;
            Ok(names)
        };
        let whole = match self.look {
            Look::Values(_) => self.labelled(&self.image, 1),
            Look::Tone(_) => Canvas { size: self.image.size, rgb: self.look.bytes(&self.image) },
        };
        let mut files = both(name, &self.image, &whole)?.to_vec();
        let part = cut.crop.within(self.image.size);
        if part.width > 0 && part.height > 0 {
            let crop = self.image.crop(part);
            files.extend(both(&format!("{name}_crop"), &crop, &self.labelled(&crop, cut.enlarge))?);
        }
        Ok(files)
    }

    /// The image in the top left corner, enlarged without smoothing; below it the label, and the bar of colours where
    /// they stand for values.
    fn labelled(&self, image: &Image, enlarge: u32) -> Canvas {
        let [w, h] = image.size.map(|n| n * enlarge);
        let width = w.max(LEAST_WIDTH);
        let lines: Vec<(usize, String)> = self
            .label
            .iter()
            .enumerate()
            .flat_map(|(i, line)| wrapped(line, (width - 2 * MARGIN) / ADVANCE).into_iter().map(move |l| (i, l)))
            .collect();
        let bar = if self.look.scale().is_some() { BAR + LABEL + 2 * MARGIN } else { 0 };
        let height = h + lines.len() as u32 * LINE + 2 * MARGIN + bar;
        let mut canvas = Canvas::new([width, height], GROUND);
        canvas.paste(0, 0, image.size, &self.look.bytes(image), enlarge);
        let mut y = h + MARGIN;
        for (i, line) in &lines {
            let ink = if *i == 0 { INK } else { FAINT };
            canvas.text(MARGIN, y, width - 2 * MARGIN, LETTER, ink, Face::Monospace, line);
            y += LINE;
        }
        if let Some(scale) = self.look.scale() {
            color_bar(&mut canvas, [MARGIN, y + MARGIN], [width - 2 * MARGIN, BAR], scale, INK);
        }
        canvas
    }
}

/// A line cut into lines of at most `columns` letters, after a comma, colon or space where there is one.
fn wrapped(line: &str, columns: u32) -> Vec<String> {
    let columns = columns.max(1) as usize;
    let mut rest: Vec<char> = line.chars().collect();
    let mut lines = Vec::new();
    while rest.len() > columns {
        let gap = rest[..columns].iter().rposition(|c| " ,:".contains(*c)).map_or(columns, |at| at + 1);
        let after = rest.split_off(gap);
        lines.push(rest.iter().collect());
        rest = after;
    }
    if !rest.is_empty() {
        lines.push(rest.iter().collect());
    }
    lines
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::export::tone::ToneMap;
    use glam::Vec3;

    #[test]
    fn lines_are_cut_at_gaps() {
        assert_eq!(wrapped("multi_sampled:n=8,grid=cells", 18), ["multi_sampled:n=8,", "grid=cells"]);
        assert_eq!(wrapped("abcdef", 4), ["abcd", "ef"]);
        assert!(wrapped("", 4).is_empty());
        assert_eq!(wrapped("ab", 0), ["a", "b"]);
    }

    #[test]
    fn enlargement_is_bounded() {
        let crop = Rect { x: 0, y: 0, width: 100, height: 2000 };
        assert_eq!(Cut::new(crop, 3, 4).enlarge, 3);
        assert_eq!(Cut::new(crop, 32, 4).enlarge, 8);
        assert_eq!(Cut::new(Rect { width: 60_000, ..crop }, 3, 4).enlarge, 1);
        assert_eq!(Cut::new(crop, 0, 1).enlarge, 1);
    }

    #[test]
    fn a_labelled_crop_keeps_its_pixels() {
        let pixels = (0..80 * 50).map(|i| Vec3::splat(i as f32 / 4000.0)).collect();
        let look = Look::Tone(ToneMap::srgb(1.0));
        let picture = Picture {
            label: vec!["a".into(), "b".into()],
            image: Image { size: [80, 50], pixels },
            look,
            facts: vec![],
        };
        let canvas = picture.labelled(&picture.image, 3);
        assert_eq!(canvas.size, [240, 150 + 2 * LINE + 2 * MARGIN]);
        let bytes = picture.look.bytes(&picture.image);
        for (x, y) in [(0, 0), (239, 149), (100, 77)] {
            let [at, from] = [3 * (y * 240 + x), 3 * (y / 3 * 80 + x / 3)];
            assert_eq!(canvas.rgb[at..at + 3], bytes[from..from + 3]);
        }
        assert!(canvas.rgb[3 * 150 * 240..].iter().any(|b| *b > 150), "there is ink below");
    }
}
