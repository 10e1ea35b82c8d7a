//! The surface at a hit: position, normals, and how the shading normal turns over a footprint.

use crate::math::frame::unit_or;
use crate::scene::geometry::NONE;
use crate::scene::{Geometry, Scene};
use crate::trace::{Hit, Ray};
use glam::{DVec3, Vec2, Vec3};

/// What a ray meets. Normals face the side that the ray comes from.
#[derive(Clone, Copy, Debug)]
pub struct Surface {
    /// Position on the surface, metres; from the surface's own parameters, so that it does not lose digits with distance.
    pub position: Vec3,
    /// Unit normal of the flat triangle or the sphere.
    pub normal: Vec3,
    /// Unit shading normal, on the same side as `normal`.
    pub shading: Vec3,
    /// Whether the ray meets the front side.
    pub front: bool,
    /// Texture coordinates.
    pub uv: Vec2,
    /// Index of the primitive.
    pub primitive: u32,
    /// Index of the material.
    pub material: u32,
    weights: [f32; 2],
}

impl Surface {
    /// The surface where `ray` meets `hit`.
    pub fn new(scene: &Scene, ray: &Ray, hit: &Hit) -> Self {
        let g = &scene.geometry;
        let index = hit.primitive as usize;
        let (position, outward, shading, uv) = if index < g.triangles.len() {
            let [a, b, c] = g.corners(index);
            let [wb, wc] = hit.weights;
            let normal = unit_or((b - a).as_dvec3().cross((c - a).as_dvec3()).as_vec3(), Vec3::Y);
            let shading = match corner_normals(g, index) {
                Some([na, nb, nc]) => {
                    let n = unit_or(na * (1.0 - wb - wc) + nb * wb + nc * wc, normal);
                    if n.dot(normal) < 0.0 { -n } else { n }
                }
                None => normal,
            };
            let uv = match g.corner_uvs[index] {
                [i, j, k] if i != NONE => {
                    let at = |i: u32| g.uvs[i as usize];
                    at(i) * (1.0 - wb - wc) + at(j) * wb + at(k) * wc
                }
                _ => Vec2::ZERO,
            };
            (a + (b - a) * wb + (c - a) * wc, normal, shading, uv)
        } else {
            let s = g.spheres[index - g.triangles.len()];
            let normal = unit_or(ray.origin + ray.direction * hit.t - s.center, Vec3::Y);
            (s.center + normal * s.radius, normal, normal, Vec2::ZERO)
        };
        let front = outward.dot(ray.direction) < 0.0;
        let side = if front { 1.0 } else { -1.0 };
        Self {
            position,
            normal: outward * side,
            shading: shading * side,
            front,
            uv,
            primitive: hit.primitive,
            material: g.material(index) as u32,
            weights: hit.weights,
        }
    }

    /// Change dN of the unit shading normal for changes `dq` of the position in the surface (Igehy 1999, section 3.3).
    ///
    /// Zero on flat triangles, `dq/r` on spheres, the derivative of the interpolated normal on smooth triangles. A
    /// triangle too thin to have a derivative counts as flat.
    pub fn normal_differential(&self, scene: &Scene, dq: [Vec3; 2]) -> [Vec3; 2] {
        let g = &scene.geometry;
        let index = self.primitive as usize;
        if index >= g.triangles.len() {
            let r = g.spheres[index - g.triangles.len()].radius;
            let side = if self.front { 1.0 } else { -1.0 };
            return dq.map(|d| d * (side / r));
        }
        let Some(n) = corner_normals(g, index) else {
            return [Vec3::ZERO; 2];
        };
        let [a, b, c] = g.corners(index).map(|p| p.as_dvec3());
        let [na, nb, nc] = n.map(|n| n.as_dvec3());
        let (e1, e2) = (b - a, c - a);
        let area2 = e1.cross(e2);
        let scale = area2.length_squared();
        if scale <= 0.0 {
            return [Vec3::ZERO; 2];
        }
        let [wb, wc] = self.weights.map(f64::from);
        let sum = na * (1.0 - wb - wc) + nb * wb + nc * wc;
        let length = sum.length();
        if length < 1e-6 {
            return [Vec3::ZERO; 2];
        }
        let unit = sum / length;
        let towards = if unit.dot(self.shading.as_dvec3()) < 0.0 { -1.0 } else { 1.0 };
        dq.map(|d| {
            let d = d.as_dvec3();
            // Gradients of the weights of the second and third corner.
            let db = d.cross(e2).dot(area2) / scale;
            let dc = e1.cross(d).dot(area2) / scale;
            let dn: DVec3 = (nb - na) * db + (nc - na) * dc;
            let dn = (dn - unit * unit.dot(dn)) * (towards / length);
            if dn.is_finite() { dn.as_vec3() } else { Vec3::ZERO }
        })
    }

