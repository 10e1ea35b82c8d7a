//! The camera of the tracers: rays through an image, places in it, and which pixels see what.

use crate::measure::Mask;
use crate::scene::{Camera, Material, Scene};
use crate::trace::{Intersector, Ray, Surface};
use glam::DVec3;
use rayon::prelude::*;

/// A pinhole camera with an image of `size` pixels, in 64 bits.
#[derive(Clone, Copy, Debug)]
pub struct Pinhole {
    eye: DVec3,
    right: DVec3,
    up: DVec3,
    forward: DVec3,
    size: [u32; 2],
    /// Width of a pixel at distance 1.
    step: f64,
}

/// A point as the camera sees it.
#[derive(Clone, Copy, Debug)]
pub struct Seen {
    /// Index of the pixel, row by row.
    pub pixel: u32,
    /// Unit vector from the point to the camera.
    pub towards: DVec3,
    /// Distance, metres.
    pub distance: f64,
    /// Radiance of the pixel for an intensity of 1 W/sr from the point: `1/(d² cos³ θ A)`, with θ the angle to the
    /// camera's axis and A the pixel's area at distance 1; 1/m² sr⁻¹.
    pub importance: f64,
}

impl Pinhole {
    /// A scene's camera with an image of `size` pixels.
    pub fn new(camera: &Camera, size: [u32; 2]) -> Self {
        let [right, up, forward] = camera.frame.map(|a| a.as_dvec3());
        let step = 2.0 * f64::from(camera.tan_half_fov_y) / f64::from(size[1]);
        Self { eye: camera.position.as_dvec3(), right, up, forward, size, step }
    }

    /// Pixels across and down.
    pub fn size(&self) -> [u32; 2] {
        self.size
    }

    /// Where it stands.
    pub fn eye(&self) -> DVec3 {
        self.eye
    }

    /// Unit direction through the place `(x, y)` of the image, `y` down.
    pub fn direction(&self, x: f64, y: f64) -> DVec3 {
        let across = (x - f64::from(self.size[0]) / 2.0) * self.step;
        let down = (y - f64::from(self.size[1]) / 2.0) * self.step;
        (self.forward + self.right * across - self.up * down).normalize()
    }

    /// The ray through the place `(x, y)`.
    pub fn ray(&self, x: f64, y: f64) -> Ray {
        Ray { origin: self.eye.as_vec3(), direction: self.direction(x, y).as_vec3() }
    }

    /// How the camera sees a point; None behind it or outside the image.
    pub fn sees(&self, point: DVec3) -> Option<Seen> {
        let to = point - self.eye;
        let depth = to.dot(self.forward);
        if depth <= 0.0 {
            return None;
        }
        let x = f64::from(self.size[0]) / 2.0 + to.dot(self.right) / (depth * self.step);
        let y = f64::from(self.size[1]) / 2.0 - to.dot(self.up) / (depth * self.step);
        let inside = |a: f64, n: u32| a >= 0.0 && a < f64::from(n);
        if !(inside(x, self.size[0]) && inside(y, self.size[1])) {
            return None;
        }
        let distance = to.length();
        let cos = depth / distance;
        let importance = 1.0 / (distance * distance * cos * cos * cos * self.step * self.step);
        let pixel = y as u32 * self.size[0] + x as u32;
        importance.is_finite().then(|| Seen { pixel, towards: -to / distance, distance, importance })
    }
}

/// The pixels of which every ray of a lattice meets a material that `accepts`; None means nothing is met.
///
/// The lattice has a point every half pixel, also on the edges and corners of pixels and half a pixel around them.
/// What is thinner than half a pixel may be missed.
pub fn pixels_that_see(
    scene: &Scene,
    intersector: &Intersector,
    camera: &Pinhole,
    accepts: impl Fn(Option<&Material>) -> bool + Sync,
) -> Mask {
    let [w, h] = camera.size();
    let columns = 2 * w as usize + 3;
    let lattice: Vec<Vec<bool>> = (0..2 * h as usize + 3)
        .into_par_iter()
        .map(|j| {
            let at = |i: usize| (i as f64 - 1.0) / 2.0;
            (0..columns)
                .map(|i| {
                    let ray = camera.ray(at(i), at(j));
                    let surface = intersector.closest(&ray).map(|hit| Surface::new(scene, &ray, &hit));
                    accepts(surface.map(|s| &scene.materials[s.material as usize]))
                })
                .collect()
        })
        .collect();
    let counts = (0..h as usize)
        .flat_map(|y| (0..w as usize).map(move |x| (x, y)))
        .map(|(x, y)| lattice[2 * y..2 * y + 5].iter().all(|row| row[2 * x..2 * x + 5].iter().all(|&b| b)))
        .collect();
    Mask { size: [w, h], counts }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::open;

    #[test]
    fn places_and_rays_are_inverse_and_importance_is_the_solid_angle_of_a_pixel() {
        let scene = open("ring").expect("built in");
        let camera = Pinhole::new(&scene.camera, [64, 48]);
        for (x, y) in [(0.5, 0.5), (11.3, 40.2), (63.2, 20.9)] {
            let d = camera.direction(x, y);
            let seen = camera.sees(camera.eye() + d * 7.0).expect("in the image");
            assert_eq!(seen.pixel, y as u32 * 64 + x as u32);
            assert!((seen.towards + d).length() < 1e-12 && (seen.distance - 7.0).abs() < 1e-12);
            // The solid angle of a pixel about this place, by finite differences: 1/(d² Ω).
            let h = 0.5;
            let across = camera.direction(x + h, y) - camera.direction(x - h, y);
            let down = camera.direction(x, y + h) - camera.direction(x, y - h);
            let omega = across.cross(down).length();
            assert!((seen.importance * 49.0 * omega - 1.0).abs() < 1e-3, "{}", seen.importance * 49.0 * omega);
        }
        assert!(camera.sees(camera.eye() - camera.direction(5.0, 5.0)).is_none());
        assert!(camera.sees(camera.eye() + camera.direction(-0.1, 5.0)).is_none());
        assert!(camera.sees(camera.eye()).is_none());
    }
}
