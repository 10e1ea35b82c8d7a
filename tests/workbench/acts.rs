//! What a user does, by the widgets and keys that a user has.

use super::window::{Window, beside, click, on_screen, open, same_as_fresh, settle, small, type_text};
use cusp::export::session::{Mode, Session};
use cusp::workbench::layout::Pane;
use cusp::workbench::messages::Gravity;
use egui::accesskit::Role;
use egui::{Event, Key, Modifiers, PointerButton};
use egui_kittest::kittest::Queryable;
use std::path::{Path, PathBuf};
use std::sync::Arc;

const CTRL: Modifiers = Modifiers::COMMAND;
const CTRL_SHIFT: Modifiers = Modifiers { shift: true, ..Modifiers::COMMAND };

fn pins(window: &Window) -> &[[u32; 2]] {
    &window.state().session().pins
}

fn press(window: &mut Window, modifiers: Modifiers, key: Key) {
    window.key_press_modifiers(modifiers, key);
    window.step();
}

/// Opens the path dialog by `key`, replaces what it suggests, and enters.
fn enter_path(window: &mut Window, modifiers: Modifiers, key: Key, path: &str) {
    press(window, modifiers, key);
    window.step();
    press(window, CTRL, Key::A);
    type_text(window, path);
    press(window, Modifiers::NONE, Key::Enter);
    settle(window);
}

#[test]
fn a_setting_changes_by_its_widget_and_is_taken_back() {
    let mut window = open(beside(small("ring", 2), Pane::Estimators));
    let before = window.state().session().panels[1].estimator.clone();
    assert!(before.starts_with("multi_sampled:n=8"), "{before}");
    window.get_by_role_and_label(Role::Slider, "N").set_value_accesskit(3.0);
    settle(&mut window);
    let after = window.state().session().panels[1].estimator.clone();
    assert!(after.starts_with("multi_sampled:n=3"), "{after}");
    same_as_fresh(&window);
    press(&mut window, CTRL, Key::Z);
    settle(&mut window);
    assert_eq!(window.state().session().panels[1].estimator, before);
    same_as_fresh(&window);
    press(&mut window, CTRL_SHIFT, Key::Z);
    settle(&mut window);
    assert_eq!(window.state().session().panels[1].estimator, after);
    same_as_fresh(&window);
}

#[test]
fn a_photon_setting_changes_by_its_widget() {
    let mut window = open(beside(small("ring", 1), Pane::Photons));
    window.get_by_role_and_label(Role::Slider, "Photons").set_value_accesskit(2500.0);
    settle(&mut window);
    assert_eq!(window.state().document().settings().photons, 2500);
    window.get_by_role_and_label(Role::ComboBox, "Light").click();
    window.step();
    window.step();
    window.get_by_label("caustic").click();
    settle(&mut window);
    assert_eq!(window.state().session().render.light.as_deref(), Some("caustic"));
    same_as_fresh(&window);
}

#[test]
fn a_click_pins_and_arrows_nudge() {
    let mut window = open(small("ring", 1));
    let at = on_screen(&window, 0, [40, 50]);
    click(&mut window, at);
    settle(&mut window);
    assert_eq!(pins(&window), [[40, 50]]);
    press(&mut window, Modifiers::NONE, Key::ArrowRight);
    press(&mut window, Modifiers::SHIFT, Key::ArrowUp);
    settle(&mut window);
    assert_eq!(pins(&window), [[41, 40]]);
    let found = window.state().desk().inspector.found.as_ref().expect("inspected");
    assert_eq!(found.inspection.pixel, [41, 40]);
    // Escape lets go of it.
    press(&mut window, Modifiers::NONE, Key::Escape);
    settle(&mut window);
    assert!(pins(&window).is_empty() && window.state().desk().inspector.found.is_none());
}

#[test]
fn ctrl_g_goes_to_a_pixel() {
    let mut window = open(small("ring", 1));
    press(&mut window, CTRL, Key::G);
    window.step();
    // Outside: nothing happens, and the dialog stays.
    type_text(&mut window, "200, 3");
    press(&mut window, Modifiers::NONE, Key::Enter);
    settle(&mut window);
    assert!(pins(&window).is_empty() && window.state().desk().dialogs.is_open());
    press(&mut window, Modifiers::NONE, Key::Escape);
    settle(&mut window);
    assert!(!window.state().desk().dialogs.is_open());
    press(&mut window, CTRL, Key::G);
    window.step();
    type_text(&mut window, "20, 3");
    press(&mut window, Modifiers::NONE, Key::Enter);
    settle(&mut window);
    assert_eq!(pins(&window), [[20, 3]]);
    assert!(!window.state().desk().dialogs.is_open());
}

