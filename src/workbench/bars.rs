//! The bar above: menus, scene, pass, photons, mode. The bar below: readout and messages.

use super::actions::{Action, Menu, entries};
use super::desk::Desk;
use super::document::Document;
use super::gallery::Gallery;
use super::layout::{self, Pane};
use super::messages::{Gravity, Messages};
use super::panes::widgets::name;
use super::render::Render;
use super::theme::{count, mono, number};
use crate::estimate::registry::{ESTIMATORS, short_name};
use crate::export::session::{Mode, Rendering};
use crate::math::rgb::luminance;
use crate::render::StoppedBy;
use crate::scene::built_in::BUILT_IN;
use egui::{Color32, Panel, Ui};
use egui_tiles::Tree;
use std::fmt::Write;

/// Draws the upper bar.
pub fn top(ui: &mut Ui, document: &Document, render: &Render, desk: &mut Desk) {
    Panel::top("top").show(ui, |ui| {
        ui.horizontal_wrapped(|ui| {
            for (menu, title) in [
                (Menu::File, "File"),
                (Menu::Edit, "Edit"),
                (Menu::Render, "Render"),
                (Menu::View, "View"),
                (Menu::Overlays, "Overlays"),
                (Menu::Help, "Help"),
            ] {
                ui.menu_button(title, |ui| menu_ui(ui, menu, document, desk));
            }
            ui.separator();
            scene_box(ui, document, desk);
            let live = document.session.rendering == Rendering::Realtime;
            for (title, on) in [("progressive", !live), ("real-time", live)] {
                let tip = "passes that are averaged, or the frame loop of real-time photon mapping (F5)";
                if ui.selectable_label(on, title).on_hover_text(tip).clicked() && !on {
                    desk.ask(Action::SwitchRendering);
                }
            }
            ui.separator();
            // What follows belongs to the progressive view.
            if live {
                return;
            }
            let paused = render.is_paused();
            let pause = ui.button(if paused { "go on" } else { "pause" });
            if pause.on_hover_text("pause or go on (Space)").clicked() {
                desk.ask(Action::Pause);
            }
            if ui.button("tile").on_hover_text("render one tile, then pause (.)").clicked() {
                desk.ask(Action::StepTile);
            }
            if ui.button("pass").on_hover_text("render to the end of a pass, then pause (,)").clicked() {
                desk.ask(Action::StepPass);
            }
            ui.separator();
            // As a whole on the next row if it does not fit.
            ui.add(egui::Label::new(mono(progress(render, desk))).extend());
            ui.separator();
            for (mode, title, action) in [
                (Mode::Grid, "grid", Action::Grid),
                (Mode::Split, "split", Action::Split),
                (Mode::Difference, "difference", Action::Difference),
            ] {
                if ui.selectable_label(document.session.comparison.mode == mode, title).clicked() {
                    desk.ask(action);
                }
            }
            let shown = if desk.flipped { "B" } else { "A" };
            ui.label(mono(shown)).on_hover_text("hold B to see the other side in every panel");
        });
    });
}

fn menu_ui(ui: &mut Ui, menu: Menu, document: &Document, desk: &mut Desk) {
    for e in entries().into_iter().filter(|e| e.menu == menu) {
        let mut button = egui::Button::new(e.title);
        if let Some(shortcut) = e.shortcut {
            button = button.shortcut_text(ui.ctx().format_shortcut(&shortcut));
        }
        if let Action::Overlay(id) = &e.action {
            button = button.selected(document.session.overlays.iter().any(|o| o == id));
        }
        let enabled = match e.action {
            Action::Undo => document.history().can_undo(),
            Action::Redo => document.history().can_redo(),
            _ => true,
        };
        if ui.add_enabled(enabled, button).clicked() {
            desk.ask(e.action);
            ui.close();
        }
    }
    if menu == Menu::File {
        ui.separator();
        ui.menu_button("Recent", |ui| recent_ui(ui, desk));
    }
    if menu == Menu::View {
        ui.separator();
        for e in ESTIMATORS {
            if ui.button(format!("Add a panel: {}", e.id)).on_hover_text(e.summary).clicked() {
                desk.ask(Action::AddPanel(e.id.to_owned()));
                ui.close();
            }
        }
    }
}

fn recent_ui(ui: &mut Ui, desk: &mut Desk) {
    for name in desk.recent.names().to_vec() {
        if ui.button(&name).clicked() {
            desk.ask(Action::OpenFile(name));
            ui.close();
        }
    }
}

fn scene_box(ui: &mut Ui, document: &Document, desk: &mut Desk) {
    let scene = &document.session.scene;
    let changed = if document.is_changed() { " *" } else { "" };
    let response = egui::ComboBox::from_id_salt("scene").selected_text(format!("{scene}{changed}")).show_ui(ui, |ui| {
        for b in BUILT_IN {
            if ui.selectable_label(b.name == scene, b.name).on_hover_text(b.purpose).clicked() {
                desk.ask(Action::OpenScene(b.name.to_owned()));
            }
        }
    });
    name(&response.response, "Scene");
}

