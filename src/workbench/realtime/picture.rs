//! The picture, scaled to its pane, and what is drawn over it.

use super::{LiveView, MOST};
use crate::export::tone::SrgbTable;
use crate::realtime::flashlight::cone_rim;
use crate::scene::{Camera, Light};
use crate::workbench::document::Document;
use crate::workbench::panes::widgets::name;
use crate::workbench::theme;
use egui::{Color32, ColorImage, Pos2, Rect, Sense, Stroke, TextureOptions, Ui, vec2};
use glam::Vec3;
use std::sync::LazyLock;

/// Red of the cones, as in figure 6.9.
const CONE: Color32 = Color32::from_rgb(230, 60, 50);

/// Lines of a cone.
const CONE_LINES: u32 = 16;

/// Length of a cone over the scene's radius.
const CONE_LENGTH: f32 = 0.35;

/// Yaw and pitch for a drag over the height of the picture, radians.
const DRAG: f64 = 1.2;

static SRGB: LazyLock<SrgbTable> = LazyLock::new(SrgbTable::new);

impl LiveView {
    pub(super) fn picture(&mut self, ui: &mut Ui, document: &mut Document) {
        let available = ui.available_size().max(vec2(32.0, 24.0));
        let (rect, response) = ui.allocate_exact_size(available, Sense::click_and_drag());
        name(&response, "Real-time picture");
        let scale = ui.ctx().pixels_per_point();
        self.pane = [available.x, available.y].map(|x| (x * scale).clamp(16.0, MOST) as u32);
        ui.painter().rect_filled(rect, 0.0, theme::SURROUND);
        if response.dragged() {
            let by = response.drag_delta() / rect.height().max(1.0);
            self.walk(document, [0.0; 3], [-f64::from(by.x) * DRAG, f64::from(by.y) * DRAG]);
        }
        if response.hovered() {
            let wheel = ui.input(|i| i.smooth_scroll_delta().y);
            if wheel != 0.0 {
                self.speed = (self.speed * libm::exp(f64::from(wheel) * 0.002)).clamp(0.05, 20.0);
            }
        }
        self.upload(ui.ctx());
        let Some(frame) = &self.last else {
            ui.painter().text(
                rect.center(),
                egui::Align2::CENTER_CENTER,
                "refining the mesh …",
                egui::FontId::proportional(16.0),
                Color32::from_gray(200),
            );
            return;
        };
        let shown = fitted(rect, frame.image.size);
        if let Some(texture) = &self.texture {
            let uv = Rect::from_min_max(Pos2::ZERO, Pos2::new(1.0, 1.0));
            ui.painter().image(texture.id(), shown, uv, Color32::WHITE);
        }
        let painter = ui.painter().with_clip_rect(shown);
        let place = |p: Vec3| on_screen(&frame.camera, frame.image.size, shown, p);
        if self.show_photons {
            let oldest = frame.photons.iter().map(|p| p.age).max().unwrap_or(0).max(1);
            for p in frame.photons.iter().rev() {
                if let Some(at) = place(p.position) {
                    painter.circle_filled(at, 1.5, age_color(p.age as f32 / oldest as f32));
                }
            }
        }
        if self.show_cone {
            let length = document.scene().radius * CONE_LENGTH;
            for light in &frame.lights {
                let Light::Spot { position, .. } = light else { continue };
                let rim = cone_rim(light, length, CONE_LINES);
                for (i, p) in rim.iter().enumerate() {
                    let next = rim[(i + 1) % rim.len()];
                    for (from, to) in [(*position, *p), (*p, next)] {
                        segment(&painter, &frame.camera, &place, from, to);
                    }
                }
            }
        }
    }

    /// Brings the texture up to date with the last frame.
    fn upload(&mut self, context: &egui::Context) {
        let Some(frame) = &self.last else { return };
        let key = (frame.version, frame.report.frame, self.exposure.to_bits());
        if self.shown == key && self.texture.is_some() {
            return;
        }
        let table = &*SRGB;
        let pixels = frame.image.pixels.iter().map(|p| {
            let [r, g, b] = (*p * self.exposure).to_array().map(|c| table.byte(c));
            Color32::from_rgb(r, g, b)
        });
        let image = ColorImage::new(frame.image.size.map(|n| n as usize), pixels.collect());
        match &mut self.texture {
            Some(texture) => texture.set(image, TextureOptions::LINEAR),
            None => self.texture = Some(context.load_texture("realtime", image, TextureOptions::LINEAR)),
        }
        self.shown = key;
    }
}

/// The largest rectangle of an image's shape in the middle of a pane.
fn fitted(pane: Rect, size: [u32; 2]) -> Rect {
    let [w, h] = size.map(|s| s.max(1) as f32);
    let scale = (pane.width() / w).min(pane.height() / h);
    Rect::from_center_size(pane.center(), vec2(w, h) * scale)
}

fn on_screen(camera: &Camera, size: [u32; 2], shown: Rect, p: Vec3) -> Option<Pos2> {
    let [x, y] = camera.project(p, size)?;
    let at = shown.min + vec2(x / size[0].max(1) as f32 * shown.width(), y / size[1].max(1) as f32 * shown.height());
    // What is far outside would only be cut off.
    (at.x.abs() < 1e5 && at.y.abs() < 1e5).then_some(at)
}

/// A line between two points, cut off at the eye's plane.
fn segment(painter: &egui::Painter, camera: &Camera, place: &impl Fn(Vec3) -> Option<Pos2>, from: Vec3, to: Vec3) {
    let depth = |p: Vec3| (p - camera.position).dot(camera.frame[2]);
    let near = 1e-3 * (to - from).length();
    let (mut a, mut b) = (from, to);
    let (da, db) = (depth(a), depth(b));
    if da < near && db < near {
        return;
    }
    if da < near {
        a = a.lerp(b, (near - da) / (db - da));
    } else if db < near {
        b = b.lerp(a, (near - db) / (da - db));
    }
    if let (Some(a), Some(b)) = (place(a), place(b)) {
        painter.line_segment([a, b], Stroke::new(1.5, CONE));
    }
}

/// Yellow for 0, new, to blue for 1, old.
fn age_color(age: f32) -> Color32 {
    let c = colorous::PLASMA.eval_continuous(f64::from(1.0 - age.clamp(0.0, 1.0)) * 0.9 + 0.1);
    Color32::from_rgb(c.r, c.g, c.b)
}
