//! The surface at a hit: position, normals, and how the shading normal turns over a footprint.

use crate::math::eights::choose;
use crate::scene::geometry::NONE;
use crate::scene::{Geometry, Scene};
use crate::trace::differential::stored;
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
    /// Whether the corners' normals cancel here, so that the flat normal shades.
    pub without_shading: bool,
    weights: [f32; 2],
}

/// Length of an interpolated normal below which it is the rounding of its corners' unit normals.
const NO_NORMAL: f64 = 4.0 * f32::EPSILON as f64;

impl Surface {
    /// The surface where `ray` meets `hit`.
    pub fn new(scene: &Scene, ray: &Ray, hit: &Hit) -> Self {
        let g = &scene.geometry;
        let index = hit.primitive as usize;
        let mut without_shading = false;
        let (position, outward, shading, uv) = if index < g.triangles.len() {
            let corners = g.corners(index);
            let place = match corner_normals(g, index) {
                Some(normals) => Place::new(corners, normals, true, hit.weights),
                None => Place::new(corners, [Vec3::ZERO; 3], false, hit.weights),
            };
            without_shading = place.without_shading;
            let uv = texture_coordinates(g, index, hit.weights);
            (place.position, place.outward, place.shading, uv)
        } else {
            let s = g.spheres[index - g.triangles.len()];
            let normal = sphere_normal(ray, s.center.as_dvec3(), f64::from(s.radius), f64::from(hit.t));
            let position = s.center.as_dvec3() + normal * f64::from(s.radius);
            (position.as_vec3(), normal, normal, Vec2::ZERO)
        };
        let front = outward.dot(ray.direction.as_dvec3()) < 0.0;
        let side = if front { 1.0 } else { -1.0 };
        Self {
            position,
            normal: (outward * side).as_vec3(),
            shading: (shading * side).as_vec3(),
            front,
            uv,
            primitive: hit.primitive,
            material: g.material(index) as u32,
            without_shading,
            weights: hit.weights,
        }
    }

    /// Change dN of the unit shading normal for changes `dq` of the position in the surface (Igehy 1999, section 3.3).
    ///
    /// Zero on flat triangles, `dq/r` on spheres, the derivative of the interpolated normal on smooth triangles; zero
    /// too where [`Surface::without_shading`]. Always finite for finite `dq`.
    pub fn normal_differential(&self, scene: &Scene, dq: [Vec3; 2]) -> [Vec3; 2] {
        let g = &scene.geometry;
        let index = self.primitive as usize;
        if index >= g.triangles.len() {
            let r = f64::from(g.spheres[index - g.triangles.len()].radius);
            let side = if self.front { 1.0 } else { -1.0 };
            return dq.map(|d| stored(d.as_dvec3() * (side / r)));
        }
        let Some(normals) = corner_normals(g, index) else {
            return [Vec3::ZERO; 2];
        };
        let turns = Turning::new(g.corners(index), normals, self.weights, self.shading);
        if turns.is_defined { dq.map(|d| stored(turns.over(d))) } else { [Vec3::ZERO; 2] }
    }

    /// Start of a ray that leaves the surface along `direction`, a little off it on that side.
    pub fn leave(&self, scene: &Scene, direction: Vec3) -> Vec3 {
        self.beside(scene, direction.dot(self.normal) >= 0.0)
    }

    /// Start of a ray a little off the surface, before it (on the side of its normal) or behind it.
    ///
    /// For a ray that is known to stay on that side, although rounding may have turned it to the other.
    pub fn beside(&self, scene: &Scene, before: bool) -> Vec3 {
        beside(scene, self.position, self.normal, before)
    }
}

/// A place on a triangle. Without a branch, so that many are found at once in lanes.
pub(crate) struct Place {
    /// Position, metres.
    pub position: Vec3,
    /// Unit normal of the flat triangle's front.
    pub outward: DVec3,
    /// Unit shading normal on the same side; the flat one where the triangle is not smooth.
    pub shading: DVec3,
    /// Whether the normals of a smooth triangle's corners cancel here.
    pub without_shading: bool,
}

