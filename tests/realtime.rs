//! `cusp realtime` as a user meets it.

#![allow(clippy::expect_used, missing_docs, reason = "a failed expectation is how this program reports")]

use serde_json::Value;
use std::process::{Command, Output};

fn cusp(args: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_cusp")).args(args).output().expect("the binary runs")
}

fn json(args: &[&str]) -> Value {
    let out = cusp(args);
    assert!(out.status.success(), "{args:?}: {}", String::from_utf8_lossy(&out.stderr));
    serde_json::from_slice(&out.stdout).expect("JSON")
}

fn refused(args: &[&str], part: &str) {
    let out = cusp(args);
    let error = String::from_utf8_lossy(&out.stderr).into_owned();
    assert_eq!(out.status.code(), Some(2), "{args:?}: {error}");
    assert!(error.trim_end().lines().count() == 1 && error.contains(part), "{args:?}: {error}");
}

#[test]
fn a_run_reports_what_it_did() {
    let folder = tempfile::tempdir().expect("a folder");
    let out = folder.path().join("run");
    let o = out.to_str().expect("a plain path");
    let d = json(&[
        "realtime",
        "rooms",
        "--frames",
        "14",
        "--size",
        "64x48",
        "--json",
        "--out",
        o,
        "--set",
        "mesh_refinement=500",
        "--set",
        "photons_from_light=50",
        "--set",
        "accumulation_frames=4",
    ]);
    for key in ["version", "command", "seed", "scene", "scene_hash", "renewal_seconds", "frame_seconds", "rss_bytes"] {
        assert!(!d[key].is_null(), "{key}");
    }
    assert_eq!((d["frames"].as_u64(), d["triangles"].as_u64()), (Some(14), Some(860)));
    assert_eq!(d["settings"]["accumulation_frames"], 4);
    assert_eq!(d["last"]["frames_in_map"], 4);
    assert_eq!(d["photons_foreseen"], 4 * (50 + 50 * 4));
    assert!(d["last"]["photons_in_map"].as_u64() <= d["photons_foreseen"].as_u64());
    assert!(d["frames_per_second"].as_f64().is_some_and(|f| f > 0.0));
    let phases = &d["phase_seconds"];
    for phase in ["update", "emit", "balance", "cull", "estimate", "draw"] {
        assert!(phases[phase].is_f64(), "{phase}");
    }
    let csv = std::fs::read_to_string(out.join("frames.csv")).expect("a table");
    assert_eq!(csv.lines().count(), 15);
    assert!(out.join("frame.png").is_file() && out.join("realtime.json").is_file());
}

/// The same frames whatever the number of threads.
#[test]
fn pictures_do_not_depend_on_threads() {
    let folder = tempfile::tempdir().expect("a folder");
    let picture = |threads: &str| {
        let out = folder.path().join(threads);
        let o = out.to_str().expect("a plain path");
        let call =
            ["realtime", "rooms", "--frames", "5", "--size", "80x60", "--quiet", "--out", o, "--threads", threads];
        assert!(cusp(&call).status.success());
        image::open(out.join("frame.png")).expect("a picture").to_rgb8().into_raw()
    };
    let one = picture("1");
    assert!(one.iter().any(|&b| b > 100));
    assert!(one == picture("3"));
}

#[test]
fn wrong_calls_are_refused_in_one_line() {
    for (args, part) in [
        (&["realtime", "nowhere"][..], "built in: ring"),
        (&["realtime", "rooms", "--set", "speed=1"], "no parameter `speed`"),
        (&["realtime", "rooms", "--set", "max_search_count"], "KEY=VALUE"),
        (&["realtime", "rooms", "--set", "max_search_count=0"], "must lie in 1 to"),
        (&["realtime", "rooms", "--set", "area=heart"], "must be one of disc, hull"),
        (&["realtime", "rooms", "--set", "recursion_depth=9"], "the map would hold"),
        (&["realtime", "rooms", "--frames", "0"], "--frames"),
        (&["realtime", "rooms", "--size", "0x3"], "--size"),
        (&["realtime", "rooms", "--time-step", "inf"], "finite"),
    ] {
        refused(args, part);
    }
}

/// A wrong value in a scene file is placed there.
#[test]
fn a_wrong_parameter_of_a_scene_is_told_with_its_line() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("scene.toml");
    let text = "[camera]\nposition = [0, 1, 3]\ntarget = [0, 0, 0]\nfov_y = 40\n\n[realtime]\nmesh_refinement = 10\nsearch = \"cube\"\n";
    std::fs::write(&path, text).expect("written");
    refused(
        &["realtime", path.to_str().expect("a plain path")],
        "scene.toml:8: realtime.search: must be one of sphere",
    );
    std::fs::write(&path, text.replace("\"cube\"", "\"sphere\"").replace("search", "serach")).expect("written");
    refused(&["realtime", path.to_str().expect("a plain path")], "scene.toml:8: serach: unknown field");
}

#[test]
fn the_parameters_are_listed() {
    let all = json(&["realtime", "--parameters", "--json"]);
    let all = all.as_array().expect("a list");
    let numbered: Vec<u64> = all.iter().filter_map(|p| p["number"].as_u64()).collect();
    assert_eq!(numbered, (1..=16).collect::<Vec<u64>>());
}

/// Ten thousand frames with a moving light hold no more memory at their end than after a tenth of them.
#[test]
fn memory_stays_flat() {
    let d = json(&[
        "realtime",
        "rooms",
        "--frames",
        "10000",
        "--size",
        "16x12",
        "--json",
        "--set",
        "mesh_refinement=100",
        "--set",
        "photons_from_light=10",
        "--set",
        "accumulation_frames=5",
        "--set",
        "max_search_count=10",
    ]);
    assert_eq!(d["frames"], 10_000);
    let Some(rss) = d["rss_bytes"].as_array() else { return };
    let [early, late] = [0, 1].map(|i| rss[i].as_f64().expect("bytes"));
    assert!(late < early + 4e6, "{early} {late}");
}
