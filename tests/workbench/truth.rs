//! What the window shows is what was rendered and stored.

use super::window::{fresh, images_only, lit, open, same_as_fresh, same_bits, settle, small, viewport};
use cusp::export::session::{Difference, Mode};
use cusp::math::rgb::mean;
use cusp::measure::image_file;
use cusp::workbench::actions::Action;
use egui::epaint::{ClippedShape, PathShape};
use egui::{Color32, Pos2, Shape};
use egui_kittest::kittest::{NodeT, Queryable};
use std::process::Command;

#[test]
fn images_are_those_of_a_fresh_render() {
    let mut session = small("ring", 4);
    session.passes = 3;
    let window = open(session);
    assert_eq!(window.state().render().progress.as_ref().expect("done").passes, [3; 4]);
    same_as_fresh(&window);
}

#[test]
fn a_draft_leaves_nothing_behind() {
    let mut session = small("ring", 2);
    // More than those of a draft.
    session.render.photons = Some(25_000);
    let window = open(session);
    assert!(!window.state().render().draft);
    same_as_fresh(&window);
}

#[test]
fn the_inspectors_sums_are_the_pixel() {
    let mut window = open(small("ring", 4));
    let renderer = fresh(window.state().session());
    let lit = lit(window.state().session());
    for pixel in [lit, [48, 60], [0, 0], [95, 95]] {
        window.state_mut().run(Action::Pin(pixel));
        settle(&mut window);
        let found = window.state().desk().inspector.found.clone().expect("inspected");
        assert_eq!(found.inspection.pixel, pixel);
        for (e, (estimator, film)) in found.inspection.estimators.iter().zip(renderer.films()).enumerate() {
            let of_pass = film.image().at(pixel[0], pixel[1]).to_array().map(f32::to_bits);
            assert_eq!(estimator.value.to_array().map(f32::to_bits), of_pass, "{} at {pixel:?}", estimator.name);
            let live = window.state().gallery().of_estimator(&estimator.name).expect("has a panel").at(pixel);
            assert_eq!(live.expect("rendered").to_array().map(f32::to_bits), of_pass);
            let rows = &found.inspection.rows;
            assert!(pixel != lit || rows.len() > 1);
            let sum: f64 = rows.iter().map(|r| f64::from(mean(r.contributions[e]))).sum();
            let whole = f64::from(mean(estimator.base)) + sum;
            let value = f64::from(mean(estimator.value));
            assert!((whole - value).abs() <= value * 2f64.powi(-20), "{}: {whole} {value}", estimator.name);
        }
    }
}

fn paths(shape: &Shape, all: &mut Vec<PathShape>) {
    match shape {
        Shape::Path(path) => all.push(path.clone()),
        Shape::Vec(shapes) => shapes.iter().for_each(|s| paths(s, all)),
        _ => {}
    }
}

fn drawn(shapes: &[ClippedShape]) -> Vec<PathShape> {
    let mut all = Vec::new();
    shapes.iter().for_each(|s| paths(&s.shape, &mut all));
    all
}

/// The ellipse of the row that was clicked lies on every image where the photon of a fresh render projects to.
#[test]
fn an_ellipse_is_the_photons_footprint() {
    let mut window = super::window::open_at(small("ring", 1), [1200.0, 800.0], 1.0);
    let pixel = lit(window.state().session());
    window.state_mut().run(Action::Pin(pixel));
    settle(&mut window);
    let rows = |window: &super::window::Window| -> Vec<String> {
        let all = window.query_all_by_label_contains("photon ");
        all.filter_map(|n| n.accesskit_node().label()).filter(|l| l.starts_with("photon ")).collect()
    };
    let label = rows(&window).into_iter().next().expect("a row is seen");
    window.get_by_label(&label).click();
    settle(&mut window);
    window.remove_cursor();
    settle(&mut window);
    let inspector = &window.state().desk().inspector;
    let found = inspector.found.as_ref().expect("inspected");
    let row = &found.inspection.rows[inspector.chosen.expect("clicked")];
    let renderer = fresh(window.state().session());
    let pass = renderer.last_pass().expect("one pass");
    let photon = &pass.maps.of(row.kind).expect("stored").photons()[row.index as usize];
    assert_eq!((photon.position, photon.axes()), (row.position, row.footprint));
    assert!(label.ends_with(&format!(" {}", row.index)), "{label}");
    let (view, camera) = (viewport(&window, 0), pass.scene.camera);
    let [a, b] = photon.axes();
    let expected = |n: usize| -> Vec<Pos2> {
        let corner = |i: usize| {
            let angle = i as f32 * std::f32::consts::TAU / n as f32;
            let place = photon.position + a * libm::cosf(angle) + b * libm::sinf(angle);
            let [x, y] = camera.project(place, pass.settings.size).expect("before the camera");
            view.to_screen(x, y)
        };
        (0..n).map(corner).collect()
    };
    let is_it = |path: &PathShape| {
        path.closed
            && path.points.len() >= 12
            && expected(path.points.len()).iter().zip(&path.points).all(|(e, p)| (*e - *p).length() < 0.01)
    };
    let bright: Vec<_> = drawn(&window.output().shapes).into_iter().filter(is_it).collect();
    assert!(
        bright.iter().any(|p| p.stroke.color == egui::epaint::ColorMode::Solid(Color32::WHITE)),
        "{}",
        bright.len()
    );
}