impl Place {
    /// The place that `weights` name; `normals` count if the triangle is smooth.
    #[inline(always)]
    pub fn new(corners: [Vec3; 3], normals: [Vec3; 3], is_smooth: bool, weights: [f32; 2]) -> Self {
        let ([a, b, c], [wb, wc]) = (corners, weights);
        let outward = flat_normal(corners);
        let sum = interpolated(normals, weights);
        let length = sum.length();
        let without_shading = is_smooth & (length < NO_NORMAL);
        let n = choose(is_smooth & !without_shading, sum * (1.0 / length), outward);
        let shading = choose(n.dot(outward) < 0.0, -n, n);
        Self { position: a + (b - a) * wb + (c - a) * wc, outward, shading, without_shading }
    }
}

/// How the interpolated normal of a smooth triangle turns. Without a branch, as [`Place`].
pub(crate) struct Turning {
    edges: [DVec3; 2],
    /// Changes of the normal along the edges.
    along: [DVec3; 2],
    area2: DVec3,
    scale: f64,
    unit: DVec3,
    per_length: f64,
    /// Whether it has a derivative: the triangle has an area, and its corners' normals do not cancel.
    pub is_defined: bool,
}

impl Turning {
    /// At the place that `weights` name, where `shading` is the shading normal on the side of interest.
    #[inline(always)]
    pub fn new(corners: [Vec3; 3], normals: [Vec3; 3], weights: [f32; 2], shading: Vec3) -> Self {
        let [a, b, c] = [corners[0].as_dvec3(), corners[1].as_dvec3(), corners[2].as_dvec3()];
        let [na, nb, nc] = [normals[0].as_dvec3(), normals[1].as_dvec3(), normals[2].as_dvec3()];
        let edges = [b - a, c - a];
        let area2 = edges[0].cross(edges[1]);
        let scale = area2.length_squared();
        let sum = interpolated(normals, weights);
        let length = sum.length();
        let unit = sum / length;
        let towards = if unit.dot(shading.as_dvec3()) < 0.0 { -1.0 } else { 1.0 };
        let is_defined = (scale > 0.0) & (length >= NO_NORMAL);
        Self { edges, along: [nb - na, nc - na], area2, scale, unit, per_length: towards / length, is_defined }
    }

    /// Change of the unit normal for a change `d` of the position, if [`Self::is_defined`].
    #[inline(always)]
    pub fn over(&self, d: Vec3) -> DVec3 {
        let (d, [e1, e2]) = (d.as_dvec3(), self.edges);
        // Gradients of the weights of the second and third corner.
        let db = d.cross(e2).dot(self.area2) / self.scale;
        let dc = e1.cross(d).dot(self.area2) / self.scale;
        let dn = self.along[0] * db + self.along[1] * dc;
        (dn - self.unit * self.unit.dot(dn)) * self.per_length
    }
}

/// [`Surface::beside`] of a position and a unit normal.
#[inline(always)]
pub(crate) fn beside(scene: &Scene, position: Vec3, normal: Vec3, before: bool) -> Vec3 {
    let offset = scene.radius * SELF_INTERSECTION;
    if before { position + normal * offset } else { position - normal * offset }
}

/// Texture coordinates at a place of a triangle; zero where it has none.
pub fn texture_coordinates(g: &Geometry, triangle: usize, [wb, wc]: [f32; 2]) -> Vec2 {
    match g.corner_uvs[triangle] {
        [i, j, k] if i != NONE => {
            let at = |i: u32| g.uvs[i as usize];
            at(i) * (1.0 - wb - wc) + at(j) * wb + at(k) * wc
        }
        _ => Vec2::ZERO,
    }
}

/// Offset of rays that leave a surface, relative to the scene's radius: some 32 units in the last place.
pub const SELF_INTERSECTION: f32 = 2e-6;

