//! What cannot be had is a message: the window goes on, and nothing is lost.

use super::window::{Window, open, settle, small};
use cusp::workbench::actions::Action;
use cusp::workbench::messages::Gravity;
use std::path::Path;

/// The errors that the window shows.
fn errors(window: &Window) -> Vec<String> {
    let all = window.state().messages().all();
    all.iter().filter(|m| m.gravity == Gravity::Error).map(|m| m.text.clone()).collect()
}

fn told(window: &Window, parts: &[&str]) {
    let errors = errors(window);
    assert!(errors.iter().any(|e| parts.iter().all(|p| e.contains(p)) && !e.contains('\n')), "{parts:?}: {errors:?}");
}

/// More photons than there is memory: the images stay, and the next change is rendered.
#[test]
fn photons_that_cannot_be_had_are_a_message() {
    let mut window = open(small("cornell", 1));
    let session = window.state_mut().session_mut();
    session.render.photons = Some(1 << 31);
    settle(&mut window);
    told(&window, &["2147483648 photons a pass", "would need", "--photons"]);
    assert!(window.state().render().is_alive());
    assert_eq!(window.state().session().render.photons, Some(1 << 31), "the edit is there to be lowered");
    window.state_mut().session_mut().render.photons = Some(3000);
    settle(&mut window);
    assert_eq!(window.state().render().progress.as_ref().map(|p| p.emitted), Some(3000));
}

/// A size or a scene that cannot be had leaves the session as it was.
#[test]
fn edits_that_cannot_be_had_are_taken_back() {
    let mut window = open(small("ring", 1));
    let before = window.state().session().clone();
    window.state_mut().session_mut().size = Some([1_000_000, 1_000_000]);
    settle(&mut window);
    told(&window, &["1000000x1000000 pixels"]);
    assert_eq!(window.state().session().size, before.size);
    let mut lights = window.state().document().scene_file().lights;
    lights[0].power = Some([1e39; 3]);
    window.state_mut().session_mut().lights = Some(lights);
    settle(&mut window);
    told(&window, &["lights[0].power", "1e30 at most"]);
    assert_eq!(window.state().session().lights, before.lights);
}

/// A session or an export that cannot be written is a message, and the session counts as unsaved.
#[test]
fn files_that_cannot_be_written_are_a_message() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("file");
    std::fs::write(&file, "old").expect("writes");
    let mut window = open(small("ring", 1));
    window.state_mut().session_mut().seed = 9;
    settle(&mut window);
    window.state_mut().run(Action::SaveSessionTo(file.join("s.toml").to_string_lossy().into_owned()));
    settle(&mut window);
    told(&window, &["file/s.toml: cannot be written: "]);
    assert!(window.state().document().is_changed() && window.state().document().path().is_none());
    window.state_mut().run(Action::ExportTo(file.to_string_lossy().into_owned()));
    settle(&mut window);
    told(&window, &["file/", "cannot be written: "]);
    assert_eq!(std::fs::read_to_string(&file).expect("reads"), "old");
    if Path::new("/dev/full").exists() {
        window.state_mut().run(Action::SaveSessionTo("/dev/full".into()));
        settle(&mut window);
        told(&window, &["/dev/full: cannot be written: No space left"]);
        assert!(window.state().document().is_changed());
    }
}
