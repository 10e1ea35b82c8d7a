//! The hemisphere over the inspected surface, seen along its normal, with the discs of the gather rays (Gjøl, Larsen and
//! Christensen, figure 3).

use super::{Inspected, Inspector, ListedRay, RayColors};
use crate::render::inspect::gathering::disc_of_directions;
use egui::{Color32, Pos2, Rect, Sense, Shape, Stroke, Ui, vec2};
use glam::Vec2;

/// Corners of a disc.
const SIDES: usize = 24;
/// Discs that are drawn at most; the strongest rays come first.
const MOST: usize = 3000;
/// Radius of a ray without a disc, points.
const POINT: f32 = 2.0;

/// Draws the hemisphere of the gathering under the chosen estimator at the chosen hit; `map` names the colours.
pub fn show(ui: &mut Ui, inspector: &mut Inspector, found: &Inspected, map: Option<&str>, height: f32) {
    let Some((gathering, rays)) = found.gathering(inspector.estimator) else { return };
    let entry = found.gathered_at(inspector.estimator, inspector.hit);
    let Some(gathered) = entry.and_then(|e| gathering.hits.get(e)) else { return };
    let Some(normal) = found.inspection.hits.get(gathered.hit).map(|h| h.view.query.normal) else { return };
    let (rect, response) = ui.allocate_exact_size(vec2(ui.available_width(), height), Sense::click());
    response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Image, true, "Hemisphere of gather rays"));
    let painter = ui.painter_at(rect);
    painter.rect_filled(rect, 2.0, Color32::from_gray(24));
    let radius = rect.width().min(rect.height()) / 2.0 - 4.0;
    let to_screen = |p: Vec2| rect.center() + vec2(p.x, -p.y) * radius;
    painter.circle(rect.center(), radius, Color32::from_gray(14), Stroke::new(1.0, Color32::from_gray(90)));
    let own: Vec<(usize, &ListedRay)> =
        rays.iter().enumerate().filter(|(_, r)| Some(r.at[0]) == entry).take(MOST).collect();
    let outline = |ray: &ListedRay| -> Vec<Pos2> {
        let Some(ray) = gathering.ray(ray.at) else { return Vec::new() };
        disc_of_directions(normal, ray, SIDES).into_iter().map(to_screen).collect()
    };
    if let Some(at) = response.hover_pos() {
        let off = |ray: &ListedRay| {
            gathering
                .ray(ray.at)
                .map_or(f32::INFINITY, |r| middle(&disc_of_directions(normal, r, SIDES), to_screen).distance(at))
        };
        let nearest = own.iter().map(|(i, r)| (*i, off(r))).min_by(|a, b| a.1.total_cmp(&b.1));
        inspector.hovered_ray = nearest.filter(|n| n.1 < reach(radius, own.len())).map(|n| n.0);
        if response.clicked() {
            inspector.chosen_ray = inspector.hovered_ray;
        }
    }
    let colors = RayColors::new(rays, map);
    // The strongest lie on top.
    for (_, ray) in own.iter().rev() {
        draw(&painter, outline(ray), colors.of(ray.adds));
    }
    if let Some(i) = inspector.bright_ray()
        && let Some((_, ray)) = own.iter().find(|(n, _)| *n == i)
    {
        let points = outline(ray);
        draw(&painter, points.clone(), colors.of(ray.adds));
        let stroke = Stroke::new(2.0, Color32::WHITE);
        painter.add(match points[..] {
            [at] => egui::epaint::CircleShape::stroke(at, POINT + 3.0, stroke).into(),
            _ => Shape::closed_line(points, stroke),
        });
    }
    legend(&painter, rect, &colors, rays);
}

/// How far from its middle a disc is still meant, points.
fn reach(radius: f32, rays: usize) -> f32 {
    (radius / (rays.max(1) as f32).sqrt()).clamp(6.0, 40.0)
}

fn middle(disc: &[Vec2], to_screen: impl Fn(Vec2) -> Pos2) -> Pos2 {
    to_screen(disc.iter().sum::<Vec2>() / disc.len().max(1) as f32)
}

fn draw(painter: &egui::Painter, points: Vec<Pos2>, color: Color32) {
    painter.add(match points[..] {
        [] => Shape::Noop,
        [at] => Shape::circle_filled(at, POINT, color),
        _ => Shape::convex_polygon(points, color.gamma_multiply(0.45), Stroke::new(1.0, color)),
    });
}

/// The colours, and what they stand for.
fn legend(painter: &egui::Painter, rect: Rect, colors: &RayColors, rays: &[ListedRay]) {
    use crate::workbench::theme::number;
    let most = rays.first().map_or(0.0, |r| r.adds);
    if most <= 0.0 {
        return;
    }
    let bar = Rect::from_min_size(rect.left_bottom() + vec2(6.0, -18.0), vec2(6.0, 12.0));
    let steps = 12;
    for i in 0..steps {
        let t = i as f32 / (steps - 1) as f32;
        let at = bar.translate(vec2(6.0 * i as f32, 0.0));
        painter.rect_filled(at, 0.0, colors.of(most * libm::exp10f(3.0 * t - 3.0)));
    }
    let font = egui::FontId::monospace(10.0);
    let text = format!("{} to {} W/(m² sr)", number(f64::from(most) * 1e-3), number(f64::from(most)));
    painter.text(bar.left_top() - vec2(0.0, 2.0), egui::Align2::LEFT_BOTTOM, text, font, Color32::from_gray(200));
}
