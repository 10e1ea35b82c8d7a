//! The way through the tree, compiled for each set of instructions.

use super::{Block, LANES, OverlapTree};
use glam::Vec3;
use pulp::{Simd, WithSimd};

/// Levels of a tree over 2³¹ entries, and one.
pub(super) const DEEPEST: usize = 12;

/// Looks for the entries whose boxes meet a box.
pub(super) struct Walk<'a, F> {
    pub tree: &'a OverlapTree,
    pub low: Vec3,
    pub high: Vec3,
    /// Told of each; whether to go on.
    pub visit: F,
}

impl<F: FnMut(u32) -> bool> WithSimd for Walk<'_, F> {
    type Output = ();

    #[inline(always)]
    fn with_simd<I: Simd>(self, _: I) {
        let Self { tree, low, high, mut visit } = self;
        // On the way down: the block of each level, and which of its eight are still to be looked at.
        let mut blocks = [0u32; DEEPEST];
        let mut masks = [0u32; DEEPEST];
        let top = tree.levels.len() - 1;
        let mut level = top;
        masks[top] = met(&tree.blocks[tree.levels[top] as usize], low, high);
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
                if !visit(below) {
                    return;
                }
            } else {
                level -= 1;
                blocks[level] = below;
                masks[level] = met(&tree.blocks[(tree.levels[level] + below) as usize], low, high);
            }
        }
    }
}

/// Which of eight boxes meet the box, as bits.
#[inline(always)]
fn met(block: &Block, low: Vec3, high: Vec3) -> u32 {
    let mut bits = [0u32; LANES];
    for (lane, bit) in bits.iter_mut().enumerate() {
        let is_met = (block.low[0][lane] <= high.x)
            & (block.low[1][lane] <= high.y)
            & (block.low[2][lane] <= high.z)
            & (block.high[0][lane] >= low.x)
            & (block.high[1][lane] >= low.y)
            & (block.high[2][lane] >= low.z);
        *bit = if is_met { 1 << lane } else { 0 };
    }
    bits.iter().fold(0, |all, own| all | own)
}
