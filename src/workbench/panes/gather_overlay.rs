//! What final gathering does, drawn into an image panel: the ends of gather rays, and irradiance estimates.

use super::overlay::Projection;
use crate::export::false_color::{FalseColor, ValueRange};
use crate::export::tone::color_map;
use crate::math::frame::tangents;
use crate::render::inspect::Gathering;
use crate::render::inspect::gathering::estimate;
use crate::workbench::inspector::{Inspected, ListedRay, RayColors};
use crate::workbench::overlays::estimates::VisibleEstimates;
use egui::{Color32, Painter, Pos2, Shape, Stroke};
use glam::Vec3;

/// Footprints of rays in a panel at most; the strongest come first.
const RAYS: usize = 1000;
/// Estimates in a panel at most; more would hide each other.
const ESTIMATES: usize = 3000;
/// Estimates of which the whole discs are drawn too, at most.
const DISCS: usize = 24;
/// Radius of a ray's end without a footprint, points.
const POINT: f32 = 2.0;

/// Where the gather rays of the pinned pixel end, under the estimator that the inspector draws.
pub(super) fn rays(projection: &Projection, painter: &Painter) {
    let inspector = &projection.panes.desk.inspector;
    let Some(found) = &inspector.found else { return };
    let Some((gathering, rays)) = found.gathering(inspector.estimator) else { return };
    let entry = found.gathered_at(inspector.estimator, inspector.hit);
    let own = rays.iter().filter(|r| r.seen && Some(r.at[0]) == entry).take(RAYS).collect::<Vec<_>>();
    let colors = RayColors::new(rays, projection.panes.document.session.tone.false_color.as_deref());
    // The strongest lie on top.
    for ray in own.iter().rev() {
        end(projection, painter, gathering, ray, colors.of(ray.adds));
    }
}

/// Footprint or place of a ray's end.
fn end(projection: &Projection, painter: &Painter, gathering: &Gathering, ray: &ListedRay, color: Color32) {
    let Some(hit) = gathering.ray(ray.at).and_then(|r| r.hit) else { return };
    match projection.ellipse(hit.position, hit.footprint) {
        Some(outline) if hit.footprint[0] != Vec3::ZERO => {
            painter.add(Shape::convex_polygon(outline, color.gamma_multiply(0.25), Stroke::new(1.0, color)));
        }
        _ => {
            if let Some(at) = projection.at(hit.position) {
                painter.circle_filled(at, POINT, color);
            }
        }
    }
}

/// The gather ray that is bright in the inspector: its way, where it ends, and the estimates that it averages. Dashed
/// where the camera does not see its end.
pub(super) fn bright(projection: &Projection, painter: &Painter) {
    let inspector = &projection.panes.desk.inspector;
    let Some(found) = &inspector.found else { return };
    let Some((gathering, rays)) = found.gathering(inspector.estimator) else { return };
    let Some(listed) = inspector.bright_ray().and_then(|i| rays.get(i)) else { return };
    averaged(projection, painter, found, gathering, listed);
    let Some(ray) = gathering.ray(listed.at) else { return };
    let from = gathering.hits.get(listed.at[0]).and_then(|h| found.inspection.hits.get(h.hit));
    let from = from.and_then(|h| projection.at(h.view.query.center));
    let Some(hit) = ray.hit else { return };
    let to = projection.at(hit.position);
    let dashed = !listed.seen;
    if let (Some(from), Some(to)) = (from, to) {
        // By way of specular surfaces it is no straight line.
        line(painter, vec![from, to], dashed || hit.specular > 0);
    }
    if let Some(mut outline) = projection.ellipse(hit.position, hit.footprint) {
        outline.push(outline[0]);
        line(painter, outline, dashed);
    }
    if let Some(to) = to {
        painter.circle_filled(to, POINT + 0.5, Color32::WHITE);
    }
}

fn line(painter: &Painter, points: Vec<Pos2>, dashed: bool) {
    if dashed {
        painter.extend(Shape::dashed_line(&points, Stroke::new(1.0, Color32::WHITE), 4.0, 3.0));
    } else {
        painter.add(Shape::line(points.clone(), Stroke::new(3.0, Color32::BLACK)));
        painter.add(Shape::line(points, Stroke::new(1.5, Color32::WHITE)));
    }
}

/// The estimates that a ray averages: their places, and their discs.
fn averaged(projection: &Projection, painter: &Painter, found: &Inspected, gathering: &Gathering, ray: &ListedRay) {
    let Some(ray) = gathering.ray(ray.at) else { return };
    let color = Color32::from_rgb(120, 200, 250);
    for at in &ray.estimates {
        let Some((radius, e)) = estimate(&found.pass.gathering, &gathering.settings, *at) else { continue };
        if let Some(disc) = projection.ellipse(e.position, disc(e.normal, radius)) {
            painter.add(Shape::closed_line(disc, Stroke::new(1.0, color.gamma_multiply(0.45))));
        }
        if let Some(at) = projection.at(e.position) {
            painter.circle_filled(at, 1.5, color);
        }
    }
}

/// Half-axes of a disc.
fn disc(normal: Vec3, radius: f32) -> [Vec3; 2] {
    let (t, b) = tangents(normal);
    [t * radius, b * radius]
}

/// The irradiance estimates of the chosen layer: of all the part that they stand for, filled, and of some the whole disc.
pub(super) fn estimates(projection: &Projection, painter: &Painter) {
    let Some(all) = &projection.panes.desk.visible_estimates else { return };
    let scale = scale(all, projection.panes.document.session.tone.false_color.as_deref());
    let inside = projection.viewport.panel;
    let seen = all.estimates.iter().filter(|e| projection.at(e.position).is_some_and(|at| inside.contains(at)));
    let seen: Vec<_> = seen.take(ESTIMATES).collect();
    let color = |irradiance: f32| {
        if irradiance <= 0.0 {
            return Color32::from_gray(40);
        }
        let [r, g, b] = scale.color(libm::log10f(irradiance));
        Color32::from_rgb(r, g, b)
    };
    for e in &seen {
        if let Some(part) = projection.ellipse(e.position, disc(e.normal, e.own_radius)) {
            painter.add(Shape::convex_polygon(part, color(e.irradiance), Stroke::NONE));
        }
    }
    for e in seen.iter().take(DISCS) {
        if let Some(whole) = projection.ellipse(e.position, disc(e.normal, all.radius)) {
            painter.add(Shape::closed_line(whole, Stroke::new(1.0, color(e.irradiance).gamma_multiply(0.7))));
        }
    }
}

/// Colours of irradiance, over its decimal logarithm.
pub(super) fn scale(all: &VisibleEstimates, map: Option<&str>) -> FalseColor {
    let [low, high] = all.range.map(libm::log10f);
    FalseColor::new(color_map(map), ValueRange { low, high })
}
