//! Photons and how they are gathered.

use super::Panes;
use super::widgets::{Limit, choice, integer, limit, real, rows};
use egui::Ui;

/// Most photons that a slider offers; the field takes more.
const PHOTONS: i64 = 20_000_000;

pub(super) fn show(panes: &mut Panes, ui: &mut Ui) {
    let now = panes.document.settings().clone();
    let session = &mut panes.document.session;
    let name = |value: &dyn erased::Name| value.name();
    rows(ui, "photons", |ui| {
        let mut photons = now.photons as i64;
        let tip = "photons emitted in each pass; their powers share the lights' flux (Pedersen 2011, eq. 1-3)";
        if integer(ui, "Photons", tip, &mut photons, 1..=PHOTONS) {
            session.render.photons = Some(photons);
        }
        let mut scale = f64::from(now.footprint_scale);
        let tip =
            "factor on the half-axes of all photon footprints; at 1 the ellipses of a point light's photons share 4π";
        if real(ui, "Footprint scale", tip, &mut scale, 0.05..=50.0, "") {
            session.render.footprint_scale = Some(scale);
        }
        let mut gather = name(&now.gather);
        let tip = "overlap: every photon whose footprint meets the query; knn: the k nearest of each map, as published";
        if choice(ui, "Gather", tip, &mut gather, &["overlap", "knn"]) {
            session.render.gather = Some(gather);
        }
        let mut k = now.k as i64;
        let tip = "photons that knn and density look up in each map (Jensen 2001)";
        if integer(ui, "k", tip, &mut k, 1..=5000) {
            session.render.k = Some(k);
        }
        let mut light = name(&now.light);
        let tip = "which light is shown: direct LD, caustic LS+D, global the rest";
        if choice(ui, "Light", tip, &mut light, &["all", "direct", "caustic", "global"]) {
            session.render.light = Some(light);
        }
        let mut direct = name(&now.direct);
        let tip = "where direct light comes from";
        if choice(ui, "Direct light", tip, &mut direct, &["shadow_rays", "photons"]) {
            session.render.direct = Some(direct);
        }
        let mut rays = i64::from(now.shadow_rays);
        let tip = "shadow rays to each light with area, for each view hit";
        if integer(ui, "Shadow rays", tip, &mut rays, 1..=256) {
            session.render.shadow_rays = Some(rays);
        }
        let mut sampling = name(&now.sampling);
        let tip = "numbers that photons are made of: Owen-scrambled Sobol points, or pseudo-random";
        if choice(ui, "Sampling", tip, &mut sampling, &["sobol", "random"]) {
            session.render.sampling = Some(sampling);
        }
        let mut spread = name(&now.diffuse_spread);
        let tip = "rule for footprints at a diffuse bounce; as_published is the thesis's listing";
        if choice(ui, "Diffuse spread", tip, &mut spread, &["polar", "as_published"]) {
            session.render.diffuse_spread = Some(spread);
        }
        let mut projection = name(&now.projection_map);
        let tip = "whether caustic photons leave the lights towards specular surfaces alone: where that pays, or never";
        if choice(ui, "Projection map", tip, &mut projection, &["auto", "off"]) {
            session.render.projection_map = Some(projection);
        }
        let mut depth = i64::from(now.max_depth);
        if integer(ui, "Depth", "surfaces that a path may meet", &mut depth, 1..=100) {
            session.render.max_depth = Some(depth);
        }
        let mut split = i64::from(now.split_depth);
        let tip = "specular view hits at which both branches are followed; then Russian roulette";
        if integer(ui, "Split depth", tip, &mut split, 0..=8) {
            session.render.split_depth = Some(split);
        }
        let mut passes = i64::from(session.passes);
        let tip = "passes after which the render rests; footprints shrink from pass to pass (Knaus and Zwicker 2011)";
        if integer(ui, "Passes", tip, &mut passes, 1..=100_000) {
            session.passes = passes as u32;
        }
        limit(
            ui,
            "Stop at error",
            &mut session.until_error,
            Limit {
                tip: "rest before that, when the estimated error of every panel is likely below this part of its mean",
                first: 0.02,
                factor: 100.0,
                unit: " %",
            },
        );
        limit(
            ui,
            "Stop at time",
            &mut session.seconds,
            Limit {
                tip: "rest before that, when the passes have taken so long; the next pass counts as long as the last",
                first: 60.0,
                factor: 1.0,
                unit: " s",
            },
        );
        let mut seed = session.seed as i64;
        if integer(ui, "Seed", "seed of everything random", &mut seed, 0..=1_000_000) {
            session.seed = seed as u64;
        }
    });
}

/// Names of settings as the scene file writes them.
mod erased {
    use crate::math::sequence::Sampling;
    use crate::photons::spread::DiffuseSpread;
    use crate::render::settings::{DirectLight, Gather, LightPart, Projection};

    pub(super) trait Name {
        fn name(&self) -> String;
    }

    macro_rules! named {
        ($($kind:ty),*) => {
            $(impl Name for $kind {
                fn name(&self) -> String {
                    // The scene file's names are those that serde writes.
                    serde_json::to_value(self).ok().and_then(|v| v.as_str().map(str::to_owned)).unwrap_or_default()
                }
            })*
        };
    }

    named!(Gather, LightPart, DirectLight, Sampling, DiffuseSpread, Projection);
}
