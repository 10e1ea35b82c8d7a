//! The render as the window sees it: the worker, the generation that counts, and how far it is.

use super::gallery::Gallery;
use super::messages::Messages;
use super::worker::messages::{Event, Job, Progress};
use super::worker::{Wake, Worker};
use crate::render::{Pass, StoppedBy};
use std::cell::Cell;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// Time per frame for taking in events, so that the window never waits for the worker.
const PATIENCE: Duration = Duration::from_millis(4);

/// The render thread and what is known of its work.
pub struct Render {
    worker: Option<Worker>,
    wake: Wake,
    job: Option<Job>,
    generation: u64,
    /// The pass whose tiles come in, or came last; drafts apart.
    pub pass: Option<Arc<Pass>>,
    /// The first pass of the job that is rendered, kept for who looks into it.
    pub first_pass: Option<Arc<Pass>>,
    first_is_old: bool,
    /// Whether that pass is a draft.
    pub draft: bool,
    /// Where the render stands.
    pub progress: Option<Progress>,
    /// Whether the worker rests because all is done.
    pub finished: bool,
    /// What was done when it came to rest last.
    pub stopped_by: Option<StoppedBy>,
    /// Counts up with every finished pass.
    pub passes_seen: u64,
    /// Tiles of the pass that have come.
    pub tiles: usize,
    /// Counts up with every finished draft.
    pub drafts_seen: u64,
    started: Instant,
    first_tile: Option<Duration>,
}

impl Render {
    /// Without a thread yet; the first job starts it. `wake` is called from the worker when there is news.
    pub fn new(wake: Wake) -> Self {
        Self {
            worker: None,
            wake,
            job: None,
            generation: 0,
            pass: None,
            first_pass: None,
            first_is_old: true,
            draft: false,
            progress: None,
            finished: false,
            stopped_by: None,
            passes_seen: 0,
            tiles: 0,
            drafts_seen: 0,
            started: Instant::now(),
            first_tile: None,
        }
    }

    /// Number for the next job.
    pub fn next_generation(&self) -> u64 {
        self.generation + 1
    }

    /// Renders `job` from now on.
    pub fn start(&mut self, job: Job, gallery: &mut Gallery, messages: &mut Messages) {
        gallery.start(&job);
        self.generation = job.generation;
        self.finished = false;
        self.stopped_by = None;
        self.started = Instant::now();
        self.first_tile = None;
        self.progress = None;
        // Until another comes, and none comes if all images are kept.
        self.first_is_old = true;
        if self.worker.is_none() {
            match Worker::start(Arc::clone(&self.wake)) {
                Ok(worker) => self.worker = Some(worker),
                Err(why) => messages.error(format!("the render thread could not be started: {why}")),
            }
        }
        if let Some(worker) = &mut self.worker {
            worker.render(job.clone());
        }
        self.job = Some(job);
    }

    /// Starts a new thread with the last job, after the old one has failed.
    pub fn restart(&mut self, gallery: &mut Gallery, messages: &mut Messages) {
        self.worker = None;
        if let Some(job) = self.job.take() {
            let generation = self.next_generation();
            self.start(Job { generation, ..job }, gallery, messages);
        }
    }

    /// Takes in what the worker tells.
    pub fn poll(&mut self, gallery: &mut Gallery, messages: &mut Messages) {
        let Some(mut worker) = self.worker.take() else { return };
        let start = Instant::now();
        let mut failed = false;
        // Whoever measures the images does so before tiles of the next pass are in them.
        let pass_done = Cell::new(false);
        worker.events(
            self.generation,
            |event| match event {
                Event::PassStarted { pass, draft, .. } => {
                    self.tiles = 0;
                    if !draft && std::mem::take(&mut self.first_is_old) {
                        self.first_pass = Some(Arc::clone(&pass));
                    }
                    self.draft = draft;
                    if !draft {
                        self.pass = Some(pass);
                    }
                }
                Event::TileDone { rect, images, .. } => {
                    self.first_tile.get_or_insert_with(|| self.started.elapsed());
                    self.tiles += 1;
                    gallery.tile(rect, images);
                }
                Event::DraftDone { .. } => self.drafts_seen += 1,
                Event::PassDone { progress, .. } => {
                    gallery.passes(&progress.passes);
                    messages.set_warnings(&progress.warnings);
                    self.progress = Some(*progress);
                    self.passes_seen += 1;
                    pass_done.set(true);
                }
                Event::Finished { why, .. } => {
                    self.finished = true;
                    self.stopped_by = Some(why);
                }
                Event::Refused { why, .. } => {
                    messages.error(why);
                    self.finished = true;
                }
                Event::Failed { why } => {
                    messages.error(format!("{why}; start another with Render > Restart the render thread"));
                    failed = true;
                }
            },
            || pass_done.get() || start.elapsed() > PATIENCE,
        );
        if !failed {
            self.worker = Some(worker);
        }
    }

    /// The worker's gate, while there is a worker.
    pub fn gate(&self) -> Option<&super::worker::gate::Gate> {
        self.worker.as_ref().map(Worker::gate)
    }

    /// Whether it is paused.
    pub fn is_paused(&self) -> bool {
        self.gate().is_some_and(|g| g.is_paused())
    }

    /// Whether there is a thread.
    pub fn is_alive(&self) -> bool {
        self.worker.is_some()
    }

    /// Time from the last change to its first tile.
    pub fn first_tile(&self) -> Option<Duration> {
        self.first_tile
    }

    /// The pass whose tiles come in or came last, if it is of the scene and size that are rendered now.
    pub fn current_pass(&self) -> Option<&Arc<Pass>> {
        let job = self.job.as_ref()?;
        self.pass.as_ref().filter(|p| Arc::ptr_eq(&p.scene, &job.scene) && p.settings.size == job.settings.size)
    }

    /// Part of the running pass that is done, in `[0, 1]`.
    pub fn part(&self) -> f32 {
        let Some(job) = &self.job else { return 0.0 };
        let all = job.settings.size.map(|n| n.div_ceil(crate::render::tiles::TILE) as usize);
        (self.tiles as f32 / (all[0] * all[1]).max(1) as f32).min(1.0)
    }

    /// The job that is rendered.
    pub fn job(&self) -> Option<&Job> {
        self.job.as_ref()
    }
}
