//! Pixels that see one plane and nothing else, whose photons can be taken from the whole pixel in every pass.
//!
//! A jittered view ray stands for a cell of its pixel, so that edges are resolved in the end. Where the pixel has no
//! edge, that leaves out most of the photons in the pixel, pass by pass. An estimator that is exact over the view
//! footprint takes the whole pixel there instead.

use crate::photons::map::Query;
use crate::scene::{Camera, Geometry, Material, Scene};
use crate::trace::{Intersector, Ray};
use glam::{DVec2, DVec3, Vec3};
use rayon::prelude::*;

/// Sine of the angle between planes, and distance over the scene's radius, up to which two triangles are one plane.
const COPLANAR: f64 = 1e-5;
/// Depth before the camera, over the scene's radius, at which edges are cut off.
const NEAR: f64 = 1e-6;

/// For each pixel whether it sees one plane and nothing else.
pub struct FlatPixels {
    size: [u32; 2],
    camera: Camera,
    radius: f64,
    /// Plane of each flat pixel, row by row.
    planes: Vec<Option<Plane>>,
}

/// A plane that faces the camera.
#[derive(Clone, Copy, Debug)]
struct Plane {
    normal: DVec3,
    /// Of the plane from the local origin along the normal, metres.
    distance: f64,
}

impl Plane {
    /// That of a diffuse triangle without texture, turned to the camera; None for any other surface.
    fn of(scene: &Scene, primitive: u32) -> Option<Self> {
        let g = &scene.geometry;
        let triangle = primitive as usize;
        // A texture varies inside a pixel, and the mean of a product is no product of means.
        let is_plain = |m: &Material| matches!(m, Material::Diffuse { texture: None, .. });
        if triangle >= g.triangles.len() || !is_plain(&scene.materials[g.material(triangle)]) {
            return None;
        }
        let normal = normal(g, triangle)?;
        let at = g.positions[g.triangles[triangle][0] as usize].as_dvec3();
        let side = if normal.dot(scene.camera.position.as_dvec3() - at) < 0.0 { -1.0 } else { 1.0 };
        Some(Self { normal: normal * side, distance: normal.dot(at) * side })
    }

    fn is_same(&self, other: &Self, radius: f64) -> bool {
        self.normal.cross(other.normal).length() < COPLANAR
            && self.normal.dot(other.normal) > 0.0
            && (self.distance - other.distance).abs() < COPLANAR * radius
    }
}

fn normal(g: &Geometry, triangle: usize) -> Option<DVec3> {
    let [a, b, c] = g.corners(triangle).map(|p| p.as_dvec3());
    (b - a).cross(c - a).try_normalize()
}

impl FlatPixels {
    /// Finds them for images of `size` pixels.
    ///
    /// A pixel is flat if no edge of a triangle is seen through it, but edges inside a plane, no sphere, and if the rays
    /// through its four corners meet the same plane: a line in which two surfaces cross would part the corners.
    pub fn new(scene: &Scene, intersector: &Intersector, size: [u32; 2]) -> Self {
        let mut edges = Edges::new(scene, size);
        outlines(&scene.geometry, f64::from(scene.radius)).for_each(|[p, q]| edges.mark(p, q));
        scene.geometry.spheres.iter().for_each(|s| edges.mark_ball(s.center.as_dvec3(), f64::from(s.radius)));
        let [w, h] = size.map(|n| n as usize);
        let corners: Vec<Option<u32>> = (0..(w + 1) * (h + 1))
            .into_par_iter()
            .with_min_len(1024)
            .map(|i| {
                let (x, y) = (i % (w + 1), i / (w + 1));
                let (direction, _) = scene.camera.ray(x as f32, y as f32, size, 0.5);
                intersector.closest(&Ray { origin: scene.camera.position, direction }).map(|hit| hit.primitive)
            })
            .collect();
        let radius = f64::from(scene.radius);
        let planes = (0..w * h)
            .into_par_iter()
            .with_min_len(1024)
            .map(|i| {
                let at = i / w * (w + 1) + i % w;
                let [first, others @ ..] = [corners[at]?, corners[at + 1]?, corners[at + w + 1]?, corners[at + w + 2]?];
                if edges.marked[i] {
                    return None;
                }
                let plane = Plane::of(scene, first)?;
                let same = |p: &u32| *p == first || Plane::of(scene, *p).is_some_and(|o| plane.is_same(&o, radius));
                others.iter().all(same).then_some(plane)
            })
            .collect();
        Self { size, camera: scene.camera, radius, planes }
    }

