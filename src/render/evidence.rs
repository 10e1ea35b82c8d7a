//! What a plan rests on: where the pilot's photons went, and where light may meet specular surfaces.

use crate::photons::path::PathSettings;
use crate::photons::projection::ProjectionMap;
use crate::render::photon_pass::{self, Emitter};
use crate::render::settings::{LightPart, PlanMode, Projection, RenderSettings};
use crate::scene::Scene;
use crate::trace::Intersector;
use std::sync::Arc;

/// Photons that the plan sends ahead to see where light goes.
pub const PILOT_PHOTONS: u64 = 65_536;

/// What is known of a scene before its first pass.
#[derive(Clone, Debug, Default)]
pub struct Evidence {
    /// The pilot, where [`Pilot::needed`] says so.
    pub pilot: Option<Pilot>,
    /// Where photons leave the lights towards specular surfaces, where settings ask for caustics and allow it.
    pub projection: Option<Arc<ProjectionMap>>,
}

impl Evidence {
    /// Gathers it; what `known` has is taken over.
    pub fn of(scene: &Scene, intersector: &Intersector, settings: &RenderSettings, known: Self) -> Self {
        let needs_pilot = Pilot::needed(scene, settings);
        let pilot = known.pilot.or_else(|| needs_pilot.then(|| Pilot::send(scene, intersector, settings)));
        let caustics = matches!(settings.light, LightPart::All | LightPart::Caustic);
        let wanted = caustics && settings.projection_map == Projection::Auto;
        let projection =
            known.projection.or_else(|| if wanted { ProjectionMap::new(scene).map(Arc::new) } else { None });
        Self { pilot, projection }
    }
}

/// Photons sent ahead of a render, to see where light goes.
#[derive(Clone, Copy, Debug)]
pub struct Pilot {
    /// Photons emitted.
    pub emitted: u64,
    /// Caustic photons stored.
    pub caustic: u64,
    /// Global photons stored.
    pub global: u64,
}

impl Pilot {
    /// Whether a plan asks for one: light may take more than one way, and not every part is forced on.
    pub fn needed(scene: &Scene, settings: &RenderSettings) -> bool {
        settings.plan == PlanMode::Needed && settings.light != LightPart::Direct && scene.total_flux() > 0.0
    }

    /// Sends [`PILOT_PHOTONS`], which carry no differentials.
    pub fn send(scene: &Scene, intersector: &Intersector, settings: &RenderSettings) -> Self {
        let path = PathSettings {
            max_depth: settings.max_depth,
            direct: false,
            caustic: true,
            global: true,
            projected: false,
            differentials: false,
            spread: settings.diffuse_spread,
        };
        let (sampling, seed) = (settings.sampling, settings.seed);
        let photons = PILOT_PHOTONS;
        let emitter = Emitter { scene, intersector, path, projection: None, sampling, photons, seed };
        let (emitted, [_, caustic, global]) = emitter.count(photon_pass::PILOT_PASS);
        Self { emitted, caustic, global }
    }

    /// Caustic and global photons that were stored for each that was emitted. Where none was, as many as the rule of
    /// three allows.
    pub fn stored_per_photon(&self) -> [f64; 2] {
        [self.caustic, self.global].map(|stored| stored.max(3) as f64 / self.emitted.max(1) as f64)
    }

    pub(super) fn verdict(&self, count: u64, what: &str) -> (bool, String) {
        let n = self.emitted;
        if count > 0 {
            (true, format!("of {n} pilot photons {count} {what}"))
        } else {
            // The rule of three: none in n tries bounds the rate by 3/n at 95 % confidence.
            let bound = 100.0 * 3.0 / n as f64;
            (false, format!("of {n} pilot photons none {what} (below {bound:.3} % with 95 % confidence)"))
        }
    }
}
