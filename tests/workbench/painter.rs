//! Plain egui widgets, so that a change of the painter or of egui is seen apart from a change of the workbench.

use super::renderer::{check, harness};
use egui::{Color32, ColorImage, Frame, RichText, ScrollArea, Sense, Stroke, TextureHandle, TextureOptions, Ui, Vec2};

/// In points; the harness leaves a margin of eight on each side.
const SIZE: [f32; 2] = [256.0, 196.0];

fn widgets(ui: &mut Ui) {
    for size in [9.0, 12.5, 18.0, 26.0] {
        ui.label(RichText::new(format!("Caustic at {size} points")).size(size));
    }
    ui.label(RichText::new("fn radiance(x: Vec3) -> f32").monospace());
    ui.add(egui::Slider::new(&mut 40.0, 0.0..=100.0).text("Photons"));
    ui.horizontal(|ui| {
        ui.checkbox(&mut true, "Footprints");
        ui.checkbox(&mut false, "Bounds");
        let _ = ui.button("Step");
    });
    ui.horizontal(|ui| {
        let _ = ui.radio(true, "Exact");
        ui.add(egui::ProgressBar::new(0.6).desired_width(90.0).text("60 %"));
        curves(ui);
    });
}

/// Thin and thick lines, a disc and a ring: what feathering has to make smooth.
fn curves(ui: &mut Ui) {
    let (rect, _) = ui.allocate_exact_size(Vec2::new(60.0, 20.0), Sense::hover());
    let painter = ui.painter_at(rect);
    let stroke = |width| Stroke::new(width, Color32::LIGHT_BLUE);
    painter.line_segment([rect.left_bottom(), rect.left_top() + Vec2::new(20.0, 0.0)], stroke(1.0));
    painter
        .line_segment([rect.left_bottom() + Vec2::new(8.0, 0.0), rect.left_top() + Vec2::new(28.0, 6.0)], stroke(2.5));
    painter.circle_filled(rect.center() + Vec2::new(8.0, 0.0), 7.0, Color32::from_rgb(200, 90, 40));
    painter.circle_stroke(rect.center() + Vec2::new(22.0, 0.0), 6.5, stroke(1.0));
}

/// A checkerboard of single texels with a ramp of colour over it.
fn checkerboard() -> ColorImage {
    let level = |x: usize, y: usize| if (x + y).is_multiple_of(2) { 40 + 12 * x as u8 } else { 20 };
    let pixels = (0..8).flat_map(|y| (0..12).map(move |x| Color32::from_rgb(level(x, y), 30 * y as u8, 90))).collect();
    ColorImage::new([12, 8], pixels)
}

/// A translucent window over one image, filtered in two ways.
fn window_over_image(ui: &mut Ui, textures: &mut Vec<TextureHandle>) {
    if textures.is_empty() {
        for (name, options) in [("nearest", TextureOptions::NEAREST), ("linear", TextureOptions::LINEAR)] {
            textures.push(ui.ctx().load_texture(name, checkerboard(), options));
        }
    }
    ui.horizontal(|ui| {
        ui.spacing_mut().item_spacing = Vec2::ZERO;
        for texture in textures.iter() {
            ui.add(egui::Image::new((texture.id(), Vec2::new(120.0, 180.0))).alt_text("checkerboard"));
        }
    });
    let fill = ui.style().visuals.window_fill.gamma_multiply(0.7);
    let frame = Frame::window(ui.style()).fill(fill);
    egui::Window::new("Inspector").frame(frame).fixed_pos([45.0, 35.0]).fixed_size([160.0, 80.0]).show(ui, |ui| {
        ui.label("A veil of seven tenths.");
        ui.separator();
        ui.hyperlink_to("Pedersen 2011", "https://example.org");
    });
}

fn scrolled(ui: &mut Ui) {
    ui.label("Cut above and below:");
    ScrollArea::both().max_height(93.0).max_width(151.0).vertical_scroll_offset(27.3).show(ui, |ui| {
        for row in 0..30 {
            let text = RichText::new(format!("row {row} of a table that is wider than its area")).size(15.0);
            ui.add(egui::Label::new(text.background_color(Color32::from_rgb(60, 20, 80))).extend());
        }
    });
    ui.label("Whole again.");
}

#[test]
fn widgets_at_1() {
    check(&mut harness(SIZE, 1.0, widgets), "painter_widgets_1");
}

#[test]
fn widgets_at_1_5() {
    check(&mut harness(SIZE, 1.5, widgets), "painter_widgets_1_5");
}

#[test]
fn window_over_image_at_1() {
    let mut textures = Vec::new();
    check(&mut harness(SIZE, 1.0, |ui| window_over_image(ui, &mut textures)), "painter_window_1");
}

#[test]
fn window_over_image_at_1_5() {
    let mut textures = Vec::new();
    check(&mut harness(SIZE, 1.5, |ui| window_over_image(ui, &mut textures)), "painter_window_1_5");
}

#[test]
fn scroll_area_at_1_5() {
    check(&mut harness(SIZE, 1.5, scrolled), "painter_scroll_1_5");
}
