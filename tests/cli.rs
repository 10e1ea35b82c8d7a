//! The command line as a user meets it: outputs, exit codes, and one clear line for everything that is wrong.

#![allow(clippy::expect_used, missing_docs, reason = "a failed expectation is how this program reports")]

use std::path::Path;
use std::process::{Command, Output};

fn cusp(args: &[&str]) -> Output {
    // Without a display, so that no test opens a window.
    Command::new(env!("CARGO_BIN_EXE_cusp"))
        .args(args)
        .env_remove("DISPLAY")
        .env_remove("WAYLAND_DISPLAY")
        .output()
        .expect("the binary runs")
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

/// A call that must fail: its exit code, and one line that holds `part`.
fn refused(args: &[&str], code: i32, part: &str) {
    let out = cusp(args);
    let error = text(&out.stderr);
    assert_eq!(out.status.code(), Some(code), "{args:?}: {error}");
    assert_eq!(error.trim_end().lines().count(), 1, "{args:?}: {error}");
    assert!(error.starts_with("cusp: ") && error.contains(part), "{args:?}: {error}");
    assert!(out.stdout.is_empty(), "{args:?}");
}

fn path(p: &Path) -> &str {
    p.to_str().expect("a plain path")
}

#[test]
fn wrong_calls_are_refused_in_one_line() {
    let folder = tempfile::tempdir().expect("a folder");
    let out = folder.path().join("out");
    let o = path(&out);
    for (args, part) in [
        (vec!["compare", "nowhere", "--out", o], "built in: ring"),
        (vec!["compare", "missing.toml", "--out", o], "no such file"),
        (vec!["compare", "map.bsp", "--out", o], "map.bsp: cannot be read: no such file"),
        (vec!["compare", "tests/corpus/map/cut_off.bsp", "--out", o], "is it cut off?"),
        (vec!["compare", "tests/corpus/map/room.pk3:hall", "--out", o], "no map `hall` in the archive; there are room"),
        (vec!["compare", "ring", "--photons", "0", "--out", o], "--photons: must lie in 1"),
        (vec!["compare", "ring", "--photons", "-5", "--out", o], "--photons: must lie in 1"),
        (vec!["compare", "ring", "--photons", "nan", "--out", o], "--photons"),
        (vec!["compare", "ring", "--photons", "1e14", "--out", o], "--photons: must lie in"),
        (vec!["compare", "ring", "--size", "0x10", "--out", o], "--size: 0x10"),
        (vec!["compare", "ring", "--size", "99999x99999", "--out", o], "--size"),
        (vec!["compare", "ring", "--size", "12", "--out", o], "WIDTHxHEIGHT"),
        (vec!["compare", "ring", "--k", "0", "--out", o], "--k"),
        (vec!["compare", "ring", "--footprint-scale", "-1", "--out", o], "--footprint-scale"),
        (vec!["compare", "ring", "--footprint-scale", "nan", "--out", o], "--footprint-scale"),
        (vec!["compare", "ring", "--gather", "octree", "--out", o], "one of knn, overlap"),
        (vec!["compare", "ring", "--light", "dark", "--out", o], "one of all, direct"),
        (vec!["compare", "ring", "--final-gather", "some", "--out", o], "there are none, classic"),
        (vec!["compare", "ring", "--estimators", "sharp", "--out", o], "there are density"),
        (vec!["compare", "ring", "--estimators", "multi_sampled:m=3", "--out", o], "it takes n, grid"),
        (vec!["compare", "ring", "--crop", "500,0,100,10", "--out", o], "leaves the image"),
        (vec!["compare", "ring", "--crop", "1,2,3", "--out", o], "x,y,width,height"),
        (vec!["compare", "ring", "--threads", "0", "--out", o], "--threads"),
        (vec!["compare", "ring", "--mask", "m.png", "--out", o], "--reference"),
        (vec!["compare", "ring", "--reference", "none.exr", "--out", o], "none.exr"),
        (vec!["compare", "--out", o], "<SCENE>"),
        (vec!["render", "ring", "-o", "a.bmp"], ".exr or .png"),
        (vec!["render", "ring", "-o", "a.exr", "--passes", "0"], "--passes"),
        (vec!["render", "ring", "-o", "a.exr", "--seconds", "-1"], "--seconds"),
        (vec!["render", "ring", "-o", "a.exr", "--seconds", "nan"], "--seconds"),
        (vec!["render", "ring", "-o", "a.exr", "--until-error", "0"], "--until-error"),
        (vec!["render", "ring", "-o", "a.exr", "--until-error", "-0.1"], "--until-error"),
        (vec!["render", "ring", "-o", "a.exr", "--until-error", "inf"], "--until-error"),
        (vec!["inspect", "ring"], "--pixel"),
        (vec!["inspect", "ring", "--pixel", "12"], "column,row"),
        (vec!["inspect", "ring", "--pixel", "-1,5"], "column,row"),
        (vec!["inspect", "ring", "--pixel", "32,5", "--size", "32x32"], "outside the image of 32x32"),
        (vec!["inspect", "ring", "--pixel", "1,1", "--pass", "0"], "--pass"),
        (vec!["inspect", "ring", "--pixel", "1,1", "--estimators", "sharp"], "there are density"),
        (vec!["inspect", "ring", "--pixel", "1,1", "--estimators", "regular", "--sort", "density"], "not among"),
        (vec!["paint"], "nor a file"),
        (vec!["compare", "ring", "--colour"], "--colour"),
    ] {
        refused(&args, 2, part);
    }
    assert!(!out.exists(), "nothing is written for a wrong call");
}

#[test]
fn wrong_scene_files_are_named_with_line_and_key() {
    let folder = tempfile::tempdir().expect("a folder");
    let write = |name: &str, text: &str| {
        let p = folder.path().join(name);
        std::fs::write(&p, text).expect("writes");
        p
    };
    let camera = "[camera]\nposition = [0, 1, 3]\ntarget = [0, 0, 0]\nfov_y = 40\n";
    let material = "[materials.a]\nkind = \"diffuse\"\n";
    let quad = "[[shapes]]\nkind = \"quad\"\nu = [1, 0, 0]\nv = [0, 0, -1]\nmaterial = \"a\"\n";
    write("cut.obj", "v 0 0 0\nv 1 0 0\nv 0 1\n");
    write("range.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n");
    let mesh = |f: &str| format!("{camera}{material}[[shapes]]\nkind = \"mesh\"\nfile = \"{f}\"\nmaterial = \"a\"\n");
    for (body, line, part) in [
        (format!("{material}{quad}"), 1, "camera: there is none"),
        (format!("{camera}fov_z = 3\n"), 5, "unknown field `fov_z`"),
        (format!("{camera}{material}reflectance = [0.5, nan, 0.5]\n"), 7, "materials.a.reflectance"),
        (format!("{camera}{material}reflectance = [0.5, -1, 0.5]\n"), 7, "[0, 1]"),
        (format!("{camera}{material}ior = 1.5\n"), 7, "no such key"),
        (
            format!("{camera}{material}{quad}[[lights]]\nkind = \"point\"\nposition = [0, 1, 0]\npower = [-1, 0, 0]\n"),
            15,
            "not negative",
        ),
        (
            format!("{camera}{material}{quad}[[lights]]\nkind = \"point\"\npower = [1, 0, 0]\n"),
            12,
            "lights[0].position",
        ),
        (format!("{camera}{material}{quad}[[lights]]\nkind = \"lamp\"\n"), 13, "point, sphere, quad"),
        (format!("{camera}{quad}"), 9, "no material `a`"),
        (format!("{camera}[render]\nphotons = 0\n"), 6, "render.photons"),
        (format!("{camera}[render]\nestimator = \"sharp\"\n"), 6, "render.estimator"),
        (camera.replace("40", "\"wide\""), 4, "fov_y"),
        (camera.replace("40", "180"), 4, "camera.fov_y"),
        (format!("{camera}resolution = [32768, 32768]\n"), 5, "camera.resolution: has 1073741824 pixels"),
        (format!("{camera}[["), 5, ""),
        (mesh("nowhere.obj"), 9, "no such file"),
    ] {
        let file = write("s.toml", &body);
        refused(&["render", path(&file), "-o", "never.exr"], 2, &format!("s.toml:{line}: "));
        refused(&["render", path(&file), "-o", "never.exr"], 2, part);
    }
    for (mesh_file, line) in [("cut.obj", 3), ("range.obj", 4)] {
        let file = write("s.toml", &mesh(mesh_file));
        refused(&["render", path(&file), "-o", "never.exr"], 2, &format!("{mesh_file}:{line}: "));
    }
    assert!(!Path::new("never.exr").exists());
}

#[test]
fn a_place_that_cannot_be_written_is_failed_work() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("file");
    std::fs::write(&file, "x").expect("writes");
    let target = file.join("a.exr");
    refused(&["render", "plane", "--size", "8x8", "-o", path(&target)], 1, "cannot be written");
}

