//! A photon as the map over frames keeps it.

use crate::math::rgb::Rgb;
use glam::Vec3;

/// A stored photon (figure 5.1).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Photon {
    /// Where it arrived, metres.
    pub position: Vec3,
    /// Its power as if its frame had been the only one, W.
    pub power: Rgb,
    /// Unit direction along which it came.
    pub direction: Vec3,
    /// Unit normal of the surface, on the side at which it arrived.
    pub normal: Vec3,
}
