//! All surfaces and lights in f64 as they come from a file, and their move to the local origin.

use crate::math::frame::unit;
use crate::math::rgb::Rgb;
use crate::scene::geometry::{Geometry, NONE, Sphere};
use crate::scene::shapes::Mesh;
use crate::scene::{Camera, Material, Motion};
use glam::{DVec3, Vec3};
use std::collections::HashSet;

/// The camera before it is moved to the local origin.
pub(super) struct CameraSource {
    pub(super) position: DVec3,
    pub(super) target: DVec3,
    pub(super) up: DVec3,
    pub(super) fov_y: f64,
    pub(super) resolution: [u32; 2],
}

impl CameraSource {
    /// The camera about a local origin.
    pub(super) fn local(&self, origin: DVec3) -> Camera {
        // Both have a direction: the loader has looked.
        let forward = unit(self.target - self.position).unwrap_or(DVec3::NEG_Z);
        let right = unit(forward.cross(self.up)).unwrap_or(DVec3::X);
        Camera {
            position: (self.position - origin).as_vec3(),
            frame: [right, right.cross(forward), forward].map(|v| v.as_vec3()),
            tan_half_fov_y: crate::math::elementary::tan(self.fov_y.to_radians() / 2.0) as f32,
            resolution: self.resolution,
        }
    }
}

/// Lights before they are moved to the local origin.
pub(super) enum LightSource {
    Point {
        position: DVec3,
        power: Rgb,
    },
    Sphere {
        center: DVec3,
        radius: f64,
        power: Rgb,
    },
    Quad {
        center: DVec3,
        u: DVec3,
        v: DVec3,
        power: Rgb,
    },
    Spot {
        position: DVec3,
        direction: DVec3,
        half: f64,
        falloff: f64,
        power: Rgb,
    },
    Directional {
        direction: DVec3,
        irradiance: Rgb,
    },
    /// A range of triangles.
    Mesh {
        first: usize,
        count: usize,
        radiance: Rgb,
    },
}

/// All surfaces in f64, as they come.
#[derive(Default)]
pub(super) struct Assembly {
    pub(super) mesh: Mesh,
    pub(super) materials: Vec<Material>,
    pub(super) material_names: Vec<String>,
    pub(super) spheres: Vec<(DVec3, f64, u32)>,
    /// Each with the key that it came from.
    pub(super) lights: Vec<(String, LightSource)>,
    /// What moves in real-time rendering.
    pub(super) moving: Vec<Moving>,
}

/// How many triangles, spheres and lights there are.
#[derive(Clone, Copy)]
pub(super) struct Extent {
    triangles: usize,
    spheres: usize,
    lights: usize,
}

/// What came in between two extents, and its path.
pub(super) struct Moving {
    pub(super) from: Extent,
    pub(super) to: Extent,
    pub(super) path: Vec<DVec3>,
    pub(super) period: f64,
}

impl Assembly {
    pub(super) fn extent(&self) -> Extent {
        Extent { triangles: self.mesh.triangles.len(), spheres: self.spheres.len(), lights: self.lights.len() }
    }

    pub(super) fn add_mesh(&mut self, mesh: Mesh, material: impl Fn(u32) -> u32) {
        let (p, n, t) = (self.mesh.positions.len() as u32, self.mesh.normals.len() as u32, self.mesh.uvs.len() as u32);
        let shift = |i: [u32; 3], by: u32| i.map(|i| if i == NONE { NONE } else { i + by });
        self.mesh.positions.extend(mesh.positions);
        self.mesh.normals.extend(mesh.normals);
        self.mesh.uvs.extend(mesh.uvs);
        self.mesh.triangles.extend(mesh.triangles.iter().map(|&i| shift(i, p)));
        self.mesh.corner_normals.extend(mesh.corner_normals.iter().map(|&i| shift(i, n)));
        self.mesh.corner_uvs.extend(mesh.corner_uvs.iter().map(|&i| shift(i, t)));
        self.mesh.materials.extend(mesh.materials.iter().map(|&m| material(m)));
    }

    pub(super) fn add_material(&mut self, name: impl Into<String>, material: Material) -> u32 {
        self.materials.push(material);
        self.material_names.push(name.into());
        self.materials.len() as u32 - 1
    }

