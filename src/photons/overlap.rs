//! Gathering by footprint: every photon whose ellipsoid meets a point or a view footprint.

use glam::{Vec3, Vec3A};
use obvhs::BvhBuildParams;
use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::builder::build_bvh2;
use rayon::prelude::*;
use std::ops::Range;
use std::time::Duration;

/// A hierarchy over the boxes of photon footprints. It answers with candidates whose boxes meet the query.
pub struct OverlapTree {
    bvh: Bvh2,
    /// For each entry the box that it is.
    order: Vec<u32>,
    /// Where the entries of each of the hierarchy's leaves start, with one more at the end; empty if each has one.
    starts: Vec<u32>,
}

impl OverlapTree {
    /// Builds over boxes given as centre and half-size.
    pub fn new(boxes: impl Iterator<Item = (Vec3, Vec3)>) -> Self {
        // One unit in the last place on each side keeps the box around what it holds.
        let boxes: Vec<Aabb> = boxes
            .map(|(center, half)| {
                let half = half * (1.0 + 4.0 * f32::EPSILON) + center.abs() * f32::EPSILON;
                Aabb::new((center - half).into(), (center + half).into())
            })
            .collect();
        if boxes.is_empty() {
            return Self { bvh: Bvh2::default(), order: Vec::new(), starts: Vec::new() };
        }
        if !is_crowded(&boxes) {
            let bvh = build(&boxes);
            return Self { order: bvh.primitive_indices.clone(), bvh, starts: Vec::new() };
        }
        let mut sorted: Vec<u32> = (0..boxes.len() as u32).collect();
        sorted.par_sort_unstable_by_key(|&i| (bits(&boxes[i as usize]), i));
        let groups: Vec<&[u32]> =
            sorted.chunk_by(|&i, &j| bits(&boxes[i as usize]) == bits(&boxes[j as usize])).collect();
        let bvh = build(&groups.iter().map(|g| boxes[g[0] as usize]).collect::<Vec<_>>());
        let (mut order, mut starts) = (Vec::with_capacity(boxes.len()), vec![0]);
        for &group in &bvh.primitive_indices {
            order.extend_from_slice(groups[group as usize]);
            starts.push(order.len() as u32);
        }
        Self { bvh, order, starts }
    }

    /// For each entry, as ranges of them are reported, the box that it is.
    pub fn order(&self) -> &[u32] {
        &self.order
    }

    fn entries(&self, first: u32, count: u32) -> Range<u32> {
        match self.starts.is_empty() {
            true => first..first + count,
            false => self.starts[first as usize]..self.starts[(first + count) as usize],
        }
    }

    /// Calls `visit` with ranges of entries whose node's box holds the point.
    #[inline]
    pub fn at_point(&self, point: Vec3, mut visit: impl FnMut(Range<u32>)) {
        self.bvh.point_traverse(Vec3A::from(point), |bvh, node| {
            let node = &bvh.nodes[node as usize];
            visit(self.entries(node.first_index, node.prim_count));
            true
        });
    }

    /// Calls `visit` with ranges of entries whose node's box meets the box of that centre and half-size.
    #[inline]
    pub fn in_box(&self, center: Vec3, half: Vec3, mut visit: impl FnMut(Range<u32>)) {
        let half = half * (1.0 + 4.0 * f32::EPSILON) + center.abs() * f32::EPSILON;
        let query = Aabb::new((center - half).into(), (center + half).into());
        self.bvh.aabb_traverse(query, |bvh, node| {
            let node = &bvh.nodes[node as usize];
            visit(self.entries(node.first_index, node.prim_count));
            true
        });
    }
}

fn build(boxes: &[Aabb]) -> Bvh2 {
    let parameters =
        if boxes.len() < 50_000 { BvhBuildParams::fast_build() } else { BvhBuildParams::very_fast_build() };
    build_bvh2(boxes, parameters, &mut Duration::default())
}

/// A box as numbers that are equal where it is.
fn bits(b: &Aabb) -> [u32; 6] {
    let (low, high) = (b.min.to_array(), b.max.to_array());
    [low[0], low[1], low[2], high[0], high[1], high[2]].map(f32::to_bits)
}

/// Boxes that are looked at to see whether many are the same.
const SAMPLE: usize = 4096;

/// Whether more than a few boxes are the same, judged by a sample.
///
/// The builder joins neighbours that each is the other's best. In a row of boxes that are all the same only one pair is,
/// so the time to build would grow with the square of their number.
fn is_crowded(boxes: &[Aabb]) -> bool {
    let step = boxes.len().div_ceil(SAMPLE);
    let mut sample: Vec<[u32; 6]> = boxes.iter().step_by(step).map(bits).collect();
    sample.sort_unstable();
    sample.windows(3).any(|w| w[0] == w[2])
}

#[cfg(test)]
mod tests {
    use super::*;

    /// All entries are reported once, wherever heaps of the same box lie.
    #[test]
    fn heaps_of_the_same_box_are_found() {
        for heaps in [1u32, 3, 4000] {
            let place = |i: u32| Vec3::new((i % heaps) as f32, 0.0, 1.0);
            let tree = OverlapTree::new((0..100_000).map(|i| (place(i), Vec3::splat(0.25))));
            let mut found = Vec::new();
            tree.at_point(place(heaps - 1), |range| found.extend(range));
            let mut boxes: Vec<u32> = found.iter().map(|&e| tree.order()[e as usize]).collect();
            boxes.retain(|i| i % heaps == heaps - 1);
            boxes.sort_unstable();
            let expected: Vec<u32> = (0..100_000).filter(|i| i % heaps == heaps - 1).collect();
            assert_eq!(boxes, expected, "{heaps} heaps");
            found.clear();
            tree.in_box(Vec3::ZERO, Vec3::splat(1e5), |range| found.extend(range));
            found.sort_unstable();
            assert!(found.into_iter().eq(0..100_000), "{heaps} heaps");
        }
    }
}
