//! The thread that owns the engine, and the window's end of it.
//!
//! The window writes what it wishes into a slot; the thread looks at the newest there before each frame. Frames come back
//! over a channel of one: a slow window slows the thread, and nothing piles up.

use crate::realtime::{Engine, FrameReport, RealtimeSettings};
use crate::render::film::Image;
use crate::scene::{Camera, Light, Scene};
use crate::workbench::worker::Wake;
use crossbeam_channel::{Receiver, Sender, bounded};
use glam::Vec3;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::{Arc, Condvar, Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::Instant;

/// Seconds of the scene for a single step.
pub const STEP: f64 = 1.0 / 30.0;

/// Seconds of the scene that a frame moves on at most, however long the one before took.
const LONGEST_STEP: f64 = 0.1;

/// Photons that are handed to the window at most.
const MOST_PHOTONS: usize = 6000;

/// What the window wants to see.
#[derive(Clone)]
pub struct Wish {
    /// Raised at every change.
    pub version: u64,
    /// Scene.
    pub scene: Arc<Scene>,
    /// Parameters.
    pub settings: RealtimeSettings,
    /// Camera.
    pub camera: Camera,
    /// Pixels across and down.
    pub size: [u32; 2],
    /// Exposure of the screen, for blending by offset.
    pub exposure: f32,
    /// Whether frames follow each other.
    pub playing: bool,
    /// Single steps that were asked for, all in all.
    pub steps: u64,
    /// Starts over that were asked for.
    pub restarts: u64,
    /// Whether photons are wanted.
    pub photons: bool,
}

/// A photon as the window draws it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SeenPhoton {
    /// Where it is, metres.
    pub position: Vec3,
    /// Frames since it was stored.
    pub age: u32,
}

/// A frame for the window.
pub struct LiveFrame {
    /// Version of the wish that it grants.
    pub version: u64,
    /// Single steps that were made.
    pub steps: u64,
    /// Camera that it was drawn for.
    pub camera: Camera,
    /// The picture, linear radiance.
    pub image: Image,
    /// What it took.
    pub report: FrameReport,
    /// Lights at that moment.
    pub lights: Vec<Light>,
    /// Triangles and vertices of the refined mesh.
    pub mesh: [usize; 2],
    /// Some of the photons, if they were asked for, and how many there are.
    pub photons: Vec<SeenPhoton>,
}

#[derive(Default)]
struct Slot {
    wish: Option<Wish>,
    closed: bool,
}

type Shared = Arc<(Mutex<Slot>, Condvar)>;

/// The window's end.
pub struct LiveThread {
    shared: Shared,
    frames: Receiver<Result<LiveFrame, String>>,
    thread: Option<JoinHandle<()>>,
}

impl LiveThread {
    /// Starts a thread of the name `cusp-realtime`.
    ///
    /// # Errors
    /// If the system has no room for a thread.
    pub fn start(wake: Wake) -> std::io::Result<Self> {
        let shared = Shared::default();
        let (outbox, frames) = bounded(1);
        let theirs = Arc::clone(&shared);
        let thread = std::thread::Builder::new().name("cusp-realtime".into()).spawn(move || {
            let work = AssertUnwindSafe(|| run(&theirs, &outbox, &wake));
            if catch_unwind(work).is_err() {
                // Nobody may be there to hear it.
                let _ = outbox.send(Err("a defect in the real-time thread; leave the view and come back".into()));
                wake();
            }
        })?;
        Ok(Self { shared, frames, thread: Some(thread) })
    }

    /// Says what is wanted from now on.
    pub fn wish(&self, wish: Wish) {
        let (slot, bell) = &*self.shared;
        slot.lock().unwrap_or_else(PoisonError::into_inner).wish = Some(wish);
        bell.notify_one();
    }

    /// A frame that has been made, if there is one.
    pub fn poll(&self) -> Option<Result<LiveFrame, String>> {
        self.frames.try_recv().ok()
    }
}

