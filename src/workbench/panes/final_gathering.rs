//! Widgets for an estimator's final gathering.

use super::widgets::{Limit, choice, integer, limit, real, rows};
use crate::estimate::FinalGathering;
use crate::estimate::final_gathering::{FinalGatherMethod, MAX_RAYS, PATTERNS, REACHES};
use egui::Ui;

/// Radius that a fixed one begins with, in radii of the scene.
const FIRST_RADIUS: f64 = 0.02;

/// Edits the final gathering of a panel; what it is now if it was changed. `radius` is that of the scene, metres.
pub(super) fn edit(ui: &mut Ui, now: Option<FinalGathering>, radius: f64) -> Option<Option<FinalGathering>> {
    let mut method = now.map_or("none", |f| f.method.name()).to_owned();
    let mut changed = false;
    let mut edited = now;
    rows(ui, "final gathering", |ui| {
        let methods: Vec<&str> = std::iter::once("none").chain(FinalGatherMethod::ALL.map(|(n, _)| n)).collect();
        let tip = "where global light comes from: the photons around a view hit, or one more bounce of many rays that \
                   look up photons, the nearest precomputed irradiance, or its mean over the ray's footprint \
                   (Jensen 2001; Christensen 1999; Gjøl, Larsen and Christensen)";
        if choice(ui, "Final gathering", tip, &mut method, &methods) {
            changed = true;
            let chosen = FinalGatherMethod::ALL.into_iter().find(|(n, _)| *n == method);
            edited = chosen.map(|(_, m)| match now {
                Some(f) => FinalGathering { method: m, ..f },
                None => FinalGathering::new(m),
            });
        }
        if let Some(f) = &mut edited {
            changed |= settings(ui, f, radius);
        }
    });
    changed.then_some(edited)
}

fn settings(ui: &mut Ui, f: &mut FinalGathering, scene: f64) -> bool {
    let mut changed = false;
    let mut rays = i64::from(f.rays);
    if integer(ui, "Rays", "gather rays from each view hit", &mut rays, 1..=i64::from(MAX_RAYS)) {
        f.rays = rays as u32;
        changed = true;
    }
    let tip = "how the rays are spread; stratified is as published, a spiral's footprints tile the hemisphere";
    changed |= one_of(ui, "Pattern", tip, &mut f.pattern, &PATTERNS);
    let by_footprint = f.method == FinalGatherMethod::RayDifferentials;
    if by_footprint {
        let tip = "size of the rays' footprints: 1/√(N cos θ), or √(2π/N) over cos θ as published";
        changed |= published(ui, "Differentials", tip, &mut f.differentials_as_published);
        let tip =
            "which estimates under a footprint count: of its own surface, or all that face the ray (as published)";
        changed |= one_of(ui, "Reach", tip, &mut f.reach, &REACHES);
    }
    if f.method != FinalGatherMethod::Classic {
        let tip = "irradiance over the surface that a disc holds and means by area, or whole discs and plain means";
        changed |= published(ui, "Estimates", tip, &mut f.estimates_as_published);
    }
    let mut radius = f.radius.map(f64::from);
    let tip =
        "of the first search for photons and of the first layer's discs; automatic: the disc that holds k photons";
    let looks = Limit { tip, first: FIRST_RADIUS * scene, factor: 1.0, unit: " m" };
    limit(ui, "Fixed radius", &mut radius, looks);
    if radius != f.radius.map(f64::from) {
        f.radius = radius.map(|r| r as f32).filter(|r| *r > 0.0);
        changed = true;
    }
    if by_footprint {
        let mut growth = f64::from(f.growth);
        if real(ui, "Growth", "radius of a layer over that of the one before", &mut growth, 1.1..=16.0, "") {
            f.growth = growth as f32;
            changed = true;
        }
    }
    let mut near = f64::from(f.near);
    let tip = "a ray that meets a surface nearer than this gathers a second time from there; 0 for never";
    if real(ui, "Near", tip, &mut near, 0.0..=scene, " m") {
        f.near = near.max(0.0) as f32;
        changed = true;
    }
    changed
}

fn published(ui: &mut Ui, label: &str, tip: &str, value: &mut bool) -> bool {
    one_of(ui, label, tip, value, &[("corrected", false), ("as_published", true)])
}

/// A choice among named values.
fn one_of<T: Copy + PartialEq>(ui: &mut Ui, label: &str, tip: &str, value: &mut T, all: &[(&str, T)]) -> bool {
    let names: Vec<&str> = all.iter().map(|(n, _)| *n).collect();
    let mut name = all.iter().find(|(_, v)| v == value).map_or("", |(n, _)| *n).to_owned();
    if !choice(ui, label, tip, &mut name, &names) {
        return false;
    }
    if let Some((_, v)) = all.iter().find(|(n, _)| *n == name) {
        *value = *v;
    }
    true
}