#[test]
fn compare_writes_all_its_files_and_a_report() {
    let folder = tempfile::tempdir().expect("a folder");
    let o = path(folder.path());
    let out = cusp(&[
        "compare",
        "ring",
        "--size",
        "128x128",
        "--photons",
        "5e4",
        "--out",
        o,
        "--crop",
        "40,40,64,48",
        "--json",
    ]);
    assert!(out.status.success(), "{}", text(&out.stderr));
    let report: serde_json::Value = serde_json::from_slice(&out.stdout).expect("JSON");
    for key in [
        "version",
        "scene",
        "estimator",
        "gather",
        "light",
        "seed",
        "threads",
        "size",
        "passes",
        "photons_emitted",
        "photons_stored",
        "seconds",
        "peak_rss_bytes",
        "bounded",
        "plan",
        "estimators",
    ] {
        assert!(!report[key].is_null(), "{key}");
    }
    for key in ["load", "bvh", "photon_trace", "map_build", "view_trace", "gather", "estimate", "total"] {
        assert!(report["seconds"][key].is_f64(), "{key}");
    }
    let estimators = report["estimators"].as_array().expect("a list");
    assert_eq!(estimators.len(), 6);
    for e in estimators {
        assert!(e["error"]["relative_rmse"].as_f64().expect("a number").is_finite());
        for file in e["files"].as_array().expect("a list") {
            assert!(folder.path().join(file.as_str().expect("a name")).exists(), "{file}");
        }
    }
    let written: serde_json::Value =
        serde_json::from_slice(&std::fs::read(folder.path().join("report.json")).expect("reads")).expect("JSON");
    assert_eq!(written["estimators"], report["estimators"]);
    let csv = std::fs::read_to_string(folder.path().join("timings.csv")).expect("reads");
    assert_eq!(csv.lines().count(), 7);
    let sheet = image::open(folder.path().join("sheet.png")).expect("a PNG");
    assert!(sheet.width() > 6 * 64 * 3);
    let crop = image::open(folder.path().join("integrated_crop.png")).expect("a PNG");
    assert_eq!((crop.width(), crop.height()), (192, 144));
    let bytes = std::fs::read(folder.path().join("integrated.exr")).expect("reads");
    assert!(bytes.windows(12).any(|w| w == b"cusp compare"), "the EXR carries its command line");
}