#[test]
fn the_scene_is_switched_and_taken_back() {
    let mut window = open(small("ring", 1));
    window.get_by_role_and_label(Role::ComboBox, "Scene").click();
    window.step();
    window.step();
    window.get_by_label("plane").click();
    let start = std::time::Instant::now();
    while window.state().session().scene != "plane" {
        window.step();
        assert!(start.elapsed().as_secs() < 30, "the scene does not come");
    }
    assert_eq!(window.state().document().scene().name, "plane");
    press(&mut window, CTRL, Key::Z);
    settle(&mut window);
    assert_eq!(window.state().session().scene, "ring");
    assert_eq!(window.state().document().scene().name, "ring");
    same_as_fresh(&window);
}

#[test]
fn a_missing_file_is_one_error_that_is_dismissed() {
    let mut window = open(beside(small("ring", 1), Pane::Messages));
    for times in 1..=2 {
        enter_path(&mut window, CTRL, Key::O, "no/such/file.toml");
        let messages = window.state().messages().all();
        let errors: Vec<_> = messages.iter().filter(|m| m.gravity == Gravity::Error).collect();
        assert_eq!(errors.len(), 1, "{messages:?}");
        assert_eq!(errors[0].times, times);
        assert!(errors[0].text.contains("no/such/file.toml") && !errors[0].text.contains('\n'), "{}", errors[0].text);
    }
    assert_eq!(window.state().session().scene, "ring");
    same_as_fresh(&window);
    window.get_by_label("Dismiss message 1").click();
    settle(&mut window);
    assert!(window.state().messages().all().is_empty());
    // An image and a session that are not there, and a file that is no image.
    let folder = tempfile::tempdir().expect("a folder");
    let text = folder.path().join("text.exr");
    std::fs::write(&text, "no image").expect("writes");
    for path in ["no/such/image.exr", text.to_str().expect("plain"), "no/such/model.obj"] {
        enter_path(&mut window, CTRL, Key::O, path);
    }
    let messages = window.state().messages().all();
    assert_eq!(messages.iter().filter(|m| m.gravity == Gravity::Error).count(), 3, "{messages:?}");
    assert_eq!(window.state().session().panels.len(), 1, "what can't be read is no panel");
    window.get_by_label("Dismiss all").click();
    settle(&mut window);
    assert!(window.state().messages().all().is_empty());
}

/// A file on the disk that is dropped onto the window.
#[derive(Debug)]
struct Dropped(PathBuf);

impl egui::DroppedFile for Dropped {
    fn path(&self) -> &Path {
        &self.0
    }

    fn bytes(&self) -> Result<Vec<u8>, String> {
        std::fs::read(&self.0).map_err(|e| e.to_string())
    }
}

#[test]
fn dropped_files_are_opened() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("dropped.toml");
    let mut dropped = small("glass_sphere", 3);
    dropped.pins = vec![[7, 9]];
    dropped.comparison.mode = Mode::Split;
    std::fs::write(&path, dropped.to_toml(folder.path()).expect("a text")).expect("writes");
    let mut window = open(small("ring", 1));
    window.input_mut().dropped_files.push(Arc::new(Dropped(path.clone())));
    settle(&mut window);
    assert_eq!(window.state().session(), &dropped);
    assert_eq!(window.state().document().path(), Some(path.as_path()));
    same_as_fresh(&window);
    // A picture becomes a panel.
    let picture = folder.path().join("picture.png");
    image::RgbImage::from_pixel(96, 96, image::Rgb([200, 10, 10])).save(&picture).expect("writes");
    window.input_mut().dropped_files.push(Arc::new(Dropped(picture)));
    settle(&mut window);
    let session = window.state().session();
    assert_eq!(session.panels.len(), 4);
    let image = window.state().gallery().of(&session.panels[3]).expect("read");
    assert!(image.is_fresh() && image.size() == [96, 96]);
}

#[test]
fn a_session_is_saved_and_reopened() {
    let folder = tempfile::tempdir().expect("a folder");
    let picture = folder.path().join("picture.png");
    image::RgbImage::from_pixel(96, 96, image::Rgb([200, 10, 10])).save(&picture).expect("writes");
    let mut session = small("ring", 2);
    session.panels.push(cusp::export::session::Panel {
        image: Some(picture.to_string_lossy().into()),
        ..session.panels[0].clone()
    });
    session.panels[2].estimator.clear();
    session.overlays = vec!["tiles".into()];
    session.tone.auto = false;
    session.tone.exposure = 1.5;
    let mut window = open(session);
    let at = on_screen(&window, 0, [30, 31]);
    click(&mut window, at);
    let path = folder.path().join("saved.toml");
    enter_path(&mut window, CTRL_SHIFT, Key::S, path.to_str().expect("plain"));
    assert!(!window.state().document().is_changed());
    let mut reopened = open(Session::open(&path).expect("opens"));
    assert_eq!(reopened.state().session(), window.state().session());
    assert_eq!(pins(&reopened), [[30, 31]]);
    same_as_fresh(&reopened);
    // The image of a file comes with it.
    let panel = &reopened.state().session().panels[2];
    assert!(reopened.state().gallery().of(panel).is_some_and(|i| i.is_fresh()));
    // Saved again, by its own window, it is the same file.
    let text = std::fs::read_to_string(&path).expect("reads");
    enter_path(&mut reopened, CTRL_SHIFT, Key::S, path.to_str().expect("plain"));
    assert_eq!(std::fs::read_to_string(&path).expect("reads"), text);
}

