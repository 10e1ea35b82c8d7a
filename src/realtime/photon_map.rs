//! The photon map over frames (section 5.3): photons of each frame in a store of its own, and trees over all of them.

use crate::photons::kd_tree::{KdTree, Nearest, Volume};
use crate::realtime::photon::Photon;
use crate::realtime::search::{Query, Region};
use crate::realtime::settings::{Partition, RealtimeSettings};
use glam::Vec3;

/// The photons of the last frames, as one map.
#[derive(Default)]
pub struct PhotonMap {
    /// Photons of the frames `f` with `f mod frames` equal to the index, and which frame that is.
    stores: Vec<(Option<u64>, Vec<Photon>)>,
    /// All photons, those of a tree together and in its order.
    photons: Vec<Photon>,
    trees: Vec<Tree>,
    partition: Option<Partition>,
}

/// Some of the photons with a tree over them.
struct Tree {
    /// First of its photons.
    first: u32,
    tree: KdTree,
    /// What they have in common: a direction of the normal, or a cell.
    class: u32,
    /// Corners of their box, metres.
    bounds: (Vec3, Vec3),
}

/// Cell of visibility of a place.
pub type CellOf<'a> = &'a (dyn Fn(Vec3) -> u32 + Sync);

impl PhotonMap {
    /// A map without photons over `frames` frames.
    pub fn new(frames: u32) -> Self {
        Self { stores: (0..frames.max(1)).map(|_| (None, Vec::new())).collect(), ..Self::default() }
    }

    /// Puts the photons of a frame in the place of those of `frames` frames ago, and gives back the old store, empty.
    pub fn store(&mut self, frame: u64, photons: Vec<Photon>) -> Vec<Photon> {
        let at = (frame % self.stores.len() as u64) as usize;
        let (_, mut old) = std::mem::replace(&mut self.stores[at], (Some(frame), photons));
        old.clear();
        old
    }

    /// Frames whose photons are in it, oldest first.
    pub fn frames(&self) -> Vec<u64> {
        let mut all: Vec<u64> = self.stores.iter().filter_map(|s| s.0).collect();
        all.sort_unstable();
        all
    }

    /// Photons of a frame, in the order in which they were stored; none if the frame has left the map.
    pub fn of_frame(&self, frame: u64) -> &[Photon] {
        self.stores.iter().find(|s| s.0 == Some(frame)).map_or(&[], |s| &s.1)
    }

    /// All photons of the balanced map. Indices of queries are into this list.
    pub fn photons(&self) -> &[Photon] {
        &self.photons
    }

    /// By what the powers of photons are divided: the number of frames in the map.
    pub fn frame_count(&self) -> usize {
        self.stores.iter().filter(|s| s.0.is_some()).count()
    }

    /// Builds the trees over all photons. `cell` is asked for a partition by cells.
    pub fn balance(&mut self, settings: &RealtimeSettings, cell: Option<CellOf>) {
        let leaf = settings.stop_recursion_size as usize;
        let all = self.stores.iter().flat_map(|s| s.1.iter());
        let mut classes: Vec<(u32, Vec<Photon>)> = Vec::new();
        match settings.partition {
            Partition::None => classes.push((0, all.copied().collect())),
            by => {
                let mut place = std::collections::HashMap::new();
                for p in all {
                    let class = match (by, cell) {
                        (Partition::Normal, _) => normal_class(p.normal),
                        // A little before the surface, which may lie in the plane between two cells.
                        (_, Some(cell)) => cell(p.position + p.normal * settings.max_search_radius * BEFORE),
                        (_, None) => 0,
                    };
                    let at = *place.entry(class).or_insert_with(|| {
                        classes.push((class, Vec::new()));
                        classes.len() - 1
                    });
                    classes[at].1.push(*p);
                }
                classes.sort_unstable_by_key(|c| c.0);
            }
        }
        self.photons.clear();
        self.trees.clear();
        self.partition = Some(settings.partition);
        for (class, photons) in classes {
            let tree = KdTree::with_leaves(photons.iter().map(|p| p.position), leaf);
            let first = self.photons.len() as u32;
            self.photons.extend(tree.order().iter().map(|&i| photons[i as usize]));
            let bounds = photons.iter().fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(low, high), p| {
                (low.min(p.position), high.max(p.position))
            });
            self.trees.push(Tree { first, tree: tree.renumbered(), class, bounds });
        }
    }

    /// Fills `found` with the nearest photons of a query, by index.
    ///
    /// A partition by normal leaves out those of other walls; a partition by cells looks into all cells that the query
    /// reaches, and finds what one map finds.
    pub fn nearest(&self, query: &Query, found: &mut Nearest) {
        found.clear();
        match &query.region {
            Region::Slice(v) => self.nearest_in(query, v, found),
            Region::Cylinder(v) => self.nearest_in(query, v, found),
            Region::Ellipsoid(v) => self.nearest_in(query, v, found),
        }
    }

    #[inline]
    fn nearest_in(&self, query: &Query, volume: &impl Volume, found: &mut Nearest) {
        let limit = (query.radius * query.radius).min(f32::MAX);
        let wanted = (self.partition == Some(Partition::Normal)).then(|| normal_class(query.normal));
        for t in &self.trees {
            if wanted.is_some_and(|c| c != t.class) {
                continue;
            }
            if self.trees.len() > 1 {
                let away = (t.bounds.0 - query.position).max(query.position - t.bounds.1).max(Vec3::ZERO);
                if away.length_squared() > volume.reach(limit) {
                    continue;
                }
            }
            let photons = &self.photons[t.first as usize..];
            t.tree.add_nearest(t.first, query.position, limit, query.count, volume, found, |i| {
                query.takes(&photons[i as usize])
            });
        }
    }

    /// Radius about the centre of the photons' box that holds them all, metres; 0 without any.
    pub fn radius(&self) -> f32 {
        let (low, high) = self
            .trees
            .iter()
            .fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(l, h), t| (l.min(t.bounds.0), h.max(t.bounds.1)));
        if low.x > high.x {
            return 0.0;
        }
        let center = low.midpoint(high);
        self.photons.iter().map(|p| p.position.distance_squared(center)).fold(0.0, f32::max).sqrt()
    }
}

/// Part of the search radius by which a photon is moved off its wall before its cell is looked up.
const BEFORE: f32 = 1e-3;

/// Which of six axes a normal is nearest to.
pub fn normal_class(n: Vec3) -> u32 {
    let a = n.abs();
    let axis = if a.x >= a.y && a.x >= a.z {
        0
    } else if a.y >= a.z {
        1
    } else {
        2
    };
    2 * axis + u32::from(n[axis as usize] < 0.0)
}
