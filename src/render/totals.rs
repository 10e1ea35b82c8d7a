//! What the passes of a render add up to: photons, gather rays, and what was bounded or odd.

use crate::estimate::FinalGathering;
use crate::final_gather::GatherCounts;
use crate::render::pass::Pass;
use crate::render::plan::Plan;
use crate::render::stats::{Bounded, StoredCounts};
use crate::render::view::ViewCounts;
use crate::scene::Scene;

/// Gather rays without light, in percent of all, from which there is a warning: a few always end in the dark under
/// something, and are no reason for more photons.
const UNLIT_PERCENT: f64 = 0.05;

/// Counts of all passes.
#[derive(Clone, Copy, Debug, Default)]
pub struct Totals {
    /// Passes whose photons are counted.
    pub passes: u32,
    /// Photons emitted.
    pub emitted: u64,
    /// Photons stored.
    pub stored: StoredCounts,
    /// What was bounded.
    pub bounded: Bounded,
    /// View rays that started inside a dielectric.
    pub inside_glass: u64,
    /// Rays of final gathering, and how they ended.
    pub gather: GatherCounts,
}

impl Totals {
    /// Adds the views of a pass.
    pub fn add_views(&mut self, counts: &ViewCounts) {
        self.bounded.views += counts.bounded;
        self.bounded.overflow += counts.overflow;
        self.bounded.disc_floor += counts.disc_floor;
        self.inside_glass += counts.camera_inside_glass;
        self.gather += counts.gather;
    }

    /// Adds the photons of a pass that is seen for the first time.
    pub fn add_photons(&mut self, pass: &Pass) {
        self.passes += 1;
        let (photons, stored) = (&pass.photons, &pass.photons.stored);
        self.emitted += photons.emitted;
        self.stored.direct += stored.direct.len() as u64;
        self.stored.caustic += stored.caustic.len() as u64;
        self.stored.global += stored.global.len() as u64;
        self.bounded.photons += photons.counts;
        let (floor, ceiling) = pass.maps.limited();
        self.bounded.footprint_floor += floor;
        self.bounded.footprint_ceiling += ceiling;
        self.bounded.cut_off_power += (photons.cut_off - self.bounded.cut_off_power) / f64::from(self.passes);
    }

    /// What was defined but odd: the scene's warnings, and what the passes met.
    pub fn warnings(&self, scene: &Scene, plan: &Plan) -> Vec<String> {
        let mut all = scene.warnings.clone();
        if self.passes > 0 && plan.needs_photons() && self.stored == StoredCounts::default() {
            all.push(format!("none of {} photons was stored", self.emitted));
        }
        if self.bounded.overflow > 0 {
            all.push(format!(
                "{} pixel values of all passes are beyond 32 bits and were lowered to 3.4e38; lower the power of lights",
                self.bounded.overflow
            ));
        }
        if self.inside_glass > 0 {
            all.push(format!("the camera stands inside glass: {} view rays start there", self.inside_glass));
        }
        let part = 100.0 * self.gather.unknown as f64 / self.gather.rays.max(1) as f64;
        if part >= UNLIT_PERCENT {
            all.push(format!(
                "{} gather rays ({part:.2} %) end where no photon has arrived and brought no light; emit more photons",
                self.gather.unknown
            ));
        }
        let below = |f: &&FinalGathering| f.radius.is_some_and(|r| r < scene.resolution());
        if let Some(f) = plan.final_gatherings.iter().find(below) {
            all.push(format!(
                "{f}: its radius is below the resolution of 32 bits in this scene and was raised to {:e} m",
                scene.resolution()
            ));
        }
        all
    }
}