    /// Whether it was made for this view.
    pub fn is_of(&self, camera: &Camera, size: [u32; 2]) -> bool {
        self.camera == *camera && self.size == size
    }

    /// Number of flat pixels.
    pub fn count(&self) -> usize {
        self.planes.iter().flatten().count()
    }

    /// The part `low` to `high` of pixel `(x, y)` (in parts of it, from its upper left corner) on its plane, if the
    /// pixel is flat and `hit` lies on that plane. The half-edges are the best fit to what the corners span.
    pub fn part(&self, [x, y]: [u32; 2], low: [f32; 2], high: [f32; 2], hit: &Query) -> Option<Query> {
        let plane = self.planes[(y * self.size[0] + x) as usize]?;
        let away = plane.normal.dot(hit.center.as_dvec3()) - plane.distance;
        if plane.normal.dot(hit.normal.as_dvec3()) < 1.0 - COPLANAR || away.abs() > COPLANAR * self.radius {
            return None;
        }
        let origin = self.camera.position.as_dvec3();
        let height = plane.distance - plane.normal.dot(origin);
        let at = |px: f32, py: f32| {
            let (direction, _) = self.camera.ray(x as f32 + px, y as f32 + py, self.size, 0.5);
            let d = direction.as_dvec3();
            let t = height / plane.normal.dot(d);
            (t > 0.0 && t.is_finite()).then(|| origin + d * t)
        };
        let (a, b) = (at(low[0], low[1])?, at(high[0], low[1])?);
        let (c, d) = (at(low[0], high[1])?, at(high[0], high[1])?);
        let axes = [((b + d) - (a + c)) / 4.0, ((c + d) - (a + b)) / 4.0].map(|v| v.as_vec3());
        Some(Query { center: ((a + b + c + d) / 4.0).as_vec3(), normal: hit.normal, axes })
    }
}

/// Edges of triangles, but those between two triangles of one plane and material.
fn outlines(g: &Geometry, radius: f64) -> impl Iterator<Item = [DVec3; 2]> {
    let key = |p: Vec3| p.to_array().map(f32::to_bits);
    let mut all: Vec<([[u32; 3]; 2], u32)> = (0..g.triangles.len())
        .flat_map(|t| {
            let c = g.corners(t).map(key);
            [[c[0], c[1]], [c[1], c[2]], [c[2], c[0]]].map(|[p, q]| (if p < q { [p, q] } else { [q, p] }, t as u32))
        })
        .collect();
    all.par_sort_unstable();
    let inside = |pair: &[([[u32; 3]; 2], u32)]| {
        let [(_, s), (_, t)] = pair else { return false };
        let (s, t) = (*s as usize, *t as usize);
        let (Some(m), Some(n)) = (normal(g, s), normal(g, t)) else { return false };
        let at = |t: usize| g.corners(t)[0].as_dvec3();
        let plane = |n: DVec3, t: usize| Plane { normal: n, distance: n.dot(at(t)) };
        g.material(s) == g.material(t) && plane(m, s).is_same(&plane(n, t), radius)
    };
    let outer: Vec<[DVec3; 2]> = all
        .chunk_by(|a, b| a.0 == b.0)
        .filter(|group| !inside(group))
        .map(|group| group[0].0.map(|p| Vec3::from_array(p.map(f32::from_bits)).as_dvec3()))
        .collect();
    outer.into_iter()
}

