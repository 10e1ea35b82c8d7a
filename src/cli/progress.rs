//! Progress on standard error, and the interruption by Ctrl-C.

use crate::render::film::Image;
use crate::render::view_pass::{TileResult, TileWatch};
use crate::render::watch::{TileDone, Watch};
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, PoisonError};
use std::time::Instant;

static INTERRUPTED: AtomicBool = AtomicBool::new(false);

/// Lets Ctrl-C ask for a clean stop; a second one ends the process at once.
pub fn listen_for_interrupts() {
    // A handler that is already there does the same.
    let _ = ctrlc::set_handler(|| {
        if INTERRUPTED.swap(true, Ordering::SeqCst) {
            std::process::exit(130);
        }
    });
}

/// Whether Ctrl-C was pressed.
pub fn interrupted() -> bool {
    INTERRUPTED.load(Ordering::Relaxed)
}

/// A bar of `steps`; invisible if `quiet`, or if nobody watches.
pub fn bar(steps: u64, what: &str, quiet: bool) -> ProgressBar {
    let bar = ProgressBar::new(steps);
    if quiet {
        bar.set_draw_target(ProgressDrawTarget::hidden());
    }
    if let Ok(style) = ProgressStyle::with_template("{msg:24} {bar:40} {pos}/{len} {elapsed} (left {eta})") {
        bar.set_style(style);
    }
    bar.set_message(what.to_owned());
    bar
}

/// Moves a bar on with every tile, and stops at Ctrl-C or at a moment.
pub struct ProgressWatch<'a> {
    /// The bar; a step is a tile.
    pub bar: &'a ProgressBar,
    /// When to stop.
    pub deadline: Option<Instant>,
}

impl Watch for ProgressWatch<'_> {
    fn cancelled(&self) -> bool {
        interrupted() || self.deadline.is_some_and(|d| Instant::now() >= d)
    }

    fn tile_done(&self, _tile: &TileDone) {
        self.bar.inc(1);
    }
}

/// As [`ProgressWatch`], and keeps the tiles for the case that the pass is not finished.
pub struct Collector<'a> {
    bar: &'a ProgressBar,
    /// One image for each estimator, and how many tiles are in them.
    done: Mutex<(Vec<Image>, u64)>,
}

impl<'a> Collector<'a> {
    /// For so many images of `size` pixels.
    pub fn new(size: [u32; 2], images: usize, bar: &'a ProgressBar) -> Self {
        Self { bar, done: Mutex::new((vec![Image::black(size); images], 0)) }
    }

    /// The images, black where no tile was done, and the number of tiles.
    pub fn into_images(self) -> (Vec<Image>, u64) {
        // Tiles are copied whole, so what a panicking thread left is of use too.
        self.done.into_inner().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Watch for Collector<'_> {
    fn cancelled(&self) -> bool {
        interrupted()
    }

    fn tile_done(&self, tile: &TileDone) {
        let rect = tile.rect();
        let mut done = self.done.lock().unwrap_or_else(PoisonError::into_inner);
        for (estimator, pixels, _) in tile.means() {
            done.0[estimator].put(rect, &pixels);
        }
        done.1 += 1;
        self.bar.inc(1);
    }
}

impl TileWatch for ProgressWatch<'_> {
    fn cancelled(&self) -> bool {
        Watch::cancelled(self)
    }

    fn tile_done(&self, _tile: &TileResult) {
        self.bar.inc(1);
    }
}
