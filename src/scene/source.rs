//! Where a scene comes from: a built-in name, a TOML file, an OBJ file or a Quake 3 map.

use crate::math::hash::{FNV_START, fnv1a};
use crate::scene::built_in::{self, BuiltIn};
use crate::scene::load;
use crate::scene::memory;
use crate::scene::quake;
use crate::scene::scene_file::SceneFile;
use crate::scene::{Scene, SceneError};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// The files that a scene may name: those beside it, those of the binary, or those that a caller holds in memory.
pub enum Files {
    /// Relative to a folder.
    Folder(PathBuf),
    /// Those that a built-in scene carries.
    BuiltIn(&'static [(&'static str, &'static str)]),
    /// By name; nothing is read from a disk.
    Memory(BTreeMap<String, Vec<u8>>),
}

impl Files {
    /// Text of the file `name`, and the path by which errors call it.
    ///
    /// # Errors
    /// If it is not there, is no plain file, or is no text.
    pub fn read(&self, name: &str) -> Result<(PathBuf, String), SceneError> {
        let (file, bytes) = self.bytes(name)?;
        match String::from_utf8(bytes) {
            Ok(text) => Ok((file, text)),
            Err(_) => Err(SceneError::Unreadable { file, why: NOT_TEXT.into() }),
        }
    }

    /// Bytes of the file `name`, and the path by which errors call it.
    ///
    /// # Errors
    /// If it is not there, or is no plain file.
    pub fn bytes(&self, name: &str) -> Result<(PathBuf, Vec<u8>), SceneError> {
        let missing = |why: &str| SceneError::Unreadable { file: name.into(), why: why.into() };
        match self {
            Self::Folder(folder) => {
                let path = folder.join(name);
                read_bytes(&path).map(|bytes| (path, bytes))
            }
            Self::BuiltIn(files) => files
                .iter()
                .find(|(n, _)| *n == name)
                .map(|(n, text)| (PathBuf::from(n), text.as_bytes().to_vec()))
                .ok_or_else(|| missing("not among the built-in files")),
            Self::Memory(files) => {
                files.get(name).map(|bytes| (PathBuf::from(name), bytes.clone())).ok_or_else(|| missing("no such file"))
            }
        }
    }
}

const NOT_TEXT: &str = "not text in UTF-8";

/// Bytes of a plain file: a device or a pipe may never end.
fn read_bytes(path: &Path) -> Result<Vec<u8>, SceneError> {
    let wrong = |why: String| SceneError::Unreadable { file: path.to_owned(), why };
    let read = || {
        let about = std::fs::metadata(path)?;
        if !about.is_file() {
            return Ok(Err(wrong("no plain file".into())));
        }
        match memory::check(format!("its {} bytes", about.len()), about.len(), "give a smaller file") {
            Ok(()) => std::fs::read(path).map(Ok),
            Err(short) => Ok(Err(wrong(short.to_string()))),
        }
    };
    read().unwrap_or_else(|e: std::io::Error| {
        Err(wrong(match e.kind() {
            std::io::ErrorKind::NotFound => "no such file".into(),
            _ => e.to_string(),
        }))
    })
}

fn read_text(path: &Path) -> Result<String, SceneError> {
    String::from_utf8(read_bytes(path)?)
        .map_err(|_| SceneError::Unreadable { file: path.to_owned(), why: NOT_TEXT.into() })
}

/// An opened scene: as it is written, which can be edited, and as it was loaded.
pub struct Source {
    /// What the user called it: a built-in name or a path.
    pub name: String,
    /// As it is written; for an OBJ, the scene file that frames and lights it.
    pub file: SceneFile,
    /// As it was loaded.
    pub scene: Arc<Scene>,
    path: PathBuf,
    text: String,
    files: Files,
}

impl Source {
    /// Opens a scene by its name on the command line.
    ///
    /// # Errors
    /// An unknown name, an unreadable file, or anything wrong in it.
    pub fn open(name: &str) -> Result<Self, SceneError> {
        let from_toml = |path: PathBuf, text: String, files: Files| {
            let file = load::parse(&path, &text)?;
            let scene = Arc::new(load::scene_from_file(&path, &text, &file, &files)?);
            Ok(Self { name: name.to_owned(), file, scene, path, text, files })
        };
        if let Some(b) = built_in::find(name) {
            return from_toml(format!("{}.toml", b.name).into(), b.text.to_owned(), Files::BuiltIn(b.files));
        }
        let path = Path::new(name);
        let folder = || Files::Folder(path.parent().unwrap_or(Path::new("")).to_owned());
        let extension = path.extension().and_then(|e| e.to_str()).unwrap_or("");
        match extension.to_ascii_lowercase().as_str() {
            "toml" => from_toml(path.to_owned(), read_text(path)?, folder()),
            "obj" => {
                let text = read_text(path)?;
                let (file, scene) = load::scene_from_obj(path, &text, &folder())?;
                let (path, text, scene) = (path.to_owned(), String::new(), Arc::new(scene));
                Ok(Self { name: name.to_owned(), file, scene, path, text, files: folder() })
            }
            _ if quake::is_map(name) => {
                // `archive.pk3:maps/name.bsp` is in the archive's folder.
                let (file, map) = quake::split_name(name);
                let path = Path::new(file);
                let files = Files::Folder(path.parent().unwrap_or(Path::new("")).to_owned());
                let (file, scene) = load::scene_from_map(path, map, &files)?;
                let (path, text, scene) = (path.to_owned(), String::new(), Arc::new(scene));
                Ok(Self { name: name.to_owned(), file, scene, path, text, files })
            }
            _ => Err(SceneError::Unknown { name: name.to_owned(), known: built_in::names() }),
        }
    }

