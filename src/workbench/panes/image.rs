//! An image panel: one estimator's image, linked with all the others.

use super::{Panes, overlay};
use crate::export::false_color::ValueRange;
use crate::export::session::{Curve, Mode, Panel, Tone};
use crate::export::tone::SrgbTable;
use crate::render::film::Rect as PixelRect;
use crate::render::tiles::tiles;
use crate::workbench::actions::Action;
use crate::workbench::desk::Hover;
use crate::workbench::gallery::image::{LiveImage, Tile};
use crate::workbench::gallery::shade::{Shade, color_map, luminance_scale};
use crate::workbench::gallery::texture::PanelTexture;
use crate::workbench::theme::{self, mono, number};
use crate::workbench::viewport::Viewport;
use egui::{Align2, Color32, FontId, Rect, Sense, Stroke, Ui, pos2, vec2};
use std::sync::{Arc, LazyLock};

static SRGB: LazyLock<SrgbTable> = LazyLock::new(SrgbTable::new);

/// Height of the line above an image, points.
const HEADER: f32 = 20.0;

/// What a panel shows, in words.
pub(super) fn title(panel: &Panel) -> String {
    let name = match &panel.image {
        Some(path) => std::path::Path::new(path).file_name().map_or(path.clone(), |n| n.to_string_lossy().into_owned()),
        None => panel.estimator.clone(),
    };
    match &panel.heatmap {
        Some(heatmap) => format!("{name} [{heatmap}]"),
        None => name,
    }
}

/// Draws panel `index`; whether its header is dragged, which moves the panel.
pub(super) fn show(panes: &mut Panes, ui: &mut Ui, index: usize) -> bool {
    let Some(panel) = panes.document.session.panels.get(index).cloned() else { return false };
    let all = ui.available_rect_before_wrap();
    let (header, body) = all.split_top_bottom_at_y(all.top() + HEADER);
    let dragged = show_header(panes, ui, index, &panel, header);
    let response = ui.interact(body, ui.scope_id().with(("image", index)), Sense::click_and_drag());
    response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Image, true, format!("Image of {}", title(&panel))));
    ui.painter().rect_filled(body, 0.0, theme::SURROUND);
    let size = panes.gallery.of(&panel).map(LiveImage::size);
    let Some(size) = size else {
        ui.painter().text(body.center(), Align2::CENTER_CENTER, "no image", FontId::proportional(14.0), Color32::GRAY);
        return dragged;
    };
    let viewport = Viewport::new(panes.document.session.view, body, size);
    draw(panes, ui, index, &panel, &viewport);
    navigate(panes, ui, index, &viewport, &response);
    dragged
}

fn show_header(panes: &mut Panes, ui: &mut Ui, index: usize, panel: &Panel, rect: Rect) -> bool {
    let names: Vec<&str> = panes.document.session.panels.iter().map(|p| p.estimator.as_str()).collect();
    let color = theme::panel_color(&names, index);
    let response = ui.interact(rect, ui.scope_id().with(("header", index)), Sense::click_and_drag());
    ui.painter().rect_filled(rect, 0.0, Color32::from_gray(34));
    ui.painter().rect_filled(Rect::from_min_size(rect.min, vec2(4.0, rect.height())), 0.0, color);
    let mut right = String::new();
    if let Some(image) = panes.gallery.of(panel) {
        if panel.image.is_none() {
            right = format!("{} pass{}", image.passes, if image.passes == 1 { "" } else { "es" });
        }
        if let Some(e) = panes.desk.error_of(&panel.estimator).filter(|_| panel.image.is_none()) {
            right = format!("err {:.2} %   {right}", 100.0 * e.error.relative_rmse);
        }
    }
    let font = FontId::monospace(12.0);
    let right_rect = ui.painter().text(
        rect.right_center() - vec2(6.0, 0.0),
        Align2::RIGHT_CENTER,
        &right,
        font.clone(),
        Color32::from_gray(190),
    );
    let clip = Rect::from_min_max(rect.min, pos2(right_rect.left() - 8.0, rect.bottom()));
    ui.painter().with_clip_rect(clip).text(
        rect.left_center() + vec2(10.0, 0.0),
        Align2::LEFT_CENTER,
        title(panel),
        font,
        Color32::from_gray(225),
    );
    if response.double_clicked() {
        panes.desk.ask(Action::Maximize(index));
    }
    response.context_menu(|ui| {
        if ui.button("Fill the middle").clicked() {
            panes.desk.ask(Action::Maximize(index));
            ui.close();
        }
        if ui.button("Compare the others with this").clicked() {
            panes.desk.ask(Action::CompareWith(Some(index)));
            ui.close();
        }
        if ui.button("Remove").clicked() {
            panes.desk.ask(Action::RemovePanel(index));
            ui.close();
        }
    });
    response.clone().on_hover_ui(|ui| {
        ui.label(mono(title(panel)));
        ui.weak("relative RMSE against the reference; drag to dock it elsewhere, double click to fill the middle");
    });
    response.drag_started()
}

