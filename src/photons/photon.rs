//! Photons as they arrive, and as they are stored.

use crate::math::eights::{Group, LANES, Row, set};
use crate::math::frame::tangents;
use crate::math::octahedron::Octahedral;
use crate::math::rgb::Rgb;
use glam::Vec3;
use pulp::{Arch, Simd, WithSimd};
use rayon::prelude::*;
use serde::Serialize;
use std::ops::Range;

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

/// A photon, stored or not, that a map can be made of.
pub trait Footprinted: Copy + Sync + Into<Photon> {
    /// Where it arrived, metres.
    fn position(&self) -> Vec3;

    /// About the longest semi-axis of its footprint at scale 1, metres: from that to √2 of it.
    fn size(&self) -> f32;

    /// Power, W.
    fn power(&self) -> Rgb;

    /// Footprints (two vectors), normals and directions of a group, as each has them alone.
    fn group(photons: &[Self; LANES]) -> Group<4> {
        let mut group = [[[0.0; LANES]; 3]; 4];
        for (lane, &photon) in photons.iter().enumerate() {
            let Photon { footprint: [a, b], normal, direction, .. } = photon.into();
            for (of, v) in group.iter_mut().zip([a, b, normal, direction]) {
                set(of, lane, v);
            }
        }
        group
    }
}

impl Footprinted for Photon {
    fn position(&self) -> Vec3 {
        self.position
    }

    fn size(&self) -> f32 {
        let [a, b] = self.footprint;
        (a.length_squared() + b.length_squared()).sqrt()
    }

    fn power(&self) -> Rgb {
        self.power
    }
}

impl Footprinted for StoredPhoton {
    fn position(&self) -> Vec3 {
        self.position
    }

    fn size(&self) -> f32 {
        self.footprint.iter().map(|x| x * x).sum::<f32>().sqrt()
    }

    fn power(&self) -> Rgb {
        self.power
    }

    fn group(photons: &[Self; LANES]) -> Group<4> {
        let mut encoded = EncodedGroup::default();
        for (lane, photon) in photons.iter().enumerate() {
            for (row, x) in encoded.footprint.iter_mut().zip(photon.footprint) {
                row[lane] = x;
            }
            for (row, x) in
                encoded.steps.iter_mut().zip([photon.normal.to_steps(), photon.direction.to_steps()].as_flattened())
            {
                row[lane] = *x;
            }
        }
        Arch::new().dispatch(encoded)
    }
}

/// Footprints, and steps of normals and directions, of a group.
#[derive(Default)]
struct EncodedGroup {
    footprint: [Row; 4],
    steps: [Row; 4],
}

impl WithSimd for EncodedGroup {
    type Output = Group<4>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> Group<4> {
        let Self { footprint: [at, ab, ct, cb], steps: [nx, ny, dx, dy] } = self;
        let mut group = [[[0.0; LANES]; 3]; 4];
        for lane in 0..LANES {
            let normal = Octahedral::direction_of_steps([nx[lane], ny[lane]]);
            let [a, b] = decoded(normal, [at[lane], ab[lane], ct[lane], cb[lane]]);
            set(&mut group[0], lane, a);
            set(&mut group[1], lane, b);
            set(&mut group[2], lane, normal);
            set(&mut group[3], lane, Octahedral::direction_of_steps([dx[lane], dy[lane]]));
        }
        group
    }
}

/// Directions and footprint of a photon as they are stored. Without a branch, for many at once in lanes.
#[derive(Clone, Copy, Debug)]
pub(super) struct Encoded {
    /// As [`StoredPhoton`] has it.
    pub footprint: [f32; 4],
    /// Steps on the octahedron.
    pub direction: [f32; 2],
    /// Steps on the octahedron.
    pub normal: [f32; 2],
}

impl Encoded {
    #[inline(always)]
    pub fn new(direction: Vec3, normal: Vec3, [a, c]: [Vec3; 2]) -> Self {
        let normal = Octahedral::steps(normal);
        let (t, b) = tangents(Octahedral::direction_of_steps(normal));
        let footprint = [a.dot(t), a.dot(b), c.dot(t), c.dot(b)];
        Self { footprint, direction: Octahedral::steps(direction), normal }
    }

