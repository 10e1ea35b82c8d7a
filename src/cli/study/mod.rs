//! `cusp study`: error against run time, for every combination of settings.

pub mod judged;
mod judged_text;
pub mod merge;
mod own_reference;
mod truth;

use crate::cli::failure::Failure;
use crate::cli::flags::CommonFlags;
use crate::cli::print;
use crate::cli::progress::{bar, interrupted, listen_for_interrupts};
use crate::estimate::registry::{self, ESTIMATORS};
use crate::export::names;
use crate::export::study::Store;
use crate::measure::study::study_plan::{Shard, Task};
use crate::measure::study::{Keep, StudyPlan, Sweep, TaskRecord, Unfinished, task};
use crate::render::Watch;
use crate::render::film::Image;
use crate::render::memory::check_images;
use crate::render::settings::RenderSettings;
use crate::scene::scene_file::RenderFile;
use crate::scene::{Scene, open};
use clap::Args;
use indicatif::ProgressBar;
use judged::{JudgeFlags, Study};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use truth::{Given, given_reference};

/// Passes of a curve if neither passes nor seconds are given.
const PASSES: u32 = 32;

/// Flags of `study`.
#[derive(Debug, Args)]
pub struct StudyArgs {
    /// A built-in name, a .toml, an .obj or a Quake 3 map (.bsp, .pk3:NAME)
    scene: String,
    /// Estimators, separated by commas; all with their defaults if left out
    #[arg(long, value_name = "A,B")]
    estimators: Option<String>,
    /// Values of a setting, as in photons=1e4,1e5; for photons, k, n, footprint_scale and gather; may be repeated
    #[arg(long, value_name = "SETTING=V,V")]
    sweep: Vec<String>,
    /// Seeds with which each setting is rendered, from --seed on
    #[arg(long, value_name = "N", default_value_t = 3, value_parser = clap::value_parser!(u32).range(1..=1000))]
    seeds: u32,
    /// Passes at which a curve ends; 32 if --seconds is not given either
    #[arg(long, value_name = "P", value_parser = clap::value_parser!(u32).range(1..))]
    passes: Option<u32>,
    /// Seconds of rendering after which a curve ends, at its next checkpoint (1, 2, 4, 8, ... passes)
    #[arg(long, value_name = "S", allow_negative_numbers = true)]
    seconds: Option<f64>,
    /// Do part i of n of the work, and no more; `cusp merge` judges the parts together
    #[arg(long, value_name = "I/N", value_parser = Shard::parse)]
    shard: Option<Shard>,
    /// Go on with the study in the folder: what is finished is not done again
    #[arg(long)]
    resume: bool,
    #[command(flatten)]
    judge: JudgeFlags,
    #[command(flatten)]
    flags: CommonFlags,
}

/// Studies.
///
/// # Errors
/// A wrong call, a file that cannot be written, or an interruption.
pub fn run(args: &StudyArgs) -> Result<(), Failure> {
    if args.seconds.is_some_and(|s| !(s > 0.0 && s.is_finite())) {
        return Err(Failure::Call("--seconds: must be positive".into()));
    }
    listen_for_interrupts();
    args.flags.on_threads(|| {
        let prepared = prepare(args)?;
        let shard = args.shard.unwrap_or(Shard::WHOLE);
        let hidden = args.flags.quiet || args.flags.json;
        let tasks = prepared.plan.tasks_of(shard);
        let done = render(&prepared, &tasks, args.resume, hidden)?;
        let left = tasks.len() - done.len();
        let folder = prepared.store.folder();
        if shard != Shard::WHOLE {
            return if left > 0 { Err(stopped(&done, left)) } else { shard_done(args, &done, folder) };
        }
        if left > 0 && (done.is_empty() || matches!(prepared.reference, Given::None)) {
            return Err(stopped(&done, left));
        }
        let records = done.into_iter().map(|r| (r, prepared.store.clone())).collect();
        let Prepared { plan, scene, reference, store } = prepared;
        let study = Study { plan, scene: Some(scene), records };
        study.judge(&args.judge, reference, store.folder(), args.flags.json, args.flags.quiet)?;
        if left > 0 { Err(stopped(&study.records, left)) } else { Ok(()) }
    })
}

/// What an interruption leaves.
fn stopped<T>(done: &[T], left: usize) -> Failure {
    let n = done.len();
    Failure::Interrupted(format!("{n} of {} tasks are done; --resume goes on with the others", n + left))
}

fn shard_done(args: &StudyArgs, done: &[TaskRecord], folder: &Path) -> Result<(), Failure> {
    if args.flags.quiet {
        return Ok(());
    }
    let text = if args.flags.json {
        crate::cli::to_json(&serde_json::json!({
            "version": env!("CARGO_PKG_VERSION"), "shard": args.shard, "tasks_done": done.len(), "folder": folder,
        }))?
    } else {
        format!("{}: {} tasks are done; `cusp merge` judges them with the other shards\n", folder.display(), done.len())
    };
    print(&text)
}

/// A study before its first task.
struct Prepared {
    plan: StudyPlan,
    scene: Arc<Scene>,
    reference: Given,
    store: Store,
}