#[test]
fn render_writes_an_image_and_its_stats() {
    let folder = tempfile::tempdir().expect("a folder");
    let (exr, stats) = (folder.path().join("deep/a.exr"), folder.path().join("a.json"));
    let args = [
        "render",
        "cornell",
        "--size",
        "32x24",
        "--photons",
        "5000",
        "--passes",
        "3",
        "-o",
        path(&exr),
        "--stats",
        path(&stats),
    ];
    let out = cusp(&args);
    assert!(out.status.success(), "{}", text(&out.stderr));
    assert!(text(&out.stdout).contains("3 passes"));
    let image = image::open(&exr).expect("an EXR").to_rgb32f();
    assert_eq!((image.width(), image.height()), (32, 24));
    let json: serde_json::Value = serde_json::from_slice(&std::fs::read(&stats).expect("reads")).expect("JSON");
    assert_eq!((json["passes"].as_u64(), json["photons_emitted"].as_u64()), (Some(3), Some(15_000)));
    let png = folder.path().join("a.png");
    assert!(cusp(&["render", "plane", "--size", "16x16", "--quiet", "-o", path(&png)]).stdout.is_empty());
    assert_eq!(image::open(&png).expect("a PNG").width(), 16);
}

/// A render with those flags on top, its statistics as JSON, and what it printed.
fn stats_of(flags: &[&str]) -> (serde_json::Value, Output) {
    let folder = tempfile::tempdir().expect("a folder");
    let (exr, stats) = (folder.path().join("a.exr"), folder.path().join("a.json"));
    let common = ["render", "--photons", "2000", "--size", "32x32", "-o", path(&exr), "--stats", path(&stats)];
    let out = cusp(&[&common[..], flags].concat());
    assert!(out.status.success(), "{}", text(&out.stderr));
    (serde_json::from_slice(&std::fs::read(&stats).expect("reads")).expect("JSON"), out)
}

