//! Shapes as f64 meshes, and the transform that places them.

use glam::{DMat3, DVec2, DVec3};
use std::f64::consts::TAU;

use crate::scene::geometry::NONE;

/// A mesh before it is placed: indexed triangles with optional corner attributes.
#[derive(Clone, Debug, Default)]
pub struct Mesh {
    /// Vertices, m.
    pub positions: Vec<DVec3>,
    /// Shading normals, any positive length.
    pub normals: Vec<DVec3>,
    /// Texture coordinates.
    pub uvs: Vec<DVec2>,
    /// Vertex indices, counter-clockwise from the front.
    pub triangles: Vec<[u32; 3]>,
    /// Indices into `normals`, or [`NONE`].
    pub corner_normals: Vec<[u32; 3]>,
    /// Indices into `uvs`, or [`NONE`].
    pub corner_uvs: Vec<[u32; 3]>,
    /// Index of each triangle's own material; [`NONE`] without one.
    pub materials: Vec<u32>,
}

impl Mesh {
    fn add(&mut self, vertices: [u32; 3], normals: [u32; 3], uvs: [u32; 3]) {
        self.triangles.push(vertices);
        self.corner_normals.push(normals);
        self.corner_uvs.push(uvs);
        self.materials.push(NONE);
    }

    fn add_quad(&mut self, corners: [DVec3; 4]) {
        let base = self.positions.len() as u32;
        let uv = self.uvs.len() as u32;
        self.positions.extend(corners);
        self.uvs.extend([DVec2::ZERO, DVec2::X, DVec2::ONE, DVec2::Y]);
        for [a, b, c] in [[0, 1, 2], [0, 2, 3]] {
            self.add([base + a, base + b, base + c], [NONE; 3], [uv + a, uv + b, uv + c]);
        }
    }

    /// Applies `place` to all vertices and normals.
    pub fn placed(mut self, place: &Placement) -> Self {
        for p in &mut self.positions {
            *p = place.point(*p);
        }
        for n in &mut self.normals {
            *n = place.rotation * *n;
        }
        self
    }
}

/// Scale, then rotate, then translate.
#[derive(Clone, Copy, Debug)]
pub struct Placement {
    /// Factor, positive.
    pub scale: f64,
    /// Rotation.
    pub rotation: DMat3,
    /// Offset, m.
    pub translation: DVec3,
}

impl Placement {
    /// Where a point of the shape goes.
    pub fn point(&self, p: DVec3) -> DVec3 {
        self.rotation * (p * self.scale) + self.translation
    }

    /// Where an edge of the shape goes.
    pub fn vector(&self, v: DVec3) -> DVec3 {
        self.rotation * (v * self.scale)
    }
}

/// Rotation by `degrees` about `axis` (any length but zero), right-handed; exact sines of the `libm` crate.
pub fn rotation(axis: DVec3, degrees: f64) -> DMat3 {
    let a = axis.normalize();
    let (s, c) = libm::sincos(degrees.to_radians());
    let k = DMat3::from_cols(DVec3::new(0.0, a.z, -a.y), DVec3::new(-a.z, 0.0, a.x), DVec3::new(a.y, -a.x, 0.0));
    DMat3::IDENTITY + k * s + k * k * (1.0 - c)
}

/// Parallelogram with half-edges `u`, `v`; front along `u × v`.
pub fn quad(center: DVec3, u: DVec3, v: DVec3) -> Mesh {
    let mut mesh = Mesh::default();
    mesh.add_quad([center - u - v, center + u - v, center + u + v, center - u + v]);
    mesh
}

/// Box about the origin, its front sides outward.
pub fn cuboid(half: DVec3) -> Mesh {
    let mut mesh = Mesh::default();
    let (x, y, z) = (DVec3::X * half.x, DVec3::Y * half.y, DVec3::Z * half.z);
    for (w, u, v) in [(x, y, z), (-x, z, y), (y, z, x), (-y, x, z), (z, x, y), (-z, y, x)] {
        mesh.add_quad([w - u - v, w + u - v, w + u + v, w - u + v]);
    }
    mesh
}

/// Open ring on y = 0: inner wall, outer wall and flat top rim, smooth around; no bottom.
pub fn ring(inner: f64, outer: f64, height: f64, segments: u32) -> Mesh {
    let mut mesh = Mesh::default();
    for i in 0..segments {
        let (s, c) = libm::sincos(TAU * f64::from(i) / f64::from(segments));
        let out = DVec3::new(c, 0.0, s);
        let up = DVec3::Y * height;
        mesh.positions.extend([out * inner, out * inner + up, out * outer, out * outer + up]);
        mesh.normals.extend([-out, out]);
    }
    for i in 0..segments {
        let j = (i + 1) % segments;
        let (a, b) = (4 * i, 4 * j);
        let (inward, outward) = ([2 * i, 2 * j], [2 * i + 1, 2 * j + 1]);
        // Seen from the axis the inner wall runs the other way round than the outer wall seen from outside.
        mesh.add([a, b, b + 1], [inward[0], inward[1], inward[1]], [NONE; 3]);
        mesh.add([a, b + 1, a + 1], [inward[0], inward[1], inward[0]], [NONE; 3]);
        mesh.add([a + 2, b + 3, b + 2], [outward[0], outward[1], outward[1]], [NONE; 3]);
        mesh.add([a + 2, a + 3, b + 3], [outward[0], outward[0], outward[1]], [NONE; 3]);
        mesh.add([a + 1, b + 1, b + 3], [NONE; 3], [NONE; 3]);
        mesh.add([a + 1, b + 3, a + 3], [NONE; 3], [NONE; 3]);
    }
    mesh
}

#[cfg(test)]
mod tests {
    use super::*;

    fn area_and_volume(mesh: &Mesh) -> (f64, f64) {
        mesh.triangles.iter().fold((0.0, 0.0), |(area, volume), t| {
            let [a, b, c] = t.map(|i| mesh.positions[i as usize]);
            let n = (b - a).cross(c - a);
            (area + n.length() / 2.0, volume + n.dot(a) / 6.0)
        })
    }

    #[test]
    fn box_is_closed_and_faces_outward() {
        let (area, volume) = area_and_volume(&cuboid(DVec3::new(0.5, 1.0, 1.5)));
        assert!((area - 22.0).abs() < 1e-12 && (volume - 6.0).abs() < 1e-12);
    }

    #[test]
    fn quad_faces_along_its_edges_cross_product() {
        let mesh = quad(DVec3::ZERO, DVec3::X, -DVec3::Z);
        let [a, b, c] = mesh.triangles[0].map(|i| mesh.positions[i as usize]);
        assert!((b - a).cross(c - a).y > 0.0);
    }

    #[test]
    fn ring_sides_face_as_named() {
        let mesh = ring(1.0, 1.1, 0.5, 64);
        for (t, n) in mesh.triangles.iter().zip(&mesh.corner_normals) {
            let [a, b, c] = t.map(|i| mesh.positions[i as usize]);
            let g = (b - a).cross(c - a).normalize();
            if n[0] == NONE {
                assert!((g - DVec3::Y).length() < 1e-12);
            } else {
                assert!(g.dot(mesh.normals[n[0] as usize]) > 0.99);
            }
        }
    }

    #[test]
    fn rotation_is_right_handed() {
        let r = rotation(DVec3::Y * 3.0, 90.0);
        assert!((r * DVec3::Z - DVec3::X).length() < 1e-15);
    }
}
