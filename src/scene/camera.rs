//! The pinhole camera.

use crate::scene::scene_file::CameraFile;
use glam::{DVec3, Vec3};

/// A pinhole camera.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    /// Eye, local coordinates, metres.
    pub position: Vec3,
    /// Unit vectors to the right, up and forward.
    pub frame: [Vec3; 3],
    /// Tangent of half the vertical field of view.
    pub tan_half_fov_y: f32,
    /// Pixels across and down, as the scene asks.
    pub resolution: [u32; 2],
}

/// A way to move a camera by hand.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Move {
    /// About the target.
    Orbit,
    /// Camera and target together, in the image plane.
    Sideways,
    /// Towards the target.
    Nearer,
}

/// Moves a camera by `x` to the right and `y` down, in heights of the image; whether it moved.
///
/// An orbit by one height is half a turn, and never goes over the poles; the target stays in the middle.
pub fn moved(camera: &mut CameraFile, how: Move, x: f64, y: f64) -> bool {
    let (position, target) = (DVec3::from_array(camera.position), DVec3::from_array(camera.target));
    let up = DVec3::from_array(camera.up.unwrap_or([0.0, 1.0, 0.0])).normalize_or(DVec3::Y);
    let offset = position - target;
    let distance = offset.length();
    let right = up.cross(offset).normalize_or_zero();
    if right == DVec3::ZERO || !distance.is_finite() {
        return false;
    }
    match how {
        Move::Orbit => {
            let height = (up.dot(offset) / distance).clamp(-1.0, 1.0);
            let elevation = libm::asin(height);
            let limit = std::f64::consts::FRAC_PI_2 - 0.01;
            let to =
                (elevation + y * std::f64::consts::PI).clamp(-limit.max(elevation.abs()), limit.max(elevation.abs()));
            let flat = (offset - up * up.dot(offset)).normalize_or_zero();
            let azimuth = -x * std::f64::consts::PI;
            let turned = flat * libm::cos(azimuth) + up.cross(flat) * libm::sin(azimuth);
            camera.position = (target + (turned * libm::cos(to) + up * libm::sin(to)) * distance).to_array();
        }
        Move::Sideways => {
            let height = 2.0 * distance * libm::tan(camera.fov_y.to_radians() / 2.0);
            let image_up = offset.cross(right).normalize_or_zero();
            let by = image_up * (y * height) - right * (x * height);
            camera.position = (position + by).to_array();
            camera.target = (target + by).to_array();
        }
        Move::Nearer => camera.position = (target + offset * libm::exp2(y * 2.0)).to_array(),
    }
    true
}

/// Walks with a camera: by metres to the right, up and forward, then turns it by radians to the right and up about the
/// eye; whether it moved. Forward follows the view, up the camera's own up; it never looks straight up or down.
pub fn walked(camera: &mut CameraFile, [right_by, up_by, forward_by]: [f64; 3], [yaw, pitch]: [f64; 2]) -> bool {
    let (position, target) = (DVec3::from_array(camera.position), DVec3::from_array(camera.target));
    let up = DVec3::from_array(camera.up.unwrap_or([0.0, 1.0, 0.0])).normalize_or(DVec3::Y);
    let view = target - position;
    let (distance, forward) = (view.length(), view.normalize_or_zero());
    let right = forward.cross(up).normalize_or_zero();
    if right == DVec3::ZERO || !distance.is_finite() {
        return false;
    }
    let eye = position + right * right_by + up * up_by + forward * forward_by;
    let elevation = libm::asin(forward.dot(up).clamp(-1.0, 1.0));
    let limit = (std::f64::consts::FRAC_PI_2 - 0.01).max(elevation.abs());
    let (se, ce) = libm::sincos((elevation + pitch).clamp(-limit, limit));
    let flat = up.cross(right).normalize_or_zero();
    let (sy, cy) = libm::sincos(yaw);
    let turned = (flat * cy + right * sy) * ce + up * se;
    let looked = eye + turned * distance;
    if !(eye.is_finite() && looked.is_finite()) {
        return false;
    }
    (camera.position, camera.target) = (eye.to_array(), looked.to_array());
    true
}

#[cfg(test)]
mod tests {
    use super::*;

    fn camera() -> CameraFile {
        CameraFile { position: [0.0, 3.0, 4.0], target: [0.0, 0.0, 0.0], up: None, fov_y: 40.0, resolution: None }
    }

    #[test]
    fn orbits_keep_the_distance_and_stay_off_the_poles() {
        let mut c = camera();
        for (x, y) in [(0.1, 0.0), (0.3, -0.1), (0.0, 5.0), (0.2, -9.0)] {
            assert!(moved(&mut c, Move::Orbit, x, y));
            let p = DVec3::from_array(c.position);
            assert!((p.length() - 5.0).abs() < 1e-9);
            assert!(p.y.abs() < 4.9999, "{p}");
        }
        let mut c = camera();
        moved(&mut c, Move::Orbit, 0.5, 0.0);
        assert!((DVec3::from_array(c.position) - DVec3::new(-4.0, 3.0, 0.0)).length() < 1e-9, "{:?}", c.position);
    }

    /// A move by one height of the image brings what was at its edge beyond the other.
    #[test]
    fn moving_sideways_follows_the_pointer() {
        let mut c = camera();
        moved(&mut c, Move::Sideways, 0.0, 1.0);
        let by = DVec3::from_array(c.target);
        let height = 2.0 * 5.0 * libm::tan(20f64.to_radians());
        assert!((by.length() - height).abs() < 1e-9);
        assert!(by.y > 0.0 && (DVec3::from_array(c.position) - by - DVec3::new(0.0, 3.0, 4.0)).length() < 1e-9);
    }

    /// Forward goes along the view, right turns bring what was at the right into the middle, and the distance stays.
    #[test]
    fn walks_go_where_the_view_goes() {
        let eye = |c: &CameraFile| DVec3::from_array(c.position);
        let view = |c: &CameraFile| (DVec3::from_array(c.target) - eye(c)).normalize();
        let (mut c, start) = (camera(), camera());
        assert!(walked(&mut c, [0.0, 0.0, 2.0], [0.0; 2]));
        assert!(
            (eye(&c) - eye(&start) - view(&start) * 2.0).length() < 1e-9 && (view(&c) - view(&start)).length() < 1e-9
        );
        let right = view(&start).cross(DVec3::Y).normalize();
        let mut c = camera();
        walked(&mut c, [1.0, 0.5, 0.0], [0.0; 2]);
        assert!((eye(&c) - eye(&start) - right - DVec3::Y * 0.5).length() < 1e-9);
        let mut c = camera();
        walked(&mut c, [0.0; 3], [0.3, 0.0]);
        assert!(view(&c).dot(right) > 0.1 && (view(&c).y - view(&start).y).abs() < 1e-9 && eye(&c) == eye(&start));
        walked(&mut c, [0.0; 3], [-0.3, 0.2]);
        assert!(view(&c).y > view(&start).y + 0.1 && view(&c).dot(right).abs() < 1e-9);
        walked(&mut c, [0.0; 3], [0.0, 99.0]);
        assert!(view(&c).y < 1.0 && walked(&mut c, [0.0; 3], [1.0, 0.0]));
        c.target = c.position;
        assert!(!walked(&mut c, [0.0, 0.0, 1.0], [0.0; 2]));
    }

    #[test]
    fn looking_straight_down_does_not_break() {
        let mut c = CameraFile { position: [0.0, 5.0, 0.0], ..camera() };
        assert!(!moved(&mut c, Move::Orbit, 0.1, 0.1));
    }
}
