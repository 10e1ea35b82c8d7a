//! Final gathering by the command line: what `render`, `compare` and `inspect` tell of it.

#![allow(clippy::expect_used, missing_docs, reason = "a failed expectation is how this program reports")]

use serde_json::Value;
use std::path::Path;
use std::process::{Command, Output};

const COMMON: [&str; 6] = ["--size", "32x24", "--photons", "6000", "--final-gather-rays", "24"];

fn cusp(args: &[&str]) -> Output {
    let out = Command::new(env!("CARGO_BIN_EXE_cusp"))
        .args(args)
        .args(COMMON)
        .env_remove("DISPLAY")
        .env_remove("WAYLAND_DISPLAY")
        .output()
        .expect("the binary runs");
    assert!(out.status.success(), "{}", String::from_utf8_lossy(&out.stderr));
    out
}

fn shown(args: &[&str]) -> String {
    String::from_utf8_lossy(&cusp(args).stdout).into_owned()
}

fn json(path: &Path) -> Value {
    serde_json::from_slice(&std::fs::read(path).expect("reads")).expect("JSON")
}

fn sum(list: &Value, key: &str) -> u64 {
    list.as_array().expect("a list").iter().map(|l| l[key].as_u64().expect("a number")).sum()
}

#[test]
fn stats_tell_what_was_looked_up() {
    let folder = tempfile::tempdir().expect("a folder");
    let (exr, stats) = (folder.path().join("a.exr"), folder.path().join("a.json"));
    let [exr, stats_path] = [&exr, &stats].map(|p| p.to_str().expect("plain"));
    let render = |method: &str| {
        let text = shown(&["render", "cornell", "--final-gather", method, "-o", exr, "--stats", stats_path]);
        (text, json(&stats))
    };
    let (text, told) = render("ray-differentials");
    assert!(text.contains("final gathering 0.") && text.contains("estimates by layer"), "{text}");
    let f = &told["final_gather"];
    assert_eq!(f["settings"], "ray-differentials:rays=24");
    let layers = f["layers"].as_array().expect("layers");
    assert!(layers.len() > 1 && layers[0]["radius"] == f["radius"], "{f}");
    assert_eq!(sum(&f["layers"], "bytes"), f["memory"]["layers"].as_u64().expect("a number"));
    assert!(f["memory"]["peak"].as_u64() > f["memory"]["photons"].as_u64());
    // Each pixel sees the box or nothing, and a hit sends 24 rays.
    let rays = told["gather_counts"]["rays"].as_u64().expect("a number");
    assert!(rays % 24 == 0 && rays > 0 && rays <= 32 * 24 * 24, "{rays}");
    assert!(told["seconds"]["final_gather"].as_f64().is_some_and(|s| s > 0.0));
    let (text, told) = render("classic");
    assert!(text.contains("first search"), "{text}");
    let f = &told["final_gather"];
    assert!(f["layers"].as_array().is_some_and(Vec::is_empty) && f["memory"]["photons"].as_u64() > Some(0));
    let (text, told) = render("none");
    assert!(!text.contains("final gathering") && told["final_gather"].is_null(), "{text}");
    assert_eq!(told["gather_counts"]["rays"], 0);
}

#[test]
fn a_comparison_tells_methods_apart() {
    let folder = tempfile::tempdir().expect("a folder");
    let out = folder.path().to_str().expect("plain");
    let all = "none,classic,ray-differentials";
    let text = shown(&["compare", "cornell", "--estimators", "integrated", "--final-gather", all, "--out", out]);
    assert!(text.contains("final gathering s") && text.contains("integrated+classic:rays=24"), "{text}");
    let csv = std::fs::read_to_string(folder.path().join("timings.csv")).expect("reads");
    let lines: Vec<Vec<&str>> = csv.lines().map(|l| l.split(',').collect()).collect();
    assert!(lines.len() == 4 && lines.iter().all(|l| l.len() == lines[0].len()), "{csv}");
    let column = |key: &str| lines[0].iter().position(|k| *k == key).expect(key);
    assert_eq!(column("final_gather_s"), column("estimate_s") + 1);
    let spent = |line: usize| lines[line][column("final_gather_s")].parse::<f64>().expect("a number");
    assert!(spent(1) == 0.0 && spent(2) > 0.0 && spent(3) > 0.0, "{csv}");
    assert_eq!(lines[3][column("final_gather")], "\"ray-differentials:rays=24\"");
    let report = json(&folder.path().join("report.json"));
    let estimators = report["estimators"].as_array().expect("a list");
    assert!(estimators[0]["final_gather"].is_null());
    assert_eq!(estimators[1]["final_gather"]["settings"], "classic:rays=24");
    // The images have names of their own.
    let files: std::collections::BTreeSet<&str> = estimators.iter().filter_map(|e| e["files"][0].as_str()).collect();
    assert_eq!(files.len(), 3);
}

