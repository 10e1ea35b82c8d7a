//! Eight rays that go about the same way through a hierarchy together.
//!
//! A node is looked up once for all of them, and each of its boxes is tested by all at once, in lanes. Each ray visits the nodes
//! that it visits alone.

use super::intersector::{Ray, SMALLEST_COMPONENT};
use super::traversal::{Group, Stack};
use crate::math::eights::{LANES, Row, set, vector};
use crate::math::lanes::{EightLanes, Lanes, Vec3Lanes, bits, dispatch_eight_lanes, of_bytes};
use glam::Vec3;
use obvhs::cwbvh::node::CwBvhNode;
use pulp::Simd;

/// Rays of a packet.
pub const PACKET: usize = LANES;

/// Rays of one octant and one longest axis.
#[derive(Clone, Copy)]
pub struct Packet {
    /// Starts.
    pub origin: [Row; 3],
    /// Directions.
    pub direction: [Row; 3],
    /// The octant that they go to, as [`octant_of`](super::traversal::octant_of) has it.
    pub octant: u32,
    count: usize,
}

impl Packet {
    /// None yet.
    pub fn new(octant: u32) -> Self {
        let zero = [[0.0; PACKET]; 3];
        Self { origin: zero, direction: zero, octant, count: 0 }
    }

    /// Adds a ray to less than eight, and says in which lane.
    #[inline(always)]
    pub fn push(&mut self, ray: &Ray) -> usize {
        let lane = self.count % PACKET;
        set(&mut self.origin, lane, ray.origin);
        set(&mut self.direction, lane, ray.direction);
        self.count = lane + 1;
        lane
    }

    /// Number of rays.
    #[inline(always)]
    pub fn ray_count(&self) -> usize {
        self.count
    }

    /// Forgets them. What is in a lane that holds no ray is traced for nobody.
    #[inline(always)]
    pub fn clear(&mut self) {
        self.count = 0;
    }

    /// One of them.
    #[inline(always)]
    pub fn ray(&self, lane: usize) -> Ray {
        Ray { origin: vector(&self.origin, lane), direction: vector(&self.direction, lane) }
    }

    /// One over the components of the directions, as each ray has it alone.
    #[inline(always)]
    fn inverse(&self) -> [Row; 3] {
        let mut inverse = [[0.0; PACKET]; 3];
        for lane in 0..PACKET {
            set(&mut inverse, lane, inverse_of(vector(&self.direction, lane)));
        }
        inverse
    }
}

/// One over each component of a direction, finite; a zero has no sign.
#[inline(always)]
pub fn inverse_of(direction: Vec3) -> Vec3 {
    let direction = direction + Vec3::ZERO;
    direction.abs().max(Vec3::splat(SMALLEST_COMPONENT)).copysign(direction).recip()
}

/// What is done with the primitives of leaves.
pub trait PacketTest {
    /// Makes it ready for the rays of a packet.
    fn start(&mut self, packet: &Packet);

    /// Tests the entry `leaf` of the hierarchy's primitives for those rays whose bits are set in `rays`; `limits` is how far
    /// boxes are opened for each ray, which it may lower.
    fn test<S: Simd>(&mut self, simd: S, leaf: usize, rays: u32, limits: &mut Row);
}

/// What a packet's rays had in common.
#[derive(Clone, Copy, Debug, Default)]
pub struct Visits {
    /// Nodes that any of them visited.
    pub nodes: u32,
    /// Nodes that each of them visited, in all.
    pub by_rays: u32,
}

/// Hands `test` what [`traverse`](super::traversal::traverse) would for each ray of a packet, without a limit at first.
pub fn traverse_packet(nodes: &[CwBvhNode], packet: &Packet, test: &mut impl PacketTest) -> Visits {
    if nodes.is_empty() { Visits::default() } else { dispatch_eight_lanes(PacketTraversal { nodes, packet, test }) }
}

struct PacketTraversal<'a, T> {
    nodes: &'a [CwBvhNode],
    packet: &'a Packet,
    test: &'a mut T,
}

/// Children of a node that are still to be visited, and by which rays.
#[derive(Clone, Copy, Default)]
struct Shared {
    group: Group,
    /// For each of the children, in the order of the octant, the rays that meet it.
    rays: [u8; 8],
}

