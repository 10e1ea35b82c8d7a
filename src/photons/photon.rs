//! Photons as they arrive, and as they are stored.

use crate::math::frame::tangents;
use crate::math::octahedron::Octahedral;
use crate::math::rgb::Rgb;
use glam::Vec3;
use serde::Serialize;

/// What a photon has been through before it was stored.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum PhotonKind {
    /// Straight from the light (LD).
    Direct,
    /// By specular surfaces alone (LS+D).
    Caustic,
    /// Anything else.
    Global,
}

impl PhotonKind {
    /// All kinds, in the order in which maps are gathered from.
    pub const ALL: [Self; 3] = [Self::Direct, Self::Caustic, Self::Global];

    /// `direct`, `caustic` or `global`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Direct => "direct",
            Self::Caustic => "caustic",
            Self::Global => "global",
        }
    }
}

/// A photon differential on a diffuse surface, its footprint at scale 1.
#[derive(Clone, Copy, Debug)]
pub struct Photon {
    /// Where it arrived, metres.
    pub position: Vec3,
    /// Unit direction in which it travelled.
    pub direction: Vec3,
    /// Unit normal of the flat surface, on the side that it arrived at.
    pub normal: Vec3,
    /// Power, W.
    pub power: Rgb,
    /// Footprint `(dα, dβ)`, half-axes in the tangent plane, metres.
    pub footprint: [Vec3; 2],
}

/// A photon in 48 bytes: its directions to 6.5e-5 radians, exact along the axes; its footprint in the tangent plane.
#[derive(Clone, Copy, Debug)]
pub struct StoredPhoton {
    /// Where it arrived, metres.
    pub position: Vec3,
    /// Power, W.
    pub power: Rgb,
    /// `dα` and then `dβ` along the two [`tangents`] of the stored normal, metres.
    footprint: [f32; 4],
    direction: Octahedral,
    normal: Octahedral,
}

impl From<Photon> for StoredPhoton {
    fn from(p: Photon) -> Self {
        let normal = Octahedral::new(p.normal);
        let (t, b) = tangents(normal.direction());
        let [a, c] = p.footprint;
        Self {
            position: p.position,
            power: p.power,
            footprint: [a.dot(t), a.dot(b), c.dot(t), c.dot(b)],
            direction: Octahedral::new(p.direction),
            normal,
        }
    }
}

impl From<StoredPhoton> for Photon {
    fn from(p: StoredPhoton) -> Self {
        let normal = p.normal.direction();
        let (t, b) = tangents(normal);
        let [at, ab, ct, cb] = p.footprint;
        Self {
            position: p.position,
            direction: p.direction.direction(),
            normal,
            power: p.power,
            footprint: [t * at + b * ab, t * ct + b * cb],
        }
    }
}

/// The photons of one pass by kind.
#[derive(Clone, Debug, Default)]
pub struct StoredPhotons {
    /// Direct photons.
    pub direct: Vec<StoredPhoton>,
    /// Caustic photons.
    pub caustic: Vec<StoredPhoton>,
    /// Global photons.
    pub global: Vec<StoredPhoton>,
}

impl StoredPhotons {
    /// The list of that kind.
    pub fn of(&self, kind: PhotonKind) -> &[StoredPhoton] {
        match kind {
            PhotonKind::Direct => &self.direct,
            PhotonKind::Caustic => &self.caustic,
            PhotonKind::Global => &self.global,
        }
    }

    /// The list of that kind, to be added to.
    pub fn of_mut(&mut self, kind: PhotonKind) -> &mut Vec<StoredPhoton> {
        match kind {
            PhotonKind::Direct => &mut self.direct,
            PhotonKind::Caustic => &mut self.caustic,
            PhotonKind::Global => &mut self.global,
        }
    }

    /// Forgets them; the lists keep their memory.
    pub fn clear(&mut self) {
        PhotonKind::ALL.into_iter().for_each(|kind| self.of_mut(kind).clear());
    }

    /// Puts all of `other` at the end of these.
    pub fn append(&mut self, other: &Self) {
        PhotonKind::ALL.into_iter().for_each(|kind| self.of_mut(kind).extend_from_slice(other.of(kind)));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::frame::uniform_sphere;
    use crate::math::sequence::{Sampling, Sequence};

    /// What comes back of many photons, on walls along the axes and of any slope.
    #[test]
    fn a_stored_photon_is_the_same_but_for_its_last_digits() {
        assert_eq!(size_of::<StoredPhoton>(), 48);
        let sequence = Sequence::new(Sampling::Random, 3);
        for i in 0..20_000 {
            let (x, y) = (sequence.four(i, 0), sequence.four(i, 1));
            let axes = [Vec3::X, Vec3::Y, Vec3::Z, Vec3::NEG_X, Vec3::NEG_Y, Vec3::NEG_Z];
            let normal = axes.get(i as usize).copied().unwrap_or(uniform_sphere(x[0], x[1]).normalize());
            let (t, b) = tangents(normal);
            let size = (20.0 * x[2] - 10.0).exp();
            let footprint = [t * size + b * (size * y[2]), b * (size * y[3]) - t * size];
            let direction = uniform_sphere(y[0], y[1]).normalize();
            let photon = Photon { position: direction * size, direction, normal, power: Rgb::splat(size), footprint };
            let back = Photon::from(StoredPhoton::from(photon));
            assert_eq!((back.position, back.power), (photon.position, photon.power));
            assert!(back.normal.is_normalized() && back.direction.is_normalized());
            assert!((back.normal - normal).length() < 6.6e-5 && (back.direction - direction).length() < 6.6e-5);
            for (back, given) in back.footprint.into_iter().zip(footprint) {
                assert!((back - given).length() < 7e-5 * given.length(), "{back} {given}");
            }
            if (i as usize) < axes.len() {
                assert_eq!(back.normal, normal);
                for (back, given) in back.footprint.into_iter().zip(footprint) {
                    assert!((back - given).length() <= 1e-6 * given.length(), "{back} {given}");
                }
            }
        }
    }
}
