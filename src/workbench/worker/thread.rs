//! The render thread's loop.

use super::Wake;
use super::gate::Gate;
use super::messages::{Command, Event, Job, Progress, TileImage};
use crate::estimate::{Estimator, registry};
use crate::render::error_estimate::{ErrorEstimate, is_milestone};
use crate::render::film::{Film, Rect};
use crate::render::pass::Pass;
use crate::render::stop::Standing;
use crate::render::tiles::tiles;
use crate::render::view_pass::PartSeconds;
use crate::render::watch::{TileDone, Watch};
use crate::render::{Renderer, Step, StoppedBy};
use crossbeam_channel::{Receiver, SendTimeoutError, Sender};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use std::time::Duration;

/// Bytes of photons that are kept for estimators that come later.
const PHOTON_BYTES: usize = 512 << 20;
/// Photons of a draft. Passes of more than this show one first.
const DRAFT_PHOTONS: u64 = 20_000;
/// How long a send waits before it looks whether its event is stale.
const PATIENCE: Duration = Duration::from_millis(5);

/// Renders what comes in until it is told to quit or the window is gone; a panic is reported and ends the thread.
pub(super) fn run(inbox: &Receiver<Command>, outbox: &Sender<Event>, gate: &Gate, wake: &Wake) {
    // Threads of its own: while it is paused its tiles wait in them, and others have work for the shared ones.
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(rayon::current_num_threads())
        .thread_name(|i| format!("cusp-tiles-{i}"))
        .build()
        .ok();
    let work = AssertUnwindSafe(|| Loop { inbox, outbox, gate, wake, pool, renderer: None }.run());
    if let Err(panic) = catch_unwind(work) {
        let what = panic
            .downcast_ref::<&str>()
            .map(|s| (*s).to_owned())
            .or_else(|| panic.downcast_ref::<String>().cloned())
            .unwrap_or_else(|| "no reason given".into());
        let why = format!("the render thread has stopped by a defect: {what}");
        let _ = outbox.send_timeout(Event::Failed { why }, Duration::from_secs(10));
        wake();
    }
}

struct Loop<'a> {
    inbox: &'a Receiver<Command>,
    outbox: &'a Sender<Event>,
    gate: &'a Gate,
    wake: &'a Wake,
    /// Its own threads; without them it takes those that all share.
    pool: Option<rayon::ThreadPool>,
    renderer: Option<Renderer>,
}

impl Loop<'_> {
    fn run(mut self) {
        while let Ok(Command::Render(first)) = self.inbox.recv() {
            let mut job = first;
            // Only the newest counts.
            while let Ok(next) = self.inbox.try_recv() {
                match next {
                    Command::Render(newer) => job = newer,
                    Command::Quit => return,
                }
            }
            match self.pool.take() {
                Some(pool) => {
                    pool.install(|| self.job(&job));
                    self.pool = Some(pool);
                }
                None => self.job(&job),
            }
        }
    }

    /// Renders a job until it is done or stale.
    fn job(&mut self, job: &Job) {
        let estimators: Vec<Box<dyn Estimator>> =
            job.estimators.iter().filter_map(|e| registry::estimator(e).ok()).collect();
        let (scene, settings) = (Arc::clone(&job.scene), job.settings.clone());
        match &mut self.renderer {
            Some(renderer) => renderer.change(scene, settings, estimators),
            None => {
                let mut renderer = Renderer::unplanned(scene, settings, estimators);
                renderer.keep_photons(PHOTON_BYTES);
                self.renderer = Some(renderer);
            }
        }
        let Some(renderer) = &mut self.renderer else { return };
        let desk = Desk { outbox: self.outbox, gate: self.gate, wake: self.wake, generation: job.generation };
        // What is kept may have been sent for an older generation and dropped, so it is sent again.
        for (estimator, film) in renderer.films().iter().enumerate().filter(|(_, f)| f.passes() > 0) {
            let image = film.image();
            for rect in tiles(Rect::whole(image.size)) {
                let pixels = image.crop(rect).pixels;
                let images = vec![TileImage { estimator, pixels, seconds: PartSeconds::default() }];
                desk.send(Event::TileDone { generation: job.generation, rect, images, draft: false });
            }
        }
        let kept = estimates(renderer, |_| true);
        let error = worst(&kept);
        if renderer.films().iter().any(|f| f.passes() > 0) {
            let progress = Box::new(progress(renderer, kept));
            desk.send(Event::PassDone { generation: job.generation, progress });
        }
        let wants_draft = job.settings.photons > DRAFT_PHOTONS && renderer.passes() == 0;
        if wants_draft && !renderer.films().is_empty() {
            if renderer.draft(DRAFT_PHOTONS, &desk) == Step::Cancelled {
                return;
            }
            desk.send(Event::DraftDone { generation: job.generation });
        }
        // Films whose images are kept need no pass, and so no memory.
        let asks_for_more = |now: &Standing| job.stop.verdict(now).is_none();
        let mut now = Standing { passes: renderer.passes(), seconds: renderer.seconds().sum(), next_pass: 0.0, error };
        if asks_for_more(&now)
            && !renderer.films().is_empty()
            && let Err(short) = renderer.check_memory()
        {
            return desk.send(Event::Refused { generation: job.generation, why: short.to_string() });
        }
        // Without an estimator there is nothing to wait for.
        let nothing = renderer.films().is_empty().then_some(StoppedBy::Passes);
        let why = loop {
            if self.gate.is_stale(job.generation) {
                return;
            }
            if let Some(why) = nothing.or_else(|| job.stop.verdict(&now)) {
                break why;
            }
            if renderer.step(&desk) == Step::Cancelled {
                return;
            }
            self.gate.pass_ended();
            let seconds = renderer.seconds().sum();
            let all = estimates(renderer, is_milestone);
            now = Standing {
                passes: renderer.passes(),
                seconds,
                next_pass: seconds - now.seconds,
                error: worst(&all).or(now.error),
            };
            let progress = Box::new(progress(renderer, all));
            desk.send(Event::PassDone { generation: job.generation, progress });
        };
        desk.send(Event::Finished { generation: job.generation, why });
    }
}

