//! Where a scene comes from: a built-in name, a TOML file or an OBJ file.

use crate::math::hash::{FNV_START, fnv1a};
use crate::scene::built_in::{self, BuiltIn};
use crate::scene::load;
use crate::scene::{Scene, SceneError};
use std::path::{Path, PathBuf};

/// The files that a scene may name: those beside it, or those of the binary.
pub enum Files {
    /// Relative to a folder.
    Folder(PathBuf),
    /// Those that a built-in scene carries.
    BuiltIn(&'static [(&'static str, &'static str)]),
}

impl Files {
    /// Text of the file `name`, and the path by which errors call it.
    ///
    /// # Errors
    /// If it is not there, or is no text.
    pub fn read(&self, name: &str) -> Result<(PathBuf, String), SceneError> {
        match self {
            Self::Folder(folder) => {
                let path = folder.join(name);
                read_text(&path).map(|text| (path, text))
            }
            Self::BuiltIn(files) => files
                .iter()
                .find(|(n, _)| *n == name)
                .map(|(n, text)| (PathBuf::from(n), (*text).to_owned()))
                .ok_or_else(|| SceneError::Unreadable {
                    file: name.into(),
                    why: "not among the built-in files".into(),
                }),
        }
    }

    /// Path of the file `name`, if it is one on disk.
    pub fn path(&self, name: &str) -> Option<PathBuf> {
        match self {
            Self::Folder(folder) => Some(folder.join(name)),
            Self::BuiltIn(_) => None,
        }
    }
}

fn read_text(path: &Path) -> Result<String, SceneError> {
    std::fs::read_to_string(path).map_err(|e| SceneError::Unreadable {
        file: path.to_owned(),
        why: match e.kind() {
            std::io::ErrorKind::NotFound => "no such file".into(),
            std::io::ErrorKind::InvalidData => "not text in UTF-8".into(),
            _ => e.to_string(),
        },
    })
}

/// Opens a scene by its name on the command line.
///
/// # Errors
/// An unknown name, an unreadable file, or anything wrong in it.
pub fn open(name: &str) -> Result<Scene, SceneError> {
    if let Some(b) = built_in::find(name) {
        return open_built_in(b);
    }
    let path = Path::new(name);
    let extension = path.extension().and_then(|e| e.to_str()).unwrap_or("");
    match extension.to_ascii_lowercase().as_str() {
        "toml" => {
            let text = read_text(path)?;
            let folder = path.parent().unwrap_or(Path::new("")).to_owned();
            load::scene_from_toml(path, &text, &Files::Folder(folder))
        }
        "obj" => {
            let text = read_text(path)?;
            load::scene_from_obj(path, &text)
        }
        "bsp" | "pk3" => Err(SceneError::Whole {
            file: path.to_owned(),
            what: "Quake 3 maps cannot be read yet; convert it to OBJ".into(),
        }),
        _ => Err(SceneError::Unknown { name: name.to_owned(), known: built_in::names() }),
    }
}

/// Opens a scene of the binary.
///
/// # Errors
/// None but a defect of the binary.
pub fn open_built_in(b: &BuiltIn) -> Result<Scene, SceneError> {
    let file = PathBuf::from(format!("{}.toml", b.name));
    load::scene_from_toml(&file, b.text, &Files::BuiltIn(b.files))
}

/// Hash of texts in their order.
pub fn hash_of(texts: &[&str]) -> u64 {
    texts.iter().fold(FNV_START, |h, t| fnv1a(fnv1a(h, t.as_bytes()), &[0]))
}
