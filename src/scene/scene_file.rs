//! The scene format as it is written (TOML), before any check but that of names and types.

use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// A scene file.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SceneFile {
    /// Name of the scene.
    pub name: Option<String>,
    /// The camera.
    pub camera: Option<CameraFile>,
    /// Materials by name.
    #[serde(default)]
    pub materials: BTreeMap<String, MaterialFile>,
    /// Surfaces.
    #[serde(default)]
    pub shapes: Vec<ShapeFile>,
    /// Lights.
    #[serde(default)]
    pub lights: Vec<LightFile>,
    /// Settings that the scene asks for.
    #[serde(default)]
    pub render: RenderFile,
}

/// `[camera]`.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CameraFile {
    /// Eye, m.
    pub position: [f64; 3],
    /// Point looked at, m.
    pub target: [f64; 3],
    /// Direction that is up in the image; y if left out.
    pub up: Option<[f64; 3]>,
    /// Vertical field of view, degrees, in (0, 180).
    pub fov_y: f64,
    /// Pixels across and down.
    pub resolution: Option<[i64; 2]>,
}

/// `[materials.NAME]`.
#[derive(Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MaterialFile {
    /// diffuse, mirror, metal, dielectric or emissive.
    pub kind: String,
    /// Diffuse, mirror: reflectance; metal: at normal incidence.
    pub reflectance: Option<[f64; 3]>,
    /// Diffuse: PNG that multiplies the reflectance.
    pub texture: Option<String>,
    /// Dielectric: refractive index.
    pub ior: Option<f64>,
    /// Dielectric: per metre.
    pub transmittance: Option<[f64; 3]>,
    /// Emissive: W/(m² sr).
    pub radiance: Option<[f64; 3]>,
}

/// `rotate = { axis, angle }`.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RotateFile {
    /// Axis, of any length.
    pub axis: [f64; 3],
    /// Angle, degrees, right-handed.
    pub angle: f64,
}

/// `animate = { path, period }`, used by real-time rendering.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct AnimateFile {
    /// Offsets along a closed path, m.
    pub path: Vec<[f64; 3]>,
    /// Seconds for once around.
    pub period: f64,
}

/// `[[shapes]]`.
#[derive(Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ShapeFile {
    /// mesh, quad, box, sphere or ring.
    pub kind: String,
    /// Name of a material; a mesh may leave it out.
    pub material: Option<String>,
    /// Mesh: OBJ file relative to this one.
    pub file: Option<String>,
    /// Mesh: angle above which an edge stays sharp, degrees.
    pub crease_angle: Option<f64>,
    /// Quad, sphere: centre, m.
    pub center: Option<[f64; 3]>,
    /// Quad: half-edge, m.
    pub u: Option<[f64; 3]>,
    /// Quad: half-edge, m.
    pub v: Option<[f64; 3]>,
    /// Box: half its size, m.
    pub half_size: Option<[f64; 3]>,
    /// Sphere: m.
    pub radius: Option<f64>,
    /// Ring: inner radius, m.
    pub inner: Option<f64>,
    /// Ring: outer radius, m.
    pub outer: Option<f64>,
    /// Ring: m.
    pub height: Option<f64>,
    /// Ring: facets around.
    pub segments: Option<i64>,
    /// Factor, positive.
    pub scale: Option<f64>,
    /// Turn after scaling.
    pub rotate: Option<RotateFile>,
    /// Move after turning, m.
    pub translate: Option<[f64; 3]>,
    /// Real-time only.
    pub animate: Option<AnimateFile>,
}

/// `[[lights]]`.
#[derive(Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LightFile {
    /// point, sphere, quad, spot or directional.
    pub kind: String,
    /// Point, sphere, spot: m.
    pub position: Option<[f64; 3]>,
    /// Sphere: m.
    pub radius: Option<f64>,
    /// Quad: m.
    pub center: Option<[f64; 3]>,
    /// Quad: half-edge, m.
    pub u: Option<[f64; 3]>,
    /// Quad: half-edge, m.
    pub v: Option<[f64; 3]>,
    /// Spot, directional: along the light.
    pub direction: Option<[f64; 3]>,
    /// Spot: full angle, degrees.
    pub cone: Option<f64>,
    /// Spot: exponent of the cosine.
    pub falloff: Option<f64>,
    /// All but directional: Φ, W.
    pub power: Option<[f64; 3]>,
    /// Directional: W/m².
    pub irradiance: Option<[f64; 3]>,
    /// Real-time only.
    pub animate: Option<AnimateFile>,
}

/// `[render]`: every key has a flag of the same name that wins.
#[derive(Clone, Debug, Default, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct RenderFile {
    /// Photons emitted per pass.
    pub photons: Option<i64>,
    /// Estimator and its settings.
    pub estimator: Option<String>,
    /// knn or overlap.
    pub gather: Option<String>,
    /// Photons that `knn` and `density` look up.
    pub k: Option<i64>,
    /// Factor on the axes of all photon footprints.
    pub footprint_scale: Option<f64>,
    /// Bounces of a path.
    pub max_depth: Option<i64>,
    /// Specular view hits at which both branches are followed.
    pub split_depth: Option<i64>,
    /// none.
    pub final_gather: Option<String>,
    /// all, direct, caustic or global.
    pub light: Option<String>,
    /// shadow_rays or photons.
    pub direct: Option<String>,
    /// Shadow rays to each light with area, for each view hit.
    pub shadow_rays: Option<i64>,
    /// sobol or random.
    pub sampling: Option<String>,
    /// polar or as_published.
    pub diffuse_spread: Option<String>,
}
