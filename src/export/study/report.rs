//! A study as JSON and CSV.

use crate::estimate::registry;
use crate::measure::Reference;
use crate::measure::study::pareto::Best;
use crate::measure::study::{Curve, Evaluation, Judge, StudyPlan};
use crate::render::film::Rect;
use serde::Serialize;
use std::fmt::Write;

/// The content of `study.json`.
#[derive(Debug, Serialize)]
pub struct StudyReport<'a> {
    /// Version of Cusp.
    pub version: &'static str,
    /// The command line.
    pub command: String,
    /// Name of the scene.
    pub scene: &'a str,
    /// Hash of the scene's files.
    pub scene_hash: &'a str,
    /// Pixels across and down of the images.
    pub size: [u32; 2],
    /// Seeds.
    pub seeds: &'a [u64],
    /// Tasks whose images are in it.
    pub tasks_done: usize,
    /// Tasks of the plan.
    pub tasks: usize,
    /// What errors are taken against.
    pub reference: ReferenceReport,
    /// Part of the reference that counts, besides its mask.
    pub crop: Option<Rect>,
    /// Share of the seconds that no part of a render accounts for, the median over all tasks: what keeping films and
    /// clocks costs.
    pub unaccounted: Option<f64>,
    /// The curves.
    pub curves: &'a [Curve],
    /// The best for each budget of time.
    pub pareto: &'a [Best],
}

/// The reference of a study.
#[derive(Debug, Serialize)]
pub struct ReferenceReport {
    /// Where it comes from.
    pub source: String,
    /// RMS of its own noise over its mean, over the pixels that count; None if unknown. No smaller error is told.
    pub noise: Option<f64>,
    /// Pixels that count.
    pub pixels: usize,
    /// Exposure of FLIP, stops.
    pub flip_exposure: f32,
}

impl ReferenceReport {
    /// Of a reference and who judges by it.
    pub fn new(reference: &Reference, judge: &Judge) -> Self {
        Self {
            source: reference.source.clone(),
            noise: judge.relative_noise(),
            pixels: judge.pixels(),
            flip_exposure: judge.exposure(),
        }
    }
}

impl<'a> StudyReport<'a> {
    /// A judged study.
    pub fn new(
        plan: &'a StudyPlan,
        evaluation: &'a Evaluation,
        reference: ReferenceReport,
        crop: Option<Rect>,
        tasks_done: usize,
    ) -> Self {
        let last = evaluation.curves.iter().flat_map(|c| c.points.chunk_by(|a, b| a.passes == b.passes).last());
        let shares = last.flatten().filter(|p| p.seconds > 0.0).map(|p| p.parts.other / p.seconds);
        Self {
            version: env!("CARGO_PKG_VERSION"),
            command: crate::export::provenance::command_line(),
            scene: &plan.scene_name,
            scene_hash: &plan.scene_hash,
            size: plan.base.size,
            seeds: &plan.seeds,
            tasks_done,
            tasks: plan.tasks().len(),
            reference,
            crop,
            unaccounted: crate::measure::study::curve::Spread::of(shares).map(|s| s.median),
            curves: &evaluation.curves,
            pareto: &evaluation.pareto,
        }
    }

    /// One line for each image. Errors are empty where they cannot be told from the reference's noise.
    pub fn csv(&self) -> String {
        let mut csv = String::from(
            "estimator,settings,gather,photons_per_pass,k,footprint_scale,seed,passes,photons,seconds,\
             bvh_s,plan_s,photon_trace_s,map_build_s,view_trace_s,gather_s,estimate_s,final_gather_s,other_s,\
             mse,rmse,relative_rmse,relative_mse,trimmed_mse,trimmed_relative_mse,smape,bias,flip,final_gather\n",
        );
        for curve in self.curves {
            let s = &curve.setting;
            let (id, own, final_gather) = registry::parts(&s.estimator);
            let gather = s.gather.name();
            let k = s.k.map_or(String::new(), |k| k.to_string());
            let scale = s.footprint_scale.map_or(String::new(), |f| f.to_string());
            for p in &curve.points {
                let t = &p.parts;
                let parts = [
                    t.bvh,
                    t.plan,
                    t.photon_trace,
                    t.map_build,
                    t.view_trace,
                    t.gather,
                    t.estimate,
                    t.final_gather,
                    t.other,
                ];
                let seconds = parts.map(|v| format!("{v:.6}")).join(",");
                let errors = match &p.error {
                    None => ",".repeat(8),
                    Some(e) => {
                        let m = &e.metrics;
                        let all = [
                            m.mse,
                            m.rmse,
                            m.relative_rmse,
                            m.relative_mse,
                            m.trimmed_mse,
                            m.trimmed_relative_mse,
                            m.smape,
                            m.bias,
                            e.flip,
                        ];
                        all.map(|v| format!("{v:.6e}")).join(",")
                    }
                };
                // Writing to a string cannot fail.
                let _ = writeln!(
                    csv,
                    "{id},\"{own}\",{gather},{},{k},{scale},{},{},{},{:.6},{seconds},{errors},\"{final_gather}\"",
                    s.photons, p.seed, p.passes, p.photons, p.seconds
                );
            }
        }
        csv
    }
}