    /// The scene of an edited file. Where its surfaces are those of `before`, they are the same value in memory.
    ///
    /// # Errors
    /// Anything wrong in it; lines are those of the file as it was opened.
    pub fn edited(&self, file: &SceneFile, before: &Scene) -> Result<Scene, SceneError> {
        let mut scene = load::scene_from_file(&self.path, &self.text, file, &self.files)?;
        scene.hash = self.hash_of_edited(file);
        if let Some(same) = [&before.geometry, &self.scene.geometry].into_iter().find(|g| ***g == *scene.geometry) {
            scene.geometry = Arc::clone(same);
        }
        Ok(scene)
    }

    /// The scene `before` with the camera of an edited file, which differs in nothing else.
    ///
    /// # Errors
    /// Anything wrong in the camera.
    pub fn with_camera(&self, file: &SceneFile, before: &Scene) -> Result<Scene, SceneError> {
        let camera = load::camera_from_file(&self.path, &self.text, file, &self.files, before.origin)?;
        Ok(Scene { camera, hash: self.hash_of_edited(file), ..before.clone() })
    }

    /// Hash of the files as they were opened, and of the edits.
    fn hash_of_edited(&self, file: &SceneFile) -> u64 {
        if *file == self.file {
            return self.scene.hash;
        }
        let text = toml::to_string(file).unwrap_or_default();
        hash_of(&[&format!("{:016x}", self.scene.hash), &text])
    }

    /// Its file on disk, if it is one.
    pub fn path(&self) -> Option<&Path> {
        matches!(self.files, Files::Folder(_)).then_some(self.path.as_path())
    }
}

/// Opens a scene by its name on the command line.
///
/// # Errors
/// An unknown name, an unreadable file, or anything wrong in it.
pub fn open(name: &str) -> Result<Scene, SceneError> {
    Source::open(name).map(|source| Arc::unwrap_or_clone(source.scene))
}

/// Opens a scene of the binary.
///
/// # Errors
/// None but a defect of the binary.
pub fn open_built_in(b: &BuiltIn) -> Result<Scene, SceneError> {
    open(b.name)
}

/// Hash of texts in their order.
pub fn hash_of(texts: &[&str]) -> u64 {
    texts.iter().fold(FNV_START, |h, t| fnv1a(fnv1a(h, t.as_bytes()), &[0]))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every built-in scene written out again loads as the same scene.
    #[test]
    fn scene_files_come_back_as_they_were_written() {
        for b in built_in::BUILT_IN {
            let source = Source::open(b.name).expect("built in");
            let text = toml::to_string(&source.file).expect("a text");
            let again = load::parse(Path::new("again.toml"), &text).expect(&text);
            assert_eq!(again, source.file, "{}", b.name);
        }
    }

    /// Thousands of copies of a triangle count as one: the first, which rays meet. A pair is left as it is.
    #[test]
    fn copies_of_a_triangle_are_left_out() {
        let open = |copies: usize| {
            let faces = "f 1 2 3\n".repeat(copies);
            let text = format!("v -1 0 -1\nv 1 0 -1\nv 0 0 1\nv 5 0 0\n{faces}f 1 2 4\n");
            let folder = tempfile::tempdir().expect("a folder");
            let path = folder.path().join("copies.obj");
            std::fs::write(&path, text).expect("written");
            super::open(path.to_str().expect("a plain path")).expect("opens")
        };
        let (many, pair) = (open(20_000), open(2));
        assert_eq!((many.geometry.triangles.len(), many.geometry.repeated), (2, 19_999));
        assert!(many.warnings.iter().any(|w| w == "19999 triangles in the place of others left out"));
        assert_eq!((pair.geometry.triangles.len(), pair.geometry.repeated), (3, 0));
    }

    /// Moving a light that has no surface keeps the surfaces in memory; moving one that has makes new ones.
    #[test]
    fn edits_keep_what_they_do_not_touch() {
        let source = Source::open("ring").expect("built in");
        let mut file = source.file.clone();
        file.lights[0].position = Some([0.5, 2.0, 0.5]);
        let edited = source.edited(&file, &source.scene).expect("valid");
        assert!(Arc::ptr_eq(&edited.geometry, &source.scene.geometry) && edited.hash != source.scene.hash);
        let soft = Source::open("ring_soft").expect("built in");
        let mut file = soft.file.clone();
        file.lights[0].radius = Some(0.05);
        let edited = soft.edited(&file, &soft.scene).expect("valid");
        assert!(!Arc::ptr_eq(&edited.geometry, &soft.scene.geometry));
        file.lights[0].radius = Some(-1.0);
        let error = soft.edited(&file, &soft.scene).expect_err("negative").to_string();
        assert!(error.contains("lights[0].radius"), "{error}");
    }
}
