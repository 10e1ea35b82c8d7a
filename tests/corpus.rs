//! Replays what the fuzz targets have found, file by file.

#![allow(clippy::expect_used, clippy::panic, missing_docs, reason = "a failed expectation is how this program reports")]

#[path = "corpus/targets.rs"]
mod targets;

use std::path::Path;

fn replay(folder: &str, target: fn(&[u8]) -> Result<(), String>) {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/corpus").join(folder);
    for entry in std::fs::read_dir(&folder).expect("a folder of inputs") {
        let path = entry.expect("an entry").path();
        let input = std::fs::read(&path).expect("reads");
        if std::panic::catch_unwind(|| target(&input)).is_err() {
            panic!("{} breaks what must hold; the reason is above", path.display());
        }
    }
}

#[test]
fn scenes() {
    replay("scene", targets::scene);
}

#[test]
fn meshes() {
    replay("obj", targets::obj);
}

#[test]
fn maps() {
    replay("map", targets::map);
}

#[test]
fn sessions() {
    replay("session", targets::session);
}

/// Inputs that once broke what must hold, with what they are refused for now.
#[test]
fn findings_are_refused() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/corpus");
    type Target = fn(&[u8]) -> Result<(), String>;
    let cases: [(&str, Target, &str); 3] = [
        (
            "scene/crash-choice-with-a-line-end.toml",
            targets::scene,
            "render.gather: must be one of knn, overlap, got `k\\n`",
        ),
        (
            "obj/crash-vertex-divided-by-a-tiny-w.obj",
            targets::obj,
            "mesh.obj:8: OBJ: divided by w = 5e-324, `v` must be",
        ),
        (
            "session/crash-light-that-is-no-number.toml",
            targets::session,
            "lights[0].radius: must be positive and finite",
        ),
    ];
    for (file, target, why) in cases {
        let input = std::fs::read(folder.join(file)).expect("reads");
        let error = target(&input).expect_err(file);
        assert!(error.contains(why), "{file}: {error}");
    }
}