/// Pixels through which something is seen that is not a plane.
struct Edges {
    size: [u32; 2],
    /// From local coordinates to right, down (both in pixels over depth) and depth.
    rows: [DVec3; 3],
    eye: DVec3,
    middle: DVec2,
    near: f64,
    marked: Vec<bool>,
}

impl Edges {
    fn new(scene: &Scene, size: [u32; 2]) -> Self {
        let [right, up, forward] = scene.camera.frame.map(|v| v.as_dvec3());
        let [w, h] = size.map(f64::from);
        let scale = h / (2.0 * f64::from(scene.camera.tan_half_fov_y));
        Self {
            size,
            rows: [right * scale, up * -scale, forward],
            eye: scene.camera.position.as_dvec3(),
            middle: DVec2::new(w / 2.0, h / 2.0),
            near: NEAR * f64::from(scene.radius),
            marked: vec![false; size[0] as usize * size[1] as usize],
        }
    }

    fn seen(&self, p: DVec3) -> DVec3 {
        let v = p - self.eye;
        DVec3::new(self.rows[0].dot(v), self.rows[1].dot(v), self.rows[2].dot(v))
    }

    /// Marks the pixels that a segment is seen through, and their neighbours.
    fn mark(&mut self, p: DVec3, q: DVec3) {
        let (mut p, mut q) = (self.seen(p), self.seen(q));
        if p.z > q.z {
            std::mem::swap(&mut p, &mut q);
        }
        if q.z <= self.near {
            return;
        }
        if p.z < self.near {
            p += (q - p) * ((self.near - p.z) / (q.z - p.z));
        }
        let flat = |v: DVec3| self.middle + DVec2::new(v.x, v.y) / v.z;
        let Some([p, q]) = self.cut(flat(p), flat(q)) else { return };
        let d = q - p;
        // Steps of a pixel at most along either axis; the neighbours cover what lies between.
        let steps = d.abs().max_element().ceil().max(1.0);
        for i in 0..=steps as u64 {
            let at = p + d * (i as f64 / steps);
            self.mark_block(at - 1.0, at + 1.0);
        }
    }

    /// The part of a segment near the image (Liang and Barsky 1984).
    fn cut(&self, p: DVec2, q: DVec2) -> Option<[DVec2; 2]> {
        let d = q - p;
        let (low, high) = (DVec2::splat(-2.0), self.middle * 2.0 + 2.0);
        let (mut from, mut to) = (0.0f64, 1.0f64);
        for axis in 0..2 {
            for (toward, room) in [(-d[axis], p[axis] - low[axis]), (d[axis], high[axis] - p[axis])] {
                if toward == 0.0 && room < 0.0 {
                    return None;
                } else if toward < 0.0 {
                    from = from.max(room / toward);
                } else if toward > 0.0 {
                    to = to.min(room / toward);
                }
            }
        }
        (from <= to).then(|| [p + d * from, p + d * to])
    }

    /// Marks a box around where a ball is seen; everything if it reaches beside the camera.
    fn mark_ball(&mut self, center: DVec3, radius: f64) {
        let corners = (0..8).map(|i| {
            let side = |bit: u32| if i & bit == 0 { -radius } else { radius };
            self.seen(center + DVec3::new(side(1), side(2), side(4)))
        });
        let corners: Vec<DVec3> = corners.collect();
        if corners.iter().any(|c| c.z <= self.near) {
            if corners.iter().any(|c| c.z > self.near) {
                self.marked.fill(true);
            }
            return;
        }
        let flat = corners.iter().map(|v| self.middle + DVec2::new(v.x, v.y) / v.z);
        let (low, high) = flat.fold((DVec2::MAX, DVec2::MIN), |(low, high), p| (low.min(p), high.max(p)));
        self.mark_block(low - 1.0, high + 1.0);
    }

