//! What the window asks of the worker, and what the worker tells the window.

use crate::final_gather::GatherCounts;
use crate::math::rgb::Rgb;
use crate::render::film::Rect;
use crate::render::pass::Pass;
use crate::render::settings::RenderSettings;
use crate::render::stats::{Bounded, Seconds, StoredCounts};
use crate::render::view_pass::PartSeconds;
use crate::render::{ErrorEstimate, StopRule, StoppedBy};
use crate::scene::Scene;
use std::sync::Arc;

/// Everything that a render depends on, and the generation that it belongs to.
#[derive(Clone)]
pub struct Job {
    /// Number of the change that made it. Larger is newer; what belongs to an older one is stale.
    pub generation: u64,
    /// The scene.
    pub scene: Arc<Scene>,
    /// The settings.
    pub settings: RenderSettings,
    /// Estimators with their settings, as `multi_sampled:n=8,grid=cells`. Each of them is valid.
    pub estimators: Vec<String>,
    /// When the worker rests. Seconds are those of rendering, and the pass that runs is finished.
    pub stop: StopRule,
}

/// What the window asks.
pub enum Command {
    /// Render this from now on, keeping what the change leaves valid.
    Render(Box<Job>),
    /// End the thread.
    Quit,
}

/// What the worker tells. Each belongs to a generation; the window drops those of older ones.
pub enum Event {
    /// Photons and maps of a pass stand.
    PassStarted {
        /// Generation of the job.
        generation: u64,
        /// The pass.
        pass: Arc<Pass>,
        /// Whether it is not kept.
        draft: bool,
    },
    /// A tile is done.
    TileDone {
        /// Generation of the job.
        generation: u64,
        /// Where it lies.
        rect: Rect,
        /// One for each estimator of the pass.
        images: Vec<TileImage>,
        /// Whether it is not kept.
        draft: bool,
    },
    /// All tiles of a draft have come.
    DraftDone {
        /// Generation of the job.
        generation: u64,
    },
    /// A pass is in the films.
    PassDone {
        /// Generation of the job.
        generation: u64,
        /// Where the render stands.
        progress: Box<Progress>,
    },
    /// The worker rests.
    Finished {
        /// Generation of the job.
        generation: u64,
        /// Why.
        why: StoppedBy,
    },
    /// The next pass would need more memory than there is; the worker rests, and what it has stays.
    Refused {
        /// Generation of the job.
        generation: u64,
        /// One line.
        why: String,
    },
    /// The worker's thread has ended by a defect; the window may start another.
    Failed {
        /// One line.
        why: String,
    },
}

/// One estimator's part of a tile.
pub struct TileImage {
    /// Index of the estimator in the job.
    pub estimator: usize,
    /// Mean radiance of the passes so far, row by row.
    pub pixels: Vec<Rgb>,
    /// Thread seconds of this pass.
    pub seconds: PartSeconds,
}

/// Where a render stands after a pass.
#[derive(Clone, Debug)]
pub struct Progress {
    /// Passes that each estimator has.
    pub passes: Vec<u32>,
    /// Wall seconds of each estimator's view passes.
    pub estimator_seconds: Vec<PartSeconds>,
    /// Wall seconds of photons and maps of each estimator's passes.
    pub photon_seconds: Vec<f64>,
    /// Wall seconds of all passes by part.
    pub seconds: Seconds,
    /// Estimated error of each estimator's image, if it was looked at after this pass.
    pub estimates: Vec<Option<ErrorEstimate>>,
    /// Photons emitted in all passes.
    pub emitted: u64,
    /// Photons stored in all passes.
    pub stored: StoredCounts,
    /// Rays of final gathering in all passes, and how they ended.
    pub gather_counts: GatherCounts,
    /// What was bounded.
    pub bounded: Bounded,
    /// What was odd.
    pub warnings: Vec<String>,
}

impl Event {
    /// Generation that it belongs to; None if it concerns all.
    pub fn generation(&self) -> Option<u64> {
        match self {
            Self::PassStarted { generation, .. }
            | Self::TileDone { generation, .. }
            | Self::DraftDone { generation }
            | Self::PassDone { generation, .. }
            | Self::Refused { generation, .. }
            | Self::Finished { generation, .. } => Some(*generation),
            Self::Failed { .. } => None,
        }
    }
}
