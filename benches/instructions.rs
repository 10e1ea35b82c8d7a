//! Instructions of small fixed workloads, counted by `valgrind --tool=callgrind` and held against those on record.
//!
//! `cargo bench --bench instructions` prints a table and ends with 1 if a workload takes 3 % more than on record;
//! `cargo bench --bench instructions -- --save` puts the new counts on record. Without valgrind it says so and ends with 0.

#![allow(clippy::expect_used, clippy::panic, missing_docs, reason = "a failed expectation is how this program reports")]

use cusp::estimate::registry::estimators;
use cusp::math::frame::uniform_sphere;
use cusp::math::sequence::{Sampling, Sequence};
use cusp::photons::kd_tree::{KdTree, Nearest, NearestQuery};
use cusp::render::{RenderSettings, Renderer, Silent};
use cusp::scene::open;
use cusp::scene::scene_file::RenderFile;
use cusp::trace::Ray;
use glam::Vec3;
use std::collections::BTreeMap;
use std::hint::black_box;
use std::path::Path;
use std::process::{Command, ExitCode};

/// Part by which a count may grow.
const TOLERANCE: f64 = 0.03;
const RECORD: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/benches/instructions.toml");

/// Prepares a workload and does it so many times.
type Workload = fn(u32);

const WORKLOADS: [(&str, Workload); 8] = [
    ("nearest", nearest),
    ("closest", closest),
    ("photons_ring", |times| photons("ring", times)),
    ("photons_cornell", |times| photons("cornell", times)),
    ("view_regular", |times| view("regular", times)),
    ("view_coplanar", |times| view("coplanar", times)),
    ("view_multi_sampled", |times| view("multi_sampled:n=8,grid=cells", times)),
    ("view_integrated", |times| view("integrated", times)),
];

/// A thousand searches for the 50 nearest of 50,000 photons on a wall.
fn nearest(times: u32) {
    let sequence = Sequence::new(Sampling::Random, 1);
    let at = |i: u64, set| {
        let x = sequence.four(i, set);
        Vec3::new(x[0], 0.0, x[1])
    };
    let tree = KdTree::new((0..50_000).map(|i| at(i, 0)));
    let mut found = Nearest::new();
    for _ in 0..times {
        for i in 0..1000 {
            let query = NearestQuery { center: at(i, 1), radius: f32::INFINITY, k: 50, normal: Vec3::Y, slice: 0.01 };
            tree.nearest(&query, &mut found, |_| true);
            black_box(found.len());
        }
    }
}

fn renderer(scene: &str, estimator: &str, photons: i64, size: u32) -> Renderer {
    let scene = open(scene).expect("built in");
    // Without a projection map: what is on record is the work for so many photons of all directions.
    let projection_map = Some("off".into());
    let flags = RenderFile { photons: Some(photons), projection_map, ..Default::default() };
    let settings = RenderSettings::new(&scene, &flags, Some([size, size]), 1).expect("valid");
    Renderer::new(scene.into(), settings, estimators(estimator).expect("registered"))
}

/// Ten thousand rays about the middle of the ring.
fn closest(times: u32) {
    let renderer = renderer("ring", "integrated", 1000, 8);
    let sequence = Sequence::new(Sampling::Random, 2);
    for _ in 0..times {
        for i in 0..10_000 {
            let x = sequence.four(i, 0);
            let direction = uniform_sphere(x[0], x[1]).normalize();
            black_box(renderer.intersector().closest(&Ray { origin: Vec3::Y * 0.2, direction }));
        }
    }
}

fn photons(scene: &str, times: u32) {
    let renderer = renderer(scene, "integrated", 20_000, 8);
    for _ in 0..times {
        black_box(renderer.emitter(renderer.plan(), renderer.settings()).run(0, &|| false).emitted);
    }
}

/// A pass of the ring at 48×48 with 20,000 photons, from the photons to the image.
fn view(estimator: &str, times: u32) {
    let mut renderer = renderer("ring", estimator, 20_000, 48);
    for _ in 0..times {
        renderer.step(&Silent);
    }
}

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).filter(|a| a != "--bench").collect();
    if let [name, times] = arguments.as_slice() {
        let one = rayon::ThreadPoolBuilder::new().num_threads(1).use_current_thread().build().expect("a pool");
        let (_, workload) = WORKLOADS.iter().find(|(n, _)| n == name).expect("a workload");
        one.install(|| workload(times.parse().expect("a number")));
        return ExitCode::SUCCESS;
    }
    if Command::new("valgrind").arg("--version").output().is_err() {
        println!("valgrind is not installed: no instructions counted");
        return ExitCode::SUCCESS;
    }
    let text = std::fs::read_to_string(RECORD).unwrap_or_default();
    let record: BTreeMap<String, u64> = toml::from_str(&text).expect("a table of counts");
    let mut counts = BTreeMap::new();
    let mut slower = false;
    println!("{:<20} {:>14} {:>14} {:>7}", "workload", "instructions", "on record", "ratio");
    for (name, _) in WORKLOADS {
        // What it takes to prepare is not the workload's.
        let count = instructions(name, 1) - instructions(name, 0);
        let before = record.get(name).copied();
        let ratio = before.map(|b| count as f64 / b as f64);
        slower |= ratio.is_some_and(|r| r > 1.0 + TOLERANCE);
        let shown = |v: Option<String>| v.unwrap_or_else(|| "-".into());
        println!(
            "{name:<20} {count:>14} {:>14} {:>7}",
            shown(before.map(|b| b.to_string())),
            shown(ratio.map(|r| format!("{r:.3}")))
        );
        counts.insert(name.to_owned(), count);
    }
    if arguments.iter().any(|a| a == "--save") {
        let text = toml::to_string(&counts).expect("numbers");
        std::fs::write(RECORD, text).expect("the folder of benchmarks can be written to");
        return ExitCode::SUCCESS;
    }
    if slower { ExitCode::FAILURE } else { ExitCode::SUCCESS }
}

/// Instructions of this program when it prepares a workload and does it so many times.
fn instructions(name: &str, times: u32) -> u64 {
    let program = std::env::current_exe().expect("a path");
    let output = Command::new("valgrind")
        .args(["--tool=callgrind", "--callgrind-out-file=/dev/null"])
        .arg(Path::new(&program))
        .args([name, &times.to_string()])
        .output()
        .expect("valgrind starts");
    let text = String::from_utf8_lossy(&output.stderr);
    let collected = text.lines().find_map(|l| l.split_once("Collected : ")).map(|(_, n)| n.trim().parse());
    match collected {
        Some(Ok(count)) => count,
        _ => panic!("valgrind counted nothing for {name}: {text}"),
    }
}