#[test]
fn panels_go_and_come() {
    let mut window = open(beside(small("ring", 2), Pane::Estimators));
    let second = window.state().session().panels[1].clone();
    window.get_by_label("Remove panel 1").click();
    settle(&mut window);
    assert_eq!(window.state().session().panels, [second]);
    window.get_by_label("Add a panel").click();
    window.step();
    window.step();
    window.get_by_label("density").click();
    settle(&mut window);
    let panels = &window.state().session().panels;
    assert_eq!(panels.len(), 2);
    assert!(panels[1].estimator.starts_with("density"));
    same_as_fresh(&window);
    // The last panel may go too.
    for _ in 0..2 {
        window.get_by_label("Remove panel 1").click();
        settle(&mut window);
    }
    assert!(window.state().session().panels.is_empty());
    press(&mut window, CTRL, Key::Z);
    settle(&mut window);
    assert_eq!(window.state().session().panels.len(), 1);
    same_as_fresh(&window);
}

#[test]
fn overlays_and_modes_have_keys() {
    let mut window = open(small("ring", 1));
    press(&mut window, Modifiers::NONE, Key::T);
    assert_eq!(window.state().session().overlays, ["tiles"]);
    press(&mut window, Modifiers::NONE, Key::V);
    press(&mut window, Modifiers::NONE, Key::T);
    assert_eq!(window.state().session().overlays, ["footprint"]);
    press(&mut window, Modifiers::NONE, Key::D);
    assert_eq!(window.state().session().comparison.mode, Mode::Difference);
    let kind = window.state().session().comparison.difference;
    press(&mut window, Modifiers::SHIFT, Key::D);
    assert_ne!(window.state().session().comparison.difference, kind);
    assert_eq!(window.state().session().comparison.mode, Mode::Difference);
    window.key_down(Key::B);
    window.step();
    assert!(window.state().desk().flipped);
    window.key_up(Key::B);
    window.step();
    assert!(!window.state().desk().flipped);
}

#[test]
fn the_palette_searches_and_does() {
    let mut window = open(small("ring", 1));
    press(&mut window, CTRL, Key::P);
    window.step();
    // Every letter of this is a shortcut too; none may act while it is typed.
    let before = window.state().session().clone();
    type_text(&mut window, "ONE to one");
    assert_eq!(window.state().session(), &before);
    press(&mut window, Modifiers::NONE, Key::Enter);
    settle(&mut window);
    assert_eq!(window.state().session().view.zoom, 1.0);
    assert!(!window.state().desk().dialogs.is_open());
}

#[test]
fn a_crop_is_dragged() {
    let mut window = open(small("ring", 1));
    press(&mut window, Modifiers::NONE, Key::C);
    let (from, to) = (on_screen(&window, 0, [10, 20]), on_screen(&window, 0, [29, 24]));
    let button = |pos, pressed| Event::PointerButton {
        pos,
        button: PointerButton::Primary,
        pressed,
        modifiers: Modifiers::NONE,
    };
    window.hover_at(from);
    window.event(button(from, true));
    window.hover_at(from.lerp(to, 0.5));
    window.hover_at(to);
    window.event(button(to, false));
    settle(&mut window);
    assert_eq!(window.state().session().crop, Some([10, 20, 20, 5]));
    assert!(pins(&window).is_empty());
    press(&mut window, CTRL, Key::Z);
    settle(&mut window);
    assert_eq!(window.state().session().crop, None);
}

#[test]
fn exposure_restarts_nothing() {
    let mut window = open(small("ring", 1));
    let generation = window.state().render().next_generation();
    press(&mut window, Modifiers::NONE, Key::E);
    press(&mut window, Modifiers::NONE, Key::M);
    press(&mut window, Modifiers::NONE, Key::F);
    settle(&mut window);
    assert_eq!(window.state().render().next_generation(), generation);
    window.get_by_label("pause").click();
    window.step();
    window.step();
    assert!(window.state().render().is_paused());
}
