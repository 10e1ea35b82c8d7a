//! The real-time view: switched to and back, played, stepped, walked through, and what its parameters do.

use super::renderer::check;
use super::window::{Window, click, open, open_at, same_as_fresh, settle, small};
use cusp::export::session::{Rendering, Session};
use cusp::realtime::settings::set;
use cusp::realtime::{Engine, RealtimeSettings};
use egui::accesskit::Role;
use egui::{Key, Modifiers};
use egui_kittest::kittest::Queryable;
use std::time::{Duration, Instant};

/// A session of the real-time view with few photons and triangles.
fn live(scene: &str) -> Session {
    let mut session = Session { rendering: Rendering::Realtime, ..small(scene, 1) };
    for text in ["mesh_refinement=600", "photons_from_light=100", "accumulation_frames=4"] {
        set(&mut session.realtime, text).expect(text);
    }
    session
}

fn frame(window: &mut Window) -> u64 {
    window.state_mut().live().last().expect("a frame").report.frame
}

fn press(window: &mut Window, key: Key) {
    window.key_press(key);
    settle(window);
}

/// Runs frames of the window until `done`.
fn run_until(window: &mut Window, what: &str, mut done: impl FnMut(&mut Window) -> bool) {
    let start = Instant::now();
    while !done(window) {
        window.step();
        std::thread::sleep(Duration::from_millis(2));
        assert!(start.elapsed() < Duration::from_secs(30), "{what}");
    }
}

/// To the real-time view, a walk there, and back: camera and scene stay, and the progressive image is that of a fresh
/// render from where the walk ended.
#[test]
fn switching_keeps_camera_and_scene() {
    let mut session = live("cornell");
    session.rendering = Rendering::Progressive;
    let mut window = open(session);
    same_as_fresh(&window);
    let before = window.state().document().scene().camera;
    window.get_by_role_and_label(Role::Button, "real-time").click();
    window.step();
    settle(&mut window);
    assert!(window.state().is_live());
    let scene = std::sync::Arc::clone(window.state().document().scene());
    assert_eq!(window.state_mut().live().last().expect("a frame").camera, before);
    window.key_down(Key::W);
    run_until(&mut window, "it walks", |w| w.state().document().scene().camera != before);
    window.key_up(Key::W);
    window.step();
    settle(&mut window);
    let walked = window.state().document().scene().camera;
    assert!((walked.position - before.position).dot(before.frame[2]) > 0.0 && walked.frame == before.frame);
    assert!(std::sync::Arc::ptr_eq(&scene.geometry, &window.state().document().scene().geometry));
    assert_eq!(window.state_mut().live().last().expect("a frame").camera, walked);
    press(&mut window, Key::F5);
    assert!(!window.state().is_live() && window.state().document().scene().camera == walked);
    same_as_fresh(&window);
}

/// A walk is one step back, however many frames it took.
#[test]
fn a_walk_is_taken_back_as_a_whole() {
    let mut window = open(live("rooms"));
    let before = window.state().document().scene().camera;
    window.key_down(Key::A);
    window.key_down(Key::ArrowLeft);
    let mut frames = 0;
    run_until(&mut window, "it walks", |_| {
        frames += 1;
        frames > 12
    });
    window.key_up(Key::A);
    window.key_up(Key::ArrowLeft);
    window.step();
    settle(&mut window);
    let walked = window.state().document().scene().camera;
    assert!(walked.position != before.position && walked.frame != before.frame);
    window.key_press_modifiers(Modifiers::COMMAND, Key::Z);
    window.step();
    settle(&mut window);
    assert_eq!(window.state().document().scene().camera, before);
}

/// Steps make one frame each; playing makes them without being asked, until it is paused.
#[test]
fn frames_are_stepped_and_played() {
    let mut window = open(live("rooms"));
    assert!(!window.state_mut().live().is_playing());
    let first = frame(&mut window);
    for n in 1..=3 {
        press(&mut window, Key::Period);
        assert_eq!(frame(&mut window), first + n);
    }
    let last = window.state_mut().live().last().expect("a frame").report;
    assert!((last.time - 0.1).abs() < 1e-9 && last.frames_in_map == 4);
    window.get_by_role_and_label(Role::Button, "play").click();
    run_until(&mut window, "it plays", |w| frame(w) > first + 8);
    press(&mut window, Key::Space);
    let rest = frame(&mut window);
    settle(&mut window);
    assert!(frame(&mut window) == rest && !window.state_mut().live().is_playing());
    press(&mut window, Key::Home);
    let again = window.state_mut().live().last().expect("a frame").report;
    assert_eq!((again.time, again.frames_in_map), (0.0, 1));
}

