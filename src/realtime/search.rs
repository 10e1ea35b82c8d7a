//! Regions in which the photons of an estimate are looked for (section 3.5.1).

use crate::photons::kd_tree::{Nearest, Slice, Volume};
use crate::realtime::photon::Photon;
use crate::realtime::settings::{RealtimeSettings, Search};
use glam::Vec3;

/// A cylinder about the normal: the nearest by distance from the axis, up to a height along it.
#[derive(Clone, Copy, Debug)]
pub struct Cylinder {
    /// Unit vector of the axis.
    pub normal: Vec3,
    /// Half-height, metres.
    pub height: f32,
}

impl Volume for Cylinder {
    #[inline(always)]
    fn squared(&self, offset: Vec3) -> f32 {
        let along = offset.dot(self.normal);
        let squared = (offset - self.normal * along).length_squared();
        if along.abs() > self.height { f32::INFINITY } else { squared }
    }

    #[inline(always)]
    fn reach(&self, squared: f32) -> f32 {
        // Rounding of the difference above must not lose what lies on the rim.
        (squared + self.height * self.height) * (1.0 + 8.0 * f32::EPSILON)
    }
}

/// An ellipsoid (eq. 3.13) that is flat along the normal.
#[derive(Clone, Copy, Debug)]
pub struct Ellipsoid {
    /// Unit vector of the short axis.
    pub normal: Vec3,
    /// One over the short axis, as a multiple of the long ones; at least 1.
    pub per_height: f32,
}

impl Volume for Ellipsoid {
    #[inline(always)]
    fn squared(&self, offset: Vec3) -> f32 {
        let along = offset.dot(self.normal);
        let stretched = along * self.per_height;
        (offset - self.normal * along).length_squared() + stretched * stretched
    }

    #[inline(always)]
    fn reach(&self, squared: f32) -> f32 {
        squared * (1.0 + 8.0 * f32::EPSILON)
    }
}

/// One of the regions, for a vertex.
#[derive(Clone, Copy, Debug)]
pub enum Region {
    /// A ball or a slice of it.
    Slice(Slice),
    /// A cylinder.
    Cylinder(Cylinder),
    /// An ellipsoid.
    Ellipsoid(Ellipsoid),
}

/// What an estimate looks for.
#[derive(Clone, Copy, Debug)]
pub struct Query {
    /// Where, metres.
    pub position: Vec3,
    /// Unit normal of the surface there, on the side that is looked at.
    pub normal: Vec3,
    /// Largest distance, metres, positive.
    pub radius: f32,
    /// Photons at most.
    pub count: usize,
    /// Region of the search.
    pub region: Region,
    /// Whether photons that arrive from behind are left out.
    pub incoming_direction: bool,
}

impl Query {
    /// The query of these settings with the given radius.
    pub fn new(s: &RealtimeSettings, position: Vec3, normal: Vec3, radius: f32) -> Self {
        let height = s.slice_height * radius;
        let region = match s.search {
            Search::Sphere => {
                Region::Slice(Slice { normal, height: if s.sphere_slice { height } else { f32::INFINITY } })
            }
            Search::Cylinder => Region::Cylinder(Cylinder { normal, height }),
            Search::Ellipsoid => Region::Ellipsoid(Ellipsoid { normal, per_height: 1.0 / s.slice_height }),
        };
        Self {
            position,
            normal,
            radius,
            count: s.max_search_count as usize,
            region,
            incoming_direction: s.incoming_direction,
        }
    }

    /// Whether a photon passes the test of its direction.
    #[inline]
    pub fn takes(&self, photon: &Photon) -> bool {
        !self.incoming_direction || photon.direction.dot(self.normal) < 0.0
    }

    /// Squared distance of a photon as the region measures it, metres²; infinite outside.
    pub fn squared(&self, position: Vec3) -> f32 {
        let offset = position - self.position;
        match &self.region {
            Region::Slice(v) => v.squared(offset),
            Region::Cylinder(v) => v.squared(offset),
            Region::Ellipsoid(v) => v.squared(offset),
        }
    }

    /// The nearest photons by trying every one of them: what a photon map must find.
    pub fn exact(&self, photons: &[Photon]) -> Nearest {
        let limit = (self.radius * self.radius).min(f32::MAX);
        let mut all: Vec<(u32, u32)> = photons
            .iter()
            .zip(0u32..)
            .filter(|(p, _)| self.takes(p))
            .map(|(p, i)| (self.squared(p.position), i))
            .filter(|(d, _)| *d <= limit)
            .map(|(d, i)| (d.to_bits(), i))
            .collect();
        all.sort_unstable();
        all.truncate(self.count);
        all.into_iter().collect()
    }
}
