//! All photons of a pass, whatever way they took: the map that final gathering reads.

use crate::math::rgb::Rgb;
use crate::photons::irradiance::agree;
use crate::photons::kd_tree::{KdTree, Nearest, NearestQuery};
use crate::photons::{Photon, PhotonKind, StoredPhoton, StoredPhotons};
use glam::{DVec3, Vec3};
use std::f64::consts::PI;

/// What irradiance needs of a photon.
#[derive(Clone, Copy, Debug)]
pub struct GlobalPhoton {
    /// Where it arrived, metres.
    pub position: Vec3,
    /// Unit normal of the flat surface, on the side that it arrived at.
    pub normal: Vec3,
    /// Power, W.
    pub power: Rgb,
}

/// Photons with a kd-tree, in the tree's order.
#[derive(Default)]
pub struct GlobalPhotons {
    photons: Vec<GlobalPhoton>,
    tree: KdTree,
}

impl GlobalPhotons {
    /// Those of the given kinds.
    pub fn new(stored: &StoredPhotons, kinds: &[PhotonKind]) -> Self {
        let all: Vec<&[StoredPhoton]> = kinds.iter().map(|&kind| stored.of(kind)).collect();
        let each = || all.iter().flat_map(|photons| photons.iter());
        let tree = KdTree::with_small_leaves(each().map(|p| p.position));
        let mut starts = Vec::with_capacity(all.len());
        let mut next = 0;
        for photons in &all {
            starts.push(next);
            next += photons.len();
        }
        let photons = tree
            .order()
            .iter()
            .map(|&i| {
                // The last list that starts at or before the photon.
                let list = starts.partition_point(|&s| s <= i as usize) - 1;
                let p = Photon::from(all[list][i as usize - starts[list]]);
                GlobalPhoton { position: p.position, normal: p.normal, power: p.power }
            })
            .collect();
        Self { photons, tree: tree.renumbered() }
    }

    /// The photons.
    pub fn photons(&self) -> &[GlobalPhoton] {
        &self.photons
    }

    /// Memory that they take, bytes.
    pub fn bytes(&self) -> usize {
        bytes(self.photons.len())
    }

    /// Their tree, which names them by their place in [`GlobalPhotons::photons`].
    pub fn tree(&self) -> &KdTree {
        &self.tree
    }

    /// Power of the photons from one distance (metres) of a place up to another whose surfaces agree with its unit
    /// `normal`, W.
    pub fn power_between(&self, position: Vec3, normal: Vec3, [from, to]: [f32; 2]) -> DVec3 {
        let mut sum = DVec3::ZERO;
        self.tree.within(position, to, |i, offset| {
            let p = &self.photons[i as usize];
            if offset.length_squared() >= from * from && agree(p.normal, normal) {
                sum += p.power.as_dvec3();
            }
        });
        sum
    }

    /// Irradiance at a place of a surface by its `k` nearest photons of surfaces that agree, over the disc that they fill,
    /// W/m² (Jensen 2001).
    ///
    /// They are looked for within `radius` (metres, positive), then within twice as much, and so on until there are `k` or
    /// `farthest` is reached, over whose disc the photons that there are count then. Not below the disc of radius
    /// `smallest`.
    pub fn irradiance(&self, position: Vec3, normal: Vec3, search: &Search, heap: &mut Nearest) -> DVec3 {
        let mut radius = search.radius.max(search.smallest);
        loop {
            let query = NearestQuery { center: position, radius, k: search.k, normal, slice: f32::INFINITY };
            self.tree.nearest(&query, heap, |i| agree(self.photons[i as usize].normal, normal));
            if heap.len() >= search.k || radius >= search.farthest {
                break;
            }
            radius = (radius * 2.0).min(search.farthest);
        }
        let disc = match heap.farthest() {
            Some((bits, _)) if heap.len() >= search.k => f32::from_bits(bits).sqrt(),
            _ => radius,
        };
        let sum: DVec3 = heap.iter().map(|(_, i)| self.photons[i as usize].power.as_dvec3()).sum();
        let disc = f64::from(disc.max(search.smallest));
        sum / (PI * disc * disc)
    }
}

/// How the photons of a density estimate are looked for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Search {
    /// Photons, at least one.
    pub k: usize,
    /// Radius that is looked through first, metres.
    pub radius: f32,
    /// Largest radius, metres.
    pub farthest: f32,
    /// Smallest disc, metres: the resolution of f32 there.
    pub smallest: f32,
}

/// Memory of so many photons, bytes.
pub fn bytes(photons: usize) -> usize {
    photons * (size_of::<GlobalPhoton>() + crate::photons::kd_tree::BYTES_PER_ENTRY_OF_SMALL_LEAVES)
}
