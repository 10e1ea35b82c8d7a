//! Exposure, tone curve, false colour and comparison, the same for all panels.

use super::Panes;
use super::widgets::{choice, name, real, row, rows};
use crate::export::false_color::ColorMap;
use crate::export::session::{Curve, Difference, Mode};
use egui::Ui;

pub(super) fn show(panes: &mut Panes, ui: &mut Ui) {
    let auto_exposure = panes.desk.auto_exposure;
    let session = &mut panes.document.session;
    rows(ui, "tone", |ui| {
        let mut exposure = f64::from(if session.tone.auto { auto_exposure } else { session.tone.exposure });
        if real(ui, "Exposure", "radiance times 2 to this (E, Shift+E)", &mut exposure, -16.0..=16.0, " stops") {
            session.tone.auto = false;
            session.tone.exposure = exposure as f32;
        }
        let mut offset = f64::from(session.tone.offset);
        if real(ui, "Offset", "added after exposure", &mut offset, -1.0..=1.0, "") {
            session.tone.offset = offset as f32;
        }
        let auto = "exposure and range follow the images (A); off locks them";
        let mut follows = session.tone.auto;
        if row(ui, "Automatic", auto, |ui| ui.checkbox(&mut follows, "")).changed() {
            session.tone.auto = follows;
            session.tone.exposure = auto_exposure;
        }
        ui.label("Curve");
        ui.horizontal_wrapped(|ui| {
            for (curve, name, tip) in [
                (Curve::Srgb, "sRGB", "IEC 61966-2-1, cut at white"),
                (Curve::Gamma, "gamma", "power of 1/2.2, cut at white"),
                (Curve::Linear, "linear", "as it is, cut at white"),
                (Curve::Reinhard, "Reinhard", "x/(1 + x) by luminance, then sRGB (Reinhard et al. 2002, eq. 3)"),
            ] {
                ui.selectable_value(&mut session.tone.curve, curve, name).on_hover_text(tip);
            }
        });
        ui.end_row();
    });
    rows(ui, "false colour", |ui| {
        let names: Vec<&str> = std::iter::once("none").chain(ColorMap::ALL.map(ColorMap::name)).collect();
        let mut shown = session.tone.false_color.clone().unwrap_or_else(|| "none".into());
        let tip = "luminance by a scale of colours (M); heatmaps and differences take the same scale";
        if choice(ui, "False colour", tip, &mut shown, &names) {
            session.tone.false_color = (shown != "none").then_some(shown);
        }
        if !session.tone.auto {
            let mut range = session.tone.range.unwrap_or([0.0, libm::exp2f(-session.tone.exposure)]);
            let mut changed = false;
            ui.label("Range").on_hover_text("values at the ends of the colour bar");
            ui.horizontal(|ui| {
                for (value, end) in range.iter_mut().zip(["low", "high"]) {
                    let speed = f64::from(value.abs().max(1e-3)) * 0.01;
                    let response = ui.add(egui::DragValue::new(value).speed(speed));
                    name(&response, &format!("Range {end}"));
                    changed |= response.changed();
                }
            });
            ui.end_row();
            if changed {
                session.tone.range = Some(range);
            }
        }
    });
    ui.separator();
    let names: Vec<String> = session.panels.iter().map(super::image::title).collect();
    rows(ui, "comparison", |ui| {
        ui.label("Mode");
        ui.horizontal(|ui| {
            for (mode, name) in [(Mode::Grid, "grid"), (Mode::Split, "split"), (Mode::Difference, "difference")] {
                ui.selectable_value(&mut session.comparison.mode, mode, name);
            }
        });
        ui.end_row();
        let label = ui.label("Against");
        let with = session.comparison.with;
        let shown = with.and_then(|i| names.get(i)).map_or("reference", String::as_str);
        let side = egui::ComboBox::from_id_salt("against").selected_text(shown).show_ui(ui, |ui| {
            ui.selectable_value(&mut session.comparison.with, None, "reference");
            for (i, name) in names.iter().enumerate() {
                ui.selectable_value(&mut session.comparison.with, Some(i), name);
            }
        });
        side.response.labelled_by(label.id).on_hover_text("the other side of split, of difference, and of B");
        ui.end_row();
        ui.label("Difference");
        ui.horizontal_wrapped(|ui| {
            for (kind, name, tip) in [
                (Difference::Signed, "signed", "x - r, mean of the channels, W/(m² sr)"),
                (Difference::Absolute, "absolute", "|x - r|, mean of the channels, W/(m² sr)"),
                (Difference::Relative, "relative", "(x - r)/(|r| + ε), ε a hundredth of the mean of r"),
                (
                    Difference::Flip,
                    "FLIP",
                    "difference that a person sees when flipping the images (Andersson et al. 2020)",
                ),
            ] {
                ui.selectable_value(&mut session.comparison.difference, kind, name).on_hover_text(tip);
            }
        });
        ui.end_row();
    });
}
