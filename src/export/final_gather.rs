//! What the final gathering of an estimator looked things up in: radius, layers, memory and seconds.

use crate::estimate::{Estimator, FinalGathering};
use crate::photons::irradiance::PyramidMemory;
use crate::render::Pass;
use crate::scene::memory;
use serde::Serialize;

/// Final gathering of one estimator in the last pass.
#[derive(Clone, Debug, Serialize)]
pub struct FinalGatherReport {
    /// Method and settings, as the command line takes them.
    pub settings: String,
    /// Radius of the first search for photons, or of the first layer, metres.
    pub radius: f32,
    /// Layers of the irradiance pyramid, the most detailed first; none where photons are looked up.
    pub layers: Vec<LayerReport>,
    /// Memory, bytes; of `classic` the photons alone.
    pub memory: PyramidMemory,
    /// Wall seconds to build it.
    pub seconds: FinalGatherSeconds,
}

/// A layer of an irradiance pyramid.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct LayerReport {
    /// Radius of its discs, metres.
    pub radius: f32,
    /// Number of estimates.
    pub estimates: usize,
    /// Memory, bytes.
    pub bytes: usize,
}

/// Wall seconds to build what is looked up.
#[derive(Clone, Copy, Debug, Default, Serialize)]
pub struct FinalGatherSeconds {
    /// The tree over all photons.
    pub photons: f64,
    /// The first layer.
    pub first: f64,
    /// The other layers.
    pub others: f64,
}

impl FinalGatherReport {
    /// Of an estimator in a pass; None if its final gathering does not run there.
    pub fn new(pass: &Pass, estimator: &dyn Estimator) -> Option<Self> {
        Self::of(pass, pass.plan.final_gathering(estimator)?)
    }

    /// Of settings that run in a pass; None if there is nothing that they look up.
    pub fn of(pass: &Pass, settings: &FinalGathering) -> Option<Self> {
        let maps = &pass.gathering;
        if maps.is_empty() {
            return None;
        }
        let pyramid = maps.pyramid(settings);
        let photons = maps.photons().map_or(0, |p| p.bytes() as u64);
        let seconds = pyramid.map(|p| *p.seconds()).unwrap_or_default();
        let layers = pyramid.map_or(&[][..], |p| p.layers()).iter();
        Some(Self {
            settings: settings.to_string(),
            radius: maps.radius(settings),
            layers: layers
                .map(|l| LayerReport { radius: l.radius(), estimates: l.estimates().len(), bytes: l.bytes() })
                .collect(),
            memory: pyramid.map_or(PyramidMemory { photons, peak: photons, layers: 0 }, |p| *p.memory()),
            seconds: FinalGatherSeconds {
                photons: maps.photon_seconds(),
                first: seconds.first,
                others: seconds.others,
            },
        })
    }

    /// One line for people, without seconds.
    pub fn line(&self) -> String {
        let m = &self.memory;
        let [photons, peak, layers] = [m.photons, m.peak, m.layers].map(memory::text);
        let radius = self.radius;
        match &self.layers[..] {
            [] => format!("{}: first search {radius:.4} m; memory: photons {photons}", self.settings),
            all => {
                let counts: Vec<String> = all.iter().map(|l| l.estimates.to_string()).collect();
                format!(
                    "{}: first radius {radius:.4} m, estimates by layer {}; memory: photons {photons}, {peak} at the highest, layers {layers}",
                    self.settings,
                    counts.join(" ")
                )
            }
        }
    }
}
