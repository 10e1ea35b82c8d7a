//! The plan: what a scene needs, and what is left out and why.

use crate::estimate::registry::{needs_photon_footprint, needs_view_footprint};
use crate::estimate::{Estimator, Lookup};
use crate::photons::map::MapParts;
use crate::photons::path::PathSettings;
use crate::render::photon_pass::{self, Emitter};
use crate::render::settings::{DirectLight, Gather, LightPart, PlanMode, RenderSettings};
use crate::scene::{Light, Scene};
use crate::trace::Intersector;
use serde::Serialize;

/// Photons that the plan sends ahead to see where light goes.
pub const PILOT_PHOTONS: u64 = 65_536;
/// Surfaces that a pilot photon meets at most: where nothing absorbs, a high bounce limit would keep it on its way, and
/// in memory, for long after it has shown what there is.
const PILOT_DEPTH: u32 = 64;

/// One part of a render.
#[derive(Clone, Debug, Serialize)]
pub struct PlanItem {
    /// Which part.
    pub part: &'static str,
    /// Whether it runs.
    pub on: bool,
    /// Why, or why not.
    pub why: String,
}

/// What a render does.
#[derive(Clone, Debug, Serialize)]
pub struct Plan {
    /// Direct photons are stored.
    pub direct_map: bool,
    /// Caustic photons are stored.
    pub caustic_map: bool,
    /// Paths go on after a diffuse bounce, and global photons are stored.
    pub global_map: bool,
    /// Direct light comes from shadow rays.
    pub shadow_rays: bool,
    /// Light sources are seen.
    pub emission: bool,
    /// Photons carry differentials.
    pub photon_differentials: bool,
    /// View rays carry differentials.
    pub view_differentials: bool,
    /// Maps have a kd-tree.
    pub kd_tree: bool,
    /// Maps have a footprint hierarchy.
    pub overlap: bool,
    /// All of it in words.
    pub items: Vec<PlanItem>,
}

/// An estimator with the gather that it uses.
#[derive(Clone, Copy)]
pub struct Slot<'a> {
    /// The estimator.
    pub estimator: &'a dyn Estimator,
    /// How it looks photons up; `density` is always `knn`.
    pub gather: Gather,
}

impl<'a> Slot<'a> {
    /// An estimator in a render that looks photons up by `gather`.
    pub fn new(estimator: &'a dyn Estimator, gather: Gather) -> Self {
        Self { estimator, gather: if estimator.lookup() == Lookup::Disc { Gather::Knn } else { gather } }
    }
}

impl Plan {
    /// Plans for a scene and estimators, on the evidence of a pilot where [`Pilot::needed`] says so.
    pub fn new(scene: &Scene, settings: &RenderSettings, slots: &[Slot], pilot: Option<&Pilot>) -> Self {
        let full = settings.plan == PlanMode::Full;
        let shows = |part| settings.light == LightPart::All || settings.light == part;
        let lit = scene.total_flux() > 0.0;
        let direct_by_photons = settings.direct == DirectLight::Photons && shows(LightPart::Direct);
        let mut items = Vec::new();
        let mut item = |part, on, why: String| {
            items.push(PlanItem { part, on, why });
            on
        };

        let has_specular = scene.has_specular();
        let caustic_map = {
            let (on, why) = match pilot {
                _ if !shows(LightPart::Caustic) => (false, "this light is not asked for".into()),
                _ if full => (true, "forced on".into()),
                None => (false, "no light has power".into()),
                Some(_) if !has_specular => (false, "no surface is specular".into()),
                // However rare: photons that miss all specular surfaces are dropped at once, so it costs little.
                Some(p) => (true, format!("of {} pilot photons {} came by specular surfaces", p.emitted, p.caustic)),
            };
            item("caustic map", on, why)
        };
        let global_map = {
            let (on, why) = match pilot {
                _ if !shows(LightPart::Global) => (false, "this light is not asked for".into()),
                _ if full => (true, "forced on".into()),
                None => (false, "no light has power".into()),
                Some(p) => p.verdict(p.global, "met a diffuse surface again after a diffuse bounce"),
            };
            item("global map", on, why)
        };
        item(
            "photon bounces after a diffuse surface",
            global_map,
            if global_map { "the global map wants them".into() } else { "there is no global map".into() },
        );
        let only_caustic = caustic_map && !global_map && !direct_by_photons;
        item(
            "photons that miss all specular surfaces",
            !only_caustic && (caustic_map || global_map || direct_by_photons),
            if only_caustic { "they cannot become caustic".into() } else { "followed with the others, if any".into() },
        );
        let direct_map = item(
            "direct photons",
            direct_by_photons,
            if direct_by_photons { "asked for".into() } else { "shadow rays take their place".into() },
        );
        let shadow_rays = item(
            "shadow rays",
            shows(LightPart::Direct) && !direct_by_photons && lit,
            match (shows(LightPart::Direct), direct_by_photons, lit) {
                (false, ..) => "direct light is not asked for".into(),
                (_, true, _) => "direct photons take their place".into(),
                (.., false) => "no light has power".into(),
                _ => "for direct light".into(),
            },
        );
        let has_area =
            scene.lights.iter().any(|l| matches!(l, Light::Sphere { .. } | Light::Quad { .. } | Light::Mesh { .. }));
        let emission = item(
            "lights seen by the camera",
            shows(LightPart::Direct) && has_area,
            if has_area { "they have area".into() } else { "none has area".into() },
        );
        let any_map = direct_map || caustic_map || global_map;
        let footprints = slots.iter().any(|s| needs_photon_footprint(s.estimator));
        let photon_differentials = item(
            "photon differentials",
            any_map && (footprints || full),
            if !any_map {
                "there is no photon map".into()
            } else if footprints {
                "estimators use footprints".into()
            } else if full {
                "forced on".into()
            } else {
                "no estimator uses footprints".into()
            },
        );
        let views = slots.iter().any(|s| needs_view_footprint(s.estimator));
        let view_differentials = item(
            "view differentials",
            any_map && (views || full),
            if !any_map {
                "there is no photon map".into()
            } else if views {
                "estimators use the view footprint".into()
            } else if full {
                "forced on".into()
            } else {
                "no estimator uses the view footprint".into()
            },
        );
        let uses_knn = |s: &Slot| s.gather == Gather::Knn || s.estimator.lookup() == Lookup::Disc;
        let kd_tree = item(
            "kd-tree",
            any_map && slots.iter().any(uses_knn),
            if !any_map {
                "there is no photon map".into()
            } else if slots.iter().any(uses_knn) {
                "for the k nearest".into()
            } else {
                "nothing looks up the k nearest".into()
            },
        );
        let by_overlap = slots.iter().any(|s| !uses_knn(s));
        let overlap = item(
            "footprint hierarchy",
            any_map && by_overlap,
            if !any_map {
                "there is no photon map".into()
            } else if by_overlap {
                "for overlap".into()
            } else {
                "nothing gathers by overlap".into()
            },
        );
        item(
            "specular view paths",
            has_specular,
            if has_specular { "surfaces reflect or refract".into() } else { "no surface is specular".into() },
        );
        item("final gathering", false, "not asked for".into());
        Self {
            direct_map,
            caustic_map,
            global_map,
            shadow_rays,
            emission,
            photon_differentials,
            view_differentials,
            kd_tree,
            overlap,
            items,
        }
    }

