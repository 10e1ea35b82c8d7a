//! Searches: the way through the tree, and what is done with the blocks of a leaf.
//!
//! All of it is inlined into the one function that is compiled for each set of instructions.

use super::{Block, IS_LEAF, KdTree, LANES, Nearest, Volume, squared};
use glam::Vec3;
use pulp::{Simd, WithSimd};

/// What looks at leaves.
pub(super) trait Scan {
    /// Squared distance up to which leaves are of interest now.
    fn limit(&self) -> f32;
    /// Looks at the blocks of a leaf.
    fn leaf(&mut self, blocks: &[Block]);
}

/// A search about `center`.
pub(super) struct Search<'a, S> {
    pub tree: &'a KdTree,
    pub center: Vec3,
    pub scan: &'a mut S,
}

/// Nodes on the way down: a tree of 2³¹ entries is not as deep.
const DEEPEST: usize = 64;

impl<S: Scan> WithSimd for Search<'_, S> {
    type Output = ();

    /// Hands the leaves whose cells come near enough to the scan, the near ones first.
    #[inline(always)]
    fn with_simd<I: Simd>(self, _: I) {
        let Self { tree, center, scan } = self;
        if tree.nodes.is_empty() {
            return;
        }
        let center = center.to_array();
        let mut stack = [(0u32, 0.0f32, [0.0f32; 3]); DEEPEST];
        let mut top = 1;
        while top > 0 {
            top -= 1;
            let (mut at, distance, offset) = stack[top];
            if distance > scan.limit() {
                continue;
            }
            loop {
                let node = tree.nodes[at as usize];
                if node.axis == IS_LEAF {
                    let first = node.start as usize;
                    scan.leaf(&tree.blocks[first..first + (node.count as usize).div_ceil(LANES)]);
                    break;
                }
                let axis = node.axis as usize;
                let d = center[axis] - node.split;
                let (near, far) = if d < 0.0 { (at + 1, node.start) } else { (node.start, at + 1) };
                let beyond = distance - offset[axis] * offset[axis] + d * d;
                if beyond <= scan.limit() {
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
}

/// Squared distances of a block's entries from a centre, metres²; None if all are beyond `limit`.
#[inline(always)]
fn near(block: &Block, center: Vec3, limit: f32, distance: impl Fn(Vec3) -> f32) -> Option<[f32; LANES]> {
    let mut all = [0.0; LANES];
    for (lane, d) in all.iter_mut().enumerate() {
        *d = distance(offset(block, lane, center));
    }
    // What is no number is never the least.
    let least = all.iter().fold(f32::INFINITY, |least, &d| if d < least { d } else { least });
    (least <= limit).then_some(all)
}

#[inline(always)]
fn offset(block: &Block, lane: usize, center: Vec3) -> Vec3 {
    Vec3::new(block.x[lane] - center.x, block.y[lane] - center.y, block.z[lane] - center.z)
}

/// Looks for the k nearest by the distance of a volume.
pub(super) struct SearchNearest<'a, V, A> {
    pub first: u32,
    pub center: Vec3,
    pub volume: &'a V,
    pub found: &'a mut Nearest,
    pub accept: A,
}

impl<V: Volume, A: Fn(u32) -> bool> Scan for SearchNearest<'_, V, A> {
    #[inline(always)]
    fn limit(&self) -> f32 {
        self.volume.reach(self.found.worst()).min(f32::MAX)
    }

    #[inline(always)]
    fn leaf(&mut self, blocks: &[Block]) {
        let before = self.found.len();
        let worst = self.found.worst();
        for block in blocks {
            let distance = |offset| self.volume.squared(offset);
            let Some(distances) = near(block, self.center, worst, distance) else { continue };
            // Those near enough put together without a branch for each, which half of the time would go wrong.
            let (mut near, mut count) = ([0u64; LANES], 0usize);
            for (distance, index) in distances.iter().zip(&block.index) {
                near[count % LANES] = u64::from(distance.to_bits()) << 32 | u64::from(*index);
                count += usize::from(*distance <= worst);
            }
            for &key in &near[..count.min(LANES)] {
                if (self.accept)(key as u32) {
                    self.found.put(key + u64::from(self.first));
                }
            }
        }
        self.found.settle(before);
    }
}

/// Looks for all within a distance.
pub(super) struct SearchWithin<F> {
    pub center: Vec3,
    /// Squared distance, metres².
    pub limit: f32,
    pub visit: F,
}

impl<F: FnMut(u32, Vec3)> Scan for SearchWithin<F> {
    #[inline(always)]
    fn limit(&self) -> f32 {
        self.limit
    }

    #[inline(always)]
    fn leaf(&mut self, blocks: &[Block]) {
        for block in blocks {
            let Some(distances) = near(block, self.center, self.limit, squared) else { continue };
            for (lane, distance) in distances.into_iter().enumerate() {
                if distance <= self.limit {
                    (self.visit)(block.index[lane], offset(block, lane, self.center));
                }
            }
        }
    }
}

/// Looks for the nearest.
pub(super) struct SearchOne<A> {
    pub center: Vec3,
    /// Squared distance, metres².
    pub limit: f32,
    pub best: Option<(u32, f32)>,
    pub accept: A,
}

impl<A: Fn(u32) -> bool> Scan for SearchOne<A> {
    #[inline(always)]
    fn limit(&self) -> f32 {
        self.limit
    }

    #[inline(always)]
    fn leaf(&mut self, blocks: &[Block]) {
        for block in blocks {
            let Some(distances) = near(block, self.center, self.limit, squared) else { continue };
            for (squared, &index) in distances.into_iter().zip(&block.index) {
                let nearer =
                    squared < self.limit || squared == self.limit && self.best.is_none_or(|(best, _)| index < best);
                if nearer && (self.accept)(index) {
                    self.best = Some((index, squared));
                    self.limit = squared;
                }
            }
        }
    }
}
