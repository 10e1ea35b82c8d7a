//! Opening and saving: scenes, sessions, images.

use super::app::Workbench;
use super::desk::{Finding, Kind, Step};
use super::dialogs::Purpose;
use super::gallery::tiled::TiledImage;
use crate::export::session::Session;
use crate::export::whole_file;
use std::path::Path;

/// A session on another scene that keeps the panels and how they are shown.
pub fn session_for(session: &Session, scene: &str) -> Session {
    Session {
        panels: session.panels.clone(),
        overlays: session.overlays.clone(),
        comparison: session.comparison.clone(),
        layout: session.layout.clone(),
        ..Session::of(scene)
    }
}

impl Workbench {
    /// Opens a scene, a session or an image, by what the file is.
    pub(super) fn open_file(&mut self, path: &str) {
        let extension = Path::new(path).extension().and_then(|e| e.to_str()).unwrap_or("").to_ascii_lowercase();
        match extension.as_str() {
            "toml" if Session::is_one(Path::new(path)) => match Session::open(Path::new(path)) {
                Ok(session) => self.open(session, Step::Document(Some(path.into()))),
                Err(why) => self.messages.error(why.to_string()),
            },
            // It becomes a panel once it is read.
            "exr" | "png" => self.read_image(path),
            _ => {
                let session = session_for(&self.document.session, path);
                self.open(session, Step::New);
            }
        }
    }

    /// Reads an image for a panel.
    pub(super) fn read_image(&mut self, path: &str) {
        let path = path.to_owned();
        self.desk.asked_images.insert(path.clone());
        self.analysis.ask(Kind::Image(path.clone()), move || {
            let read = crate::measure::image_file::read(path.as_ref());
            let read = read.map(|image| TiledImage::of(&image)).map_err(|e| e.to_string());
            Finding::Image(path, read)
        });
    }

    /// Asks for a file to open.
    pub(super) fn open_dialog(&mut self) {
        self.desk.dialogs.ask_path(Purpose::Open, "");
    }

    /// Saves the session to its own file, or to one that is asked for.
    pub(super) fn save_session(&mut self, elsewhere: bool) {
        match self.document.path().map(Path::to_owned) {
            Some(path) if !elsewhere => self.save_session_to(&path),
            _ => self.desk.dialogs.ask_path(Purpose::SaveSession, "session.toml"),
        }
    }

    /// Writes the session.
    pub(super) fn save_session_to(&mut self, path: &Path) {
        self.document.session.layout = super::layout::to_text(&self.tree);
        let written = self
            .document
            .session
            .to_toml(path.parent().unwrap_or(Path::new("")))
            .and_then(|text| whole_file::write(path, text.as_bytes()).map_err(|e| e.to_string()));
        match written {
            Ok(()) => {
                self.document.saved_as(path.to_owned());
                self.messages.note(format!("saved the session as {}", path.display()));
            }
            Err(why) => self.messages.error(why),
        }
    }

    /// Asks where to save the scene.
    pub(super) fn save_scene(&mut self) {
        let name = format!("{}-edited.toml", self.document.scene().name);
        self.desk.dialogs.ask_path(Purpose::SaveScene, &name);
    }

    /// Writes the scene with its edits. Files that it names stay where they are, so their paths are made whole.
    pub(super) fn save_scene_to(&mut self, path: &Path) {
        let mut file = self.document.scene_file();
        if let Some(folder) = self.document.source().path().and_then(Path::parent) {
            let meshes = file.shapes.iter_mut().filter_map(|s| s.file.as_mut());
            let textures = file.materials.values_mut().filter_map(|m| m.texture.as_mut());
            for name in meshes.chain(textures) {
                let placed = folder.join(&*name);
                *name = std::path::absolute(&placed).unwrap_or(placed).to_string_lossy().into_owned();
            }
        }
        let written = toml::to_string(&file)
            .map_err(|e| e.to_string())
            .and_then(|text| whole_file::write(path, text.as_bytes()).map_err(|e| e.to_string()));
        match written {
            Ok(()) => self.messages.note(format!("saved the scene as {}", path.display())),
            Err(why) => self.messages.error(why),
        }
    }

    /// Asks where to export.
    pub(super) fn export(&mut self) {
        self.desk.dialogs.ask_path(Purpose::Export, "cusp-out/window");
    }
}
