//! A kd-tree over photon positions: the k nearest within a radius, with the tests applied inside the search.
//!
//! Entries lie in blocks of eight as structures of arrays, the blocks of a leaf one after the other, so that a leaf is a
//! few lines of memory and a block one step of the processor's widest instructions. Those are chosen when the program
//! runs (the crate `pulp`) and round as the others do: what is found does not depend on them.

mod build;
mod nearest;
mod scan;

pub use nearest::Nearest;

use crate::math::lanes::dispatch_in_eights;
use build::{build, node_count};
use glam::Vec3;
use rayon::prelude::*;
use scan::{Search, SearchNearest, SearchOne, SearchWithin};

/// Entries in a leaf, scanned in one go.
const LEAF: usize = 32;

/// Entries in a small leaf.
const SMALL_LEAF: usize = 12;

/// Entries of a block.
const LANES: usize = 8;

#[derive(Clone, Copy, Debug)]
struct Node {
    /// Where the halves meet.
    split: f32,
    /// 0, 1, 2, or [`IS_LEAF`].
    axis: u32,
    /// Inner node: index of the right child, the left one follows the node. Leaf: first block.
    start: u32,
    /// Leaf: entries.
    count: u32,
}

const IS_LEAF: u32 = 3;

/// Eight entries; those that it lacks lie at infinity, where no search finds them.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
struct Block {
    x: [f32; LANES],
    y: [f32; LANES],
    z: [f32; LANES],
    index: [u32; LANES],
}

impl Block {
    const EMPTY: Self =
        Self { x: [f32::INFINITY; LANES], y: [f32::INFINITY; LANES], z: [f32::INFINITY; LANES], index: [0; LANES] };

    fn of(entries: &[(Vec3, u32)]) -> Self {
        let mut block = Self::EMPTY;
        for (lane, (p, index)) in entries.iter().enumerate() {
            (block.x[lane], block.y[lane], block.z[lane]) = (p.x, p.y, p.z);
            block.index[lane] = *index;
        }
        block
    }
}

/// Memory of one entry: its place in a block and in the order, and two nodes for every leaf, which is half full at least.
pub const BYTES_PER_ENTRY: usize = size_of::<Block>() / LANES + size_of::<u32>() + 4 * size_of::<Node>() / LEAF;

/// The same for [`KdTree::with_small_leaves`].
pub const BYTES_PER_ENTRY_OF_SMALL_LEAVES: usize =
    2 * size_of::<Block>() / (LANES + 1) + size_of::<u32>() + 4 * size_of::<Node>() / SMALL_LEAF;

/// Memory of one entry while the tree is built, beside that of the tree: once, and again while wide nodes are cut.
pub const BYTES_PER_BUILT_ENTRY: usize = 2 * size_of::<(Vec3, u32)>();

/// A balanced kd-tree.
#[derive(Clone, Debug, Default)]
pub struct KdTree {
    nodes: Vec<Node>,
    blocks: Vec<Block>,
    /// Indices of the entries, leaf by leaf.
    order: Vec<u32>,
}

/// What to look for.
#[derive(Clone, Copy, Debug)]
pub struct NearestQuery {
    /// Centre, metres.
    pub center: Vec3,
    /// Largest distance, metres; may be infinite.
    pub radius: f32,
    /// How many, at least one.
    pub k: usize,
    /// Unit normal of the slice.
    pub normal: Vec3,
    /// Half-height of the slice about the centre's plane, metres; infinite for the whole sphere.
    pub slice: f32,
}

/// A region about a centre in which photons are looked for, and the distance by which the nearest are chosen in it.
pub trait Volume {
    /// Squared distance of an offset from the centre, metres²; infinite outside of the region whatever its size.
    fn squared(&self, offset: Vec3) -> f32;
    /// Squared radius of a ball that holds all offsets of a squared distance up to `squared`.
    fn reach(&self, squared: f32) -> f32;
}

/// A ball, or the slice of it about a plane through its centre (Kristensen and Ottosen 2003, figure 3.8).
#[derive(Clone, Copy, Debug)]
pub struct Slice {
    /// Unit normal of the plane.
    pub normal: Vec3,
    /// Half-height, metres; infinite for the whole ball.
    pub height: f32,
}

impl Volume for Slice {
    #[inline(always)]
    fn squared(&self, offset: Vec3) -> f32 {
        // Both before the choice, which is one of lanes then. Not over the height: an infinite one holds what is no number too.
        let (squared, off) = (squared(offset), offset.dot(self.normal).abs());
        if off > self.height { f32::INFINITY } else { squared }
    }

    #[inline(always)]
    fn reach(&self, squared: f32) -> f32 {
        squared
    }
}

