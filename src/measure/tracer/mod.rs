//! References of our own: two plain, unbiased tracers that share nothing with the estimators.
//!
//! They use the scene, the intersector and the surface at a hit, and otherwise code of their own: no differentials, no
//! photon maps, no footprints. An image is the mean of independent batches, so that its noise is measured on itself.

pub mod batches;
pub mod directions;
pub mod emission;
pub mod illumination;
pub mod light;
pub mod path;
pub mod pinhole;
pub mod scattering;

use crate::math::hash::mix;
use crate::measure::reference::{Noise, Reference};
use crate::measure::{Mask, reference::closed_form};
use crate::render::LightPart;
use crate::scene::{Material, Scene};
use crate::trace::Intersector;
use batches::Batches;
use emission::Aim;
use glam::DVec3;
use illumination::Illumination;
use light::{LightTracer, Parts};
use path::PathTracer;
use pinhole::{Pinhole, pixels_that_see};
use std::time::Instant;

/// Changes when the same settings give another image, so that no stored state is mixed with it.
pub const TRACER_VERSION: u32 = 1;

/// Paths or photons of a batch: about a second of work. Images of many pixels have one path for each.
const BATCH: u64 = 1 << 19;
/// Most paths for each pixel in a batch.
const MOST_SAMPLES: u64 = 64;
/// Batches before the measured noise is trusted enough to stop on it.
pub const TRUSTED_BATCHES: u32 = 16;
/// What a reference shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ReferenceSettings {
    /// Pixels across and down, at least 1 each.
    pub size: [u32; 2],
    /// Which light is shown.
    pub light: LightPart,
    /// Surfaces that a view path, or a path from a light, may meet, at least 1; as in the renderer's settings.
    pub max_depth: u32,
    /// Seed of everything random.
    pub seed: u64,
}

/// When a reference is good enough; what is met first counts. Without any of them only the caller stops it.
///
/// All count from the very first batch, also from one that a cache brought back.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Until {
    /// RMS of the noise over the mean, over the mask; trusted from [`TRUSTED_BATCHES`] batches on.
    pub noise: Option<f64>,
    /// Seconds spent in batches. Two batches are made at least, so that there is a noise to tell.
    pub seconds: Option<f64>,
    /// Batches.
    pub batches: Option<u32>,
}

/// Which tracer makes an image.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Method {
    /// Paths from the camera. All pixels count but those that see a light directly: its radiance is no estimator's work.
    Paths,
    /// Photons for light whose first surface is specular, all aimed there, and paths for all other light. Only pixels
    /// count that see diffuse surfaces alone, directly: no photon can be joined to the camera by a mirror or glass.
    PathsAndPhotons,
}

impl Method {
    /// Photons where light meets specular surfaces; else paths.
    ///
    /// No path from the camera finds the caustic of a light without area. Of a light with area it does, but at the same
    /// time a caustic by photons has a tenth of the noise or less (`ring_soft`, `glass_sphere`).
    pub fn of(scene: &Scene, light: LightPart) -> Self {
        let photons = scene.has_specular() && !scene.lights.is_empty() && light != LightPart::Direct;
        if photons { Self::PathsAndPhotons } else { Self::Paths }
    }

    fn mask(self, scene: &Scene, intersector: &Intersector, camera: &Pinhole) -> Mask {
        pixels_that_see(scene, intersector, camera, |material| match self {
            Self::Paths => !matches!(material, Some(Material::Emitter { .. })),
            Self::PathsAndPhotons => material.is_some_and(Material::is_diffuse),
        })
    }
}

/// A reference in the making: batches are added until it is good enough, now or later.
pub struct Tracer<'a> {
    scene: &'a Scene,
    settings: ReferenceSettings,
    method: Method,
    paths: PathTracer<'a>,
    photons: LightTracer<'a>,
    samples: u32,
    mask: Mask,
    batches: Batches,
    seconds: f64,
}

impl<'a> Tracer<'a> {
    /// With the method of choice; nothing is traced yet but the mask.
    pub fn new(scene: &'a Scene, intersector: &'a Intersector, settings: ReferenceSettings) -> Self {
        Self::with_method(scene, intersector, settings, Method::of(scene, settings.light))
    }

    /// With a method that the caller picks: [`Method::Paths`] misses caustics of lights without area.
    pub fn with_method(
        scene: &'a Scene,
        intersector: &'a Intersector,
        settings: ReferenceSettings,
        method: Method,
    ) -> Self {
        let camera = Pinhole::new(&scene.camera, settings.size);
        let shows = |part| settings.light == LightPart::All || settings.light == part;
        let parts = Parts { direct: false, caustic: shows(LightPart::Caustic), global: shows(LightPart::Global) };
        let pixels = u64::from(settings.size[0]) * u64::from(settings.size[1]);
        let samples = (BATCH / pixels.max(1)).clamp(1, MOST_SAMPLES);
        Self {
            scene,
            settings,
            method,
            paths: PathTracer {
                scene,
                intersector,
                illumination: Illumination::new(scene, intersector),
                camera,
                light: settings.light,
                specular_first: method == Method::Paths,
                max_depth: settings.max_depth,
            },
            photons: LightTracer {
                scene,
                intersector,
                camera,
                parts,
                specular_first: true,
                max_depth: settings.max_depth,
                aim: Aim::at_specular(scene, 1.0),
            },
            // A power of two: Sobol points of a pixel are then even.
            samples: 1 << samples.ilog2(),
            mask: method.mask(scene, intersector, &camera),
            batches: Batches::new(settings.size),
            seconds: 0.0,
        }
    }

