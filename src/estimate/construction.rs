//! What an estimator does with one photon, as plain geometry to be drawn or counted.

use glam::Vec3;

/// A point of the view footprint at which the kernel is evaluated.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SamplingPoint {
    /// In the view footprint's plane, metres.
    pub position: Vec3,
    /// Whether it lies inside the photon's ellipsoid, so that the kernel is not zero there.
    pub inside: bool,
}

/// Points and a polygon in world space. What an estimator does not use is empty.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Construction {
    /// Where the kernel is evaluated (Pedersen 2011, figure 14).
    pub points: Vec<SamplingPoint>,
    /// The part of the view footprint that the photon's shape covers, corner by corner, metres.
    pub covered: Vec<Vec3>,
    /// That part's area over the view footprint's, in `[0, 1]`; 0 without such a part.
    pub coverage: f64,
    /// Centroid of that part, where the kernel is evaluated as published (Pedersen 2011, eq. 66), metres; None without it.
    pub centroid: Option<Vec3>,
}

impl Construction {
    /// Points that lie inside the photon.
    pub fn points_inside(&self) -> u32 {
        self.points.iter().filter(|p| p.inside).count() as u32
    }
}
