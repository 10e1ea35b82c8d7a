//! `realtime-timing`: parts of a frame by themselves, and in their context (section 4.5.1).

use super::{origin, parameters, rooms, run_settings, stopped};
use crate::cli::failure::Failure;
use crate::cli::paper::PaperFlags;
use crate::cli::paper::bars::{self, Bar, Chart, Segment};
use crate::cli::paper::output::{Done, Origin};
use crate::cli::progress::{bar, interrupted};
use crate::cli::realtime::SIZE;
use crate::cli::table::Table;
use crate::export::plot::INKS;
use crate::measure::realtime::RunReport;
use crate::measure::realtime::tables::{Isolated, isolated, measured};
use crate::realtime::PhaseSeconds;
use serde::Serialize;
use std::fmt::Write;
use std::path::Path;

/// Primary rays a second that the paper prints for its small level of 369 triangles, and for its large one of 5,355.
const PRINTED_RAYS: [f64; 2] = [47_500.0, 6_200.0];
/// Frames of the run.
const FRAMES: u64 = 120;

#[derive(Serialize)]
struct Report<'a> {
    #[serde(flatten)]
    origin: &'a Origin,
    printed_primary_rays_per_second: [f64; 2],
    isolated: &'a [Isolated],
    in_context: &'a [RunReport],
}

/// Measures and makes the table.
///
/// # Errors
/// A wrong flag, a file that cannot be written, or an interruption.
pub fn run(item: &'static str, flags: &PaperFlags, folder: &Path) -> Result<Done, Failure> {
    let scene = rooms()?;
    let settings = parameters(&scene, flags, &[])?;
    let progress = bar(2 * FRAMES, item, flags.quiet || flags.json);
    let alone = isolated(&scene, &settings, 1.0);
    let mut runs = Vec::new();
    for turn in [0.0, 2.0] {
        let going_on = || {
            progress.inc(1);
            !interrupted()
        };
        let how = run_settings(flags, FRAMES, turn);
        runs.push(measured(&scene, settings.clone(), &how, going_on).ok_or_else(|| stopped(item))?);
    }
    progress.finish_and_clear();
    let origin = origin(item, "Kristensen and Ottosen 2003, sections 4.5.1 and 6.3", &scene, flags, SIZE)?;
    let mut table = Table::new(["by itself", "in a second"]);
    let mut csv = String::from("what,value\n");
    for i in &alone {
        table.row([i.what.to_owned(), format!("{:.0}", i.per_second)]);
        // Writing to a string cannot fail.
        let _ = writeln!(csv, "\"{} per second\",{:.1}", i.what, i.per_second);
    }
    let mut text = table.text();
    let _ = writeln!(
        text,
        "\nprinted: {} primary rays a second in a level of 369 triangles, {} in one of 5,355, on a Pentium 4 of 3 GHz\n",
        PRINTED_RAYS[0], PRINTED_RAYS[1]
    );
    let mut context = Table::new(["phase in context", "still: ms", "turning: ms"]);
    for (i, name) in PhaseSeconds::NAMES.iter().enumerate() {
        let ms = |r: &RunReport| format!("{:.3}", 1e3 * r.phase_seconds.all()[i]);
        context.row([(*name).to_owned(), ms(&runs[0]), ms(&runs[1])]);
        let _ = writeln!(csv, "\"{name} seconds, still\",{:.6}", runs[0].phase_seconds.all()[i]);
        let _ = writeln!(csv, "\"{name} seconds, turning\",{:.6}", runs[1].phase_seconds.all()[i]);
    }
    context.row([
        "frame".to_owned(),
        format!("{:.3}", 1e3 * runs[0].frame_seconds[1]),
        format!("{:.3}", 1e3 * runs[1].frame_seconds[1]),
    ]);
    text += &context.text();
    let _ = writeln!(
        text,
        "\nmedians of {FRAMES} frames of rooms as it is; turning: 2 degrees a frame; {} threads",
        origin.threads
    );
    let rows = runs.iter().zip(["camera still", "camera turning"]).map(|(r, label)| Bar {
        label: label.into(),
        segments: r.phase_seconds.all().iter().zip(INKS).map(|(s, color)| Segment { value: *s, color }).collect(),
        number: format!("{:.2} ms", 1e3 * r.frame_seconds[1]),
    });
    let chart = Chart {
        title: "Where a frame's time goes".into(),
        subtitle: origin.subtitle(),
        legend: PhaseSeconds::NAMES.iter().zip(INKS).map(|(n, c)| ((*n).to_owned(), c)).collect(),
        bars: rows.collect(),
        note: String::new(),
    };
    let picture = bars::draw(&chart, 1000);
    let report =
        Report { origin: &origin, printed_primary_rays_per_second: PRINTED_RAYS, isolated: &alone, in_context: &runs };
    origin.write(folder, &picture, &csv, &report, &text)
}
