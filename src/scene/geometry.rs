//! Surfaces as the intersector sees them: indexed triangles and spheres.

use glam::{Vec2, Vec3};
use prefetch_index::prefetch_index;

/// No shading normal or texture coordinate at a corner.
pub const NONE: u32 = u32::MAX;

/// A sphere with its surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sphere {
    /// Centre, metres.
    pub center: Vec3,
    /// Radius, metres, positive.
    pub radius: f32,
    /// Index of its material.
    pub material: u32,
}

/// Triangles and spheres. Primitive `i` is triangle `i`, or sphere `i - triangles` beyond them.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Geometry {
    /// Vertices, metres.
    pub positions: Vec<Vec3>,
    /// Unit shading normals.
    pub normals: Vec<Vec3>,
    /// Texture coordinates.
    pub uvs: Vec<Vec2>,
    /// Vertices of each triangle, counter-clockwise seen from the front.
    pub triangles: Vec<[u32; 3]>,
    /// Shading normals of each triangle's corners; [`NONE`] where it is flat.
    pub corner_normals: Vec<[u32; 3]>,
    /// Texture coordinates of each triangle's corners; [`NONE`] where there are none.
    pub corner_uvs: Vec<[u32; 3]>,
    /// Material of each triangle.
    pub triangle_materials: Vec<u32>,
    /// Spheres.
    pub spheres: Vec<Sphere>,
    /// Triangles and spheres of the input without area, left out.
    pub zero_area: usize,
    /// Triangles that were left out because others lie in their place.
    pub repeated: usize,
}

/// Memory that a triangle takes while a scene is loaded, and its hierarchy built, bytes: twice its entries in the lists
/// of the loader, which grow by doubling, its entries here, and in the hierarchy a box, a leaf and its share of the nodes
/// while they are built.
pub const BYTES_PER_TRIANGLE: usize = 3 * INDICES + HIERARCHY;

/// Three lists of three indices and one of materials.
const INDICES: usize = size_of::<[[u32; 3]; 3]>() + size_of::<u32>();

/// Boxes, leaves and nodes while they are built. With all lists and vertices a ring of 1.2 million triangles took 349
/// bytes for each at the highest.
const HIERARCHY: usize = 240;

/// Memory that a vertex with its normal takes while a scene is loaded, bytes.
pub const BYTES_PER_VERTEX: usize = 2 * (2 * size_of::<glam::DVec3>()) + 2 * size_of::<Vec3>();

impl Geometry {
    /// Asks for the memory of primitives that are to be met: those of a large mesh lie anywhere, and what they are made of lies
    /// elsewhere again.
    pub fn prefetch(&self, primitives: impl Iterator<Item = usize> + Clone) {
        for p in primitives.clone() {
            prefetch_index(&self.triangles, p);
            prefetch_index(&self.corner_normals, p);
            prefetch_index(&self.corner_uvs, p);
            prefetch_index(&self.triangle_materials, p);
        }
        for p in primitives {
            let (Some(corners), Some(normals)) = (self.triangles.get(p), self.corner_normals.get(p)) else { continue };
            corners.iter().for_each(|&i| prefetch_index(&self.positions, i as usize));
            normals.iter().filter(|i| **i != NONE).for_each(|&i| prefetch_index(&self.normals, i as usize));
        }
    }

    /// Corners of a triangle.
    #[inline]
    pub fn corners(&self, triangle: usize) -> [Vec3; 3] {
        // Spelled out: a map over an array whose closure may panic is not inlined.
        let [i, j, k] = self.triangles[triangle];
        [self.positions[i as usize], self.positions[j as usize], self.positions[k as usize]]
    }

    /// Number of triangles and spheres.
    pub fn primitive_count(&self) -> usize {
        self.triangles.len() + self.spheres.len()
    }

    /// Index of the material of a primitive.
    pub fn material(&self, primitive: usize) -> usize {
        match self.triangle_materials.get(primitive) {
            Some(m) => *m as usize,
            None => self.spheres[primitive - self.triangles.len()].material as usize,
        }
    }

    /// Corners of the box around a primitive.
    pub fn bounds(&self, primitive: usize) -> (Vec3, Vec3) {
        if primitive < self.triangles.len() {
            let [a, b, c] = self.corners(primitive);
            (a.min(b).min(c), a.max(b).max(c))
        } else {
            let s = self.spheres[primitive - self.triangles.len()];
            (s.center - s.radius, s.center + s.radius)
        }
    }

    /// Indices of the materials that some surface has; an index may come more than once.
    pub fn used_materials(&self) -> impl Iterator<Item = usize> + '_ {
        let mut last = NONE;
        self.triangle_materials
            .iter()
            .copied()
            .chain(self.spheres.iter().map(|s| s.material))
            .filter(move |&m| std::mem::replace(&mut last, m) != m)
            .map(|m| m as usize)
    }
}
