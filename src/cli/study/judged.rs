//! From the images of a study to its files and tables.

use crate::cli::failure::Failure;
use crate::cli::flags::rect;
use crate::cli::study::judged_text::text;
use crate::cli::study::own_reference;
use crate::cli::study::truth::Given;
use crate::cli::{print, to_json};
use crate::export::study::report::ReferenceReport;
use crate::export::study::{Store, StudyReport, picture};
use crate::export::tone::auto_exposure;
use crate::export::{plot, png_file, whole_file};
use crate::measure::study::study_plan::Task;
use crate::measure::study::{Evaluation, Judge, StudyPlan, TaskRecord};
use crate::render::film::{Image, Rect};
use crate::scene::Scene;
use clap::Args;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// How images are judged.
#[derive(Clone, Debug, Default, Args)]
pub struct JudgeFlags {
    /// Image to take errors against (EXR of linear radiance, or PNG), instead of a built-in scene's own
    #[arg(long, value_name = "R")]
    pub reference: Option<PathBuf>,
    /// Pixels of it that count (PNG, white)
    #[arg(long, value_name = "M.png", requires = "reference")]
    pub mask: Option<PathBuf>,
    /// Part of it that counts: x,y,width,height
    #[arg(long, value_name = "X,Y,W,H", value_parser = rect)]
    pub crop: Option<Rect>,
    /// Render a reference though the scene has a stored one
    #[arg(long, conflicts_with = "reference")]
    pub own_reference: bool,
    /// Seconds that rendering a reference may take
    #[arg(long, value_name = "S", default_value_t = 60.0, allow_negative_numbers = true)]
    pub reference_seconds: f64,
}

/// A study whose tasks are done, each with the folder that holds its images.
pub struct Study {
    /// What was rendered.
    pub plan: StudyPlan,
    /// The scene, if it is there.
    pub scene: Option<Arc<Scene>>,
    /// Finished tasks.
    pub records: Vec<(TaskRecord, Store)>,
}

impl Study {
    /// Judges the images, writes `study.csv`, `study.json` and `study.png` to `out`, and prints.
    ///
    /// # Errors
    /// An image that cannot be read, a reference that cannot be made, or a file that cannot be written.
    pub fn judge(&self, flags: &JudgeFlags, given: Given, out: &Path, json: bool, quiet: bool) -> Result<(), Failure> {
        let reference = match given {
            Given::Reference(reference) => *reference,
            Given::None => own_reference::make(self, flags, out, json || quiet)?,
        };
        let exposure = libm::log2f(auto_exposure(&reference.image));
        let judge = Judge::new(&reference, flags.crop, exposure).map_err(Failure::Call)?;
        let records = self.task_records();
        let evaluation =
            Evaluation::new(&self.plan, &records, &judge, &|t, p| self.image(t, p)).map_err(Failure::Work)?;
        let facts = ReferenceReport::new(&reference, &judge);
        let report = StudyReport::new(&self.plan, &evaluation, facts, flags.crop, records.len());
        let whole = to_json(&report)?;
        whole_file::write(&out.join("study.json"), whole.as_bytes())?;
        whole_file::write(&out.join("study.csv"), report.csv().as_bytes())?;
        let canvas = plot::draw(&picture::plot(&report)).map_err(Failure::Work)?;
        let facts = [
            ("cusp.version", report.version.to_owned()),
            ("cusp.command", report.command.clone()),
            ("cusp.scene", report.scene.to_owned()),
            ("cusp.scene_hash", report.scene_hash.to_owned()),
        ];
        png_file::write_with(&out.join("study.png"), canvas.size, &canvas.rgb, &facts)?;
        if json {
            print(&whole)
        } else if quiet {
            Ok(())
        } else {
            print(&text(&report, out))
        }
    }

    /// Its finished tasks.
    pub fn task_records(&self) -> Vec<TaskRecord> {
        self.records.iter().map(|r| r.0.clone()).collect()
    }

    /// The image of a task after so many passes.
    ///
    /// # Errors
    /// A file that is missing or damaged.
    pub fn image(&self, task: Task, passes: u32) -> Result<Image, String> {
        let of = |r: &TaskRecord| r.setting == task.setting && r.seed == task.seed;
        match self.records.iter().find(|(r, _)| of(r)) {
            Some((_, store)) => store.image(task, passes),
            None => Err(format!("task {} is not done", task.name())),
        }
    }
}
