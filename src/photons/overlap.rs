//! Gathering by footprint: every photon whose ellipsoid meets a point or a view footprint.

use glam::{Vec3, Vec3A};
use obvhs::BvhBuildParams;
use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::builder::build_bvh2;
use obvhs::bvh2::node::Bvh2Node;
use std::time::Duration;

/// Memory of one entry: two nodes and its place in the order.
pub const BYTES_PER_ENTRY: usize = 2 * size_of::<Bvh2Node>() + size_of::<u32>();

/// Memory of one entry while the hierarchy is built, beside that of the hierarchy: its box, and in the builder a node,
/// a code along the curve by which boxes are sorted and their indices, twice.
pub const BYTES_PER_BUILT_ENTRY: usize = size_of::<Aabb>() + size_of::<Bvh2Node>() + 2 * 16;

/// A hierarchy over the boxes of photon footprints. It answers with candidates whose boxes meet the query.
pub struct OverlapTree {
    bvh: Bvh2,
}

impl OverlapTree {
    /// Builds over boxes given as centre and half-size, and returns the order in which entries are reported:
    /// entry `i` of the tree is box `order[i]`.
    pub fn new(boxes: impl Iterator<Item = (Vec3, Vec3)>) -> (Self, Vec<u32>) {
        // One unit in the last place on each side keeps the box around what it holds.
        let boxes: Vec<Aabb> = boxes
            .map(|(center, half)| {
                let half = half * (1.0 + 4.0 * f32::EPSILON) + center.abs() * f32::EPSILON;
                Aabb::new((center - half).into(), (center + half).into())
            })
            .collect();
        if boxes.is_empty() {
            return (Self { bvh: Bvh2::default() }, Vec::new());
        }
        let parameters =
            if boxes.len() < 50_000 { BvhBuildParams::fast_build() } else { BvhBuildParams::very_fast_build() };
        let bvh = build_bvh2(&boxes, parameters, &mut Duration::default());
        let order = bvh.primitive_indices.clone();
        (Self { bvh }, order)
    }

    /// For each entry the box that it is, as [`OverlapTree::new`] returned it.
    pub fn order(&self) -> &[u32] {
        &self.bvh.primitive_indices
    }

    /// Calls `visit` with ranges of entries whose node's box holds the point.
    #[inline]
    pub fn at_point(&self, point: Vec3, mut visit: impl FnMut(std::ops::Range<u32>)) {
        self.bvh.point_traverse(Vec3A::from(point), |bvh, node| {
            let node = &bvh.nodes[node as usize];
            visit(node.first_index..node.first_index + node.prim_count);
            true
        });
    }

    /// Calls `visit` with ranges of entries whose node's box meets the box of that centre and half-size.
    #[inline]
    pub fn in_box(&self, center: Vec3, half: Vec3, mut visit: impl FnMut(std::ops::Range<u32>)) {
        let half = half * (1.0 + 4.0 * f32::EPSILON) + center.abs() * f32::EPSILON;
        let query = Aabb::new((center - half).into(), (center + half).into());
        self.bvh.aabb_traverse(query, |bvh, node| {
            let node = &bvh.nodes[node as usize];
            visit(node.first_index..node.first_index + node.prim_count);
            true
        });
    }
}
