//! The items of `cusp paper` on the pi-engine: their files, columns, printed values and demands, at small sizes.

#![allow(clippy::expect_used, missing_docs, reason = "a failed expectation is how this program reports")]

use serde_json::Value;
use std::process::Command;

/// Runs an item; returns its JSON and its CSV.
fn run(item: &str, more: &[&str]) -> (Value, String) {
    let folder = tempfile::tempdir().expect("a folder");
    let out = folder.path().to_str().expect("a plain path");
    let run = Command::new(env!("CARGO_BIN_EXE_cusp"))
        .args(["paper", item, "--json", "--out", out])
        .args(more)
        .output()
        .expect("the binary runs");
    assert!(run.status.success(), "{item}: {}", String::from_utf8_lossy(&run.stderr));
    let json: Value = serde_json::from_slice(&run.stdout).expect("JSON");
    for key in ["version", "command", "seed", "scene", "scene_hash", "source", "threads", "files"] {
        assert!(!json[key].is_null(), "{item}: {key}");
    }
    let picture = std::fs::read(folder.path().join(format!("{item}.png"))).expect("a picture");
    assert!(picture.starts_with(b"\x89PNG") && picture.len() > 2000);
    let csv = std::fs::read_to_string(folder.path().join(format!("{item}.csv"))).expect("a table");
    (json, csv)
}

fn number(value: &Value) -> f64 {
    value.as_f64().expect("a number")
}

#[test]
fn frame_rates_stand_beside_the_printed_ones() {
    let (json, csv) = run("realtime-table-6.1", &["--size", "16x12"]);
    assert_eq!(csv.lines().count(), 1 + 2 * 49);
    assert_eq!(json["printed"][3][3], 58.0);
    for grid in json["grids"].as_array().expect("grids") {
        let (rates, ratios) = (&grid["frames_per_second"], &grid["ratio_to_printed"]);
        for t in 0..7 {
            for p in 0..7 {
                let (rate, ratio) = (number(&rates[t][p]), number(&ratios[t][p]));
                assert!(rate > 0.0 && (rate / number(&json["printed"][t][p]) - ratio).abs() < 1e-9 * ratio);
            }
        }
    }
    assert_eq!(json["demands"].as_array().map(Vec::len), Some(8));
}

#[test]
fn renewal_takes_as_many_frames_as_the_map_holds() {
    let (json, _) = run("realtime-table-6.2", &["--size", "16x12"]);
    let rows = json["rows"].as_array().expect("rows");
    let frames: Vec<u64> = rows.iter().filter_map(|r| r["accumulation_frames"].as_u64()).collect();
    assert_eq!(frames, [1, 2, 4, 8, 16, 32, 64]);
    for (r, n) in rows.iter().zip(frames) {
        let expected = n as f64 / number(&r["frames_per_second"]);
        assert!((number(&r["renewal_seconds"]) / expected - 1.0).abs() < 1e-9);
    }
    assert_eq!(rows[4]["printed_frames_per_second"], 8.25);
}

/// What the searches and areas owe: less surface bias by the slice, less boundary bias by the hull.
#[test]
fn biases_are_told_apart() {
    let (json, csv) = run("realtime-bias", &["--photons", "8000", "--repeats", "1"]);
    assert_eq!(csv.lines().count(), 1 + 2 * 11 * 4);
    for v in json["verdicts"].as_array().expect("verdicts") {
        assert!(number(&v["surface_bias_removed"]) > 0.9, "{v}");
        assert!(number(&v["boundary_bias_left_by_hull"]) < 0.5, "{v}");
    }
}

/// Coherent numbers leave at most a tenth of the fluctuation away from what moves, by every distribution.
#[test]
fn coherent_numbers_calm_all_distributions() {
    let (json, csv) = run("realtime-fluctuation", &["--photons", "200"]);
    assert_eq!(csv.lines().count(), 1 + 6);
    for r in json["rows"].as_array().expect("rows") {
        assert!(number(&r["reduction"][1]) > 0.9 && number(&r["incoherent"][1]) > 0.01, "{r}");
        assert!(r["away"].as_u64() > Some(100), "{r}");
    }
}

/// Every picture is made, and those of the box are held against its reference.
#[test]
fn pictures_are_made() {
    for (figure, pictures, size) in
        [(1, 3, "64x64"), (2, 5, "32x32"), (3, 3, "32x32"), (7, 2, "40x30"), (9, 3, "160x120")]
    {
        let (json, csv) = run(&format!("realtime-figure-6.{figure}"), &["--size", size, "--photons", "20000"]);
        let all = json["pictures"].as_array().expect("pictures");
        assert_eq!((all.len(), csv.lines().count()), (pictures, 1 + pictures), "{figure}");
        assert!(json["printed"].as_str().is_some_and(|p| p.len() > 10));
        if figure == 1 {
            let error = |i: usize| number(&all[i]["relative_rmse"]);
            // The slice keeps what the ball lets leak, and the hull what the slice loses at edges.
            assert!(error(0) < error(1) && error(2) < error(1), "{} {} {}", error(0), error(1), error(2));
        }
        if figure == 9 {
            let estimates = |i: usize| number(&all[i]["last"]["estimates"]);
            assert!(estimates(1) > 3.0 * estimates(0));
        }
    }
}

#[test]
fn distributions_have_their_discrepancies() {
    let (json, csv) = run("realtime-scattering", &["--size", "32x32"]);
    assert_eq!(csv.lines().count(), 1 + 6 * 5);
    assert_eq!(json["scattering"].as_array().map(Vec::len), Some(12));
}
