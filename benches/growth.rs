//! How time and memory of each phase of a render grow: photons, triangles, pixels, k and N over decades.
//!
//! `cargo bench --bench growth` runs the command for each point, and writes tables with fitted exponents and log-log plots
//! to `target/growth`. Names of sweeps after `--` choose some; `--quick` leaves out the last point of each, which
//! may need ten gigabytes. Memory is the process's largest resident set.

#![allow(clippy::expect_used, missing_docs, reason = "a failed expectation is how this program reports")]

use cusp::export::plot::{Axes, Plot, Series, draw, ink};
use cusp::export::png_file;
use serde_json::Value;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Phases of a render, as the report names them.
const PHASES: [&str; 8] = ["load", "bvh", "plan", "photon_trace", "map_build", "view_trace", "gather", "estimate"];

/// Seconds below which a phase says nothing about its growth.
const SHORTEST: f64 = 0.004;
/// Runs that take less are made three times, and the median counts.
const SHORT_RUN: f64 = 5.0;

/// One quantity, and what is run for each of its values.
struct Sweep {
    name: &'static str,
    values: &'static [u64],
    command: fn(u64, &Path) -> Vec<String>,
}

const SWEEPS: [Sweep; 6] = [
    Sweep {
        name: "photons",
        values: &[10_000, 100_000, 1_000_000, 10_000_000, 100_000_000],
        command: |n, _| words(&format!("cornell --size 128x128 --footprint-scale 1 --photons {n}")),
    },
    Sweep {
        name: "caustic_photons",
        values: &[10_000, 100_000, 1_000_000, 10_000_000, 100_000_000],
        command: |n, _| words(&format!("ring --size 128x128 --footprint-scale 1 --photons {n}")),
    },
    Sweep {
        name: "triangles",
        values: &[100, 1_000, 10_000, 100_000, 1_000_000, 10_000_000],
        command: |n, folder| words(&format!("{} --size 256x256 --photons 200000", rings(n, folder).display())),
    },
    Sweep {
        name: "pixels",
        values: &[128 * 128, 256 * 256, 512 * 512, 1024 * 1024, 2048 * 2048, 4096 * 4096],
        command: |n, _| words(&format!("ring --size {0}x{0} --photons 200000", n.isqrt())),
    },
    Sweep {
        name: "k",
        values: &[10, 32, 100, 316, 1000],
        command: |n, _| words(&format!("cornell --gather knn --k {n} --size 128x128 --photons 200000")),
    },
    Sweep {
        name: "N",
        values: &[2, 4, 8, 16, 32],
        command: |n, _| words(&format!("ring --estimator multi_sampled:n={n} --size 512x512 --photons 200000")),
    },
];

fn words(text: &str) -> Vec<String> {
    text.split(' ').map(str::to_owned).collect()
}

/// A scene of some `triangles` in three mirror rings, six for each of their segments.
fn rings(triangles: u64, folder: &Path) -> PathBuf {
    let path = folder.join(format!("rings-{triangles}.toml"));
    let ring = |inner: f64| {
        format!(
            "[[shapes]]\nkind = \"ring\"\ninner = {inner:.1}\nouter = {:.1}\nheight = 0.5\nsegments = {}\nmaterial = \"metal\"\n",
            inner + 0.1,
            (triangles / 18).max(3)
        )
    };
    let text = format!(
        "[camera]\nposition = [0.0, 3.6, 4.2]\ntarget = [0.0, 0.15, 0.0]\nfov_y = 35.0\n\
         [materials.floor]\nkind = \"diffuse\"\nreflectance = [0.8, 0.8, 0.8]\n\
         [materials.metal]\nkind = \"mirror\"\nreflectance = [1.0, 1.0, 1.0]\n\
         [[shapes]]\nkind = \"quad\"\ncenter = [0.0, 0.0, 0.0]\nu = [10.0, 0.0, 0.0]\nv = [0.0, 0.0, -10.0]\nmaterial = \"floor\"\n\
         {}{}{}[[lights]]\nkind = \"point\"\nposition = [-2.5, 2.2, -1.2]\npower = [100.0, 100.0, 100.0]\n",
        ring(1.0),
        ring(1.5),
        ring(2.0)
    );
    std::fs::write(&path, text).expect("a folder that can be written to");
    path
}

/// What one run took.
#[derive(Clone)]
struct Point {
    value: u64,
    /// Seconds of each phase.
    seconds: [f64; PHASES.len()],
    total: f64,
    /// Largest resident set, bytes.
    memory: f64,
    /// What was stated before, bytes.
    stated: f64,
}

fn run(sweep: &Sweep, value: u64, folder: &Path) -> Point {
    let stats = folder.join("stats.json");
    let output = Command::new(env!("CARGO_BIN_EXE_cusp"))
        .arg("render")
        .args((sweep.command)(value, folder))
        .args(["--quiet", "--stats"])
        .arg(&stats)
        .arg("--output")
        .arg(folder.join("image.exr"))
        .output()
        .expect("the command starts");
    assert!(output.status.success(), "{} {value}: {}", sweep.name, String::from_utf8_lossy(&output.stderr));
    let report: Value = serde_json::from_str(&std::fs::read_to_string(stats).expect("written")).expect("JSON");
    let seconds = PHASES.map(|phase| report["seconds"][phase].as_f64().expect("seconds"));
    let part = |name: &str| report["memory"][name].as_f64().unwrap_or_default();
    Point {
        value,
        seconds,
        total: report["seconds"]["total"].as_f64().expect("seconds"),
        memory: report["peak_rss_bytes"].as_f64().expect("bytes"),
        stated: part("images") + part("photons") + part("maps"),
    }
}