/// How far the render is, as in `pass 12 / 3.4 s   2.4 M photons (18 k caustic)`.
fn progress(render: &Render, desk: &Desk) -> String {
    let mut text = String::new();
    // Writing to a string cannot fail.
    if let Some(p) = &render.progress {
        let s = &p.seconds;
        let total = s.photon_trace + s.map_build + s.view_trace + s.gather + s.estimate + s.final_gather;
        let _ = write!(text, "pass {} / {}", p.passes.iter().min().unwrap_or(&0), desk.seconds(total));
        let _ = write!(text, "   photons {}", count(p.emitted));
        for (n, kind) in [(p.stored.direct, "direct"), (p.stored.caustic, "caustic"), (p.stored.global, "global")] {
            if n > 0 {
                let _ = write!(text, " ({} {kind})", count(n));
            }
        }
    } else {
        let _ = write!(text, "{} {:2.0} %", if render.draft { "draft" } else { "pass 1:" }, 100.0 * render.part());
    }
    if !render.is_alive() {
        text.push_str("   stopped");
    } else if render.finished {
        text.push_str(match render.stopped_by {
            Some(StoppedBy::Error) => "   done: error reached",
            Some(StoppedBy::Seconds) => "   done: time is up",
            Some(StoppedBy::Passes | StoppedBy::Interruption) | None => "   done",
        });
    } else if render.is_paused() {
        text.push_str("   paused");
    }
    text
}

/// Draws the lower bar.
pub fn status(
    ui: &mut Ui,
    document: &Document,
    gallery: &Gallery,
    render: &Render,
    messages: &Messages,
    desk: &mut Desk,
    tree: &mut Tree<Pane>,
) {
    Panel::bottom("status").show(ui, |ui| {
        ui.horizontal(|ui| {
            match readout(document, gallery, render, desk) {
                _ if document.session.rendering == Rendering::Realtime => {
                    ui.weak("W A S D and the arrows walk, Space plays, F5 goes back to the progressive view.")
                }
                Some(text) => ui.label(mono(text)),
                None if render.progress.is_none() && messages.all().is_empty() => {
                    ui.weak("Hover a pixel, click to pin it, hold B to compare; Ctrl+P lists every action.")
                }
                None => ui.weak("Hover a pixel for its values; click to see why it has them."),
            };
            ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
                if let Some(m) = messages.gravest() {
                    let text = egui::RichText::new(&m.text).color(gravity_color(m.gravity));
                    let button = egui::Button::new(text).frame(false).truncate();
                    if ui.add(button).on_hover_text("see all messages").clicked() {
                        layout::show(tree, Pane::Messages);
                    }
                }
            });
        });
    });
}

/// Colour of a message.
pub fn gravity_color(gravity: Gravity) -> Color32 {
    match gravity {
        Gravity::Note => Color32::from_gray(180),
        Gravity::Warning => Color32::from_rgb(235, 190, 80),
        Gravity::Error => Color32::from_rgb(255, 120, 100),
    }
}

/// The surface that a pixel sees first: its material, and where it lies in the scene's own coordinates.
fn place(render: &Render, pixel: [u32; 2]) -> Option<String> {
    let pass = render.current_pass()?;
    let seen = crate::render::inspect::view_path(pass, pixel).ok()?;
    let Some(first) = seen.first() else { return Some("nothing".into()) };
    let at = first.position.as_dvec3() + pass.scene.origin;
    let [x, y, z] = at.to_array().map(number);
    let name = pass.scene.material_names.get(first.material as usize).map_or("", String::as_str);
    Some(format!("{} {name} at {x} {y} {z} m", first.surface.name()))
}

/// The values of all panels under the pointer, or at the pin without one.
pub fn readout(document: &Document, gallery: &Gallery, render: &Render, desk: &Desk) -> Option<String> {
    let pixel = desk.hover.map(|h| h.pixel).or_else(|| document.session.pins.last().copied())?;
    let mut text = format!("{}, {}", pixel[0], pixel[1]);
    if let Some(place) = place(render, pixel) {
        let _ = write!(text, "  {place}");
    }
    for (i, panel) in document.session.panels.iter().enumerate() {
        let Some(value) = gallery.of(panel).and_then(|i| i.at(pixel)) else { continue };
        let number_of = gallery.values.get(&i).and_then(|v| Some((v.at(pixel)?, v)));
        let name = panel.image.clone().unwrap_or_else(|| short_name(&panel.estimator));
        let [r, g, b] = value.to_array().map(|x| number(f64::from(x)));
        let _ = write!(text, "  {name} {r} {g} {b} Y {}", number(f64::from(luminance(value))));
        if let Some((x, v)) = number_of {
            let _ = write!(
                text,
                " [{} {}{}]",
                v.title,
                number(f64::from(x)),
                if v.unit.is_empty() { String::new() } else { format!(" {}", v.unit) }
            );
        }
    }
    Some(text)
}
