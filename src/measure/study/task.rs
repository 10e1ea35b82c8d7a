//! One curve of a study: a setting rendered with one seed, and an image at each checkpoint.

use crate::estimate::registry::estimator;
use crate::measure::study::study_plan::{StudyPlan, Task, is_checkpoint};
use crate::render::film::{Film, Image};
use crate::render::stats::{Seconds, StoredCounts};
use crate::render::watch::Watch;
use crate::render::{Renderer, Step};
use crate::scene::Scene;
use glam::DVec3;
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

/// A task that is not finished: what is needed to go on at its last checkpoint.
#[derive(Clone, Debug, PartialEq)]
pub struct Unfinished {
    /// Checkpoints so far.
    pub points: Vec<Checkpoint>,
    /// Sum of the passes for each pixel.
    pub sums: Vec<DVec3>,
}

/// Where a task leaves what it makes. It is called while the clock stands still.
pub trait Keep {
    /// What may go wrong.
    type Error: From<String>;

    /// What an earlier process left of this task.
    fn unfinished(&mut self) -> Option<Unfinished> {
        None
    }

    /// Keeps the image of a checkpoint, and then that the task got so far.
    ///
    /// # Errors
    /// Whatever prevents it; the task ends.
    fn keep(&mut self, image: &Image, so_far: &Unfinished) -> Result<(), Self::Error>;
}

/// Renders a task. Returns None if `watch` cancelled it.
///
/// # Errors
/// What `keep` returns, or a setting that is none.
pub fn run<K: Keep>(
    plan: &StudyPlan,
    scene: &Arc<Scene>,
    task: Task,
    watch: &dyn Watch,
    keep: &mut K,
) -> Result<Option<TaskRecord>, K::Error> {
    let setting = &plan.settings[task.setting];
    let mut settings = setting.onto(&plan.base);
    settings.seed = task.seed;
    let size = settings.size;
    let chosen = estimator(&setting.estimator).map_err(|e| e.to_string())?;
    let start = Instant::now();
    let mut renderer = Renderer::new(Arc::clone(scene), settings, vec![chosen]);
    renderer.check_memory().map_err(|e| e.to_string())?;
    let mut spent = start.elapsed().as_secs_f64();
    let mut so_far = Unfinished { points: Vec::new(), sums: Vec::new() };
    if let Some(old) = keep.unfinished()
        && let Some(last) = old.points.last()
        && let Some(film) = Film::going_on(size, old.sums, last.passes)
        && renderer.go_on(vec![film], last.photons, last.stored, last.seconds)
    {
        spent = last.seconds.total;
        so_far.points = old.points;
    }
    let enough = |passes: u32, spent: f64| {
        plan.passes.is_some_and(|p| passes >= p)
            || plan.seconds.is_some_and(|s| spent >= s) && is_checkpoint(passes)
            || passes == u32::MAX
    };
    while !so_far.points.last().is_some_and(|p| enough(p.passes, p.seconds.total)) {
        let start = Instant::now();
        let step = renderer.step(watch);
        spent += start.elapsed().as_secs_f64();
        if step == Step::Cancelled {
            return Ok(None);
        }
        let passes = renderer.passes();
        if enough(passes, spent) || is_checkpoint(passes) {
            so_far.points.push(Checkpoint {
                passes,
                photons: renderer.emitted(),
                stored: renderer.stored(),
                seconds: renderer.seconds().within(spent),
            });
            let film = &renderer.films()[0];
            so_far.sums = film.sums().to_vec();
            keep.keep(&film.image(), &so_far)?;
        }
    }
    let (plan, points) = (format!("{:016x}", plan.hash()?), so_far.points);
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

    /// Keeps in memory, and fails after so many checkpoints.
    struct Memory {
        images: Vec<(u32, Image)>,
        left: Option<Unfinished>,
        room: usize,
    }

    impl Memory {
        fn new(room: usize) -> Self {
            Self { images: Vec::new(), left: None, room }
        }
    }

    impl Keep for Memory {
        type Error = String;

        fn unfinished(&mut self) -> Option<Unfinished> {
            self.left.take()
        }

        fn keep(&mut self, image: &Image, so_far: &Unfinished) -> Result<(), String> {
            if self.images.len() == self.room {
                return Err("disk full".into());
            }
            self.images.push((so_far.points.last().map_or(0, |p| p.passes), image.clone()));
            self.left = Some(so_far.clone());
            Ok(())
        }
    }

    #[test]
    fn a_task_keeps_what_a_render_makes_and_its_parts_add_up() {
        let scene = Arc::new(open("ring").expect("built in"));
        let plan = plan(&scene, 6);
        let mut memory = Memory::new(9);
        let record = run(&plan, &scene, Task { setting: 1, seed: 5 }, &Silent, &mut memory);
        let record = record.expect("no error").expect("not cancelled");
        assert_eq!(record.points.iter().map(|p| p.passes).collect::<Vec<_>>(), [1, 2, 4, 6]);
        for p in &record.points {
            let s = &p.seconds;
            let parts = s.sum();
            assert!((parts - s.total).abs() < 1e-9 && s.other > -1e-6, "{s:?}");
            assert_eq!(p.photons, 2000 * u64::from(p.passes));
        }
        let settings = RenderSettings { seed: 5, ..plan.settings[1].onto(&plan.base) };
        let mut alone = Renderer::new(Arc::clone(&scene), settings, vec![estimator("integrated").expect("registered")]);
        (0..4).for_each(|_| _ = alone.step(&Silent));
        assert_eq!(memory.images[2].1, alone.films()[0].image());
    }

    /// A task that a full disk stopped goes on at its last checkpoint, and ends with the same bits.
    #[test]
    fn a_stopped_task_goes_on_as_if_nothing_had_been() {
        let scene = Arc::new(open("ring").expect("built in"));
        let plan = plan(&scene, 8);
        let task = Task { setting: 1, seed: 5 };
        let mut whole = Memory::new(9);
        let expected = run(&plan, &scene, task, &Silent, &mut whole).expect("no error").expect("not cancelled");
        let mut memory = Memory::new(3);
        assert_eq!(run(&plan, &scene, task, &Silent, &mut memory), Err("disk full".to_owned()));
        memory.room = 9;
        let record = run(&plan, &scene, task, &Silent, &mut memory).expect("no error").expect("not cancelled");
        assert_eq!(memory.images, whole.images);
        let counts = |r: &TaskRecord| r.points.iter().map(|p| (p.passes, p.photons, p.stored)).collect::<Vec<_>>();
        assert_eq!(counts(&record), counts(&expected));
        let times: Vec<f64> = record.points.iter().map(|p| p.seconds.total).collect();
        assert!(times.is_sorted(), "{times:?}");
        // What is of another size is not gone on from.
        memory.left = Some(Unfinished { points: record.points, sums: vec![DVec3::ZERO; 3] });
        memory.images.clear();
        run(&plan, &scene, task, &Silent, &mut memory).expect("no error");
        assert_eq!(memory.images, whole.images);
    }
}