    #[inline(always)]
    pub fn at(self, position: Vec3, power: Rgb) -> StoredPhoton {
        let (direction, normal) = (Octahedral::of_steps(self.direction), Octahedral::of_steps(self.normal));
        StoredPhoton { position, power, footprint: self.footprint, direction, normal }
    }
}

impl From<Photon> for StoredPhoton {
    fn from(p: Photon) -> Self {
        Encoded::new(p.direction, p.normal, p.footprint).at(p.position, p.power)
    }
}

/// Axes of a footprint from coordinates along the tangents of a normal.
#[inline(always)]
fn decoded(normal: Vec3, [at, ab, ct, cb]: [f32; 4]) -> [Vec3; 2] {
    let (t, b) = tangents(normal);
    [t * at + b * ab, t * ct + b * cb]
}

impl From<StoredPhoton> for Photon {
    fn from(p: StoredPhoton) -> Self {
        let normal = p.normal.direction();
        Self {
            position: p.position,
            direction: p.direction.direction(),
            normal,
            power: p.power,
            footprint: decoded(normal, p.footprint),
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

    /// The photons of several, one after the other.
    pub fn joined(parts: &[&Self]) -> Self {
        let of = |kind| joined(&parts.iter().map(|part| part.of(kind)).collect::<Vec<_>>());
        Self { direct: of(PhotonKind::Direct), caustic: of(PhotonKind::Caustic), global: of(PhotonKind::Global) }
    }
}

/// Lists in one, made on all threads.
fn joined(lists: &[&[StoredPhoton]]) -> Vec<StoredPhoton> {
    let ends: Vec<usize> = lists
        .iter()
        .scan(0, |end, list| {
            *end += list.len();
            Some(*end)
        })
        .collect();
    let of = |at: &mut (Range<usize>, usize), i: usize| {
        if !at.0.contains(&i) {
            let list = ends.partition_point(|end| *end <= i);
            *at = (ends[list] - lists[list].len()..ends[list], list);
        }
        lists[at.1][i - at.0.start]
    };
    (0..ends.last().copied().unwrap_or(0)).into_par_iter().map_init(|| (0..0, 0), of).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::frame::uniform_sphere;
    use crate::math::sequence::{Sampling, Sequence};

    /// Lists of any length, none among them, end up one after the other.
    #[test]
    fn lists_are_joined_in_order() {
        let photon = |i: usize| {
            let position = Vec3::X * i as f32;
            Photon { position, direction: Vec3::X, normal: Vec3::X, power: Rgb::ONE, footprint: [Vec3::ZERO; 2] }.into()
        };
        let all: Vec<StoredPhoton> = (0..30_000).map(photon).collect();
        let cuts = [0, 0, 1, 5, 5, 9_000, 29_999, 30_000, 30_000];
        let lists: Vec<&[StoredPhoton]> = cuts.windows(2).map(|w| &all[w[0]..w[1]]).collect();
        let places = |list: &[StoredPhoton]| list.iter().map(|p| p.position.x).collect::<Vec<_>>();
        assert_eq!(places(&joined(&lists)), places(&all));
        assert!(joined(&[]).is_empty() && joined(&[&[]]).is_empty());
    }

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

    /// A group comes back as each photon of it alone.
    #[test]
    fn a_group_is_each_alone() {
        let sequence = Sequence::new(Sampling::Random, 4);
        for i in 0..2000 {
            let photons: [StoredPhoton; LANES] = std::array::from_fn(|lane| {
                let (x, y) = (sequence.four(i, lane as u32), sequence.four(i, 8 + lane as u32));
                let (normal, direction) =
                    (uniform_sphere(x[0], x[1]).normalize(), uniform_sphere(y[0], y[1]).normalize());
                let footprint = [direction * x[2], normal.cross(direction) * x[3]];
                Photon { position: direction, direction, normal, power: Rgb::ONE, footprint }.into()
            });
            let together = StoredPhoton::group(&photons);
            for (lane, photon) in photons.into_iter().enumerate() {
                let Photon { footprint: [a, b], normal, direction, .. } = photon.into();
                let of = |v: usize| crate::math::eights::vector(&together[v], lane).to_array().map(f32::to_bits);
                assert_eq!(
                    [of(0), of(1), of(2), of(3)],
                    [a, b, normal, direction].map(|v| v.to_array().map(f32::to_bits))
                );
            }
        }
    }
}
