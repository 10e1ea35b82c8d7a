//! `cusp diff` as a user meets it.

#![allow(clippy::expect_used, missing_docs, reason = "a failed expectation is how this program reports")]

use cusp::export::exr_file;
use cusp::measure::image_file;
use cusp::render::film::{Image, Rect};
use glam::Vec3;
use serde_json::Value;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

fn cusp(args: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_cusp")).args(args).output().expect("the binary runs")
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

fn path(p: &Path) -> &str {
    p.to_str().expect("a plain path")
}

/// A call that must be refused with exit code 2 and one line that holds `part`.
fn refused(args: &[&str], part: &str) {
    let out = cusp(args);
    let error = text(&out.stderr);
    assert_eq!(out.status.code(), Some(2), "{args:?}: {error}");
    assert_eq!(error.trim_end().lines().count(), 1, "{args:?}: {error}");
    assert!(error.starts_with("cusp: ") && error.contains(part), "{args:?}: {error}");
    assert!(out.stdout.is_empty(), "{args:?}");
}

/// What `diff --json` says of a call that succeeds.
fn json(args: &[&str]) -> Value {
    let out = cusp(&[&["diff", "--json"], args].concat());
    assert!(out.status.success(), "{args:?}: {}", text(&out.stderr));
    serde_json::from_slice(&out.stdout).expect("JSON")
}

fn number(json: &Value, key: &str) -> f64 {
    json.pointer(key).and_then(Value::as_f64).expect(key)
}

fn image(size: [u32; 2], pixel: impl Fn(u32, u32) -> Vec3) -> Image {
    let pixels = (0..size[1]).flat_map(|y| (0..size[0]).map(move |x| (x, y))).map(|(x, y)| pixel(x, y)).collect();
    Image { size, pixels }
}

fn write(folder: &Path, name: &str, image: &Image) -> PathBuf {
    let file = folder.join(name);
    exr_file::write_with(&file, image, &[]).expect("writes");
    file
}

/// A ramp as reference, and an image that is 0.25 too bright in its left half and 0.5 too dark in its right half.
fn pair() -> [Image; 2] {
    let ramp = |x: u32, y: u32| Vec3::new(1.0, 1.0 + x as f32 / 8.0, 1.0 + y as f32 / 8.0);
    let error = |x: u32| Vec3::splat(if x < 8 { 0.25 } else { -0.5 });
    [image([16, 12], |x, y| ramp(x, y) + error(x)), image([16, 12], ramp)]
}

#[test]
fn an_image_does_not_differ_from_itself() {
    let folder = tempfile::tempdir().expect("a folder");
    let a = write(folder.path(), "a.exr", &pair()[0]);
    let report = json(&[path(&a), path(&a)]);
    for key in ["mse", "rmse", "relative_rmse", "relative_mse", "trimmed_mse", "trimmed_relative_mse"] {
        assert_eq!(number(&report["metrics"], &format!("/{key}")), 0.0, "{key}");
    }
    for key in ["/metrics/smape", "/metrics/bias", "/metrics/max_error", "/flip/mean"] {
        assert_eq!(number(&report, key), 0.0, "{key}");
    }
    assert_eq!(number(&report, "/metrics/mean_ratio"), 1.0);
    assert!(report["version"].is_string() && report["difference"].is_null());
}

#[test]
fn a_known_pair_has_its_errors() {
    let folder = tempfile::tempdir().expect("a folder");
    let [a, b] = pair();
    let (a, b) = (write(folder.path(), "a.exr", &a), write(folder.path(), "b.exr", &b));
    let report = json(&[path(&a), path(&b)]);
    let is = |key: &str, value: f64| assert!((number(&report, key) - value).abs() < 1e-12, "{key}: {report}");
    is("/metrics/mse", (0.0625 + 0.25) / 2.0);
    is("/metrics/bias", -0.125);
    is("/metrics/max_error", 0.5);
    is("/metrics/pixels", 192.0);
    // The reference's mean: 1, 1 + 7.5/8 and 1 + 5.5/8.
    let mean = (3.0 + 7.5 / 8.0 + 5.5 / 8.0) / 3.0;
    is("/metrics/mean_ratio", (mean - 0.125) / mean);
    // All but the first pixel have a channel above 1.
    is("/flip/clipped", 191.0 / 192.0);
    let table = cusp(&["diff", path(&a), path(&b)]);
    let table = text(&table.stdout);
    assert!(table.contains("mse") && table.contains("0.156250") && table.contains("flip"), "{table}");
    assert!(cusp(&["diff", path(&a), path(&b), "--quiet"]).stdout.is_empty());
}

#[test]
fn exposure_brings_back_what_is_brighter_than_white() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = |name: &str, v: f32| write(folder.path(), name, &image([9, 7], |_, _| Vec3::splat(v)));
    let (a, b) = (file("a.exr", 3.0), file("b.exr", 2.0));
    let at = |stops: &str| json(&[path(&a), path(&b), "--exposure", stops]);
    let (plain, dark) = (at("0"), at("-2"));
    assert_eq!((number(&plain, "/flip/mean"), number(&plain, "/flip/clipped")), (0.0, 1.0));
    assert_eq!(number(&dark, "/flip/clipped"), 0.0);
    assert!(number(&dark, "/flip/mean") > 0.1, "{dark}");
    // Errors of radiance do not depend on it.
    assert_eq!(plain["metrics"], dark["metrics"]);
}

