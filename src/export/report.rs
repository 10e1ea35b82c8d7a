//! Reports of a render and of a comparison, as JSON and CSV.

use crate::export::Provenance;
use crate::export::final_gather::FinalGatherReport;
use crate::final_gather::GatherCounts;
use crate::measure::ErrorMetrics;
use crate::render::film::Rect;
use crate::render::memory::MemoryNeed;
use crate::render::renderer::Renderer;
use crate::render::settings::RenderSettings;
use crate::render::stats::{Bounded, Seconds, StoredCounts, peak_rss_bytes};
use crate::render::view_pass::PartSeconds;
use crate::render::{ErrorEstimate, Plan, StoppedBy};
use serde::Serialize;
use std::fmt::Write;

/// What a render was and what it cost: the content of `--stats`.
#[derive(Clone, Debug, Serialize)]
pub struct RenderReport {
    /// Where it comes from.
    #[serde(flatten)]
    pub provenance: Provenance,
    /// Estimator of `render`, or the first of a comparison.
    pub estimator: String,
    /// How photons were looked up.
    pub gather: crate::render::Gather,
    /// Which light is shown.
    pub light: crate::render::LightPart,
    /// Threads.
    pub threads: usize,
    /// Pixels across and down.
    pub size: [u32; 2],
    /// Finished passes.
    pub passes: u32,
    /// Photons emitted in all passes.
    pub photons_emitted: u64,
    /// Photons stored in all passes.
    pub photons_stored: StoredCounts,
    /// Wall seconds.
    pub seconds: Seconds,
    /// Rays of final gathering in all passes, and how they ended.
    pub gather_counts: GatherCounts,
    /// Final gathering of `estimator` in the last pass, if it runs.
    pub final_gather: Option<FinalGatherReport>,
    /// What ended the render; none for a comparison, whose work is fixed.
    pub stopped_by: Option<StoppedBy>,
    /// Error of the image as its passes tell it, of `estimator`; none below 12 passes.
    pub error_estimate: Option<ErrorEstimate>,
    /// Peak resident memory, where the system tells.
    pub peak_rss_bytes: Option<u64>,
    /// What a pass was expected to need of memory before it was begun.
    pub memory: Option<MemoryNeed>,
    /// What was limited.
    pub bounded: Bounded,
    /// What was odd.
    pub warnings: Vec<String>,
    /// All settings.
    pub settings: RenderSettings,
    /// What was needed and what was left out.
    pub plan: Plan,
}

impl RenderReport {
    /// Of a renderer; `load` and `total` are wall seconds.
    pub fn new(renderer: &Renderer, estimator: String, load: f64, total: f64) -> Self {
        let settings = renderer.settings().clone();
        Self {
            provenance: Provenance::new(renderer.scene(), settings.seed),
            estimator,
            gather: settings.gather,
            light: settings.light,
            threads: rayon::current_num_threads(),
            size: settings.size,
            passes: renderer.passes(),
            photons_emitted: renderer.emitted(),
            photons_stored: renderer.stored(),
            seconds: Seconds { load, ..*renderer.seconds() }.within(total),
            gather_counts: *renderer.gather_counts(),
            final_gather: final_gather(renderer, 0),
            stopped_by: None,
            error_estimate: renderer.error_estimate(),
            peak_rss_bytes: peak_rss_bytes(),
            memory: renderer.memory_need().copied(),
            bounded: *renderer.bounded(),
            warnings: renderer.warnings(),
            settings,
            plan: renderer.plan().clone(),
        }
    }
}

/// Final gathering of estimator `index` in the last pass, if it runs.
pub fn final_gather(renderer: &Renderer, index: usize) -> Option<FinalGatherReport> {
    let estimator = renderer.estimators().get(index)?;
    FinalGatherReport::new(renderer.last_pass()?, estimator.as_ref())
}

/// Seconds of one estimator in a comparison.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct EstimatorSeconds {
    /// By part.
    #[serde(flatten)]
    pub parts: PartSeconds,
    /// All parts.
    pub view_pass: f64,
}

/// One estimator of a comparison.
#[derive(Clone, Debug, Serialize)]
pub struct EstimatorReport {
    /// Id.
    pub id: String,
    /// Settings, empty without.
    pub settings: String,
    /// Final gathering, if it was asked for: as the command line takes it.
    pub final_gathering: Option<String>,
    /// What it looked things up in, if it runs.
    pub final_gather: Option<FinalGatherReport>,
    /// Wall seconds.
    pub seconds: EstimatorSeconds,
    /// Seconds of the view pass over those of `regular`, if it took part.
    pub ratio_to_regular: Option<f64>,
    /// Photons looked at for each pixel, the mean.
    pub photons_per_pixel: f64,
    /// Error against `regular` with 16×16 view rays on the same photons.
    pub error: Option<ErrorMetrics>,
    /// Error against the scene's reference.
    pub reference_error: Option<ErrorMetrics>,
    /// Files.
    pub files: Vec<String>,
}

/// Photon pass and map building with the plan, and with every part forced on.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct PlanCost {
    /// Seconds with the plan.
    pub needed_seconds: f64,
    /// Seconds with everything on.
    pub full_seconds: f64,
    /// Photons stored with the plan.
    pub needed_stored: u64,
    /// Photons stored with everything on.
    pub full_stored: u64,
}

/// A comparison: the content of `report.json`.
#[derive(Clone, Debug, Serialize)]
pub struct CompareReport {
    /// The render.
    #[serde(flatten)]
    pub render: RenderReport,
    /// The part that is enlarged.
    pub crop: Rect,
    /// What errors are taken against, and where.
    pub truth: Option<Rect>,
    /// The reference, if there is one.
    pub reference: Option<String>,
    /// What leaving parts out saves.
    pub plan_cost: Option<PlanCost>,
    /// The estimators.
    pub estimators: Vec<EstimatorReport>,
}

impl EstimatorReport {
    /// Its name, with settings and final gathering.
    pub fn name(&self) -> String {
        let colon = if self.settings.is_empty() { "" } else { ":" };
        let own = format!("{}{colon}{}", self.id, self.settings);
        self.final_gathering.as_ref().map_or(own.clone(), |f| format!("{own}+{f}"))
    }
}

impl CompareReport {
    /// One line for each estimator.
    pub fn timings_csv(&self) -> String {
        let mut csv = String::from(
            "estimator,settings,view_trace_s,gather_s,estimate_s,final_gather_s,view_pass_s,ratio_to_regular,photons_per_pixel,rmse,relative_rmse,relative_mse,reference_relative_rmse,final_gather\n",
        );
        let number = |x: Option<f64>| x.map_or(String::new(), |x| format!("{x:.6}"));
        for e in &self.estimators {
            let s = &e.seconds;
            // Writing to a string cannot fail.
            let _ = writeln!(
                csv,
                "{},\"{}\",{:.6},{:.6},{:.6},{:.6},{:.6},{},{:.3},{},{},{},{},\"{}\"",
                e.id,
                e.settings,
                s.parts.view_trace,
                s.parts.gather,
                s.parts.estimate,
                s.parts.final_gather,
                s.view_pass,
                number(e.ratio_to_regular),
                e.photons_per_pixel,
                number(e.error.map(|e| e.rmse)),
                number(e.error.map(|e| e.relative_rmse)),
                number(e.error.map(|e| e.relative_mse)),
                number(e.reference_error.map(|e| e.relative_rmse)),
                e.final_gathering.as_deref().unwrap_or(""),
            );
        }
        csv
    }
}
