//! The parameters of chapter 6 and ours, as sliders, switches and choices.

use crate::realtime::RealtimeSettings;
use crate::realtime::photon::Photon;
use crate::realtime::settings::{PARAMETERS, Parameter, Values, photon_count, set};
use crate::scene::memory;
use crate::scene::scene_file::RealtimeFile;
use crate::workbench::document::Document;
use crate::workbench::panes::widgets::{choice, integer, real, row, rows};
use egui::{Color32, RichText, Ui};

/// Groups of the list: title, and the numbers of chapter 6 that it holds; ours last.
const GROUPS: [(&str, std::ops::RangeInclusive<u32>); 4] =
    [("Scene", 1..=3), ("Photon map", 4..=8), ("Photon tracing", 9..=16), ("Beyond chapter 6", 0..=0)];

/// Photons from which the count is shown as a warning.
const MANY: u64 = 1_000_000;

/// Ends of sliders; larger values can be typed.
const FAR: i64 = 100_000;

pub(super) fn ui(ui: &mut Ui, document: &mut Document) {
    let scene = std::sync::Arc::clone(document.scene());
    let Ok(settings) = RealtimeSettings::new(&scene, &document.session.realtime, document.session.seed) else {
        return;
    };
    let count = photon_count(&settings);
    ui.horizontal_wrapped(|ui| {
        let text = format!("up to {count} photons in the map");
        let text = if count > MANY { RichText::new(text).color(Color32::from_rgb(255, 150, 80)) } else { text.into() };
        ui.label(text).on_hover_text(
            "figure 4.3: photons_from_light · accumulation_frames · snowball_size · (direct + the sum of diffuse_reflections to each level)",
        );
        // In its store, in the trees' order, and a tree over them.
        let bytes = memory::bytes(count, 2 * size_of::<Photon>() + 24);
        ui.weak(memory::text(bytes));
        let own = document.session.realtime != RealtimeFile::default();
        if ui.add_enabled(own, egui::Button::new("reset")).on_hover_text("the scene's own parameters").clicked() {
            document.session.realtime = RealtimeFile::default();
        }
    });
    let Ok(shown) = serde_json::to_value(&settings) else { return };
    for (title, numbers) in GROUPS {
        egui::CollapsingHeader::new(title).default_open(title != "Beyond chapter 6").show(ui, |ui| {
            rows(ui, title, |ui| {
                for p in PARAMETERS.iter().filter(|p| numbers.contains(&p.number.unwrap_or(0))) {
                    if let Some(value) = edit(ui, p, &shown[p.name], scene.radius) {
                        // The widget keeps to the range; what cannot be is refused when the session is settled.
                        let _ = set(&mut document.session.realtime, &format!("{}={value}", p.name));
                    }
                }
            });
        });
    }
}

/// Draws a parameter; its new value as text, if it was changed.
fn edit(ui: &mut Ui, p: &Parameter, value: &serde_json::Value, radius: f32) -> Option<String> {
    let tip = match p.number {
        Some(n) => format!("parameter {n} of chapter 6: {}", p.what),
        None => p.what.to_owned(),
    };
    match p.values {
        Values::Switch => {
            let mut on = value.as_bool().unwrap_or(false);
            row(ui, p.name, &tip, |ui| ui.checkbox(&mut on, "")).changed().then(|| on.to_string())
        }
        Values::Integer(low, high) => {
            let mut n = value.as_i64().unwrap_or(low);
            integer(ui, p.name, &tip, &mut n, low..=high.min(FAR)).then(|| n.to_string())
        }
        Values::Number(high) => {
            let mut x = value.as_f64().unwrap_or(high);
            // A length, or a share.
            let (range, unit) = if high > 1.0 {
                let r = f64::from(radius);
                (r * 1e-3..=r * 2.0, " m")
            } else {
                (1e-3..=1.0, "")
            };
            real(ui, p.name, &tip, &mut x, range, unit).then(|| x.to_string())
        }
        Values::Words(words) => {
            let mut word = value.as_str().unwrap_or("").to_owned();
            choice(ui, p.name, &tip, &mut word, words).then_some(word)
        }
    }
}