/// Brings the panel's texture up to date and draws it with what lies over it.
fn draw(panes: &mut Panes, ui: &mut Ui, index: usize, panel: &Panel, viewport: &Viewport) {
    let painter = ui.painter().with_clip_rect(viewport.panel);
    update_texture(panes, ui.ctx(), index, panel);
    let session = &panes.document.session;
    let other = match session.comparison.with {
        Some(i) => panes.gallery.textures.get(i).and_then(|t| t.id()),
        None => panes.gallery.reference_texture.id(),
    };
    let whole = Rect::from_min_max(pos2(0.0, 0.0), pos2(1.0, 1.0));
    let texture = |i: usize| panes.gallery.textures.get(i).and_then(|t| t.id());
    let own = if panes.desk.flipped { other.or(texture(index)) } else { texture(index) };
    if let Some(id) = own {
        painter.image(id, viewport.image(), whole, Color32::WHITE);
    }
    if session.comparison.mode == Mode::Split
        && let Some(id) = other
    {
        let divider = session.comparison.divider.clamp(0.0, 1.0);
        let mut right = viewport.image();
        right.min.x = viewport.image().left() + viewport.image().width() * divider;
        painter.image(id, right, Rect::from_min_max(pos2(divider, 0.0), pos2(1.0, 1.0)), Color32::WHITE);
        painter.vline(right.left(), viewport.image().y_range(), Stroke::new(1.0, Color32::WHITE));
    }
    if let Some(image) = panes.gallery.of(panel) {
        for (rect, tile, _) in image.tiles().filter(|t| t.1 == Tile::Stale) {
            debug_assert!(tile == Tile::Stale);
            let min = viewport.to_screen(rect.x as f32, rect.y as f32);
            let max = viewport.to_screen((rect.x + rect.width) as f32, (rect.y + rect.height) as f32);
            painter.rect_filled(Rect::from_min_max(min, max), 0.0, theme::STALE);
        }
    }
    for (i, pin) in session.pins.iter().enumerate() {
        let last = i + 1 == session.pins.len();
        let rect = Rect::from_min_max(
            viewport.to_screen(pin[0] as f32, pin[1] as f32),
            viewport.to_screen((pin[0] + 1) as f32, (pin[1] + 1) as f32),
        );
        let color = if last { Color32::WHITE } else { Color32::from_gray(170) };
        let rect = rect.expand((4.0 - rect.width() / 2.0).max(1.0));
        painter.rect_stroke(rect, 0.0, Stroke::new(3.0, Color32::BLACK), egui::StrokeKind::Outside);
        painter.rect_stroke(rect, 0.0, Stroke::new(1.0, color), egui::StrokeKind::Outside);
    }
    let inside = painter.with_clip_rect(viewport.panel.intersect(viewport.image()));
    overlay::draw(panes, &inside, index, viewport);
    color_bar(panes, &painter, index, viewport);
    let session = &panes.document.session;
    if let Some([x, y, w, h]) = session.crop {
        let min = viewport.to_screen(x as f32, y as f32);
        let max = viewport.to_screen((x + w) as f32, (y + h) as f32);
        painter.rect_stroke(
            Rect::from_min_max(min, max),
            0.0,
            Stroke::new(1.0, Color32::from_rgb(255, 220, 90)),
            egui::StrokeKind::Outside,
        );
    }
}

/// Range of the colours of a panel's numbers: as locked, or that of all panels that show the same.
fn values_range(panes: &Panes, index: usize) -> ValueRange {
    let tone = &panes.document.session.tone;
    match tone.range.filter(|_| !tone.auto) {
        Some([low, high]) => ValueRange { low, high },
        None => panes.gallery.range_of(index).unwrap_or(ValueRange::up_to(1.0)),
    }
}

