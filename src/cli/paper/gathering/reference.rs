//! References of the rooms by the path tracer, and the pixels where images may be compared with them.

use crate::cli::failure::Failure;
use crate::cli::progress::{bar, interrupted};
use crate::measure::reference::cache;
use crate::measure::tracer::{ReferenceSettings, Until};
use crate::measure::{ErrorMetrics, Mask, Reference, metrics};
use crate::render::LightPart;
use crate::render::film::Image;
use crate::scene::Scene;
use crate::trace::{Intersector, Ray, Surface};
use serde::Serialize;

/// Noise over the mean at which a reference is good enough.
const NOISE: f64 = 0.01;
/// Seed of the references, which no study uses: their batches are then those of these items alone.
const SEED: u64 = 3;
/// Rays across a pixel that look for edges.
const PROBES: u32 = 5;
/// Distance from the plane of a pixel's centre, over the distance to the centre, above which a place is beyond an edge.
const OFF_PLANE: f32 = 0.25;
/// Smallest dot product of normals within a pixel without an edge.
const SAME_NORMAL: f32 = 0.9;

/// What images of a room are judged by.
pub struct Truth {
    /// The reference.
    pub reference: Reference,
    /// The pixels without an edge of a surface: an image has one ray through the centre of each, the reference the mean.
    pub mask: Mask,
    /// What was odd about the cache.
    pub warnings: Vec<String>,
}

/// The same in words and numbers.
#[derive(Clone, Debug, Serialize)]
pub struct TruthFacts {
    /// Where it comes from.
    pub source: String,
    /// RMS of its noise over its mean, over the pixels that count.
    pub relative_noise: Option<f64>,
    /// Pixels that count.
    pub pixels: usize,
    /// Share of the pixels that count.
    pub share: f64,
}

impl Truth {
    /// Traces it with at most `most` paths for each pixel (a number, not a time, so that errors do not depend on the
    /// machine), or goes on from what the cache has.
    ///
    /// # Errors
    /// An interruption.
    pub fn new(
        scene: &Scene,
        size: [u32; 2],
        max_depth: u32,
        most: u32,
        hidden: bool,
        item: &str,
    ) -> Result<Self, Failure> {
        let intersector = Intersector::new(&scene.geometry, scene.radius);
        let settings = ReferenceSettings { size, light: LightPart::All, max_depth, seed: SEED };
        let paths = crate::measure::tracer::Tracer::new(scene, &intersector, settings).samples();
        let until = Until { noise: Some(NOISE), seconds: None, batches: Some((most / paths.max(1)).max(2)) };
        let progress = bar(u64::from(until.batches.unwrap_or(1)), "reference", hidden);
        let folder = cache::default_folder();
        let (reference, warnings) = cache::cached_reference(
            folder.as_deref(),
            scene,
            &intersector,
            &settings,
            &until,
            &interrupted,
            &mut |_, _| progress.inc(1),
        );
        progress.finish_and_clear();
        if interrupted() {
            return Err(Failure::Interrupted(format!("nothing of {item} was written")));
        }
        let mut mask = without_edges(scene, &intersector, size);
        let out: Vec<bool> = reference.mask.counts.iter().map(|counts| !counts).collect();
        mask.leave_out(&out);
        Ok(Self { reference, mask, warnings })
    }

    /// Errors of an image; None if no pixel counts.
    pub fn error(&self, image: &Image) -> Option<ErrorMetrics> {
        metrics::compare(image, &self.reference.image, &self.mask).ok()
    }

    /// What of a relative RMSE is left without the reference's own noise, which adds to it in squares; None if unknown.
    pub fn net(&self, relative_rmse: f64) -> Option<f64> {
        let noise = self.reference.relative_noise(&self.mask)?;
        Some((relative_rmse * relative_rmse - noise * noise).max(0.0).sqrt())
    }

    /// Facts for files.
    pub fn facts(&self) -> TruthFacts {
        let pixels = self.mask.counts.iter().filter(|c| **c).count();
        TruthFacts {
            source: self.reference.source.clone(),
            relative_noise: self.reference.relative_noise(&self.mask),
            pixels,
            share: pixels as f64 / self.mask.counts.len().max(1) as f64,
        }
    }
}

impl TruthFacts {
    /// One line for people.
    pub fn line(&self) -> String {
        let noise = self.relative_noise.map_or("unknown".into(), |n| format!("{:.2} %", 100.0 * n));
        format!(
            "reference: {}; its own noise {noise} of the mean; errors over the {} pixels without an edge ({:.0} %)",
            self.source,
            self.pixels,
            100.0 * self.share
        )
    }
}

/// The pixels all of whose rays meet one surface that bends little.
fn without_edges(scene: &Scene, intersector: &Intersector, size: [u32; 2]) -> Mask {
    let rays = scene.camera.rays(size);
    let at = |x: f32, y: f32| {
        let (direction, _) = rays.ray(x, y, 0.5);
        let ray = Ray { origin: scene.camera.position, direction };
        intersector.closest(&ray).map(|hit| (Surface::new(scene, &ray, &hit), hit.t))
    };
    let same = |x: u32, y: u32| {
        let Some((center, distance)) = at(x as f32 + 0.5, y as f32 + 0.5) else { return false };
        // A hair inside the pixel's border, which its neighbours share.
        let place = |i: u32| 0.01 + 0.98 * i as f32 / (PROBES - 1) as f32;
        (0..PROBES * PROBES).all(|i| {
            at(x as f32 + place(i % PROBES), y as f32 + place(i / PROBES)).is_some_and(|(s, _)| {
                let to = s.position - center.position;
                let off = to.dot(center.normal).abs();
                let agrees = s.material == center.material && s.normal.dot(center.normal) >= SAME_NORMAL;
                agrees && off <= OFF_PLANE * to.length() + 1e-5 * distance
            })
        })
    };
    let counts = (0..size[1]).flat_map(|y| (0..size[0]).map(move |x| (x, y))).map(|(x, y)| same(x, y)).collect();
    Mask { size, counts }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cli::paper::gathering::room;

    /// Walls fill most of the image; the row where the back wall meets the ceiling has an edge, the middle of the back
    /// wall has none.
    #[test]
    fn edges_are_left_out() {
        let scene = room::two_lights().expect("opens");
        let intersector = Intersector::new(&scene.geometry, scene.radius);
        let size = [65, 65];
        let mask = without_edges(&scene, &intersector, size);
        let share = mask.counts.iter().filter(|c| **c).count() as f64 / mask.counts.len() as f64;
        assert!((0.6..0.95).contains(&share), "{share}");
        let column: Vec<bool> = (0..65).map(|y| mask.counts[y * 65 + 32]).collect();
        assert!(column[20] && column.iter().filter(|c| !**c).count() >= 2, "{column:?}");
    }
}
