//! Memory of a pyramid by layer, and what "saving each layer on disk sequentially" (section 6) would save.

use crate::photons::irradiance::IrradiancePyramid;
use serde::Serialize;

/// Part of the peak that has to be saved for the trouble to be worth it.
const WORTH: f64 = 0.1;

/// A layer.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct LayerBytes {
    /// Radius of its discs, metres.
    pub radius: f32,
    /// Its estimates.
    pub estimates: usize,
    /// What it takes, bytes.
    pub bytes: u64,
}

/// Memory of a pyramid, bytes.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PyramidBytes {
    /// The photon map, before.
    pub photon_map: u64,
    /// The most at one time while it is made.
    pub peak: u64,
    /// All layers, after.
    pub sum: u64,
    /// The largest layer.
    pub largest: u64,
    /// The most at one time if each layer went to disk as soon as the next one is made.
    pub peak_by_layer: u64,
    /// Share of the peak that this would save.
    pub saved: f64,
    /// The layers, the most detailed first.
    pub layers: Vec<LayerBytes>,
}

impl PyramidBytes {
    /// Of a pyramid.
    pub fn new(pyramid: &IrradiancePyramid) -> Self {
        let of = |l: &crate::photons::irradiance::Layer| LayerBytes {
            radius: l.radius(),
            estimates: l.estimates().len(),
            bytes: l.bytes() as u64,
        };
        let memory = pyramid.memory();
        Self::of_layers(memory.photons, memory.peak, pyramid.layers().iter().map(of).collect())
    }

    fn of_layers(photon_map: u64, peak: u64, layers: Vec<LayerBytes>) -> Self {
        let bytes: Vec<u64> = layers.iter().map(|l| l.bytes).collect();
        let first = bytes.first().copied().unwrap_or(0);
        // The first layer is made beside the photons, every other one beside the layer that it is made of.
        let pairs = bytes.windows(2).map(|two| two.iter().sum());
        let peak_by_layer = pairs.fold(photon_map + first, u64::max);
        Self {
            photon_map,
            peak,
            sum: bytes.iter().sum(),
            largest: bytes.iter().copied().max().unwrap_or(0),
            peak_by_layer,
            saved: if peak > 0 { 1.0 - peak_by_layer.min(peak) as f64 / peak as f64 } else { 0.0 },
            layers,
        }
    }
}

/// Whether layers should go to disk one by one, in a sentence.
pub fn verdict<'a>(all: impl Iterator<Item = &'a PyramidBytes>) -> String {
    let all: Vec<_> = all.collect();
    let most = |f: &dyn Fn(&PyramidBytes) -> f64| all.iter().map(|p| f(p)).fold(0.0, f64::max);
    let saved = most(&|p| p.saved);
    let share = |a: u64, b: u64| if b > 0 { 100.0 * a as f64 / b as f64 } else { 0.0 };
    let (sum, largest) = (most(&|p| share(p.sum, p.photon_map)), most(&|p| share(p.largest, p.sum)));
    let by_first = all.iter().all(|p| p.layers.first().is_none_or(|l| p.photon_map + l.bytes >= p.peak));
    let peak = if by_first { "the photon map with the first layer beside it" } else { "the layers together" };
    let worth = if saved > WORTH { "is worth it" } else { "is not worth it" };
    format!(
        "saving each layer on disk as it is made {worth}: the peak is {peak}, of which that would save {:.1} % at most; all layers take {sum:.0} % of the photon map at most, the largest layer up to {largest:.0} % of them",
        100.0 * saved
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pyramid(photon_map: u64, bytes: &[u64]) -> PyramidBytes {
        let layer = |&bytes: &u64| LayerBytes { radius: 0.1, estimates: 1, bytes };
        let peak = (photon_map + bytes.first().copied().unwrap_or(0)).max(bytes.iter().sum());
        PyramidBytes::of_layers(photon_map, peak, bytes.iter().map(layer).collect())
    }

    /// By hand: a large photon map hides all layers; a small one does not.
    #[test]
    fn one_layer_at_a_time_helps_where_layers_are_the_peak() {
        let large = pyramid(100, &[40, 20, 10]);
        assert_eq!((large.peak, large.peak_by_layer, large.sum, large.largest), (140, 140, 70, 40));
        assert_eq!(large.saved, 0.0);
        let small = pyramid(5, &[40, 30, 30]);
        assert_eq!((small.peak, small.peak_by_layer), (100, 70));
        assert!((small.saved - 0.3).abs() < 1e-12);
        assert!(verdict([&large].into_iter()).contains("is not worth it: the peak is the photon map"));
        assert!(verdict([&large, &small].into_iter()).contains("is worth it: the peak is the layers"));
        assert_eq!(pyramid(0, &[]).saved, 0.0);
    }
}
