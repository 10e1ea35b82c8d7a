//! The start of what every item of this paper writes.

use crate::cli::failure::Failure;
pub use crate::cli::paper::output::Origin as Head;
use crate::cli::paper::output::{Done, write_files};
use crate::export::text::Canvas;
use crate::photons::StoredPhotons;
use crate::render::stats::StoredCounts;
use serde::Serialize;
use std::path::Path;

/// Size in the settings of what is no image.
pub const NO_IMAGE: [u32; 2] = [1, 1];

impl Head {
    /// Scene and settings in a line, for texts and pictures.
    pub fn subtitle(&self) -> String {
        let s = &self.settings;
        let (source, scene, [w, h]) = (self.source, &self.provenance.scene, s.size);
        // What has no image was given one pixel.
        let pixels = if s.size == NO_IMAGE { String::new() } else { format!(", {w}x{h} pixels, k = {}", s.k) };
        format!("{source}: {scene}{pixels}, seed {}", s.seed)
    }

    /// Writes the item's files. `text` follows the item's first line on the terminal.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn write<T: Serialize>(
        &self,
        folder: &Path,
        picture: &Canvas,
        csv: &str,
        report: &T,
        text: &str,
    ) -> Result<Done, Failure> {
        let json = write_files(folder, &self.files, &self.provenance, picture, csv, report)?;
        let text = format!("{} ({})\n\n{text}", self.item, self.subtitle());
        Ok(Done { json, text, warnings: self.warnings.clone() })
    }
}

/// Photons by kind.
pub fn counts(stored: &StoredPhotons) -> StoredCounts {
    StoredCounts {
        direct: stored.direct.len() as u64,
        caustic: stored.caustic.len() as u64,
        global: stored.global.len() as u64,
    }
}
