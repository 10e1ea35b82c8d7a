//! OpenEXR: linear radiance, float32 R G B, row 0 on top.

use crate::export::Provenance;
use crate::export::whole_file::{self, WriteError};
use crate::measure::image_file::NotFinite;
use crate::render::film::Image;
use exr::prelude::{
    AttributeValue, Encoding, Image as ExrImage, Layer, LayerAttributes, SpecificChannels, Text, Vec2, WritableImage,
};
use std::io::Cursor;
use std::path::Path;

/// Writes an image with its provenance in the header.
///
/// # Errors
/// If the file cannot be written.
pub fn write(path: &Path, image: &Image, provenance: &Provenance) -> Result<(), WriteError> {
    write_with(path, image, &provenance.pairs())
}

/// As [`write`], with these facts in the header.
///
/// # Errors
/// If the file cannot be written, or a pixel is not finite: a film holds no such pixel, and nobody could use it.
pub fn write_with(path: &Path, image: &Image, facts: &[(&str, String)]) -> Result<(), WriteError> {
    let wrong = |why: String| WriteError { path: path.to_owned(), why };
    if let Some(odd) = NotFinite::of(image) {
        return Err(wrong(format!("{odd}; this is a defect")));
    }
    let [w, h] = image.size;
    let channels = SpecificChannels::rgb(|Vec2(x, y)| {
        let p = image.at(x as u32, y as u32);
        (p.x, p.y, p.z)
    });
    // One attribute: the library keeps them without an order, and the same image should give the same bytes.
    let mut attributes = LayerAttributes::default();
    let facts: Vec<String> = facts.iter().map(|(k, v)| format!("{k} = {v}")).collect();
    attributes.other.insert(Text::from("cusp"), AttributeValue::Text(ascii(&facts.join("\n"))));
    let layer = Layer::new((w as usize, h as usize), attributes, Encoding::SMALL_LOSSLESS, channels);
    let mut bytes = Vec::new();
    ExrImage::from_layer(layer)
        .write()
        .non_parallel()
        .to_buffered(Cursor::new(&mut bytes))
        .map_err(|e| wrong(e.to_string()))?;
    whole_file::write(path, &bytes)
}

/// EXR text is single bytes; anything else becomes a question mark.
fn ascii(text: &str) -> Text {
    let plain: String = text.chars().map(|c| if c.is_ascii() { c } else { '?' }).collect();
    Text::from(plain.as_str())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::measure::Reference;
    use glam::Vec3;

    #[test]
    fn an_image_comes_back_bit_by_bit() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let path = folder.path().join("a.exr");
        let image =
            Image { size: [3, 2], pixels: (0..6).map(|i| Vec3::new(i as f32, 0.1 * i as f32, 1e-20)).collect() };
        let provenance = Provenance {
            version: "1".into(),
            command: "cusp render ring".into(),
            seed: 4,
            scene: "é".into(),
            scene_hash: "00".into(),
        };
        write(&path, &image, &provenance).expect("writes");
        let back = Reference::from_files(&path, None).expect("reads");
        assert_eq!(back.image, image);
        let bytes = std::fs::read(&path).expect("reads");
        write(&path, &image, &provenance).expect("writes");
        assert_eq!(std::fs::read(&path).expect("reads"), bytes, "the same bytes each time");
        assert!(bytes.windows(16).any(|w| w == b"cusp render ring"));
    }
}
