//! View rays of a camera, with their differentials.

use crate::scene::Camera;
use crate::trace::Differential;
use glam::{DVec3, Vec3};

/// The view rays of a camera through an image: what all of them share is worked out once.
///
/// f64: across a narrow view directions differ in their last digits, and a wide one cancels at its corners.
#[derive(Clone, Copy, Debug)]
pub struct ViewRays {
    /// Towards the image's upper left corner, at the distance 1 along the axis of view.
    corner: DVec3,
    /// A pixel to the right and a pixel down there.
    steps: [DVec3; 2],
}

impl ViewRays {
    /// Unit direction through the point `(x, y)` of the image, `y` down, and its differential for half-steps of `half`
    /// pixels along x and y (Igehy 1999, eq. 8; Pedersen 2011, eq. 20).
    ///
    /// With `half = 0.5` the parallelogram `±dP₀ ± dP₁` at the hit covers one pixel.
    #[inline]
    pub fn ray(&self, x: f32, y: f32, half: f32) -> (Vec3, Differential) {
        let [right, down] = self.steps;
        let v = self.corner + right * f64::from(x) + down * f64::from(y);
        let per_length = 1.0 / v.length();
        let direction = v * per_length;
        let half = f64::from(half) * per_length;
        let along = |step: DVec3| ((step - direction * direction.dot(step)) * half).as_vec3();
        (direction.as_vec3(), Differential { dp: [Vec3::ZERO; 2], dv: [along(right), along(down)] })
    }
}

impl Camera {
    /// The view rays through an image of `size` pixels.
    pub fn rays(&self, size: [u32; 2]) -> ViewRays {
        let [right, up, forward] = self.frame.map(|v| v.as_dvec3());
        let [w, h] = size.map(f64::from);
        let step = 2.0 * f64::from(self.tan_half_fov_y) / h;
        let corner = forward - right * (w / 2.0 * step) + up * (h / 2.0 * step);
        ViewRays { corner, steps: [right * step, -up * step] }
    }

    /// One ray of [`Camera::rays`].
    pub fn ray(&self, x: f32, y: f32, size: [u32; 2], half: f32) -> (Vec3, Differential) {
        self.rays(size).ray(x, y, half)
    }

    /// Place in an image of `size` pixels where a point is seen, `y` down; None behind the camera.
    ///
    /// The inverse of [`Camera::ray`].
    pub fn project(&self, point: Vec3, size: [u32; 2]) -> Option<[f32; 2]> {
        let [right, up, forward] = self.frame;
        let to = point - self.position;
        let depth = to.dot(forward);
        if depth <= 0.0 {
            return None;
        }
        let step = 2.0 * self.tan_half_fov_y / size[1] as f32;
        let x = size[0] as f32 / 2.0 + to.dot(right) / (depth * step);
        let y = size[1] as f32 / 2.0 - to.dot(up) / (depth * step);
        (x.is_finite() && y.is_finite()).then_some([x, y])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn projection_is_the_inverse_of_the_ray() {
        let camera = Camera {
            position: Vec3::new(1.0, 2.0, 3.0),
            frame: [Vec3::NEG_Z, Vec3::Y, Vec3::NEG_X],
            tan_half_fov_y: 0.4,
            resolution: [64, 48],
        };
        let size = [64, 48];
        for (x, y) in [(0.0, 0.0), (11.3, 40.2), (70.0, -5.0)] {
            let (v, _) = camera.ray(x, y, size, 0.5);
            let [px, py] = camera.project(camera.position + v * 7.0, size).expect("before the camera");
            assert!((px - x).abs() < 1e-3 && (py - y).abs() < 1e-3, "{px} {py}");
            assert!(camera.project(camera.position - v, size).is_none());
        }
    }

    #[test]
    fn differential_is_the_derivative_of_the_direction() {
        let camera = Camera {
            position: Vec3::ZERO,
            frame: [Vec3::X, Vec3::Y, Vec3::NEG_Z],
            tan_half_fov_y: 0.7,
            resolution: [64, 48],
        };
        let size = [64, 48];
        let (_, d) = camera.ray(11.3, 40.2, size, 0.5);
        let h = 0.05;
        for (axis, (dx, dy)) in [(h, 0.0), (0.0, h)].into_iter().enumerate() {
            let (p, _) = camera.ray(11.3 + dx, 40.2 + dy, size, 0.5);
            let (m, _) = camera.ray(11.3 - dx, 40.2 - dy, size, 0.5);
            let finite = (p - m) / (2.0 * h) * 0.5;
            assert!((finite - d.dv[axis]).length() < 1e-3 * d.dv[axis].length(), "{axis}");
        }
    }
}
