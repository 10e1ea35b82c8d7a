//! What is measured of the images: asks the analysis thread for the reference, the exposure, errors and areas.

use super::app::Workbench;
use super::areas::Areas;
use super::desk::{ErrorPoint, Finding, Kind};
use super::gallery::tiled::TiledImage;
use crate::export::tone::auto_exposure;
use crate::measure::Reference;
use crate::render::LightPart;
use std::sync::Arc;

impl Workbench {
    /// Asks for the session's reference, or the scene's own.
    pub(super) fn read_reference(&mut self) {
        self.desk.reference = None;
        self.gallery.set_reference(None);
        let session = &self.document.session;
        self.desk.reference_of = Some(self.document.reference());
        let edited = self.document.is_edited();
        let (scene, reference, mask) = (session.scene.clone(), session.reference.clone(), session.mask.clone());
        self.analysis.ask(Kind::Reference, move || {
            let read = match reference {
                Some(path) => Reference::from_files(path.as_ref(), mask.as_ref().map(|m| m.as_ref())).map(Some),
                // The stored image shows the scene as it is built in.
                None if edited => Ok(None),
                None => Reference::built_in(&scene),
            };
            Finding::Reference(read.map(|found| {
                found.map(|reference| {
                    let image = TiledImage::of(&reference.image);
                    (Arc::new(reference), image)
                })
            }))
        });
    }

    /// Asks for the exposure that suits the last panel that has an image.
    pub(super) fn expose(&mut self) {
        let panels = &self.document.session.panels;
        let shown = panels.iter().rev().filter_map(|p| self.gallery.of(p)).find(|i| i.has_pixels());
        if let Some(image) = shown.map(|i| i.pixels().clone()) {
            self.analysis.ask(Kind::Exposure, move || Finding::Exposure(auto_exposure(&image.to_image()).log2()));
        }
    }

    /// Footprint areas, and errors against the reference.
    pub(super) fn after_pass(&mut self) {
        if let Some(pass) = self.render.pass.clone() {
            self.analysis.ask(Kind::Areas, move || Finding::Areas(Areas::of(&pass)));
        }
        let (Some(progress), Some(job)) = (&self.render.progress, self.render.job()) else { return };
        self.desk.take_estimates(job, progress);
        let Some(reference) = self.desk.reference.clone() else {
            return;
        };
        if job.settings.light != LightPart::All {
            return;
        }
        let mut images = Vec::new();
        for (i, name) in job.estimators.iter().enumerate() {
            let (Some(&passes), Some(live)) = (progress.passes.get(i), self.gallery.of_estimator(name)) else {
                continue;
            };
            if passes > 0 && self.desk.error_of(name).is_none_or(|e| e.passes < passes) {
                let seconds = progress.photon_seconds[i] + progress.estimator_seconds[i].total();
                images.push((name.clone(), passes, seconds, live.pixels().clone()));
            }
        }
        let generation = job.generation;
        self.analysis.ask(Kind::Errors, move || {
            let points = images.into_iter().filter_map(|(name, passes, seconds, image)| {
                let error = reference.error_of(&image.to_image()).ok()?;
                Some((name, ErrorPoint { passes, seconds, error }))
            });
            Finding::Errors(generation, points.collect())
        });
    }
}
