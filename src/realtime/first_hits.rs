//! First hits of all view rays of a pinhole: rays of one origin, whose edge functions are the same for whole tiles.
//!
//! Each triangle gets its three edge functions about the eye once a picture; a ray then takes a few products for each
//! triangle of its tile, nearest first. Like the test of a single ray (Woop, Benthin and Wald 2013) it is in f64, and an
//! edge that two triangles share has one function, so that no ray passes between them.

use crate::scene::{Camera, Geometry};
use crate::trace::sphere::sphere;
use crate::trace::{Hit, Ray};
use glam::DVec3;
use rayon::prelude::*;

/// Pixels across and down a tile.
const TILE: u32 = 8;

/// A surface that some view ray may meet.
struct Candidate {
    primitive: u32,
    /// Least distance along the axis of view, metres: no ray meets it before.
    nearest: f32,
    /// Pixels that may show it, as left, top, right and bottom.
    rect: [u32; 4],
    /// Edge functions of a triangle, as vectors whose product with a direction they are; zero for a sphere.
    edges: [DVec3; 3],
    /// Distances of its corners along the axis of view.
    depths: DVec3,
}

/// What is looked at, and from where.
#[derive(Clone, Copy)]
pub struct Seen<'a> {
    /// Surfaces, where they are.
    pub geometry: &'a Geometry,
    /// Indices of those that count.
    pub primitives: &'a [u32],
    /// The eye.
    pub camera: &'a Camera,
    /// Pixels across and down.
    pub size: [u32; 2],
    /// Whether the backs of triangles are looked through.
    pub front_only: bool,
}

/// First hits of the view rays of a camera through an image.
#[derive(Default)]
pub struct FirstHits {
    candidates: Vec<Candidate>,
    /// Candidates of each tile, the nearest first.
    tiles: Vec<Vec<u32>>,
}

/// The eye's own frame, and the image.
struct Pinhole {
    eye: DVec3,
    right: DVec3,
    up: DVec3,
    forward: DVec3,
    /// Pixels for a tangent of 1.
    scale: f64,
    size: [u32; 2],
}

impl FirstHits {
    /// What each pixel's ray through its centre meets first, row by row: `make` gets the ray and the hit.
    pub fn each_pixel<T: Send + Clone + Default>(
        &mut self,
        seen: &Seen,
        out: &mut Vec<T>,
        make: impl Fn(&Ray, Option<Hit>) -> T + Sync,
    ) {
        let &Seen { geometry, primitives, camera, size, front_only } = seen;
        let pinhole = Pinhole {
            eye: camera.position.as_dvec3(),
            right: camera.frame[0].as_dvec3(),
            up: camera.frame[1].as_dvec3(),
            forward: camera.frame[2].as_dvec3(),
            scale: f64::from(size[1]) / (2.0 * f64::from(camera.tan_half_fov_y)),
            size,
        };
        self.candidates.clear();
        self.candidates.extend(primitives.iter().filter_map(|&p| pinhole.candidate(geometry, p, front_only)));
        self.candidates.sort_unstable_by(|a, b| a.nearest.total_cmp(&b.nearest).then(a.primitive.cmp(&b.primitive)));
        let across = size[0].div_ceil(TILE);
        let tiles = (across * size[1].div_ceil(TILE)) as usize;
        self.tiles.iter_mut().for_each(Vec::clear);
        self.tiles.resize_with(tiles.max(self.tiles.len()), Vec::new);
        for (i, c) in self.candidates.iter().enumerate() {
            let [left, top, right, bottom] = c.rect;
            for y in top / TILE..bottom.div_ceil(TILE) {
                for x in left / TILE..right.div_ceil(TILE) {
                    self.tiles[(y * across + x) as usize].push(i as u32);
                }
            }
        }
        let rays = camera.rays(size);
        let width = size[0].max(1) as usize;
        out.clear();
        out.resize(width * size[1] as usize, T::default());
        let this = &*self;
        out.par_chunks_mut(width * TILE as usize).enumerate().for_each(|(band, rows)| {
            for (i, slot) in rows.iter_mut().enumerate() {
                let (x, y) = ((i % width) as u32, (band * TILE as usize + i / width) as u32);
                let (direction, _) = rays.ray(x as f32 + 0.5, y as f32 + 0.5, 0.5);
                let ray = Ray { origin: camera.position, direction };
                let tile = &this.tiles[((y / TILE) * across + x / TILE) as usize];
                *slot = make(&ray, this.first(geometry, tile, &ray, pinhole.forward));
            }
        });
    }

