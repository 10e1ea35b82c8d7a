//! The pinhole camera.

use glam::Vec3;

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
