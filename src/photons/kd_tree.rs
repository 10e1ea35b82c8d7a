//! A kd-tree over photon positions: the k nearest within a radius, with the tests applied inside the search.

use glam::Vec3;
use std::collections::BinaryHeap;

/// Photons in a leaf, scanned in one go.
const LEAF: usize = 12;

#[derive(Clone, Copy, Debug)]
struct Node {
    /// Where the halves meet.
    split: f32,
    /// 0, 1, 2, or [`IS_LEAF`].
    axis: u32,
    /// Inner node: index of the right child, the left one follows the node. Leaf: first entry.
    start: u32,
    /// Leaf: entries.
    count: u32,
}

const IS_LEAF: u32 = 3;

/// Memory of one entry: its place in the tree, and a node for every few of them.
pub const BYTES_PER_ENTRY: usize = 3 * size_of::<f32>() + size_of::<u32>() + 4 * size_of::<Node>() / LEAF;

/// Memory of one entry while the tree is built, beside that of the tree.
pub const BYTES_PER_BUILT_ENTRY: usize = size_of::<(Vec3, u32)>();

/// A balanced kd-tree; entries are kept as structure of arrays in leaf order.
#[derive(Clone, Debug, Default)]
pub struct KdTree {
    nodes: Vec<Node>,
    xs: Vec<f32>,
    ys: Vec<f32>,
    zs: Vec<f32>,
    index: Vec<u32>,
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
    #[inline]
    fn squared(&self, offset: Vec3) -> f32 {
        // Not over the height: an infinite one holds what is no number too.
        if offset.dot(self.normal).abs() > self.height { f32::INFINITY } else { squared(offset) }
    }

    #[inline]
    fn reach(&self, squared: f32) -> f32 {
        squared
    }
}

/// Squared length, its terms summed in order.
#[inline]
fn squared(offset: Vec3) -> f32 {
    offset.x * offset.x + offset.y * offset.y + offset.z * offset.z
}

/// The photons found so far: the farthest on top.
///
/// Distances are squared and kept as the bits of a non-negative f32, whose order is that of the numbers; equal
/// distances are told apart by index, so that the set found does not depend on the order of the search.
pub type Nearest = BinaryHeap<(u32, u32)>;

impl KdTree {
    /// Builds over positions; entry `i` is reported as index `i`. The tree does not depend on the number of threads.
    pub fn new(positions: impl Iterator<Item = Vec3>) -> Self {
        Self::with_leaves(positions, LEAF)
    }

    /// The same with leaves of `leaf` entries at most, one or more. What a query finds does not depend on it.
    pub fn with_leaves(positions: impl Iterator<Item = Vec3>, leaf: usize) -> Self {
        let leaf = leaf.max(1);
        let mut entries: Vec<(Vec3, u32)> = positions.zip(0u32..).collect();
        let count = node_count(entries.len(), leaf);
        let mut nodes = vec![Node { split: 0.0, axis: IS_LEAF, start: 0, count: 0 }; count];
        if !entries.is_empty() {
            build(&mut entries, &mut nodes, 0, 0, leaf);
        }
        Self {
            nodes,
            xs: entries.iter().map(|(p, _)| p.x).collect(),
            ys: entries.iter().map(|(p, _)| p.y).collect(),
            zs: entries.iter().map(|(p, _)| p.z).collect(),
            index: entries.iter().map(|(_, i)| *i).collect(),
        }
    }

    /// Fills `found` with the `k` nearest entries in the query's sphere and slice that `accept` takes.
    pub fn nearest(&self, query: &NearestQuery, found: &mut Nearest, accept: impl Fn(u32) -> bool) {
        let slice = Slice { normal: query.normal, height: query.slice };
        found.clear();
        self.add_nearest(0, query.center, query.radius * query.radius, query.k, &slice, found, accept);
    }

