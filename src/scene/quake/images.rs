//! Where the images of a map's textures are found.

use super::pk3::Archive;
use std::path::{Path, PathBuf};

/// Endings of images, in the order in which the game looks.
const ENDINGS: [&str; 4] = ["tga", "jpg", "jpeg", "png"];

/// The archive of a map, the folder that it lies in, and the archives there.
pub struct Images {
    archives: Vec<Archive>,
    folder: Option<PathBuf>,
}

impl Images {
    /// In `own` archive, at `path`, and its neighbours; or in `folder` and the archives there.
    pub(super) fn new(own: Option<Archive>, path: Option<&Path>, folder: Option<PathBuf>) -> Self {
        let mut archives: Vec<Archive> = own.into_iter().collect();
        let beside = path.and_then(Path::parent).map(Path::to_owned).or_else(|| folder.clone());
        let mut others: Vec<PathBuf> = beside
            .and_then(|b| std::fs::read_dir(b).ok())
            .map(|all| all.filter_map(|e| Some(e.ok()?.path())).collect())
            .unwrap_or_default();
        others.retain(|p| p.extension().is_some_and(|e| e.eq_ignore_ascii_case("pk3")) && Some(p.as_path()) != path);
        // Later archives win in the game.
        others.sort_unstable_by(|a, b| b.cmp(a));
        archives.extend(others.iter().filter_map(|p| Archive::open(p)));
        Self { archives, folder }
    }

    /// The image of a texture and its ending, if there is one.
    pub fn find(&mut self, texture: &str) -> Option<(Vec<u8>, &'static str)> {
        // A name that leaves the folder is none.
        if texture.contains("..") || texture.contains(':') || texture.starts_with(['/', '\\']) {
            return None;
        }
        let stem = match texture.rsplit_once('.') {
            Some((stem, ending)) if ENDINGS.contains(&ending.to_ascii_lowercase().as_str()) => stem,
            _ => texture,
        };
        for ending in ENDINGS {
            let name = format!("{stem}.{ending}");
            if let Some(bytes) = self.folder.as_ref().and_then(|f| std::fs::read(f.join(&name)).ok()) {
                return Some((bytes, ending));
            }
            if let Some(bytes) = self.archives.iter_mut().find_map(|a| a.image(&name)) {
                return Some((bytes, ending));
            }
        }
        None
    }
}
