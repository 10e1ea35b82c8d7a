//! The top of the room's box: where figure 1 stands, and what the path tracer finds there.

use crate::cli::failure::Failure;
use crate::cli::paper::gathering::reference::Truth;
use crate::cli::paper::gathering::room::TWO_LIGHTS;
use crate::math::rgb::mean;
use crate::measure::Mask;
use crate::scene::scene_file::CameraFile;
use crate::scene::{Scene, Source};
use glam::{DVec3, Vec2, Vec3};
use std::f64::consts::PI;

/// Pixels across and down of the reference from above.
const SIZE: u32 = 32;
/// Paths for each of them.
const PATHS: u32 = 512;
/// Half of what it shows over half of the top.
const MARGIN: f64 = 1.2;
/// Height of its camera above the top, metres.
const HEIGHT: f64 = 0.6;

/// The top face of the box that stands on the floor, turned.
pub struct TableTop {
    /// The room, seen from above the top.
    pub scene: Scene,
    /// Its middle, local coordinates, metres.
    center: Vec3,
    /// Unit vectors along its edges.
    axes: [Vec3; 2],
    /// Half of its edges, metres.
    half: Vec2,
    /// Reflectance.
    reflectance: DVec3,
}

impl TableTop {
    /// Of the built-in room.
    ///
    /// # Errors
    /// A defect of the binary.
    pub fn new() -> Result<Self, Failure> {
        let source = Source::open(TWO_LIGHTS)?;
        let missing = || Failure::Work(format!("{TWO_LIGHTS}: the box that figure 1 stands on is not there"));
        let shape = source.file.shapes.iter().find(|s| s.kind == "box" && s.rotate.is_some()).ok_or_else(missing)?;
        let (Some(half), Some(turn), Some(at)) = (shape.half_size, &shape.rotate, shape.translate) else {
            return Err(missing());
        };
        let (sin, cos) = libm::sincos(turn.angle.to_radians());
        // It is turned about y.
        let (across, down) = (DVec3::new(cos, 0.0, -sin), DVec3::new(sin, 0.0, cos));
        let top = DVec3::from_array(at) + DVec3::Y * half[1];
        let mut file = source.file.clone();
        let shown = half[0].max(half[2]) * MARGIN;
        file.camera = Some(CameraFile {
            position: (top + DVec3::Y * HEIGHT).to_array(),
            target: top.to_array(),
            up: Some((-down).to_array()),
            fov_y: 2.0 * libm::atan(shown / HEIGHT).to_degrees(),
            resolution: None,
        });
        let scene = source.edited(&file, &source.scene)?;
        let name = shape.material.as_deref().unwrap_or("");
        let material = scene.material_names.iter().position(|n| n == name).ok_or_else(missing)?;
        Ok(Self {
            center: (top - scene.origin).as_vec3(),
            axes: [across.as_vec3(), down.as_vec3()],
            half: Vec2::new(half[0] as f32, half[2] as f32),
            reflectance: scene.materials[material].diffuse_reflectance(Vec2::ZERO).as_dvec3(),
            scene,
        })
    }

    /// Half of its edges, metres.
    pub fn half(&self) -> Vec2 {
        self.half
    }

    /// Coordinates in its plane, metres from its middle.
    pub fn flat(&self, position: Vec3) -> Vec2 {
        let to = position - self.center;
        Vec2::new(to.dot(self.axes[0]), to.dot(self.axes[1]))
    }

    /// The place of such coordinates.
    pub fn place(&self, p: Vec2) -> Vec3 {
        self.center + self.axes[0] * p.x + self.axes[1] * p.y
    }

    /// Whether a place of its plane lies on it.
    pub fn holds(&self, p: Vec2) -> bool {
        p.x.abs() <= self.half.x && p.y.abs() <= self.half.y
    }

    /// Whether a place of the scene lies on it, whose unit normal there is `normal`.
    pub fn has(&self, position: Vec3, normal: Vec3) -> bool {
        normal.y > 0.9 && (position.y - self.center.y).abs() < 1e-3 && self.holds(self.flat(position))
    }
}

/// Irradiance on the top by the path tracer.
pub struct TopTruth {
    truth: Truth,
    /// Half of what a pixel shows, metres.
    pixel: f32,
    shown: f32,
}