#[test]
fn crop_and_mask_choose_the_pixels() {
    let folder = tempfile::tempdir().expect("a folder");
    let [a, b] = pair();
    let (a, b) = (write(folder.path(), "a.exr", &a), write(folder.path(), "b.exr", &b));
    let left = json(&[path(&a), path(&b), "--crop", "2,3,6,4"]);
    assert_eq!((number(&left, "/metrics/mse"), number(&left, "/metrics/pixels")), (0.0625, 24.0));
    let mask = folder.path().join("mask.png");
    let right = image::GrayImage::from_fn(16, 12, |x, _| image::Luma([if x < 8 { 0 } else { 255 }]));
    right.save(&mask).expect("writes");
    let masked = json(&[path(&a), path(&b), "--mask", path(&mask)]);
    assert_eq!((number(&masked, "/metrics/mse"), number(&masked, "/metrics/pixels")), (0.25, 96.0));
    let both = json(&[path(&a), path(&b), "--mask", path(&mask), "--crop", "6,0,4,2"]);
    assert_eq!((number(&both, "/metrics/bias"), number(&both, "/metrics/pixels")), (-0.5, 4.0));
    // FLIP of what counts, too.
    let flip = |report: &Value| number(report, "/flip/mean");
    assert_ne!(flip(&left), flip(&masked));
    refused(&["diff", path(&a), path(&b), "--mask", path(&mask), "--crop", "0,0,8,8"], "no pixel");
    refused(&["diff", path(&a), path(&b), "--crop", "10,0,8,8"], "--crop: leaves the image of 16x12");
    image::GrayImage::new(4, 4).save(&mask).expect("writes");
    refused(&["diff", path(&a), path(&b), "--mask", path(&mask)], "has 4x4 pixels");
}

#[test]
fn the_exr_is_image_less_reference() {
    let folder = tempfile::tempdir().expect("a folder");
    let [a, b] = pair();
    let odd = |p: Vec3| p * Vec3::new(0.1, 0.7, 1.3);
    let a = Image { pixels: a.pixels.iter().map(|p| odd(*p)).collect(), ..a };
    let (file_a, file_b) = (write(folder.path(), "a.exr", &a), write(folder.path(), "b.exr", &b));
    let out = folder.path().join("new/d.exr");
    json(&[path(&file_a), path(&file_b), "-o", path(&out)]);
    let less: Vec<Vec3> = a.pixels.iter().zip(&b.pixels).map(|(x, r)| x - r).collect();
    let difference = image_file::read(&out).expect("reads");
    assert_eq!(difference, Image { size: a.size, pixels: less });
    let bytes = std::fs::read(&out).expect("reads");
    assert!(bytes.windows(9).any(|w| w == b"cusp diff"), "the EXR carries its command line");
    json(&[path(&file_a), path(&file_b), "--crop", "3,2,5,4", "-o", path(&out)]);
    let crop = Rect { x: 3, y: 2, width: 5, height: 4 };
    assert_eq!(image_file::read(&out).expect("reads"), difference.crop(crop));
    json(&[path(&file_a), path(&file_b), "--show", "absolute", "-o", path(&out)]);
    let absolute: Vec<Vec3> = difference.pixels.iter().map(|p| p.abs()).collect();
    assert_eq!(image_file::read(&out).expect("reads").pixels, absolute);
}