    /// Adds to `found` what is among the `k` nearest entries about `center` by the distance of `volume`, up to the squared
    /// distance `limit`, of those that `accept` takes and those that are there already. Entry `i` is put in as `first + i`.
    #[expect(clippy::too_many_arguments, reason = "a query in parts, of which callers have some alone")]
    pub fn add_nearest(
        &self,
        first: u32,
        center: Vec3,
        limit: f32,
        k: usize,
        volume: &impl Volume,
        found: &mut Nearest,
        accept: impl Fn(u32) -> bool,
    ) {
        if self.nodes.is_empty() || k == 0 {
            return;
        }
        let mut worst = limit.min(f32::MAX);
        if found.len() == k
            && let Some(farthest) = found.peek()
        {
            worst = worst.min(f32::from_bits(farthest.0));
        }
        self.cells(center, volume.reach(worst).min(f32::MAX), |node, _| {
            self.scan(node, first, center, k, volume, &mut worst, found, &accept);
            volume.reach(worst).min(f32::MAX)
        });
    }

    /// Indices of the entries in the order in which the tree keeps them: neighbours lie near each other.
    pub fn order(&self) -> &[u32] {
        &self.index
    }

    /// Names each entry by its place in [`KdTree::order`], for whoever has put what they stand for into that order.
    pub fn renumbered(mut self) -> Self {
        self.index.iter_mut().zip(0..).for_each(|(index, place)| *index = place);
        self
    }

    /// Calls `visit` with every entry within `radius` of `center` (metres) and its offset from there.
    #[inline]
    pub fn within(&self, center: Vec3, radius: f32, mut visit: impl FnMut(u32, Vec3)) {
        let limit = (radius * radius).min(f32::MAX);
        self.cells(center, limit, |node, limit| {
            let range = node.start as usize..(node.start + node.count) as usize;
            let (xs, ys, zs) = (&self.xs[range.clone()], &self.ys[range.clone()], &self.zs[range.clone()]);
            let index = &self.index[range];
            for start in (0..xs.len()).step_by(LEAF) {
                // All distances of a leaf first, for the processor's wide instructions.
                let (mut distances, end) = ([0.0f32; LEAF], (start + LEAF).min(xs.len()));
                for i in start..end {
                    distances[i - start] = squared(Vec3::new(xs[i] - center.x, ys[i] - center.y, zs[i] - center.z));
                }
                for i in start..end {
                    if distances[i - start] <= limit {
                        visit(index[i], Vec3::new(xs[i] - center.x, ys[i] - center.y, zs[i] - center.z));
                    }
                }
            }
            limit
        });
    }

    /// The nearest entry within `radius` of `center` (metres) that `accept` takes, and its squared distance; of those at
    /// the same distance the one of lower index.
    #[inline]
    pub fn nearest_one(&self, center: Vec3, radius: f32, accept: impl Fn(u32) -> bool) -> Option<(u32, f32)> {
        let mut best: Option<(u32, f32)> = None;
        self.cells(center, (radius * radius).min(f32::MAX), |node, limit| {
            let mut limit = limit;
            for i in node.start as usize..(node.start + node.count) as usize {
                let (x, y, z) = (self.xs[i] - center.x, self.ys[i] - center.y, self.zs[i] - center.z);
                let squared = x * x + y * y + z * z;
                let index = self.index[i];
                let nearer = squared < limit || squared == limit && best.is_none_or(|(b, _)| index < b);
                if nearer && accept(index) {
                    best = Some((index, squared));
                    limit = squared;
                }
            }
            limit
        });
        best
    }

    /// Calls `leaf` with the leaves whose cells come within a squared distance, the near ones first; it returns how far
    /// to look from then on.
    #[inline]
    fn cells(&self, center: Vec3, limit: f32, mut leaf: impl FnMut(Node, f32) -> f32) {
        if self.nodes.is_empty() {
            return;
        }
        let center = center.to_array();
        let mut limit = limit;
        let mut stack = [(0u32, 0.0f32, [0.0f32; 3]); 64];
        let mut top = 1;
        while top > 0 {
            top -= 1;
            let (mut at, distance, offset) = stack[top];
            if distance > limit {
                continue;
            }
            loop {
                let node = self.nodes[at as usize];
                if node.axis == IS_LEAF {
                    limit = leaf(node, limit);
                    break;
                }
                let axis = node.axis as usize;
                let d = center[axis] - node.split;
                let (near, far) = if d < 0.0 { (at + 1, node.start) } else { (node.start, at + 1) };
                let beyond = distance - offset[axis] * offset[axis] + d * d;
                if beyond <= limit {
                    let mut far_offset = offset;
                    far_offset[axis] = d;
                    stack[top] = (far, beyond.max(0.0), far_offset);
                    top += 1;
                }
                // The near side keeps the cell's distance; only going across changes it.
                at = near;
            }
        }
    }

