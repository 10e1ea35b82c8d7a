//! What cannot be had is refused before it is begun: memory, places to write to, files that claim too much.

#![allow(clippy::expect_used, missing_docs, reason = "a failed expectation is how this program reports")]

use std::path::Path;
use std::process::{Command, Output, Stdio};

fn cusp(args: &[&str]) -> Output {
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

/// A call that must fail: its exit code, and one line that holds all `parts`.
fn refused(args: &[&str], code: i32, parts: &[&str]) {
    let out = cusp(args);
    let error = text(&out.stderr);
    assert_eq!(out.status.code(), Some(code), "{args:?}: {error}");
    assert_eq!(error.trim_end().lines().count(), 1, "{args:?}: {error}");
    for part in parts {
        assert!(error.starts_with("cusp: ") && error.contains(part), "{args:?}: no `{part}` in {error}");
    }
}

fn path(p: &Path) -> &str {
    p.to_str().expect("a plain path")
}

/// No test machine has the terabytes that these ask for.
#[test]
fn memory_that_cannot_be_had_is_told_before_it_is_taken() {
    let folder = tempfile::tempdir().expect("a folder");
    let o = path(folder.path());
    let exr = path(&folder.path().join("a.exr")).to_owned();
    let render = |more: &[&'static str]| {
        let mut args = vec!["render", "cornell", "-o", exr.as_str()];
        args.extend(more);
        args.iter().map(|a| (*a).to_owned()).collect::<Vec<_>>()
    };
    let compare = |more: &[&'static str]| {
        let mut args = vec!["compare", "cornell", "--out", o];
        args.extend(more);
        args.iter().map(|a| (*a).to_owned()).collect::<Vec<_>>()
    };
    let photons = ["2147483648 photons a pass", "would need", "can be had", "--photons"];
    let cases: Vec<(Vec<String>, Vec<&str>)> = vec![
        (render(&["--photons", "1e18"]), vec!["--photons: must lie in 1 to 2147483648"]),
        (render(&["--photons", "2147483648", "--size", "8x8"]), photons.to_vec()),
        (render(&["--photons", "2147483648", "--size", "8x8", "--plan", "full"]), photons.to_vec()),
        (compare(&["--photons", "2147483648", "--size", "8x8"]), photons.to_vec()),
        (render(&["--size", "1000000x1000000"]), vec!["--size: 1000000x1000000 pixels"]),
        (render(&["--size", "4294967295x4294967295"]), vec!["--size"]),
        (render(&["--k", "4e9"]), vec!["--k: must lie in 1 to 1000000"]),
        (render(&["--passes", "1e12"]), vec!["--passes"]),
        (render(&["--max-depth", "4e9"]), vec!["--max-depth: must lie in 1 to 1000"]),
        (
            compare(&["--size", "2048x2048", "--crop", "0,0,2048,2048", "--enlarge", "32"]),
            vec!["a sheet of 6 crops of 65536x65536 pixels would need", "--enlarge"],
        ),
        (
            ["inspect", "cornell", "--pixel", "1,1", "--size", "8x8", "--photons", "2147483648"].map(Into::into).into(),
            photons.to_vec(),
        ),
    ];
    for (args, parts) in cases {
        let args: Vec<&str> = args.iter().map(String::as_str).collect();
        refused(&args, 2, &parts);
    }
    assert_eq!(std::fs::read_dir(folder.path()).expect("reads").count(), 0, "nothing is written");
    // All combinations are counted before any is made.
    let many: Vec<String> = (1..=200).map(|n| n.to_string()).collect();
    let list = |key: &str| format!("{key}={}", many.join(","));
    let sweeps = [list("photons"), list("k"), list("footprint_scale")];
    let study = ["study", "ring", "--estimators", "density", "--gather", "knn", "--out", o];
    let args: Vec<&str> = study.into_iter().chain(sweeps.iter().flat_map(|s| ["--sweep", s.as_str()])).collect();
    refused(&args, 2, &["--sweep: 8000000 combinations, 1000000 at most"]);
}

/// A chunk of a PNG: length, name, content and their check (CRC-32).
fn chunk(name: &[u8; 4], content: &[u8]) -> Vec<u8> {
    let body = [&name[..], content].concat();
    let step = |crc: u32| if crc & 1 == 1 { (crc >> 1) ^ 0xedb8_8320 } else { crc >> 1 };
    let crc = !body.iter().fold(!0u32, |crc, b| (0..8).fold(crc ^ u32::from(*b), |c, _| step(c)));
    [&(content.len() as u32).to_be_bytes()[..], &body, &crc.to_be_bytes()].concat()
}

/// A picture's header may claim what no file holds.
#[test]
fn files_that_claim_too_much_are_refused_by_line() {
    let folder = tempfile::tempdir().expect("a folder");
    let at = |name: &str| folder.path().join(name);
    let camera = "[camera]\nposition = [0, 1, 3]\ntarget = [0, 0, 0]\nfov_y = 40\n";
    let ring = "[[shapes]]\nkind = \"ring\"\ninner = 1\nouter = 2\nheight = 1\nsegments = 1000000\nmaterial = \"a\"\n";
    let material = "[materials.a]\nkind = \"diffuse\"\n";
    let quad = "[[shapes]]\nkind = \"quad\"\nu = [1, 0, 0]\nv = [0, 0, -1]\nmaterial = \"a\"\n";
    // A header of 65535 pixels each way, eight bits, colours; no pixels follow.
    let header = [&65_535u32.to_be_bytes()[..], &65_535u32.to_be_bytes(), &[8, 2, 0, 0, 0]].concat();
    let png =
        [&b"\x89PNG\r\n\x1a\n"[..], &chunk(b"IHDR", &header), &chunk(b"IDAT", b""), &chunk(b"IEND", b"")].concat();
    std::fs::write(at("t.png"), &png).expect("writes");
    std::fs::write(at("far.obj"), "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 4000000000\n").expect("writes");
    std::fs::write(at("wide.obj"), "v 0 0 0\nv 1 0 0\nv 0 1 1e300\nf 1 2 3\n").expect("writes");
    let mesh = |f: &str| format!("{camera}{material}[[shapes]]\nkind = \"mesh\"\nfile = \"{f}\"\nmaterial = \"a\"\n");
    let light = |l: &str| format!("{camera}{material}{quad}[[lights]]\n{l}");
    let cases = [
        // 60 thousand million triangles, of which none is made: what is told is what is short first.
        (format!("{camera}{material}{}", ring.repeat(10_000)), vec!["triangles", "in all", "; lower segments"]),
        (
            format!("{camera}{material}texture = \"t.png\"\n{quad}"),
            vec!["s.toml:7: materials.a.texture", "65535x65535 pixels would need"],
        ),
        (mesh("far.obj"), vec!["far.obj:4: ", "4000000000"]),
        (mesh("wide.obj"), vec!["wide.obj:3: ", "1e15 at most"]),
        (
            light("kind = \"point\"\nposition = [0, 1, 0]\npower = [1e39, 0, 0]\n"),
            vec!["s.toml:15: lights[0].power", "1e30 at most"],
        ),
        (
            light("kind = \"point\"\nposition = [1e30, 1, 0]\npower = [1, 0, 0]\n"),
            vec!["s.toml:14: lights[0].position", "1e15 at most"],
        ),
        (
            light("kind = \"sphere\"\nposition = [0, 1, 0]\nradius = 1e-30\npower = [1, 0, 0]\n"),
            vec!["s.toml:12: lights[0]", "its radiance must be at most"],
        ),
        (
            light("kind = \"sphere\"\nposition = [0, 1, 0]\nradius = 0\npower = [1, 0, 0]\n"),
            vec!["s.toml:15: lights[0].radius", "positive"],
        ),
        (
            light("kind = \"point\"\nposition = [0, 1, 0]\npower = [1e-30, 0, 0]\n"),
            vec!["s.toml:12: lights[0]", "its flux must be 0 or at least"],
        ),
        (camera.replace("40", "0"), vec!["s.toml:4: camera.fov_y"]),
        (camera.replace("40", "1e-300"), vec!["s.toml:4: camera.fov_y"]),
        (
            format!("{camera}{material}{}", quad.replace("[1, 0, 0]", "[1e13, 0, 0]")),
            vec!["shapes: the scene's radius must lie in"],
        ),
        (
            format!("{camera}{material}{quad}scale = 1e15\ntranslate = [1e15, 0, 0]\n"),
            vec!["s.toml:7: shapes[0]: reaches"],
        ),
        (format!("{camera}name = \"a\\nb\"\n"), vec!["s.toml:5: ", "unknown field"]),
        (format!("{camera}{quad}").replace("\"a\"", "\"a\\nb\""), vec!["no material `a\\nb`"]),
    ];
    let exr = at("a.exr");
    for (body, parts) in cases {
        std::fs::write(at("s.toml"), &body).expect("writes");
        refused(&["render", path(&at("s.toml")), "-o", path(&exr)], 2, &parts);
        assert!(!exr.exists(), "{parts:?}");
    }

    // A good file whose window is made 10⁹ pixels each way.
    let call = ["render", "plane", "--size", "8x8", "-o", path(&exr), "--quiet"];
    assert!(cusp(&call).status.success());
    let mut bytes = std::fs::read(&exr).expect("reads");
    for key in [&b"dataWindow\0box2i\0"[..], b"displayWindow\0box2i\0"] {
        let start = bytes.windows(key.len()).position(|w| w == key).expect("its windows") + key.len() + 4 + 8;
        bytes[start..start + 4].copy_from_slice(&999_999_999i32.to_le_bytes());
        bytes[start + 4..start + 8].copy_from_slice(&999_999_999i32.to_le_bytes());
    }
    let huge = at("huge.exr");
    std::fs::write(&huge, &bytes).expect("writes");
    // Its chunks are not those of such a window, or it would need too much: it depends on what is looked at first.
    let needs = ["huge.exr: "];
    refused(&["diff", path(&huge), path(&exr)], 2, &needs);
    refused(&["compare", "plane", "--reference", path(&huge), "--out", path(&at("never"))], 2, &needs);
    assert!(!at("never").exists());
}

/// Whatever is in the way, an older file stays and no part of a new one is left.
#[test]
fn places_that_cannot_be_written_to_are_named() {
    let folder = tempfile::tempdir().expect("a folder");
    let at = |name: &str| path(&folder.path().join(name)).to_owned();
    std::fs::create_dir(at("folder.exr")).expect("a folder");
    std::fs::write(at("file"), "old").expect("a file");
    let long = format!("{}.exr", "n".repeat(300));
    let small = ["--size", "8x8", "--photons", "100", "--quiet"];
    for (out, why) in [
        (at("folder.exr"), "a folder is in its place"),
        (at("file/a.exr"), "not a directory"),
        (at("file/b/a.exr"), "ot a directory"),
        (at(&long), "too long"),
        ("/proc/cusp/a.exr".to_owned(), "cannot be written"),
    ] {
        let place: &str = if out.len() < 200 { &out } else { &long };
        let render: Vec<&str> = ["render", "plane", "-o", &out].into_iter().chain(small).collect();
        refused(&render, 1, &[place, "cannot be written", why]);
    }
    let good = at("good.exr");
    let stats: Vec<&str> = ["render", "plane", "-o", &good, "--stats", "/dev/full"].into_iter().chain(small).collect();
    if Path::new("/dev/full").exists() {
        refused(&stats, 1, &["/dev/full: cannot be written: No space left"]);
    }
    let under = at("file");
    for args in [
        vec!["compare", "plane", "--out", &under, "--estimators", "regular", "--truth", "none"],
        vec!["study", "plane", "--out", &under, "--estimators", "regular", "--passes", "1", "--seeds", "1"],
    ] {
        refused(&args.into_iter().chain(small).collect::<Vec<_>>(), 1, &["file/", "cannot be written"]);
    }
    assert!(cusp(&["render", "plane", "-o", &good, "--size", "8x8", "--quiet"]).status.success());
    refused(&["diff", &good, &good, "-o", &at("folder.exr")], 1, &["folder.exr", "a folder is in its place"]);
    assert_eq!(std::fs::read_to_string(at("file")).expect("reads"), "old");
    let mut left: Vec<String> = std::fs::read_dir(folder.path())
        .expect("reads")
        .map(|e| e.expect("an entry").file_name().to_string_lossy().into_owned())
        .collect();
    left.sort();
    assert_eq!(left, ["file", "folder.exr", "good.exr"], "no part of a file is left");
}

/// A full disk behind the standard output is failed work.
#[cfg(target_os = "linux")]
#[test]
fn a_full_output_is_told() {
    let full = std::fs::OpenOptions::new().write(true).open("/dev/full").expect("a device");
    let out = Command::new(env!("CARGO_BIN_EXE_cusp"))
        .args(["estimators", "--json"])
        .stdout(full)
        .stderr(Stdio::piped())
        .output()
        .expect("runs");
    let error = text(&out.stderr);
    assert_eq!(out.status.code(), Some(1), "{error}");
    assert!(error.starts_with("cusp: standard output: No space left"), "{error}");
}

/// Pixels of files by others that are not finite are left out of every metric, and told of.
#[test]
fn pixels_that_are_not_finite_are_left_out_and_counted() {
    let folder = tempfile::tempdir().expect("a folder");
    let at = |name: &str| path(&folder.path().join(name)).to_owned();
    let write = |name: &str, odd: &[(u32, f32)]| {
        let mut buffer = image::ImageBuffer::from_pixel(8, 8, image::Rgb([0.5f32, 0.25, 1.0]));
        odd.iter().for_each(|(x, v)| buffer.put_pixel(*x, 2, image::Rgb([0.5, *v, 1.0])));
        let image = image::DynamicImage::ImageRgb32F(buffer);
        image.save_with_format(at(name), image::ImageFormat::OpenExr).expect("writes");
        at(name)
    };
    let good = write("good.exr", &[]);
    let odd = write("odd.exr", &[(3, f32::NAN), (5, f32::INFINITY), (7, f32::NEG_INFINITY)]);
    let difference = at("d.exr");
    let out = cusp(&["diff", &good, &odd, "--json", "-o", &difference, "--show", "signed"]);
    let json: serde_json::Value = serde_json::from_slice(&out.stdout).expect("JSON");
    assert_eq!(json["not_finite"], serde_json::json!([0, 3]));
    assert_eq!((json["metrics"]["pixels"].as_u64(), json["metrics"]["mse"].as_f64()), (Some(61), Some(0.0)));
    assert!(!json["metrics"].to_string().contains("null") && !json["flip"].to_string().contains("null"));
    let image = cusp::measure::image_file::read(Path::new(&difference)).expect("finite");
    assert!(image.pixels.iter().all(|p| *p == glam::Vec3::ZERO));
    let told = text(&cusp(&["diff", &odd, &good]).stderr);
    assert!(
        told.contains("odd.exr: 3 pixels are not finite, the first at 3,2 (R 0.5, G NaN, B 1); left out"),
        "{told}"
    );

    let small = ["--size", "8x8", "--photons", "100", "--estimators", "regular", "--truth", "none"];
    let dir = at("out");
    let call: Vec<&str> =
        ["compare", "plane", "--reference", &odd, "--out", &dir, "--json"].into_iter().chain(small).collect();
    let json: serde_json::Value = serde_json::from_slice(&cusp(&call).stdout).expect("JSON");
    assert_eq!(json["estimators"][0]["reference_error"]["pixels"].as_u64(), Some(61));
    let source = json["reference"].as_str().expect("a source");
    assert!(source.contains("3 pixels are not finite, the first at 3,2"), "{source}");
    let all = write("all.exr", &(0..8).map(|x| (x, f32::NAN)).collect::<Vec<_>>());
    let out = cusp(&["diff", &all, &good, "--crop", "0,2,8,1"]);
    assert!(text(&out.stderr).contains("leaves no pixel") && out.status.code() == Some(2));
}
