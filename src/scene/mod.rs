//! What is lit: surfaces, materials, lights and the camera, with their loaders and the built-in scenes.
//!
//! Files are read in f64, moved to a local origin, and stored in f32 about it.

pub mod built_in;
pub mod camera;
pub mod error;
pub mod geometry;
pub mod light;
pub mod load;
pub mod locate;
pub mod material;
pub mod memory;
pub mod motion;
pub mod obj;
pub mod quake;
pub mod scene_file;
pub mod shapes;
pub mod source;
pub mod texture;

pub use camera::Camera;
pub use error::SceneError;
pub use geometry::Geometry;
pub use light::Light;
pub use material::Material;
pub use motion::Motion;
pub use source::{Source, open};

use glam::{DVec3, Vec3};
use quake::Cells;
use scene_file::{RealtimeFile, RenderFile};
use std::sync::Arc;

/// Everything that is lit, in metres about a local origin.
#[derive(Clone, Debug)]
pub struct Scene {
    /// Name from the file, or the file's stem.
    pub name: String,
    /// Hash of the scene's text and of the files that it names.
    pub hash: u64,
    /// Where the local origin lies in the file's own coordinates, metres.
    pub origin: DVec3,
    /// Radius of the sphere about the local origin that holds all surfaces, metres; positive.
    pub radius: f32,
    /// The camera.
    pub camera: Camera,
    /// The surfaces.
    pub geometry: Arc<Geometry>,
    /// Materials, indexed by [`Geometry`].
    pub materials: Vec<Material>,
    /// Name of each material as the file has it.
    pub material_names: Vec<String>,
    /// Light sources.
    pub lights: Vec<Light>,
    /// The `[render]` table as it was written.
    pub render: RenderFile,
    /// The file, or the built-in's name with `.toml`, and the line of each key of `[render]`.
    pub render_lines: (std::path::PathBuf, std::collections::BTreeMap<String, usize>),
    /// The `[realtime]` table as it was written.
    pub realtime: RealtimeFile,
    /// Where the keys of `[realtime]` stand, as in `render_lines`.
    pub realtime_lines: (std::path::PathBuf, std::collections::BTreeMap<String, usize>),
    /// What moves in real-time rendering; everything else renders it where the file has it.
    pub motions: Vec<Motion>,
    /// Places to look from that the scene names.
    pub viewpoints: Vec<Viewpoint>,
    /// Cells of visibility, if the scene has them.
    pub cells: Option<Arc<Cells>>,
    /// What was defined but odd, one line each.
    pub warnings: Vec<String>,
}

/// A place to look from.
#[derive(Clone, Debug, PartialEq)]
pub struct Viewpoint {
    /// What the scene calls it.
    pub name: String,
    /// Eye, metres about the local origin.
    pub position: Vec3,
    /// Point looked at.
    pub target: Vec3,
}

impl Scene {
    /// Resolution of f32 where the scene lies: lengths below it (metres) are rounding.
    ///
    /// `2⁻²²` of the scene's radius, so that it scales with the scene's unit.
    pub fn resolution(&self) -> f32 {
        self.radius * RESOLUTION
    }

    /// Sum of the lights' fluxes, the mean of the channels, W.
    pub fn total_flux(&self) -> f64 {
        self.lights.iter().map(|l| f64::from(crate::math::rgb::mean(l.flux()))).sum()
    }

    /// Whether any surface reflects or refracts without scattering.
    pub fn has_specular(&self) -> bool {
        self.geometry.used_materials().any(|m| self.materials[m].is_specular())
    }
}

/// Four units in the last place of the scene's radius, relative to it.
pub const RESOLUTION: f32 = 1.0 / (1 << 22) as f32;
