//! Where a file comes from: what every output carries.

use crate::scene::Scene;
use serde::Serialize;

/// The command line of this process.
pub fn command_line() -> String {
    let mut words = std::env::args_os().map(|a| a.to_string_lossy().into_owned());
    // The program's own path says nothing about the result.
    words.next();
    std::iter::once("cusp".to_owned()).chain(words).collect::<Vec<_>>().join(" ")
}

/// Facts that let a reader make a file again.
#[derive(Clone, Debug, Serialize)]
pub struct Provenance {
    /// Version of Cusp.
    pub version: String,
    /// The command line.
    pub command: String,
    /// Seed.
    pub seed: u64,
    /// Name of the scene.
    pub scene: String,
    /// Hash of the scene's files, 16 hexadecimal digits.
    pub scene_hash: String,
}

impl Provenance {
    /// Of a scene rendered with that seed by the command line of this process.
    pub fn new(scene: &Scene, seed: u64) -> Self {
        Self {
            version: env!("CARGO_PKG_VERSION").into(),
            command: command_line(),
            seed,
            scene: scene.name.clone(),
            scene_hash: format!("{:016x}", scene.hash),
        }
    }

    /// Pairs for the headers of image files.
    pub fn pairs(&self) -> [(&'static str, String); 5] {
        [
            ("cusp.version", self.version.clone()),
            ("cusp.command", self.command.clone()),
            ("cusp.seed", self.seed.to_string()),
            ("cusp.scene", self.scene.clone()),
            ("cusp.scene_hash", self.scene_hash.clone()),
        ]
    }
}
