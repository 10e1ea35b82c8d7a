//! What `compare` prints for people.

use crate::cli::table::{Table, percent};
use crate::export::report::CompareReport;
use crate::measure::truth::TRUTH_RAYS;
use crate::scene::memory;
use std::path::Path;

/// The table for people.
pub fn text(report: &CompareReport, folder: &Path) -> String {
    let r = &report.render;
    let stored = &r.photons_stored;
    let seconds = |s: f64| format!("{s:.3}");
    let gathers = report.estimators.iter().any(|e| e.seconds.parts.final_gather > 0.0);
    let mut heading = vec!["estimator", "view pass s", "view rays s", "gather s", "estimate s"];
    heading.extend(gathers.then_some("final gathering s"));
    heading.extend(["x regular", "photons/pixel", "error", "to reference"]);
    let mut table = Table::new(heading);
    for e in &report.estimators {
        let mut cells = vec![
            e.name(),
            seconds(e.seconds.view_pass),
            seconds(e.seconds.parts.view_trace),
            seconds(e.seconds.parts.gather),
            seconds(e.seconds.parts.estimate),
        ];
        cells.extend(gathers.then(|| seconds(e.seconds.parts.final_gather)));
        cells.extend([
            e.ratio_to_regular.map_or("-".into(), |x| format!("{x:.2}")),
            format!("{:.1}", e.photons_per_pixel),
            percent(e.error.map(|e| e.relative_rmse)),
            percent(e.reference_error.map(|e| e.relative_rmse)),
        ]);
        table.row(cells);
    }
    let c = report.crop;
    let mut out = format!(
        "{}: {}x{}, {} photons emitted, stored {} direct, {} caustic, {} global; photons {:.3} s, maps {:.3} s\n\n{}\n",
        r.provenance.scene,
        r.size[0],
        r.size[1],
        r.photons_emitted,
        stored.direct,
        stored.caustic,
        stored.global,
        r.seconds.photon_trace,
        r.seconds.map_build,
        table.text()
    );
    let place = match report.truth {
        Some(t) if t == c => format!("the crop {},{},{},{}", c.x, c.y, c.width, c.height),
        Some(_) => "the whole image".into(),
        None => String::new(),
    };
    if !place.is_empty() {
        out.push_str(&format!(
            "error: relative RMSE over {place} against regular with {TRUTH_RAYS}x{TRUTH_RAYS} view rays on the same photons, all that overlap\n"
        ));
    }
    if let Some(reference) = &report.reference {
        out.push_str(&format!("to reference: relative RMSE of one pass against the {reference}\n"));
    }
    out.push_str("\nplan\n");
    let width = r.plan.items.iter().map(|i| i.part.len()).max().unwrap_or(0);
    for item in &r.plan.items {
        out.push_str(&format!(
            "  {:<width$}  {:<8}  {}\n",
            item.part,
            if item.on { "on" } else { "left out" },
            item.why
        ));
    }
    if let Some(m) = &r.memory {
        let [all, images, photons, maps] = [m.total(), m.images, m.photons, m.maps].map(memory::text);
        let peak = r.peak_rss_bytes.map_or(String::new(), |p| format!("; {} at the highest", memory::text(p)));
        out.push_str(&format!(
            "  memory: {all} foreseen: images {images}, {} photons {photons}, maps {maps}{peak}\n",
            m.photons_stored
        ));
    }
    if let Some(cost) = &report.plan_cost {
        out.push_str(&format!(
            "  pilot {:.3} s, once; photons and maps: {:.3} s and {} stored as planned; {:.3} s and {} stored with every part on ({:.2} x)\n",
            r.seconds.plan, cost.needed_seconds, cost.needed_stored, cost.full_seconds, cost.full_stored,
            if cost.needed_stored > 0 { cost.full_seconds / cost.needed_seconds } else { 1.0 }
        ));
    }
    let gathered: Vec<_> = report.estimators.iter().filter_map(|e| e.final_gather.as_ref()).collect();
    if !gathered.is_empty() {
        out.push_str(&format!("\nfinal gathering: {}\n", r.gather_counts.line()));
        let mut lines: Vec<String> = gathered.iter().map(|f| f.line()).collect();
        lines.dedup();
        lines.iter().for_each(|line| out.push_str(&format!("  {line}\n")));
    }
    let bounded = r.bounded.lines();
    if !bounded.is_empty() {
        out.push_str(&format!("\n{}\n", bounded.join("\n")));
    }
    out.push_str(&format!("\n{:.1} s in all; files in {}\n", r.seconds.total, folder.display()));
    out
}
