//! `realtime-table-6.2`: frame rate and renewal time over accumulation frames.

use super::{origin, parameters, rooms, run_settings, stopped};
use crate::cli::failure::Failure;
use crate::cli::paper::PaperFlags;
use crate::cli::paper::output::{Done, Origin};
use crate::cli::progress::{bar, interrupted};
use crate::cli::realtime::SIZE;
use crate::cli::table::Table;
use crate::export::plot::{Axes, Plot, Series, draw, ink};
use crate::measure::realtime::tables::{ACCUMULATION, PRINTED_ACCUMULATION, measured, with_counts};
use serde::Serialize;
use std::fmt::Write;
use std::path::Path;

/// Photons in the map, as printed.
const PHOTONS: u32 = 10_000;
const TRIANGLES: u32 = 12_800;

#[derive(Serialize)]
struct Row {
    accumulation_frames: u32,
    frames_per_second: f64,
    renewal_seconds: f64,
    printed_frames_per_second: f64,
    printed_renewal_seconds: f64,
    /// Over those of one accumulation frame, ours and printed.
    rate_ratio: [f64; 2],
    renewal_ratio: [f64; 2],
}

#[derive(Serialize)]
struct Report<'a> {
    #[serde(flatten)]
    origin: &'a Origin,
    photons: u32,
    triangles: u32,
    rows: &'a [Row],
}

/// Measures and makes the table.
///
/// # Errors
/// A wrong flag, a file that cannot be written, or an interruption.
pub fn run(item: &'static str, flags: &PaperFlags, folder: &Path) -> Result<Done, Failure> {
    let scene = rooms()?;
    let progress = bar(ACCUMULATION.iter().map(|f| frames_of(*f)).sum(), item, flags.quiet || flags.json);
    let mut rows: Vec<Row> = Vec::new();
    for (&frames, printed) in ACCUMULATION.iter().zip(PRINTED_ACCUMULATION) {
        // One reflection for each photon, so that a round is dealt out to 64 frames without a rest.
        let texts = [format!("accumulation_frames={frames}"), "diffuse_reflections=1".to_owned()];
        let plain = parameters(&scene, flags, &texts.each_ref().map(String::as_str))?;
        let s = with_counts(&scene, &plain, TRIANGLES, PHOTONS);
        let going_on = || {
            progress.inc(1);
            !interrupted()
        };
        let r =
            measured(&scene, s, &run_settings(flags, frames_of(frames), 0.0), going_on).ok_or_else(|| stopped(item))?;
        let first =
            rows.first().map_or((r.frames_per_second, r.renewal_seconds), |f| (f.frames_per_second, f.renewal_seconds));
        let [rate, renewal] = printed;
        rows.push(Row {
            accumulation_frames: frames,
            frames_per_second: r.frames_per_second,
            renewal_seconds: r.renewal_seconds,
            printed_frames_per_second: rate,
            printed_renewal_seconds: renewal,
            rate_ratio: [r.frames_per_second / first.0, rate / PRINTED_ACCUMULATION[0][0]],
            renewal_ratio: [r.renewal_seconds / first.1, renewal / PRINTED_ACCUMULATION[0][1]],
        });
    }
    progress.finish_and_clear();
    let origin = origin(item, "Kristensen and Ottosen 2003, table 6.2", &scene, flags, SIZE)?;
    let mut table = Table::new([
        "accumulation frames",
        "frames/s",
        "x one",
        "printed",
        "x one",
        "renewal s",
        "x one",
        "printed",
        "x one",
    ]);
    let mut csv = String::from(
        "accumulation_frames,frames_per_second,renewal_seconds,printed_frames_per_second,printed_renewal_seconds\n",
    );
    for r in &rows {
        table.row([
            r.accumulation_frames.to_string(),
            format!("{:.1}", r.frames_per_second),
            format!("{:.2}", r.rate_ratio[0]),
            format!("{:.2}", r.printed_frames_per_second),
            format!("{:.1}", r.rate_ratio[1]),
            format!("{:.4}", r.renewal_seconds),
            format!("{:.2}", r.renewal_ratio[0]),
            format!("{:.2}", r.printed_renewal_seconds),
            format!("{:.2}", r.renewal_ratio[1]),
        ]);
        // Writing to a string cannot fail.
        let _ = writeln!(
            csv,
            "{},{:.4},{:.6},{},{}",
            r.accumulation_frames,
            r.frames_per_second,
            r.renewal_seconds,
            r.printed_frames_per_second,
            r.printed_renewal_seconds
        );
    }
    let text = format!(
        "{}\nabout {PHOTONS} photons in the map throughout, {TRIANGLES} triangles, {} threads; the renewal time is that of so many frames\n",
        table.text(),
        origin.threads
    );
    let line = |name: &str, i: usize, f: fn(&Row) -> f64| Series {
        name: name.into(),
        color: ink(i),
        line: rows.iter().map(|r| (f64::from(r.accumulation_frames), f(r))).collect(),
        marks: true,
        ..Series::default()
    };
    let axes = |title: &str, series| Axes {
        title: title.into(),
        x: "accumulation frames".into(),
        y: "over one accumulation frame".into(),
        series,
        levels: Vec::new(),
    };
    let plot = Plot {
        title: "Frame rate and renewal time over accumulation frames".into(),
        subtitle: origin.subtitle(),
        axes: vec![
            axes("frame rate", vec![line("measured", 0, |r| r.rate_ratio[0]), line("printed", 1, |r| r.rate_ratio[1])]),
            axes(
                "renewal time",
                vec![line("measured", 0, |r| r.renewal_ratio[0]), line("printed", 1, |r| r.renewal_ratio[1])],
            ),
        ],
    };
    let picture = draw(&plot).map_err(Failure::Work)?;
    let report = Report { origin: &origin, photons: PHOTONS, triangles: TRIANGLES, rows: &rows };
    origin.write(folder, &picture, &csv, &report, &text)
}

/// Frames of a run: enough after the map is full.
fn frames_of(accumulation: u32) -> u64 {
    u64::from(accumulation) * 2 + 60
}
