//! The measured tables in numbers: lines beside the printed ones, as text and CSV.

use crate::cli::paper::gathering::layers::PyramidBytes;
use crate::cli::paper::gathering::measured::{Cell, Measured};
use crate::cli::paper::gathering::methods::Way;
use crate::cli::paper::gathering::printed::{PrintedRow, PrintedTable};
use crate::cli::paper::gathering::reference::Truth;
use crate::cli::paper::spread::Spread;
use crate::cli::table::{Table, percent};
use crate::measure::ErrorMetrics;
use crate::render::stats::StoredCounts;
use serde::Serialize;
use std::fmt::Write;

/// A table of the paper, measured.
#[derive(Debug, Serialize)]
pub struct Section {
    /// As it is printed.
    pub printed: PrintedTable,
    /// Photons emitted.
    pub photons_emitted: u64,
    /// Photons stored.
    pub photons_stored: StoredCounts,
    /// Wall seconds to emit them.
    pub emission: Spread,
    /// Memory by way.
    pub memory: Vec<WayBytes>,
    /// Its lines.
    pub rows: Vec<Row>,
}

/// Memory of a way's pyramid.
#[derive(Debug, Serialize)]
pub struct WayBytes {
    /// The way.
    pub way: Way,
    /// Its pyramid.
    #[serde(flatten)]
    pub bytes: PyramidBytes,
}

/// A way with a number of rays.
#[derive(Debug, Serialize)]
pub struct Row {
    /// Gather rays.
    pub rays: u32,
    /// What they look up.
    pub way: Way,
    /// As the command line takes it.
    pub estimator: String,
    /// Seconds of the tree over all photons.
    pub tree: Spread,
    /// Seconds of the first layer.
    pub first_layer: Spread,
    /// Seconds of all other layers.
    pub other_layers: Spread,
    /// Seconds of the image, direct light included.
    pub image: Spread,
    /// All of it: the paper's "total".
    pub total: Spread,
    /// Total over that of classic in the same repeat.
    pub ratio_to_classic: Spread,
    /// Seconds of the same cell in print.
    pub printed_total: f64,
    /// Over those of classic.
    pub printed_ratio: f64,
    /// Error against the reference; None if no pixel counts.
    pub error: Option<ErrorMetrics>,
    /// Relative RMSE without the reference's own noise.
    pub net_relative_rmse: Option<f64>,
}

impl Section {
    /// Of measurements, judged by a reference.
    pub fn new(measured: Measured, truth: &Truth) -> Self {
        let classic = |cell: &Cell| {
            let base = measured.cells.iter().find(|c| c.way == Way::Classic && c.rays == cell.rays);
            base.map_or_else(Vec::new, Cell::totals)
        };
        let rows = measured.cells.iter().map(|c| row(c, &classic(c), &measured.printed, truth)).collect();
        Self {
            rows,
            printed: measured.printed,
            photons_emitted: measured.emitted,
            photons_stored: measured.stored,
            emission: Spread::of(&measured.emission),
            memory: measured.memory.into_iter().map(|(way, bytes)| WayBytes { way, bytes }).collect(),
        }
    }
}

fn row(cell: &Cell, classic: &[f64], printed: &PrintedTable, truth: &Truth) -> Row {
    let of_build = |f: &dyn Fn(&crate::cli::paper::gathering::measured::BuildSeconds) -> f64| {
        Spread::of(&cell.build.iter().map(f).collect::<Vec<_>>())
    };
    let totals = cell.totals();
    let ratios: Vec<f64> = totals.iter().zip(classic).map(|(own, base)| own / base.max(f64::MIN_POSITIVE)).collect();
    let line = printed.rows.iter().find(|r| r.rays == cell.rays);
    let in_print = |r: &PrintedRow| match cell.way {
        Way::Classic => (r.classic, 1.0),
        _ => (r.ray_differentials, r.ratio()),
    };
    let error = truth.error(&cell.image);
    let (printed_total, printed_ratio) = line.map_or((0.0, 0.0), in_print);
    Row {
        rays: cell.rays,
        way: cell.way,
        estimator: cell.estimator.name(),
        tree: of_build(&|b| b.tree),
        first_layer: of_build(&|b| b.first_layer),
        other_layers: of_build(&|b| b.other_layers),
        image: Spread::of(&cell.image_seconds),
        total: Spread::of(&totals),
        ratio_to_classic: Spread::of(&ratios),
        printed_total,
        printed_ratio,
        error,
        net_relative_rmse: error.and_then(|e| truth.net(e.relative_rmse)),
    }
}

/// One of the tables for people: times beside the printed ones, and errors.
pub fn text(section: &Section) -> String {
    let p = &section.printed;
    let mut table = Table::new([
        "rays, way",
        "tree s",
        "first layer s",
        "others s",
        "image s",
        "total s",
        "x classic",
        "least",
        "largest",
        "printed s",
        "printed x",
        "error",
        "net",
        "mean",
    ]);
    for r in &section.rows {
        table.row([
            format!("{} {}", r.rays, r.way.title()),
            format!("{:.2}", r.tree.median),
            format!("{:.2}", r.first_layer.median),
            format!("{:.2}", r.other_layers.median),
            format!("{:.2}", r.image.median),
            format!("{:.2}", r.total.median),
            format!("{:.3}", r.ratio_to_classic.median),
            format!("{:.3}", r.ratio_to_classic.least),
            format!("{:.3}", r.ratio_to_classic.most),
            format!("{:.1}", r.printed_total),
            format!("{:.3}", r.printed_ratio),
            percent(r.error.map(|e| e.relative_rmse)),
            percent(r.net_relative_rmse),
            r.error.map_or("-".into(), |e| format!("{:.3}", e.mean_ratio)),
        ]);
    }
    format!(
        "{} photons emitted in {:.2} s ({} in {:.1} s in print), first radius {} m\n{}",
        section.photons_emitted,
        section.emission.median,
        p.photons,
        p.emission,
        p.radius,
        table.text()
    )
}