/// The bar that says which colour is which value, where colours stand for values.
fn color_bar(panes: &Panes, painter: &egui::Painter, index: usize, viewport: &Viewport) {
    let tone = &panes.document.session.tone;
    let exposure = if tone.auto { panes.desk.auto_exposure } else { tone.exposure };
    let (scale, title, unit) = match panes.gallery.values.get(&index) {
        Some(v) => (v.scale(color_map(tone.false_color.as_deref()), values_range(panes, index)), v.title, v.unit),
        None => match luminance_scale(tone, exposure) {
            Some(scale) => (scale, "luminance", "W/(m² sr)"),
            None => return,
        },
    };
    let width = (viewport.panel.width() - 24.0).clamp(40.0, 220.0);
    let frame = Rect::from_min_size(viewport.panel.left_bottom() + vec2(8.0, -44.0), vec2(width + 8.0, 38.0));
    painter.rect_filled(frame, 2.0, Color32::from_black_alpha(170));
    let bar = Rect::from_min_size(frame.min + vec2(4.0, 16.0), vec2(width, 8.0));
    let range = scale.range();
    let mut mesh = egui::Mesh::default();
    for i in 0..=64u32 {
        let t = i as f32 / 64.0;
        let [r, g, b] = scale.color(range.low * (1.0 - t) + range.high * t);
        let x = bar.left() + t * bar.width();
        mesh.colored_vertex(pos2(x, bar.top()), Color32::from_rgb(r, g, b));
        mesh.colored_vertex(pos2(x, bar.bottom()), Color32::from_rgb(r, g, b));
        if i > 0 {
            mesh.add_triangle(2 * i - 2, 2 * i - 1, 2 * i);
            mesh.add_triangle(2 * i - 1, 2 * i, 2 * i + 1);
        }
    }
    painter.add(egui::Shape::mesh(mesh));
    let text = |at, align, text: String| {
        painter.text(at, align, text, FontId::monospace(10.0), Color32::from_gray(230));
    };
    text(
        frame.min + vec2(4.0, 2.0),
        Align2::LEFT_TOP,
        if unit.is_empty() { title.into() } else { format!("{title}, {unit}") },
    );
    text(bar.left_bottom() + vec2(0.0, 1.0), Align2::LEFT_TOP, number(f64::from(range.low)));
    text(bar.right_bottom() + vec2(0.0, 1.0), Align2::RIGHT_TOP, number(f64::from(range.high)));
}

fn update_texture(panes: &mut Panes, context: &egui::Context, index: usize, panel: &Panel) {
    if panes.gallery.textures.len() <= index {
        panes.gallery.textures.resize_with(index + 1, Default::default);
    }
    let (late, started) = (panes.is_late(), panes.started);
    let enough = || late || started.elapsed() > super::TEXTURE_TIME;
    let tone = &panes.document.session.tone;
    let exposure = if tone.auto { panes.desk.auto_exposure } else { tone.exposure };
    let mut texture = std::mem::take(&mut panes.gallery.textures[index]);
    if let Some(values) = panes.gallery.values.get(&index) {
        let scale = values.scale(color_map(tone.false_color.as_deref()), values_range(panes, index));
        let made_of = Arc::as_ptr(&values.values) as usize;
        let key = hash(&format!("{made_of} {:?} {:?}", scale.range(), tone.false_color));
        let tiles = tiles(PixelRect::whole(values.size)).into_iter().map(|rect| (rect, 1));
        let colors = |rect: PixelRect, out: &mut Vec<Color32>| {
            out.extend(values.rows(rect).flatten().map(|x| {
                let [r, g, b] = scale.color(*x);
                Color32::from_rgb(r, g, b)
            }));
        };
        if texture.update(context, values.size, key, tiles, colors, enough) {
            panes.desk.unfinished = true;
        }
    } else if let Some(image) = panes.gallery.of(panel) {
        let shade = Shade::new(tone, exposure);
        let key = key_of(panel, tone, exposure);
        if show_radiance(&mut texture, context, image, &shade, key, enough) {
            panes.desk.unfinished = true;
        }
    }
    panes.gallery.textures[index] = texture;
    update_reference(panes, context, exposure);
}

/// Brings a texture of radiance up to date; whether more is to be done.
fn show_radiance(
    texture: &mut PanelTexture,
    context: &egui::Context,
    image: &LiveImage,
    shade: &Shade,
    key: u64,
    enough: impl FnMut() -> bool,
) -> bool {
    let tiles = image.tiles().map(|(rect, _, version)| (rect, version));
    let colors = |rect, out: &mut Vec<Color32>| {
        out.extend(image.pixels().pieces(rect).flatten().map(|p| shade.color(&SRGB, *p)));
    };
    texture.update(context, image.size(), key, tiles, colors, enough)
}

/// The reference's texture, where something shows it.
fn update_reference(panes: &mut Panes, context: &egui::Context, exposure: f32) {
    let comparison = &panes.document.session.comparison;
    if comparison.with.is_some() || !(panes.desk.flipped || comparison.mode == Mode::Split) {
        return;
    }
    let tone = &panes.document.session.tone;
    let shade = Shade::new(tone, exposure);
    let key = key_of(&Panel::of("reference"), tone, exposure);
    let mut texture = std::mem::take(&mut panes.gallery.reference_texture);
    if let Some(image) = panes.gallery.reference() {
        let (late, started) = (panes.is_late(), panes.started);
        let enough = || late || started.elapsed() > super::TEXTURE_TIME;
        if show_radiance(&mut texture, context, image, &shade, key, enough) {
            panes.desk.unfinished = true;
        }
    }
    panes.gallery.reference_texture = texture;
}

