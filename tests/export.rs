//! What the window exports, opened and checked: it is what the window shows, and it can be made again.

#![allow(clippy::expect_used, missing_docs, reason = "a failed expectation is how this program reports")]

mod frames;

use cusp::export::exr_file;
use cusp::export::session::{Difference, Mode, Panel, Session};
use cusp::measure::Reference;
use cusp::render::film::{Image, Rect};
use cusp::workbench::Workbench;
use cusp::workbench::actions::Action;
use cusp::workbench::document::Opened;
use cusp::workbench::messages::Gravity;
use frames::run_until;
use std::path::Path;
use std::process::Command;

const SIZE: [u32; 2] = [64, 64];
const CROP: Rect = Rect { x: 10, y: 20, width: 48, height: 32 };
const ENLARGE: u32 = 4;

/// A window on `session` that has rendered all its passes.
fn finished(context: &egui::Context, session: Session) -> Workbench {
    let opened = Opened::new(session).expect("opens");
    let mut workbench = Workbench::new(context, opened, None).expect("threads");
    run_until(&mut workbench, context, Workbench::is_idle);
    // What panels show is asked for when the passes are there.
    run_until(&mut workbench, context, Workbench::is_idle);
    workbench
}

/// Exports and waits for the message that says so.
fn export(workbench: &mut Workbench, context: &egui::Context, folder: &Path) -> (Gravity, String) {
    let find = |w: &Workbench| {
        let about = |m: &&cusp::workbench::messages::Message| m.text.contains("export") || m.gravity == Gravity::Error;
        w.messages().all().iter().rev().find(about).map(|m| (m.gravity, m.text.clone()))
    };
    workbench.run(Action::DismissMessages);
    workbench.run(Action::ExportTo(folder.to_string_lossy().into_owned()));
    run_until(workbench, context, |w| find(w).is_some());
    find(workbench).expect("found just now")
}

fn session() -> Session {
    let mut session = Session::of("ring");
    session.size = Some(SIZE);
    session.passes = 1;
    session.seed = 7;
    session.render.photons = Some(20_000);
    session.crop = Some([CROP.x, CROP.y, CROP.width, CROP.height]);
    session.enlarge = ENLARGE;
    session.panels = vec![Panel::of("regular"), Panel::of("integrated")];
    session
}

fn read(path: &Path) -> Image {
    Reference::from_files(path, None).expect("an image").image
}

fn bits(image: &Image) -> Vec<[u32; 3]> {
    image.pixels.iter().map(|p| p.to_array().map(f32::to_bits)).collect()
}

/// The fields of a line of CSV; commas inside quotes are part of a field.
fn fields(line: &str) -> Vec<String> {
    let mut fields = vec![String::new()];
    let mut quoted = false;
    for c in line.chars() {
        match c {
            '"' => quoted = !quoted,
            ',' if !quoted => fields.push(String::new()),
            c => fields.last_mut().expect("never empty").push(c),
        }
    }
    fields
}