    #[inline]
    fn first(&self, geometry: &Geometry, tile: &[u32], ray: &Ray, forward: DVec3) -> Option<Hit> {
        let v = ray.direction.as_dvec3();
        // Distances along the axis of view, at a direction of which 1 goes along it.
        let along = v.dot(forward);
        let mut best: Option<Hit> = None;
        let mut depth = f64::INFINITY;
        for &i in tile {
            let c = &self.candidates[i as usize];
            if f64::from(c.nearest) > depth {
                break;
            }
            if c.edges[0] == DVec3::ZERO {
                let Some(s) = geometry.spheres.get((c.primitive as usize).wrapping_sub(geometry.triangles.len()))
                else {
                    continue;
                };
                if let Some(t) = sphere(ray, s.center, s.radius, f32::INFINITY) {
                    let d = f64::from(t) * along;
                    if d < depth || d == depth && best.is_some_and(|b| c.primitive < b.primitive) {
                        (depth, best) = (d, Some(Hit { t, primitive: c.primitive, weights: [0.0; 2] }));
                    }
                }
                continue;
            }
            let (a, b, w) = (c.edges[0].dot(v), c.edges[1].dot(v), c.edges[2].dot(v));
            if a.min(b).min(w) < 0.0 && a.max(b).max(w) > 0.0 {
                continue;
            }
            let det = a + b + w;
            if det == 0.0 {
                continue;
            }
            let d = (a * c.depths.x + b * c.depths.y + w * c.depths.z) / det;
            if d > 0.0 && (d < depth || d == depth && best.is_some_and(|x| c.primitive < x.primitive)) {
                let weights = [(b / det) as f32, (w / det) as f32];
                (depth, best) = (d, Some(Hit { t: (d / along) as f32, primitive: c.primitive, weights }));
            }
        }
        best
    }
}

impl Pinhole {
    /// What rays need to know of a surface; None if none can meet it.
    fn candidate(&self, g: &Geometry, primitive: u32, front_only: bool) -> Option<Candidate> {
        let index = primitive as usize;
        if let Some(s) = g.spheres.get(index.wrapping_sub(g.triangles.len())) {
            return self.sphere(s.center.as_dvec3() - self.eye, f64::from(s.radius), primitive);
        }
        let corners = g.corners(index).map(|p| p.as_dvec3() - self.eye);
        let [a, b, c] = corners;
        let edges = [b.cross(c), c.cross(a), a.cross(b)];
        // The eye is behind the triangle's plane, or in it.
        if front_only && edges[0].dot(a) >= 0.0 {
            return None;
        }
        let depths = corners.map(|p| p.dot(self.forward));
        let far = depths.iter().fold(f64::NEG_INFINITY, |m, d| m.max(*d));
        let near = depths.iter().fold(f64::INFINITY, |m, d| m.min(*d));
        if far <= 0.0 || edges[0] == DVec3::ZERO {
            return None;
        }
        let mut bounds = Bounds::new();
        // What lies before the eye, cut off a little before it.
        let cut = far * NEAR;
        for i in 0..3 {
            let (p, q, dp, dq) = (corners[i], corners[(i + 1) % 3], depths[i], depths[(i + 1) % 3]);
            if dp >= cut {
                bounds.add(self.project(p, dp));
            }
            if (dp >= cut) != (dq >= cut) {
                let at = p.lerp(q, (cut - dp) / (dq - dp));
                bounds.add(self.project(at, cut));
            }
        }
        let rect = bounds.pixels(self.size)?;
        let nearest = below(near.max(0.0));
        Some(Candidate { primitive, nearest, rect, edges, depths: DVec3::from_array(depths) })
    }

    fn sphere(&self, center: DVec3, radius: f64, primitive: u32) -> Option<Candidate> {
        let depth = center.dot(self.forward);
        if depth + radius <= 0.0 {
            return None;
        }
        let mut bounds = Bounds::new();
        if depth - radius > NEAR * (depth + radius) {
            // The box around it, whose corners may lie a little nearer than it.
            for corner in 0..8 {
                let side = |bit: u32| if corner >> bit & 1 == 0 { -radius } else { radius };
                let p = center + self.right * side(0) + self.up * side(1) + self.forward * side(2);
                bounds.add(self.project(p, depth + side(2)));
            }
        } else {
            bounds.add([f64::NEG_INFINITY; 2]);
            bounds.add([f64::INFINITY; 2]);
        }
        Some(Candidate {
            primitive,
            nearest: below((depth - radius).max(0.0)),
            rect: bounds.pixels(self.size)?,
            edges: [DVec3::ZERO; 3],
            depths: DVec3::ZERO,
        })
    }

    fn project(&self, p: DVec3, depth: f64) -> [f64; 2] {
        let [w, h] = self.size.map(f64::from);
        [w / 2.0 + p.dot(self.right) / depth * self.scale, h / 2.0 - p.dot(self.up) / depth * self.scale]
    }
}

