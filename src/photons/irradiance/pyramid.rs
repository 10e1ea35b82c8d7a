//! The irradiance pyramid: layers of growing radius, each made of the one before.

use crate::photons::irradiance::GlobalPhotons;
use crate::photons::irradiance::layer::{Estimates, Layer};
use crate::photons::irradiance::surface_area::SurfaceAreas;
use crate::scene::Scene;
use serde::Serialize;
use std::time::Instant;

/// How a pyramid is made.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PyramidSettings {
    /// Radius of the first layer, metres; raised to the scene's resolution.
    pub radius: f32,
    /// Ratio of a layer's radius to that of the one before, above 1.
    pub growth: f32,
    /// Estimates over whole discs and plain means, as published.
    pub as_published: bool,
    /// Layers at most, at least 1.
    pub layers: usize,
}

/// Photons nearer to one with an estimate than this part of the first radius get none (Gjøl et al., section 3.1).
pub const PHOTON_SPACING: f32 = 0.25;
/// Estimates nearer to one of the next layer than this part of their own radius get none there.
pub const ESTIMATE_SPACING: f32 = 0.75;

/// Radius of the layer that is looked up over the longest semi-axis of the footprint, as published.
const SHARE_AS_PUBLISHED: f32 = 0.5;
/// The same where estimates are means over cells, which are smaller than their discs: with half of it there is as much
/// noise, and four times as many estimates are read.
const SHARE: f32 = 1.0;

/// Memory while a pyramid was made, bytes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct PyramidMemory {
    /// The photon map, before.
    pub photons: u64,
    /// The most at one time: the photon map and the first layer.
    pub peak: u64,
    /// All layers, after the photon map is dropped.
    pub layers: u64,
}

/// Seconds that a pyramid took.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct PyramidSeconds {
    /// The first layer.
    pub first: f64,
    /// All others.
    pub others: f64,
}

/// Layers of irradiance estimates, the most detailed first.
#[derive(Clone, Debug, Default)]
pub struct IrradiancePyramid {
    layers: Vec<Layer>,
    memory: PyramidMemory,
    seconds: PyramidSeconds,
    /// Radius of the layer for a footprint, over its longest semi-axis.
    share: f32,
}

impl IrradiancePyramid {
    /// Makes the first layer of `photons` on the surfaces of `areas`, and what comes above it when
    /// [`IrradiancePyramid::grow`] is called.
    pub fn new(areas: &SurfaceAreas, photons: &GlobalPhotons, settings: &PyramidSettings) -> Self {
        let start = Instant::now();
        let radius = settings.radius.max(areas.scene().resolution());
        let how = if settings.as_published { Estimates::AsPublished } else { Estimates::Corrected(areas) };
        let first = Layer::of_photons(photons, radius, radius * PHOTON_SPACING, how);
        let bytes = first.bytes() as u64;
        let memory =
            PyramidMemory { photons: photons.bytes() as u64, peak: photons.bytes() as u64 + bytes, layers: bytes };
        let seconds = PyramidSeconds { first: start.elapsed().as_secs_f64(), others: 0.0 };
        let share = if settings.as_published { SHARE_AS_PUBLISHED } else { SHARE };
        Self { layers: vec![first], memory, seconds, share }
    }

    /// Makes the other layers, until one disc would hold half the scene, a layer is a single estimate, or there are as many
    /// as the settings allow. The photons are not needed any more.
    pub fn grow(&mut self, scene: &Scene, settings: &PyramidSettings) {
        let start = Instant::now();
        while let Some(last) = self.layers.last() {
            let radius = last.radius() * settings.growth;
            let ends = last.estimates().len() <= 1 || radius <= last.radius() || radius > scene.radius / 2.0;
            if ends || self.layers.len() >= settings.layers {
                break;
            }
            let next = Layer::of_layer(last, radius, last.radius() * ESTIMATE_SPACING, settings.as_published);
            self.memory.layers += next.bytes() as u64;
            self.layers.push(next);
        }
        self.memory.peak = self.memory.peak.max(self.memory.layers);
        self.seconds.others = start.elapsed().as_secs_f64();
    }

    /// The layers, the most detailed first; at least one.
    pub fn layers(&self) -> &[Layer] {
        &self.layers
    }

    /// Memory while it was made.
    pub fn memory(&self) -> &PyramidMemory {
        &self.memory
    }

    /// Seconds that it took.
    pub fn seconds(&self) -> &PyramidSeconds {
        &self.seconds
    }

    /// Index of the layer whose radius is nearest in ratio to a footprint's longest semi-axis (metres), or as published to
    /// half of it; None if
    /// that semi-axis is shorter than the first layer's radius, so that the nearest estimate takes its place.
    pub fn layer_for(&self, longest: f32) -> Option<usize> {
        let first = self.layers.first()?.radius();
        if longest.is_nan() || longest < first {
            return None;
        }
        let Some(second) = self.layers.get(1) else { return Some(0) };
        let growth = libm::log2f(second.radius() / first);
        let last = (self.layers.len() - 1) as f32;
        let place = libm::log2f(longest * self.share / first) / growth;
        Some(place.round().clamp(0.0, last) as usize)
    }
}