impl TopTruth {
    /// Traces it, or goes on from what the cache has.
    ///
    /// # Errors
    /// An interruption.
    pub fn new(top: &TableTop, max_depth: u32, hidden: bool, item: &str) -> Result<Self, Failure> {
        let truth = Truth::new(&top.scene, [SIZE; 2], max_depth, PATHS, hidden, item)?;
        let shown = top.half.max_element() * MARGIN as f32;
        Ok(Self { truth, pixel: shown / SIZE as f32, shown })
    }

    /// What was odd about the cache.
    pub fn warnings(&self) -> &[String] {
        &self.truth.warnings
    }

    /// Where it comes from.
    pub fn source(&self) -> &str {
        &self.truth.reference.source
    }

    fn place(&self, i: usize) -> Vec2 {
        let at = |n: usize| (2.0 * (n as f32 + 0.5) / SIZE as f32 - 1.0) * self.shown;
        Vec2::new(at(i % SIZE as usize), at(i / SIZE as usize))
    }

    /// Mean irradiance over the part of the top in a disc, W/m², and its own noise relative to that; None if no pixel
    /// lies wholly on the top and with its middle in the disc.
    pub fn mean(&self, top: &TableTop, center: Vec2, radius: f32) -> Option<(f64, f64)> {
        let on = top.half - Vec2::splat(self.pixel);
        let inside = |p: Vec2| p.x.abs() <= on.x && p.y.abs() <= on.y && p.distance(center) <= radius;
        let counts: Vec<bool> = (0..(SIZE * SIZE) as usize).map(|i| inside(self.place(i))).collect();
        let mask = Mask { size: [SIZE; 2], counts };
        let image = &self.truth.reference.image;
        let counted = image.pixels.iter().zip(&mask.counts).filter(|(_, c)| **c);
        let (sum, n) = counted.fold((0.0, 0u32), |(sum, n), (p, _)| {
            (sum + (p.as_dvec3() * PI / top.reflectance).element_sum() / 3.0, n + 1)
        });
        let noise = self.truth.reference.relative_noise(&mask)? / f64::from(n.max(1)).sqrt();
        (n > 0).then(|| (sum / f64::from(n), noise))
    }

    /// Irradiance of the pixel at a place, W/m², of those wholly on the top the nearest.
    pub fn at(&self, top: &TableTop, p: Vec2) -> Option<f64> {
        let on = top.half - Vec2::splat(2.0 * self.pixel);
        let p = p.clamp(-on, on);
        let index = |v: f32| ((v / self.shown + 1.0) / 2.0 * SIZE as f32).floor();
        let (x, y) = (index(p.x), index(p.y));
        let inside = (0.0..SIZE as f32).contains(&x) && (0.0..SIZE as f32).contains(&y);
        inside.then(|| {
            let radiance = self.truth.reference.image.at(x as u32, y as u32);
            f64::from(mean(radiance * (std::f32::consts::PI / top.reflectance.as_vec3())))
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::trace::{Intersector, Ray, Surface};

    /// Rays of the camera above meet the top where its coordinates say, and nothing of it beyond its edges.
    #[test]
    fn the_top_is_where_the_camera_sees_it() {
        let top = TableTop::new().expect("built in");
        let intersector = Intersector::new(&top.scene.geometry, top.scene.radius);
        let rays = top.scene.camera.rays([SIZE; 2]);
        let shown = top.half.max_element() * MARGIN as f32;
        for (x, y) in [(16, 16), (5, 16), (16, 28), (27, 25), (1, 16), (30, 30)] {
            let (direction, _) = rays.ray(x as f32 + 0.5, y as f32 + 0.5, 0.5);
            let ray = Ray { origin: top.scene.camera.position, direction };
            let hit = intersector.closest(&ray).expect("a closed room");
            let surface = Surface::new(&top.scene, &ray, &hit);
            let at = |n: u32| (2.0 * (n as f32 + 0.5) / SIZE as f32 - 1.0) * shown;
            let expected = Vec2::new(at(x), at(y));
            assert_eq!(top.has(surface.position, surface.normal), top.holds(expected), "{x} {y}");
            if top.holds(expected) {
                assert!(top.flat(surface.position).distance(expected) < 1e-4, "{x} {y}");
                assert!(top.place(expected).distance(surface.position) < 1e-4);
            }
        }
    }
}
