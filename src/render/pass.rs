//! One pass as a value: the photons, their maps, and everything needed to look at it again.

use crate::estimate::Estimator;
use crate::final_gather::GatherMaps;
use crate::render::evidence::Evidence;
use crate::render::flat_pixels::FlatPixels;
use crate::render::memory::foreseen;
use crate::render::photon_pass::{Emitter, PhotonMaps, PhotonPass};
use crate::render::plan::{Plan, Slot};
use crate::render::renderer::{area_factor, slots};
use crate::render::settings::RenderSettings;
use crate::render::tiles::TILE;
use crate::render::view::ViewTracer;
use crate::render::view_pass::ViewPass;
use crate::scene::Scene;
use crate::scene::memory::Shortage;
use crate::trace::Intersector;
use std::sync::Arc;

/// The photons and maps of a pass, with what they were made from.
///
/// It is shared and never changes: whoever holds it (a view pass, an inspector, an overlay) sees the same photons,
/// also when the renderer has gone on.
pub struct Pass {
    /// The scene.
    pub scene: Arc<Scene>,
    /// Its intersector.
    pub intersector: Arc<Intersector>,
    /// The settings, with the number of photons that this pass emits.
    pub settings: RenderSettings,
    /// The plan.
    pub plan: Plan,
    /// The photons, footprints at scale 1.
    pub photons: Arc<PhotonPass>,
    /// The maps made of them.
    pub maps: PhotonMaps,
    /// What final gathering looks up.
    pub gathering: GatherMaps,
    /// Number of the pass, from 0.
    pub number: u32,
    /// Area of the footprints relative to the first pass, in `(0, 1]`.
    pub area_factor: f64,
    /// Pixels that see one plane alone; None where nothing asks for them.
    pub flat: Option<Arc<FlatPixels>>,
}

impl Pass {
    /// Makes pass `number` (from 0) alone, as a render by these estimators makes it; None if cancelled.
    ///
    /// # Errors
    /// If its photons would need more memory than there is; one line.
    pub fn alone(
        scene: Arc<Scene>,
        settings: RenderSettings,
        estimators: &[Box<dyn Estimator>],
        number: u32,
        cancelled: &(dyn Fn() -> bool + Sync),
    ) -> Result<Option<Self>, Shortage> {
        let slots = slots(estimators, settings.gather);
        Self::for_slots(scene, settings, &slots, number, cancelled)
    }

    /// The same, planned for estimators that need not all gather alike.
    ///
    /// # Errors
    /// As [`Pass::alone`].
    pub fn for_slots(
        scene: Arc<Scene>,
        settings: RenderSettings,
        slots: &[Slot],
        number: u32,
        cancelled: &(dyn Fn() -> bool + Sync),
    ) -> Result<Option<Self>, Shortage> {
        let intersector =
            Arc::new(Intersector::for_rays(&scene.geometry, scene.radius, settings.rays_of_pass(slots.len())));
        let evidence = Evidence::of(&scene, &intersector, &settings, Evidence::default());
        let plan = Plan::new(&scene, &settings, slots, &evidence);
        foreseen(&scene, &intersector, &settings, &plan, evidence.pilot.as_ref(), 1, 1).check(&settings)?;
        let area_factor = area_factor(number);
        let (photons, maps, gathering) = (Arc::default(), PhotonMaps::default(), GatherMaps::default());
        let flat = needs_flat_pixels(slots.iter().map(|s| s.estimator), &plan, number)
            .then(|| Arc::new(FlatPixels::new(&scene, &intersector, settings.size)));
        let mut pass = Self { scene, intersector, settings, plan, photons, maps, gathering, number, area_factor, flat };
        if pass.plan.needs_photons() {
            pass.photons = Arc::new(pass.emitter().run(u64::from(number), cancelled));
        }
        if cancelled() {
            return Ok(None);
        }
        pass.maps = PhotonMaps::new(&pass.scene, &pass.plan, &pass.photons.stored, pass.scale());
        pass.gathering = gather_maps(&pass.scene, &pass.plan, &pass.settings, &pass.photons, area_factor);
        Ok(Some(pass))
    }

    /// What traced its photons.
    pub fn emitter(&self) -> Emitter<'_> {
        Emitter {
            scene: &self.scene,
            intersector: &self.intersector,
            path: self.plan.path_settings(&self.settings),
            projection: self.plan.projection.as_deref(),
            sampling: self.settings.sampling,
            photons: self.settings.photons,
            seed: self.settings.seed,
        }
    }

    /// What renders views of this pass.
    pub fn view(&self) -> ViewPass<'_> {
        ViewPass {
            tracer: ViewTracer {
                scene: &self.scene,
                intersector: &self.intersector,
                settings: &self.settings,
                plan: &self.plan,
                footprints: self.plan.view_differentials,
            },
            maps: &self.maps,
            gathering: &self.gathering,
            pass: self.number,
            flat: self.flat.as_deref(),
            area_factor: self.area_factor as f32,
            gather_rays: u32::MAX,
            tile: TILE,
        }
    }

    /// Factor on the axes of the photons' footprints in this pass's maps.
    pub fn scale(&self) -> f32 {
        scale_of(&self.settings, self.area_factor)
    }
}

/// Whether pass `number` of these estimators asks for the flat pixels: view rays are jittered, and photons are looked up
/// by an exact mean over footprints that view rays carry.
pub(super) fn needs_flat_pixels<'a>(
    mut estimators: impl Iterator<Item = &'a dyn Estimator>,
    plan: &Plan,
    number: u32,
) -> bool {
    number > 0 && plan.needs_photons() && plan.view_differentials && estimators.any(|e| e.is_exact_mean())
}

/// What the final gatherings of a plan look up.
pub(super) fn gather_maps(
    scene: &Scene,
    plan: &Plan,
    settings: &RenderSettings,
    photons: &PhotonPass,
    area_factor: f64,
) -> GatherMaps {
    GatherMaps::new(scene, &photons.stored, &plan.final_gatherings, settings.k, area_factor)
}

/// Factor on the axes of footprints whose area is `area_factor` of the first pass's.
pub(super) fn scale_of(settings: &RenderSettings, area_factor: f64) -> f32 {
    (f64::from(settings.footprint_scale) * area_factor.sqrt()) as f32
}
