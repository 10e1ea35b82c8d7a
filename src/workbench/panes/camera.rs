//! The camera.

use super::Panes;
use super::widgets::{integer, real, rows, vector};
use egui::Ui;

pub(super) fn show(panes: &mut Panes, ui: &mut Ui) {
    let Some(mut camera) = panes.document.scene_file().camera else { return };
    let radius = f64::from(panes.document.scene().radius);
    let mut changed = false;
    rows(ui, "camera", |ui| {
        changed |= vector(ui, "Position", "of the eye, metres", &mut camera.position, radius * 0.005, -1e6..=1e6);
        changed |= vector(ui, "Target", "point looked at, metres", &mut camera.target, radius * 0.005, -1e6..=1e6);
        changed |= real(ui, "Field of view", "vertical", &mut camera.fov_y, 1.0..=170.0, "°");
        let mut size = panes.document.settings().size.map(i64::from);
        let mut resized = integer(ui, "Width", "of the image, pixels", &mut size[0], 16..=4096);
        resized |= integer(ui, "Height", "of the image, pixels", &mut size[1], 16..=4096);
        if resized {
            panes.document.session.size = Some(size.map(|n| n as u32));
        }
    });
    if changed {
        panes.document.session.camera = Some(camera);
    }
    let reset = ui.button("Reset the camera").on_hover_text("to that of the scene file");
    if reset.clicked() {
        panes.document.session.camera = None;
        panes.document.session.size = None;
    }
    ui.weak("Drag an image with the right button to orbit, with Shift to move sideways, with Ctrl to come nearer.");
}