/// The picture at rest is the engine's own, in as many pixels as the pane has.
#[test]
fn the_picture_is_the_engines() {
    let session = live("rooms");
    let mut window = open(session.clone());
    for _ in 0..3 {
        press(&mut window, Key::Period);
    }
    let (_, scene) = session.open_scene().expect("opens");
    let scene = std::sync::Arc::new(scene);
    let settings = RealtimeSettings::new(&scene, &session.realtime, session.seed).expect("valid");
    let mut engine = Engine::new(&scene, settings);
    (0..4).for_each(|i| engine.step(f64::from(i) / 30.0, &scene.camera));
    let shown = window.state_mut().live().last().expect("a frame");
    let size = shown.image.size;
    assert!(size[0] > 300 && size[1] > 300, "{size:?}");
    assert!(shown.image == engine.draw(&scene.camera, size, 1.0));
}

/// A switch and a slider change the settings and the photons that are foreseen; what cannot be is refused in one line.
#[test]
fn parameters_are_set_by_their_widgets() {
    let mut window = open_at(live("rooms"), [1000.0, 1400.0], 1.0);
    assert!(window.query_by_label("up to 2000 photons in the map").is_some());
    window.get_by_role_and_label(Role::CheckBox, "store_direct_light").click();
    window.step();
    settle(&mut window);
    assert_eq!(window.state().session().realtime.store_direct_light, Some(false));
    assert!(window.query_by_label("up to 1600 photons in the map").is_some());
    window.get_by_role_and_label(Role::Slider, "diffuse_reflections").set_value_accesskit(9.0);
    window.step();
    settle(&mut window);
    assert_eq!(window.state().session().realtime.diffuse_reflections, Some(9));
    assert!(window.query_by_label("up to 3600 photons in the map").is_some());
    window.key_press_modifiers(Modifiers::COMMAND, Key::Z);
    window.step();
    settle(&mut window);
    assert_eq!(window.state().session().realtime.diffuse_reflections, None);
    window.state_mut().session_mut().realtime.recursion_depth = Some(30);
    window.step();
    window.step();
    assert_eq!(window.state().session().realtime.recursion_depth, None);
    assert!(window.state().messages().all().iter().any(|m| m.text.contains("the map would hold")));
}

#[test]
fn sessions_keep_the_view_and_its_parameters() {
    let session = live("rooms");
    let text = session.to_toml(std::path::Path::new("")).expect("a text");
    assert!(text.contains("rendering = \"realtime\"") && text.contains("[realtime]"), "{text}");
    let again = Session::parse(std::path::Path::new("s.toml"), &text).expect("parses");
    assert_eq!(again, session);
    let plain = small("ring", 1).to_toml(std::path::Path::new("")).expect("a text");
    assert!(!plain.contains("realtime") && !plain.contains("rendering"), "{plain}");
}

/// As many frames as are asked for before the first is drawn.
#[test]
fn a_shot_has_as_many_frames_as_asked_for() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("view.png");
    let run = std::process::Command::new(env!("CARGO_BIN_EXE_cusp"))
        .args(["shot", "rooms", "--realtime", "3", "--window", "400x300", "-o"])
        .arg(&file)
        .output()
        .expect("the binary runs");
    assert!(run.status.success() && String::from_utf8_lossy(&run.stdout).contains("rooms after 3 frames"));
    let opened = cusp::workbench::document::Opened::new(live("rooms")).expect("opens");
    let mut shot = cusp::workbench::shot::Shot::new(opened, None, [400, 300], 1.0).expect("threads");
    shot.workbench().live().step(3);
    shot.take(|_| false).expect("a picture");
    assert_eq!(shot.workbench().live().last().expect("a frame").report.frame, 2);
}

/// The flashlight with its cone, and photons by age.
#[test]
fn the_view_with_flashlight_and_photons() {
    let mut session = live("rooms");
    set(&mut session.realtime, "flashlight=true").expect("a key");
    set(&mut session.realtime, "mesh_refinement=3000").expect("a key");
    let mut window = open_at(session, [900.0, 560.0], 1.0);
    window.state_mut().live().show_photons(true);
    for _ in 0..4 {
        press(&mut window, Key::Period);
    }
    let at = window.get_by_label("Real-time picture").rect().center();
    click(&mut window, at);
    window.event(egui::Event::PointerGone);
    settle(&mut window);
    check(&mut window, "realtime");
}
