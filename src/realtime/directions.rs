//! Directions of photons, made once and used in every round of frames (section 5.2.2).
//!
//! A photon's path is a tree of which every branch has a number: a branch that ends early leaves the directions of its
//! twigs unused, so that what one photon meets never changes the directions of another.

use crate::math::frame::{cosine_hemisphere, tangents};
use crate::math::hash::mix;
use crate::math::sequence::{Sampling, Sequence};
use crate::realtime::distribution::Distribution;
use crate::realtime::settings::{RealtimeSettings, Scattering};
use glam::Vec3;
use rayon::prelude::*;

/// Directions that are kept; what a path asks for beyond is made when it is needed.
const MOST_KEPT: usize = 4_000_000;

/// Seeds of what is drawn: emission, reflections, choices.
const EMIT: u64 = 0xe117;
const REFLECT: u64 = 0x5eed_0000;
const CHOOSE: u64 = 0xc001;

/// The random numbers of all photons of a round of frames.
pub struct Directions {
    seed: u64,
    kind: Distribution,
    children: usize,
    /// For each level of reflection the directions about the z axis, while there is room.
    levels: Vec<Vec<Vec3>>,
}

/// Number of photons into which a reflected one is split.
pub fn children(s: &RealtimeSettings) -> usize {
    match s.scattering {
        Scattering::Splitting => s.diffuse_reflections as usize,
        Scattering::Roulette => 1,
    }
}

impl Directions {
    /// Directions for `photons` emitted photons; kept if the numbers are coherent.
    pub fn new(s: &RealtimeSettings, photons: usize, seed: u64) -> Self {
        let mut all = Self { seed, kind: s.diffuse_distribution, children: children(s), levels: Vec::new() };
        let (mut parents, mut kept) = (photons, 0usize);
        for level in 0..s.recursion_depth {
            let count = parents.saturating_mul(all.children);
            kept = kept.saturating_add(count);
            if !s.coherent || kept > MOST_KEPT {
                break;
            }
            let made: Vec<Vec<Vec3>> = (0..parents).into_par_iter().map(|p| all.make(level, p as u64)).collect();
            all.levels.push(made.concat());
            parents = count;
        }
        all
    }

    /// Directions that are kept.
    pub fn kept(&self) -> usize {
        self.levels.iter().map(Vec::len).sum()
    }

    /// Calls `each` with the number and the unit direction about the unit vector `normal` of every branch of the branch
    /// `parent` of that level.
    pub fn reflections(&self, level: u32, parent: u64, normal: Vec3, mut each: impl FnMut(u64, Vec3)) {
        let (x, y) = tangents(normal);
        let first = parent * self.children as u64;
        let mut give = |d: &[Vec3]| {
            for (i, d) in d.iter().enumerate() {
                each(first + i as u64, (x * d.x + y * d.y + normal * d.z).normalize());
            }
        };
        match self.levels.get(level as usize) {
            Some(kept) => give(&kept[first as usize..first as usize + self.children]),
            None => give(&self.make(level, parent)),
        }
    }

    /// Four numbers for the choices of a branch at one of its specular surfaces, or for its survival.
    pub fn choices(&self, level: u32, branch: u64, surface: u32) -> [f32; 4] {
        Sequence::new(Sampling::Random, mix(self.seed, CHOOSE + (u64::from(level) << 32))).four(branch, surface)
    }

    fn make(&self, level: u32, parent: u64) -> Vec<Vec3> {
        let seed = mix(self.seed, REFLECT + u64::from(level));
        let n = self.children;
        let points = match self.kind {
            // One sequence over all branches of a level, so that one photon's fill what another's leave.
            Distribution::Sobol => {
                let numbers = Sequence::new(Sampling::Sobol, seed);
                (0..n as u64).map(|i| numbers.four(parent * n as u64 + i, 1)).map(|x| [x[0], x[1]]).collect()
            }
            kind => kind.set(n, mix(seed, parent) | 1),
        };
        points.iter().map(|[u, v]| cosine_hemisphere(Vec3::Z, *u, *v)).collect()
    }
}

/// Points in the unit square by which `count` photons of a light are emitted.
pub fn emission(s: &RealtimeSettings, light: usize, count: usize, seed: u64) -> Vec<[f32; 2]> {
    // The first light has the published spiral as it is printed.
    let own = if light == 0 && s.coherent { 0 } else { mix(seed, EMIT + light as u64) };
    match s.light_distribution {
        kind @ (Distribution::SaffKuijlaars | Distribution::Spiral) => kind.set(count, own),
        kind => kind.set(count, mix(seed, EMIT + light as u64)),
    }
}
