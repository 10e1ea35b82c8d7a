//! The inspector's pane.

use super::Panes;
use super::widgets::choice;
use crate::estimate::registry::short_name;
use crate::math::rgb::mean;
use crate::workbench::inspector::{Inspected, Inspector, hemisphere, plane, rays, summary, table};
use crate::workbench::theme::{self, mono, number};
use egui::{Color32, Ui};
use std::sync::Arc;

pub(super) fn show(panes: &mut Panes, ui: &mut Ui) {
    let Some(pixel) = panes.document.session.pins.last().copied() else {
        ui.weak("Click a pixel to see why it has its value. Arrows move the pin, Ctrl+G goes to a pixel.");
        return;
    };
    ui.horizontal_wrapped(|ui| {
        ui.strong(format!("pixel {}, {}", pixel[0], pixel[1]));
        let tip = "photons differ from pass to pass; the first stays as it is while the render goes on";
        ui.selectable_value(&mut panes.desk.inspector.latest, false, "first pass").on_hover_text(tip);
        ui.selectable_value(&mut panes.desk.inspector.latest, true, "latest").on_hover_text(tip);
    });
    let Some(found) = panes.desk.inspector.found.clone() else {
        ui.weak("Waiting for a pass.");
        return;
    };
    let i = &found.inspection;
    let names: Vec<&str> = i.estimators.iter().map(|e| e.name.as_str()).collect();
    let colors: Vec<Color32> = (0..names.len()).map(|e| theme::panel_color(&names, e)).collect();
    let inspector = &mut panes.desk.inspector;
    egui::Grid::new("inspector choices").num_columns(2).show(ui, |ui| {
        if i.hits.len() > 1 {
            let titles: Vec<String> = (0..i.hits.len()).map(|h| hit_title(&found, h)).collect();
            let titles: Vec<&str> = titles.iter().map(String::as_str).collect();
            let mut title = titles.get(inspector.hit).copied().unwrap_or("").to_owned();
            if choice(ui, "Hit", "surface at which photons are gathered", &mut title, &titles) {
                inspector.hit = titles.iter().position(|t| *t == title).unwrap_or(0);
            }
        }
        let mut name = names.get(inspector.estimator).copied().unwrap_or("").to_owned();
        let tip = "whose sampling points and polygons are drawn for the photon under the pointer";
        if choice(ui, "Drawn for", tip, &mut name, &names) {
            inspector.estimator = names.iter().position(|n| *n == name).unwrap_or(0);
        }
    });
    if i.hits.is_empty() {
        ui.weak("No view ray of this pixel meets a diffuse surface that photons light.");
    }
    let height = 240.0_f32.min(ui.available_height() * 0.45);
    if found.gathering(inspector.estimator).is_some() {
        ui.horizontal(|ui| {
            let tip = "the hemisphere over the surface, seen along its normal, with the rays of final gathering";
            ui.selectable_value(&mut inspector.shows_rays, true, "gather rays").on_hover_text(tip);
            let tip = "the tangent plane with the photons that the estimator gathers itself: caustic ones";
            ui.selectable_value(&mut inspector.shows_rays, false, "photons").on_hover_text(tip);
        });
        if inspector.shows_rays {
            let map = panes.document.session.tone.false_color.as_deref();
            hemisphere::show(ui, inspector, &found, map, height);
            sums(ui, &found, &colors);
            gathered(ui, inspector, &found);
            rays::show(ui, inspector, &found);
            return;
        }
    }
    plane::show(ui, inspector, &found, height);
    sums(ui, &found, &colors);
    ui.horizontal(|ui| {
        ui.label(mono(format!("{} photons", i.rows.len())));
        if ui.small_button("Copy as CSV").on_hover_text("the photon table, all columns").clicked() {
            ui.ctx().copy_text(summary::csv(&found));
        }
    });
    let inspector = &mut panes.desk.inspector;
    table::show(ui, inspector, &found, &colors);
}