    /// Start of a ray that leaves the surface along `direction`, a little off it on that side.
    pub fn leave(&self, scene: &Scene, direction: Vec3) -> Vec3 {
        let offset = scene.radius * SELF_INTERSECTION;
        if direction.dot(self.normal) >= 0.0 {
            self.position + self.normal * offset
        } else {
            self.position - self.normal * offset
        }
    }
}

/// Offset of rays that leave a surface, relative to the scene's radius: some 32 units in the last place.
pub const SELF_INTERSECTION: f32 = 2e-6;

fn corner_normals(g: &Geometry, triangle: usize) -> Option<[Vec3; 3]> {
    let n = g.corner_normals[triangle];
    (n[0] != NONE).then(|| n.map(|i| g.normals[i as usize]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::built_in;
    use crate::scene::source::open_built_in;
    use crate::trace::Intersector;

    /// dN on the ring's smooth wall and on a sphere against finite differences of the traced normal.
    #[test]
    fn normal_differential_matches_traced_neighbours() {
        let cases = [
            ("ring", Vec3::new(0.2, 1.0, 0.3), Vec3::new(0.8f32, -0.75, -0.33)),
            ("glass_ball", Vec3::new(0.5, 2.0, 2.0), Vec3::new(-0.1, -0.52, -0.7)),
        ];
        for (name, origin, direction) in cases {
            let b = built_in::find(name).expect(name);
            let scene = open_built_in(b).expect(name);
            let origin = origin - scene.origin.as_vec3();
            let intersector = Intersector::new(&scene.geometry, scene.radius);
            let at = |d: Vec3| {
                let ray = Ray { origin, direction: d.normalize() };
                let hit = intersector.closest(&ray).expect("hits");
                (ray, hit, Surface::new(&scene, &ray, &hit))
            };
            let (ray, hit, center) = at(direction);
            assert!(center.shading != center.normal || name != "ring", "smooth");
            let h = 5e-3;
            let (t, _) = crate::math::frame::tangents(ray.direction);
            // Neighbours that stay on the same facet, so that the normal is differentiable between them.
            let (_, hit_p, p) = at(ray.direction + t * h * 0.2);
            let (_, hit_m, m) = at(ray.direction - t * h * 0.2);
            if name == "ring" {
                assert!(hit_p.primitive == hit.primitive && hit_m.primitive == hit.primitive);
            }
            let dq = p.position - m.position;
            let dn = center.normal_differential(&scene, [dq, -dq]);
            let finite = p.shading - m.shading;
            assert!((dn[0] - finite).length() < 0.02 * finite.length().max(1e-4), "{name} {:?} {finite:?}", dn[0]);
            assert_eq!(dn[1], -dn[0]);
        }
    }

    /// On a smooth triangle whose normals differ by more than a right angle: the error of dN against central
    /// differences of the traced normal falls as h².
    #[test]
    fn normal_differential_converges_to_second_order_on_a_smooth_triangle() {
        let b = built_in::find("plane").expect("built in");
        let mut scene = open_built_in(b).expect("opens");
        scene.geometry = std::sync::Arc::new(Geometry {
            positions: vec![Vec3::ZERO, Vec3::new(2.0, 0.0, 0.1), Vec3::new(0.3, 0.2, -1.7)],
            normals: [Vec3::new(-0.9, 1.0, 0.3), Vec3::new(1.0, 0.8, 0.2), Vec3::new(0.1, 1.0, -0.9)]
                .map(Vec3::normalize)
                .into(),
            triangles: vec![[0, 1, 2]],
            corner_normals: vec![[0, 1, 2]],
            corner_uvs: vec![[NONE; 3]],
            triangle_materials: vec![0],
            ..Default::default()
        });
        let intersector = Intersector::new(&scene.geometry, scene.radius);
        let at = |x: f32, z: f32| {
            let ray = Ray { origin: Vec3::new(x, 3.0, z), direction: Vec3::NEG_Y };
            let hit = intersector.closest(&ray).expect("hits");
            Surface::new(&scene, &ray, &hit)
        };
        let (x, z) = (0.75, -0.5);
        let error = |h: f32, (dx, dz): (f32, f32)| {
            let (p, m) = (at(x + h * dx, z + h * dz), at(x - h * dx, z - h * dz));
            let dq = (p.position - m.position) / (2.0 * h);
            let dn = at(x, z).normal_differential(&scene, [dq, dq])[0];
            ((p.shading - m.shading) / (2.0 * h) - dn).length()
        };
        for along in [(1.0, 0.0), (0.0, 1.0), (0.6, 0.8)] {
            let order = (error(0.16, along) / error(0.08, along)).log2();
            assert!((1.8..2.2).contains(&order), "{along:?}: order {order}");
            assert!(error(0.02, along) < 2e-3);
        }
    }
}
