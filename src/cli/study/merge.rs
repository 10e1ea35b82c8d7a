//! `cusp merge`: the shards of a study as one.

use crate::cli::failure::Failure;
use crate::cli::progress::listen_for_interrupts;
use crate::cli::study::judged::{JudgeFlags, Study};
use crate::cli::study::truth::given_reference;
use crate::export::study::Store;
use crate::measure::study::{StudyPlan, TaskRecord};
use crate::scene::open;
use clap::Args;
use std::path::PathBuf;
use std::sync::Arc;

/// Flags of `merge`.
#[derive(Debug, Args)]
pub struct MergeArgs {
    /// Folders of the shards; one, if all wrote to the same
    #[arg(required = true, value_name = "DIR")]
    folders: Vec<PathBuf>,
    /// Folder for study.csv, study.json and study.png; the first of the shards' if left out
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// The scene, if it is not where the shards found it
    #[arg(long, value_name = "SCENE")]
    scene: Option<String>,
    #[command(flatten)]
    judge: JudgeFlags,
    /// Print JSON instead of a table
    #[arg(long)]
    json: bool,
    /// Print nothing but errors
    #[arg(long)]
    quiet: bool,
}

/// Merges.
///
/// # Errors
/// Folders that hold no study or different ones, tasks that are missing, or a file that cannot be written.
pub fn run(args: &MergeArgs) -> Result<(), Failure> {
    listen_for_interrupts();
    let stores: Vec<Store> = args.folders.iter().map(Store::new).collect();
    let plan = common_plan(&stores)?;
    let hash = plan.hash().map_err(Failure::Work)?;
    let mut records: Vec<(TaskRecord, Store)> = Vec::new();
    let mut missing = Vec::new();
    for task in plan.tasks() {
        match stores.iter().find_map(|s| Some((s.record(hash, task)?, s.clone()))) {
            Some(found) => records.push(found),
            None => missing.push(task.name()),
        }
    }
    let first = missing.iter().take(3).map(String::as_str).collect::<Vec<_>>().join(", ");
    if records.is_empty() {
        return Err(Failure::Call("no task is done in these folders; run the shards first".into()));
    }
    let named = args.scene.as_ref().unwrap_or(&plan.scene);
    let reference = given_reference(&args.judge, named, plan.base.light)?;
    reference.check(&args.judge, plan.base.size)?;
    // Without the scene there is no reference but a given one, which may be enough.
    let scene = open(named).ok().filter(|s| format!("{:016x}", s.hash) == plan.scene_hash).map(Arc::new);
    let out = args.out.clone().unwrap_or_else(|| stores[0].folder().to_owned());
    let study = Study { plan, scene, records };
    study.judge(&args.judge, reference, &out, args.json, args.quiet)?;
    if missing.is_empty() {
        return Ok(());
    }
    Err(Failure::Work(format!(
        "{} of {} tasks are missing ({first}{}): run their shards with --resume, then merge again",
        missing.len(),
        study.plan.tasks().len(),
        if missing.len() > 3 { ", ..." } else { "" }
    )))
}

/// The plan that all folders share.
fn common_plan(stores: &[Store]) -> Result<StudyPlan, Failure> {
    let mut common: Option<(StudyPlan, &Store)> = None;
    for store in stores {
        let at = store.folder().display();
        let plan = store.plan().map_err(Failure::Call)?;
        let plan = plan.ok_or_else(|| Failure::Call(format!("{at}: holds no study; name a folder of `cusp study`")))?;
        match &common {
            Some((first, of)) if !first.is_same_study(&plan) => {
                return Err(Failure::Call(format!("{at}: holds another study than {}", of.folder().display())));
            }
            Some(_) => {}
            None => common = Some((plan, store)),
        }
    }
    // Clap asks for at least one folder.
    common.map(|c| c.0).ok_or_else(|| Failure::Call("name at least one folder".into()))
}