fn hit_title(found: &Arc<Inspected>, hit: usize) -> String {
    let h = &found.inspection.hits[hit];
    let depth = found.inspection.path.get(h.vertex).map_or(0, |v| v.depth);
    let rays = if h.rays_per_axis > 1 {
        format!(", {0}×{0} rays, cell {1}", h.rays_per_axis, h.cell + 1)
    } else {
        String::new()
    };
    format!("{}: after {depth} bounces{rays}", hit + 1)
}

/// How the gather rays of the chosen estimator ended, and which layers they used.
fn gathered(ui: &mut Ui, inspector: &Inspector, found: &Inspected) {
    let Some((gathering, all)) = found.gathering(inspector.estimator) else { return };
    let ends: Vec<String> = gathering.ends().iter().map(|(end, n)| format!("{n} {}", end.title())).collect();
    ui.horizontal(|ui| {
        ui.label(mono(format!("{} gather rays", all.len()))).on_hover_text(ends.join(", "));
        if ui.small_button("Copy as CSV").on_hover_text("all gather rays").clicked() {
            ui.ctx().copy_text(rays::csv(found));
        }
    });
    ui.weak(ends.join(", "));
    let layers = gathering.layers.iter().zip(gathering.rays_by_layer()).enumerate();
    let used: Vec<String> = layers
        .filter(|(_, (_, rays))| *rays > 0)
        .map(|(i, (l, rays))| format!("{rays} of layer {i} ({} m)", number(f64::from(l.radius))))
        .collect();
    if !used.is_empty() {
        ui.weak(used.join(", "));
    }
    if gathering.unrecorded > 0 {
        ui.weak(format!("{} rays more count but are not listed: there are too many", gathering.unrecorded));
    }
}

/// For each estimator: light without photons, the rows' sum, and the pixel of the pass.
fn sums(ui: &mut Ui, found: &Inspected, colors: &[Color32]) {
    if !found.inspection.gatherings.is_empty() {
        return sums_with_rays(ui, found, colors);
    }
    egui::Grid::new("sums").num_columns(4).striped(true).show(ui, |ui| {
        for (title, tip) in [("", ""), ("no photons", NO_PHOTONS), ("+ rows", ROWS), ("= pixel", PIXEL)] {
            ui.weak(title).on_hover_text(tip);
        }
        ui.end_row();
        for (e, estimator) in found.inspection.estimators.iter().enumerate() {
            ui.colored_label(colors[e], mono(short_name(&estimator.name)).color(colors[e]));
            let base = f64::from(mean(estimator.base));
            let rows = f64::from(mean(found.inspection.sum(e))) - base;
            ui.label(mono(number(base)));
            ui.label(mono(number(rows)));
            ui.label(mono(number(f64::from(mean(estimator.value)))));
            ui.end_row();
        }
    });
}

const NO_PHOTONS: &str = "direct light by shadow rays, and lights that are seen; mean channel, W/(m² sr)";
const ROWS: &str = "sum of the photon table's contributions";
const RAYS: &str = "what gather rays bring";
const PIXEL: &str = "the pixel of this pass's image, by the code that renders";

/// The same with what gather rays bring; names are long then and have lines of their own.
fn sums_with_rays(ui: &mut Ui, found: &Inspected, colors: &[Color32]) {
    for (e, estimator) in found.inspection.estimators.iter().enumerate() {
        ui.colored_label(colors[e], mono(short_name(&estimator.name)).color(colors[e]));
        ui.horizontal_wrapped(|ui| {
            ui.spacing_mut().item_spacing.x = 4.0;
            let photons = found.inspection.rows.iter().filter_map(|r| r.contributions.get(e));
            let rays = found.inspection.gathering(e).map(|g| g.sum().element_sum() / 3.0);
            for (title, value, tip) in [
                ("no photons", Some(f64::from(mean(estimator.base))), NO_PHOTONS),
                ("+ rows", Some(photons.map(|c| f64::from(mean(*c))).sum()), ROWS),
                ("+ rays", rays, RAYS),
                ("= pixel", Some(f64::from(mean(estimator.value))), PIXEL),
            ] {
                if let Some(value) = value {
                    ui.weak(title).on_hover_text(tip);
                    ui.label(mono(number(value)));
                }
            }
        });
    }
}
