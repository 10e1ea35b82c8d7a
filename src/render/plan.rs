//! The plan: what a scene needs, and what is left out and why.

use crate::estimate::registry::{needs_photon_footprint, needs_view_footprint};
use crate::estimate::{Estimator, FinalGatherMethod, FinalGathering, Lookup};
use crate::photons::map::MapParts;
use crate::photons::path::PathSettings;
use crate::photons::projection::ProjectionMap;
use crate::render::evidence::Evidence;
use crate::render::settings::{DirectLight, Gather, LightPart, PlanMode, Projection, RenderSettings};
use crate::scene::{Light, Scene};
use serde::Serialize;
use std::sync::Arc;

/// Share of the lights' power towards specular surfaces from which on a projection map is not worth having.
pub const WORTHWHILE_SHARE: f64 = 0.5;

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
    /// Global photons are stored, and estimators look them up.
    pub global_map: bool,
    /// Where caustic photons leave their lights, if they are emitted by themselves.
    #[serde(skip)]
    pub projection: Option<Arc<ProjectionMap>>,
    /// The final gatherings that run. Where there is one, photons of all kinds are stored.
    pub final_gatherings: Vec<FinalGathering>,
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
    /// Plans for a scene and estimators on the evidence that there is.
    pub fn new(scene: &Scene, settings: &RenderSettings, slots: &[Slot], evidence: &Evidence) -> Self {
        let pilot = evidence.pilot.as_ref();
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
        let (global_light, why_global) = match pilot {
            _ if !shows(LightPart::Global) => (false, "this light is not asked for".into()),
            _ if full => (true, "forced on".into()),
            None => (false, "no light has power".into()),
            Some(p) => p.verdict(p.global, "met a diffuse surface again after a diffuse bounce"),
        };
        let asked = gatherings(slots);
        let by_photons = slots.iter().any(|s| s.estimator.final_gathering().is_none());
        let global_map = item(
            "global map",
            global_light && by_photons,
            if global_light && !by_photons { "final gathering takes its place".into() } else { why_global.clone() },
        );
        let final_gatherings = if global_light { asked.clone() } else { Vec::new() };
        let gathers = item(
            "final gathering",
            !final_gatherings.is_empty(),
            match (asked.is_empty(), global_light) {
                (true, _) => "not asked for".into(),
                (false, false) => format!("there is nothing to gather: {why_global}"),
                (false, true) => asked.iter().map(ToString::to_string).collect::<Vec<_>>().join("; "),
            },
        );
        let layered = |f: &FinalGathering| f.method != FinalGatherMethod::Classic;
        item(
            "irradiance pyramid",
            final_gatherings.iter().any(layered),
            match (asked.iter().any(layered), gathers) {
                (false, _) => "no final gathering asks for one".into(),
                (true, false) => "there is nothing to gather".into(),
                (true, true) => "for precomputed irradiance".into(),
            },
        );
        item(
            "photon bounces after a diffuse surface",
            global_map || gathers,
            match (global_map, gathers) {
                (true, _) => "the global map wants them".into(),
                (_, true) => "final gathering wants them".into(),
                _ => "there is no global map".into(),
            },
        );
        let projection = evidence.projection.as_ref().filter(|p| {
            let pays = p.share() < WORTHWHILE_SHARE && !gathers;
            caustic_map && pays && settings.projection_map == Projection::Auto
        });
        item(
            "projection map",
            projection.is_some(),
            match (settings.projection_map, &evidence.projection) {
                _ if !caustic_map => "there is no caustic map".into(),
                (Projection::Off, _) => "turned off".into(),
                _ if gathers => "final gathering looks up photons of equal power".into(),
                (_, None) => "it has not been made".into(),
                (_, Some(p)) => {
                    format!("{:.3} % of the lights' power leaves towards specular surfaces", 100.0 * p.share())
                }
            },
        );
        let only_caustic = caustic_map && !global_map && !direct_by_photons && !gathers;
        item(
            "photons that miss all specular surfaces",
            !only_caustic && (caustic_map || global_map || direct_by_photons || gathers),
            match (only_caustic, projection.is_some()) {
                (true, true) => "they are not emitted".into(),
                (true, false) => "they cannot become caustic".into(),
                (false, true) => "as many photons again, for the other maps".into(),
                (false, false) => "followed with the others, if any".into(),
            },
        );
        let direct_map = direct_by_photons;
        item(
            "direct photons",
            direct_map || gathers,
            match (direct_map, gathers) {
                (true, _) => "asked for".into(),
                (_, true) => "gather rays look them up; shadow rays take their place elsewhere".into(),
                _ => "shadow rays take their place".into(),
            },
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
        Self {
            direct_map,
            caustic_map,
            global_map,
            projection: projection.map(Arc::clone),
            final_gatherings,
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
        self.direct_map || self.caustic_map || self.global_map || self.gathers()
    }

    /// Whether any final gathering runs.
    pub fn gathers(&self) -> bool {
        !self.final_gatherings.is_empty()
    }

    /// Whether photon paths go on after a diffuse bounce.
    pub fn bounces(&self) -> bool {
        self.global_map || self.gathers()
    }

    /// The final gathering of an estimator, if it runs.
    pub fn final_gathering<'a>(&self, estimator: &'a dyn Estimator) -> Option<&'a FinalGathering> {
        estimator.final_gathering().filter(|f| self.final_gatherings.contains(f))
    }

    /// The first part that a slot needs and a pass of this plan does not have.
    pub fn lacks(&self, slot: &Slot) -> Option<&'static str> {
        let by_k = slot.gather == Gather::Knn || slot.estimator.lookup() == Lookup::Disc;
        let wanted = slot.estimator.final_gathering();
        let gathered = wanted.is_none_or(|f| self.final_gatherings.contains(f));
        if self.bounces() && !gathered {
            return Some("its final gathering");
        }
        if self.bounces() && wanted.is_none() && !self.global_map {
            return Some("a global map");
        }
        let maps = self.direct_map || self.caustic_map || self.global_map;
        let needs = [
            (needs_photon_footprint(slot.estimator), self.photon_differentials, "photon differentials"),
            (needs_view_footprint(slot.estimator), self.view_differentials, "view differentials"),
            (by_k, self.kd_tree, "kd-tree"),
            (!by_k, self.overlap, "footprint hierarchy"),
        ];
        let missing = needs.into_iter().find(|(needed, there, _)| *needed && !*there);
        missing.filter(|_| maps).map(|(.., part)| part)
    }

    /// How photon paths are followed under this plan.
    pub fn path_settings(&self, settings: &RenderSettings) -> PathSettings {
        PathSettings {
            max_depth: settings.max_depth,
            direct: self.direct_map || self.gathers(),
            caustic: self.caustic_map || self.gathers(),
            global: self.bounces(),
            projected: self.projection.is_some(),
            differentials: self.photon_differentials,
            spread: settings.diffuse_spread,
        }
    }

    /// The structures that maps need.
    pub fn map_parts(&self) -> MapParts {
        MapParts { kd_tree: self.kd_tree, overlap: self.overlap }
    }
}

/// The final gatherings that slots ask for, each once.
fn gatherings(slots: &[Slot]) -> Vec<FinalGathering> {
    let mut all: Vec<FinalGathering> = Vec::new();
    for f in slots.iter().filter_map(|s| s.estimator.final_gathering()) {
        if !all.contains(f) {
            all.push(*f);
        }
    }
    all
}
