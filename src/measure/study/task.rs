//! One curve of a study: a setting rendered with one seed, and an image at each checkpoint.

use crate::estimate::registry::estimator;
use crate::measure::study::study_plan::{StudyPlan, Task, is_checkpoint};
use crate::render::film::Image;
use crate::render::stats::{Seconds, StoredCounts};
use crate::render::watch::Watch;
use crate::render::{Renderer, Step};
use crate::scene::Scene;
use serde::{Deserialize, Serialize};
use std::sync::Arc;
use std::time::Instant;

/// Where a curve stood when an image was kept.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Checkpoint {
    /// Passes in the image.
    pub passes: u32,
    /// Photons emitted in all of them.
    pub photons: u64,
    /// Photons stored in all of them.
    pub stored: StoredCounts,
    /// Wall seconds up to here by part: hierarchy, plan and passes; neither reading the scene nor keeping images.
    pub seconds: Seconds,
}

/// A finished task.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TaskRecord {
    /// Hash of the study's plan, 16 hexadecimal digits.
    pub plan: String,
    /// Index of the setting.
    pub setting: usize,
    /// The seed.
    pub seed: u64,
    /// Threads that rendered it.
    pub threads: usize,
    /// Its checkpoints, by rising passes.
    pub points: Vec<Checkpoint>,
}

/// Renders a task. `keep` is given each checkpoint with its image, while the clock stands still.
///
/// Returns None if `watch` cancelled it.
///
/// # Errors
/// What `keep` returns, or a setting that is none.
pub fn run<E: From<String>>(
    plan: &StudyPlan,
    scene: &Arc<Scene>,
    task: Task,
    watch: &dyn Watch,
    mut keep: impl FnMut(&Checkpoint, &Image) -> Result<(), E>,
) -> Result<Option<TaskRecord>, E> {
    let setting = &plan.settings[task.setting];
    let mut settings = setting.onto(&plan.base);
    settings.seed = task.seed;
    let chosen = estimator(&setting.estimator).map_err(|e| e.to_string())?;
    let start = Instant::now();
    let mut renderer = Renderer::new(Arc::clone(scene), settings, vec![chosen]);
    let mut spent = start.elapsed().as_secs_f64();
    let mut points = Vec::new();
    let enough = |passes: u32, spent: f64| {
        plan.passes.is_some_and(|p| passes >= p)
            || plan.seconds.is_some_and(|s| spent >= s) && is_checkpoint(passes)
            || passes == u32::MAX
    };
    loop {
        let start = Instant::now();
        let step = renderer.step(watch);
        spent += start.elapsed().as_secs_f64();
        if step == Step::Cancelled {
            return Ok(None);
        }
        let passes = renderer.passes();
        let last = enough(passes, spent);
        if last || is_checkpoint(passes) {
            let point = Checkpoint {
                passes,
                photons: renderer.emitted(),
                stored: renderer.stored(),
                seconds: renderer.seconds().of_total(spent),
            };
            keep(&point, &renderer.films()[0].image())?;
            points.push(point);
        }
        if last {
            break;
        }
    }
    let plan = format!("{:016x}", plan.hash()?);
    Ok(Some(TaskRecord { plan, setting: task.setting, seed: task.seed, threads: rayon::current_num_threads(), points }))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::measure::study::Sweep;
    use crate::render::{RenderSettings, Silent};
    use crate::scene::open;
    use crate::scene::scene_file::RenderFile;

    fn plan(scene: &Scene, passes: u32) -> StudyPlan {
        let flags = RenderFile { photons: Some(2000), ..Default::default() };
        let base = RenderSettings::new(scene, &flags, Some([24, 24]), 1).expect("valid");
        let estimators = crate::estimate::registry::estimators("regular,integrated").expect("known");
        let settings = Sweep::default().settings(scene, &flags, &estimators).expect("valid");
        StudyPlan::new("ring", scene, base, settings, vec![5], Some(passes), None)
    }

    #[test]
    fn a_task_keeps_what_a_render_makes_and_its_parts_add_up() {
        let scene = Arc::new(open("ring").expect("built in"));
        let plan = plan(&scene, 6);
        let mut kept = Vec::new();
        let record = run::<String>(&plan, &scene, Task { setting: 1, seed: 5 }, &Silent, |p, image| {
            kept.push((p.passes, image.clone()));
            Ok(())
        });
        let record = record.expect("no error").expect("not cancelled");
        assert_eq!(record.points.iter().map(|p| p.passes).collect::<Vec<_>>(), [1, 2, 4, 6]);
        for p in &record.points {
            let s = &p.seconds;
            let parts = s.bvh + s.plan + s.photon_trace + s.map_build + s.view_trace + s.gather + s.estimate + s.other;
            assert!((parts - s.total).abs() < 1e-9 && s.other > -1e-6, "{s:?}");
            assert_eq!(p.photons, 2000 * u64::from(p.passes));
        }
        let settings = RenderSettings { seed: 5, ..plan.settings[1].onto(&plan.base) };
        let mut alone = Renderer::new(Arc::clone(&scene), settings, vec![estimator("integrated").expect("registered")]);
        (0..4).for_each(|_| _ = alone.step(&Silent));
        assert_eq!(kept[2].1, alone.films()[0].image());
    }

    #[test]
    fn a_failed_keep_ends_it() {
        let scene = Arc::new(open("ring").expect("built in"));
        let plan = plan(&scene, 4);
        let task = Task { setting: 0, seed: 5 };
        let end =
            run::<String>(
                &plan,
                &scene,
                task,
                &Silent,
                |p, _| {
                    if p.passes == 2 { Err("disk full".into()) } else { Ok(()) }
                },
            );
        assert_eq!(end, Err("disk full".to_owned()));
    }
}
