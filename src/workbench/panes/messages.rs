//! Messages, until dismissed.

use super::Panes;
use super::widgets::name;
use crate::workbench::actions::Action;
use crate::workbench::bars::gravity_color;
use egui::Ui;

pub(super) fn show(panes: &mut Panes, ui: &mut Ui) {
    if panes.messages.all().is_empty() {
        ui.weak("No messages.");
        return;
    }
    if ui.small_button("Dismiss all").clicked() {
        panes.desk.ask(Action::DismissMessages);
    }
    let mut gone = None;
    for (i, m) in panes.messages.all().iter().enumerate().rev() {
        ui.horizontal_wrapped(|ui| {
            let button = ui.small_button("×");
            name(&button, &format!("Dismiss message {}", i + 1));
            if button.clicked() {
                gone = Some(i);
            }
            let times = if m.times > 1 { format!(" (×{})", m.times) } else { String::new() };
            ui.colored_label(gravity_color(m.gravity), format!("{}{times}", m.text));
        });
    }
    if let Some(i) = gone {
        panes.messages.dismiss(i);
    }
}