#[test]
fn reported_seconds_add_up() {
    let (json, _) = stats_of(&["cornell", "--passes", "3"]);
    let seconds = json["seconds"].as_object().expect("an object");
    let of = |key: &str| seconds[key].as_f64().expect("a number");
    let parts: f64 = seconds.keys().filter(|k| *k != "total").map(|k| of(k)).sum();
    assert!((parts - of("total")).abs() <= 1e-12 * of("total"), "{seconds:?}");
    assert!(seconds.values().all(|s| s.as_f64().is_some_and(|s| s >= 0.0)), "{seconds:?}");
    assert!(of("other") < of("total"));
}

#[test]
fn renders_say_what_stopped_them() {
    let (json, out) = stats_of(&["ring", "--passes", "2"]);
    assert_eq!((&json["stopped_by"], json["error_estimate"].is_null()), (&"passes".into(), true));
    assert!(text(&out.stdout).contains("unknown below 12 passes"));
    // A limit that is reached first, though the error is not.
    let (json, out) = stats_of(&["ring", "--passes", "13", "--seconds", "600", "--until-error", "1e-6"]);
    assert_eq!((&json["stopped_by"], json["passes"].as_u64()), (&"passes".into(), Some(13)));
    let estimate = &json["error_estimate"];
    let of = |key: &str| estimate[key].as_f64().expect("a number");
    assert!((of("rmse").powi(2) - of("noise_rmse").powi(2) - of("bias_rmse").powi(2)).abs() < 1e-9 * of("rmse"));
    assert!(of("noise_rmse") > 0.0 && of("relative_bound") >= of("relative"));
    assert!(text(&out.stdout).contains("was asked for and not reached"), "{}", text(&out.stdout));
    assert!(text(&out.stderr).is_empty(), "{}", text(&out.stderr));
    let (json, out) = stats_of(&["ring", "--passes", "500", "--until-error", "100"]);
    assert_eq!((&json["stopped_by"], json["passes"].as_u64()), (&"error".into(), Some(16)));
    assert!(text(&out.stdout).contains("was asked for and reached"));
}

#[test]
fn a_bias_that_stays_is_warned_of() {
    for flags in [["--gather", "knn"], ["--estimator", "coplanar"]] {
        let (json, out) = stats_of(&[&["ring", "--until-error", "1e-6", "--passes", "1"], &flags[..]].concat());
        assert!(text(&out.stderr).contains("leaves a bias"), "{flags:?}: {}", text(&out.stderr));
        assert!(json["warnings"].to_string().contains("leaves a bias"));
    }
}

/// A time that is up before anything is done leaves one pass, and says that it took longer.
#[test]
fn the_first_pass_is_finished() {
    let (json, out) = stats_of(&["ring", "--seconds", "1e-9"]);
    assert_eq!((&json["stopped_by"], json["passes"].as_u64()), (&"seconds".into(), Some(1)));
    assert!(text(&out.stderr).contains("the first pass ended after"), "{}", text(&out.stderr));
}

/// The inspector's pixel, and the sum of its photons, against the pixel that `render` writes.
#[test]
fn inspect_explains_the_pixel_that_render_writes() {
    let folder = tempfile::tempdir().expect("a folder");
    let exr = folder.path().join("a.exr");
    let common = ["--size", "48x40", "--photons", "30000"];
    for (scene, x, y) in [("ring", 24, 20), ("glass_sphere", 25, 24)] {
        let at = format!("{x},{y}");
        let out = cusp(&[&["inspect", scene, "--pixel", &at, "--json"][..], &common].concat());
        assert!(out.status.success(), "{}", text(&out.stderr));
        let json: serde_json::Value = serde_json::from_slice(&out.stdout).expect("JSON");
        for key in ["version", "pixel", "pass", "plan", "hits", "path", "photons", "settings"] {
            assert!(!json[key].is_null(), "{key}");
        }
        let rgb = |v: &serde_json::Value| [0, 1, 2].map(|c| v[c].as_f64().expect("a number") as f32);
        let list = json["estimators"].as_array().expect("a list");
        assert_eq!(list.len(), 6);
        for (e, of) in list.iter().enumerate() {
            let name = of["name"].as_str().expect("a name");
            let render = ["render", scene, "--estimator", name, "--quiet", "-o", path(&exr)];
            assert!(cusp(&[&render[..], &common].concat()).status.success());
            let image = image::open(&exr).expect("an EXR").to_rgb32f();
            assert_eq!(rgb(&of["pixel"]), image.get_pixel(x, y).0, "{scene} {name}");
            let mut sum = rgb(&of["direct_and_emitted"]).map(f64::from);
            for photon in json["photons"].as_array().expect("a list") {
                let added = rgb(&photon["contributions"][e]);
                sum.iter_mut().zip(added).for_each(|(s, a)| *s += f64::from(a));
            }
            for (s, value) in sum.into_iter().zip(rgb(&of["pixel"])) {
                assert!((s - f64::from(value)).abs() <= f64::from(value) * 2f64.powi(-21), "{scene} {name}");
            }
        }
        assert!(json["photons"].as_array().is_some_and(|p| p.len() > 10));
    }
}