/// The run of median time among three, or the only one if it is long.
fn measured(sweep: &Sweep, value: u64, folder: &Path) -> Point {
    let mut runs = vec![run(sweep, value, folder)];
    while runs[0].total < SHORT_RUN && runs.len() < 3 {
        runs.push(run(sweep, value, folder));
    }
    runs.sort_by(|a, b| a.total.total_cmp(&b.total));
    let phase = |i: usize| {
        let mut all: Vec<f64> = runs.iter().map(|r| r.seconds[i]).collect();
        all.sort_by(f64::total_cmp);
        all[all.len() / 2]
    };
    Point { seconds: std::array::from_fn(phase), ..runs[runs.len() / 2].clone() }
}

/// Exponent of a power law through points by least squares of logarithms; None for fewer than three.
fn exponent(points: &[(f64, f64)]) -> Option<f64> {
    let n = points.len() as f64;
    if points.len() < 3 {
        return None;
    }
    let logs: Vec<(f64, f64)> = points.iter().map(|(x, y)| (x.ln(), y.ln())).collect();
    let (mx, my) = (logs.iter().map(|p| p.0).sum::<f64>() / n, logs.iter().map(|p| p.1).sum::<f64>() / n);
    let covariance: f64 = logs.iter().map(|(x, y)| (x - mx) * (y - my)).sum();
    let variance: f64 = logs.iter().map(|(x, _)| (x - mx).powi(2)).sum();
    Some(covariance / variance)
}

/// Points of a phase that last long enough to say something.
fn curve(points: &[Point], phase: usize) -> Vec<(f64, f64)> {
    points.iter().map(|p| (p.value as f64, p.seconds[phase])).filter(|(_, s)| *s >= SHORTEST).collect()
}

/// Memory beyond what the smallest run takes.
fn memory(points: &[Point]) -> Vec<(f64, f64)> {
    let least = points.iter().map(|p| p.memory).fold(f64::INFINITY, f64::min);
    let grown = points.iter().map(|p| (p.value as f64, p.memory - least));
    grown.filter(|(_, bytes)| *bytes > 0.5 * least).collect()
}

fn table(sweep: &Sweep, points: &[Point]) -> String {
    let mut text = format!(
        "| {} | {} | peak, MB | stated, MB |\n|{}\n",
        sweep.name,
        PHASES.join(" | "),
        " --- |".repeat(PHASES.len() + 3)
    );
    for p in points {
        let seconds: Vec<String> = p.seconds.iter().map(|s| format!("{s:.4}")).collect();
        let megabytes = [p.memory, p.stated].map(|b| format!("{:.1}", b / 1e6));
        writeln!(text, "| {} | {} | {} |", p.value, seconds.join(" | "), megabytes.join(" | ")).expect("a string");
    }
    let shown = |e: Option<f64>| e.map_or("".into(), |e| format!("{e:.2}"));
    let exponents: Vec<String> = (0..PHASES.len()).map(|i| shown(exponent(&curve(points, i)))).collect();
    writeln!(text, "| exponent | {} | {} | |", exponents.join(" | "), shown(exponent(&memory(points))))
        .expect("a string");
    text
}

fn axes(sweep: &Sweep, points: &[Point]) -> Axes {
    let named = |name: &str, e: Option<f64>| e.map_or(name.to_owned(), |e| format!("{name}: {e:.2}"));
    let series = |i: usize| {
        let line = points.iter().map(|p| (p.value as f64, p.seconds[i])).collect();
        let name = named(PHASES[i], exponent(&curve(points, i)));
        Series { name, color: ink(i), line, marks: true, ..Default::default() }
    };
    let gigabytes = |of: fn(&Point) -> f64| points.iter().map(|p| (p.value as f64, of(p) / 1e9)).collect();
    let mut all: Vec<Series> = (0..PHASES.len()).map(series).collect();
    all.push(Series {
        name: named("memory, GB", exponent(&memory(points))),
        color: ink(PHASES.len()),
        line: gigabytes(|p| p.memory),
        dashed: true,
        ..Default::default()
    });
    Axes { title: String::new(), x: sweep.name.into(), y: "seconds".into(), series: all, levels: Vec::new() }
}

fn main() {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let quick = words.iter().any(|w| w == "--quick");
    let chosen: Vec<&String> = words.iter().filter(|w| !w.starts_with("--")).collect();
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("target/growth");
    std::fs::create_dir_all(&folder).expect("a folder that can be written to");
    for sweep in SWEEPS.iter().filter(|s| chosen.is_empty() || chosen.iter().any(|c| *c == s.name)) {
        let values = &sweep.values[..sweep.values.len() - usize::from(quick)];
        let points: Vec<Point> = values.iter().map(|&value| measured(sweep, value, &folder)).collect();
        let text = table(sweep, &points);
        println!("{text}");
        std::fs::write(folder.join(format!("{}.md", sweep.name)), text).expect("written");
        let plot = Plot {
            title: format!("Growth with {}", sweep.name),
            subtitle: "time of each phase, and fitted exponents".into(),
            axes: vec![axes(sweep, &points)],
        };
        let canvas = draw(&plot).expect("a plot");
        let file = folder.join(format!("{}.png", sweep.name));
        png_file::write_with(&file, canvas.size, &canvas.rgb, &[]).expect("written");
    }
}
