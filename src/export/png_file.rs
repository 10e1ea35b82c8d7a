//! PNG with provenance in its text chunks.

use crate::export::Provenance;
use crate::export::whole_file::{self, WriteError};
use std::path::Path;

/// Writes an eight-bit RGB image of `size` pixels, row 0 on top.
///
/// # Errors
/// If the file cannot be written.
pub fn write(path: &Path, size: [u32; 2], rgb: &[u8], provenance: &Provenance) -> Result<(), WriteError> {
    write_with(path, size, rgb, &provenance.pairs())
}

/// As [`write`], with a text for each fact.
///
/// # Errors
/// If the file cannot be written.
pub fn write_with(path: &Path, size: [u32; 2], rgb: &[u8], facts: &[(&str, String)]) -> Result<(), WriteError> {
    let bytes = encode(size, rgb, facts).map_err(|e| WriteError { path: path.to_owned(), why: e.to_string() })?;
    whole_file::write(path, &bytes)
}

fn encode(size: [u32; 2], rgb: &[u8], facts: &[(&str, String)]) -> Result<Vec<u8>, png::EncodingError> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, size[0], size[1]);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.set_compression(png::Compression::Balanced);
    for (key, value) in facts {
        encoder.add_itxt_chunk((*key).to_owned(), value.clone())?;
    }
    encoder.write_header()?.write_image_data(rgb)?;
    Ok(bytes)
}
