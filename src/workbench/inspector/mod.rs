//! The inspector: why the pinned pixel has its value.

pub mod hemisphere;
pub mod listed;
pub mod plane;
pub mod rays;
pub mod summary;
pub mod table;

use crate::estimate::{Construction, Estimator, registry};
use crate::export::false_color::{FalseColor, ValueRange};
use crate::export::tone::color_map;
use crate::math::rgb::mean;
use crate::photons::PhotonKind;
use crate::render::Pass;
use crate::render::inspect::{Gathering, Inspection, PhotonPath, inspect, photon_path};
use crate::workbench::overlays::photons::is_seen;
use egui::Color32;
use std::sync::Arc;

/// A pixel taken apart, with what is drawn of it.
pub struct Inspected {
    /// The pass that was looked at.
    pub pass: Arc<Pass>,
    /// The account.
    pub inspection: Inspection,
    /// For each row and estimator: points and polygons; empty where the estimator uses none.
    pub constructions: Vec<Vec<Construction>>,
    /// For each of the inspection's gatherings: its rays, the strongest first.
    pub rays: Vec<Vec<ListedRay>>,
}

/// A gather ray in the list of all of them.
#[derive(Clone, Copy, Debug)]
pub struct ListedRay {
    /// Which it is, for [`Gathering::ray`].
    pub at: [usize; 2],
    /// What it adds to the pixel's mean channel, W/(m² sr).
    pub adds: f32,
    /// Whether the camera sees the place where it ends.
    pub seen: bool,
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
        let rays = inspection.gatherings.iter().map(|g| listed(pass, g)).collect();
        Ok(Self { pass: Arc::clone(pass), inspection, constructions, rays })
    }

    /// The gathering of an estimator with the list of its rays.
    pub fn gathering(&self, estimator: usize) -> Option<(&Gathering, &[ListedRay])> {
        let at = self.inspection.gatherings.iter().position(|g| g.estimator == estimator)?;
        Some((&self.inspection.gatherings[at], self.rays.get(at)?))
    }

    /// The gathering of an estimator at a hit: the entry of that hit, or else the first.
    pub fn gathered_at(&self, estimator: usize, hit: usize) -> Option<usize> {
        let (gathering, _) = self.gathering(estimator)?;
        let own = gathering.hits.iter().position(|h| h.hit == hit);
        own.or((!gathering.hits.is_empty()).then_some(0))
    }
}

fn listed(pass: &Pass, gathering: &Gathering) -> Vec<ListedRay> {
    let ray = |at: [usize; 2]| {
        let end = gathering.ray(at).and_then(|r| r.hit);
        let seen = end.is_some_and(|h| is_seen(pass, h.position, h.normal));
        ListedRay { at, adds: mean(gathering.adds(at)), seen }
    };
    gathering.strongest().into_iter().map(ray).collect()
}

/// Colours of what rays bring: logarithmic, from a thousandth of the strongest up.
pub struct RayColors {
    scale: FalseColor,
    most: f32,
}

impl RayColors {
    /// Of the rays of a list, by the colour map of that name.
    pub fn new(rays: &[ListedRay], map: Option<&str>) -> Self {
        let scale = FalseColor::new(color_map(map), ValueRange { low: -3.0, high: 0.0 });
        Self { scale, most: rays.first().map_or(0.0, |r| r.adds) }
    }

    /// That of a ray which adds so much; grey for nothing.
    pub fn of(&self, adds: f32) -> Color32 {
        if !(adds > 0.0 && self.most > 0.0) {
            return Color32::from_gray(70);
        }
        let [r, g, b] = self.scale.color(libm::log10f(adds / self.most));
        Color32::from_rgb(r, g, b)
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
    /// Whether gather rays are shown in place of photons, under an estimator that gathers finally.
    pub shows_rays: bool,
    /// Gather ray under the pointer in this frame, by its place in the list.
    pub hovered_ray: Option<usize>,
    /// Gather ray under the pointer in the frame before.
    pub lit_ray: Option<usize>,
    /// Gather ray that was clicked.
    pub chosen_ray: Option<usize>,
    /// Gather ray to be chosen when the next pixel is found, under the first estimator that gathers finally.
    pub wanted_ray: Option<usize>,
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
            shows_rays: true,
            hovered_ray: None,
            lit_ray: None,
            chosen_ray: None,
            wanted_ray: None,
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
            self.chosen_ray = None;
        }
        // The hit that says most of the pixel comes first.
        let hits = &found.inspection.hits;
        self.hit = self.hit.min(hits.len().saturating_sub(1));
        self.estimator = self.estimator.min(found.inspection.estimators.len().saturating_sub(1));
        if self.chosen.is_some_and(|c| c >= found.inspection.rows.len()) {
            self.chosen = None;
        }
        if let (Some(rank), Some(g)) = (self.wanted_ray, found.inspection.gatherings.first()) {
            (self.estimator, self.chosen_ray, self.wanted_ray) = (g.estimator, Some(rank), None);
        }
        let rays = found.gathering(self.estimator).map_or(0, |(_, rays)| rays.len());
        self.chosen_ray = self.chosen_ray.filter(|r| *r < rays);
        self.lit = None;
        self.hovered = None;
        (self.lit_ray, self.hovered_ray) = (None, None);
        self.found = Some(Arc::new(found));
    }

    /// Forgets what was found.
    pub fn clear(&mut self) {
        *self = Self {
            latest: self.latest,
            zoom: self.zoom,
            sort: self.sort,
            descending: self.descending,
            shows_rays: self.shows_rays,
            ..Self::default()
        };
    }

    /// Begins a frame.
    pub fn begin(&mut self) {
        self.lit = self.hovered.take();
        self.lit_ray = self.hovered_ray.take();
    }

    /// The row that is drawn bright: under the pointer, or else clicked.
    pub fn bright(&self) -> Option<usize> {
        self.lit.or(self.chosen)
    }

    /// The gather ray that is drawn bright, by its place in the list.
    pub fn bright_ray(&self) -> Option<usize> {
        self.lit_ray.or(self.chosen_ray)
    }
}
