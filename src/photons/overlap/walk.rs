//! The way through the tree, compiled for each set of instructions.

use super::{Block, LANES, OverlapTree};
use crate::math::lanes::{Vec3Lanes, bits};
use glam::Vec3;
use pulp::{Simd, WithSimd};

/// Levels of a tree over 2³¹ entries, and one.
pub(super) const DEEPEST: usize = 12;

/// Is told what was found.
pub trait Visit {
    /// Of an entry, by the same instructions as it was found; whether to go on.
    fn visit<S: Simd>(&mut self, simd: S, entry: u32) -> bool;
}

/// Of each entry.
pub(super) struct Each<F>(pub F);

impl<F: FnMut(u32)> Visit for Each<F> {
    #[inline(always)]
    fn visit<S: Simd>(&mut self, _: S, entry: u32) -> bool {
        self.0(entry);
        true
    }
}

/// Looks for the entries whose boxes meet a box.
pub struct Walk<'a, V> {
    pub tree: &'a OverlapTree,
    pub low: Vec3,
    pub high: Vec3,
    pub visit: V,
}

impl<V: Visit> WithSimd for Walk<'_, V> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { tree, low, high, mut visit } = self;
        if tree.is_empty() {
            return;
        }
        // On the way down: the block of each level, and which of its eight are still to be looked at.
        let mut blocks = [0u32; DEEPEST];
        let mut masks = [0u32; DEEPEST];
        let top = tree.levels.len() - 1;
        let mut level = top;
        masks[top] = met(simd, &tree.blocks[tree.levels[top] as usize], low, high);
        loop {
            if masks[level] == 0 {
                if level == top {
                    return;
                }
                level += 1;
                continue;
            }
            let below = blocks[level] * LANES as u32 + masks[level].trailing_zeros();
            masks[level] &= masks[level] - 1;
            if level == 0 {
                if !visit.visit(simd, below) {
                    return;
                }
            } else {
                level -= 1;
                blocks[level] = below;
                masks[level] = met(simd, &tree.blocks[(tree.levels[level] + below) as usize], low, high);
            }
        }
    }
}

/// Which of eight boxes meet the box, as bits.
#[inline(always)]
fn met<S: Simd>(simd: S, block: &Block, low: Vec3, high: Vec3) -> u32 {
    let mut all = 0;
    for group in 0..LANES / S::F32_LANES {
        let own = (Vec3Lanes::of(simd, &block.low, group), Vec3Lanes::of(simd, &block.high, group));
        let other = (Vec3Lanes::splat(simd, low), Vec3Lanes::splat(simd, high));
        all |= bits(simd, Vec3Lanes::boxes_meet(simd, own, other)) << (group * S::F32_LANES);
    }
    all
}
