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
    /// Final gathering: its rays and what they look up.
    #[serde(default)]
    pub final_gather: f64,
    /// Everything else: films, error estimates, files, passes that were dropped.
    pub other: f64,
    /// From start to end: the sum of the parts.
    pub total: f64,
}

impl Seconds {
    /// The parts with what they leave of `total`, wall seconds of the whole, as `other`.
    ///
    /// Parts are measured inside `total`; if they are longer by rounding of the clock, `total` is their sum.
    pub fn within(self, total: f64) -> Self {
        let parts = Self { other: 0.0, ..self }.sum();
        let other = (total - parts).max(0.0);
        let all = Self { other, ..self };
        Self { total: all.sum(), ..all }
    }

    /// Sum of all parts.
    pub fn sum(&self) -> f64 {
        let Self {
            load,
            bvh,
            plan,
            photon_trace,
            map_build,
            view_trace,
            gather,
            estimate,
            final_gather,
            other,
            total: _,
        } = *self;
        load + bvh + plan + photon_trace + map_build + view_trace + gather + estimate + final_gather + other
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
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Bounded {
    /// Photon paths.
    pub photons: PathCounts,
    /// View paths.
    pub views: PathCounts,
    /// Photon footprints raised to the resolution of f32.
    pub footprint_floor: u64,
    /// Photon footprints lowered to the scene's radius.
    pub footprint_ceiling: u64,
    /// Discs of density estimation raised to the resolution of f32, because their photons lie in one point.
    pub disc_floor: u64,
    /// Pixels of passes with a channel beyond f32, which hold its largest number there; one for each estimator.
    pub overflow: u64,
    /// Power of the photons whose paths the bounce limit ended, W: the mean over the passes and channels.
    pub cut_off_power: f64,
}

impl Bounded {
    /// What was limited at all: how often, what, and what was done to it.
    pub fn notes(&self) -> Vec<(u64, String, &'static str)> {
        let paths = |of: &str, counts: &PathCounts| {
            let PathCounts { differentials, grazing, horizon, normals, depth } = *counts;
            [
                (
                    differentials,
                    format!("{of} differentials"),
                    "shortened to the scene's radius or to a linear range of directions",
                ),
                (grazing, format!("{of} solid angles"), "bounded at grazing directions"),
                (horizon, format!("{of} shading normals"), "beyond the horizon; the flat normal took their place"),
                (normals, format!("{of} shading normals"), "of no length; the flat normal took their place"),
                (depth, format!("{of} paths"), "ended by the bounce limit"),
            ]
        };
        let own = [
            (self.footprint_floor, "photon footprints".to_owned(), "raised to the resolution of f32"),
            (self.footprint_ceiling, "photon footprints".to_owned(), "lowered to the scene's radius"),
            (self.disc_floor, "discs of density estimation".to_owned(), "raised to the resolution of f32"),
            (self.overflow, "pixels".to_owned(), "beyond f32; they hold its largest number"),
        ];
        let all = paths("photon", &self.photons).into_iter().chain(paths("view", &self.views)).chain(own);
        all.filter(|(count, ..)| *count > 0).collect()
    }

    /// The notes as one line each.
    pub fn lines(&self) -> Vec<String> {
        let mut lines: Vec<String> =
            self.notes().iter().map(|(count, what, how)| format!("bounded: {what} {how}: {count}")).collect();
        if self.cut_off_power > 0.0 {
            lines.push(format!(
                "bounded: power that the bounce limit ended, W for each pass: {:.4e}",
                self.cut_off_power
            ));
        }
        lines
    }
}

/// Largest resident memory of this process so far, bytes; None where the system does not say.
pub fn peak_rss_bytes() -> Option<u64> {
    status_bytes("VmHWM:")
}

/// Resident memory of this process now, bytes; None where the system does not say.
pub fn current_rss_bytes() -> Option<u64> {
    status_bytes("VmRSS:")
}

fn status_bytes(key: &str) -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find(|l| l.starts_with(key))?;
    let kib: u64 = line.split_whitespace().nth(1)?.parse().ok()?;
    Some(kib * 1024)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_was_bounded_is_said_and_nothing_else() {
        assert!(Bounded::default().lines().is_empty());
        let views = PathCounts { horizon: 3, ..Default::default() };
        let bounded = Bounded { views, overflow: 2, cut_off_power: 1.5, ..Default::default() };
        let lines = bounded.lines();
        assert_eq!(lines.len(), 3);
        assert!(lines[0].starts_with("bounded: view shading normals beyond the horizon"), "{}", lines[0]);
        assert!(lines[0].ends_with(": 3"));
        assert!(lines[1].starts_with("bounded: pixels beyond f32") && lines[2].ends_with(": 1.5000e0"));
    }

    #[test]
    fn the_parts_make_the_whole() {
        let parts = Seconds { load: 0.25, gather: 1.0, estimate: 0.5, ..Default::default() };
        let all = parts.within(2.0);
        assert_eq!((all.other, all.total), (0.25, 2.0));
        assert_eq!(all.sum(), all.total);
        let longer = parts.within(1.5);
        assert_eq!((longer.other, longer.total), (0.0, 1.75));
    }
}
