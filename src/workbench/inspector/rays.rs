//! The gather rays of the inspected pixel as a table.

use super::listed::{self, Picks};
use super::{Inspected, Inspector, ListedRay};
use crate::math::rgb::mean;
use crate::render::inspect::gathering::{layer_of, semi_axes};
use crate::render::inspect::{Gathering, RayEnd};
use crate::workbench::theme::{mono, number};
use egui::{Align, Color32, Layout, Rect, Sense, Ui, pos2, vec2};
use std::fmt::Write;

const ROW: f32 = 20.0;

/// Columns: title, width in points, and what it is.
const COLUMNS: [(&str, f32, &str); 8] = [
    ("ray", 34.0, "by what it adds, the strongest first"),
    ("adds", 62.0, "to the pixel's mean channel, W/(m² sr)"),
    ("%", 42.0, "share of all that final gathering adds"),
    ("E", 62.0, "irradiance where it ends, the mean channel, W/m²"),
    ("m", 52.0, "length of its way, metres"),
    ("axis m", 56.0, "longest semi-axis of its footprint, metres; a dash if it carries none"),
    ("lay", 30.0, "layer of the pyramid, 0 is the most detailed"),
    ("n", 34.0, "estimates that it averages"),
];

/// Draws the table of the rays from the chosen hit under the chosen estimator.
pub fn show(ui: &mut Ui, inspector: &mut Inspector, found: &Inspected) {
    let Some((gathering, rays)) = found.gathering(inspector.estimator) else { return };
    let entry = found.gathered_at(inspector.estimator, inspector.hit);
    let order: Vec<usize> = (0..rays.len()).filter(|i| Some(rays[*i].at[0]) == entry).collect();
    let total: f32 = gathering.hits.iter().map(|h| mean(h.contribution)).sum();
    let width: f32 = COLUMNS.iter().map(|c| c.1).sum();
    egui::ScrollArea::horizontal().id_salt("ray columns").show(ui, |ui| {
        ui.set_min_width(width);
        ui.horizontal(|ui| {
            ui.spacing_mut().item_spacing.x = 0.0;
            for (title, width, tip) in COLUMNS {
                let text = mono(title).color(Color32::from_gray(190)).size(11.0);
                let (rect, response) = ui.allocate_exact_size(vec2(width, ROW), Sense::hover());
                let cell = Rect::from_min_max(rect.min, pos2(rect.right() - 4.0, rect.bottom()));
                let mut ui = ui.new_child(egui::UiBuilder::new().max_rect(cell).layout(Layout::top_down(Align::Max)));
                ui.add(egui::Label::new(text).selectable(false));
                response.on_hover_text(format!("{title}: {tip}"));
            }
        });
        let height = ui.available_height().max(4.0 * ROW);
        egui::ScrollArea::vertical().id_salt("ray rows").max_height(height).auto_shrink([false, true]).show_rows(
            ui,
            ROW,
            order.len(),
            |ui, range| {
                ui.spacing_mut().item_spacing = vec2(0.0, 0.0);
                for at in range {
                    row(ui, inspector, found, gathering, order[at], &rays[order[at]], total);
                }
            },
        );
    });
}

fn row(
    ui: &mut Ui,
    inspector: &mut Inspector,
    found: &Inspected,
    gathering: &Gathering,
    index: usize,
    listed: &ListedRay,
    total: f32,
) {
    let Some(ray) = gathering.ray(listed.at) else { return };
    let width: f32 = COLUMNS.iter().map(|c| c.1).sum();
    let name = format!("gather ray {}", index + 1);
    let bright = inspector.bright_ray();
    let mut picks = Picks { hovered: &mut inspector.hovered_ray, chosen: &mut inspector.chosen_ray, bright };
    let (rect, response) = listed::row(ui, vec2(width, ROW), &name, index, &mut picks);
    let dash = || "-".to_owned();
    let share = if total > 0.0 { 100.0 * listed.adds / total } else { 0.0 };
    let footprint = ray.hit.filter(|_| ray.radius > 0.0);
    let cells = [
        (index + 1).to_string(),
        number(f64::from(listed.adds)),
        format!("{share:.2}"),
        ray.hit.map_or_else(|| RayEnd::of(ray).title().into(), |_| number(f64::from(mean(ray.irradiance)))),
        ray.hit.map_or_else(dash, |h| number(f64::from(h.distance))),
        footprint.map_or_else(dash, |h| number(f64::from(semi_axes(&h, found.pass.scene.resolution())[0]))),
        layer_of(ray).map_or_else(dash, |l| l.to_string()),
        ray.estimates.len().to_string(),
    ];
    let mut left = rect.left();
    for (text, (_, width, _)) in cells.into_iter().zip(COLUMNS) {
        listed::cell(ui, rect, left, width, Align::Max, text);
        left += width;
    }
    response.on_hover_text(tip(ray, found));
}

/// How a ray ended, and where.
fn tip(ray: &crate::final_gather::RecordedRay, found: &Inspected) -> String {
    let mut text = RayEnd::of(ray).title().to_owned();
    if let Some(h) = ray.hit {
        let at = h.position.as_dvec3() + found.pass.scene.origin;
        // Writing to a string cannot fail.
        let _ = write!(text, " at {:.4}, {:.4}, {:.4}", at.x, at.y, at.z);
        if h.specular > 0 {
            let _ = write!(text, ", after {} specular surfaces", h.specular);
        }
    }
    text
}

/// All rays of all gatherings as CSV.
pub fn csv(found: &Inspected) -> String {
    let mut text = String::from(
        "estimator,hit,end,direction_x,direction_y,direction_z,radius,x,y,z,distance_m,semi_axis_long_m,semi_axis_short_m,layer,estimates,irradiance,adds\n",
    );
    for (gathering, rays) in found.inspection.gatherings.iter().zip(&found.rays) {
        let name = found.inspection.estimators.get(gathering.estimator).map_or("", |e| e.name.as_str());
        for listed in rays {
            let Some(ray) = gathering.ray(listed.at) else { continue };
            let [dx, dy, dz] = ray.direction.to_array();
            let end = ray.hit.map_or(",,,,,".to_owned(), |h| {
                let at = h.position.as_dvec3() + found.pass.scene.origin;
                let [long, short] = semi_axes(&h, found.pass.scene.resolution());
                let axes = if ray.radius > 0.0 { format!("{long:e},{short:e}") } else { ",".into() };
                format!("{:e},{:e},{:e},{:e},{axes}", at.x, at.y, at.z, h.distance)
            });
            // Writing to a string cannot fail.
            let _ = writeln!(
                text,
                "\"{name}\",{},{},{dx:e},{dy:e},{dz:e},{:e},{end},{},{},{:e},{:e}",
                gathering.hits[listed.at[0]].hit,
                RayEnd::of(ray).title(),
                ray.radius,
                layer_of(ray).map_or(String::new(), |l| l.to_string()),
                ray.estimates.len(),
                mean(ray.irradiance),
                listed.adds
            );
        }
    }
    text
}
