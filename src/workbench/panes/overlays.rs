//! The overlays with their keys and legends.

use super::Panes;
use crate::workbench::actions::Action;
use crate::workbench::overlays::ALL;
use egui::Ui;

pub(super) fn show(panes: &mut Panes, ui: &mut Ui) {
    for o in ALL {
        let mut on = panes.document.session.overlays.iter().any(|id| id == o.id);
        let text = format!("{} ({})", o.title, o.key.name());
        if ui.checkbox(&mut on, text).on_hover_text(o.legend).changed() {
            panes.desk.ask(Action::Overlay(o.id));
        }
        if on {
            ui.indent(o.id, |ui| ui.weak(o.legend));
        }
    }
}