    /// Whether photons are needed at all.
    pub fn needs_photons(&self) -> bool {
        self.direct_map || self.caustic_map || self.global_map
    }

    /// The first part that a slot needs and a pass of this plan does not have.
    pub fn lacks(&self, slot: &Slot) -> Option<&'static str> {
        let by_k = slot.gather == Gather::Knn || slot.estimator.lookup() == Lookup::Disc;
        let needs = [
            (needs_photon_footprint(slot.estimator), self.photon_differentials, "photon differentials"),
            (needs_view_footprint(slot.estimator), self.view_differentials, "view differentials"),
            (by_k, self.kd_tree, "kd-tree"),
            (!by_k, self.overlap, "footprint hierarchy"),
        ];
        let missing = needs.into_iter().find(|(needed, there, _)| *needed && !*there);
        missing.filter(|_| self.needs_photons()).map(|(.., part)| part)
    }

    /// How photon paths are followed under this plan.
    pub fn path_settings(&self, settings: &RenderSettings) -> PathSettings {
        PathSettings {
            max_depth: settings.max_depth,
            direct: self.direct_map,
            caustic: self.caustic_map,
            global: self.global_map,
            differentials: self.photon_differentials,
            spread: settings.diffuse_spread,
        }
    }

    /// The structures that maps need.
    pub fn map_parts(&self) -> MapParts {
        MapParts { kd_tree: self.kd_tree, overlap: self.overlap }
    }
}

/// Photons sent ahead of a render, to see where light goes.
#[derive(Clone, Copy, Debug)]
pub struct Pilot {
    emitted: u64,
    caustic: u64,
    global: u64,
}

impl Pilot {
    /// Whether a plan asks for one: light may take more than one way, and not every part is forced on.
    pub fn needed(scene: &Scene, settings: &RenderSettings) -> bool {
        settings.plan == PlanMode::Needed && settings.light != LightPart::Direct && scene.total_flux() > 0.0
    }

    /// Sends [`PILOT_PHOTONS`], which carry no differentials.
    pub fn send(scene: &Scene, intersector: &Intersector, settings: &RenderSettings) -> Self {
        let path = PathSettings {
            max_depth: settings.max_depth.min(PILOT_DEPTH),
            direct: false,
            caustic: true,
            global: true,
            differentials: false,
            spread: settings.diffuse_spread,
        };
        let (sampling, seed) = (settings.sampling, settings.seed);
        let emitter = Emitter { scene, intersector, path, sampling, photons: PILOT_PHOTONS, seed };
        let pass = emitter.run(photon_pass::PILOT_PASS, &|| false);
        let (caustic, global) = (pass.stored.caustic.len() as u64, pass.stored.global.len() as u64);
        Self { emitted: pass.emitted, caustic, global }
    }

    fn verdict(&self, count: u64, what: &str) -> (bool, String) {
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