/// Reads and checks everything that can be wrong before any work is done.
fn prepare(args: &StudyArgs) -> Result<Prepared, Failure> {
    let scene = open(&args.scene)?;
    if args.estimators.is_some() && args.flags.estimator.is_some() {
        return Err(Failure::Call("--estimator: is in --estimators already; give one of them".into()));
    }
    let estimators = match args.estimators.as_ref().or(args.flags.estimator.as_ref()) {
        Some(list) => registry::estimators(list)?,
        None => ESTIMATORS.iter().filter_map(|e| e.default_estimator()).collect(),
    };
    let mut flags = RenderFile::default();
    args.flags.onto(&mut flags);
    // Here `--estimator` may be a list, like `--estimators`.
    flags.estimator = None;
    let seed = args.flags.seed.unwrap_or(1);
    let mut base = RenderSettings::new(&scene, &flags, args.flags.size, seed)?;
    base.plan = args.flags.plan.into();
    let estimators = base.with_final_gathering(&estimators)?;
    let reference = given_reference(&args.judge, &args.scene, base.light)?;
    if args.flags.size.is_none()
        && let Given::Reference(r) = &reference
    {
        base.size = r.image.size;
        check_images(&base, 1)?;
    }
    reference.check(&args.judge, base.size)?;
    let settings =
        Sweep::parse(&args.sweep).and_then(|s| s.settings(&scene, &flags, &estimators)).map_err(Failure::Call)?;
    let seeds = (0..u64::from(args.seeds)).map(|i| seed.wrapping_add(i)).collect();
    let passes = args.passes.or(if args.seconds.is_none() { Some(PASSES) } else { None });
    let plan = StudyPlan::new(&args.scene, &scene, base, settings, seeds, passes, args.seconds);
    let folder = args.flags.out.clone().unwrap_or_else(|| default_folder("study", &scene.name));
    let store = Store::new(folder);
    agree(args, &plan, &store)?;
    Ok(Prepared { plan, scene: Arc::new(scene), reference, store })
}

/// Where files go by default.
fn default_folder(command: &str, scene: &str) -> PathBuf {
    Path::new("cusp-out").join(format!("{command}-{}", names::file_stem(scene)))
}

/// Sees to it that the folder holds this plan and no other.
fn agree(args: &StudyArgs, plan: &StudyPlan, store: &Store) -> Result<(), Failure> {
    let joins = args.resume || args.shard.is_some();
    let at = store.folder().display();
    match store.plan() {
        Ok(Some(old)) if old.is_same_study(plan) => return Ok(()),
        Ok(Some(_)) if joins => {
            return Err(Failure::Call(format!(
                "{at}: holds another study; call with the same scene, settings, seeds and size, or give another --out"
            )));
        }
        Err(why) if joins => return Err(Failure::Call(why)),
        _ => {}
    }
    Ok(store.write_plan(plan)?)
}

/// Renders the tasks that are not done yet; those that are done in the end, in order.
fn render(prepared: &Prepared, tasks: &[Task], resume: bool, hidden: bool) -> Result<Vec<TaskRecord>, Failure> {
    let Prepared { plan, scene, store, .. } = prepared;
    let hash = plan.hash().map_err(Failure::Work)?;
    if !resume {
        for task in tasks {
            store.forget(*task)?;
        }
    }
    let progress = bar(tasks.len() as u64, "study", hidden);
    let labels = crate::measure::study::setting::labels(&plan.settings);
    let mut done = Vec::new();
    for task in tasks {
        if let Some(record) = store.record(hash, *task) {
            done.push(record);
            progress.inc(1);
            continue;
        }
        if interrupted() {
            continue;
        }
        progress.set_message(format!("{}, seed {}", labels[task.setting], task.seed));
        let mut keep = Keeper { store, task: *task, plan_hash: hash, facts: facts(plan, *task) };
        let kept = task::run(plan, scene, *task, &TaskWatch { bar: &progress }, &mut keep)?;
        if let Some(record) = kept {
            store.write_record(&record)?;
            done.push(record);
            progress.inc(1);
        }
    }
    progress.finish_and_clear();
    Ok(done)
}

/// Keeps what a task makes in the study's folder.
struct Keeper<'a> {
    store: &'a Store,
    task: Task,
    plan_hash: u64,
    facts: Vec<(&'static str, String)>,
}

impl Keep for Keeper<'_> {
    type Error = Failure;

    fn unfinished(&mut self) -> Option<Unfinished> {
        self.store.unfinished(self.plan_hash, self.task)
    }

    fn keep(&mut self, image: &Image, so_far: &Unfinished) -> Result<(), Failure> {
        let passes = so_far.points.last().map_or(0, |p| p.passes);
        let mut facts = self.facts.clone();
        facts.push(("cusp.passes", passes.to_string()));
        self.store.write_image(self.task, passes, image, &facts)?;
        Ok(self.store.write_unfinished(self.plan_hash, self.task, so_far)?)
    }
}

/// What the images of a task carry.
fn facts(plan: &StudyPlan, task: Task) -> Vec<(&'static str, String)> {
    let setting = &plan.settings[task.setting];
    vec![
        ("cusp.version", plan.version.clone()),
        ("cusp.command", crate::export::provenance::command_line()),
        ("cusp.seed", task.seed.to_string()),
        ("cusp.scene", plan.scene_name.clone()),
        ("cusp.scene_hash", plan.scene_hash.clone()),
        ("cusp.estimator", setting.estimator.clone()),
        ("cusp.settings", setting.rest()),
    ]
}

/// Stops at Ctrl-C, and keeps the clock of the bar going.
struct TaskWatch<'a> {
    bar: &'a ProgressBar,
}

impl Watch for TaskWatch<'_> {
    fn cancelled(&self) -> bool {
        interrupted()
    }

    fn pass_started(&self, _pass: &Arc<crate::render::Pass>, _draft: bool) {
        self.bar.tick();
    }
}

impl From<String> for Failure {
    fn from(why: String) -> Self {
        Self::Work(why)
    }
}
