//! Plots: error against run time, time by phase, footprint areas.

use super::Panes;
use crate::estimate::registry::short_name;
use crate::workbench::desk::Desk;
use crate::workbench::theme::{self, number, seconds};
use egui::{Color32, Ui};
use egui_plot::{Bar, BarChart, Corner, GridMark, HoverPosition, Legend, Line, LineStyle, Plot, PlotPoints, Points};
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
fn short(names: &[&str], name: &str) -> String {
    let own = short_name(name);
    let alike = names.iter().any(|n| *n != name && short_name(n) == own);
    if alike { name.to_owned() } else { own }
}

/// log10 of a positive number; anything else has no place in a plot.
fn log10(x: f64) -> Option<f64> {
    (x > 0.0 && x.is_finite()).then(|| libm::log10(x))
}

/// A line of the error plot: log10 of seconds and of relative RMSE.
struct Curve {
    title: String,
    panel: usize,
    points: Vec<[f64; 2]>,
    estimated: bool,
}

/// The measured curves of the panels, then the estimated ones.
fn error_curves(desk: &Desk, names: &[&str]) -> Vec<Curve> {
    let distinct = || names.iter().enumerate().filter(|(i, name)| !names[..*i].contains(name));
    let measured = distinct().filter_map(|(panel, name)| {
        let points = desk.errors.get(*name)?.iter();
        let points = points.filter_map(|p| Some([log10(p.seconds)?, log10(p.error.relative_rmse)?])).collect();
        Some(Curve { title: short(names, name), panel, points, estimated: false })
    });
    let estimated = distinct().filter_map(|(panel, name)| {
        let points = desk.estimates.get(*name)?.iter();
        let points = points.filter_map(|p| Some([log10(p.seconds)?, log10(p.error.relative)?])).collect();
        Some(Curve { title: format!("{}, estimated", short(names, name)), panel, points, estimated: true })
    });
    measured.chain(estimated).collect()
}

pub(super) fn errors(panes: &mut Panes, ui: &mut Ui) {
    ui.horizontal(|ui| {
        ui.strong("Error against run time").on_hover_text(
            "relative RMSE over seconds of photons, maps and the estimator's own view passes; both axes logarithmic. \
             Full: against the reference. Dashed: estimated from the scatter of the passes, from pass 12 on; it does not \
             see a bias that stays",
        );
        if let Some(reference) = &panes.desk.reference {
            ui.weak(&reference.source);
        }
    });
    let session = &panes.document.session;
    let names: Vec<&str> = session.panels.iter().map(|p| p.estimator.as_str()).collect();
    let curves = error_curves(panes.desk, &names);
    if panes.desk.reference.is_none() && curves.is_empty() {
        ui.weak("No reference is loaded. Some built-in scenes bring one, which shows them unedited; File > Compare with a reference image takes an EXR or PNG. From pass 12 on the error that the passes themselves tell is shown.");
        return;
    }
    if panes.desk.untimed {
        ui.weak(UNTIMED);
        return;
    }
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
            for Curve { title, panel, points, estimated } in curves {
                let color = theme::panel_color(&names, panel);
                let style = if estimated { LineStyle::dashed_dense() } else { LineStyle::Solid };
                let line = Line::new(title.clone(), PlotPoints::from(points.clone()));
                plot.line(line.color(color).width(1.5).style(style));
                // Where there are many the line says it.
                if points.len() <= 40 && !estimated {
                    plot.points(Points::new(title, PlotPoints::from(points)).color(color).radius(2.0));
                }
            }
        });
}

/// Phases of the stacked bars with their colours: greys, since colours are the estimators'.
const PHASES: [(&str, u8); 6] =
    [("photons", 60), ("maps", 95), ("view rays", 130), ("gather", 165), ("estimate", 205), ("final gathering", 245)];

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
        let photons = shared * traced / both;
        let parts = [photons, shared - photons, own.view_trace, own.gather, own.estimate, own.final_gather];
        for ((stack, part), (_, grey)) in stacks.iter_mut().zip(parts).zip(&PHASES) {
            let shade = Color32::from_gray(*grey);
            let bar = Bar::new(i as f64, part / passes * 1e3).width(0.7).fill(shade);
            stack.push(bar.stroke(egui::Stroke::NONE));
        }
    }
    let names: Vec<&str> = job.estimators.iter().map(String::as_str).collect();
    let names: Vec<String> = names.iter().map(|n| short(&names, n)).collect();
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::render::ErrorEstimate;
    use crate::workbench::desk::EstimatePoint;

    #[test]
    fn estimated_curves_need_no_reference() {
        let mut desk = Desk::default();
        let at = |passes: u32, relative: f64| EstimatePoint {
            seconds: f64::from(passes) / 10.0,
            error: ErrorEstimate {
                passes,
                rmse: relative,
                noise_rmse: relative,
                bias_rmse: 0.0,
                relative,
                relative_bound: relative,
            },
        };
        // A point without error has no place on a logarithmic axis.
        desk.estimates.insert("integrated".into(), vec![at(10, 0.1), at(100, 0.01), at(1000, 0.0)]);
        let curves = error_curves(&desk, &["regular", "integrated", "integrated"]);
        assert_eq!(curves.len(), 1);
        assert_eq!((curves[0].title.as_str(), curves[0].panel), ("integrated, estimated", 1));
        assert!(curves[0].estimated);
        let expected = [[0.0, -1.0], [1.0, -2.0]];
        assert_eq!(curves[0].points.len(), 2);
        for (p, e) in curves[0].points.iter().zip(expected) {
            assert!((p[0] - e[0]).abs() < 1e-12 && (p[1] - e[1]).abs() < 1e-12, "{p:?}");
        }
    }
}
