//! Widgets with a label, a unit and the equation that they stand for.

use crate::workbench::theme::mono;
use egui::{DragValue, Response, SliderClamping, Ui};
use std::ops::RangeInclusive;

/// A row of a settings grid: the label left, the widget right, both with the tooltip. The widget is named by the label.
pub fn row(ui: &mut Ui, label: &str, tip: &str, add: impl FnOnce(&mut Ui) -> Response) -> Response {
    let title = ui.label(label).on_hover_text(tip);
    let response = add(ui).labelled_by(title.id).on_hover_text(tip);
    ui.end_row();
    response
}

/// Names a widget that has no label of its own, or only a glyph, for those who can't see it.
pub fn name(response: &Response, name: &str) {
    response.ctx.accesskit_node_builder(response.id, |node| node.set_label(name));
}

/// A grid of rows.
pub fn rows(ui: &mut Ui, id: &str, add: impl FnOnce(&mut Ui)) {
    egui::Grid::new(id).num_columns(2).spacing([8.0, 4.0]).show(ui, add);
}

/// A slider over a whole number; logarithmic if the range is wide.
pub fn integer(ui: &mut Ui, label: &str, tip: &str, value: &mut i64, range: RangeInclusive<i64>) -> bool {
    let wide = *range.end() > 1000;
    row(ui, label, tip, |ui| {
        ui.add(egui::Slider::new(value, range).logarithmic(wide).integer().clamping(SliderClamping::Edits))
    })
    .changed()
}

/// A slider over a number with a unit.
pub fn real(ui: &mut Ui, label: &str, tip: &str, value: &mut f64, range: RangeInclusive<f64>, unit: &str) -> bool {
    let wide = *range.start() > 0.0 && range.end() / range.start() > 100.0;
    // Only edits are clamped and rounded: a value that was set elsewhere is shown as it is.
    let slider = egui::Slider::new(value, range).logarithmic(wide).suffix(unit).clamping(SliderClamping::Edits);
    row(ui, label, tip, |ui| ui.add(slider)).changed()
}

/// How a limit is shown.
pub struct Limit {
    /// Tooltip.
    pub tip: &'static str,
    /// Its value when it is switched on.
    pub first: f64,
    /// From the value to what is shown.
    pub factor: f64,
    /// Unit behind it.
    pub unit: &'static str,
}

/// A limit that can be off.
pub fn limit(ui: &mut Ui, label: &str, value: &mut Option<f64>, Limit { tip, first, factor, unit }: Limit) {
    let title = ui.label(label).on_hover_text(tip);
    ui.horizontal(|ui| {
        let mut on = value.is_some();
        if ui.checkbox(&mut on, "").labelled_by(title.id).on_hover_text(tip).changed() {
            *value = on.then_some(first);
        }
        let Some(value) = value else { return };
        let mut shown = *value * factor;
        let speed = shown * 0.01;
        let drag = DragValue::new(&mut shown).speed(speed).range(1e-3..=1e6).suffix(unit);
        let response = ui.add(drag).on_hover_text(tip);
        name(&response, &format!("{label}, limit"));
        if response.changed() {
            *value = shown / factor;
        }
    });
    ui.end_row();
}

/// Three numbers side by side.
pub fn vector(
    ui: &mut Ui,
    label: &str,
    tip: &str,
    value: &mut [f64; 3],
    speed: f64,
    range: RangeInclusive<f64>,
) -> bool {
    let mut changed = false;
    ui.label(label).on_hover_text(tip);
    ui.horizontal(|ui| {
        for (axis, x) in ["x", "y", "z"].iter().zip(value.iter_mut()) {
            let drag = DragValue::new(x).speed(speed).range(range.clone()).max_decimals(4);
            let response = ui.add(drag).on_hover_text(format!("{label}, {axis}: {tip}"));
            name(&response, &format!("{label} {axis}"));
            changed |= response.changed();
        }
    });
    ui.end_row();
    changed
}

/// Three channels side by side.
pub fn channels(ui: &mut Ui, label: &str, tip: &str, value: &mut [f64; 3], range: RangeInclusive<f64>) -> bool {
    let mut changed = false;
    ui.label(label).on_hover_text(tip);
    ui.horizontal(|ui| {
        for (channel, x) in ["red", "green", "blue"].iter().zip(value.iter_mut()) {
            let speed = (x.abs() * 0.01).max(0.005);
            let drag = DragValue::new(x).speed(speed).range(range.clone()).max_decimals(4);
            let response = ui.add(drag).on_hover_text(format!("{label}, {channel}: {tip}"));
            name(&response, &format!("{label} {channel}"));
            changed |= response.changed();
        }
    });
    ui.end_row();
    changed
}

/// A choice among names.
pub fn choice(ui: &mut Ui, label: &str, tip: &str, value: &mut String, all: &[&str]) -> bool {
    let before = value.clone();
    let title = ui.label(label).on_hover_text(tip);
    let response = egui::ComboBox::from_id_salt(label).selected_text(value.as_str()).show_ui(ui, |ui| {
        for option in all {
            ui.selectable_value(value, (*option).to_owned(), *option);
        }
    });
    response.response.labelled_by(title.id).on_hover_text(tip);
    ui.end_row();
    before != *value
}

/// A square of a colour.
pub fn swatch(ui: &mut Ui, color: egui::Color32) {
    let (rect, _) = ui.allocate_exact_size(egui::vec2(10.0, 10.0), egui::Sense::hover());
    ui.painter().rect_filled(rect, 1.0, color);
}

/// A fact: label and text in the fixed-width face.
pub fn fact(ui: &mut Ui, label: &str, text: impl Into<String>) {
    ui.label(label);
    ui.label(mono(text));
    ui.end_row();
}