/// Unit normal of a triangle's front; f64 from the corners on, as the edges of a needle are nearly parallel and products
/// of short ones vanish in f32. The y axis for one without area.
#[inline(always)]
pub fn flat_normal(corners: [Vec3; 3]) -> DVec3 {
    let a = corners[0].as_dvec3();
    let n = (corners[1].as_dvec3() - a).cross(corners[2].as_dvec3() - a);
    let per_length = 1.0 / n.length();
    choose((per_length > 0.0) & (per_length < f64::INFINITY), n * per_length, DVec3::Y)
}

/// Unit normal of a sphere where a ray meets it near the distance `t`, whose last digits an f32 does not have.
///
/// They count where the sphere is small against the way to it.
fn sphere_normal(ray: &Ray, center: DVec3, radius: f64, t: f64) -> DVec3 {
    let d = ray.direction.as_dvec3();
    let near = ray.origin.as_dvec3() + d * t - center;
    // One of the two roots of |near + d x|² = r², the one nearer to 0.
    let (a, b, c) = (d.length_squared(), near.dot(d), near.length_squared() - radius * radius);
    let root = (b * b - a * c).max(0.0).sqrt();
    let x = if b > 0.0 { -c / (b + root) } else { c / (root - b) };
    let at = if x.is_finite() { near + d * x } else { near };
    at.try_normalize().unwrap_or(DVec3::Y)
}

/// The normal interpolated between a triangle's corners, of any length.
#[inline(always)]
fn interpolated([na, nb, nc]: [Vec3; 3], weights: [f32; 2]) -> DVec3 {
    let (wb, wc) = (f64::from(weights[0]), f64::from(weights[1]));
    na.as_dvec3() * (1.0 - wb - wc) + nb.as_dvec3() * wb + nc.as_dvec3() * wc
}

/// Normals of a smooth triangle's corners; None for a flat one.
pub(crate) fn corner_normals(g: &Geometry, triangle: usize) -> Option<[Vec3; 3]> {
    let [i, j, k] = g.corner_normals[triangle];
    if i == NONE {
        return None;
    }
    Some([g.normals[i as usize], g.normals[j as usize], g.normals[k as usize]])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::built_in;
    use crate::scene::source::open_built_in;
    use crate::trace::Intersector;

    #[test]
    fn normals_of_needles_and_specks_are_theirs() {
        // A speck whose area vanishes in f32, and a needle whose edges are parallel but for their last digits.
        let tiny = [Vec3::ZERO, Vec3::X * 1e-25, Vec3::Y * 1e-24];
        assert_eq!(flat_normal(tiny), DVec3::Z);
        let needle = [Vec3::ZERO, Vec3::new(1.0, 0.3, 0.7), Vec3::new(1.0, 0.3, 0.700_000_05)];
        let expected = DVec3::new(f64::from(0.3f32), -1.0, 0.0).normalize();
        assert!((flat_normal(needle) - expected).length() < 1e-7);
        assert_eq!(flat_normal([Vec3::ONE; 3]), DVec3::Y);
    }

    /// A sphere of a thousandth of the way to it: the normal is that of the place where the line of the ray meets it.
    #[test]
    fn a_far_small_sphere_keeps_its_normals() {
        let (center, radius) = (DVec3::new(30.0, -20.0, 90.0), 0.01);
        for i in 0..50 {
            let off = DVec3::new(0.003, -0.004, 0.0) * (f64::from(i) / 30.0);
            let ray = Ray { origin: Vec3::ZERO, direction: (center + off).normalize().as_vec3() };
            let d = ray.direction.as_dvec3().normalize();
            let b = d.dot(center);
            let half = (radius * radius - (center - d * b).length_squared()).sqrt();
            let expected = (d * (b - half) - center) / radius;
            let found = sphere_normal(&ray, center, radius, f64::from((b - half) as f32));
            assert!((found - expected).length() < 1e-6, "{i}");
        }
    }

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
