//! Scenes of cases: surfaces and materials, without a file.

use crate::math::rgb::Rgb;
use crate::scene::geometry::{NONE, Sphere};
use crate::scene::scene_file::RenderFile;
use crate::scene::{Camera, Geometry, Material, Scene};
use crate::trace::{Intersector, Ray, Surface};
use glam::{DVec3, Vec3};

/// A mirror that reflects everything.
pub const MIRROR: Material = Material::Mirror { reflectance: Rgb::ONE };

/// Clear glass.
pub fn glass(ior: f32) -> Material {
    Material::Dielectric { ior, absorption: Rgb::ZERO }
}

/// A scene about the local origin of these surfaces, all of them of `material`.
pub fn scene(geometry: Geometry, material: Material, radius: f32) -> Scene {
    Scene {
        name: String::new(),
        hash: 0,
        origin: DVec3::ZERO,
        radius,
        camera: Camera {
            position: Vec3::ZERO,
            frame: [Vec3::X, Vec3::Y, Vec3::NEG_Z],
            tan_half_fov_y: 0.5,
            resolution: [1, 1],
        },
        geometry: geometry.into(),
        materials: vec![material],
        material_names: vec![String::new()],
        lights: Vec::new(),
        render: RenderFile::default(),
        render_lines: Default::default(),
        realtime: Default::default(),
        realtime_lines: Default::default(),
        motions: Vec::new(),
        viewpoints: Vec::new(),
        cells: None,
        warnings: Vec::new(),
    }
}

/// Flat triangles over shared vertices, of material 0.
pub fn mesh(positions: Vec<Vec3>, triangles: Vec<[u32; 3]>) -> Geometry {
    let none = vec![[NONE; 3]; triangles.len()];
    Geometry {
        positions,
        triangle_materials: vec![0; triangles.len()],
        corner_normals: none.clone(),
        corner_uvs: none,
        triangles,
        ..Default::default()
    }
}

/// Spheres of material 0.
pub fn spheres(all: impl IntoIterator<Item = (Vec3, f32)>) -> Geometry {
    let of = |(center, radius)| Sphere { center, radius, material: 0 };
    Geometry { spheres: all.into_iter().map(of).collect(), ..Default::default() }
}

/// Distance to the surface that a ray meets, and the surface.
pub fn meet(scene: &Scene, intersector: &Intersector, ray: &Ray) -> Option<(f32, Surface)> {
    intersector.closest(ray).map(|hit| (hit.t, Surface::new(scene, ray, &hit)))
}