fn render(estimator: &str, file: &std::path::Path) {
    let args = ["render", "ring", "--photons", "4000", "--size", "96x96", "--quiet", "--estimator", estimator, "-o"];
    let out = Command::new(env!("CARGO_BIN_EXE_cusp")).args(args).arg(file).output().expect("runs");
    assert!(out.status.success(), "{}", String::from_utf8_lossy(&out.stderr));
}

/// Panels in every kind of difference hold the difference of the EXR files that the command line writes.
#[test]
fn differences_are_those_of_the_files() {
    let folder = tempfile::tempdir().expect("a folder");
    let mut session = images_only(small("ring", 2));
    session.comparison.mode = Mode::Difference;
    session.comparison.with = Some(1);
    session.tone.auto = false;
    session.tone.exposure = -1.25;
    let mut images = Vec::new();
    for (i, panel) in session.panels.iter().enumerate() {
        let file = folder.path().join(format!("{i}.exr"));
        render(&panel.estimator, &file);
        images.push(image_file::read(&file).expect("reads"));
    }
    let mut window = open(session);
    for (i, image) in images.iter().enumerate() {
        let panel = &window.state().session().panels[i];
        same_bits(&window.state().gallery().of(panel).expect("rendered").pixels().to_image(), image, &panel.estimator);
    }
    for kind in [Difference::Signed, Difference::Absolute, Difference::Relative, Difference::Flip] {
        window.state_mut().session_mut().comparison.difference = kind;
        settle(&mut window);
        let gallery = window.state().gallery();
        assert!(!gallery.values.contains_key(&1), "the other side shows itself");
        let values = &gallery.values.get(&0).expect("it shows a difference").values;
        let expected = cusp::measure::difference::difference(kind, &images[0], &images[1], -1.25).expect("same size");
        assert!(expected.iter().any(|x| *x != 0.0), "{kind:?}");
        assert_eq!(values.len(), expected.len());
        let same = values.iter().zip(&expected).all(|(a, b)| a.to_bits() == b.to_bits());
        assert!(same, "{kind:?}");
    }
    // Back in the grid nothing of it is left.
    window.state_mut().run(Action::Grid);
    settle(&mut window);
    assert!(window.state().gallery().values.is_empty());
}

/// A stored reference shows the scene as it is built in: of an edited one there is no error, and undo brings it back.
#[test]
fn an_edited_scene_has_no_stored_reference() {
    let mut session = small("ring", 2);
    session.comparison.mode = Mode::Difference;
    let mut window = open(session);
    assert!(window.state().desk().reference.is_some() && window.state().gallery().values.len() == 2);
    let mut camera = window.state().document().scene_file().camera.expect("has one");
    camera.position[0] += 0.5;
    window.state_mut().session_mut().camera = Some(camera);
    settle(&mut window);
    assert!(window.state().desk().reference.is_none() && window.state().desk().errors.is_empty());
    assert!(window.state().gallery().values.is_empty(), "no difference to an image of another view");
    window.state_mut().run(Action::Undo);
    settle(&mut window);
    assert!(window.state().desk().reference.is_some() && window.state().gallery().values.len() == 2);
}
