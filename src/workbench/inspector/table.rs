//! The photons of the inspected pixel as a table.

use super::listed::{self, Picks};
use super::summary::situation_tip;
use super::{Column, Inspected, Inspector};
use crate::estimate::registry::short_name;
use crate::math::rgb::mean;
use crate::render::inspect::PhotonRow;
use crate::workbench::theme::{mono, number};
use egui::{Align, Color32, Ui, vec2};
use std::cmp::Ordering;

const ROW: f32 = 17.0;

/// The rows in the order that is chosen.
pub fn order(inspector: &Inspector, rows: &[PhotonRow]) -> Vec<usize> {
    let mut order: Vec<usize> = (0..rows.len()).collect();
    let key = |a: &PhotonRow, b: &PhotonRow| -> Ordering {
        match inspector.sort {
            Column::Photon => (a.kind, a.index).cmp(&(b.kind, b.index)),
            Column::Power => mean(a.power).total_cmp(&mean(b.power)),
            Column::Area => a.area.total_cmp(&b.area),
            Column::Distance => a.distance.total_cmp(&b.distance),
            Column::Situation => a.situation.cmp(&b.situation),
            Column::Weight(e) => {
                let weight = |r: &PhotonRow| r.weights.get(e).copied().unwrap_or(0.0);
                weight(a).total_cmp(&weight(b))
            }
        }
    };
    order.sort_by(|&a, &b| {
        let by = key(&rows[a], &rows[b]);
        (if inspector.descending { by.reverse() } else { by }).then(a.cmp(&b))
    });
    order
}

/// Draws the table: a header that sorts, rows that light up, and the sums. `colors` are the estimators'.
pub fn show(ui: &mut Ui, inspector: &mut Inspector, found: &Inspected, colors: &[Color32]) {
    let i = &found.inspection;
    let mut columns: Vec<(Column, String, f32, &str)> = vec![
        (Column::Photon, "photon".into(), 88.0, "kind and index in its map"),
        (Column::Power, "W".into(), 62.0, "power, the mean of the channels, W"),
        (Column::Area, "m²".into(), 62.0, "area of its ellipse, m²"),
        (Column::Distance, "dist".into(), 44.0, "distance of the hit point in filter space; inside below 1"),
        (Column::Situation, "fig".into(), 30.0, "situation of figure 10 of the thesis: a, b or c"),
    ];
    for (e, estimator) in i.estimators.iter().enumerate() {
        let id = short_name(&estimator.name);
        // Weights are what one looks for, so they come right after the photon.
        columns.insert(1 + e, (Column::Weight(e), id, 60.0, "weight under this estimator, 1/m²"));
    }
    let width: f32 = columns.iter().map(|c| c.2).sum();
    egui::ScrollArea::horizontal().id_salt("photon columns").show(ui, |ui| {
        ui.set_min_width(width);
        ui.horizontal(|ui| {
            ui.spacing_mut().item_spacing.x = 0.0;
            for (column, title, width, tip) in &columns {
                let arrow = match (inspector.sort == *column, inspector.descending) {
                    (true, true) => " v",
                    (true, false) => " ^",
                    _ => "",
                };
                let color = match column {
                    Column::Weight(e) => colors.get(*e).copied().unwrap_or(Color32::GRAY),
                    _ => Color32::from_gray(190),
                };
                let text = mono(format!("{title}{arrow}")).color(color).size(11.0);
                let button = egui::Button::new(text).frame(false).truncate();
                let response =
                    ui.add_sized([*width, ROW], button).on_hover_text(format!("{title}: {tip}; click to sort"));
                if response.clicked() {
                    inspector.descending = inspector.sort != *column || !inspector.descending;
                    inspector.sort = *column;
                }
            }
        });
        let order = order(inspector, &i.rows);
        let height = ui.available_height().max(4.0 * ROW);
        egui::ScrollArea::vertical().id_salt("photon rows").max_height(height).auto_shrink([false, true]).show_rows(
            ui,
            ROW,
            order.len(),
            |ui, range| {
                ui.spacing_mut().item_spacing = vec2(0.0, 0.0);
                for at in range {
                    row(ui, inspector, &i.rows[order[at]], order[at], &columns);
                }
            },
        );
    });
}

fn row(ui: &mut Ui, inspector: &mut Inspector, row: &PhotonRow, index: usize, columns: &[(Column, String, f32, &str)]) {
    let width: f32 = columns.iter().map(|c| c.2).sum();
    let name = format!("photon {} {}", row.kind.name(), row.index);
    let bright = inspector.bright();
    let mut picks = Picks { hovered: &mut inspector.hovered, chosen: &mut inspector.chosen, bright };
    let (rect, response) = listed::row(ui, vec2(width, ROW + 3.0), &name, index, &mut picks);
    let mut left = rect.left();
    for (column, _, width, _) in columns {
        let text = match column {
            Column::Photon => format!("{} {}", row.kind.name(), row.index),
            Column::Power => number(f64::from(mean(row.power))),
            Column::Area => number(f64::from(row.area)),
            Column::Distance => number(f64::from(row.distance)),
            Column::Situation => row.situation.letter().into(),
            Column::Weight(e) => number(row.weights.get(*e).copied().unwrap_or(0.0)),
        };
        let align = if *column == Column::Photon { Align::Min } else { Align::Max };
        listed::cell(ui, rect, left, *width, align, text);
        left += width;
    }
    response.on_hover_text(format!(
        "at {:.4}, {:.4}, {:.4}; {}; condition {}",
        row.position.x,
        row.position.y,
        row.position.z,
        situation_tip(row.situation),
        number(row.condition)
    ));
}