/// Part of a triangle's farthest distance before which it is cut off for its outline in the image alone.
const NEAR: f64 = 1e-6;

/// A number in 32 bits that is not above.
fn below(x: f64) -> f32 {
    (x * (1.0 - 1e-6)) as f32
}

struct Bounds {
    low: [f64; 2],
    high: [f64; 2],
}

impl Bounds {
    fn new() -> Self {
        Self { low: [f64::INFINITY; 2], high: [f64::NEG_INFINITY; 2] }
    }

    fn add(&mut self, p: [f64; 2]) {
        for (axis, x) in p.into_iter().enumerate() {
            self.low[axis] = self.low[axis].min(x);
            self.high[axis] = self.high[axis].max(x);
        }
    }

    /// Pixels whose centres may lie inside, one more on each side for rounding.
    fn pixels(&self, size: [u32; 2]) -> Option<[u32; 4]> {
        let inside = |x: f64, axis: usize| x.clamp(0.0, f64::from(size[axis])) as u32;
        let rect = [
            inside(self.low[0] - 1.0, 0),
            inside(self.low[1] - 1.0, 1),
            inside(self.high[0] + 2.0, 0),
            inside(self.high[1] + 2.0, 1),
        ];
        (rect[0] < rect[2] && rect[1] < rect[3]).then_some(rect)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::realtime::settings::Moving;
    use crate::realtime::world::World;
    use crate::scene::open;
    use glam::Vec3;

    /// Every pixel of the built-in scenes, from outside, within and close to a wall, meets what a single ray meets.
    #[test]
    fn pixels_meet_what_single_rays_meet() {
        let size = [57, 43];
        for name in ["rooms", "cornell", "glass_ball", "ring", "prism_wall"] {
            let scene = open(name).expect("built in");
            let world = World::new(&scene, Moving::Rebuild, true);
            let all: Vec<u32> = (0..scene.geometry.primitive_count() as u32).collect();
            let mut cameras = vec![scene.camera];
            for (at, towards) in [
                (Vec3::new(0.1, 0.05, 0.2), Vec3::X),
                (Vec3::new(-0.2, 0.31, 0.1), Vec3::new(0.3, -0.8, 0.4)),
                (Vec3::new(0.4, -0.2, 0.3), Vec3::new(-0.2, 0.1, -1.0)),
            ] {
                let forward = towards.normalize();
                let right = forward.cross(Vec3::Y).normalize();
                let frame = [right, right.cross(forward), forward];
                cameras.push(Camera { position: at * scene.radius, frame, tan_half_fov_y: 0.9, resolution: size });
            }
            for camera in cameras {
                let mut found = Vec::new();
                let geometry = world.moved_geometry().unwrap_or(&scene.geometry);
                let seen = Seen { geometry, primitives: &all, camera: &camera, size, front_only: false };
                FirstHits::default().each_pixel(&seen, &mut found, |r, h| Some((*r, h)));
                let mut other = 0;
                for (ray, hit) in found.into_iter().flatten() {
                    let single = world.closest(&scene, &ray).map(|w| w.hit);
                    match (hit, single) {
                        (Some(a), Some(b)) => {
                            assert!((a.t - b.t).abs() <= 2e-5 * b.t.max(0.01 * scene.radius), "{name} {a:?} {b:?}");
                            // On an edge one triangle is as good as the other.
                            other += usize::from(a.primitive != b.primitive);
                        }
                        (None, None) => {}
                        _ => panic!("{name} {hit:?} {single:?} {ray:?}"),
                    }
                }
                assert!(other < 10, "{name} {other}");
            }
        }
    }

    #[test]
    fn backs_are_left_out_if_asked() {
        let scene = open("rooms").expect("built in");
        let all: Vec<u32> = (0..scene.geometry.primitive_count() as u32).collect();
        let camera =
            Camera { position: Vec3::new(0.0, 12.0, 0.1), frame: [Vec3::X, Vec3::NEG_Z, Vec3::NEG_Y], ..scene.camera };
        for front_only in [false, true] {
            let mut heights: Vec<Option<f32>> = Vec::new();
            let seen =
                Seen { geometry: &scene.geometry, primitives: &all, camera: &camera, size: [20, 20], front_only };
            FirstHits::default().each_pixel(&seen, &mut heights, |r, h| h.map(|h| (r.origin + r.direction * h.t).y));
            // The ceiling from above is a back; without it the floor is seen.
            let middle = heights[10 * 20 + 10].expect("a surface");
            assert!((middle > 1.0) != front_only, "{middle}");
        }
    }
}