#[test]
fn inspect_is_readable_by_people() {
    let args = ["inspect", "ring", "--size", "64x64", "--photons", "5e4", "--pixel", "32,36"];
    let shown = |more: &[&str]| {
        let out = cusp(&[&args[..], more].concat());
        assert!(out.status.success(), "{}", text(&out.stderr));
        text(&out.stdout)
    };
    let table = |text: &str| text.lines().filter(|l| l.starts_with("  caustic ")).count();
    let few = shown(&["--estimators", "regular,integrated", "--sort", "integrated", "--rows", "3"]);
    assert!(few.starts_with("ring: pixel 32,36 of 64x64, pass 1"), "{few}");
    assert!(few.contains("more are left out") && few.contains("figure 10") && few.contains("\nplan\n"), "{few}");
    let all = shown(&["--estimators", "regular,integrated", "--rows", "0"]);
    assert!(!all.contains("left out; --rows") && table(&all) > table(&few), "{all}");
    assert!(shown(&["--pass", "3"]).contains("pass 3"));
    assert!(shown(&["--quiet"]).is_empty());
}

#[test]
fn an_obj_is_a_scene() {
    let folder = tempfile::tempdir().expect("a folder");
    let obj = folder.path().join("t.obj");
    std::fs::write(&obj, "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 0\nf 1 2 3\nf 1 1 1\n").expect("writes");
    let out = cusp(&["render", path(&obj), "--size", "32x32", "-o", path(&folder.path().join("a.exr"))]);
    assert!(out.status.success(), "{}", text(&out.stderr));
    assert!(text(&out.stderr).contains("without area"), "{}", text(&out.stderr));
}

#[test]
fn lists_are_readable_by_people_and_programs() {
    for (command, name) in [("scenes", "prism_wall"), ("estimators", "multi_sampled")] {
        assert!(text(&cusp(&[command]).stdout).contains(name));
        let json: serde_json::Value = serde_json::from_slice(&cusp(&[command, "--json"]).stdout).expect("JSON");
        assert!(json[command].as_array().expect("a list").len() >= 6 && !json["version"].is_null());
    }
    let help = text(&cusp(&["compare", "--help"]).stdout);
    for flag in ["--estimators", "--crop", "--truth", "--photons", "--footprint-scale", "--seed", "--json"] {
        assert!(help.contains(flag), "{flag}");
    }
}

#[test]
fn without_a_display_the_ring_is_compared() {
    let folder = tempfile::tempdir().expect("a folder");
    let o = path(folder.path());
    let out = cusp(&["--out", o, "--size", "64x64", "--photons", "1e4"]);
    assert!(out.status.success(), "{}", text(&out.stderr));
    assert!(text(&out.stderr).contains("There is no window (no display"));
    assert!(text(&out.stdout).starts_with("ring: 64x64"));
}

/// Ctrl-C ends a long render cleanly: what is done is written, exit code 130.
#[cfg(unix)]
#[test]
fn an_interrupted_render_writes_what_is_done() {
    let folder = tempfile::tempdir().expect("a folder");
    let exr = folder.path().join("a.exr");
    let args = ["render", "ring", "--size", "64x64", "--photons", "2000", "--seconds", "600", "-o", path(&exr)];
    let out = interrupt(&args);
    assert!(text(&out.stderr).contains("passes were written"), "{}", text(&out.stderr));
    assert!(image::open(&exr).is_ok());
}