#[test]
fn files_hold_what_the_window_shows() {
    let folder = tempfile::tempdir().expect("a folder");
    let out = folder.path().join("out");
    // A reference of our own, as errors need one that fits.
    let reference = folder.path().join("grey.exr");
    let grey = Image { size: SIZE, pixels: vec![glam::Vec3::splat(0.25); 64 * 64] };
    exr_file::write_with(&reference, &grey, &[]).expect("writes");
    let mut session = session();
    session.reference = Some(reference.to_string_lossy().into_owned());
    // An image of another size, which the crop meets in part.
    let other = folder.path().join("other.exr");
    let pixels = (0..30 * 40).map(|i| glam::Vec3::new(i as f32, 0.5, 1.0) / 1200.0).collect();
    let loaded = Image { size: [30, 40], pixels };
    exr_file::write_with(&other, &loaded, &[]).expect("writes");
    session.panels.push(Panel { image: Some(other.to_string_lossy().into_owned()), ..Panel::of("") });
    session.tone.offset = 0.05;
    let context = egui::Context::default();
    let mut workbench = finished(&context, session);
    // The brightest pixel has photons to list.
    let first = workbench.gallery().of_estimator("regular").expect("an image").pixels().to_image();
    let at = |i: u32| [i % 64, i / 64];
    let bright = (0..64 * 64).max_by(|a, b| first.pixels[*a].x.total_cmp(&first.pixels[*b].x)).expect("pixels") as u32;
    let pins = [[0, 63], at(bright)];
    pins.into_iter().for_each(|pin| workbench.run(Action::Pin(pin)));
    let (gravity, message) = export(&mut workbench, &context, &out);
    assert_eq!(gravity, Gravity::Note, "{message}");

    for (i, name) in ["regular", "integrated"].into_iter().enumerate() {
        let shown = workbench.gallery().of(&workbench.session().panels[i]).expect("an image").pixels().to_image();
        assert!(shown.pixels.iter().any(|p| p.max_element() > 0.0));
        let written = read(&out.join(format!("{name}.exr")));
        assert_eq!(bits(&written), bits(&shown), "{name}");
        let crop = read(&out.join(format!("{name}_crop.exr")));
        assert_eq!((crop.size, bits(&crop)), ([CROP.width, CROP.height], bits(&shown.crop(CROP))), "{name}");

        // The bytes of the screen: exposure by the images, the offset, the sRGB curve.
        let whole = image::open(out.join(format!("{name}.png"))).expect("a PNG").to_rgb8();
        assert_eq!(whole.dimensions(), (64, 64));
        let exposure = workbench.desk().auto_exposure;
        let shade = cusp::workbench::gallery::shade::Shade::new(&workbench.session().tone, exposure);
        let table = cusp::export::tone::SrgbTable::new();
        for (x, y, pixel) in whole.enumerate_pixels() {
            let [r, g, b, _] = shade.color(&table, shown.at(x, y)).to_array();
            assert_eq!(pixel.0, [r, g, b], "{name} {x} {y}");
        }
        let enlarged = image::open(out.join(format!("{name}_crop.png"))).expect("a PNG").to_rgb8();
        assert_eq!(enlarged.width(), CROP.width * ENLARGE);
        assert!(enlarged.height() > CROP.height * ENLARGE, "a label lies below");
        for y in 0..CROP.height * ENLARGE {
            for x in 0..CROP.width * ENLARGE {
                let from = whole.get_pixel(CROP.x + x / ENLARGE, CROP.y + y / ENLARGE);
                assert_eq!(enlarged.get_pixel(x, y), from, "{name} {x} {y}");
            }
        }
        let label = enlarged.rows().skip((CROP.height * ENLARGE) as usize).flatten();
        assert!(label.into_iter().any(|p| p.0[0] > 150), "the label has ink");
        for file in [format!("{name}.exr"), format!("{name}_crop.png")] {
            let bytes = std::fs::read(out.join(&file)).expect("reads");
            for fact in ["cusp.version", "cusp.seed", "cusp.scene_hash", "cusp.estimator", "cusp.passes"] {
                assert!(bytes.windows(fact.len()).any(|w| w == fact.as_bytes()), "{file} carries {fact}");
            }
        }
    }
    assert_eq!(bits(&read(&out.join("image-other.exr"))), bits(&loaded));
    let part = Rect { x: 10, y: 20, width: 20, height: 20 };
    assert_eq!(bits(&read(&out.join("image-other_crop.exr"))), bits(&loaded.crop(part)));
    let sheet = image::open(out.join("sheet.png")).expect("a PNG");
    assert_eq!(sheet.width(), 12 + 3 * (CROP.width * ENLARGE + 12));

    let csv = std::fs::read_to_string(out.join("timings.csv")).expect("reads");
    let lines: Vec<Vec<String>> = csv.lines().map(fields).collect();
    assert!(lines.len() == 3 && lines.iter().all(|l| l.len() == lines[0].len()), "{csv}");
    let json: serde_json::Value =
        serde_json::from_slice(&std::fs::read(out.join("timings.json")).expect("reads")).expect("JSON");
    assert_eq!((&json["seed"], &json["scene"], &json["size"][1]), (&7.into(), &"ring".into(), &64.into()));
    assert!(json["version"].is_string() && json["settings"]["photons"] == 20_000);
    for (line, name) in lines[1..].iter().zip(["regular", "integrated"]) {
        let field = |key: &str| &line[lines[0].iter().position(|k| k == key).expect(key)];
        assert_eq!((field("estimator").as_str(), field("passes").as_str()), (name, "1"));
        let number = |key: &str| field(key).parse::<f64>().expect(key);
        let parts = ["photons_and_maps_s", "view_trace_s", "gather_s", "estimate_s", "final_gather_s"].map(number);
        assert!((parts.iter().sum::<f64>() - number("total_s")).abs() < 1e-5 && number("total_s") > 0.0, "{csv}");
        let image = read(&out.join(format!("{name}.exr")));
        let error = Reference::from_files(&reference, None).expect("reads").error_of(&image).expect("sizes fit");
        assert!((number("relative_rmse") / error.relative_rmse - 1.0).abs() < 1e-6);
    }

    for [x, y] in pins {
        let table = std::fs::read_to_string(out.join(format!("photons-{x}-{y}.csv"))).expect("reads");
        let rows: Vec<Vec<String>> = table.lines().map(fields).collect();
        assert!(rows.iter().all(|r| r.len() == rows[0].len()), "{table}");
        assert!(rows[0].contains(&"weight integrated".to_owned()), "{table}");
        assert!(rows.len() > 1 || [x, y] != at(bright), "{table}");
    }

    let mut again = Session::open(&out.join("session.toml")).expect("opens");
    let layout = again.layout.take().expect("the layout is part of it");
    assert!(cusp::workbench::layout::from_text(&layout).is_some());
    let is = |named: Option<String>, path: &Path| {
        let whole = |p: &Path| std::fs::canonicalize(p).expect("is there");
        assert_eq!(whole(named.expect("a path").as_ref()), whole(path));
    };
    is(again.reference.take(), &reference);
    is(again.panels[2].image.take(), &other);
    let mut expected = Session { reference: None, layout: None, ..workbench.session().clone() };
    expected.panels[2].image = None;
    assert_eq!(again, expected);
    let text = std::fs::read_to_string(out.join("session.toml")).expect("reads");
    assert!(text.contains("\"../grey.exr\"") && text.contains("\"../other.exr\""), "{text}");
    // The window that it reopens shows the same.
    let mut reopened = finished(&context, Session::open(&out.join("session.toml")).expect("opens"));
    let second = folder.path().join("second");
    assert_eq!(export(&mut reopened, &context, &second).0, Gravity::Note);
    for file in ["regular.exr", "integrated_crop.exr", "image-other.exr"] {
        assert_eq!(bits(&read(&second.join(file))), bits(&read(&out.join(file))), "{file}");
    }
}

