//! `realtime-table-5.1`: one photon map or several.

use super::{origin, parameters, rooms, run_settings, stopped};
use crate::cli::failure::Failure;
use crate::cli::paper::PaperFlags;
use crate::cli::paper::output::{Done, Origin};
use crate::cli::progress::{bar, interrupted};
use crate::cli::realtime::SIZE;
use crate::cli::table::Table;
use crate::export::plot::{Axes, Plot, Series, draw, ink};
use crate::measure::realtime::tables::{PRINTED_PARTITION, PartitionRow, measured, partition_rows};
use serde::Serialize;
use std::fmt::Write;
use std::path::Path;

/// Searches of each row.
const QUERIES: u64 = 20_000;

#[derive(Serialize)]
struct InContext {
    partition: &'static str,
    balance_ms: f64,
    estimate_ms: f64,
    frame_ms: f64,
}

#[derive(Serialize)]
struct Report<'a> {
    #[serde(flatten)]
    origin: &'a Origin,
    repeats: u32,
    printed: Vec<f64>,
    rows: &'a [PartitionRow],
    in_context: &'a [InContext],
}

/// Measures and makes the table.
///
/// # Errors
/// A wrong flag, a file that cannot be written, or an interruption.
pub fn run(item: &'static str, flags: &PaperFlags, folder: &Path) -> Result<Done, Failure> {
    let scene = rooms()?;
    let repeats = flags.repeats();
    let progress = bar(240, item, flags.quiet || flags.json);
    let rows = partition_rows(QUERIES, repeats);
    let mut in_context = Vec::new();
    for partition in ["none", "normal"] {
        let texts = [format!("partition={partition}"), "photons_from_light=2000".to_owned()];
        let s = parameters(&scene, flags, &texts.each_ref().map(String::as_str))?;
        let going_on = || {
            progress.inc(1);
            !interrupted()
        };
        let r = measured(&scene, s, &run_settings(flags, 120, 0.0), going_on).ok_or_else(|| stopped(item))?;
        let p = r.phase_seconds;
        in_context.push(InContext {
            partition,
            balance_ms: 1e3 * p.balance,
            estimate_ms: 1e3 * p.estimate,
            frame_ms: 1e3 * r.frame_seconds[1],
        });
    }
    progress.finish_and_clear();
    let origin = origin(item, "Kristensen and Ottosen 2003, table 5.1", &scene, flags, SIZE)?;
    let mut table =
        Table::new(["photons", "in each map", "search µs", "measured", "least to most", "printed", "build ms"]);
    let mut csv = String::from("photons,each,search_us,ratio,least,most,printed,balance_ms\n");
    for (r, p) in rows.iter().zip(PRINTED_PARTITION) {
        let [least, middle, most] = r.ratio;
        table.row([
            r.total.to_string(),
            r.each.to_string(),
            format!("{:.2}", r.search),
            format!("{:.0} %", 100.0 * middle),
            format!("{:.0} to {:.0} %", 100.0 * least, 100.0 * most),
            format!("{:.0} %", 100.0 * p.2),
            format!("{:.1}", r.balance),
        ]);
        // Writing to a string cannot fail.
        let _ = writeln!(
            csv,
            "{},{},{:.4},{middle:.4},{least:.4},{most:.4},{},{:.4}",
            r.total, r.each, r.search, p.2, r.balance
        );
    }
    let mut text = table.text();
    let _ = writeln!(
        text,
        "\nsearches of 50 photons on a plane, the median of {repeats} repeats; printed: what lg a + 50 predicts\n"
    );
    let mut context = Table::new(["partition in rooms", "balance ms", "estimate ms", "frame ms"]);
    for c in &in_context {
        context.row([
            c.partition.to_owned(),
            format!("{:.2}", c.balance_ms),
            format!("{:.2}", c.estimate_ms),
            format!("{:.2}", c.frame_ms),
        ]);
    }
    text += &context.text();
    let series = |total: u32, i: usize, printed: bool| {
        let chosen = rows.iter().zip(PRINTED_PARTITION).filter(|(r, _)| r.total == total);
        Series {
            name: format!("{total} photons, {}", if printed { "expected in print" } else { "measured" }),
            color: ink(i),
            line: chosen.map(|(r, p)| (f64::from(r.each), if printed { p.2 } else { r.ratio[1] })).collect(),
            dashed: printed,
            marks: true,
            ..Series::default()
        }
    };
    let plot = Plot {
        title: "Time of a search over the size of the map".into(),
        subtitle: origin.subtitle(),
        axes: vec![Axes {
            title: "searches of 50 photons".into(),
            x: "photons in a map".into(),
            y: "time over that of one map".into(),
            series: vec![
                series(1_000_000, 0, false),
                series(1_000_000, 0, true),
                series(10_000, 1, false),
                series(10_000, 1, true),
            ],
            levels: Vec::new(),
        }],
    };
    let picture = draw(&plot).map_err(Failure::Work)?;
    let printed = PRINTED_PARTITION.iter().map(|p| p.2).collect();
    let report = Report { origin: &origin, repeats, printed, rows: &rows, in_context: &in_context };
    origin.write(folder, &picture, &csv, &report, &text)
}