#[test]
fn the_png_has_colours_a_bar_and_its_range() {
    let folder = tempfile::tempdir().expect("a folder");
    let [a, b] = pair();
    let (a, b) = (write(folder.path(), "a.exr", &a), write(folder.path(), "b.exr", &b));
    let out = folder.path().join("d.png");
    let report = json(&[path(&a), path(&b), "-o", path(&out)]);
    assert_eq!(report["difference"]["kind"], "signed");
    assert_eq!(number(&report, "/difference/colors/range/high"), 0.5);
    let png = image::open(&out).expect("a PNG").to_rgb8();
    assert!(png.height() > 12 && png.width() >= 16);
    let (bright, dark) = (png.get_pixel(0, 0).0, png.get_pixel(15, 11).0);
    assert!(bright[0] > bright[2] && dark[2] > dark[0], "red is too bright, blue too dark: {bright:?} {dark:?}");
    let bytes = std::fs::read(&out).expect("reads");
    assert!(bytes.windows(10).any(|w| w == b"cusp.range"));
    for show in ["absolute", "relative", "flip"] {
        let table = cusp(&["diff", path(&a), path(&b), "--show", show, "-o", path(&out), "--range", "2"]);
        let table = text(&table.stdout);
        assert!(table.contains(&format!("{show} difference: ")) && table.contains(" to 2.00"), "{table}");
    }
}

#[test]
fn a_png_is_compared_as_linear_values() {
    let folder = tempfile::tempdir().expect("a folder");
    let png = folder.path().join("a.png");
    image::RgbImage::from_pixel(6, 5, image::Rgb([128; 3])).save(&png).expect("writes");
    let linear = write(folder.path(), "b.exr", &image([6, 5], |_, _| Vec3::splat(0.215_860_5)));
    let report = json(&[path(&png), path(&linear)]);
    assert!(number(&report, "/metrics/max_error") < 1e-6, "{report}");
}

#[test]
fn wrong_calls_are_refused_in_one_line() {
    let folder = tempfile::tempdir().expect("a folder");
    let [a, _] = pair();
    let a = write(folder.path(), "a.exr", &a);
    let small = write(folder.path(), "small.exr", &Image::black([4, 3]));
    let no_image = folder.path().join("c.exr");
    std::fs::write(&no_image, "words").expect("writes");
    let (a, small) = (path(&a), path(&small));
    refused(&["diff", a, small], "a.exr has 16x12 pixels");
    refused(&["diff", a, "nowhere.exr"], "nowhere.exr: no such file");
    refused(&["diff", a, path(&no_image)], "neither an EXR nor a PNG");
    refused(&["diff", a], "<REFERENCE>");
    refused(&["diff", a, a, "-o", "d.jpg"], ".exr or .png");
    refused(&["diff", a, a, "--show", "flip"], "--output");
    refused(&["diff", a, a, "--show", "worst", "-o", "d.png"], "worst");
    refused(&["diff", a, a, "--exposure", "nan"], "--exposure");
    refused(&["diff", a, a, "--exposure", "100"], "--exposure: must lie in -64 to 64");
    refused(&["diff", a, a, "--range", "0", "-o", "d.png"], "--range: must be positive");
    refused(&["diff", a, a, "--crop", "1,2,3"], "x,y,width,height");
    assert!(!Path::new("d.png").exists() && !Path::new("d.jpg").exists());
}

#[test]
fn a_place_that_cannot_be_written_is_failed_work() {
    let folder = tempfile::tempdir().expect("a folder");
    let a = write(folder.path(), "a.exr", &pair()[0]);
    let target = a.join("d.png");
    let out = cusp(&["diff", path(&a), path(&a), "-o", path(&target)]);
    assert_eq!(out.status.code(), Some(1), "{}", text(&out.stderr));
    assert!(text(&out.stderr).contains("cannot be written"));
}