    /// Centre and radius of what is there; a unit sphere about the origin if nothing is.
    pub(super) fn bounds(&self) -> (DVec3, f64) {
        let mut low = DVec3::INFINITY;
        let mut high = DVec3::NEG_INFINITY;
        for t in &self.mesh.triangles {
            for &i in t {
                low = low.min(self.mesh.positions[i as usize]);
                high = high.max(self.mesh.positions[i as usize]);
            }
        }
        for (c, r, _) in &self.spheres {
            low = low.min(*c - *r);
            high = high.max(*c + *r);
        }
        let radius = (high - low).length() / 2.0;
        if radius.is_finite() && radius > 0.0 { ((low + high) / 2.0, radius) } else { (DVec3::ZERO, 1.0) }
    }
}

/// Length relative to the scene's radius below which products of edges vanish against the scene in f32.
const SMALLEST: f64 = 1e-12;

/// Triangles that are looked at to see whether many are the same.
const SAMPLE: usize = 4096;

/// Corners of a triangle as numbers that are equal where it is.
fn place(triangle: [u32; 3], positions: &[Vec3]) -> [[u32; 3]; 3] {
    triangle.map(|i| positions[i as usize].to_array().map(f32::to_bits))
}

/// Whether more than two triangles are the same, judged by a sample.
///
/// The hierarchy's builder takes time in the square of boxes that are all the same.
fn is_crowded(triangles: &[[u32; 3]], positions: &[Vec3]) -> bool {
    let step = triangles.len().div_ceil(SAMPLE).max(1);
    let mut sample: Vec<_> = triangles.iter().step_by(step).map(|t| place(*t, positions)).collect();
    sample.sort_unstable();
    sample.windows(3).any(|w| w[0] == w[2])
}

/// Moves the assembly to the local origin, in f32, without its triangles and spheres that have no area. Where many
/// triangles are the same the first alone is kept, which is the one that rays meet.
///
/// What moves is told by where it comes to lie.
pub(super) fn local_geometry(assembly: &Assembly, origin: DVec3, radius: f64) -> (Geometry, Vec<Motion>) {
    let mesh = &assembly.mesh;
    let mut g = Geometry {
        positions: mesh.positions.iter().map(|&p| (p - origin).as_vec3()).collect(),
        normals: mesh.normals.iter().map(|n| unit(*n).unwrap_or(DVec3::Y).as_vec3()).collect(),
        uvs: mesh.uvs.iter().map(|t| t.as_vec2()).collect(),
        spheres: assembly
            .spheres
            .iter()
            .filter(|(_, r, _)| *r > radius * SMALLEST)
            .map(|&(c, r, material)| Sphere { center: (c - origin).as_vec3(), radius: r as f32, material })
            .collect(),
        ..Default::default()
    };
    g.zero_area = assembly.spheres.len() - g.spheres.len();
    let smallest = radius * radius * (SMALLEST * SMALLEST);
    let mut places = is_crowded(&mesh.triangles, &g.positions).then(HashSet::new);
    // Triangles and spheres that are kept of the first `i`, where something moves.
    let mut kept = Vec::new();
    for (i, t) in mesh.triangles.iter().enumerate() {
        if !assembly.moving.is_empty() {
            kept.push(g.triangles.len() as u32);
        }
        let [a, b, c] = t.map(|i| mesh.positions[i as usize]);
        if (b - a).cross(c - a).length() <= smallest {
            g.zero_area += 1;
            continue;
        }
        if places.as_mut().is_some_and(|p| !p.insert(place(*t, &g.positions))) {
            g.repeated += 1;
            continue;
        }
        g.triangles.push(*t);
        g.corner_normals.push(mesh.corner_normals[i]);
        g.corner_uvs.push(mesh.corner_uvs[i]);
        g.triangle_materials.push(mesh.materials[i]);
    }
    kept.push(g.triangles.len() as u32);
    let spheres =
        |before: usize| assembly.spheres[..before].iter().filter(|(_, r, _)| *r > radius * SMALLEST).count() as u32;
    let motions = assembly.moving.iter().map(|m| Motion {
        triangles: kept[m.from.triangles]..kept[m.to.triangles],
        spheres: spheres(m.from.spheres)..spheres(m.to.spheres),
        lights: (m.from.lights as u32..m.to.lights as u32).collect(),
        path: m.path.clone(),
        period: m.period,
    });
    let motions = motions.collect();
    (g, motions)
}
