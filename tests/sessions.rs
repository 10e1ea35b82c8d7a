//! Sessions without a window, and what the window does when their scene changes on disk.

#![allow(clippy::expect_used, missing_docs, reason = "a failed expectation is how this program reports")]

mod frames;

use cusp::export::session::{Panel, Session};
use cusp::math::rgb::mean;
use cusp::measure::Reference;
use cusp::render::film::Image;
use cusp::workbench::Workbench;
use cusp::workbench::actions::Action;
use cusp::workbench::document::Opened;
use cusp::workbench::messages::Gravity;
use frames::run_until;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::time::{Duration, Instant, SystemTime};

fn compare(session: &Path, out: &Path) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_cusp"));
    command.arg("compare").arg(session).arg("--out").arg(out).args(["--truth", "none", "--json"]);
    command.output().expect("the binary runs")
}

fn read(path: &Path) -> Image {
    Reference::from_files(path, None).expect("an image").image
}

fn brightness(image: &Image) -> f64 {
    image.pixels.iter().map(|p| f64::from(mean(*p))).sum::<f64>() / image.pixels.len() as f64
}

/// A session file on the ring with its light `factor` times as strong.
fn session_file(folder: &Path, factor: f64) -> PathBuf {
    let path = folder.join(format!("times-{factor}.toml"));
    let power = 100.0 * factor;
    let text = format!(
        "session = 1\nscene = \"ring\"\nsize = [48, 40]\nseed = 5\ncrop = [8, 10, 24, 16]\nenlarge = 2\n\
         [render]\nphotons = 10000\nfootprint_scale = 2.0\n\
         [[lights]]\nkind = \"point\"\nposition = [-2.5, 2.2, -1.2]\npower = [{power}, {power}, {power}]\n\
         [[panels]]\nestimator = \"integrated\"\n[[panels]]\nestimator = \"multi_sampled:n=2,grid=cells\"\n\
         [[panels]]\nestimator = \"integrated\"\nheatmap = \"photons\"\n"
    );
    std::fs::write(&path, text).expect("writes");
    path
}

#[test]
fn compare_does_what_the_session_says() {
    let folder = tempfile::tempdir().expect("a folder");
    let mut images = Vec::new();
    for factor in [1.0, 2.0] {
        let out = folder.path().join(format!("out-{factor}"));
        let run = compare(&session_file(folder.path(), factor), &out);
        assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
        let report: serde_json::Value = serde_json::from_slice(&run.stdout).expect("JSON");
        assert_eq!((&report["size"][0], &report["size"][1]), (&48.into(), &40.into()));
        assert_eq!((&report["seed"], &report["settings"]["photons"]), (&5.into(), &10_000.into()));
        assert_eq!(report["settings"]["footprint_scale"], 2.0);
        assert_eq!((&report["crop"]["x"], &report["crop"]["height"]), (&8.into(), &16.into()));
        let estimators = report["estimators"].as_array().expect("a list");
        let names: Vec<_> = estimators.iter().map(|e| (e["id"].as_str(), e["settings"].as_str())).collect();
        // Two panels of one estimator are rendered once.
        assert_eq!(names, [(Some("integrated"), Some("")), (Some("multi_sampled"), Some("n=2,grid=cells"))]);
        let crop = image::open(out.join("integrated_crop.png")).expect("a PNG");
        assert_eq!((crop.width(), crop.height()), (48, 32));
        let image = read(&out.join("multi_sampled.exr"));
        assert_eq!(image.size, [48, 40]);
        assert_eq!(
            read(&out.join("multi_sampled_crop.exr")),
            image.crop(cusp::render::film::Rect { x: 8, y: 10, width: 24, height: 16 })
        );
        images.push(image);
    }
    let ratio = brightness(&images[1]) / brightness(&images[0]);
    assert!(brightness(&images[0]) > 0.0 && (ratio - 2.0).abs() < 1e-5, "{ratio}");
}

#[test]
fn bad_sessions_are_refused_in_one_line() {
    let folder = tempfile::tempdir().expect("a folder");
    let out = folder.path().join("out");
    let file = folder.path().join("s.toml");
    for (text, line, part) in [
        ("session = 1\nscene = \"ring\"\n\ncolour = 3\n", 4, "colour"),
        ("session = 1\nscene = \"ring\"\n[tone]\ncolour = 3\n", 4, "colour"),
        ("session = 1\nscene = \"ring\"\n[[panels]]\nestimator = \"sharp\"\n", 4, "there are density"),
        ("# mine\nsession = 2\nscene = \"ring\"\n", 2, "is version 2; this program reads 1"),
        ("session = 1\nseed = 3\n", 1, "scene"),
        ("session = 1\nseed = 3\nscene = \"nowhere.toml\"\n", 3, "no such file"),
        ("session = 1\nscene = \"rings\"\n", 2, "no such file"),
        ("session = 1\nscene = \"ring\"\nenlarge = 0\n", 3, "1 to 32"),
        ("session = 1\nscene = \"ring\"\ncrop = [1, 2, 0, 4]\n", 3, "at least 1"),
        ("session = 1\nscene = \"ring\"\nsize = [0.5, 2]\n", 3, "size"),
        ("session = 1\nscene = \"ring\n", 2, ""),
        (
            "session = 1\nscene = \"ring\"\n[[lights]]\nkind = \"point\"\nposition = [0, 1, 0]\npower = [-1, 0, 0]\n",
            6,
            "lights[0].power",
        ),
        (
            "session = 1\nscene = \"ring\"\n[materials.floor]\nkind = \"diffuse\"\nreflectance = [2, 0, 0]\n",
            5,
            "materials.floor.reflectance",
        ),
    ] {
        std::fs::write(&file, text).expect("writes");
        let run = compare(&file, &out);
        let error = String::from_utf8_lossy(&run.stderr).into_owned();
        assert_eq!(run.status.code(), Some(2), "{text}: {error}");
        assert_eq!(error.trim_end().lines().count(), 1, "{text}: {error}");
        assert!(error.contains(&format!("s.toml:{line}: ")) && error.contains(part), "{text}: {error}");
        assert!(run.stdout.is_empty() && !out.exists(), "{text}");
    }
}

