//! The inspector: why the pinned pixel has its value.

pub mod plane;
pub mod summary;
pub mod table;

use crate::estimate::{Construction, Estimator, registry};
use crate::photons::PhotonKind;
use crate::render::Pass;
use crate::render::inspect::{Inspection, PhotonPath, inspect, photon_path};
use std::sync::Arc;

/// A pixel taken apart, with what is drawn of it.
pub struct Inspected {
    /// The pass that was looked at.
    pub pass: Arc<Pass>,
    /// The account.
    pub inspection: Inspection,
    /// For each row and estimator: points and polygons; empty where the estimator uses none.
    pub constructions: Vec<Vec<Construction>>,
}

impl Inspected {
    /// Takes a pixel of a pass apart under the estimators named.
    ///
    /// # Errors
    /// As [`inspect`], in one line.
    pub fn new(pass: &Arc<Pass>, names: &[String], pixel: [u32; 2]) -> Result<Self, String> {
        let estimators: Vec<Box<dyn Estimator>> = names.iter().filter_map(|n| registry::estimator(n).ok()).collect();
        let inspection = inspect(pass, &estimators, pixel).map_err(|e| e.to_string())?;
        let constructions = inspection.rows.iter().map(|row| {
            let photon = pass.maps.of(row.kind).and_then(|m| m.photons().get(row.index as usize));
            let view = inspection.hits.get(row.hit).map(|h| h.view);
            match (photon, view) {
                (Some(photon), Some(view)) => estimators.iter().map(|e| e.construction(photon, &view)).collect(),
                _ => Vec::new(),
            }
        });
        let constructions = constructions.collect();
        Ok(Self { pass: Arc::clone(pass), inspection, constructions })
    }
}

/// The path of one photon, and which it is.
pub struct FoundPath {
    /// The photon.
    pub photon: (PhotonKind, u32),
    /// Its path.
    pub path: PhotonPath,
}

impl FoundPath {
    /// Follows a photon of a pass again.
    pub fn new(pass: &Pass, kind: PhotonKind, index: u32) -> Option<Self> {
        Some(Self { photon: (kind, index), path: photon_path(pass, kind, index)? })
    }
}

/// What orders the table.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Column {
    /// Kind and index.
    Photon,
    /// Mean of the power's channels.
    Power,
    /// Area of the footprint.
    Area,
    /// Distance in filter space.
    Distance,
    /// Situation of figure 10.
    Situation,
    /// Weight under an estimator.
    Weight(usize),
}

/// State of the inspector.
pub struct Inspector {
    /// What was found last.
    pub found: Option<Arc<Inspected>>,
    /// What was asked for last: the pass's address, the pixel, the estimators.
    pub asked: Option<(usize, [u32; 2], Vec<String>)>,
    /// Whether to look at the latest pass instead of the first.
    pub latest: bool,
    /// Which hit is drawn.
    pub hit: usize,
    /// Which estimator's points and polygons are drawn.
    pub estimator: usize,
    /// What orders the table.
    pub sort: Column,
    /// Whether the largest comes first.
    pub descending: bool,
    /// Row under the pointer, in table or drawing, of this frame.
    pub hovered: Option<usize>,
    /// Row under the pointer in the frame before: what is drawn bright now.
    pub lit: Option<usize>,
    /// Row that was clicked.
    pub chosen: Option<usize>,
    /// Zoom of the drawing.
    pub zoom: f32,
    /// Path of the photon that was clicked.
    pub path: Option<FoundPath>,
}

impl Default for Inspector {
    fn default() -> Self {
        Self {
            found: None,
            asked: None,
            latest: false,
            hit: 0,
            estimator: 0,
            sort: Column::Weight(0),
            descending: true,
            hovered: None,
            lit: None,
            chosen: None,
            zoom: 1.0,
            path: None,
        }
    }
}

impl Inspector {
    /// Takes in what was found for another pixel, pass or list of estimators.
    pub fn take(&mut self, found: Inspected) {
        let same_pixel = self.found.as_ref().is_some_and(|f| f.inspection.pixel == found.inspection.pixel);
        if !same_pixel {
            self.hit = 0;
            self.chosen = None;
            self.path = None;
        }
        // The hit that says most of the pixel comes first.
        let hits = &found.inspection.hits;
        self.hit = self.hit.min(hits.len().saturating_sub(1));
        self.estimator = self.estimator.min(found.inspection.estimators.len().saturating_sub(1));
        if self.chosen.is_some_and(|c| c >= found.inspection.rows.len()) {
            self.chosen = None;
        }
        self.lit = None;
        self.hovered = None;
        self.found = Some(Arc::new(found));
    }

    /// Forgets what was found.
    pub fn clear(&mut self) {
        *self = Self {
            latest: self.latest,
            zoom: self.zoom,
            sort: self.sort,
            descending: self.descending,
            ..Self::default()
        };
    }

    /// Begins a frame.
    pub fn begin(&mut self) {
        self.lit = self.hovered.take();
    }

    /// The row that is drawn bright: under the pointer, or else clicked.
    pub fn bright(&self) -> Option<usize> {
        self.lit.or(self.chosen)
    }
}
