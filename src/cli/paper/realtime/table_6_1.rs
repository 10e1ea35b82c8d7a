//! `realtime-table-6.1`: frames per second over triangles and photons.

use super::{origin, parameters, rooms, run_settings, stopped};
use crate::cli::failure::Failure;
use crate::cli::paper::PaperFlags;
use crate::cli::paper::output::{Done, Origin};
use crate::cli::progress::{bar, interrupted};
use crate::cli::realtime::SIZE;
use crate::cli::table::Table;
use crate::export::plot::{Axes, Plot, Series, draw, ink};
use crate::measure::realtime::tables::{GRID, PRINTED_GRID, measured, with_counts};
use crate::measure::study::power_law::PowerLaw;
use serde::Serialize;
use std::fmt::Write;
use std::path::Path;

/// Frames of each cell.
const FRAMES: u64 = 60;
/// Degrees by which the camera turns from frame to frame where it does.
const TURN: f64 = 2.0;

/// Frames per second of a grid, a row for each number of triangles.
#[derive(Serialize)]
struct Grid {
    accumulation_frames: u32,
    frames_per_second: Vec<Vec<f64>>,
    /// Ours over the printed ones.
    ratio_to_printed: Vec<Vec<f64>>,
    /// Exponents of the frame's seconds over photons, one for each number of triangles, and over triangles.
    exponents_of_rows: Vec<Option<f64>>,
    exponents_of_columns: Vec<Option<f64>>,
    /// Share of the variance of the frame's seconds that `a + b triangles + c photons` explains.
    explained_by_sum: f64,
}

/// A cell with a demand on it.
#[derive(Serialize)]
struct Demand {
    triangles: u32,
    photons: u32,
    accumulation_frames: u32,
    camera: &'static str,
    frames_per_second: f64,
    wanted: f64,
    holds: bool,
}

#[derive(Serialize)]
struct Report<'a> {
    #[serde(flatten)]
    origin: &'a Origin,
    triangles: [u32; 7],
    photons: [u32; 7],
    printed: [[f64; 7]; 7],
    grids: &'a [Grid],
    demands: &'a [Demand],
}

/// Measures and makes the table.
///
/// # Errors
/// A wrong flag, a file that cannot be written, or an interruption.
pub fn run(item: &'static str, flags: &PaperFlags, folder: &Path) -> Result<Done, Failure> {
    let scene = rooms()?;
    let hidden = flags.quiet || flags.json;
    let progress = bar((2 * 49 + 8) * FRAMES, item, hidden);
    let rate = |triangles: u32, photons: u32, frames: u32, turn: f64| {
        let plain = parameters(&scene, flags, &[&format!("accumulation_frames={frames}")])?;
        let s = with_counts(&scene, &plain, triangles, photons);
        let how = run_settings(flags, FRAMES, turn);
        let going_on = || {
            progress.inc(1);
            !interrupted()
        };
        measured(&scene, s, &how, going_on).map(|r| r.frames_per_second).ok_or_else(|| stopped(item))
    };
    let mut grids = Vec::new();
    for frames in [10, 1] {
        let mut rows = Vec::new();
        for triangles in GRID {
            let row: Result<Vec<f64>, Failure> = GRID.iter().map(|&p| rate(triangles, p, frames, 0.0)).collect();
            rows.push(row?);
        }
        grids.push(grid(frames, rows));
    }
    let mut demands = Vec::new();
    for (count, wanted) in [(12_800, 60.0), (25_600, 30.0)] {
        for frames in [10, 1] {
            for (camera, turn) in [("still", 0.0), ("turning 2 degrees a frame", TURN)] {
                let found = rate(count, count, frames, turn)?;
                demands.push(Demand {
                    triangles: count,
                    photons: count,
                    accumulation_frames: frames,
                    camera,
                    frames_per_second: found,
                    wanted,
                    holds: found >= wanted,
                });
            }
        }
    }
    progress.finish_and_clear();
    let origin = origin(item, "Kristensen and Ottosen 2003, table 6.1", &scene, flags, SIZE)?;
    let picture = draw(&plot(&grids, &origin)).map_err(Failure::Work)?;
    let report = Report {
        origin: &origin,
        triangles: GRID,
        photons: GRID,
        printed: PRINTED_GRID,
        grids: &grids,
        demands: &demands,
    };
    origin.write(folder, &picture, &csv(&grids), &report, &text(&grids, &demands, &origin))
}

fn grid(accumulation_frames: u32, rates: Vec<Vec<f64>>) -> Grid {
    let exponent = |seconds: &dyn Fn(usize) -> f64| {
        PowerLaw::fit(GRID.iter().enumerate().map(|(i, &n)| (f64::from(n), seconds(i)))).map(|p| p.exponent)
    };
    let at = |t: usize, p: usize| 1.0 / rates[t][p].max(f64::MIN_POSITIVE);
    Grid {
        accumulation_frames,
        ratio_to_printed: rates
            .iter()
            .zip(PRINTED_GRID)
            .map(|(r, p)| r.iter().zip(p).map(|(a, b)| a / b).collect())
            .collect(),
        exponents_of_rows: (0..7).map(|t| exponent(&|p| at(t, p))).collect(),
        exponents_of_columns: (0..7).map(|p| exponent(&|t| at(t, p))).collect(),
        explained_by_sum: explained(&rates),
        frames_per_second: rates,
    }
}