#[test]
fn numbers_that_panels_show_are_files() {
    let folder = tempfile::tempdir().expect("a folder");
    let mut session = session();
    session.comparison.mode = Mode::Difference;
    session.comparison.with = Some(0);
    session.panels.push(Panel { heatmap: Some("photons".into()), ..Panel::of("integrated") });
    let context = egui::Context::default();
    let mut workbench = finished(&context, session);
    let (gravity, message) = export(&mut workbench, &context, folder.path());
    assert_eq!(gravity, Gravity::Note, "{message}");
    let image = |name: &str| read(&folder.path().join(format!("{name}.exr")));

    // Two panels of one estimator are told apart by the heatmap.
    let (regular, integrated) = (image("regular"), image("integrated"));
    let difference = image("integrated_values");
    assert_eq!(difference.size, SIZE);
    let mut other_than_zero = 0;
    for ((d, x), r) in difference.pixels.iter().zip(&integrated.pixels).zip(&regular.pixels) {
        let expected = ((x.as_dvec3() - r.as_dvec3()).element_sum() / 3.0) as f32;
        assert_eq!(d.to_array(), [expected; 3]);
        other_than_zero += usize::from(expected != 0.0);
    }
    assert!(other_than_zero > 100, "{other_than_zero} pixels differ");
    let crop = image("integrated_values_crop");
    assert_eq!(bits(&crop), bits(&difference.crop(CROP)));
    assert!(!folder.path().join("regular_values.exr").exists(), "it is what others are compared with");

    let heatmap = image("integrated-photons_values");
    let shown = workbench.gallery().values.get(&2).expect("the heatmap");
    assert!(shown.values.iter().any(|v| *v > 0.0));
    for (pixel, v) in heatmap.pixels.iter().zip(shown.values.iter()) {
        assert_eq!(pixel.to_array(), [*v; 3]);
    }
    let png = image::open(folder.path().join("integrated-photons_values.png")).expect("a PNG").to_rgb8();
    assert!(png.width() >= 64 && png.height() > 64 + 16, "a label and a bar lie below");
    let scale = shown.scale(cusp::export::tone::color_map(None), shown.range);
    assert_eq!(png.get_pixel(30, 40).0, scale.color(shown.at([30, 40]).expect("inside")));
    // The bar runs from the low end to the high end.
    let rows = || (64..png.height()).map(|y| (4..png.width() - 4).map(move |x| (x, y)));
    let ends = [scale.color(scale.range().low), scale.color(scale.range().high)];
    let has_bar = rows().any(|row| {
        let row: Vec<_> = row.map(|(x, y)| png.get_pixel(x, y).0).collect();
        [row[0], row[row.len() - 1]] == ends
    });
    assert!(has_bar);
}

