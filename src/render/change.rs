//! What depends on what: which photons and images outlive a change of scene or settings.

use crate::estimate::{Estimator, Lookup};
use crate::photons::StoredPhoton;
use crate::photons::path::PathSettings;
use crate::render::photon_pass::PhotonPass;
use crate::render::settings::{Gather, RenderSettings};
use crate::scene::{Geometry, Light, Material, Scene};
use std::sync::Arc;

/// The part of a scene that photons meet: all but the camera.
#[derive(Clone, Copy)]
pub struct World<'a> {
    geometry: &'a Arc<Geometry>,
    materials: &'a [Material],
    lights: &'a [Light],
}

impl<'a> World<'a> {
    /// That of a scene.
    pub fn of(scene: &'a Scene) -> Self {
        Self { geometry: &scene.geometry, materials: &scene.materials, lights: &scene.lights }
    }
}

impl PartialEq for World<'_> {
    /// Surfaces are the same if they are the same value in memory: a scene that was read again is another one.
    fn eq(&self, other: &Self) -> bool {
        Arc::ptr_eq(self.geometry, other.geometry) && self.materials == other.materials && self.lights == other.lights
    }
}

/// Whether photons traced under the settings `old` are those of `new`, in the same world.
///
/// Which kinds are stored depends on the plan too; [`PhotonStore`] looks after that.
pub fn photons_are_kept(old: &RenderSettings, new: &RenderSettings) -> bool {
    let of = |s: &RenderSettings| (s.photons, s.max_depth, s.sampling, s.diffuse_spread, s.projection_map, s.seed);
    of(old) == of(new)
}

/// Whether an estimator's image is still right when photons are kept.
pub fn film_is_kept(old: (&Scene, &RenderSettings), new: (&Scene, &RenderSettings), estimator: &dyn Estimator) -> bool {
    let is_disc = estimator.lookup() == Lookup::Disc;
    let of = |s: &RenderSettings| {
        let uses_k = is_disc || s.gather == Gather::Knn || estimator.final_gathering().is_some();
        (
            (s.size, s.light, s.direct, s.shadow_rays, s.split_depth),
            (!is_disc).then_some((s.gather, s.footprint_scale.to_bits())),
            uses_k.then_some(s.k),
        )
    };
    old.0.camera == new.0.camera && of(old.1) == of(new.1)
}

/// Photons of passes, kept for estimators that come later.
#[derive(Default)]
pub struct PhotonStore {
    budget: usize,
    used: usize,
    passes: Vec<Kept>,
}

struct Kept {
    number: u32,
    path: PathSettings,
    photons: Arc<PhotonPass>,
    seconds: f64,
}

impl PhotonStore {
    /// One that holds at most `budget` bytes of photons. The earliest passes stay, since whoever comes later begins
    /// with them.
    pub fn of(budget: usize) -> Self {
        Self { budget, ..Default::default() }
    }

    /// Photons of pass `number` that were traced with those settings, and the seconds that it took.
    pub fn get(&self, number: u32, path: &PathSettings) -> Option<(Arc<PhotonPass>, f64)> {
        let kept = self.passes.iter().find(|k| k.number == number && k.path == *path)?;
        Some((Arc::clone(&kept.photons), kept.seconds))
    }

    /// Keeps the photons of a pass in place of others of its number, if there is room.
    pub fn put(&mut self, number: u32, path: PathSettings, photons: &Arc<PhotonPass>, seconds: f64) {
        if let Some(at) = self.passes.iter().position(|k| k.number == number) {
            self.used -= bytes(&self.passes.swap_remove(at).photons);
        }
        let size = bytes(photons);
        if self.used + size <= self.budget {
            self.used += size;
            self.passes.push(Kept { number, path, photons: Arc::clone(photons), seconds });
        }
    }

    /// Whether it keeps any.
    pub fn is_used(&self) -> bool {
        self.budget > 0
    }

    /// Forgets all.
    pub fn clear(&mut self) {
        self.used = 0;
        self.passes.clear();
    }
}

fn bytes(photons: &PhotonPass) -> usize {
    let s = &photons.stored;
    (s.direct.len() + s.caustic.len() + s.global.len()) * size_of::<StoredPhoton>()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::photons::spread::DiffuseSpread;

    const PATH: PathSettings = PathSettings {
        max_depth: 5,
        direct: false,
        caustic: true,
        global: false,
        projected: false,
        differentials: true,
        spread: DiffuseSpread::Polar,
    };

    fn photons(n: usize) -> Arc<PhotonPass> {
        let mut pass = PhotonPass::default();
        let photon = crate::photons::Photon {
            position: glam::Vec3::ZERO,
            direction: glam::Vec3::X,
            normal: glam::Vec3::Y,
            power: glam::Vec3::ONE,
            footprint: [glam::Vec3::ZERO; 2],
        };
        pass.stored.caustic = vec![photon.into(); n];
        Arc::new(pass)
    }

    #[test]
    fn store_keeps_the_earliest_within_its_budget() {
        let mut store = PhotonStore::of(10 * size_of::<StoredPhoton>());
        store.put(0, PATH, &photons(4), 0.5);
        store.put(1, PATH, &photons(5), 0.5);
        store.put(2, PATH, &photons(5), 0.5);
        assert!(store.get(0, &PATH).is_some() && store.get(1, &PATH).is_some() && store.get(2, &PATH).is_none());
        assert!(store.get(0, &PathSettings { global: true, ..PATH }).is_none());
        // Others of the same number take their place and their room.
        store.put(1, PathSettings { global: true, ..PATH }, &photons(6), 0.5);
        assert!(store.get(1, &PATH).is_none());
        store.clear();
        store.put(9, PATH, &photons(10), 0.5);
        assert!(store.get(9, &PATH).is_some());
    }
}
