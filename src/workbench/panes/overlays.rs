//! The overlays with their keys and legends.

use super::Panes;
use super::gather_overlay::scale;
use super::widgets::{choice, fact, integer, rows};
use crate::scene::memory;
use crate::workbench::actions::Action;
use crate::workbench::overlays::ALL;
use crate::workbench::overlays::estimates::{VisibleEstimates, with_pyramid};
use crate::workbench::theme::number;
use egui::{Color32, Rect, Sense, Ui, vec2};

pub(super) fn show(panes: &mut Panes, ui: &mut Ui) {
    for o in ALL {
        let mut on = panes.document.session.overlays.iter().any(|id| id == o.id);
        let text = format!("{} ({})", o.title, o.key.name());
        if ui.checkbox(&mut on, text).on_hover_text(o.legend).changed() {
            panes.desk.ask(Action::Overlay(o.id));
        }
        if on {
            ui.indent(o.id, |ui| {
                ui.weak(o.legend);
                if o.id == "irradiance" {
                    estimates(panes, ui);
                }
            });
        }
    }
}

/// Which layer of which pyramid is drawn, and what it is.
fn estimates(panes: &mut Panes, ui: &mut Ui) {
    let Some(pass) = &panes.render.first_pass else { return };
    let all = with_pyramid(pass);
    if all.is_empty() {
        ui.weak("There is no pyramid: choose precomputed or ray-differentials as a panel's final gathering.");
        return;
    }
    let shown = &mut panes.desk.shown_estimates;
    rows(ui, "irradiance", |ui| {
        if all.len() > 1 {
            let names: Vec<String> = all.iter().map(ToString::to_string).collect();
            let names: Vec<&str> = names.iter().map(String::as_str).collect();
            let mut name = names[shown.gathering.min(names.len() - 1)].to_owned();
            if choice(ui, "Pyramid", "the final gathering whose pyramid is drawn", &mut name, &names) {
                shown.gathering = names.iter().position(|n| *n == name).unwrap_or(0);
            }
        }
        let f = &all[shown.gathering.min(all.len() - 1)];
        let last = pass.gathering.pyramid(f).map_or(0, |p| p.layers().len().saturating_sub(1));
        let mut layer = shown.layer.min(last) as i64;
        if integer(ui, "Layer", "0 is the most detailed", &mut layer, 0..=last as i64) {
            shown.layer = layer as usize;
        }
        if let Some(v) = &panes.desk.visible_estimates {
            fact(ui, "Estimates", format!("{}, {} of them seen", v.all, v.estimates.len()));
            fact(ui, "Disc radius", format!("{} m", number(f64::from(v.radius))));
            fact(ui, "Photons before", memory::text(v.memory.photons));
            fact(ui, "Memory, highest", memory::text(v.memory.peak));
            fact(ui, "All layers, after", memory::text(v.memory.layers));
        }
    });
    if let Some(v) = &panes.desk.visible_estimates {
        bar(ui, v, panes.document.session.tone.false_color.as_deref());
    }
}

/// Which colour is which irradiance.
fn bar(ui: &mut Ui, v: &VisibleEstimates, map: Option<&str>) {
    let scale = scale(v, map);
    let range = scale.range();
    ui.horizontal(|ui| {
        ui.weak(number(f64::from(v.range[0])));
        let (rect, _) = ui.allocate_exact_size(vec2(96.0, 10.0), Sense::hover());
        let steps = 32;
        for i in 0..steps {
            let t = i as f32 / (steps - 1) as f32;
            let [r, g, b] = scale.color(range.low + (range.high - range.low) * t);
            let left = rect.min + vec2(3.0 * i as f32, 0.0);
            ui.painter().rect_filled(Rect::from_min_size(left, vec2(3.0, 10.0)), 0.0, Color32::from_rgb(r, g, b));
        }
        ui.weak(format!("{} W/m²", number(f64::from(v.range[1]))));
    });
}