/// R² of the seconds over `1, triangles, photons`, by least squares.
fn explained(rates: &[Vec<f64>]) -> f64 {
    let rows: Vec<([f64; 3], f64)> = GRID
        .iter()
        .enumerate()
        .flat_map(|(t, &triangles)| {
            GRID.iter().enumerate().map(move |(p, &photons)| {
                ([1.0, f64::from(triangles) / 1e4, f64::from(photons) / 1e4], 1.0 / rates[t][p].max(f64::MIN_POSITIVE))
            })
        })
        .collect();
    let mut a = glam::DMat3::ZERO;
    let mut b = glam::DVec3::ZERO;
    for (x, y) in &rows {
        let x = glam::DVec3::from_array(*x);
        a += glam::DMat3::from_cols(x * x.x, x * x.y, x * x.z);
        b += x * *y;
    }
    let fit = a.inverse() * b;
    let mean = rows.iter().map(|r| r.1).sum::<f64>() / rows.len() as f64;
    let (mut left, mut all) = (0.0, 0.0);
    for (x, y) in &rows {
        left += (y - fit.dot(glam::DVec3::from_array(*x))).powi(2);
        all += (y - mean).powi(2);
    }
    if all > 0.0 { 1.0 - left / all } else { 0.0 }
}

fn text(grids: &[Grid], demands: &[Demand], origin: &Origin) -> String {
    let mut out = String::new();
    for g in grids {
        let mut table =
            Table::new(std::iter::once("triangles \\ photons".to_owned()).chain(GRID.map(|p| p.to_string())));
        for (t, triangles) in GRID.iter().enumerate() {
            let cells = (0..7).map(|p| format!("{:.0} (x {:.1})", g.frames_per_second[t][p], g.ratio_to_printed[t][p]));
            table.row(std::iter::once(triangles.to_string()).chain(cells));
        }
        let span = |e: &[Option<f64>]| {
            let known: Vec<f64> = e.iter().flatten().copied().collect();
            let ends = known.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| (l.min(*x), h.max(*x)));
            format!("{:.2} to {:.2}", ends.0, ends.1)
        };
        // Writing to a string cannot fail.
        let _ = write!(
            out,
            "frames per second, {} accumulation frame(s), camera still; in brackets over the printed rate\n{}seconds grow as photons^{} along rows, as triangles^{} along columns; a + b triangles + c photons explains {:.1} % of their variance\n\n",
            g.accumulation_frames,
            table.text(),
            span(&g.exponents_of_rows),
            span(&g.exponents_of_columns),
            100.0 * g.explained_by_sum
        );
    }
    for d in demands {
        let _ = writeln!(
            out,
            "{} triangles, {} photons, {} accumulation frame(s), camera {}: {:.1} frames per second, wanted {}: {}",
            d.triangles,
            d.photons,
            d.accumulation_frames,
            d.camera,
            d.frames_per_second,
            d.wanted,
            if d.holds { "holds" } else { "falls short" }
        );
    }
    let _ = writeln!(
        out,
        "photons are those of the map; the median of {FRAMES} frames less the first; {} threads; the printed machine was a Pentium 4 of 3 GHz with a graphics card",
        origin.threads
    );
    out
}

fn csv(grids: &[Grid]) -> String {
    let mut out = String::from("accumulation_frames,triangles,photons,frames_per_second,printed,ratio\n");
    for g in grids {
        for (t, triangles) in GRID.iter().enumerate() {
            for (p, photons) in GRID.iter().enumerate() {
                let (rate, printed) = (g.frames_per_second[t][p], PRINTED_GRID[t][p]);
                let _ = writeln!(
                    out,
                    "{},{triangles},{photons},{rate:.3},{printed},{:.3}",
                    g.accumulation_frames,
                    rate / printed
                );
            }
        }
    }
    out
}

fn plot(grids: &[Grid], origin: &Origin) -> Plot {
    let along = |g: &Grid, by_photons: bool, title: &str| Axes {
        title: title.into(),
        x: if by_photons { "photons in the map".into() } else { "triangles".into() },
        y: "seconds of a frame".into(),
        series: (0..7)
            .map(|k| {
                let at = |i: usize| if by_photons { g.frames_per_second[k][i] } else { g.frames_per_second[i][k] };
                Series {
                    // One legend serves all: rows have so many triangles, columns so many photons.
                    name: format!("{} triangles, along columns photons", GRID[k]),
                    color: ink(k),
                    line: (0..7).map(|i| (f64::from(GRID[i]), 1.0 / at(i))).collect(),
                    marks: true,
                    ..Series::default()
                }
            })
            .collect(),
        ..Axes::default()
    };
    let mut axes = Vec::new();
    for g in grids {
        let n = g.accumulation_frames;
        axes.push(along(g, true, &format!("along rows, {n} accumulation frame(s)")));
        axes.push(along(g, false, &format!("along columns, {n} accumulation frame(s)")));
    }
    Plot { title: "Seconds of a frame over triangles and photons".into(), subtitle: origin.subtitle(), axes }
}
