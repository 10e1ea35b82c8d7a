//! `cusp study` and `cusp merge` as a user meets them.

#![allow(clippy::expect_used, missing_docs, reason = "a failed expectation is how this program reports")]

use serde_json::Value;
use std::path::Path;
use std::process::{Command, Output};

fn cusp(cache: &Path, args: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_cusp")).args(args).env("CUSP_CACHE", cache).output().expect("the binary runs")
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

fn path(p: &Path) -> &str {
    p.to_str().expect("a plain path")
}

fn done(cache: &Path, args: &[&str]) -> String {
    let out = cusp(cache, args);
    assert_eq!(out.status.code(), Some(0), "{args:?}: {}", text(&out.stderr));
    text(&out.stdout)
}

fn json(file: &Path) -> Value {
    serde_json::from_slice(&std::fs::read(file).expect("reads")).expect("JSON")
}

/// A study without its times: what must be the same whenever and wherever it is made.
fn timeless(mut study: Value) -> Value {
    for key in ["command", "pareto", "unaccounted"] {
        study.as_object_mut().expect("an object").remove(key);
    }
    for curve in study["curves"].as_array_mut().expect("curves") {
        curve.as_object_mut().expect("an object").remove("convergence");
        for list in ["points", "summary"] {
            for point in curve[list].as_array_mut().expect("points") {
                point.as_object_mut().expect("an object").retain(|k, _| k != "seconds" && k != "parts");
            }
        }
    }
    study
}

const RING: [&str; 13] = [
    "ring",
    "--estimators",
    "density,integrated",
    "--sweep",
    "photons=1000,2000",
    "--passes",
    "3",
    "--seeds",
    "2",
    "--size",
    "256x256",
    "--crop",
    "96,104,64,48",
];

fn study(cache: &Path, out: &Path, more: &[&str]) -> String {
    done(cache, &[&["study"], &RING[..], &["--out", path(out)], more].concat())
}

/// One run, the same again, and three shards of which one is killed and restarted: the same but for times.
#[test]
fn a_study_is_the_same_in_one_run_and_in_shards() {
    let folder = tempfile::tempdir().expect("a folder");
    let at = |name: &str| folder.path().join(name);
    let table = study(folder.path(), &at("one"), &[]);
    assert!(table.contains("integrated photons=2000") && table.contains("budget s"), "{table}");
    let whole = json(&at("one").join("study.json"));
    assert_eq!(whole["tasks_done"], 8);
    assert_eq!(whole["curves"].as_array().expect("curves").len(), 4);
    let points = whole["curves"][3]["points"].as_array().expect("points").clone();
    assert_eq!(points.len(), 3 * 2, "1, 2 and 3 passes, two seeds");
    for p in &points {
        let parts = p["parts"].as_object().expect("parts");
        let sum: f64 = parts.iter().filter(|(k, _)| *k != "total").map(|(_, v)| v.as_f64().expect("a number")).sum();
        assert!((sum - p["seconds"].as_f64().expect("a number")).abs() < 1e-9, "parts add up: {p}");
        assert!(p["error"]["relative_rmse"].as_f64().expect("a number") > 0.0, "{p}");
        assert!(p["error"]["flip"].is_number() && p["photons"] == 2000 * p["passes"].as_u64().expect("passes"));
    }
    assert!(whole["reference"]["noise"].as_f64().expect("known") > 0.001);
    let csv = std::fs::read_to_string(at("one").join("study.csv")).expect("a table");
    let columns: Vec<usize> = csv.lines().map(|l| l.split(',').count()).collect();
    assert_eq!(columns.len(), 1 + 4 * 3 * 2);
    assert!(std::fs::read(at("one").join("study.png")).expect("a picture").starts_with(b"\x89PNG"));

    study(folder.path(), &at("again"), &[]);
    assert_eq!(timeless(json(&at("again").join("study.json"))), timeless(whole.clone()));

    for shard in ["1/3", "2/3", "3/3"] {
        let out = at(&shard.replace('/', "-"));
        let said = study(folder.path(), &out, &["--shard", shard]);
        assert!(said.contains("cusp merge"), "{said}");
        assert!(!out.join("study.json").exists(), "a shard judges nothing");
    }
    // Killed in the middle of its second task: no record, and an image of a pass that is wrong.
    let second = at("2-3").join("tasks");
    let mut records: Vec<_> = std::fs::read_dir(&second)
        .expect("tasks")
        .map(|e| e.expect("an entry").path())
        .filter(|p| p.extension().is_some_and(|e| e == "json"))
        .collect();
    records.sort();
    let lost = records.last().expect("a record");
    std::fs::remove_file(lost).expect("removes");
    std::fs::write(lost.with_extension("").join("1.exr"), b"half a file").expect("writes");
    let kept = std::fs::metadata(&records[0]).expect("there").modified().expect("a time");
    let dirs = ["1-3", "2-3", "3-3"].map(at);
    let crop = ["--crop", "96,104,64,48"];
    let part = cusp(folder.path(), &[&["merge"], &dirs.each_ref().map(|d| path(d))[..], &crop].concat());
    assert_eq!(part.status.code(), Some(1));
    assert!(text(&part.stderr).contains("1 of 8 tasks are missing"), "{}", text(&part.stderr));

    study(folder.path(), &at("2-3"), &["--shard", "2/3", "--resume"]);
    assert_eq!(std::fs::metadata(&records[0]).expect("there").modified().expect("a time"), kept, "not done again");
    let merged = at("merged");
    done(
        folder.path(),
        &[&["merge"], &dirs.each_ref().map(|d| path(d))[..], &crop, &["--out", path(&merged), "--quiet"]].concat(),
    );
    assert_eq!(timeless(json(&merged.join("study.json"))), timeless(whole));
}

/// Without a stored reference: the closed form of the plane, and a traced one whose noise is told and kept.
#[test]
fn a_scene_without_a_reference_gets_one() {
    let folder = tempfile::tempdir().expect("a folder");
    let out = folder.path().join("plane");
    let args = ["study", "plane", "--size", "24x24", "--direct", "photons", "--estimators", "regular,integrated"];
    let more = ["--photons", "3000", "--passes", "2", "--seeds", "2", "--out", path(&out), "--json"];
    let study: Value = serde_json::from_str(&done(folder.path(), &[&args[..], &more].concat())).expect("JSON");
    assert_eq!(study["reference"]["noise"], 0.0);
    let last = &study["curves"][1]["summary"][1];
    let parts = &last["bias_and_variance"];
    let (noise, error) = (parts["relative_noise"].as_f64(), last["relative_rmse"]["median"].as_f64());
    let (noise, error) = (noise.expect("two seeds"), error.expect("told"));
    assert!(noise > 0.0 && noise <= error * 1.5 && error < 0.3, "{noise} {error}");

    let out = folder.path().join("box");
    let args =
        ["study", "two_lights", "--size", "24x24", "--estimators", "integrated", "--passes", "1", "--seeds", "1"];
    let more = ["--photons", "2000", "--reference-seconds", "2", "--out", path(&out), "--json"];
    let study: Value = serde_json::from_str(&done(folder.path(), &[&args[..], &more].concat())).expect("JSON");
    let noise = study["reference"]["noise"].as_f64().expect("measured");
    let source = study["reference"]["source"].as_str().expect("a text");
    assert!(source.contains("tracer") && noise > 0.0, "{source} {noise}");
    let error = study["curves"][0]["summary"][0]["relative_rmse"]["median"].as_f64();
    assert!(error.is_none_or(|e| e >= noise), "{error:?} {noise}");
    // What it wrote is a reference for the next call, with the same noise.
    let (exr, mask) = (out.join("reference.exr"), out.join("reference_mask.png"));
    let given = ["merge", path(&out), "--reference", path(&exr), "--mask", path(&mask), "--json"];
    let again: Value = serde_json::from_str(&done(folder.path(), &given)).expect("JSON");
    let stated = again["reference"]["noise"].as_f64().expect("stated");
    assert!((stated / noise - 1.0).abs() < 1e-5, "{stated} {noise}");
}

#[test]
fn wrong_calls_are_refused_in_one_line() {
    let folder = tempfile::tempdir().expect("a folder");
    let (out, empty) = (folder.path().join("out"), folder.path().join("empty"));
    std::fs::create_dir_all(&empty).expect("a folder");
    let o = path(&out);
    let short = ["--passes", "1", "--seeds", "1", "--estimators", "regular", "--photons", "100", "--quiet"];
    done(folder.path(), &[&["study", "plane", "--size", "8x8", "--out", o], &short[..]].concat());
    for (args, part) in [
        (vec!["study", "nowhere", "--out", o], "built in: ring"),
        (vec!["study", "ring", "--sweep", "photons", "--out", o], "SETTING=VALUE"),
        (vec!["study", "ring", "--sweep", "size=2", "--out", o], "sweep photons, k, n"),
        (vec!["study", "ring", "--shard", "3/2", "--out", o], "i/n"),
        (vec!["study", "ring", "--seconds", "-1", "--out", o], "--seconds: must be positive"),
        (vec!["study", "ring", "--size", "100x100", "--out", o], "no multiple"),
        (vec!["study", "ring", "--crop", "250,0,20,20", "--out", o], "--crop"),
        (vec!["study", "ring", "--mask", "m.png", "--out", o], "--reference"),
        (vec!["study", "ring", "--resume", "--out", o], "holds another study"),
        (vec!["study", "ring", "--shard", "1/2", "--out", o], "holds another study"),
        (vec!["study", "ring", "--estimators", "sharp", "--out", o], "there are density"),
        (vec!["merge", path(&empty)], "holds no study"),
        (vec!["merge", o, path(&empty)], "holds no study"),
        (vec!["merge"], "DIR"),
    ] {
        let got = cusp(folder.path(), &args);
        let error = text(&got.stderr);
        assert_eq!(got.status.code(), Some(2), "{args:?}: {error}");
        assert_eq!(error.trim_end().lines().count(), 1, "{args:?}: {error}");
        assert!(error.starts_with("cusp: ") && error.contains(part), "{args:?}: {error}");
    }
}
