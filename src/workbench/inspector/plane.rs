//! The tangent plane at a hit: view footprint, photons, sampling points, clipped polygons.

use super::{Inspected, Inspector};
use crate::math::frame::tangents;
use crate::photons::PhotonKind;
use crate::render::inspect::PhotonRow;
use crate::workbench::theme::number;
use egui::{Align2, Color32, FontId, Pos2, Rect, Sense, Shape, Stroke, Ui, vec2};
use glam::Vec3;

/// Points around an ellipse.
const SIDES: usize = 48;
/// Ellipses that are drawn at most; those of the largest weight come first.
const MOST: usize = 600;

/// Where world points of the plane lie on the screen.
pub struct Chart {
    origin: Vec3,
    axes: [Vec3; 2],
    middle: Pos2,
    scale: f32,
}

impl Chart {
    /// The plane at `origin` with unit `normal`, `radius` metres of it in half the smaller side of `rect`.
    pub fn new(origin: Vec3, normal: Vec3, rect: Rect, radius: f32) -> Self {
        let (a, b) = tangents(normal);
        let half = rect.width().min(rect.height()) / 2.0;
        Self { origin, axes: [a, b], middle: rect.center(), scale: half / radius.max(f32::MIN_POSITIVE) }
    }

    /// Place on the screen of a world point, projected along the normal.
    pub fn to_screen(&self, point: Vec3) -> Pos2 {
        let d = point - self.origin;
        self.middle + vec2(d.dot(self.axes[0]), -d.dot(self.axes[1])) * self.scale
    }

    /// The ellipse with half-axes `a` and `b` about `center`, as a polygon.
    pub fn ellipse(&self, center: Vec3, a: Vec3, b: Vec3) -> Vec<Pos2> {
        ellipse_points(center, [a, b], SIDES).map(|p| self.to_screen(p)).collect()
    }

    /// Metres for each point of the screen.
    pub fn metres_per_point(&self) -> f32 {
        1.0 / self.scale
    }
}

/// Colour of a kind of photon.
pub fn kind_color(kind: PhotonKind) -> Color32 {
    match kind {
        PhotonKind::Direct => Color32::from_gray(200),
        PhotonKind::Caustic => Color32::from_rgb(250, 200, 110),
        PhotonKind::Global => Color32::from_rgb(120, 180, 240),
    }
}

/// Draws the plane of the chosen hit.
pub fn show(ui: &mut Ui, inspector: &mut Inspector, found: &Inspected, height: f32) {
    let Some(hit) = found.inspection.hits.get(inspector.hit) else { return };
    let (rect, response) = ui.allocate_exact_size(vec2(ui.available_width(), height), Sense::click_and_drag());
    response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Image, true, "Tangent plane"));
    let painter = ui.painter_at(rect);
    painter.rect_filled(rect, 2.0, Color32::from_gray(24));
    if response.hovered() {
        let scroll = ui.input(|i| i.smooth_scroll_delta().y);
        inspector.zoom = (inspector.zoom * (scroll / 200.0).exp2()).clamp(1e-3, 1e3);
    }
    if response.double_clicked() {
        inspector.zoom = 1.0;
    }
    let query = &hit.view.query;
    let mut rows: Vec<(usize, &PhotonRow)> =
        found.inspection.rows.iter().enumerate().filter(|(_, r)| r.hit == inspector.hit).collect();
    let chart = Chart::new(query.center, query.normal, rect, radius(&rows, &query.axes) / inspector.zoom);
    let heaviest = |row: &PhotonRow| row.weights.iter().copied().fold(0.0, f64::max);
    rows.sort_by(|a, b| heaviest(b.1).total_cmp(&heaviest(a.1)).then(a.0.cmp(&b.0)));
    let drawn = &rows[..rows.len().min(MOST)];
    if let Some(at) = response.hover_pos() {
        inspector.hovered = drawn
            .iter()
            .map(|(i, r)| (*i, off(&chart, r, at)))
            .filter(|d| d.1 < 6.0)
            .min_by(|a, b| a.1.total_cmp(&b.1))
            .map(|d| d.0);
        if response.clicked() {
            inspector.chosen = inspector.hovered;
        }
    }
    for (i, row) in drawn {
        let bright = inspector.bright() == Some(*i);
        let weight = row.weights.get(inspector.estimator).copied().unwrap_or(0.0);
        let color = match (bright, weight > 0.0) {
            (true, _) => Color32::WHITE,
            (false, true) => kind_color(row.kind).gamma_multiply(0.55),
            (false, false) => Color32::from_gray(80),
        };
        let outline = chart.ellipse(row.position, row.footprint[0], row.footprint[1]);
        painter.add(Shape::closed_line(outline, Stroke::new(if bright { 2.0 } else { 1.0 }, color)));
    }
    let footprint = corners(query.center, query.axes).map(|p| chart.to_screen(p));
    painter.add(Shape::closed_line(footprint.to_vec(), Stroke::new(1.5, Color32::from_rgb(120, 230, 140))));
    painter.circle_filled(chart.to_screen(query.center), 2.0, Color32::from_rgb(120, 230, 140));
    if let Some(i) = inspector.bright() {
        construction(&painter, &chart, found, i, inspector.estimator);
    }
    scale_bar(&painter, rect, chart.metres_per_point());
    if drawn.len() < rows.len() {
        let text = format!("the {} heaviest of {} photons", drawn.len(), rows.len());
        painter.text(
            rect.left_top() + vec2(6.0, 4.0),
            Align2::LEFT_TOP,
            text,
            FontId::proportional(11.0),
            Color32::GRAY,
        );
    }
}