/// Ctrl-C in the one pass of a comparison leaves an image of each estimator with the tiles that were done.
#[cfg(unix)]
#[test]
fn an_interrupted_comparison_writes_its_tiles() {
    let folder = tempfile::tempdir().expect("a folder");
    let o = folder.path().join("part");
    let mut args = vec!["compare", "cornell", "--size", "4096x4096", "--photons", "1000"];
    args.extend(["--estimators", "regular,integrated", "--out", path(&o)]);
    let out = interrupt(&args);
    assert!(text(&out.stderr).contains("of 16384 tiles of each image are in"), "{}", text(&out.stderr));
    for name in ["regular.exr", "integrated.exr"] {
        assert!(image::open(o.join(name)).is_ok(), "{name}");
    }
    assert!(!o.join("report.json").exists());
}

/// Starts a command that runs for minutes, sends Ctrl-C and waits for exit code 130. A busy machine may not have finished
/// its first tile by then, and says so: the command is then started again and given four times as long.
#[cfg(unix)]
fn interrupt(args: &[&str]) -> Output {
    let mut seconds = 2;
    loop {
        let child = Command::new(env!("CARGO_BIN_EXE_cusp"))
            .args(args)
            .stdout(std::process::Stdio::piped())
            .stderr(std::process::Stdio::piped())
            .spawn()
            .expect("the binary runs");
        std::thread::sleep(std::time::Duration::from_secs(seconds));
        let killed = Command::new("kill").args(["-INT", &child.id().to_string()]).status().expect("kill runs");
        assert!(killed.success());
        let out = child.wait_with_output().expect("ends");
        // Killed before it listened for Ctrl-C, or before its first tile.
        let too_early = out.status.code().is_none() || text(&out.stderr).contains("nothing was written");
        if seconds > 60 || !too_early {
            assert_eq!(out.status.code(), Some(130), "{}", text(&out.stderr));
            return out;
        }
        seconds *= 4;
    }
}

/// The same window gives the same bits; wrong calls are refused.
#[test]
fn shot_draws_the_window() {
    let folder = tempfile::tempdir().expect("a folder");
    let draw = |name: &str| {
        let file = folder.path().join(name);
        let args = ["shot", "--size", "48x48", "--photons", "2000", "--passes", "2", "--pixel", "20,30", "--overlays"];
        let more = ["tiles", "--window", "700x500", "--quiet", "-o", path(&file)];
        let out = cusp(&[&args[..], &more[..]].concat());
        assert!(out.status.success() && out.stdout.is_empty(), "{}", text(&out.stderr));
        let picture = image::open(&file).expect("a picture").to_rgb8();
        assert_eq!(picture.dimensions(), (700, 500));
        let bytes = std::fs::read(&file).expect("reads");
        assert!(bytes.windows(12).any(|w| w == b"cusp.command"));
        picture
    };
    assert!(draw("a.png") == draw("b.png"), "two calls give different pictures");
    let out = folder.path().join("c.png");
    let o = path(&out);
    refused(&["shot", "-o", "c.jpg"], 2, "end the name in .png");
    refused(&["shot", "-o", o, "--window", "10x10"], 2, "--window: sides must lie in");
    refused(&["shot", "-o", o, "--overlays", "ghost"], 2, "there are footprint");
    refused(&["shot", "-o", o, "--pixel", "999,1"], 2, "--pixel: lies outside");
    refused(&["shot", "-o", o, "--maximize", "5"], 2, "numbered 1 to 4");
    refused(&["shot", "-o", o, "--maximize", "2", "--final-gather", "classic"], 2, "numbered 1 to 1");
    refused(&["shot", "-o", o, "nowhere"], 2, "built in: ring");
    assert!(!out.exists());
}

/// A Quake 3 map is a scene like others: rendered, with its triangles told, and in real time.
#[test]
fn maps_are_scenes() {
    let folder = tempfile::tempdir().expect("a folder");
    let image = folder.path().join("room.png");
    let out =
        cusp(&["render", "tests/corpus/map/room.pk3:room", "-o", path(&image), "--size", "32x24", "--photons", "5000"]);
    assert!(out.status.success(), "{}", text(&out.stderr));
    assert!(
        text(&out.stderr).contains("51 triangles in the map, 45 of them read; left out: 2 not drawn, 2 sky, 2 trigger")
    );
    let pixels = image::open(&image).expect("a picture").to_rgb8();
    assert!(pixels.pixels().filter(|p| p[0] > 60).count() > 300);
    let out = cusp(&[
        "realtime",
        "tests/corpus/map/room.bsp",
        "--frames",
        "3",
        "--size",
        "32x24",
        "--json",
        "--set",
        "partition=cell",
    ]);
    assert!(out.status.success(), "{}", text(&out.stderr));
}