/// A number that differs when anything that decides a panel's colours differs.
fn key_of(panel: &Panel, tone: &Tone, exposure: f32) -> u64 {
    let curve = match tone.curve {
        Curve::Srgb => 0u8,
        Curve::Gamma => 1,
        Curve::Linear => 2,
        Curve::Reinhard => 3,
    };
    let text = format!(
        "{panel:?} {} {} {curve} {:?} {:?} {}",
        exposure.to_bits(),
        tone.offset.to_bits(),
        tone.false_color,
        tone.range,
        tone.auto
    );
    hash(&text)
}

fn hash(text: &str) -> u64 {
    crate::math::hash::fnv1a(crate::math::hash::FNV_START, text.as_bytes())
}

/// Zoom, pan, pins and the crop.
fn navigate(panes: &mut Panes, ui: &mut Ui, index: usize, viewport: &Viewport, response: &egui::Response) {
    let pointer = response.hover_pos();
    if let Some(at) = pointer
        && let Some(pixel) = viewport.pixel(at)
    {
        let place = viewport.to_image(at);
        panes.desk.hover = Some(Hover { panel: index, pixel, at: [place.x, place.y] });
    }
    let session = &mut panes.document.session;
    if let Some(at) = pointer {
        let (scroll, pinch) = ui.input(|i| (i.smooth_scroll_delta().y, i.zoom_delta()));
        let factor = (scroll / 200.0).exp2() * pinch;
        if factor != 1.0 {
            session.view = viewport.zoomed(factor, at);
        }
    }
    if response.double_clicked() {
        panes.desk.ask(Action::Maximize(index));
        return;
    }
    let at = response.interact_pointer_pos();
    if panes.desk.crop_drag.is_some() {
        if let Some(at) = at {
            drag_crop(panes, viewport, response, at);
        }
        return;
    }
    if response.dragged_by(egui::PointerButton::Primary) {
        let split = session.comparison.mode == Mode::Split;
        if split && let Some(at) = at {
            session.comparison.divider = ((at.x - viewport.image().left()) / viewport.image().width()).clamp(0.0, 1.0);
        } else {
            session.view = viewport.panned(response.drag_delta());
        }
    }
    if response.dragged_by(egui::PointerButton::Middle) {
        session.view = viewport.panned(response.drag_delta());
    }
    if response.dragged_by(egui::PointerButton::Secondary) {
        let held = ui.input(|i| i.modifiers);
        orbit(panes, response.drag_delta() / viewport.panel.height().max(1.0), held);
    }
    if response.clicked()
        && let Some(pixel) = at.and_then(|at| viewport.pixel(at))
    {
        panes.desk.ask(Action::Pin(pixel));
    }
}

fn drag_crop(panes: &mut Panes, viewport: &Viewport, response: &egui::Response, at: egui::Pos2) {
    let [w, h] = panes.document.settings().size;
    let inside = |x: f32, n: u32| (x.max(0.0) as u32).min(n.saturating_sub(1));
    let pixel_at = |at: egui::Pos2| {
        let place = viewport.to_image(at);
        [inside(place.x, w), inside(place.y, h)]
    };
    let pixel = pixel_at(at);
    let start = match panes.desk.crop_drag {
        Some(Some(start)) if !response.drag_started() => start,
        // A drag is known as one only when the pointer has left the place where the button was pressed.
        _ => response.ctx.input(|i| i.pointer.press_origin()).map_or(pixel, pixel_at),
    };
    if response.dragged() || response.drag_started() {
        panes.desk.crop_drag = Some(Some(start));
        let low = [start[0].min(pixel[0]), start[1].min(pixel[1])];
        let high = [start[0].max(pixel[0]), start[1].max(pixel[1])];
        panes.document.session.crop = Some([low[0], low[1], high[0] - low[0] + 1, high[1] - low[1] + 1]);
    }
    if response.drag_stopped() {
        panes.desk.crop_drag = None;
    }
}

/// Turns the camera about its target, moves both sideways with Shift, or comes nearer with Ctrl. `delta` is in heights
/// of the panel.
fn orbit(panes: &mut Panes, delta: egui::Vec2, held: egui::Modifiers) {
    let Some(mut camera) = panes.document.scene_file().camera else { return };
    let held = if held.shift {
        crate::scene::camera::Move::Sideways
    } else if held.command {
        crate::scene::camera::Move::Nearer
    } else {
        crate::scene::camera::Move::Orbit
    };
    if delta != egui::Vec2::ZERO
        && crate::scene::camera::moved(&mut camera, held, f64::from(delta.x), f64::from(delta.y))
    {
        panes.document.session.camera = Some(camera);
    }
}
