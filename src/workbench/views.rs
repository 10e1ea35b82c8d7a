//! What panels show besides radiance: asks the analysis thread for heatmaps and differences.

use super::app::Workbench;
use super::desk::{Finding, Kind};
use super::gallery::Gallery;
use super::gallery::tiled::TiledImage;
use super::gallery::values::{Origin, Values};
use super::overlays::estimates::VisibleEstimates;
use super::overlays::photons::VisiblePhotons;
use super::render::Render;
use crate::export::session::{Mode, Panel, Session};
use crate::measure::Reference;
use crate::render::heatmap::Heatmap;
use std::sync::Arc;

/// The heatmap that a panel shows.
pub fn heatmap_of(panel: &Panel) -> Option<Heatmap> {
    panel.heatmap.as_deref().and_then(Heatmap::parse).filter(|_| panel.image.is_none())
}

/// Whether panel `index` shows a difference; not the panel that others are compared with.
pub fn shows_difference(session: &Session, index: usize) -> bool {
    session.comparison.mode == Mode::Difference && session.comparison.with != Some(index)
}

/// What panels are compared with.
enum OtherSide {
    Panel(TiledImage),
    Reference(Arc<Reference>),
}

/// What the panels are compared with, and the number of its last change.
fn other_side(session: &Session, gallery: &Gallery, reference: Option<&Arc<Reference>>) -> Option<(OtherSide, u64)> {
    match session.comparison.with {
        Some(i) => {
            let live = gallery.of(session.panels.get(i)?)?;
            Some((OtherSide::Panel(live.pixels().clone()), live.version()))
        }
        None => reference.map(|r| (OtherSide::Reference(Arc::clone(r)), 0)),
    }
}

impl Workbench {
    /// Asks once for the files of panels that a session or a step of the history brought.
    pub(super) fn ask_images(&mut self) {
        let files = self.document.session.panels.iter().filter_map(|p| p.image.clone());
        for path in files.collect::<Vec<_>>() {
            if !self.gallery.has_file(&path) && !self.desk.asked_images.contains(&path) {
                self.read_image(&path);
            }
        }
    }

    /// Asks for the photons of the overlay: those of the first pass, which stay as they are while the render goes on.
    pub(super) fn ask_photons(&mut self) {
        let on = self.document.session.overlays.iter().any(|o| o == "photons");
        let Some(pass) = self.render.first_pass.clone().filter(|_| on) else { return };
        let address = Arc::as_ptr(&pass) as usize;
        if self.desk.photons_of != Some(address) {
            self.desk.photons_of = Some(address);
            self.analysis.ask(Kind::Photons, move || Finding::Photons(VisiblePhotons::of(&pass)));
        }
    }

    /// Asks for the irradiance estimates of the overlay, of the first pass as well.
    pub(super) fn ask_estimates(&mut self) {
        let on = self.document.session.overlays.iter().any(|o| o == "irradiance");
        let Some(pass) = self.render.first_pass.clone().filter(|_| on) else { return };
        let shown = self.desk.shown_estimates;
        let wanted = (Arc::as_ptr(&pass) as usize, shown);
        if self.desk.estimates_of != Some(wanted) {
            self.desk.estimates_of = Some(wanted);
            self.analysis.ask(Kind::Estimates, move || Finding::Estimates(VisibleEstimates::of(&pass, shown)));
        }
    }

    /// Asks for the numbers of panels that show numbers and have none of what is shown now.
    pub(super) fn ask_values(&mut self) {
        let session = &self.document.session;
        let count = session.panels.len();
        self.gallery.values.retain(|panel, _| *panel < count);
        self.desk.asked_values.retain(|panel, _| *panel < count);
        for (index, panel) in session.panels.iter().enumerate() {
            let wanted = match heatmap_of(panel).filter(|h| !(self.desk.untimed && *h == Heatmap::TileMilliseconds)) {
                Some(kind) => heatmap_work(&self.render, panel, kind),
                None if shows_difference(session, index) => {
                    let stops = if session.tone.auto { self.desk.auto_exposure } else { session.tone.exposure };
                    let reference = self.desk.reference.as_ref();
                    difference_work(session, &self.gallery, reference, panel, stops, self.render.passes_seen)
                }
                None => {
                    self.gallery.values.remove(&index);
                    self.desk.asked_values.remove(&index);
                    continue;
                }
            };
            let Some((origin, work)) = wanted else {
                // Without the other side there is no difference, and an old one would be wrong.
                if shows_difference(session, index) && heatmap_of(panel).is_none() {
                    self.gallery.values.remove(&index);
                    self.desk.asked_values.remove(&index);
                }
                continue;
            };
            if self.desk.asked_values.get(&index) != Some(&origin) {
                self.desk.asked_values.insert(index, origin);
                self.analysis.ask(Kind::Values(index), move || Finding::Values(index, work()));
            }
        }
    }
}

/// What numbers would be made of, and how they are made.
pub(super) type Work = (Origin, Box<dyn FnOnce() -> Result<Values, String> + Send>);

/// The heatmap of a panel in the first pass; None before there is one.
pub(super) fn heatmap_work(render: &Render, panel: &Panel, kind: Heatmap) -> Option<Work> {
    let pass = Arc::clone(render.first_pass.as_ref()?);
    let name = panel.estimator.clone();
    let origin = Origin::Heatmap(kind, name.clone(), Arc::as_ptr(&pass) as usize);
    let made = origin.clone();
    Some((origin, Box::new(move || Values::heatmap(&pass, &name, kind, made))))
}

/// A difference of whole passes: made again when a pass is done, not with every tile.
pub(super) fn difference_work(
    session: &Session,
    gallery: &Gallery,
    reference: Option<&Arc<Reference>>,
    panel: &Panel,
    stops: f32,
    passes_seen: u64,
) -> Option<Work> {
    let live = gallery.of(panel)?;
    let (other, other_version) = other_side(session, gallery, reference)?;
    let kind = session.comparison.difference;
    // Before the first pass is done every tile counts; the stops count for FLIP alone.
    let version = if passes_seen == 0 { live.version() } else { passes_seen << 32 };
    let with = session.comparison.with.map_or(other_version, |i| (i as u64 + 1) << 48);
    let is_flip = kind == crate::measure::difference::Difference::Flip;
    let bits = if is_flip { stops.to_bits() } else { 0 };
    let origin = Origin::Difference(kind, version, with, bits);
    let (image, made) = (live.pixels().clone(), origin.clone());
    let work = move || {
        let image = image.to_image();
        match other {
            OtherSide::Panel(other) => Values::difference(&image, &other.to_image(), kind, stops, made),
            OtherSide::Reference(reference) => Values::difference(&image, &reference.image, kind, stops, made),
        }
    };
    Some((origin, Box::new(work)))
}