/// Estimated error of each image whose number of passes is `wanted`: it costs a look at each pixel.
fn estimates(r: &Renderer, wanted: fn(u32) -> bool) -> Vec<Option<ErrorEstimate>> {
    let of = |f: &Film| f.error_estimate(Rect::whole(f.size()), None);
    r.films().iter().map(|f| wanted(f.passes()).then(|| of(f)).flatten()).collect()
}

/// The estimate of the image that is farthest from its end; None if one is missing.
fn worst(estimates: &[Option<ErrorEstimate>]) -> Option<ErrorEstimate> {
    let all: Option<Vec<ErrorEstimate>> = estimates.iter().copied().collect();
    all?.into_iter().max_by(|a, b| a.relative_bound.total_cmp(&b.relative_bound))
}

fn progress(r: &Renderer, estimates: Vec<Option<ErrorEstimate>>) -> Progress {
    Progress {
        passes: r.films().iter().map(|f| f.passes()).collect(),
        estimator_seconds: r.estimator_seconds().to_vec(),
        photon_seconds: r.photon_seconds().to_vec(),
        seconds: r.seconds().within(0.0),
        estimates,
        emitted: r.emitted(),
        stored: r.stored(),
        gather_counts: *r.gather_counts(),
        bounded: *r.bounded(),
        warnings: r.warnings(),
    }
}

/// Where the renderer's threads ask and tell.
struct Desk<'a> {
    outbox: &'a Sender<Event>,
    gate: &'a Gate,
    wake: &'a Wake,
    generation: u64,
}

impl Desk<'_> {
    /// Waits for room, unless the event has become stale.
    fn send(&self, event: Event) {
        let mut event = event;
        while !self.gate.is_stale(self.generation) {
            match self.outbox.send_timeout(event, PATIENCE) {
                Ok(()) => return (self.wake)(),
                Err(SendTimeoutError::Timeout(back)) => event = back,
                Err(SendTimeoutError::Disconnected(_)) => return,
            }
        }
    }
}

impl Watch for Desk<'_> {
    fn cancelled(&self) -> bool {
        self.gate.is_stale(self.generation)
    }

    fn tile_allowed(&self) -> bool {
        self.gate.pass_tile(self.generation)
    }

    fn pass_started(&self, pass: &Arc<Pass>, draft: bool) {
        self.send(Event::PassStarted { generation: self.generation, pass: Arc::clone(pass), draft });
    }

    fn tile_done(&self, tile: &TileDone) {
        let images =
            tile.means().map(|(estimator, pixels, seconds)| TileImage { estimator, pixels, seconds }).collect();
        self.send(Event::TileDone { generation: self.generation, rect: tile.rect(), images, draft: tile.draft });
    }
}
