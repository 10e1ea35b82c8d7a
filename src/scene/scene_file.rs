//! The scene format as it is written (TOML), before any check but that of names and types.

use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// A scene file.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct SceneFile {
    /// Name of the scene.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub name: Option<String>,
    /// The camera.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub camera: Option<CameraFile>,
    /// Materials by name.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub materials: BTreeMap<String, MaterialFile>,
    /// Surfaces.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub shapes: Vec<ShapeFile>,
    /// Lights.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub lights: Vec<LightFile>,
    /// Settings that the scene asks for.
    #[serde(default)]
    pub render: RenderFile,
}

/// `[camera]`.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct CameraFile {
    /// Eye, m.
    pub position: [f64; 3],
    /// Point looked at, m.
    pub target: [f64; 3],
    /// Direction that is up in the image; y if left out.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub up: Option<[f64; 3]>,
    /// Vertical field of view, degrees, in (0, 180).
    pub fov_y: f64,
    /// Pixels across and down.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub resolution: Option<[i64; 2]>,
}

/// `[materials.NAME]`.
#[derive(Clone, Debug, Default, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct MaterialFile {
    /// diffuse, mirror, metal, dielectric or emissive.
    pub kind: String,
    /// Diffuse, mirror: reflectance; metal: at normal incidence.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub reflectance: Option<[f64; 3]>,
    /// Diffuse: PNG that multiplies the reflectance.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub texture: Option<String>,
    /// Dielectric: refractive index.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub ior: Option<f64>,
    /// Dielectric: per metre.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub transmittance: Option<[f64; 3]>,
    /// Emissive: W/(m² sr).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub radiance: Option<[f64; 3]>,
}

/// `rotate = { axis, angle }`.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct RotateFile {
    /// Axis, of any length.
    pub axis: [f64; 3],
    /// Angle, degrees, right-handed.
    pub angle: f64,
}

/// `animate = { path, period }`, used by real-time rendering.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct AnimateFile {
    /// Offsets along a closed path, m.
    pub path: Vec<[f64; 3]>,
    /// Seconds for once around.
    pub period: f64,
}

/// `[[shapes]]`.
#[derive(Clone, Debug, Default, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct ShapeFile {
    /// mesh, quad, box, sphere or ring.
    pub kind: String,
    /// Name of a material; a mesh may leave it out.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub material: Option<String>,
    /// Mesh: OBJ file relative to this one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub file: Option<String>,
    /// Mesh: angle above which an edge stays sharp, degrees.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub crease_angle: Option<f64>,
    /// Quad, sphere: centre, m.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub center: Option<[f64; 3]>,
    /// Quad: half-edge, m.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub u: Option<[f64; 3]>,
    /// Quad: half-edge, m.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub v: Option<[f64; 3]>,
    /// Box: half its size, m.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub half_size: Option<[f64; 3]>,
    /// Sphere: m.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub radius: Option<f64>,
    /// Ring: inner radius, m.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub inner: Option<f64>,
    /// Ring: outer radius, m.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub outer: Option<f64>,
    /// Ring: m.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub height: Option<f64>,
    /// Ring: facets around.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub segments: Option<i64>,
    /// Factor, positive.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub scale: Option<f64>,
    /// Turn after scaling.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rotate: Option<RotateFile>,
    /// Move after turning, m.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub translate: Option<[f64; 3]>,
    /// Real-time only.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub animate: Option<AnimateFile>,
}

/// `[[lights]]`.
#[derive(Clone, Debug, Default, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct LightFile {
    /// point, sphere, quad, spot or directional.
    pub kind: String,
    /// Point, sphere, spot: m.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub position: Option<[f64; 3]>,
    /// Sphere: m.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub radius: Option<f64>,
    /// Quad: m.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub center: Option<[f64; 3]>,
    /// Quad: half-edge, m.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub u: Option<[f64; 3]>,
    /// Quad: half-edge, m.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub v: Option<[f64; 3]>,
    /// Spot, directional: along the light.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub direction: Option<[f64; 3]>,
    /// Spot: full angle, degrees.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub cone: Option<f64>,
    /// Spot: exponent of the cosine.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub falloff: Option<f64>,
    /// All but directional: Φ, W.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub power: Option<[f64; 3]>,
    /// Directional: W/m².
    #[serde(skip_serializing_if = "Option::is_none")]
    pub irradiance: Option<[f64; 3]>,
    /// Real-time only.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub animate: Option<AnimateFile>,
}

/// `[render]`: every key has a flag of the same name that wins.
#[derive(Clone, Debug, Default, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct RenderFile {
    /// Photons emitted per pass.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub photons: Option<i64>,
    /// Estimator and its settings.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub estimator: Option<String>,
    /// knn or overlap.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub gather: Option<String>,
    /// Photons that `knn` and `density` look up.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub k: Option<i64>,
    /// Factor on the axes of all photon footprints.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub footprint_scale: Option<f64>,
    /// Bounces of a path.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub max_depth: Option<i64>,
    /// Specular view hits at which both branches are followed.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub split_depth: Option<i64>,
    /// none, classic, precomputed or ray-differentials, with settings; a list where estimators are compared.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub final_gather: Option<String>,
    /// Rays of final gathering from each view hit.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub final_gather_rays: Option<i64>,
    /// all, direct, caustic or global.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub light: Option<String>,
    /// shadow_rays or photons.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub direct: Option<String>,
    /// Shadow rays to each light with area, for each view hit.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub shadow_rays: Option<i64>,
    /// sobol or random.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sampling: Option<String>,
    /// polar or as_published.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub diffuse_spread: Option<String>,
}
