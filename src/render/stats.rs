//! What a render cost: seconds of its parts, photons, memory, and counts of what was bounded.

use crate::photons::path::PathCounts;
use serde::{Deserialize, Serialize};

/// Wall seconds of a render's parts. Inside a view pass, sums over threads scaled to the pass's wall time.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Seconds {
    /// Reading the scene.
    pub load: f64,
    /// Building the hierarchy over its surfaces.
    pub bvh: f64,
    /// The plan's pilot photons.
    pub plan: f64,
    /// Tracing photons.
    pub photon_trace: f64,
    /// Building photon maps.
    pub map_build: f64,
    /// View rays and shadow rays.
    pub view_trace: f64,
    /// Looking photons up.
    pub gather: f64,
    /// Evaluating estimators.
    pub estimate: f64,
    /// What is left of the total: reading flags, films, files.
    pub other: f64,
    /// From start to end: the sum of all of these.
    pub total: f64,
}

impl Seconds {
    /// The same parts with that total; what they leave of it is `other`.
    pub fn of_total(self, total: f64) -> Self {
        let parts = [
            self.load,
            self.bvh,
            self.plan,
            self.photon_trace,
            self.map_build,
            self.view_trace,
            self.gather,
            self.estimate,
        ];
        Self { other: total - parts.iter().sum::<f64>(), total, ..self }
    }
}

/// Photons stored, by kind.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct StoredCounts {
    /// Straight from a light.
    pub direct: u64,
    /// By specular surfaces alone.
    pub caustic: u64,
    /// Anything else.
    pub global: u64,
}

/// Counts of values that were limited, so that nothing is limited in silence.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Bounded {
    /// Photon paths.
    pub photons: PathCounts,
    /// View paths.
    pub views: PathCounts,
    /// Photon footprints raised to the resolution of f32.
    pub footprint_floor: u64,
    /// Photon footprints lowered to the scene's radius.
    pub footprint_ceiling: u64,
}

/// Largest resident memory of this process so far, bytes; None where the system does not say.
pub fn peak_rss_bytes() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find(|l| l.starts_with("VmHWM:"))?;
    let kib: u64 = line.split_whitespace().nth(1)?.parse().ok()?;
    Some(kib * 1024)
}
