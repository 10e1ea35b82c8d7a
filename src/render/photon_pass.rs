//! The photon pass: all photons of one pass, and the maps made of them.

use crate::math::hash::mix;
use crate::math::sequence::{Sampling, Sequence};
use crate::photons::emission::{emit, share_photons};
use crate::photons::map::{FootprintLimits, MapParts};
use crate::photons::path::{Flight, PathCounts, PathSettings, SpecularBounds};
use crate::photons::{Photon, PhotonMap, StoredPhotons};
use crate::render::plan::Plan;
use crate::scene::Scene;
use crate::trace::Intersector;
use rayon::prelude::*;

/// Number of the plan's pilot pass, whose photons are not those of any other.
pub const PILOT_PASS: u64 = u64::MAX;
/// Photons that one thread follows at a time.
const CHUNK: u64 = 4096;

/// What is needed to trace the photons of a pass.
pub struct Emitter<'a> {
    /// The scene.
    pub scene: &'a Scene,
    /// Its intersector.
    pub intersector: &'a Intersector,
    /// How paths are followed.
    pub path: PathSettings,
    /// Numbers that photons are made of.
    pub sampling: Sampling,
    /// Photons to emit.
    pub photons: u64,
    /// Seed of the render.
    pub seed: u64,
}

/// The photons of a pass.
#[derive(Default)]
pub struct PhotonPass {
    /// Stored photons, in the order of emission.
    pub stored: StoredPhotons,
    /// Photons emitted.
    pub emitted: u64,
    /// What was bounded.
    pub counts: PathCounts,
}

impl Emitter<'_> {
    /// Traces pass number `pass`. The result does not depend on the number of threads; a cancelled pass is short.
    pub fn run(&self, pass: u64, cancelled: &(dyn Fn() -> bool + Sync)) -> PhotonPass {
        let seed = mix(mix(self.seed, 0x70_686f_746f_6e73), pass);
        let shares = share_photons(self.scene, self.photons, &Sequence::new(Sampling::Random, seed));
        let chunks: Vec<(usize, u64)> = shares
            .iter()
            .enumerate()
            .flat_map(|(s, share)| (0..share.count).step_by(CHUNK as usize).map(move |first| (s, first)))
            .collect();
        // Where nothing but caustic photons is kept, those that cannot meet a specular surface need not be followed.
        let only_caustic = self.path.caustic && !self.path.direct && !self.path.global;
        let aim = if only_caustic { SpecularBounds::of(self.scene) } else { None };
        let parts: Vec<PhotonPass> = chunks
            .par_iter()
            .map(|&(s, first)| {
                let mut part = PhotonPass::default();
                if cancelled() {
                    return part;
                }
                let share = &shares[s];
                let light = &self.scene.lights[share.light];
                let flight = Flight {
                    scene: self.scene,
                    intersector: self.intersector,
                    settings: self.path,
                    sequence: Sequence::new(self.sampling, mix(seed, share.light as u64)),
                };
                for i in first..(first + CHUNK).min(share.count) {
                    let emission = emit(self.scene, light, share.count, flight.sequence.four(i, 0));
                    part.emitted += 1;
                    if aim.is_none_or(|a| a.may_meet(emission.origin, emission.direction)) {
                        flight.trace(i, &emission, share.power, share.count, &mut part.stored, &mut part.counts);
                    }
                }
                part
            })
            .collect();
        let mut whole = PhotonPass::default();
        for mut part in parts {
            whole.stored.append(&mut part.stored);
            whole.emitted += part.emitted;
            whole.counts += part.counts;
        }
        whole
    }
}

/// The maps of a pass; None where the plan leaves one out.
#[derive(Default)]
pub struct PhotonMaps {
    /// Direct photons.
    pub direct: Option<PhotonMap>,
    /// Caustic photons.
    pub caustic: Option<PhotonMap>,
    /// Global photons.
    pub global: Option<PhotonMap>,
}

impl PhotonMaps {
    /// Builds the maps of the plan. `scale` multiplies all footprints' axes.
    pub fn new(scene: &Scene, plan: &Plan, stored: &StoredPhotons, scale: f32) -> Self {
        Self::with_parts(scene, plan, stored, scale, plan.map_parts())
    }

    /// The same with other structures than the plan's.
    pub fn with_parts(scene: &Scene, plan: &Plan, stored: &StoredPhotons, scale: f32, parts: MapParts) -> Self {
        let limits = FootprintLimits { scale, floor: scene.resolution(), ceiling: scene.radius };
        let build = |on: bool, photons: &[Photon]| on.then(|| PhotonMap::new(photons, limits, parts));
        Self {
            direct: build(plan.direct_map, &stored.direct),
            caustic: build(plan.caustic_map, &stored.caustic),
            global: build(plan.global_map, &stored.global),
        }
    }

    /// Those that are there.
    pub fn all(&self) -> impl Iterator<Item = &PhotonMap> {
        [&self.direct, &self.caustic, &self.global].into_iter().flatten()
    }

    /// Footprints raised to the floor and lowered to the ceiling in all maps.
    pub fn limited(&self) -> (u64, u64) {
        self.all().map(PhotonMap::limited).fold((0, 0), |sum, l| (sum.0 + l.0, sum.1 + l.1))
    }
}
