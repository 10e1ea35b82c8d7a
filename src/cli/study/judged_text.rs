//! What `study` and `merge` print for people.

use crate::cli::table::{Table, percent};
use crate::export::study::StudyReport;
use crate::measure::study::Curve;
use std::path::Path;

/// The tables.
pub fn text(report: &StudyReport, folder: &Path) -> String {
    let r = &report.reference;
    let [w, h] = report.size;
    let noise = r.noise.map_or("unknown".into(), |n| percent(Some(n)));
    let mut out = format!(
        "{}: {w}x{h}, {} of {} tasks, seeds {:?}\nreference: {}, its own noise {noise} over {} pixels\n\n{}\n",
        report.scene,
        report.tasks_done,
        report.tasks,
        report.seeds,
        r.source,
        r.pixels,
        curves(report.curves).text()
    );
    out.push_str(
        "error: relative RMSE at the last checkpoint, median (smallest to largest) over the seeds; `-` where it cannot \
         be told from the reference's noise\nconvergence: x in MSE ~ seconds^x\n",
    );
    if !report.pareto.is_empty() {
        out.push_str(&format!("\n{}\n", budgets(report).text()));
    }
    if let Some(share) = report.unaccounted {
        out.push_str(&format!("{:.2} % of the seconds belong to no part of a render\n", 100.0 * share));
    }
    out.push_str(&format!("study.csv, study.json and study.png are in {}\n", folder.display()));
    out
}

fn curves(curves: &[Curve]) -> Table {
    let mut table =
        Table::new(["setting", "passes", "seconds", "error", "range", "bias", "noise", "convergence", "consistent"]);
    for curve in curves {
        let Some(last) = curve.summary.last() else { continue };
        let parts = last.bias_and_variance;
        table.row([
            curve.label.clone(),
            last.passes.to_string(),
            format!("{:.3}", last.seconds.median),
            percent(last.relative_rmse.map(|e| e.median)),
            last.relative_rmse.map_or("-".into(), |e| format!("{:.2} to {:.2}", 100.0 * e.low, 100.0 * e.high)),
            percent(parts.and_then(|p| p.relative_bias)),
            percent(parts.map(|p| p.relative_noise)),
            // Two points lie on a line, whatever they are.
            curve
                .convergence
                .filter(|c| c.points > 2)
                .map_or("-".into(), |c| format!("{:.2} ± {:.2}", c.exponent, c.standard_error)),
            if curve.consistent { "yes" } else { "no" }.into(),
        ]);
    }
    table
}

fn budgets(report: &StudyReport) -> Table {
    let mut table = Table::new(["budget s", "best", "error", "next", "x"]);
    for best in report.pareto {
        let others = best.ratios.iter().enumerate().filter(|(i, _)| *i != best.curve);
        let next = others.filter_map(|(i, r)| Some((i, (*r)?))).min_by(|a, b| a.1.total_cmp(&b.1));
        table.row([
            format!("{}", best.seconds),
            best.label.clone(),
            percent(Some(best.relative_rmse)),
            next.map_or(String::new(), |(i, _)| report.curves[i].label.clone()),
            next.map_or(String::new(), |(_, r)| format!("{r:.2}")),
        ]);
    }
    table
}
