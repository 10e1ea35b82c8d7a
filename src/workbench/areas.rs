//! Histogram of footprint areas.

use crate::photons::PhotonMap;
use crate::render::Pass;
use std::collections::BTreeMap;

/// Width of a bin, in powers of ten.
pub const BIN: f64 = 0.125;

/// Photons by the logarithm of their footprint's area.
#[derive(Debug, Default, PartialEq)]
pub struct Areas {
    /// For each kind of photon its name, and the middle (log10 of m²) and count of each bin that is not empty.
    pub kinds: Vec<(&'static str, Vec<(f64, u64)>)>,
}

impl Areas {
    /// Of the photons of a pass, as its maps hold them.
    pub fn of(pass: &Pass) -> Self {
        let kinds = pass.maps.by_kind().map(|(kind, map)| (kind.name(), bins(map))).collect();
        Self { kinds }
    }
}

fn bins(map: &PhotonMap) -> Vec<(f64, u64)> {
    let mut counts: BTreeMap<i64, u64> = BTreeMap::new();
    for photon in map.photons() {
        // Inverse areas are positive and finite.
        let log = -libm::log10(f64::from(photon.inverse_area));
        *counts.entry((log / BIN).floor() as i64).or_default() += 1;
    }
    counts.into_iter().map(|(bin, n)| ((bin as f64 + 0.5) * BIN, n)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::render::{RenderSettings, Renderer, Silent};
    use crate::scene::open;
    use crate::scene::scene_file::RenderFile;

    #[test]
    fn every_photon_is_counted_once() {
        let scene = open("glass_sphere").expect("built in");
        let flags = RenderFile { photons: Some(5000), ..Default::default() };
        let settings = RenderSettings::new(&scene, &flags, Some([16, 16]), 1).expect("valid");
        let estimators = crate::estimate::registry::estimators("regular").expect("registered");
        let mut renderer = Renderer::new(scene.into(), settings, estimators);
        renderer.step(&Silent);
        let pass = renderer.last_pass().expect("one");
        let areas = Areas::of(pass);
        let counted: u64 = areas.kinds.iter().flat_map(|k| &k.1).map(|b| b.1).sum();
        let stored: usize = pass.maps.all().map(|m| m.photons().len()).sum();
        assert_eq!(counted, stored as u64);
        assert_eq!(areas.kinds.iter().map(|k| k.0).collect::<Vec<_>>(), ["caustic", "global"]);
    }
}