#[test]
fn a_difference_to_the_reference_comes_with_the_reference() {
    let folder = tempfile::tempdir().expect("a folder");
    let reference = folder.path().join("grey.exr");
    let grey = Image { size: SIZE, pixels: vec![glam::Vec3::splat(0.25); 64 * 64] };
    exr_file::write_with(&reference, &grey, &[]).expect("writes");
    let mut session = session();
    session.reference = Some(reference.to_string_lossy().into_owned());
    session.comparison.mode = Mode::Difference;
    session.comparison.difference = Difference::Absolute;
    session.crop = None;
    let context = egui::Context::default();
    let mut workbench = finished(&context, session);
    let out = folder.path().join("out");
    let (gravity, message) = export(&mut workbench, &context, &out);
    assert_eq!(gravity, Gravity::Note, "{message}");
    let image = |name: &str| read(&out.join(format!("{name}.exr")));
    let exported = image("reference");
    assert_eq!(bits(&exported), bits(&grey));
    for name in ["regular", "integrated"] {
        let (x, d) = (image(name), image(&format!("{name}_values")));
        for ((d, x), r) in d.pixels.iter().zip(&x.pixels).zip(&exported.pixels) {
            let expected = ((x.as_dvec3() - r.as_dvec3()).abs().element_sum() / 3.0) as f32;
            assert_eq!(d.to_array(), [expected; 3]);
        }
        // Without a crop it is the whole image that is enlarged.
        assert_eq!(bits(&image(&format!("{name}_crop"))), bits(&x));
        let png = image::open(out.join(format!("{name}_crop.png"))).expect("a PNG");
        assert_eq!(png.width(), 64 * ENLARGE);
    }
}

#[test]
fn compare_makes_the_same_images_from_the_exported_session() {
    let folder = tempfile::tempdir().expect("a folder");
    let (shown, made) = (folder.path().join("shown"), folder.path().join("made"));
    let mut session = session();
    let opened = session.open_scene().expect("opens").0;
    let mut lights = opened.file.lights;
    lights[0].power = lights[0].power.map(|p| p.map(|x| 3.0 * x));
    session.lights = Some(lights);
    let context = egui::Context::default();
    let mut workbench = finished(&context, session);
    let (gravity, message) = export(&mut workbench, &context, &shown);
    assert_eq!(gravity, Gravity::Note, "{message}");
    let run = Command::new(env!("CARGO_BIN_EXE_cusp"))
        .arg("compare")
        .arg(shown.join("session.toml"))
        .arg("--out")
        .arg(&made)
        .args(["--truth", "none", "--quiet"])
        .output()
        .expect("runs");
    assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
    for name in ["regular", "integrated", "regular_crop", "integrated_crop"] {
        let name = format!("{name}.exr");
        assert_eq!(bits(&read(&shown.join(&name))), bits(&read(&made.join(&name))), "{name}");
    }
}

#[test]
fn an_export_that_fails_is_one_error() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("file");
    std::fs::write(&file, "x").expect("writes");
    let context = egui::Context::default();
    let mut workbench = finished(&context, session());
    let (gravity, message) = export(&mut workbench, &context, &file.join("out"));
    assert_eq!(gravity, Gravity::Error);
    assert!(message.contains("cannot be written") && !message.contains('\n'), "{message}");
    run_until(&mut workbench, &context, Workbench::is_idle);
    assert_eq!(workbench.messages().all().iter().filter(|m| m.gravity == Gravity::Error).count(), 1);
}