    /// Adds one batch; false, with nothing added, if cancelled. The n-th batch is the same whatever came between, and
    /// whatever the number of threads.
    pub fn step(&mut self, cancelled: &(dyn Fn() -> bool + Sync)) -> bool {
        let start = Instant::now();
        let Some(image) = self.batch(self.batches.count(), cancelled) else {
            return false;
        };
        self.batches.add(&image);
        self.seconds += start.elapsed().as_secs_f64();
        true
    }

    fn batch(&self, number: u32, cancelled: &(dyn Fn() -> bool + Sync)) -> Option<Vec<DVec3>> {
        // "referenc": no pass of the renderer has this seed.
        let seed = mix(mix(self.settings.seed, 0x7265_6665_7265_6e63), u64::from(number));
        let mut image = self.paths.batch(self.samples, seed, cancelled)?;
        if self.method == Method::PathsAndPhotons {
            let photons = self.photons.batch(BATCH, mix(seed, 1), cancelled)?;
            image.iter_mut().zip(photons).for_each(|(p, more)| *p += more);
        }
        Some(image)
    }

    /// Adds batches until `until` is met; false if cancelled before. `progress` is told seconds and relative noise
    /// after each batch.
    pub fn refine(
        &mut self,
        until: &Until,
        cancelled: &(dyn Fn() -> bool + Sync),
        progress: &mut dyn FnMut(f64, Option<f64>),
    ) -> bool {
        while !self.meets(until) {
            if !self.step(cancelled) {
                return false;
            }
            progress(self.seconds, self.relative_noise());
        }
        true
    }

    /// Whether the batches so far are what `until` asks for, or there is no pixel to measure.
    pub fn meets(&self, until: &Until) -> bool {
        let count = self.batches.count();
        if until.batches.is_some_and(|n| count >= n) || !self.mask.counts.contains(&true) {
            return true;
        }
        let enough_time = count >= 2 && until.seconds.is_some_and(|s| self.seconds >= s);
        let quiet = || match (until.noise, self.batches.noise(&self.mask)) {
            (Some(target), Some((rms, mean))) => count >= TRUSTED_BATCHES && rms <= target * mean,
            _ => false,
        };
        enough_time || quiet()
    }

    /// RMS of the noise over the mean, over the mask; None before the second batch and where the mean vanishes.
    pub fn relative_noise(&self) -> Option<f64> {
        self.batches.noise(&self.mask).and_then(|(rms, mean)| (mean > 0.0).then(|| rms / mean))
    }

    /// Seconds spent in batches.
    pub fn seconds(&self) -> f64 {
        self.seconds
    }

    /// Batches so far.
    pub fn batches(&self) -> &Batches {
        &self.batches
    }

    /// Paths for each pixel in a batch.
    pub fn samples(&self) -> u32 {
        self.samples
    }

    /// Which tracer it is.
    pub fn method(&self) -> Method {
        self.method
    }

    /// The pixels that count.
    pub fn mask(&self) -> &Mask {
        &self.mask
    }

    /// The scene.
    pub fn scene(&self) -> &Scene {
        self.scene
    }

    /// The settings.
    pub fn settings(&self) -> &ReferenceSettings {
        &self.settings
    }

    /// Goes on from batches of the same scene and settings; false, with nothing changed, if they have another size.
    pub fn resume(&mut self, batches: Batches, seconds: f64) -> bool {
        let fits = batches.size == self.batches.size
            && batches.sum.len() == self.batches.sum.len()
            && batches.squares.len() == self.batches.squares.len();
        if fits {
            (self.batches, self.seconds) = (batches, seconds);
        }
        fits
    }

    /// The mean of the batches, with their measured noise.
    pub fn reference(&self) -> Reference {
        let (count, seed) = (self.batches.count(), self.settings.seed);
        let paths = format!("path tracer, {count} batches of {} paths a pixel", self.samples);
        let source = match self.method {
            Method::Paths => format!("{paths}, seed {seed}"),
            Method::PathsAndPhotons => format!("{paths}, and light tracer, of {BATCH} photons each, seed {seed}"),
        };
        Reference {
            source,
            image: self.batches.mean(),
            mask: self.mask.clone(),
            noise: self.batches.variance().map_or(Noise::Unknown, Noise::Measured),
        }
    }
}

/// A reference image of a scene: its closed form if it has one, else traced `until` it is good enough or cancelled.
///
/// `progress` is told seconds and relative noise after each batch. If cancelled before the first batch, the image is black
/// and its noise unknown.
pub fn render_reference(
    scene: &Scene,
    intersector: &Intersector,
    settings: &ReferenceSettings,
    until: &Until,
    cancelled: &(dyn Fn() -> bool + Sync),
    progress: &mut dyn FnMut(f64, Option<f64>),
) -> Reference {
    if let Some(exact) = closed_form::reference(scene, settings.size, settings.light) {
        return exact;
    }
    let mut tracer = Tracer::new(scene, intersector, *settings);
    tracer.refine(until, cancelled, progress);
    tracer.reference()
}

#[cfg(test)]
mod tests;