/// Squared length, its terms summed in order.
#[inline(always)]
fn squared(offset: Vec3) -> f32 {
    offset.x * offset.x + offset.y * offset.y + offset.z * offset.z
}

impl KdTree {
    /// Builds over positions; entry `i` is reported as index `i`. The tree does not depend on the number of threads.
    pub fn new(positions: impl Iterator<Item = Vec3>) -> Self {
        Self::with_leaves(positions, LEAF)
    }

    /// The same with small leaves, for searches that look for one entry or for a few.
    pub fn with_small_leaves(positions: impl Iterator<Item = Vec3>) -> Self {
        Self::with_leaves(positions, SMALL_LEAF)
    }

    /// The same with leaves of `leaf` entries at most, one or more. What a query finds does not depend on it.
    pub fn with_leaves(positions: impl Iterator<Item = Vec3>, leaf: usize) -> Self {
        Self::over(positions.zip(0u32..).collect(), leaf.max(1))
    }

    /// Builds over positions with the indices that they are reported as.
    pub fn of(entries: Vec<(Vec3, u32)>) -> Self {
        Self::over(entries, LEAF)
    }

    fn over(mut entries: Vec<(Vec3, u32)>, leaf: usize) -> Self {
        let count = node_count(entries.len(), leaf);
        let mut nodes = vec![Node { split: 0.0, axis: IS_LEAF, start: 0, count: 0 }; count];
        if !entries.is_empty() {
            build(&mut entries, &mut nodes, 0, 0, leaf);
        }
        let leaves = nodes.iter_mut().filter(|n| n.axis == IS_LEAF);
        let blocks = if leaf.is_multiple_of(LANES) {
            // No leaf but the last has a block that is not full.
            leaves.for_each(|node| node.start /= LANES as u32);
            entries.par_chunks(LANES).map(Block::of).collect()
        } else {
            let mut blocks = Vec::with_capacity(2 * entries.len() / (LANES + 1) + count);
            for node in leaves {
                let own = &entries[node.start as usize..(node.start + node.count) as usize];
                node.start = blocks.len() as u32;
                blocks.extend(own.chunks(LANES).map(Block::of));
            }
            blocks
        };
        Self { nodes, blocks, order: entries.par_iter().map(|(_, index)| *index).collect() }
    }

    /// Fills `found` with the `k` nearest entries in the query's sphere and slice that `accept` takes.
    ///
    /// Where `found` holds what the same tree found for a place nearby, the search starts from there: photons that were
    /// near the one place are not much farther from the other. What is found is the same.
    pub fn nearest(&self, query: &NearestQuery, found: &mut Nearest, accept: impl Fn(u32) -> bool) {
        let volume = Slice { normal: query.normal, height: query.slice };
        let limit = query.radius * query.radius;
        let expected = found.expected(query.center, query.k).filter(|e| *e < limit);
        found.clear();
        self.add_nearest(0, query.center, expected.unwrap_or(limit), query.k, &volume, found, &accept);
        if expected.is_some() && found.len() < query.k {
            found.clear();
            self.add_nearest(0, query.center, limit, query.k, &volume, found, &accept);
        }
        found.remember(query.center, query.k);
    }

    /// Adds to `found` what is among the `k` nearest entries about `center` by the distance of `volume`, up to the squared
    /// distance `limit`, of those that `accept` takes and those that are there already. Entry `i` is put in as `first + i`.
    #[expect(clippy::too_many_arguments, reason = "a query in parts, of which callers have some alone")]
    pub fn add_nearest<V: Volume>(
        &self,
        first: u32,
        center: Vec3,
        limit: f32,
        k: usize,
        volume: &V,
        found: &mut Nearest,
        accept: impl Fn(u32) -> bool,
    ) {
        if self.nodes.is_empty() || k == 0 {
            return;
        }
        found.begin(k, limit);
        let scan = &mut SearchNearest { first, center, volume, found, accept };
        dispatch_in_eights(Search { tree: self, center, scan });
        found.finish();
    }

    /// Indices of the entries in the order in which the tree keeps them: neighbours lie near each other.
    pub fn order(&self) -> &[u32] {
        &self.order
    }

    /// Names each entry by its place in [`KdTree::order`], for whoever has put what they stand for into that order.
    pub fn renumbered(mut self) -> Self {
        let mut place = 0;
        for node in self.nodes.iter().filter(|n| n.axis == IS_LEAF) {
            for i in 0..node.count as usize {
                self.blocks[node.start as usize + i / LANES].index[i % LANES] = place;
                place += 1;
            }
        }
        self.order.iter_mut().zip(0..).for_each(|(index, place)| *index = place);
        self
    }

    /// Calls `visit` with every entry within `radius` of `center` (metres) and its offset from there.
    #[inline]
    pub fn within(&self, center: Vec3, radius: f32, visit: impl FnMut(u32, Vec3)) {
        let scan = &mut SearchWithin { center, limit: (radius * radius).min(f32::MAX), visit };
        dispatch_in_eights(Search { tree: self, center, scan });
    }

