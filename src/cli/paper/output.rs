//! What every item writes and prints.

use crate::cli::failure::Failure;
use crate::cli::paper::printed;
use crate::cli::paper::test_case::TestCase;
use crate::cli::to_json;
use crate::export::text::Canvas;
use crate::export::{Provenance, png_file, whole_file};
use crate::render::settings::RenderSettings;
use crate::render::stats::StoredCounts;
use crate::scene::Scene;
use serde::Serialize;
use std::path::Path;

/// What the thesis says of its test case.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct PrintedSetup {
    /// Caustic photons stored.
    pub stored_caustic: u64,
    /// Global photons stored.
    pub stored_global: u64,
    /// Nearest photons.
    pub k: i64,
    /// Factor on footprints in the listing.
    pub diff_smoothing: f64,
}

/// Where an item comes from: the start of every item's JSON.
#[derive(Clone, Debug, Serialize)]
pub struct Origin {
    /// Version, command, seed and scene.
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

impl Origin {
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
}

/// The same with what the thesis says of its test case.
#[derive(Clone, Debug, Serialize)]
pub struct Head {
    /// Where it comes from.
    #[serde(flatten)]
    pub origin: Origin,
    /// What the thesis says of the test case.
    pub printed_setup: PrintedSetup,
    /// Photons emitted.
    pub photons_emitted: u64,
    /// Photons stored.
    pub photons_stored: StoredCounts,
    /// Wall seconds of photons and maps.
    pub photon_seconds: f64,
}

impl Head {
    /// Of an item's test case.
    pub fn new(case: &TestCase, item: &'static str, source: &'static str) -> Self {
        let pass = &case.pass;
        let stored = &pass.photons.stored;
        let photons_stored = StoredCounts {
            direct: stored.direct.len() as u64,
            caustic: stored.caustic.len() as u64,
            global: stored.global.len() as u64,
        };
        let mut origin = Origin::new(item, source, &pass.scene, &pass.settings);
        if photons_stored == StoredCounts::default() {
            origin.warnings.push(format!("none of {} photons was stored", pass.photons.emitted));
        }
        Self {
            origin,
            printed_setup: PrintedSetup {
                stored_caustic: printed::STORED_CAUSTIC,
                stored_global: printed::STORED_GLOBAL,
                k: printed::K,
                diff_smoothing: printed::DIFF_SMOOTHING,
            },
            photons_emitted: pass.photons.emitted,
            photons_stored,
            photon_seconds: case.photon_seconds,
        }
    }

    /// The first line of the printed text.
    pub fn line(&self) -> String {
        let s = &self.origin.settings;
        format!(
            "{} ({}): ring, {}x{}, {} photons emitted, {} caustic stored ({} in print), footprint scale {}, k = {}, seed {}\n\n",
            self.origin.item,
            self.origin.source,
            s.size[0],
            s.size[1],
            self.photons_emitted,
            self.photons_stored.caustic,
            printed::STORED_CAUSTIC,
            s.footprint_scale,
            s.k,
            s.seed
        )
    }

    /// The line below the title of a picture.
    pub fn subtitle(&self) -> String {
        let s = &self.origin.settings;
        format!(
            "{}, {}x{} pixels, {} caustic photons stored, footprint scale {}, seed {}",
            self.origin.source, s.size[0], s.size[1], self.photons_stored.caustic, s.footprint_scale, s.seed
        )
    }
}

/// A finished item.
pub struct Done {
    /// Its JSON, with a line end.
    pub json: String,
    /// Its table, with what explains it.
    pub text: String,
    /// What was odd.
    pub warnings: Vec<String>,
}

impl Done {
    /// Writes picture, CSV and JSON of an item.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn write<T: Serialize>(
        folder: &Path,
        head: &Head,
        picture: &Canvas,
        csv: &str,
        report: &T,
        text: &str,
    ) -> Result<Self, Failure> {
        let json = write_files(folder, &head.origin.files, &head.origin.provenance, picture, csv, report)?;
        Ok(Self { json, text: head.line() + text, warnings: head.origin.warnings.clone() })
    }
}

/// Writes picture, CSV and JSON under the names `files`, in this order; returns the JSON.
///
/// # Errors
/// A file that cannot be written.
pub fn write_files<T: Serialize>(
    folder: &Path,
    files: &[String; 3],
    provenance: &Provenance,
    picture: &Canvas,
    csv: &str,
    report: &T,
) -> Result<String, Failure> {
    let [png, csv_file, json_file] = files;
    let json = to_json(report)?;
    png_file::write(&folder.join(png), picture.size, &picture.rgb, provenance)?;
    whole_file::write(&folder.join(csv_file), csv.as_bytes())?;
    whole_file::write(&folder.join(json_file), json.as_bytes())?;
    Ok(json)
}
