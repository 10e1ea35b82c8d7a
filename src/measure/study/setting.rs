//! One setting of a study: an estimator with everything that is swept.

use crate::estimate::Lookup;
use crate::estimate::registry::{estimator, short_name};
use crate::render::plan::Slot;
use crate::render::settings::{Gather, RenderSettings};
use serde::{Deserialize, Serialize};

/// An estimator and how it is fed. What the estimator does not use is None, so that equal settings are equal.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Setting {
    /// Estimator with its settings, as in `multi_sampled:n=8,grid=cells`.
    pub estimator: String,
    /// How photons are looked up.
    pub gather: Gather,
    /// Photons emitted per pass.
    pub photons: u64,
    /// Photons looked up in each map, where the k nearest are, or of a density estimate of final gathering.
    pub k: Option<usize>,
    /// Factor on the axes of photon footprints, where footprints are used.
    pub footprint_scale: Option<f32>,
}

impl Setting {
    /// What `settings` mean to an estimator.
    pub fn of(settings: &RenderSettings, estimator: &dyn crate::estimate::Estimator) -> Self {
        let gather = Slot::new(estimator, settings.gather).gather;
        Self {
            estimator: estimator.name(),
            gather,
            photons: settings.photons,
            k: (gather == Gather::Knn || estimator.final_gathering().is_some()).then_some(settings.k),
            footprint_scale: (estimator.lookup() != Lookup::Disc).then_some(settings.footprint_scale),
        }
    }

    /// The settings of a render of it; `base` says what is not swept.
    pub fn onto(&self, base: &RenderSettings) -> RenderSettings {
        RenderSettings {
            estimator: self.estimator.clone(),
            gather: self.gather,
            photons: self.photons,
            k: self.k.unwrap_or(base.k),
            footprint_scale: self.footprint_scale.unwrap_or(base.footprint_scale),
            ..base.clone()
        }
    }

    /// Name of the estimator without its settings, with the method of its final gathering.
    pub fn id(&self) -> String {
        short_name(&self.estimator)
    }

    /// Whether its progressive render tends to the truth: the estimator is consistent and sees all photons that overlap.
    pub fn is_consistent(&self) -> bool {
        self.gather == Gather::Overlap && estimator(&self.estimator).is_ok_and(|e| e.is_consistent())
    }

    /// All of it but the estimator, as in `gather=knn,k=50,photons=200000`.
    pub fn rest(&self) -> String {
        let mut parts = vec![format!("gather={}", self.gather.name())];
        parts.extend(self.k.map(|k| format!("k={k}")));
        parts.extend(self.footprint_scale.map(|s| format!("footprint_scale={s}")));
        parts.push(format!("photons={}", self.photons));
        parts.join(",")
    }
}

/// A short name for each setting: its estimator, without settings that all of its kind share, and what else differs.
pub fn labels(settings: &[Setting]) -> Vec<String> {
    let differs = |f: &dyn Fn(&Setting) -> String| settings.iter().any(|s| f(s) != f(&settings[0]));
    // What an estimator does not use does not make it differ from the others.
    let among = |f: &dyn Fn(&Setting) -> Option<String>| {
        let used: Vec<String> = settings.iter().filter_map(f).collect();
        used.iter().any(|u| *u != used[0])
    };
    let photons = differs(&|s| s.photons.to_string());
    let gathers = among(&|s| s.footprint_scale.map(|_| s.gather.name().to_owned()));
    let k = among(&|s| s.k.map(|k| k.to_string()));
    let scale = among(&|s| s.footprint_scale.map(|f| f.to_string()));
    settings
        .iter()
        .map(|s| {
            let alone = !settings.iter().any(|o| o.id() == s.id() && o.estimator != s.estimator);
            let mut label = if alone { s.id() } else { s.estimator.clone() };
            if gathers && s.footprint_scale.is_some() {
                label.push_str(&format!(" {}", s.gather.name()));
            }
            if let Some(n) = s.k.filter(|_| k) {
                label.push_str(&format!(" k={n}"));
            }
            if let Some(f) = s.footprint_scale.filter(|_| scale) {
                label.push_str(&format!(" scale={f}"));
            }
            if photons {
                label.push_str(&format!(" photons={}", s.photons));
            }
            label
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn setting(estimator: &str, gather: Gather, k: Option<usize>, scale: Option<f32>) -> Setting {
        Setting { estimator: estimator.into(), gather, photons: 1000, k, footprint_scale: scale }
    }

    #[test]
    fn labels_say_what_differs() {
        let all = [
            setting("density:kernel=none", Gather::Knn, Some(50), None),
            setting("multi_sampled:n=2,grid=cells", Gather::Overlap, None, Some(3.0)),
            setting("multi_sampled:n=4,grid=cells", Gather::Knn, Some(50), Some(3.0)),
        ];
        let expected = ["density", "multi_sampled:n=2,grid=cells overlap", "multi_sampled:n=4,grid=cells knn"];
        assert_eq!(labels(&all), expected);
        let swept = [
            setting("integrated", Gather::Overlap, None, Some(1.0)),
            setting("integrated", Gather::Overlap, None, Some(2.0)),
        ];
        assert_eq!(labels(&swept), ["integrated scale=1", "integrated scale=2"]);
        assert!(labels(&[]).is_empty());
    }

    #[test]
    fn only_overlap_of_a_consistent_estimator_converges() {
        assert!(setting("integrated", Gather::Overlap, None, Some(1.0)).is_consistent());
        assert!(!setting("integrated", Gather::Knn, Some(50), Some(1.0)).is_consistent());
        assert!(!setting("multi_sampled:n=8,grid=closed", Gather::Overlap, None, Some(1.0)).is_consistent());
    }
}
