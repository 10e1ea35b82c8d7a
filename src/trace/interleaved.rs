//! Many rays through a large hierarchy, several in flight at once.
//!
//! Where a hierarchy is larger than the caches a ray waits for memory most of its time. A step of one ray asks for what its next
//! step looks at, and the others take theirs meanwhile.

use super::traversal::{BoxRay, Group, LeafTest, PRIMITIVES, Stack, boxes_met, children_met, octant_of, prefetch};
use crate::math::lanes::dispatch_in_eights;
use obvhs::cwbvh::node::CwBvhNode;
use pulp::{Simd, WithSimd};

/// Rays that are in flight at once.
const IN_FLIGHT: usize = 8;

/// Goes the ways of many rays, as [`traverse`](super::traversal::traverse) goes one: `next` gives them with how far boxes are
/// opened and with what tests their leaves, and `done` is handed that at the end of each, in any order.
pub fn traverse_interleaved<T: LeafTest>(
    nodes: &[CwBvhNode],
    next: impl FnMut() -> Option<(BoxRay, f32, T)>,
    done: impl FnMut(T),
) {
    if !nodes.is_empty() {
        dispatch_in_eights(Interleaved { nodes, next, done });
    }
}

struct Interleaved<'a, N, D> {
    nodes: &'a [CwBvhNode],
    next: N,
    done: D,
}

impl<T: LeafTest, N: FnMut() -> Option<(BoxRay, f32, T)>, D: FnMut(T)> WithSimd for Interleaved<'_, N, D> {
    type Output = ();

    #[inline(always)]
    fn with_simd<I: Simd>(self, _: I) {
        let Self { nodes, mut next, mut done } = self;
        let mut states: Vec<TraversalState<T>> = Vec::with_capacity(IN_FLIGHT);
        while states.len() < IN_FLIGHT
            && let Some(ray) = next()
        {
            states.push(TraversalState::new(ray));
        }
        let mut at = 0;
        while let Some(state) = states.get_mut(at) {
            if state.step(nodes) {
                at += 1;
            } else if let Some(ray) = next() {
                done(std::mem::replace(state, TraversalState::new(ray)).test);
                at += 1;
            } else {
                done(states.swap_remove(at).test);
            }
            if at >= states.len() {
                at = 0;
            }
        }
    }
}

/// How far a ray has come.
struct TraversalState<T> {
    ray: BoxRay,
    octant: u32,
    limit: f32,
    test: T,
    stack: Stack,
    group: Group,
    /// Entries of the last node that are still to be tested: the first, and a mask.
    primitives: (u32, u32),
}

impl<T: LeafTest> TraversalState<T> {
    #[inline(always)]
    fn new((ray, limit, test): (BoxRay, f32, T)) -> Self {
        Self {
            ray,
            octant: octant_of(ray.inverse),
            limit,
            test,
            stack: Stack::new(),
            group: Group::ROOT,
            primitives: (0, 0),
        }
    }

    /// Tests the entries of the last node and goes on to the next; false at the end.
    #[inline(always)]
    fn step(&mut self, nodes: &[CwBvhNode]) -> bool {
        let (first, mut primitives) = self.primitives;
        while primitives != 0 {
            if self.test.test((first + primitives.trailing_zeros()) as usize, &mut self.limit) {
                return false;
            }
            primitives &= primitives - 1;
        }
        if self.group.is_done() {
            let Some(next) = self.stack.pop() else { return false };
            self.group = next;
        }
        let (index, rest) = self.group.nearest(self.octant);
        let node = &nodes[index];
        if !rest.is_done() {
            self.stack.push(rest);
        }
        let met = boxes_met(node, &self.ray, self.octant, self.limit);
        self.group = children_met(node, met);
        self.primitives = (node.primitive_base_idx, met & PRIMITIVES);
        prefetch(nodes, node, met, self.octant, &self.test);
        true
    }
}
