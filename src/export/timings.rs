//! What each estimator of the window cost, as CSV and JSON.

use crate::export::Provenance;
use crate::measure::ErrorMetrics;
use crate::render::settings::RenderSettings;
use crate::render::stats::{Seconds, StoredCounts};
use crate::render::view_pass::PartSeconds;
use serde::Serialize;
use std::fmt::Write;

/// One estimator.
#[derive(Clone, Debug, Serialize)]
pub struct EstimatorTimings {
    /// Name with settings.
    pub estimator: String,
    /// Passes that are in its image.
    pub passes: u32,
    /// Seconds of those passes.
    pub seconds: PassSeconds,
    /// Error against the reference, if there is one that fits.
    pub error: Option<ErrorMetrics>,
}

/// Wall seconds of an estimator's passes.
#[derive(Clone, Copy, Debug, Default, Serialize)]
pub struct PassSeconds {
    /// Photons and maps, which all estimators of a pass share.
    pub photons_and_maps: f64,
    /// Its view passes by part.
    #[serde(flatten)]
    pub view: PartSeconds,
    /// All of these.
    pub total: f64,
}

impl PassSeconds {
    /// The sum of photons and maps and of the view passes.
    pub fn new(photons_and_maps: f64, view: PartSeconds) -> Self {
        Self { photons_and_maps, view, total: photons_and_maps + view.total() }
    }
}

/// The content of `timings.json`.
#[derive(Clone, Debug, Serialize)]
pub struct Timings {
    /// Where it comes from.
    #[serde(flatten)]
    pub provenance: Provenance,
    /// Pixels across and down.
    pub size: [u32; 2],
    /// Photons emitted in all passes.
    pub photons_emitted: u64,
    /// Photons stored in all passes.
    pub photons_stored: StoredCounts,
    /// Wall seconds of all passes by part.
    pub seconds: Seconds,
    /// What errors are taken against.
    pub reference: Option<String>,
    /// All settings.
    pub settings: RenderSettings,
    /// The estimators.
    pub estimators: Vec<EstimatorTimings>,
}

impl Timings {
    /// One line for each estimator. Empty fields are unknown.
    pub fn csv(&self) -> String {
        let mut csv = String::from(
            "estimator,passes,photons_and_maps_s,view_trace_s,gather_s,estimate_s,final_gather_s,total_s,photons_emitted,rmse,relative_rmse,relative_mse\n",
        );
        let number = |x: Option<f64>| x.map_or(String::new(), |x| format!("{x:.6e}"));
        for e in &self.estimators {
            let s = &e.seconds;
            // Writing to a string cannot fail.
            let _ = writeln!(
                csv,
                "\"{}\",{},{:.6},{:.6},{:.6},{:.6},{:.6},{:.6},{},{},{},{}",
                e.estimator,
                e.passes,
                s.photons_and_maps,
                s.view.view_trace,
                s.view.gather,
                s.view.estimate,
                s.view.final_gather,
                s.total,
                self.photons_emitted,
                number(e.error.map(|e| e.rmse)),
                number(e.error.map(|e| e.relative_rmse)),
                number(e.error.map(|e| e.relative_mse)),
            );
        }
        csv
    }
}
