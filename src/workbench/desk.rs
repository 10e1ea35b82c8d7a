//! What the window knows beyond the session: the pointer, open dialogs, findings of the analysis thread.

use super::actions::Action;
use super::areas::Areas;
use super::dialogs::Dialogs;
use super::gallery::tiled::TiledImage;
use super::gallery::values::{Origin, Values};
use super::inspector::{FoundPath, Inspected, Inspector};
use super::overlays::estimates::{Shown, VisibleEstimates};
use super::overlays::photons::VisiblePhotons;
use super::recent::Recent;
use super::worker::messages::{Job, Progress};
use crate::measure::{ErrorMetrics, Reference};
use crate::render::ErrorEstimate;
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

/// A kind of work for the analysis thread.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Kind {
    /// Open a scene.
    Open,
    /// Read a reference.
    Reference,
    /// Read an image.
    Image(String),
    /// The exposure that suits the images.
    Exposure,
    /// Errors of all panels.
    Errors,
    /// Histogram of footprint areas.
    Areas,
    /// Numbers of a panel.
    Values(usize),
    /// Photons that the camera sees.
    Photons,
    /// Irradiance estimates that the camera sees.
    Estimates,
    /// The pinned pixel.
    Inspect,
    /// A photon's path.
    Path,
    /// Write what is shown.
    Export,
}

/// What the analysis thread has found.
pub enum Finding {
    /// A scene for a session, or why there is none; whether it is a step of the history.
    Opened(Box<Result<super::document::Opened, String>>, Step),
    /// The reference that belongs to a session's scene, if there is one.
    Reference(Result<Option<(Arc<Reference>, TiledImage)>, String>),
    /// An image from a file.
    Image(String, Result<TiledImage, String>),
    /// The exposure that suits the images, stops.
    Exposure(f32),
    /// Errors by estimator, of a generation.
    Errors(u64, Vec<(String, ErrorPoint)>),
    /// Histogram of footprint areas.
    Areas(Areas),
    /// Numbers of a panel.
    Values(usize, Result<Values, String>),
    /// Photons that the camera sees.
    Photons(VisiblePhotons),
    /// Irradiance estimates that the camera sees; none without a pyramid.
    Estimates(Option<VisibleEstimates>),
    /// The pinned pixel taken apart.
    Inspected(Result<Box<Inspected>, String>),
    /// The path of a photon.
    Path(Option<FoundPath>),
    /// What was exported, or why not.
    Exported(Result<String, String>),
}

/// How a scene that was opened comes into the history.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Step {
    /// As a new step.
    New,
    /// It is a step back or forth.
    Taken,
    /// No step: the same scene, whose file has changed.
    Reloaded,
    /// As a new document, with the session's file.
    Document(Option<std::path::PathBuf>),
}

/// An error at a time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ErrorPoint {
    /// Passes.
    pub passes: u32,
    /// Seconds of photons, maps and this estimator's view passes.
    pub seconds: f64,
    /// The error against the reference.
    pub error: ErrorMetrics,
}

/// An estimated error at a time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EstimatePoint {
    /// Seconds as in [`ErrorPoint`].
    pub seconds: f64,
    /// The estimate.
    pub error: ErrorEstimate,
}

/// What lies under the pointer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hover {
    /// Number of the panel.
    pub panel: usize,
    /// The pixel.
    pub pixel: [u32; 2],
    /// Place in the image, pixels.
    pub at: [f32; 2],
}

/// State of the window that is not saved.
#[derive(Default)]
pub struct Desk {
    /// What lies under the pointer.
    pub hover: Option<Hover>,
    /// What lay there in the frame before.
    pub hover_before: Option<Hover>,
    /// Dialogs.
    pub dialogs: Dialogs,
    /// A panel that fills the middle.
    pub maximized: Option<usize>,
    /// Whether the key of the other side is held.
    pub flipped: bool,
    /// Whether a rectangle is to be dragged, and where it began.
    pub crop_drag: Option<Option<[u32; 2]>>,
    /// Exposure by the images, stops.
    pub auto_exposure: f32,
    /// What panels are compared with by default.
    pub reference: Option<Arc<Reference>>,
    /// What was asked for last.
    pub reference_of: Option<super::document::ReferenceOf>,
    /// Error curves by estimator.
    pub errors: BTreeMap<String, Vec<ErrorPoint>>,
    /// Curves of estimated errors by estimator.
    pub estimates: BTreeMap<String, Vec<EstimatePoint>>,
    /// The inspector.
    pub inspector: Inspector,
    /// What each panel's numbers were asked for last.
    pub asked_values: BTreeMap<usize, Origin>,
    /// Image files that were asked for.
    pub asked_images: BTreeSet<String>,
    /// Photons that the camera sees, for the overlay.
    pub visible_photons: VisiblePhotons,
    /// The pass that they are of, by its address.
    pub photons_of: Option<usize>,
    /// Which irradiance estimates the overlay draws.
    pub shown_estimates: Shown,
    /// The estimates, for the overlay.
    pub visible_estimates: Option<VisibleEstimates>,
    /// The pass that they are of, by its address, and which were asked for.
    pub estimates_of: Option<(usize, Shown)>,
    /// Footprint areas of the last pass.
    pub areas: Areas,
    /// What was opened last.
    pub recent: Recent,
    /// What the user asked for in this frame.
    pub actions: Vec<Action>,
    /// Whether what the panes show needs more frames to be brought up to date.
    pub unfinished: bool,
    /// Whether measured times and memory are left out, so that the same work gives the same picture.
    pub untimed: bool,
}

impl Desk {
    /// Asks for an action at the end of the frame.
    pub fn ask(&mut self, action: Action) {
        self.actions.push(action);
    }

    /// Seconds with a fitting unit; a dash where times are left out.
    pub fn seconds(&self, s: f64) -> String {
        if self.untimed { "-".into() } else { super::theme::seconds(s) }
    }

    /// Takes in what the worker estimated after a pass.
    pub fn take_estimates(&mut self, job: &Job, progress: &Progress) {
        for (i, name) in job.estimators.iter().enumerate() {
            let (Some(Some(error)), Some(shared), Some(own)) =
                (progress.estimates.get(i), progress.photon_seconds.get(i), progress.estimator_seconds.get(i))
            else {
                continue;
            };
            let curve = self.estimates.entry(name.clone()).or_default();
            if curve.last().is_none_or(|last| last.error.passes < error.passes) {
                curve.push(EstimatePoint { seconds: shared + own.total(), error: *error });
            }
        }
    }

    /// Forgets all errors: the images are others.
    pub fn forget_errors(&mut self) {
        self.errors.clear();
        self.estimates.clear();
    }

    /// The last error of an estimator.
    pub fn error_of(&self, estimator: &str) -> Option<ErrorPoint> {
        self.errors.get(estimator)?.last().copied()
    }
}
