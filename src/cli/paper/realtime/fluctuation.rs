//! `realtime-fluctuation`: irradiance from frame to frame while one object moves, with and without coherent numbers.

use super::{origin, parameters, rooms, stopped};
use crate::cli::failure::Failure;
use crate::cli::paper::PaperFlags;
use crate::cli::paper::bars::{self, Bar, Chart, Segment};
use crate::cli::paper::output::{Done, Origin};
use crate::cli::progress::{bar, interrupted};
use crate::cli::realtime::SIZE;
use crate::cli::table::Table;
use crate::export::plot::INKS;
use crate::measure::realtime::fluctuation::{Fluctuation, FluctuationSettings, fluctuation};
use crate::realtime::distribution::Distribution;
use serde::Serialize;
use std::fmt::Write;
use std::path::Path;

/// Frames that are compared.
const FRAMES: u64 = 30;

#[derive(Serialize)]
struct Row {
    distribution: &'static str,
    #[serde(flatten)]
    found: Fluctuation,
    /// Over all vertices, and away from the object's influence.
    reduction: [f64; 2],
}

#[derive(Serialize)]
struct Report<'a> {
    #[serde(flatten)]
    origin: &'a Origin,
    printed_reduction: f64,
    rows: &'a [Row],
}

/// Measures and makes the table.
///
/// # Errors
/// A wrong flag, a file that cannot be written, or an interruption.
pub fn run(item: &'static str, flags: &PaperFlags, folder: &Path) -> Result<Done, Failure> {
    let scene = rooms()?;
    let progress = bar(Distribution::ALL.len() as u64, item, flags.quiet || flags.json);
    let mut rows = Vec::new();
    for kind in Distribution::ALL {
        if interrupted() {
            return Err(stopped(item));
        }
        // The flag is the number that a frame emits.
        let emitted = flags.photons.or(scene.realtime.photons_from_light).unwrap_or(200).clamp(1, 100_000);
        let texts = [
            format!("photons_from_light={emitted}"),
            format!("light_distribution={}", kind.name()),
            format!("diffuse_distribution={}", kind.name()),
            "mesh_refinement=3000".to_owned(),
        ];
        let settings = parameters(&scene, flags, &texts.each_ref().map(String::as_str))?;
        let how = FluctuationSettings { frames: FRAMES, time_step: 1.0 / 30.0, many: 10, influence: 0.02 };
        let found = fluctuation(&scene, &settings, &how);
        rows.push(Row { distribution: kind.name(), reduction: found.reduction(), found });
        progress.inc(1);
    }
    progress.finish_and_clear();
    let origin = origin(item, "Kristensen and Ottosen 2003, section 5.2.2", &scene, flags, SIZE)?;
    let mut table = Table::new([
        "directions",
        "own numbers",
        "coherent",
        "less by",
        "away: own",
        "coherent",
        "less by",
        "vertices away",
    ]);
    let mut csv = String::from(
        "distribution,incoherent,coherent,reduction,away_incoherent,away_coherent,away_reduction,away,vertices\n",
    );
    let mut chart = Vec::new();
    for r in &rows {
        let f = &r.found;
        let cell = |x: f64| format!("{:.3} %", 100.0 * x);
        table.row([
            r.distribution.to_owned(),
            cell(f.incoherent[0]),
            cell(f.coherent[0]),
            format!("{:.1} %", 100.0 * r.reduction[0]),
            cell(f.incoherent[1]),
            cell(f.coherent[1]),
            format!("{:.1} %", 100.0 * r.reduction[1]),
            format!("{} of {}", f.away, f.vertices),
        ]);
        // Writing to a string cannot fail.
        let _ = writeln!(
            csv,
            "{},{:.6},{:.6},{:.6},{:.6},{:.6},{:.6},{},{}",
            r.distribution,
            f.incoherent[0],
            f.coherent[0],
            r.reduction[0],
            f.incoherent[1],
            f.coherent[1],
            r.reduction[1],
            f.away,
            f.vertices
        );
        for (name, value, color) in [
            ("all, own numbers", f.incoherent[0], INKS[5]),
            ("all, coherent", f.coherent[0], INKS[0]),
            ("away, own numbers", f.incoherent[1], INKS[6]),
            ("away, coherent", f.coherent[1], INKS[1]),
        ] {
            chart.push(Bar {
                label: format!("{}: {name}", r.distribution),
                segments: vec![Segment { value, color }],
                number: cell(value),
            });
        }
    }
    let text = format!(
        "{}\nmean change of the irradiance of a vertex from frame to frame over its mean, {FRAMES} frames while the box moves, lights at rest;\naway: vertices whose irradiance, by ten times the photons, changes by less than 2 % while it moves; in print coherent numbers promise 90 % less\n",
        table.text()
    );
    let picture = bars::draw(
        &Chart {
            title: "Fluctuation while the box moves".into(),
            subtitle: origin.subtitle(),
            legend: Vec::new(),
            bars: chart,
            note: "away: where the box has no influence".into(),
        },
        1000,
    );
    let report = Report { origin: &origin, printed_reduction: 0.9, rows: &rows };
    origin.write(folder, &picture, &csv, &report, &text)
}