/// Memory of all pyramids for people.
pub fn memory_text(sections: &[Section]) -> String {
    let mut table = Table::new([
        "photons, radius, pyramid",
        "photon map MB",
        "peak MB",
        "layers MB",
        "layers",
        "largest MB",
        "by layer MB",
        "saved",
    ]);
    let mb = |bytes: u64| format!("{:.1}", bytes as f64 / 1e6);
    for s in sections {
        for WayBytes { way, bytes: b } in &s.memory {
            table.row([
                format!("{} {} {}", s.photons_emitted, s.printed.radius, way.title()),
                mb(b.photon_map),
                mb(b.peak),
                mb(b.sum),
                b.layers.len().to_string(),
                mb(b.largest),
                mb(b.peak_by_layer),
                format!("{:.1} %", 100.0 * b.saved),
            ]);
        }
    }
    table.text()
}

/// In how many cells ray differentials are faster, and what an image of equal error takes, in two sentences.
pub fn summary(sections: &[Section]) -> String {
    let rows = || sections.iter().flat_map(|s| s.rows.iter());
    let mut out = String::new();
    for way in Way::TIMED.into_iter().skip(1) {
        let own: Vec<&Row> = rows().filter(|r| r.way == way).collect();
        let faster = own.iter().filter(|r| r.ratio_to_classic.median < 1.0).count();
        let ratio = Spread::of(&own.iter().map(|r| r.ratio_to_classic.median).collect::<Vec<_>>());
        let error = |r: &Row| r.error.map(|e| e.rmse);
        let better = own.iter().filter(|r| {
            let classic = sections.iter().find_map(|s| {
                s.rows
                    .iter()
                    .any(|o| std::ptr::eq(o, **r))
                    .then(|| s.rows.iter().find(|c| c.way == Way::Classic && c.rays == r.rays))?
            });
            matches!((error(r), classic.and_then(error)), (Some(own), Some(base)) if own < base)
        });
        // Writing to a string cannot fail.
        let _ = writeln!(
            out,
            "{}: faster than classic in {faster} of {} cells, {:.3} of its time (median; {:.3} to {:.3}), less error in {}",
            way.title(),
            own.len(),
            ratio.median,
            ratio.least,
            ratio.most,
            better.count()
        );
    }
    let printed: Vec<f64> = rows().filter(|r| r.way == Way::AsPublished).map(|r| r.printed_ratio).collect();
    let p = Spread::of(&printed);
    let _ = writeln!(
        out,
        "in print: faster in {} of {} cells, {:.3} of its time (median; {:.3} to {:.3})",
        printed.iter().filter(|r| **r < 1.0).count(),
        printed.len(),
        p.median,
        p.least,
        p.most
    );
    out
}

/// One line for each cell.
pub fn csv(sections: &[Section]) -> String {
    let mut csv = String::from(
        "photons,radius_m,rays,way,estimator,emission_s,tree_s,first_layer_s,other_layers_s,image_s,total_s,total_least_s,total_largest_s,ratio_to_classic,ratio_least,ratio_largest,printed_total_s,printed_ratio,relative_rmse,net_relative_rmse,mean_ratio,photon_map_bytes,peak_bytes,layers_bytes\n",
    );
    for s in sections {
        for r in &s.rows {
            let memory = s.memory.iter().find(|m| m.way == r.way).map(|m| &m.bytes);
            let bytes = |f: &dyn Fn(&PyramidBytes) -> u64| memory.map_or(String::new(), |m| f(m).to_string());
            let error =
                |f: &dyn Fn(&ErrorMetrics) -> f64| r.error.as_ref().map_or(String::new(), |e| format!("{:.6}", f(e)));
            let numbers: Vec<String> = [
                s.emission.median,
                r.tree.median,
                r.first_layer.median,
                r.other_layers.median,
                r.image.median,
                r.total.median,
                r.total.least,
                r.total.most,
                r.ratio_to_classic.median,
                r.ratio_to_classic.least,
                r.ratio_to_classic.most,
                r.printed_total,
                r.printed_ratio,
            ]
            .map(|x| format!("{x:.6}"))
            .into();
            // Writing to a string cannot fail.
            let _ = writeln!(
                csv,
                "{},{},{},{},\"{}\",{},{},{},{},{},{},{}",
                s.photons_emitted,
                s.printed.radius,
                r.rays,
                r.way.name(),
                r.estimator,
                numbers.join(","),
                error(&|e| e.relative_rmse),
                r.net_relative_rmse.map_or(String::new(), |e| format!("{e:.6}")),
                error(&|e| e.mean_ratio),
                bytes(&|m| m.photon_map),
                bytes(&|m| m.peak),
                bytes(&|m| m.sum)
            );
        }
    }
    csv
}