#[test]
fn a_scene_that_changes_on_disk_is_read_again() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("mine.toml");
    let scene = include_str!("../assets/scenes/two_lights.toml");
    let write = |text: &str, age: u64| {
        std::fs::write(&path, text).expect("writes");
        let file = std::fs::File::options().append(true).open(&path).expect("opens");
        // No two writes have the same time, however coarse the clock of the disk is.
        file.set_modified(SystemTime::now() - Duration::from_secs(age)).expect("sets the time");
    };
    write(scene, 100);
    let name = path.to_string_lossy().into_owned();
    let mut session = Session::of(name.clone());
    session.size = Some([32, 32]);
    session.passes = 1;
    session.render.photons = Some(5000);
    session.panels = vec![Panel::of("regular")];
    let context = egui::Context::default();
    let opened = Opened::new(session).expect("opens");
    let mut workbench = Workbench::new(&context, opened, None).expect("threads");
    assert_eq!(workbench.desk().recent.names(), [name]);
    run_until(&mut workbench, &context, Workbench::is_idle);
    let shown = |w: &Workbench| w.gallery().of_estimator("regular").expect("an image").pixels().to_image();
    let before = shown(&workbench);

    let position = scene.lines().find(|l| l.starts_with("position")).expect("the camera's").to_owned();
    let moved = scene.replacen(&position, "position = [0.5, 3.0, 5.0]", 1);
    assert_ne!(moved, scene);
    write(&moved, 50);
    run_until(&mut workbench, &context, |w| w.messages().all().iter().any(|m| m.text.contains("reloaded")));
    run_until(&mut workbench, &context, Workbench::is_idle);
    let after = shown(&workbench);
    assert_ne!(after, before);

    write("name = [", 10);
    let errors = |w: &Workbench| w.messages().all().iter().filter(|m| m.gravity == Gravity::Error).cloned().collect();
    run_until(&mut workbench, &context, |w| !Vec::is_empty(&errors(w)));
    let start = Instant::now();
    run_until(&mut workbench, &context, |_| start.elapsed() > Duration::from_millis(2200));
    let errors: Vec<cusp::workbench::messages::Message> = errors(&workbench);
    assert_eq!((errors.len(), errors[0].times), (1, 1), "{errors:?}");
    assert!(errors[0].text.contains("mine.toml:1"), "{errors:?}");
    assert_eq!(shown(&workbench), after, "the window goes on with the scene that it has");
}

/// What eframe keeps between two starts.
#[derive(Default)]
struct Memory(BTreeMap<String, String>);

impl eframe::Storage for Memory {
    fn get_string(&self, key: &str) -> Option<String> {
        self.0.get(key).cloned()
    }

    fn set_string(&mut self, key: &str, value: String) {
        self.0.insert(key.to_owned(), value);
    }

    fn remove_string(&mut self, key: &str) {
        self.0.remove(key);
    }

    fn flush(&mut self) {}
}

#[test]
fn what_was_opened_is_remembered() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = session_file(folder.path(), 1.0).to_string_lossy().into_owned();
    let small = Session { size: Some([16, 16]), passes: 1, ..Session::of("plane") };
    let context = egui::Context::default();
    let start = || Workbench::new(&context, Opened::new(small.clone()).expect("opens"), None).expect("threads");
    let mut memory = Memory::default();
    let mut workbench = start();
    workbench.run(Action::OpenFile(file.clone()));
    workbench.run(Action::OpenFile(folder.path().join("nowhere.toml").to_string_lossy().into_owned()));
    run_until(&mut workbench, &context, |w| w.messages().all().iter().any(|m| m.gravity == Gravity::Error));
    workbench.run(Action::OpenFile(file.clone()));
    run_until(&mut workbench, &context, |w| w.session().scene == "ring");
    assert_eq!(workbench.desk().recent.names(), [file.as_str(), "plane"]);
    eframe::App::save(&mut workbench, &mut memory);
    let mut again = start();
    again.recall(&memory);
    assert_eq!(again.desk().recent.names(), ["plane", file.as_str()]);
}
