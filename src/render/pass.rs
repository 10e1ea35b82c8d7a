//! One pass as a value: the photons, their maps, and everything needed to look at it again.

use crate::render::photon_pass::{PhotonMaps, PhotonPass};
use crate::render::plan::Plan;
use crate::render::settings::RenderSettings;
use crate::render::view::ViewTracer;
use crate::render::view_pass::ViewPass;
use crate::scene::Scene;
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
    /// Number of the pass, from 0.
    pub number: u32,
    /// Area of the footprints relative to the first pass, in `(0, 1]`.
    pub area_factor: f64,
}

impl Pass {
    /// What renders views of this pass.
    pub fn view(&self) -> ViewPass<'_> {
        ViewPass {
            tracer: ViewTracer {
                scene: &self.scene,
                intersector: &self.intersector,
                settings: &self.settings,
                plan: &self.plan,
            },
            maps: &self.maps,
            pass: self.number,
            area_factor: self.area_factor as f32,
        }
    }

    /// Factor on the axes of the photons' footprints in this pass's maps.
    pub fn scale(&self) -> f32 {
        (f64::from(self.settings.footprint_scale) * self.area_factor.sqrt()) as f32
    }
}
