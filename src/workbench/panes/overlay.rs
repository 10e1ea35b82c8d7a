//! Overlays drawn into an image panel.

use super::{Panes, gather_overlay};
use crate::photons::PhotonKind;
use crate::render::inspect::view_path;
use crate::workbench::inspector::plane::{corners, ellipse_points, kind_color};
use crate::workbench::theme::number;
use crate::workbench::viewport::Viewport;
use egui::{Align2, Color32, FontId, Painter, Pos2, Rect, Shape, Stroke};
use glam::Vec3;

const GREEN: Color32 = Color32::from_rgb(90, 220, 110);
const RED: Color32 = Color32::from_rgb(240, 90, 80);
const PINK: Color32 = Color32::from_rgb(230, 120, 200);
/// Sides of an ellipse in an image.
const SIDES: usize = 24;
/// Ellipses in a panel at most; more would hide each other.
const ELLIPSES: usize = 250;
/// Tiles need this many points to carry their time.
const LABELLED: f32 = 44.0;

/// World points as they are seen in a panel.
pub(super) struct Projection<'a> {
    pub panes: &'a Panes<'a>,
    pub viewport: &'a Viewport,
}

impl Projection<'_> {
    pub fn at(&self, point: Vec3) -> Option<Pos2> {
        let size = self.panes.document.settings().size;
        let [x, y] = self.panes.document.scene().camera.project(point, size)?;
        // What lies far outside would only cost time.
        (x.abs() < 1e5 && y.abs() < 1e5).then(|| self.viewport.to_screen(x, y))
    }

    fn all(&self, points: &[Vec3]) -> Option<Vec<Pos2>> {
        points.iter().map(|p| self.at(*p)).collect()
    }

    pub fn ellipse(&self, center: Vec3, axes: [Vec3; 2]) -> Option<Vec<Pos2>> {
        ellipse_points(center, axes, SIDES).map(|p| self.at(p)).collect()
    }
}

/// Draws the overlays that are on.
pub(super) fn draw(panes: &Panes, painter: &Painter, index: usize, viewport: &Viewport) {
    let on = |id: &str| panes.document.session.overlays.iter().any(|o| o == id);
    let projection = Projection { panes, viewport };
    if on("tiles") {
        tiles(panes, painter, index, viewport);
    }
    if on("irradiance") {
        gather_overlay::estimates(&projection, painter);
    }
    if on("photons") {
        photons(&projection, painter);
    }
    if on("footprint") {
        footprint(&projection, painter);
    }
    if on("polygons") {
        polygons(&projection, painter);
    }
    if on("samples") {
        samples(&projection, painter);
    }
    if on("path") {
        path(&projection, painter);
    }
    if on("gather_rays") {
        gather_overlay::rays(&projection, painter);
    }
    bright(&projection, painter);
    gather_overlay::bright(&projection, painter);
}

/// The view footprint of the pixel under the pointer; dashed where it is seen by way of a specular surface.
fn footprint(projection: &Projection, painter: &Painter) {
    let panes = projection.panes;
    let (Some(hover), Some(pass)) = (panes.desk.hover_before, panes.render.current_pass()) else { return };
    let Ok(seen) = view_path(pass, hover.pixel) else { return };
    for vertex in &seen {
        let Some(outline) = projection.all(&corners(vertex.position, vertex.footprint)) else { continue };
        if vertex.depth == 0 {
            painter.add(Shape::closed_line(outline, Stroke::new(1.5, GREEN)));
        } else {
            let mut closed = outline;
            closed.push(closed[0]);
            painter.extend(Shape::dashed_line(&closed, Stroke::new(1.0, GREEN), 3.0, 3.0));
        }
    }
}

/// Photon differentials as ellipses, thinned where they are dense; hidden ones were left out when they were chosen.
fn photons(projection: &Projection, painter: &Painter) {
    let all = &projection.panes.desk.visible_photons;
    let inside = projection.viewport.panel;
    let mut drawn = 0;
    for photon in all.photons.iter() {
        let Some(middle) = projection.at(photon.position) else { continue };
        if !inside.contains(middle) {
            continue;
        }
        if drawn == ELLIPSES {
            break;
        }
        drawn += 1;
        let Some(outline) = projection.ellipse(photon.position, photon.axes) else { continue };
        let color = photon.color;
        if photon.kind == PhotonKind::Global {
            let mut closed = outline;
            closed.push(closed[0]);
            painter.extend(Shape::dashed_line(&closed, Stroke::new(1.0, color), 4.0, 3.0));
        } else {
            painter.add(Shape::closed_line(outline, Stroke::new(1.0, color)));
        }
    }
}

