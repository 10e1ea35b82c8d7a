//! `cusp paper` as a user meets it: every item at a small size, its files, its rows, and calls that are wrong.

#![allow(clippy::expect_used, missing_docs, reason = "a failed expectation is how this program reports")]

use serde_json::Value;
use std::path::Path;
use std::process::{Command, Output, Stdio};

fn cusp(args: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_cusp")).args(args).output().expect("the binary runs")
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

/// Runs an item at a small size; returns what it printed as JSON, and the folder of its files.
fn small(item: &str, more: &[&str]) -> (Value, tempfile::TempDir) {
    let folder = tempfile::tempdir().expect("a folder");
    let out = folder.path().to_str().expect("a plain path");
    let mut args = vec!["paper", item, "--size", "48x48", "--photons", "40000", "--json", "--out", out];
    args.extend(more);
    let run = cusp(&args);
    assert!(run.status.success(), "{item}: {}", text(&run.stderr));
    let json = serde_json::from_slice(&run.stdout).expect("JSON");
    (json, folder)
}

/// The item's three files are there, complete, and say where they come from.
fn files_are_whole(json: &Value, folder: &Path) {
    let item = json["item"].as_str().expect("a name");
    let mut reader = png::Decoder::new(std::io::BufReader::new(
        std::fs::File::open(folder.join(format!("{item}.png"))).expect("a picture"),
    ))
    .read_info()
    .expect("a PNG");
    let mut bytes = vec![0; reader.output_buffer_size().expect("fits")];
    reader.next_frame(&mut bytes).expect("decodes");
    assert!(bytes.iter().any(|b| *b > 200), "{item}: there is ink");
    reader.finish().expect("decodes to its end");
    let facts: Vec<&str> = reader.info().utf8_text.iter().map(|t| t.keyword.as_str()).collect();
    for key in ["cusp.version", "cusp.command", "cusp.seed", "cusp.scene", "cusp.scene_hash"] {
        assert!(facts.contains(&key), "{item}: {key} in {facts:?}");
    }
    let stored = std::fs::read_to_string(folder.join(format!("{item}.json"))).expect("JSON");
    assert_eq!(&serde_json::from_str::<Value>(&stored).expect("JSON"), json);
    for key in ["version", "command", "seed", "scene_hash", "source", "photons_stored", "settings", "threads"] {
        assert!(!json[key].is_null(), "{item}: {key}");
    }
    assert_eq!(json["settings"]["k"], 50);
    assert_eq!(json["settings"]["photons"], 40_000);
}

fn csv_rows(folder: &Path, item: &str) -> usize {
    std::fs::read_to_string(folder.join(format!("{item}.csv"))).expect("CSV").lines().count() - 1
}

fn rows(json: &Value) -> &Vec<Value> {
    json["rows"].as_array().expect("rows")
}

#[test]
fn figures_have_their_rows() {
    for (item, count, light) in [("figure-15", 3, "all"), ("figure-16", 10, "caustic"), ("figure-17", 21, "caustic")] {
        let (json, folder) = small(item, &[]);
        files_are_whole(&json, folder.path());
        assert_eq!(rows(&json).len(), count, "{item}");
        assert_eq!(csv_rows(folder.path(), item), count, "{item}");
        assert_eq!(json["settings"]["light"], light);
        for row in rows(&json) {
            let error = row["error"]["relative_rmse"].as_f64().expect("an error");
            assert!(error.is_finite() && error > 0.0, "{item}: {row}");
            assert!(row["seconds"]["view_pass"].as_f64().expect("seconds") > 0.0);
        }
        // All photons that overlap, integrated exactly, come nearer to the truth than one point of each pixel does.
        let error = |estimator: &str| {
            let row = rows(&json).iter().find(|r| r["estimator"] == estimator && r["gather"] == "overlap");
            row.expect(estimator)["error"]["relative_rmse"].as_f64().expect("an error")
        };
        assert!(error("integrated") < error("regular"), "{item}");
    }
}

/// With a k that holds all photons, `knn` finds what overlaps; a small k loses light.
#[test]
fn a_large_k_loses_nothing() {
    let mean = |k: &str| {
        let (json, _folder) = small("figure-16", &["--k", k]);
        let of = |gather: &str| {
            let row = rows(&json).iter().find(|r| r["estimator"] == "integrated" && r["gather"] == gather);
            row.expect("a row")["error"]["mean_ratio"].as_f64().expect("a mean")
        };
        (of("knn"), of("overlap"))
    };
    let (by_k, by_overlap) = mean("100000");
    assert!((by_k / by_overlap - 1.0).abs() < 1e-5, "{by_k} {by_overlap}");
    let (by_k, by_overlap) = mean("3");
    assert!(by_k < 0.9 * by_overlap, "{by_k} {by_overlap}");
}

#[test]
fn figure_18_has_every_grid_and_does_not_depend_on_threads() {
    let (one, folder) = small("figure-18", &["--threads", "1"]);
    files_are_whole(&one, folder.path());
    assert_eq!(rows(&one).len(), 28);
    let names: Vec<&str> = rows(&one).iter().filter_map(|r| r["estimator"].as_str()).collect();
    for n in [2, 4, 8, 16] {
        for grid in ["closed", "cells", "closed,w_pd=carried"] {
            let name = format!("multi_sampled:n={n},grid={grid}");
            assert_eq!(names.iter().filter(|other| **other == name).count(), 2, "{name}");
        }
    }
    let (three, _folder) = small("figure-18", &["--threads", "3"]);
    for (a, b) in rows(&one).iter().zip(rows(&three)) {
        assert_eq!(a["error"], b["error"], "{}", a["estimator"]);
        assert_eq!(a["error_of_rays"], b["error_of_rays"], "{}", a["estimator"]);
    }
}

/// What is printed is divided, not typed in.
#[test]
fn printed_ratios_are_quotients_of_printed_seconds() {
    let (json, folder) = small("table-1", &["--repeats", "2"]);
    files_are_whole(&json, folder.path());
    assert_eq!(rows(&json).len(), 10);
    assert_eq!(csv_rows(folder.path(), "table-1"), 10);
    let mut printed = Vec::new();
    for row in rows(&json) {
        assert_eq!(row["seconds"].as_array().map(Vec::len), Some(2));
        let x = &row["ratio_to_regular"];
        let [least, median, most] = ["least", "median", "most"].map(|k| x[k].as_f64().expect("a ratio"));
        assert!(0.0 < least && least <= median && median <= most);
        if row["estimator"] == "regular" {
            assert_eq!([least, median, most], [1.0; 3]);
        }
        if let Some(seconds) = row["printed"]["seconds"].as_f64() {
            assert_eq!(row["printed"]["ratio_to_regular"].as_f64(), Some(seconds / 20.637));
            assert_eq!(row["printed"]["source"], "Pedersen 2011, table 1, page 40");
            printed.push(seconds);
        } else {
            assert_eq!(row["estimator"], "integrated");
        }
    }
    let four = [20.637, 183.255, 380.045, 63.671];
    assert_eq!(printed, [four, four].concat());
}

#[test]
fn figure_19_accounts_for_all_of_the_time() {
    let (json, folder) = small("figure-19", &["--repeats", "1"]);
    files_are_whole(&json, folder.path());
    assert_eq!(csv_rows(folder.path(), "figure-19"), 12);
    assert_eq!(json["printed"]["share"], 0.915);
    for profile in json["profiles"].as_array().expect("profiles") {
        let steps = profile["steps"].as_array().expect("steps");
        let share: f64 = steps.iter().filter_map(|s| s["share"]["median"].as_f64()).sum();
        assert!((share - 1.0).abs() < 1e-9, "{share}");
        assert_eq!(steps[4]["share"], profile["intersection_share"]);
        let (clipped, all) = (profile["clipped"].as_u64(), profile["photons"].as_u64());
        assert!(Some(0) < clipped && clipped <= all, "{clipped:?} {all:?}");
    }
}

#[test]
fn items_are_listed() {
    let out = cusp(&["paper"]);
    assert!(out.status.success());
    let json: Value = serde_json::from_slice(&cusp(&["paper", "--json"]).stdout).expect("JSON");
    let items = json["items"].as_array().expect("items");
    assert_eq!(items.len(), 29);
    for item in items {
        assert!(text(&out.stdout).contains(item["item"].as_str().expect("a name")));
    }
}

#[test]
fn wrong_calls_are_refused_in_one_line() {
    for (args, part) in [
        (vec!["paper", "figure-20"], "figure-20"),
        (vec!["paper", "figure-15", "--photons", "0"], "--photons: must lie in 1"),
        (vec!["paper", "table-1", "--repeats", "0"], "--repeats"),
        (vec!["paper", "figure-16", "--footprint-scale", "-1"], "--footprint-scale"),
        (vec!["paper", "figure-16", "--k", "0"], "--k"),
        (vec!["paper", "figure-16", "--size", "0x10"], "--size"),
        (vec!["paper", "figure-16", "--threads", "0"], "--threads"),
        (vec!["paper", "figure-16", "--estimator", "regular"], "--estimator"),
    ] {
        let out = cusp(&args);
        let error = text(&out.stderr);
        assert_eq!(out.status.code(), Some(2), "{args:?}: {error}");
        assert_eq!(error.trim_end().lines().count(), 1, "{args:?}: {error}");
        assert!(error.starts_with("cusp: ") && error.contains(part), "{args:?}: {error}");
    }
}

/// No photon at all, and an image of one pixel, are odd but defined; and `all` makes every item.
#[test]
fn empty_and_tiny_cases_are_defined() {
    let one_pixel = ["figure-15", "figure-16", "figure-17", "figure-18", "table-1", "figure-19", "gather-table"];
    let cases = std::iter::once(("all", "4x4", "1")).chain(one_pixel.map(|item| (item, "1x1", "20000")));
    for (item, size, photons) in cases {
        let folder = tempfile::tempdir().expect("a folder");
        let out = folder.path().to_str().expect("a plain path");
        let args = ["paper", item, "--size", size, "--photons", photons, "--repeats", "1", "--out", out, "--json"];
        // References are kept beside the files.
        let run = Command::new(env!("CARGO_BIN_EXE_cusp")).args(args).env("CUSP_CACHE", out).output().expect("runs");
        assert!(run.status.success(), "{args:?}: {}", text(&run.stderr));
        let json: Value = serde_json::from_slice(&run.stdout).expect("JSON");
        let items = json["items"].as_array().cloned().unwrap_or_else(|| vec![json.clone()]);
        assert_eq!(items.len(), if item == "all" { 29 } else { 1 });
        for name in items.iter().map(|i| i["item"].as_str().expect("a name")) {
            for end in ["png", "csv", "json"] {
                assert!(folder.path().join(format!("{name}.{end}")).exists(), "{name}.{end}");
            }
        }
    }
}

/// Ctrl-C ends it cleanly, with exit code 130 and no part of an item.
#[cfg(unix)]
#[test]
fn an_interrupted_item_leaves_nothing() {
    let folder = tempfile::tempdir().expect("a folder");
    let out = folder.path().join("part");
    let child = Command::new(env!("CARGO_BIN_EXE_cusp"))
        .args(["paper", "figure-16", "--size", "4096x4096", "--photons", "1000", "--out"])
        .arg(&out)
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("the binary runs");
    std::thread::sleep(std::time::Duration::from_secs(2));
    let killed = Command::new("kill").args(["-INT", &child.id().to_string()]).status().expect("kill runs");
    assert!(killed.success());
    let run = child.wait_with_output().expect("ends");
    assert_eq!(run.status.code(), Some(130), "{}", text(&run.stderr));
    assert!(text(&run.stderr).contains("nothing of figure-16 was written"), "{}", text(&run.stderr));
    assert!(!out.exists());
}