impl<T: PacketTest> EightLanes for PacketTraversal<'_, T> {
    type Output = Visits;

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) -> Visits {
        let Self { nodes, packet, test } = self;
        let octant = packet.octant;
        let inverse = packet.inverse();
        test.start(packet);
        let mut limits = [f32::INFINITY; PACKET];
        let mut stack = Stack::new();
        let active = u8::MAX >> (PACKET - packet.count);
        let mut shared = Shared { group: Group::ROOT, rays: [active; 8] };
        let mut visits = Visits::default();
        loop {
            let (index, rest) = shared.group.nearest(octant);
            let own = shared.rays[shared.group.child() as usize];
            let node = &nodes[index];
            visits.nodes += 1;
            visits.by_rays += own.count_ones();
            if !rest.is_done() {
                stack.push(Shared { group: rest, ..shared });
            }
            let mut met = met_by(simd, node, packet, &inverse, &limits);
            let mut by_any = 0;
            for (slot, met) in met.iter_mut().enumerate() {
                *met &= own;
                by_any |= u32::from(*met != 0) << slot;
            }
            let mut children = 0;
            let mut inner = by_any & u32::from(node.imask);
            while inner != 0 {
                let slot = inner.trailing_zeros();
                inner &= inner - 1;
                children |= 1 << (24 + (slot ^ octant));
                shared.rays[(slot ^ octant) as usize] = met[slot as usize];
            }
            shared.group = Group::of(node, children);
            let mut leaves = by_any & !u32::from(node.imask);
            while leaves != 0 {
                let slot = leaves.trailing_zeros() as usize;
                leaves &= leaves - 1;
                // As many bits as there are primitives, and where the first of them is.
                let meta = u32::from(node.child_meta[slot]);
                let first = node.primitive_base_idx + (meta & 31);
                for leaf in first..first + (meta >> 5).count_ones() {
                    test.test(simd, leaf as usize, u32::from(met[slot]), &mut limits);
                }
            }
            if shared.group.is_done() {
                let Some(next) = stack.pop() else { return visits };
                shared = next;
            }
        }
    }
}

/// For each child of a node the rays that meet its box within their limits, as bits.
#[inline(always)]
fn met_by<S: Simd>(simd: S, node: &CwBvhNode, packet: &Packet, inverse: &[Row; 3], limits: &Row) -> [u8; 8] {
    let low = [&node.child_min_x, &node.child_min_y, &node.child_min_z];
    let high = [&node.child_max_x, &node.child_max_y, &node.child_max_z];
    let (mut near, mut far) = ([[0.0f32; 8]; 3], [[0.0f32; 8]; 3]);
    for axis in 0..3 {
        let goes_up = packet.octant >> (2 - axis) & 1 == 1;
        let (from, to) = if goes_up { (low[axis], high[axis]) } else { (high[axis], low[axis]) };
        near[axis] = of_bytes(simd, from);
        far[axis] = of_bytes(simd, to);
    }
    let mut met = [0; 8];
    for group in 0..PACKET / S::F32_LANES {
        let rays = BoxRays::new(simd, node, packet, inverse, limits, group);
        for slot in 0..8 {
            let near = [near[0][slot], near[1][slot], near[2][slot]];
            let far = [far[0][slot], far[1][slot], far[2][slot]];
            met[slot] |= (rays.meet(simd, near, far) << (group * S::F32_LANES)) as u8;
        }
    }
    met
}

/// Rays in the coordinates of a node's boxes.
struct BoxRays<S: Simd> {
    scale: Vec3Lanes<S>,
    start: Vec3Lanes<S>,
    limit: Lanes<S>,
}

impl<S: Simd> BoxRays<S> {
    #[inline(always)]
    fn new(simd: S, node: &CwBvhNode, packet: &Packet, inverse: &[Row; 3], limits: &Row, group: usize) -> Self {
        let [ex, ey, ez] = node.e;
        let inverse = Vec3Lanes::of(simd, inverse, group);
        let scale = Vec3Lanes {
            x: inverse.x * Lanes::splat(simd, f32::from_bits(u32::from(ex) << 23)),
            y: inverse.y * Lanes::splat(simd, f32::from_bits(u32::from(ey) << 23)),
            z: inverse.z * Lanes::splat(simd, f32::from_bits(u32::from(ez) << 23)),
        };
        let start = Vec3Lanes::splat(simd, node.p) - Vec3Lanes::of(simd, &packet.origin, group);
        let start = Vec3Lanes { x: start.x * inverse.x, y: start.y * inverse.y, z: start.z * inverse.z };
        Self { scale, start, limit: Lanes::of(simd, limits, group) }
    }

