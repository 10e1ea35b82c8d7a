//! Eight rays of one octant through a hierarchy together.
//!
//! A node is looked up once for all of them, and each of its boxes is tested by all at once, in lanes. Each ray visits the nodes
//! that it visits alone, in the same order.

use super::traversal::{BoxRay, Group, Stack};
use crate::math::eights::{LANES, Row, set};
use crate::math::lanes::{Lanes, Vec3Lanes, bits, dispatch_in_eights};
use obvhs::cwbvh::node::CwBvhNode;
use pulp::{Simd, WithSimd};

/// Rays of a packet.
pub const PACKET: usize = LANES;

/// Rays of one octant, made ready for the box test.
#[derive(Clone, Copy)]
pub struct BoxRays {
    origin: [Row; 3],
    inverse: [Row; 3],
    octant: u32,
}

impl BoxRays {
    /// None yet, of that octant.
    pub fn new(octant: u32) -> Self {
        Self { origin: [[0.0; PACKET]; 3], inverse: [[0.0; PACKET]; 3], octant }
    }

    /// Puts one in a lane.
    #[inline(always)]
    pub fn set(&mut self, lane: usize, ray: &BoxRay) {
        set(&mut self.origin, lane, ray.origin);
        set(&mut self.inverse, lane, ray.inverse);
    }
}

/// What is done with the primitives of leaves.
pub trait PacketTest {
    /// Tests the entry `leaf` of the hierarchy's primitives for those rays whose bits are set in `rays`; `limits` is how far
    /// boxes are opened for each ray, which it may lower.
    fn test(&mut self, leaf: usize, rays: u32, limits: &mut [f32; PACKET]);
}

/// Hands `test` what [`traverse`](super::traversal::traverse) would for each of the rays whose bits are set in `active`, in the
/// same order, without a limit at first.
pub fn traverse_packet(nodes: &[CwBvhNode], rays: &BoxRays, active: u32, test: &mut impl PacketTest) {
    if !nodes.is_empty() {
        dispatch_in_eights(PacketTraversal { nodes, rays, active, test });
    }
}

struct PacketTraversal<'a, T> {
    nodes: &'a [CwBvhNode],
    rays: &'a BoxRays,
    active: u32,
    test: &'a mut T,
}

/// Children of a node that are still to be visited, and by which rays.
#[derive(Clone, Copy, Default)]
struct Shared {
    group: Group,
    /// For each of the children, in the order of the octant, the rays that meet it.
    rays: [u8; 8],
}

impl<T: PacketTest> WithSimd for PacketTraversal<'_, T> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { nodes, rays, active, test } = self;
        let mut limits = [f32::INFINITY; PACKET];
        let mut stack = Stack::new();
        let mut shared = Shared { group: Group::ROOT, rays: [active as u8; 8] };
        loop {
            let (index, rest) = shared.group.nearest(rays.octant);
            let own = u32::from(shared.rays[shared.group.child() as usize]);
            let node = &nodes[index];
            if !rest.is_done() {
                stack.push(Shared { group: rest, ..shared });
            }
            let met = met_by(simd, node, rays, &limits);
            let mut children = 0;
            let mut primitives = 0;
            let mut by_primitive = [0; 24];
            shared.rays = [0; 8];
            for (slot, met) in met.iter().enumerate() {
                let met = met & own;
                let meta = u32::from(node.child_meta[slot]);
                if met == 0 || meta == 0 {
                    continue;
                }
                if meta & 0x18 == 0x18 {
                    let child = (meta ^ rays.octant) & 31;
                    children |= 1 << child;
                    shared.rays[child as usize - 24] = met as u8;
                } else {
                    let mut of_leaf = (meta >> 5) << (meta & 31);
                    primitives |= of_leaf;
                    while of_leaf != 0 {
                        by_primitive[of_leaf.trailing_zeros() as usize] = met;
                        of_leaf &= of_leaf - 1;
                    }
                }
            }
            shared.group = Group::of(node, children);
            while primitives != 0 {
                let place = primitives.trailing_zeros();
                primitives &= primitives - 1;
                test.test((node.primitive_base_idx + place) as usize, by_primitive[place as usize], &mut limits);
            }
            if shared.group.is_done() {
                let Some(next) = stack.pop() else { return };
                shared = next;
            }
        }
    }
}

/// For each child of a node the rays that meet its box within their limits, as bits.
#[inline(always)]
fn met_by<S: Simd>(simd: S, node: &CwBvhNode, rays: &BoxRays, limits: &[f32; PACKET]) -> [u32; 8] {
    let mut all = [0; 8];
    let low = [&node.child_min_x, &node.child_min_y, &node.child_min_z];
    let high = [&node.child_max_x, &node.child_max_y, &node.child_max_z];
    let (mut near, mut far) = ([[0.0f32; 8]; 3], [[0.0f32; 8]; 3]);
    for axis in 0..3 {
        let goes_up = rays.octant >> (2 - axis) & 1 == 1;
        let (from, to) = if goes_up { (low[axis], high[axis]) } else { (high[axis], low[axis]) };
        for slot in 0..8 {
            near[axis][slot] = f32::from(from[slot]);
        }
        for slot in 0..8 {
            far[axis][slot] = f32::from(to[slot]);
        }
    }
    for group in 0..PACKET / S::F32_LANES {
        let inverse = Vec3Lanes::of(simd, &rays.inverse, group);
        let origin = Vec3Lanes::of(simd, &rays.origin, group);
        let limit = Lanes::of(simd, limits, group);
        let splat = |x: f32| Lanes::splat(simd, x);
        let extent = |axis: usize| Lanes::splat(simd, f32::from_bits(u32::from(node.e[axis]) << 23));
        let scale =
            Vec3Lanes { x: inverse.x * extent(0), y: inverse.y * extent(1), z: inverse.z * extent(2) };
        let start = Vec3Lanes::splat(simd, node.p) - origin;
        let start = Vec3Lanes { x: start.x * inverse.x, y: start.y * inverse.y, z: start.z * inverse.z };
        for slot in 0..8 {
            let x = splat(near[0][slot]) * scale.x + start.x;
            let y = splat(near[1][slot]) * scale.y + start.y;
            let z = splat(near[2][slot]) * scale.z + start.z;
            let enters = x.larger(y).larger(z.larger(splat(0.0)));
            let x = splat(far[0][slot]) * scale.x + start.x;
            let y = splat(far[1][slot]) * scale.y + start.y;
            let z = splat(far[2][slot]) * scale.z + start.z;
            let leaves = x.smaller(y).smaller(z.smaller(limit));
            all[slot] |= bits(simd, enters.at_most(leaves)) << (group * S::F32_LANES);
        }
    }
    all
}
