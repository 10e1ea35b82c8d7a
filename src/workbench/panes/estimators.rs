//! The estimators of the panels with their settings.

use super::widgets::{choice, integer, name, rows, swatch};
use super::{Panes, final_gathering};
use crate::estimate::FinalGathering;
use crate::estimate::registry::{self, ESTIMATORS};
use crate::estimate::settings::Spec;
use crate::render::heatmap::Heatmap;
use crate::workbench::actions::Action;
use crate::workbench::theme;
use crate::workbench::views::heatmap_of;
use egui::Ui;

pub(super) fn show(panes: &mut Panes, ui: &mut Ui) {
    let radius = f64::from(panes.document.scene().radius);
    let names: Vec<String> = panes.document.session.panels.iter().map(|p| p.estimator.clone()).collect();
    let names: Vec<&str> = names.iter().map(String::as_str).collect();
    for index in 0..panes.document.session.panels.len() {
        let panel = &mut panes.document.session.panels[index];
        if panel.image.is_some() {
            continue;
        }
        ui.push_id(index, |ui| {
            let mut close = false;
            ui.horizontal(|ui| {
                swatch(ui, theme::panel_color(&names, index));
                ui.strong(format!("panel {}", index + 1));
                let button = ui.small_button("×").on_hover_text("remove this panel");
                name(&button, &format!("Remove panel {}", index + 1));
                close = button.clicked();
            });
            if close {
                panes.desk.ask(Action::RemovePanel(index));
            }
            let (own, gathering) = split(&panel.estimator);
            let own = edit(ui, own).unwrap_or_else(|| own.to_owned());
            let gathering = final_gathering::edit(ui, gathering, radius).unwrap_or(gathering);
            let name = gathering.map_or(own.clone(), |f| format!("{own}+{f}"));
            // Only what has changed is written: a name keeps the form in which it was given.
            let meant = |text: &str| registry::estimator(text).ok().map(|e| e.name());
            if let Some(name) = meant(&name).filter(|n| Some(n) != meant(&panel.estimator).as_ref()) {
                panel.estimator = name;
            }
            rows(ui, "shows", |ui| {
                let titles: Vec<&str> = std::iter::once("radiance").chain(Heatmap::ALL.map(Heatmap::title)).collect();
                let mut shown = heatmap_of(panel).map_or("radiance", Heatmap::title).to_owned();
                let tip = "the image, or a heatmap of how the estimator made it in the first pass";
                if choice(ui, "Shows", tip, &mut shown, &titles) {
                    panel.heatmap = Heatmap::ALL.iter().find(|h| h.title() == shown).map(|h| h.id().to_owned());
                }
            });
            if let Some(note) =
                heatmap_of(panel).filter(|_| gathering.is_some()).and_then(Heatmap::with_final_gathering)
            {
                ui.weak(note);
            }
        });
        ui.separator();
    }
    let add = ui.menu_button("Add a panel", |ui| {
        for e in ESTIMATORS {
            if ui.button(e.id).on_hover_text(format!("{} ({})", e.summary, e.source)).clicked() {
                panes.desk.ask(Action::AddPanel(e.id.to_owned()));
                ui.close();
            }
        }
    });
    add.response.on_hover_text("another estimator on the same photons");
}

/// The estimator itself, and its final gathering.
fn split(text: &str) -> (&str, Option<FinalGathering>) {
    match text.split_once('+') {
        Some((own, gathering)) => (own, FinalGathering::parse(gathering).ok().flatten()),
        None => (text, None),
    }
}

/// Widgets for one estimator; its new text if it was changed.
fn edit(ui: &mut Ui, text: &str) -> Option<String> {
    let spec = Spec::parse(text).ok()?;
    let mut id = spec.id.to_owned();
    let ids: Vec<&str> = ESTIMATORS.iter().map(|e| e.id).collect();
    let entry = ESTIMATORS.iter().find(|e| e.id == id)?;
    let mut settings: Vec<(&str, String)> = Vec::new();
    let mut changed = false;
    let mut other = false;
    rows(ui, "estimator", |ui| {
        other = choice(ui, "Estimator", &format!("{} ({})", entry.summary, entry.source), &mut id, &ids);
        match entry.id {
            "density" => {
                let mut kernel = spec.get("kernel").unwrap_or("silverman").to_owned();
                let all = ["none", "cone", "gaussian", "epanechnikov", "silverman"];
                changed |= choice(
                    ui,
                    "Kernel",
                    "of distance over radius, normalised (Pedersen 2011, eq. 9-11)",
                    &mut kernel,
                    &all,
                );
                settings.push(("kernel", kernel));
            }
            "regular_3x3" => {
                let mut n = spec.integer("n", 3, 1..=64).map_or(3, i64::from);
                changed |= integer(ui, "n", "n×n view rays for each pixel (Pedersen 2011, section 5)", &mut n, 2..=16);
                settings.push(("n", n.to_string()));
            }
            "coplanar" => {
                let shape = spec.get("shape").unwrap_or("parallelogram");
                let (kind, sides) = shape.split_once(':').unwrap_or((shape, "20"));
                let (mut kind, mut sides) = (kind.to_owned(), sides.parse().unwrap_or(20i64));
                let tip = "shape of the footprints that are clipped (Pedersen 2011, eq. 50-55)";
                changed |= choice(ui, "Shape", tip, &mut kind, &["parallelogram", "ellipse"]);
                if kind == "ellipse" {
                    changed |= integer(ui, "Sides", "sides of the polygon in the ellipse's place", &mut sides, 3..=64);
                    settings.push(("shape", format!("ellipse:{sides}")));
                } else {
                    settings.push(("shape", kind));
                }
                let mut weight = spec.get("weight").unwrap_or("centroid").to_owned();
                let tip = "kernel at the centroid, as published (eq. 66-67), or its mean over the part that is covered";
                changed |= choice(ui, "Weight", tip, &mut weight, &["centroid", "mean"]);
                settings.push(("weight", weight));
            }
            "multi_sampled" => {
                let mut n = spec.integer("n", 8, 2..=256).map_or(8, i64::from);
                changed |=
                    integer(ui, "N", "N×N points of the view footprint (Pedersen 2011, eq. 68-71)", &mut n, 2..=64);
                settings.push(("n", n.to_string()));
                let mut grid = spec.get("grid").unwrap_or("closed").to_owned();
                let tip = "closed: points up to the edges, as published; cells: centres of cells, which is consistent";
                changed |= choice(ui, "Grid", tip, &mut grid, &["closed", "cells"]);
                settings.push(("grid", grid));
            }
            _ => {}
        }
    });
    if other {
        return registry::estimator(&id).ok().map(|e| e.name());
    }
    let pairs: Vec<String> = settings.iter().map(|(k, v)| format!("{k}={v}")).collect();
    let text = format!("{id}:{}", pairs.join(","));
    changed.then(|| registry::estimator(&text).ok().map(|e| e.name())).flatten()
}