    /// Bits of those that meet a box, whose corners are those that rays of the octant come to first and last.
    #[inline(always)]
    fn meet(&self, simd: S, near: [f32; 3], far: [f32; 3]) -> u32 {
        let Self { scale, start, limit } = self;
        let x = Lanes::splat(simd, near[0]) * scale.x + start.x;
        let y = Lanes::splat(simd, near[1]) * scale.y + start.y;
        let z = Lanes::splat(simd, near[2]) * scale.z + start.z;
        let enters = x.larger(y).larger(z.larger(Lanes::splat(simd, 0.0)));
        let x = Lanes::splat(simd, far[0]) * scale.x + start.x;
        let y = Lanes::splat(simd, far[1]) * scale.y + start.y;
        let z = Lanes::splat(simd, far[2]) * scale.z + start.z;
        let leaves = x.smaller(y).smaller(z.smaller(*limit));
        bits(simd, enters.at_most(leaves))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::frame::uniform_sphere;
    use crate::math::sequence::{Sampling, Sequence};
    use crate::trace::traversal::{BoxRay, boxes_met, octant_of};
    use glam::Vec3A;
    use obvhs::BvhBuildParams;
    use obvhs::aabb::Aabb;
    use obvhs::cwbvh::builder::build_cwbvh;
    use std::time::Duration;

    struct Met<'a>(&'a CwBvhNode, &'a Packet, &'a Row);

    impl EightLanes for Met<'_> {
        type Output = [u8; 8];

        fn run<S: Simd>(self, simd: S) -> [u8; 8] {
            met_by(simd, self.0, self.1, &self.1.inverse(), self.2)
        }
    }

    /// In the widest instructions and in none each ray of a packet meets the boxes that it meets alone.
    #[test]
    fn rays_of_a_packet_meet_boxes_as_each_alone() {
        let sequence = Sequence::new(Sampling::Random, 12);
        let boxes: Vec<Aabb> = (0..500)
            .map(|i| {
                let (x, y) = (sequence.four(i, 0), sequence.four(i, 1));
                let low = Vec3A::new(x[0], x[1], x[2]);
                Aabb::new(low, low + 0.3 * Vec3A::new(y[0], y[1], y[2]))
            })
            .collect();
        let bvh = build_cwbvh(&boxes, BvhBuildParams::medium_build(), &mut Duration::default());
        let mut met = [0u32; 2];
        for i in 0..2000u64 {
            let octant = (i % 8) as u32;
            let mut packet = Packet::new(octant);
            let mut limits = [0.0; PACKET];
            for (lane, limit) in limits.iter_mut().enumerate() {
                let (x, y) = (sequence.four(i, 2 + lane as u32), sequence.four(i, 10 + lane as u32));
                let sign = |bit: u32| if octant >> bit & 1 == 1 { 1.0 } else { -1.0 };
                let mut direction = uniform_sphere(x[0], x[1]).normalize().abs() * Vec3::new(sign(2), sign(1), sign(0));
                if lane == 3 && octant == 7 {
                    direction.y = 0.0;
                }
                let origin = Vec3::new(x[2], x[3], y[0]) - direction * y[1];
                packet.push(&Ray { origin, direction });
                *limit = if lane % 2 == 0 { f32::INFINITY } else { y[2] };
            }
            let node = &bvh.nodes[i as usize % bvh.nodes.len()];
            let together = dispatch_eight_lanes(Met(node, &packet, &limits));
            assert_eq!(together, Met(node, &packet, &limits).run(pulp::Scalar));
            for (lane, limit) in limits.into_iter().enumerate() {
                let ray = packet.ray(lane);
                let start = BoxRay { origin: ray.origin, inverse: inverse_of(ray.direction) };
                if octant_of(ray.direction) != octant {
                    continue;
                }
                let alone = boxes_met(node, &start, octant, limit);
                for (slot, together) in together.iter().enumerate() {
                    let meta = u32::from(node.child_meta[slot]);
                    let bit = if meta & 0x18 == 0x18 { (meta ^ octant) & 31 } else { meta & 31 };
                    let is_met = together >> lane & 1 == 1 && meta != 0;
                    if meta != 0 {
                        assert_eq!(is_met, alone >> bit & 1 == 1, "{i} {lane} {slot}");
                        met[usize::from(is_met)] += 1;
                    }
                }
            }
        }
        assert!(met.iter().all(|n| *n > 3000), "{met:?}");
    }
}
