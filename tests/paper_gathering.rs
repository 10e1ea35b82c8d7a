//! The items of `cusp paper` on final gathering, at tiny sizes: their files, columns and numbers.

#![allow(clippy::expect_used, missing_docs, reason = "a failed expectation is how this program reports")]

use serde_json::Value;
use std::process::Command;

/// Runs an item; returns its JSON, its CSV and the folder of its files, where references are kept as well.
fn run(item: &str, more: &[&str]) -> (Value, String, tempfile::TempDir) {
    let folder = tempfile::tempdir().expect("a folder");
    let out = folder.path().to_str().expect("a plain path");
    let run = Command::new(env!("CARGO_BIN_EXE_cusp"))
        .args(["paper", item, "--json", "--out", out])
        .args(more)
        .env("CUSP_CACHE", out)
        .output()
        .expect("the binary runs");
    assert!(run.status.success(), "{item}: {}", String::from_utf8_lossy(&run.stderr));
    let json: Value = serde_json::from_slice(&run.stdout).expect("JSON");
    let stored = std::fs::read_to_string(folder.path().join(format!("{item}.json"))).expect("a file");
    assert_eq!(serde_json::from_str::<Value>(&stored).expect("JSON"), json);
    for key in ["version", "command", "seed", "scene", "scene_hash", "source", "settings", "threads"] {
        assert!(!json[key].is_null(), "{item}: {key}");
    }
    let picture = std::fs::read(folder.path().join(format!("{item}.png"))).expect("a picture");
    assert!(picture.starts_with(b"\x89PNG") && picture.len() > 2000);
    let csv = std::fs::read_to_string(folder.path().join(format!("{item}.csv"))).expect("a table");
    (json, csv, folder)
}

fn number(value: &Value) -> f64 {
    value.as_f64().expect("a number")
}

fn rows(value: &Value) -> &Vec<Value> {
    value["rows"].as_array().expect("rows")
}

#[test]
fn the_table_has_its_cells_beside_the_printed_ones() {
    let (json, csv, _folder) = run("gather-table", &["--size", "4x4", "--photons", "20000", "--repeats", "2"]);
    assert_eq!(csv.lines().count(), 1 + 27);
    let columns = csv.lines().next().expect("a heading").split(',').count();
    for line in csv.lines().skip(1) {
        // The estimator's name is quoted, and has commas.
        let parts: Vec<&str> = line.split('"').collect();
        assert_eq!(parts.len(), 3, "{line}");
        let outside = parts[0].matches(',').count() + parts[2].matches(',').count();
        assert_eq!(outside + 1, columns, "{line}");
    }
    let tables = json["tables"].as_array().expect("tables");
    let emitted: Vec<_> = tables.iter().filter_map(|t| t["photons_emitted"].as_u64()).collect();
    assert_eq!(emitted, [20_000, 10_000, 10_000]);
    for table in tables {
        assert_eq!(rows(table).len(), 9);
        for row in rows(table) {
            let parts = ["tree", "first_layer", "other_layers", "image"];
            let least: f64 = parts.iter().map(|p| number(&row[p]["least"])).sum();
            assert!(number(&row["total"]["most"]) >= least && least > 0.0, "{row}");
            let classic = row["way"] == "classic";
            assert_eq!(number(&row["first_layer"]["most"]) == 0.0, classic);
            assert_eq!(number(&row["ratio_to_classic"]["median"]) == 1.0, classic);
            assert_eq!(number(&row["printed_ratio"]) == 1.0, classic);
        }
        // Both pyramids; a sum is that of its layers, the peak holds photons and first layer.
        let memory = table["memory"].as_array().expect("memory");
        assert_eq!(memory.len(), 2);
        for m in memory {
            let layers: Vec<f64> =
                m["layers"].as_array().expect("layers").iter().map(|l| number(&l["bytes"])).collect();
            assert!(layers.len() > 2 && layers.iter().sum::<f64>() == number(&m["sum"]), "{m}");
            assert!(number(&m["peak"]) >= number(&m["photon_map"]) + layers[0]);
        }
    }
    assert!(json["layers_on_disk"].as_str().expect("a sentence").starts_with("saving each layer on disk"));
    assert!(number(&json["reference"]["relative_noise"]) > 0.0);
}

/// The photon map's estimate at the edge loses what the disc holds no surface for; the other three do not.
#[test]
fn figure_1_shows_the_loss_at_the_edge() {
    let (json, csv, _folder) = run("gather-figure-1", &[]);
    assert_eq!((rows(&json).len(), csv.lines().count()), (4, 5));
    let mean = |i: usize| number(&rows(&json)[i]["mean_ratio"]);
    assert!(mean(0) < 0.75, "{}", mean(0));
    assert!(mean(0) < mean(2) && mean(2) < mean(3), "{} {}", mean(2), mean(3));
    // Six standard deviations of the mean over overlapping discs of some 600 photons.
    assert!((mean(1) - 1.0).abs() < 0.06 && (mean(3) - 1.0).abs() < 0.06, "{} {}", mean(1), mean(3));
}

#[test]
fn figure_2_keeps_distances() {
    let (json, csv, _folder) = run("gather-figure-2", &["--photons", "30000"]);
    assert_eq!(csv.lines().count(), 4);
    let all: Vec<f64> = rows(&json).iter().map(|r| number(&r["all"])).collect();
    assert!(all[0] > all[1] && all[1] > all[2] && all[2] > 0.0, "{all:?}");
    for layer in &rows(&json)[1..] {
        assert!(number(&layer["spacing"]) >= 1.0, "{layer}");
    }
}

#[test]
fn figure_3_measures_coverage() {
    let (json, csv, _folder) = run("gather-figure-3", &[]);
    assert_eq!((rows(&json).len(), csv.lines().count()), (9, 10));
    let of = |width: &str, pattern: &str| {
        rows(&json).iter().find(|r| r["width"] == width && r["pattern"] == pattern).expect("a row")
    };
    for row in rows(&json) {
        let (covered, twice) = (number(&row["covered"]), number(&row["more_than_once"]));
        assert!(0.0 < twice && twice < covered + 1e-12 && covered <= 1.0, "{row}");
    }
    // Published footprints cover everything many times; a spiral's own share it better than random strata.
    assert!(number(&of("as_published", "stratified")["mean"]) > 6.0);
    let (spiral, strata) = (of("corrected", "spiral"), of("corrected", "stratified"));
    assert!(number(&spiral["covered"]) > number(&strata["covered"]) + 0.05);
    assert!(number(&spiral["more_than_once"]) < number(&strata["more_than_once"]));
}

#[test]
fn figures_4_and_5_have_their_ways() {
    for (item, rays) in [("gather-figure-4", 200), ("gather-figure-5", 800)] {
        let (json, csv, _folder) = run(item, &["--size", "6x6", "--photons", "20000"]);
        assert_eq!((rows(&json).len(), csv.lines().count()), (4, 5));
        assert_eq!(json["rays"], rays);
        let ways: Vec<_> = rows(&json).iter().filter_map(|r| r["way"].as_str()).collect();
        assert_eq!(ways, ["classic", "as_published", "corrected", "spiral"]);
        assert!(rows(&json).iter().all(|r| number(&r["image_s"]) > 0.0));
    }
}