impl Drop for LiveThread {
    fn drop(&mut self) {
        let (slot, bell) = &*self.shared;
        slot.lock().unwrap_or_else(PoisonError::into_inner).closed = true;
        bell.notify_one();
        // It may wait for room for a frame.
        while self.thread.as_ref().is_some_and(|t| !t.is_finished()) {
            drop(self.frames.try_recv());
            std::thread::yield_now();
        }
        if let Some(thread) = self.thread.take() {
            // Its defects have been told.
            let _ = thread.join();
        }
    }
}

/// What the thread has done so far.
struct Work {
    engine: Engine,
    /// The wish that the engine was made for.
    granted: Wish,
    time: f64,
    steps: u64,
    last: Option<Instant>,
}

fn run(shared: &Shared, outbox: &Sender<Result<LiveFrame, String>>, wake: &Wake) {
    let mut work: Option<Work> = None;
    while let Some(wish) = next(shared, work.as_ref()) {
        let frame = make(&mut work, wish);
        if outbox.send(Ok(frame)).is_err() {
            return;
        }
        wake();
    }
}

/// The newest wish, once there is something to do for it; None when the window is gone.
fn next(shared: &Shared, work: Option<&Work>) -> Option<Wish> {
    let (slot, bell) = &**shared;
    let mut held = slot.lock().unwrap_or_else(PoisonError::into_inner);
    loop {
        if held.closed {
            return None;
        }
        if let Some(wish) = &held.wish {
            let wanted = work.is_none_or(|w| wish.playing || wish.version != w.granted.version || wish.steps > w.steps);
            if wanted {
                return Some(wish.clone());
            }
        }
        held = bell.wait(held).unwrap_or_else(PoisonError::into_inner);
    }
}

fn make(work: &mut Option<Work>, wish: Wish) -> LiveFrame {
    let restarted = work.as_ref().is_some_and(|w| w.granted.restarts != wish.restarts);
    let mut now = match work.take() {
        Some(mut w) if !restarted => {
            // A walk changes the camera alone, and nothing that was estimated.
            let same = w.engine.shows(&wish.scene) && w.granted.settings == wish.settings;
            if !same {
                w.engine.change(&wish.scene, wish.settings.clone());
            }
            w
        }
        old => Work {
            engine: Engine::new(&wish.scene, wish.settings.clone()),
            granted: wish.clone(),
            time: 0.0,
            steps: old.map_or(0, |w| w.steps),
            last: None,
        },
    };
    let moment = Instant::now();
    let single = wish.steps > now.steps;
    // A map without photons has nothing to show.
    let empty = now.engine.map().frame_count() == 0;
    if wish.playing || single || empty {
        if wish.playing {
            let passed = now.last.map_or(STEP, |l| moment.duration_since(l).as_secs_f64());
            now.time += if empty { 0.0 } else { passed.min(LONGEST_STEP) };
        } else if single {
            now.time += if empty { 0.0 } else { STEP };
        }
        now.engine.step(now.time, &wish.camera);
        now.steps += u64::from(single);
    }
    now.last = wish.playing.then_some(moment);
    let image = now.engine.draw(&wish.camera, wish.size, wish.exposure);
    let photons = if wish.photons { photons_of(&now.engine) } else { Vec::new() };
    let frame = LiveFrame {
        version: wish.version,
        steps: now.steps,
        camera: wish.camera,
        image,
        report: *now.engine.report(),
        lights: now.engine.lights().to_vec(),
        mesh: [now.engine.mesh().triangles.len(), now.engine.mesh().vertices.len()],
        photons,
    };
    now.granted = wish;
    *work = Some(now);
    frame
}

/// Every so many photons of each frame in the map, the newest frame first.
fn photons_of(engine: &Engine) -> Vec<SeenPhoton> {
    let step = engine.map().photons().len().div_ceil(MOST_PHOTONS).max(1);
    let frames = engine.map().frames();
    let newest = frames.last().copied().unwrap_or(0);
    frames
        .iter()
        .rev()
        .flat_map(|&f| {
            let age = (newest - f).min(u64::from(u32::MAX)) as u32;
            engine.map().of_frame(f).iter().step_by(step).map(move |p| SeenPhoton { position: p.position, age })
        })
        .collect()
}