/// The sum of what the rays bring, photons and base, against the pixel.
#[test]
fn inspect_tells_every_ray() {
    let args = ["inspect", "cornell", "--pixel", "16,20", "--final-gather", "ray-differentials"];
    let told: Value = serde_json::from_slice(&cusp(&[&args[..], &["--json"]].concat()).stdout).expect("JSON");
    let g = &told["final_gathering"][0];
    let rays = g["hits"][0]["rays"].as_array().expect("rays");
    assert_eq!(rays.len(), 24);
    let number = |v: &Value| v.as_f64().expect("a number");
    for c in 0..3 {
        let of = &told["estimators"][0];
        let photons = told["photons"].as_array().expect("a list").iter().map(|p| number(&p["contributions"][0][c]));
        let brought = rays.iter().map(|r| number(&r["pixel"][c]));
        let sum = number(&of["direct_and_emitted"][c]) + photons.chain(brought).sum::<f64>();
        assert!((sum / number(&of["pixel"][c]) - 1.0).abs() < 1e-5, "{sum} {of}");
    }
    assert_eq!(g["ends"].as_object().expect("counts").values().filter_map(Value::as_u64).sum::<u64>(), 24);
    let layers = g["layers"].as_array().expect("layers");
    let mut used = vec![0; layers.len()];
    for ray in rays {
        let estimates = ray["estimates"].as_array().expect("a list");
        for e in estimates {
            let layer = e[0].as_u64().expect("a layer") as usize;
            assert!(e[1].as_u64() < layers[layer]["estimates"].as_u64());
        }
        assert_eq!(ray["layer"].is_null(), estimates.is_empty(), "{ray}");
        if let Some(layer) = ray["layer"].as_u64() {
            used[layer as usize] += 1;
        }
    }
    assert_eq!(used.iter().sum::<u64>(), sum(&g["layers"], "rays"));

    let text = shown(&[&args[..], &["--rows", "3"]].concat());
    assert!(text.contains("final gathering under integrated+ray-differentials:rays=24\n  24 rays from 1 view hits: "));
    let table = text.split("rays by what they add to the pixel\n").nth(1).expect("a table");
    let rows: Vec<&str> = table.lines().take(5).collect();
    assert!(rows[0].contains("share") && rows[4].contains("more that bring light are left out"), "{table}");
    let share = |row: &str| row.trim_end_matches(" %").rsplit("  ").next().and_then(|s| s.trim().parse::<f64>().ok());
    let shares: Vec<f64> = rows[1..4].iter().filter_map(|r| share(r)).collect();
    assert!(shares.len() == 3 && shares.is_sorted_by(|a, b| a >= b) && shares[0] <= 100.0, "{table}");
}

/// Panels are those of the methods that are asked for, by flag or in a session; a panel that names its own keeps it.
#[test]
fn the_window_and_its_session_gather_as_they_are_told() {
    let folder = tempfile::tempdir().expect("a folder");
    let png = folder.path().join("shot.png");
    let png = png.to_str().expect("plain");
    let more = ["--passes", "1", "--window", "800x500", "--pixel", "12,20", "--ray", "2", "--layer", "1"];
    let overlays = ["--overlays", "gather_rays,irradiance", "-o", png, "--quiet"];
    let shot = |methods: &str| {
        cusp(&[&["shot", "cornell", "--final-gather", methods][..], &more, &overlays].concat());
        image::open(png).expect("a PNG").to_rgb8()
    };
    let [one, two] = ["precomputed", "precomputed,ray-differentials"].map(shot);
    assert_eq!((one.width(), one.height()), (800, 500));
    assert_ne!(one, two, "another panel");

    let session = folder.path().join("a.toml");
    let text = "session = 1\nscene = \"cornell\"\n[render]\nfinal_gather = \"classic:rays=3\"\n\
                [[panels]]\nestimator = \"integrated\"\n[[panels]]\nestimator = \"regular+precomputed:rays=5\"\n";
    std::fs::write(&session, text).expect("writes");
    let out = folder.path().join("out");
    let (session, out) = (session.to_str().expect("plain"), out.to_str().expect("plain"));
    let compared = cusp(&["compare", session, "--out", out, "--json"]);
    let report: Value = serde_json::from_slice(&compared.stdout).expect("JSON");
    let methods: Vec<&str> =
        report["estimators"].as_array().expect("a list").iter().filter_map(|e| e["final_gathering"].as_str()).collect();
    assert_eq!(methods, ["classic:rays=3", "precomputed:rays=5"]);
}
