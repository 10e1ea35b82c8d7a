//! Plots: error against run time, time by phase, footprint areas.

use super::Panes;
use crate::workbench::theme::{self, number, seconds};
use egui::{Color32, Ui};
use egui_plot::{Bar, BarChart, Corner, GridMark, HoverPosition, Legend, Line, Plot, PlotPoints, Points};
use std::ops::RangeInclusive;

/// In place of plots of times where those are left out.
const UNTIMED: &str = "Times differ from run to run and are not shown in pictures.";

/// A mark of an axis that holds powers of ten: 0.001, 1, 1e6; nothing between whole powers when they are dense.
fn power_of_ten(mark: GridMark, _range: &RangeInclusive<f64>) -> String {
    let x = mark.value;
    if (x - x.round()).abs() > 1e-6 {
        String::new()
    } else if (-3.0..=4.0).contains(&x) {
        format!("{}", libm::exp10(x.round()) as f32)
    } else {
        format!("1e{}", x.round())
    }
}

fn plot(name: &str) -> Plot<'static> {
    Plot::new(name.to_owned()).allow_scroll(false).allow_boxed_zoom(false).show_grid(true)
}

fn legend(corner: Corner) -> Legend {
    Legend::default().position(corner).text_style(egui::TextStyle::Small).background_alpha(0.5)
}

/// An estimator without its settings, if no other panel has the same.
fn short<'a>(names: &[&'a str], name: &'a str) -> &'a str {
    let id = |n: &'a str| n.split(':').next().unwrap_or(n);
    let alike = names.iter().filter(|n| **n != name && id(n) == id(name)).count();
    if alike == 0 { id(name) } else { name }
}

/// log10 of a positive number; anything else has no place in a plot.
fn log10(x: f64) -> Option<f64> {
    (x > 0.0 && x.is_finite()).then(|| libm::log10(x))
}

pub(super) fn errors(panes: &mut Panes, ui: &mut Ui) {
    ui.horizontal(|ui| {
        ui.strong("Error against run time").on_hover_text(
            "relative RMSE against the reference, over seconds of photons, maps and the estimator's own view passes; both axes logarithmic",
        );
        if let Some(reference) = &panes.desk.reference {
            ui.weak(&reference.source);
        }
    });
    if panes.desk.reference.is_none() {
        ui.weak("No reference is loaded. Some built-in scenes bring one, which shows them unedited; File > Compare with a reference image takes an EXR or PNG.");
        return;
    }
    if panes.desk.untimed {
        ui.weak(UNTIMED);
        return;
    }
    let session = &panes.document.session;
    let names: Vec<&str> = session.panels.iter().map(|p| p.estimator.as_str()).collect();
    let format = |at: &HoverPosition| match at {
        HoverPosition::NearDataPoint { plot_name, position, .. } => {
            let (x, y) = (libm::exp10(position.x), libm::exp10(position.y));
            Some(format!("{plot_name}\n{}: {} %", seconds(x), number(100.0 * y)))
        }
        _ => None,
    };
    plot("errors")
        .x_axis_formatter(power_of_ten)
        .y_axis_formatter(power_of_ten)
        .label_formatter(format)
        .x_axis_label("s")
        .legend(legend(Corner::RightTop))
        .show(ui, |plot| {
            for (i, name) in names.iter().enumerate() {
                if names[..i].contains(name) {
                    continue;
                }
                let Some(curve) = panes.desk.errors.get(*name) else { continue };
                let points: Vec<[f64; 2]> =
                    curve.iter().filter_map(|p| Some([log10(p.seconds)?, log10(p.error.relative_rmse)?])).collect();
                let color = theme::panel_color(&names, i);
                let title = short(&names, name);
                plot.line(Line::new(title, PlotPoints::from(points.clone())).color(color).width(1.5));
                // Where there are many the line says it.
                if points.len() <= 40 {
                    plot.points(Points::new(title, PlotPoints::from(points)).color(color).radius(2.0));
                }
            }
        });
}