/// Parts of the pinned pixel's view footprints that photons cover, with their centroids.
fn polygons(projection: &Projection, painter: &Painter) {
    let inspector = &projection.panes.desk.inspector;
    let Some(found) = &inspector.found else { return };
    for (row, constructions) in found.constructions.iter().enumerate() {
        for c in constructions.iter().filter(|c| c.covered.len() >= 3) {
            let Some(polygon) = projection.all(&c.covered) else { continue };
            let lit = inspector.bright() == Some(row);
            let fill = if lit { PINK.gamma_multiply(0.4) } else { PINK.gamma_multiply(0.08) };
            painter.add(Shape::convex_polygon(polygon, fill, Stroke::new(if lit { 1.5 } else { 0.5 }, PINK)));
            if let Some(at) = c.centroid.and_then(|p| projection.at(p)) {
                painter.circle_stroke(at, if lit { 3.0 } else { 1.5 }, Stroke::new(1.0, PINK));
            }
        }
    }
}

/// Sampling points of the pinned pixel for the bright photon, or else for the heaviest.
fn samples(projection: &Projection, painter: &Painter) {
    let inspector = &projection.panes.desk.inspector;
    let Some(found) = &inspector.found else { return };
    let heaviest = || {
        let weight = |i: &usize| found.inspection.rows[*i].weights.iter().copied().fold(0.0, f64::max);
        (0..found.inspection.rows.len()).max_by(|a, b| weight(a).total_cmp(&weight(b)).then(b.cmp(a)))
    };
    let Some(constructions) = inspector.bright().or_else(heaviest).and_then(|row| found.constructions.get(row)) else {
        return;
    };
    let chosen = constructions.get(inspector.estimator).filter(|c| !c.points.is_empty());
    let Some(c) = chosen.or_else(|| constructions.iter().find(|c| !c.points.is_empty())) else { return };
    for p in &c.points {
        if let Some(at) = projection.at(p.position) {
            painter.circle_filled(at, 1.5, if p.inside { GREEN } else { RED });
        }
    }
}

/// The view ray of the pinned pixel after its first surface, and the chosen photon's path.
fn path(projection: &Projection, painter: &Painter) {
    let inspector = &projection.panes.desk.inspector;
    if let Some(found) = &inspector.found {
        let path = &found.inspection.path;
        for vertex in path.iter().filter(|v| v.rays_per_axis == 1) {
            let Some(to) = projection.at(vertex.position) else { continue };
            painter.circle_filled(to, 3.0, GREEN);
            let from = vertex.parent.and_then(|p| path.get(p)).and_then(|p| projection.at(p.position));
            if let Some(from) = from {
                painter.line_segment([from, to], Stroke::new(1.5, GREEN));
            }
        }
    }
    if let Some(found) = &inspector.path {
        let color = kind_color(found.photon.0);
        let mut from = projection.at(found.path.origin);
        for vertex in &found.path.vertices {
            let to = projection.at(vertex.position);
            if let (Some(from), Some(to)) = (from, to) {
                painter.line_segment([from, to], Stroke::new(1.5, color));
                painter.circle_filled(to, 2.5, color);
            }
            from = to;
        }
    }
}

/// The ellipse of the photon that is bright in the inspector.
fn bright(projection: &Projection, painter: &Painter) {
    let inspector = &projection.panes.desk.inspector;
    let Some(found) = &inspector.found else { return };
    let Some(row) = inspector.bright().and_then(|i| found.inspection.rows.get(i)) else { return };
    if let Some(outline) = projection.ellipse(row.position, row.footprint) {
        painter.add(Shape::closed_line(outline.clone(), Stroke::new(3.0, Color32::BLACK)));
        painter.add(Shape::closed_line(outline, Stroke::new(1.5, Color32::WHITE)));
    }
}

fn tiles(panes: &Panes, painter: &Painter, index: usize, viewport: &Viewport) {
    let Some(image) = panes.document.session.panels.get(index).and_then(|p| panes.gallery.of(p)) else { return };
    for (tile, (rect, _, _)) in image.tiles().enumerate() {
        let min = viewport.to_screen(rect.x as f32, rect.y as f32);
        let max = viewport.to_screen((rect.x + rect.width) as f32, (rect.y + rect.height) as f32);
        let at = Rect::from_min_max(min, max);
        painter.rect_stroke(at, 0.0, Stroke::new(1.0, Color32::from_white_alpha(60)), egui::StrokeKind::Inside);
        if at.width() >= LABELLED
            && let Some(seconds) = image.seconds(tile)
        {
            let text = if panes.desk.untimed { "-".into() } else { format!("{} ms", number(seconds * 1e3)) };
            painter.text(
                min + egui::vec2(3.0, 2.0),
                Align2::LEFT_TOP,
                text,
                FontId::monospace(9.0),
                Color32::from_gray(230),
            );
        }
    }
}
