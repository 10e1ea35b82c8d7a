//! The start of what every item of this paper writes.

use crate::cli::failure::Failure;
use crate::cli::paper::output::{Done, write_files};
use crate::export::Provenance;
use crate::export::text::Canvas;
use crate::photons::StoredPhotons;
use crate::render::settings::RenderSettings;
use crate::render::stats::StoredCounts;
use crate::scene::Scene;
use serde::Serialize;
use std::path::Path;

/// Size in the settings of what is no image.
pub const NO_IMAGE: [u32; 2] = [1, 1];

/// The start of an item's JSON.
#[derive(Clone, Debug, Serialize)]
pub struct Head {
    /// Where it comes from.
    #[serde(flatten)]
    pub provenance: Provenance,
    /// The item.
    pub item: &'static str,
    /// What it reproduces.
    pub source: &'static str,
    /// Threads.
    pub threads: usize,
    /// All settings, with the most photons that were emitted at once.
    pub settings: RenderSettings,
    /// What was defined but odd.
    pub warnings: Vec<String>,
    /// The files, in the item's folder.
    pub files: [String; 3],
}

impl Head {
    /// Of an item.
    pub fn new(item: &'static str, source: &'static str, scene: &Scene, settings: &RenderSettings) -> Self {
        Self {
            provenance: Provenance::new(scene, settings.seed),
            item,
            source,
            threads: rayon::current_num_threads(),
            settings: settings.clone(),
            warnings: scene.warnings.clone(),
            files: ["png", "csv", "json"].map(|e| format!("{item}.{e}")),
        }
    }

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