    /// The nearest entry within `radius` of `center` (metres) that `accept` takes, and its squared distance; of those at
    /// the same distance the one of lower index.
    #[inline]
    pub fn nearest_one(&self, center: Vec3, radius: f32, accept: impl Fn(u32) -> bool) -> Option<(u32, f32)> {
        let mut scan = SearchOne { center, limit: (radius * radius).min(f32::MAX), best: None, accept };
        dispatch_in_eights(Search { tree: self, center, scan: &mut scan });
        scan.best
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::sequence::{Sampling, Sequence};

    fn brute(points: &[Vec3], q: &NearestQuery, accept: impl Fn(u32) -> bool) -> Vec<(u32, u32)> {
        let mut all: Vec<(u32, u32)> = points
            .iter()
            .zip(0u32..)
            .filter(|(p, i)| {
                let o = **p - q.center;
                o.x * o.x + o.y * o.y + o.z * o.z <= q.radius * q.radius
                    && o.dot(q.normal).abs() <= q.slice
                    && accept(*i)
            })
            .map(|(p, i)| {
                let o = *p - q.center;
                ((o.x * o.x + o.y * o.y + o.z * o.z).to_bits(), i)
            })
            .collect();
        all.sort_unstable();
        all.truncate(q.k);
        all
    }

    #[test]
    fn balls_and_nearest_ones_are_those_of_brute_force() {
        let sequence = Sequence::new(Sampling::Random, 4);
        for n in [0usize, 1, 13, 700] {
            let place = |i: usize| {
                let x = sequence.four(i as u64, 0);
                // On a grid, so that distances are equal now and then.
                Vec3::new((x[0] * 8.0).floor() / 8.0, 0.25, (x[2] * 8.0).floor() / 8.0)
            };
            let points: Vec<Vec3> = (0..n).map(place).collect();
            let tree = KdTree::new(points.iter().copied());
            for q in 0..50u64 {
                let x = sequence.four(q, 1);
                let (center, radius) = (Vec3::new(x[0], x[1] * 0.5, x[2]), [0.1, 0.4, f32::INFINITY][q as usize % 3]);
                let accept = |i: u32| !i.is_multiple_of(3);
                let mut found = Vec::new();
                tree.within(center, radius, |i, d| found.push(((d.x * d.x + d.y * d.y + d.z * d.z).to_bits(), i)));
                found.sort_unstable();
                let query = NearestQuery { center, radius, k: usize::MAX, normal: Vec3::Y, slice: f32::INFINITY };
                assert_eq!(found, brute(&points, &query, |_| true), "{n} points, query {q}");
                let one = tree.nearest_one(center, radius, accept).map(|(i, d)| (d.to_bits(), i));
                assert_eq!(one, brute(&points, &query, accept).first().copied(), "{n} points, query {q}");
            }
        }
    }

    #[test]
    fn finds_what_brute_force_finds() {
        let sequence = Sequence::new(Sampling::Random, 3);
        let clouds: [fn([f32; 4]) -> Vec3; 4] = [
            |x| Vec3::new(x[0], x[1], x[2]),
            |x| Vec3::new(x[0], 0.5, x[2]),
            |x| Vec3::new(0.3, 0.5, (x[2] * 8.0).floor() / 8.0),
            |_| Vec3::splat(0.5),
        ];
        for (c, cloud) in clouds.into_iter().enumerate() {
            for n in [0usize, 1, 2, 13, 1000] {
                let points: Vec<Vec3> = (0..n).map(|i| cloud(sequence.four(i as u64, c as u32))).collect();
                let tree = KdTree::with_leaves(points.iter().copied(), [12, 1, 30][n % 3]);
                let mut found = Nearest::new();
                for q in 0..60u64 {
                    let x = sequence.four(q, 100);
                    let y = sequence.four(q, 101);
                    let query = NearestQuery {
                        center: Vec3::new(x[0], x[1], x[2]),
                        radius: [0.05, 0.3, f32::INFINITY][q as usize % 3],
                        k: [1, 7, 50, 2000][q as usize % 4],
                        normal: crate::math::frame::uniform_sphere(y[0], y[1]),
                        slice: if q % 2 == 0 { f32::INFINITY } else { 0.1 },
                    };
                    let accept = |i: u32| q % 5 != 0 || !i.is_multiple_of(3);
                    tree.nearest(&query, &mut found, accept);
                    let mut got: Vec<(u32, u32)> = found.iter().collect();
                    got.sort_unstable();
                    assert_eq!(got, brute(&points, &query, accept), "cloud {c}, n {n}, query {q}");
                }
            }
        }
    }
}