    fn mark_block(&mut self, low: DVec2, high: DVec2) {
        let range = |axis: usize| {
            let end = f64::from(self.size[axis]);
            low[axis].floor().clamp(0.0, end) as u32..(high[axis].floor() + 1.0).clamp(0.0, end) as u32
        };
        for y in range(1) {
            for x in range(0) {
                self.marked[(y * self.size[0] + x) as usize] = true;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::sequence::{Sampling, Sequence};
    use crate::scene::open;

    fn of(name: &str, size: [u32; 2]) -> (Scene, Intersector, FlatPixels) {
        let scene = open(name).expect("built in");
        let intersector = Intersector::new(&scene.geometry, scene.radius);
        let flat = FlatPixels::new(&scene, &intersector, size);
        (scene, intersector, flat)
    }

    /// Many rays through each flat pixel meet its plane, in every built-in scene.
    #[test]
    fn a_flat_pixel_sees_its_plane_alone() {
        let size = [40, 36];
        for b in crate::scene::built_in::BUILT_IN {
            let (scene, intersector, flat) = of(b.name, size);
            let sequence = Sequence::new(Sampling::Random, 3);
            for (i, plane) in flat.planes.iter().enumerate() {
                let Some(plane) = plane else { continue };
                for k in 0..40 {
                    let x = sequence.four(k, i as u32);
                    let (px, py) = ((i % 40) as f32 + x[0], (i / 40) as f32 + x[1]);
                    let (direction, _) = scene.camera.ray(px, py, size, 0.5);
                    let hit = intersector.closest(&Ray { origin: scene.camera.position, direction });
                    let hit = hit.map(|h| Plane::of(&scene, h.primitive).expect("a diffuse triangle"));
                    assert!(hit.is_some_and(|h| h.is_same(plane, flat.radius)), "{} pixel {i}", b.name);
                }
            }
        }
    }

    #[test]
    fn most_of_a_floor_is_flat_and_edges_are_not() {
        assert_eq!(of("plane", [40, 36]).2.count(), 40 * 36);
        let size = [256, 256];
        let (scene, _, flat) = of("ring", size);
        assert!(flat.count() > 256 * 256 / 2, "{}", flat.count());
        // The foot of the ring's outer wall.
        for i in 0..20 {
            let phi = f64::from(i) * 0.3;
            let foot = DVec3::new(1.1 * libm::cos(phi), 0.0, 1.1 * libm::sin(phi)) - scene.origin;
            let [x, y] = scene.camera.project(foot.as_vec3(), size).expect("before the camera");
            assert!(flat.planes[y as usize * 256 + x as usize].is_none(), "{phi}");
        }
    }

    /// The whole pixel is what the differential of the ray through its centre spans, up to its curvature.
    #[test]
    fn the_whole_pixel_is_that_of_the_centre_ray() {
        let size = [512, 512];
        let (scene, intersector, flat) = of("ring", size);
        let [x, y] = [300, 290];
        let (direction, d) = scene.camera.ray(x as f32 + 0.5, y as f32 + 0.5, size, 0.5);
        let hit = intersector.closest(&Ray { origin: scene.camera.position, direction }).expect("the floor");
        let center = scene.camera.position + direction * hit.t;
        let d = d.transfer(direction, Vec3::Y, hit.t);
        let query = Query { center, normal: Vec3::Y, axes: d.dp };
        let whole = flat.part([x, y], [0.0; 2], [1.0; 2], &query).expect("flat");
        let size = d.dp[1].length();
        assert!((whole.center - center).length() < 0.01 * size);
        for (a, b) in whole.axes.iter().zip(d.dp) {
            assert!((*a - b).length() < 0.01 * size, "{a} {b}");
        }
        // Its quarters are half as large, and their centres are a half-edge apart.
        let quarter = flat.part([x, y], [0.5, 0.0], [1.0, 0.5], &query).expect("flat");
        assert!((quarter.axes[0] * 2.0 - whole.axes[0]).length() < 0.01 * size);
        let expected = whole.center + (whole.axes[0] - whole.axes[1]) / 2.0;
        assert!((quarter.center - expected).length() < 0.01 * size);
        // A hit off the plane is not its own.
        let above = Query { center: center + Vec3::Y * 0.1, ..query };
        assert!(flat.part([x, y], [0.0; 2], [1.0; 2], &above).is_none());
    }
}