    #[inline]
    #[expect(clippy::too_many_arguments, reason = "the state of one query, in the loop that all time goes into")]
    fn scan(
        &self,
        node: Node,
        first: u32,
        center: Vec3,
        k: usize,
        volume: &impl Volume,
        worst: &mut f32,
        found: &mut Nearest,
        accept: &impl Fn(u32) -> bool,
    ) {
        let range = node.start as usize..(node.start + node.count) as usize;
        let (xs, ys, zs) = (&self.xs[range.clone()], &self.ys[range.clone()], &self.zs[range.clone()]);
        for start in (0..xs.len()).step_by(LEAF) {
            let (mut distances, end) = ([0.0f32; LEAF], (start + LEAF).min(xs.len()));
            for i in start..end {
                distances[i - start] = volume.squared(Vec3::new(xs[i] - center.x, ys[i] - center.y, zs[i] - center.z));
            }
            for i in start..end {
                // What is no number is not near.
                let near = distances[i - start] <= *worst;
                let index = self.index[range.start + i];
                if !(near && accept(index)) {
                    continue;
                }
                let entry = (distances[i - start].to_bits(), first + index);
                if found.len() < k {
                    found.push(entry);
                } else if let Some(mut farthest) = found.peek_mut()
                    && entry < *farthest
                {
                    *farthest = entry;
                }
                if found.len() == k
                    && let Some(farthest) = found.peek()
                {
                    *worst = worst.min(f32::from_bits(farthest.0));
                }
            }
        }
    }
}

/// Nodes of a tree over so many entries.
fn node_count(entries: usize, leaf: usize) -> usize {
    match entries {
        0 => 0,
        n if n <= leaf => 1,
        n => 1 + node_count(n / 2, leaf) + node_count(n - n / 2, leaf),
    }
}

/// Entries from which the halves of a node are built on two threads.
const PARALLEL: usize = 1 << 13;

/// Orders `entries` and fills `nodes`, of which there are [`node_count`]; the first ones of each lie at `first_entry` and
/// `first_node` of the whole tree.
fn build(entries: &mut [(Vec3, u32)], nodes: &mut [Node], first_entry: u32, first_node: u32, leaf: usize) {
    // There is a node where there is an entry.
    let Some((node, rest)) = nodes.split_first_mut() else { return };
    if entries.len() <= leaf {
        *node = Node { split: 0.0, axis: IS_LEAF, start: first_entry, count: entries.len() as u32 };
        return;
    }
    let (low, high) =
        entries.iter().fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(l, h), (p, _)| (l.min(*p), h.max(*p)));
    let size = high - low;
    let axis = if size.x >= size.y && size.x >= size.z {
        0
    } else if size.y >= size.z {
        1
    } else {
        2
    };
    let middle = entries.len() / 2;
    entries.select_nth_unstable_by(middle, |a, b| a.0[axis].total_cmp(&b.0[axis]).then(a.1.cmp(&b.1)));
    let split = entries[middle].0[axis];
    let parallel = entries.len() >= PARALLEL;
    let (left, right) = entries.split_at_mut(middle);
    let (left_nodes, right_nodes) = rest.split_at_mut(node_count(middle, leaf));
    let right_child = first_node + 1 + left_nodes.len() as u32;
    *node = Node { split, axis: axis as u32, start: right_child, count: 0 };
    let mut build_left = || build(left, left_nodes, first_entry, first_node + 1, leaf);
    let mut build_right = || build(right, right_nodes, first_entry + middle as u32, right_child, leaf);
    if parallel {
        rayon::join(build_left, build_right);
    } else {
        build_left();
        build_right();
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
                    let mut got = found.clone().into_vec();
                    got.sort_unstable();
                    assert_eq!(got, brute(&points, &query, accept), "cloud {c}, n {n}, query {q}");
                }
            }
        }
    }
}