/// Phases of the stacked bars with their colours: greys, since colours are the estimators'.
const PHASES: [(&str, u8); 5] =
    [("photons", 70), ("maps", 105), ("view rays", 140), ("gather", 180), ("estimate", 225)];

pub(super) fn times(panes: &mut Panes, ui: &mut Ui) {
    ui.strong("Time by phase").on_hover_text("wall seconds of one pass: what the panel would cost alone");
    let (Some(progress), Some(job)) = (&panes.render.progress, panes.render.job()) else {
        ui.weak("No pass is done.");
        return;
    };
    if panes.desk.untimed {
        ui.weak(UNTIMED);
        return;
    }
    let mut stacks = vec![Vec::new(); PHASES.len()];
    for i in 0..job.estimators.len() {
        let passes = f64::from(progress.passes.get(i).copied().unwrap_or(0).max(1));
        let (Some(own), Some(shared)) = (progress.estimator_seconds.get(i), progress.photon_seconds.get(i)) else {
            continue;
        };
        let traced = progress.seconds.photon_trace;
        let both = (traced + progress.seconds.map_build).max(f64::MIN_POSITIVE);
        let parts = [shared * traced / both, shared * (1.0 - traced / both), own.view_trace, own.gather, own.estimate];
        for ((stack, part), (_, grey)) in stacks.iter_mut().zip(parts).zip(&PHASES) {
            let shade = Color32::from_gray(*grey);
            let bar = Bar::new(i as f64, part / passes * 1e3).width(0.7).fill(shade);
            stack.push(bar.stroke(egui::Stroke::NONE));
        }
    }
    let names: Vec<&str> = job.estimators.iter().map(String::as_str).collect();
    let names: Vec<String> = names.iter().map(|n| short(&names, n).to_owned()).collect();
    let count = names.len();
    plot("times")
        .legend(legend(Corner::RightTop))
        .y_axis_label("ms")
        .include_x(-0.6)
        .include_x(count as f64 + 0.6)
        .x_grid_spacer(move |_| (0..count).map(|i| GridMark { value: i as f64, step_size: 1.0 }).collect())
        .x_axis_formatter(move |mark, _| {
            let i = mark.value.round();
            let is_bar = (mark.value - i).abs() < 1e-6 && i >= 0.0 && (i as usize) < count;
            if is_bar { names[i as usize].clone() } else { String::new() }
        })
        .show(ui, |plot| {
            let mut charts: Vec<BarChart> = Vec::new();
            for (stack, (name, grey)) in stacks.into_iter().zip(PHASES) {
                let chart = BarChart::new(name, stack).color(Color32::from_gray(grey));
                let below: Vec<&BarChart> = charts.iter().collect();
                let chart = chart.stack_on(&below);
                charts.push(chart);
            }
            for chart in charts {
                plot.bar_chart(chart);
            }
        });
}

pub(super) fn areas(panes: &mut Panes, ui: &mut Ui) {
    ui.strong("Footprint areas").on_hover_text("areas of the photons' ellipses in the last pass, m², logarithmic");
    let histogram = &panes.desk.areas;
    if histogram.kinds.iter().all(|k| k.1.is_empty()) {
        ui.weak("No photon is stored.");
        return;
    }
    plot("areas").x_axis_formatter(power_of_ten).x_axis_label("m²").legend(legend(Corner::RightTop)).show(ui, |plot| {
        for (name, bins) in &histogram.kinds {
            let color = match *name {
                "caustic" => Color32::from_rgb(240, 200, 120),
                "global" => Color32::from_rgb(120, 170, 220),
                _ => Color32::from_gray(170),
            };
            let bars = bins.iter().map(|(x, n)| Bar::new(*x, *n as f64).width(super::super::areas::BIN)).collect();
            plot.bar_chart(BarChart::new(*name, bars).color(color.gamma_multiply(0.7)));
        }
    });
}
