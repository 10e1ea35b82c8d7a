//! Photons as they are stored.

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

/// The photons of one pass by kind.
#[derive(Clone, Debug, Default)]
pub struct StoredPhotons {
    /// Direct photons.
    pub direct: Vec<Photon>,
    /// Caustic photons.
    pub caustic: Vec<Photon>,
    /// Global photons.
    pub global: Vec<Photon>,
}

impl StoredPhotons {
    /// The list of that kind.
    pub fn of(&self, kind: PhotonKind) -> &[Photon] {
        match kind {
            PhotonKind::Direct => &self.direct,
            PhotonKind::Caustic => &self.caustic,
            PhotonKind::Global => &self.global,
        }
    }

    /// The list of that kind, to be added to.
    pub fn of_mut(&mut self, kind: PhotonKind) -> &mut Vec<Photon> {
        match kind {
            PhotonKind::Direct => &mut self.direct,
            PhotonKind::Caustic => &mut self.caustic,
            PhotonKind::Global => &mut self.global,
        }
    }

    /// Gives back the memory that the lists do not use.
    pub fn shrink(&mut self) {
        PhotonKind::ALL.into_iter().for_each(|kind| self.of_mut(kind).shrink_to_fit());
    }

    /// Moves all of `other` to the end of these.
    pub fn append(&mut self, other: &mut Self) {
        self.direct.append(&mut other.direct);
        self.caustic.append(&mut other.caustic);
        self.global.append(&mut other.global);
    }
}
