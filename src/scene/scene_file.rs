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
    /// Settings of real-time rendering.
    #[serde(default, skip_serializing_if = "RealtimeFile::is_empty")]
    pub realtime: RealtimeFile,
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
    /// auto or off.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub projection_map: Option<String>,
}

/// `[realtime]`: parameters of real-time photon mapping (Kristensen and Ottosen 2003, chapter 6), and ours.
#[derive(Clone, Debug, Default, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct RealtimeFile {
    /// Whether rays go through a hierarchy; otherwise they try every surface.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub acceleration: Option<bool>,
    /// Triangles by which the mesh that carries irradiance is refined.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mesh_refinement: Option<i64>,
    /// Longest edge of that mesh, m; refinement ends where it is reached.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub max_edge: Option<f64>,
    /// Whether a vertex is estimated once a frame, or for each visible triangle that it is a corner of.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub estimate_cache: Option<bool>,
    /// Photons of an irradiance estimate at most.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub max_search_count: Option<i64>,
    /// How far an irradiance estimate looks, m.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub max_search_radius: Option<f64>,
    /// Whether the radius follows from the photon map instead.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub radius_heuristic: Option<bool>,
    /// Share α of the mean radiance at which that radius is reached.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub radius_alpha: Option<f64>,
    /// Whether photons off the vertex's plane are left out.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sphere_slice: Option<bool>,
    /// Whether vertices gather finally.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub final_gathering: Option<bool>,
    /// Rays of a final gathering.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub final_gathering_rays: Option<i64>,
    /// Photons that all lights together emit in a frame.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub photons_from_light: Option<i64>,
    /// Frames whose photons make the map.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub accumulation_frames: Option<i64>,
    /// Whether photons are stored where they arrive from the light.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub store_direct_light: Option<bool>,
    /// Diffuse reflections of a photon at most.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub recursion_depth: Option<i64>,
    /// Photons into which a reflected one is split.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub diffuse_reflections: Option<i64>,
    /// Photons stored for each that arrives.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub snowball_size: Option<i64>,
    /// rejection, explicit, saff_kuijlaars, spiral, stratified or sobol.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub light_distribution: Option<String>,
    /// The same for reflections.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub diffuse_distribution: Option<String>,
    /// splitting or roulette.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub scattering: Option<String>,
    /// Whether frames use the same random numbers.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub coherent: Option<bool>,
    /// sphere, cylinder or ellipsoid.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub search: Option<String>,
    /// Whether photons that arrive at the vertex's back are left out.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub incoming_direction: Option<bool>,
    /// Half-height of slice, cylinder and ellipsoid over the radius of the search.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub slice_height: Option<f64>,
    /// disc, hull, hull_as_published, circle, aligned_box, oriented_box or ellipse.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub area: Option<String>,
    /// none, normal or cell: how photons are split into maps.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub partition: Option<String>,
    /// Photons in a leaf of the kd-tree at most.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub stop_recursion_size: Option<i64>,
    /// instances or rebuild: how the hierarchy follows what moves.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub moving: Option<String>,
    /// multiply or offset.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub blending: Option<String>,
    /// Whether triangles seen from behind are left out of the picture.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub cull_back_faces: Option<bool>,
    /// Whether a spot light at the camera takes the place of the lights.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub flashlight: Option<bool>,
}

impl RealtimeFile {
    /// Whether no key is given.
    pub fn is_empty(&self) -> bool {
        *self == Self::default()
    }
}
