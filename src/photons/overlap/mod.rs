//! Gathering by footprint: every photon whose box meets a point or a box.
//!
//! The boxes are sorted along a curve that keeps neighbours together, those of like size with each other, and then packed
//! by eights from below: eight boxes are a block, eight blocks make the box of a block above, and so on (Kamel and
//! Faloutsos 1993). There are no pointers, the tree is as full as can be, and the eight boxes of a block are tested at
//! once, in the widest instructions that the processor has.

mod curve;
mod walk;

pub(super) use crate::math::eights::LANES;
use crate::math::lanes::dispatch_in_eights;
pub(super) use curve::packing_order;
use glam::Vec3;
use rayon::prelude::*;
use walk::{DEEPEST, Each};
pub(super) use walk::{Visit, Walk};

/// Memory of one entry: its box, its share of the boxes above, and its place in the order.
pub const BYTES_PER_ENTRY: usize = 28 + size_of::<u32>();

/// Memory of one entry while entries are put in order.
pub const BYTES_PER_BUILT_ENTRY: usize = size_of::<(u64, u32)>();

/// Centre and half-size.
type Bounds = (Vec3, Vec3);

/// Eight boxes: their least and largest coordinates along each axis. An empty one is met by nothing.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub(super) struct Block {
    low: [[f32; LANES]; 3],
    high: [[f32; LANES]; 3],
}

impl Block {
    /// Of eight boxes or fewer, by their centres and half-sizes.
    pub(super) fn of(boxes: impl Iterator<Item = Bounds>) -> Self {
        Self::around_all(boxes.map(corners))
    }

    /// The same by corners.
    fn around_all(boxes: impl Iterator<Item = (Vec3, Vec3)>) -> Self {
        let mut block = Self { low: [[f32::INFINITY; LANES]; 3], high: [[f32::NEG_INFINITY; LANES]; 3] };
        for (lane, (low, high)) in boxes.take(LANES).enumerate() {
            for axis in 0..3 {
                block.low[axis][lane] = low[axis];
                block.high[axis][lane] = high[axis];
            }
        }
        block
    }

    /// Corners of the box around all of them.
    fn around(&self) -> (Vec3, Vec3) {
        let least = |lanes: &[f32; LANES]| lanes.iter().fold(f32::INFINITY, |m, v| m.min(*v));
        let largest = |lanes: &[f32; LANES]| lanes.iter().fold(f32::NEG_INFINITY, |m, v| m.max(*v));
        (
            Vec3::from_array(std::array::from_fn(|i| least(&self.low[i]))),
            Vec3::from_array(std::array::from_fn(|i| largest(&self.high[i]))),
        )
    }
}

/// A hierarchy over the boxes of photon footprints. It answers with candidates whose boxes meet the query.
#[derive(Default)]
pub struct OverlapTree {
    /// Blocks of all levels, the entries' own first.
    blocks: Vec<Block>,
    /// The first block of each level.
    levels: Vec<u32>,
    /// For each entry the box that it is.
    order: Vec<u32>,
}

impl OverlapTree {
    /// Builds over boxes given as centre and half-size.
    pub fn new(boxes: &[(Vec3, Vec3)]) -> Self {
        let order = packing_order(boxes, |(center, half)| (*center, half.max_element()));
        let mut blocks = Self::room(order.len());
        let of_entries = |entries: &[u32]| Block::of(entries.iter().map(|&i| boxes[i as usize]));
        order.par_chunks(LANES).map(of_entries).collect_into_vec(&mut blocks);
        Self::over(order, blocks)
    }

    /// An empty list with room for the blocks of all levels over so many entries: a seventh more than the lowest, and one
    /// for each level that is not full.
    pub(super) fn room(entries: usize) -> Vec<Block> {
        Vec::with_capacity(entries / (LANES - 1) + DEEPEST)
    }

    /// Builds over the blocks of entries in their order, which is that of [`packing_order`].
    pub(super) fn over(order: Vec<u32>, mut blocks: Vec<Block>) -> Self {
        if blocks.is_empty() {
            return Self::default();
        }
        let mut levels = vec![0];
        while blocks.len() - levels[levels.len() - 1] as usize > 1 {
            let below = levels[levels.len() - 1] as usize;
            let of_blocks = |children: &[Block]| Block::around_all(children.iter().map(Block::around));
            let next: Vec<Block> = blocks[below..].par_chunks(LANES).map(of_blocks).collect();
            levels.push(blocks.len() as u32);
            blocks.extend(next);
        }
        Self { blocks, levels, order }
    }

    /// For each entry, as they are reported, the box that it is.
    pub fn order(&self) -> &[u32] {
        &self.order
    }

    /// Whether it has no entries.
    pub fn is_empty(&self) -> bool {
        self.levels.is_empty()
    }

    /// Calls `visit` with the entries whose box meets the box of that centre and half-size, in their order.
    #[inline]
    pub fn in_box(&self, center: Vec3, half: Vec3, visit: impl FnMut(u32)) {
        let (low, high) = corners((center, half));
        dispatch_in_eights(Walk { tree: self, low, high, visit: Each(visit) });
    }

    /// Corners of an entry's box, as it is tested.
    #[inline(always)]
    pub(super) fn corners_of(&self, entry: u32) -> (Vec3, Vec3) {
        let (block, lane) = (&self.blocks[entry as usize / LANES], entry as usize % LANES);
        let ([lx, ly, lz], [hx, hy, hz]) = (&block.low, &block.high);
        (Vec3::new(lx[lane], ly[lane], lz[lane]), Vec3::new(hx[lane], hy[lane], hz[lane]))
    }
}

/// Corners of a box, one unit in the last place out on each side: so it keeps what it holds.
#[inline]
pub(super) fn corners((center, half): Bounds) -> (Vec3, Vec3) {
    let half = half * (1.0 + 4.0 * f32::EPSILON) + center.abs() * f32::EPSILON;
    (center - half, center + half)
}

#[cfg(test)]
mod tests;