/// Points around the ellipse with half-axes `a` and `b` about `center`, evenly in its parameter, metres.
pub fn ellipse_points(center: Vec3, [a, b]: [Vec3; 2], sides: usize) -> impl Iterator<Item = Vec3> {
    let turn = std::f32::consts::TAU / sides as f32;
    (0..sides).map(move |i| {
        let angle = i as f32 * turn;
        center + a * libm::cosf(angle) + b * libm::sinf(angle)
    })
}

/// Corners of a view footprint.
pub fn corners(center: Vec3, [a, b]: [Vec3; 2]) -> [Vec3; 4] {
    [center - a - b, center + a - b, center + a + b, center - a + b]
}

/// Radius to show: the view footprint, or where half of the photons have their far ends.
fn radius(rows: &[(usize, &PhotonRow)], axes: &[Vec3; 2]) -> f32 {
    let own = 1.5 * (axes[0].length() + axes[1].length());
    let mut reach: Vec<f32> = rows.iter().map(|(_, r)| r.footprint[0].length().max(r.footprint[1].length())).collect();
    let middle = reach.len() / 2;
    let typical = if reach.is_empty() { 0.0 } else { *reach.select_nth_unstable_by(middle, f32::total_cmp).1 };
    own.max(1.6 * typical).max(f32::MIN_POSITIVE)
}

/// Distance on the screen of a point from a photon's outline.
fn off(chart: &Chart, row: &PhotonRow, at: Pos2) -> f32 {
    let outline = chart.ellipse(row.position, row.footprint[0], row.footprint[1]);
    outline.iter().map(|p| p.distance(at)).fold(f32::INFINITY, f32::min)
}

/// Sampling points and clipped polygon of one row under one estimator.
fn construction(painter: &egui::Painter, chart: &Chart, found: &Inspected, row: usize, estimator: usize) {
    let Some(c) = found.constructions.get(row).and_then(|c| c.get(estimator)) else { return };
    if c.covered.len() >= 3 {
        let polygon: Vec<Pos2> = c.covered.iter().map(|p| chart.to_screen(*p)).collect();
        let color = Color32::from_rgb(230, 120, 200);
        painter.add(Shape::convex_polygon(polygon, color.gamma_multiply(0.25), Stroke::new(1.0, color)));
        if let Some(centroid) = c.centroid {
            painter.circle_stroke(chart.to_screen(centroid), 3.0, Stroke::new(1.5, color));
        }
    }
    for p in &c.points {
        let color = if p.inside { Color32::from_rgb(90, 220, 110) } else { Color32::from_rgb(240, 90, 80) };
        painter.circle_filled(chart.to_screen(p.position), 1.8, color);
    }
}

/// A bar of a round length.
fn scale_bar(painter: &egui::Painter, rect: Rect, metres_per_point: f32) {
    let wanted = 70.0 * f64::from(metres_per_point);
    if !(wanted > 0.0 && wanted.is_finite()) {
        return;
    }
    let power = libm::exp10(libm::log10(wanted).floor());
    let round = [5.0, 2.0, 1.0].into_iter().find(|m| m * power <= wanted).unwrap_or(1.0) * power;
    let length = (round / f64::from(metres_per_point)) as f32;
    let left = rect.left_bottom() + vec2(8.0, -8.0);
    painter.line_segment([left, left + vec2(length, 0.0)], Stroke::new(2.0, Color32::from_gray(200)));
    let label = format!("{} m", number(round));
    painter.text(left + vec2(0.0, -3.0), Align2::LEFT_BOTTOM, label, FontId::monospace(11.0), Color32::from_gray(200));
}

#[cfg(test)]
mod tests {
    use super::*;

    /// An ellipse drawn is the footprint stored: its points lie on the unit circle of the footprint's own coordinates.
    #[test]
    fn ellipses_are_drawn_as_they_are_stored() {
        let rect = Rect::from_min_size(egui::pos2(10.0, 20.0), vec2(200.0, 100.0));
        let (center, a, b) = (Vec3::new(0.1, 0.0, -0.2), Vec3::new(0.3, 0.0, 0.1), Vec3::new(-0.05, 0.0, 0.2));
        let chart = Chart::new(Vec3::ZERO, Vec3::Y, rect, 0.5);
        let (t, u) = tangents(Vec3::Y);
        for p in chart.ellipse(center, a, b) {
            let d = (p - rect.center()) * chart.metres_per_point();
            let q = (t * d.x - u * d.y) - center;
            // q = s a + r b.
            let n = a.cross(b);
            let s = q.cross(b).dot(n) / n.length_squared();
            let r = a.cross(q).dot(n) / n.length_squared();
            assert!((s * s + r * r - 1.0).abs() < 1e-4, "{s} {r}");
        }
        assert!((chart.metres_per_point() - 0.01).abs() < 1e-7);
    }
}
