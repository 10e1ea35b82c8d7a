//! View rays of a camera, with their differentials.

use crate::scene::Camera;
use crate::trace::Differential;
use glam::{DVec3, Vec3};

impl Camera {
    /// Unit direction through the point `(x, y)` of an image of `size` pixels, `y` down, and its differential
    /// for half-steps of `half` pixels along x and y (Igehy 1999, eq. 8; Pedersen 2011, eq. 20).
    ///
    /// With `half = 0.5` the parallelogram `±dP₀ ± dP₁` at the hit covers one pixel.
    pub fn ray(&self, x: f32, y: f32, size: [u32; 2], half: f32) -> (Vec3, Differential) {
        // f64: across a narrow view directions differ in their last digits, and a wide one cancels at its corners.
        let [right, up, forward] = self.frame.map(|v| v.as_dvec3());
        let [w, h] = size.map(f64::from);
        let step = 2.0 * f64::from(self.tan_half_fov_y) / h;
        let v = forward + right * ((f64::from(x) - w / 2.0) * step) + up * ((h / 2.0 - f64::from(y)) * step);
        let length = v.length();
        let direction = v / length;
        let half = f64::from(half) * step / length;
        let along = |dx: DVec3| (direction.cross(dx).cross(direction) * half).as_vec3();
        let dv = [along(right), along(-up)];
        (direction.as_vec3(), Differential { dp: [Vec3::ZERO; 2], dv })
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
