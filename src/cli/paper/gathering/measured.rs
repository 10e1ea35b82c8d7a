//! One table of the benchmark, measured: photons, what is made of them, and images by every way and number of rays.

use crate::cli::failure::Failure;
use crate::cli::paper::gathering::layers::PyramidBytes;
use crate::cli::paper::gathering::methods::Way;
use crate::cli::paper::gathering::output::counts;
use crate::cli::paper::gathering::printed::PrintedTable;
use crate::cli::progress::{ProgressWatch, interrupted};
use crate::estimate::Estimator;
use crate::final_gather::GatherMaps;
use crate::render::Pass;
use crate::render::film::{Image, Rect};
use crate::render::plan::Slot;
use crate::render::settings::{Gather, RenderSettings};
use crate::render::stats::StoredCounts;
use crate::scene::Scene;
use serde::Serialize;
use std::sync::Arc;
use std::time::Instant;

/// Wall seconds to make what a way looks up.
#[derive(Clone, Copy, Debug, Default, Serialize)]
pub struct BuildSeconds {
    /// The tree over all photons.
    pub tree: f64,
    /// The first layer.
    pub first_layer: f64,
    /// All other layers.
    pub other_layers: f64,
}

impl BuildSeconds {
    /// All of it.
    pub fn total(&self) -> f64 {
        self.tree + self.first_layer + self.other_layers
    }
}

/// A way with a number of rays.
pub struct Cell {
    /// What is looked up.
    pub way: Way,
    /// Gather rays.
    pub rays: u32,
    /// The estimator with its final gathering.
    pub estimator: Box<dyn Estimator>,
    /// Wall seconds of the image, repeat by repeat, direct light included.
    pub image_seconds: Vec<f64>,
    /// Its seconds to build, repeat by repeat.
    pub build: Vec<BuildSeconds>,
    /// The image.
    pub image: Image,
}

impl Cell {
    /// Seconds of everything but the photons, repeat by repeat: the paper's "total".
    pub fn totals(&self) -> Vec<f64> {
        self.image_seconds.iter().zip(&self.build).map(|(image, build)| image + build.total()).collect()
    }
}

/// A table, measured.
pub struct Measured {
    /// The table in print.
    pub printed: PrintedTable,
    /// Photons emitted.
    pub emitted: u64,
    /// Photons stored.
    pub stored: StoredCounts,
    /// Wall seconds to emit them, repeat by repeat.
    pub emission: Vec<f64>,
    /// Ways within numbers of rays, in the order of [`Way::TIMED`].
    pub cells: Vec<Cell>,
    /// Memory of each way's pyramid.
    pub memory: Vec<(Way, PyramidBytes)>,
}

/// Measures a table `repeats` times. The ways take turns at being first.
///
/// # Errors
/// Too little memory, or an interruption.
pub fn measure(
    scene: &Arc<Scene>,
    settings: RenderSettings,
    printed: PrintedTable,
    repeats: u32,
    watch: &ProgressWatch,
    stopped: &dyn Fn() -> Failure,
) -> Result<Measured, Failure> {
    let mut cells = Vec::new();
    for rays in printed.rows.map(|r| r.rays) {
        for way in Way::TIMED {
            cells.push(Cell {
                way,
                rays,
                estimator: way.estimator(rays, printed.radius)?,
                image_seconds: Vec::new(),
                build: Vec::new(),
                image: Image::black(settings.size),
            });
        }
    }
    let whole = Rect::whole(settings.size);
    let slots: Vec<Slot> = cells.iter().map(|c| Slot::new(c.estimator.as_ref(), Gather::Overlap)).collect();
    let pass = Pass::for_slots(Arc::clone(scene), settings, &slots, 0, &interrupted)?;
    let mut pass = pass.ok_or_else(stopped)?;
    let mut emission = Vec::new();
    let ways = Way::TIMED.len();
    for repeat in 0..repeats as usize {
        let start = Instant::now();
        let again = pass.emitter().run(0, &interrupted);
        emission.push(start.elapsed().as_secs_f64());
        drop(again);
        if repeat > 0 {
            let wanted = &pass.plan.final_gatherings;
            pass.gathering =
                GatherMaps::new(&pass.scene, &pass.photons.stored, wanted, pass.settings.k, pass.area_factor);
        }
        for group in 0..cells.len() / ways {
            for place in 0..ways {
                let cell = &mut cells[group * ways + (place + group + repeat) % ways];
                let slot = Slot::new(cell.estimator.as_ref(), Gather::Overlap);
                let result = pass.view().run(whole, &[slot], watch);
                if !result.complete {
                    return Err(stopped());
                }
                cell.image_seconds.push(result.wall);
                cell.build.push(build_seconds(&pass.gathering, cell.estimator.as_ref()));
                cell.image = result.image(0, whole);
            }
        }
    }
    let mut memory = Vec::new();
    for cell in cells.iter().take(ways) {
        let pyramid = cell.estimator.final_gathering().and_then(|f| pass.gathering.pyramid(f));
        memory.extend(pyramid.map(|p| (cell.way, PyramidBytes::new(p))));
    }
    let (emitted, stored) = (pass.photons.emitted, counts(&pass.photons.stored));
    Ok(Measured { printed, emitted, stored, emission, cells, memory })
}

/// As if the way were alone.
fn build_seconds(maps: &GatherMaps, estimator: &dyn Estimator) -> BuildSeconds {
    let Some(f) = estimator.final_gathering() else { return BuildSeconds::default() };
    let layers = maps.pyramid(f).map(|p| *p.seconds()).unwrap_or_default();
    let tree = (maps.seconds(f) - layers.first - layers.others).max(0.0);
    BuildSeconds { tree, first_layer: layers.first, other_layers: layers.others }
}
