//! The way of a ray through a compressed wide hierarchy (Ylitie, Karras and Laine 2017), which `obvhs` builds.
//!
//! The eight boxes of a node are tested at once by arithmetic on lanes, in the widest instructions that the processor has
//! (the crate `pulp` chooses them when the program runs). They round as the others do: what is met does not depend on them.

use crate::math::lanes::dispatch_in_eights;
use glam::Vec3;
use obvhs::cwbvh::node::CwBvhNode;
use prefetch_index::prefetch_index;
use pulp::bytemuck::cast_slice;
use pulp::{Simd, WithSimd};

/// A ray made ready for the box test.
#[derive(Clone, Copy, Debug)]
pub struct BoxRay {
    /// Start.
    pub origin: Vec3,
    /// One over each component of the direction, finite; its sign is the component's.
    pub inverse: Vec3,
}

/// What is done with the primitives of a leaf.
pub trait LeafTest {
    /// Tests the entry `leaf` of the hierarchy's primitives; `limit` is how far boxes are opened, which it may lower. Returns
    /// whether to end.
    fn test(&mut self, leaf: usize, limit: &mut f32) -> bool;

    /// Asks for the memory of an entry that is tested soon.
    fn prefetch(&self, leaf: usize);
}

/// Nodes from which a hierarchy and its surfaces are more than the nearest cache holds, so that it pays to ask for memory early.
const LARGE: usize = 1000;

/// Hands `test` all primitives of the leaves whose boxes the ray meets within `limit` of its start, those of near boxes first
/// as far as the direction tells.
#[inline]
pub fn traverse(nodes: &[CwBvhNode], ray: &BoxRay, limit: f32, test: &mut impl LeafTest) {
    if is_large(nodes) {
        dispatch_in_eights(Traversal::<_, true> { nodes, ray, limit, test });
    } else if !nodes.is_empty() {
        dispatch_in_eights(Traversal::<_, false> { nodes, ray, limit, test });
    }
}

/// Whether it pays to ask for memory early, and to have several rays on their way.
#[inline]
pub fn is_large(nodes: &[CwBvhNode]) -> bool {
    nodes.len() > LARGE
}

/// `AHEAD`: whether memory is asked for as soon as it is known what will be looked at.
struct Traversal<'a, T, const AHEAD: bool> {
    nodes: &'a [CwBvhNode],
    ray: &'a BoxRay,
    limit: f32,
    test: &'a mut T,
}

/// Children of a node that are still to be visited.
#[derive(Clone, Copy, Default)]
pub(super) struct Group {
    /// Index of the first node among them.
    first: u32,
    /// The upper 8 bits are the children that the ray meets, the nearest on top; the lower 8 bits those that are nodes.
    mask: u32,
}

const CHILDREN: u32 = 0xff00_0000;
pub(super) const PRIMITIVES: u32 = 0x00ff_ffff;

/// Groups kept without allocation; a hierarchy over millions of triangles needs a dozen.
const SHALLOW: usize = 64;

impl Group {
    /// The root alone.
    pub(super) const ROOT: Self = Self { first: 0, mask: 1 << 31 };

    /// Whether none is left.
    #[inline(always)]
    pub(super) fn is_done(self) -> bool {
        self.mask & CHILDREN == 0
    }

    /// The index of the nearest, and the others.
    #[inline(always)]
    pub(super) fn nearest(self, octant: u32) -> (usize, Self) {
        let child = self.child();
        let index = self.index(child ^ octant);
        (index, Self { mask: self.mask & !(1 << (child + 24)), ..self })
    }

    /// The children of a node whose bits are set, in the upper 8.
    #[inline(always)]
    pub(super) fn of(node: &CwBvhNode, children: u32) -> Self {
        Self { first: node.child_base_idx, mask: children | u32::from(node.imask) }
    }

    /// The place of the nearest in the order of the octant.
    #[inline(always)]
    pub(super) fn child(self) -> u32 {
        7 - self.mask.leading_zeros()
    }

    /// The index of the node in that slot.
    #[inline(always)]
    fn index(self, slot: u32) -> usize {
        let before = (self.mask & 0xff & !(u32::MAX << slot)).count_ones();
        (self.first + before) as usize
    }
}

/// Groups that a ray comes back to, the nearest last.
pub(super) struct Stack<G = Group> {
    groups: [G; SHALLOW],
    deeper: Vec<G>,
    top: usize,
}

impl<G: Copy + Default> Stack<G> {
    /// An empty one.
    #[inline(always)]
    pub(super) fn new() -> Self {
        Self { groups: [G::default(); SHALLOW], deeper: Vec::new(), top: 0 }
    }

    /// Puts a group on top.
    #[inline(always)]
    pub(super) fn push(&mut self, group: G) {
        match self.groups.get_mut(self.top) {
            Some(place) => *place = group,
            None => self.deeper.push(group),
        }
        self.top += 1;
    }

    /// Takes the group on top; None if there is none.
    #[inline(always)]
    pub(super) fn pop(&mut self) -> Option<G> {
        self.top = self.top.checked_sub(1)?;
        self.groups.get(self.top).copied().or_else(|| self.deeper.pop())
    }
}

/// The octant that a ray goes to by its direction, or by one over that: three bits.
#[inline(always)]
pub(super) fn octant_of(direction: Vec3) -> u32 {
    let [x, y, z] = direction.to_array().map(|c| u32::from(c >= 0.0));
    x << 2 | y << 1 | z
}

impl<T: LeafTest, const AHEAD: bool> WithSimd for Traversal<'_, T, AHEAD> {
    type Output = ();

    #[inline(always)]
    fn with_simd<I: Simd>(self, _: I) {
        let Self { nodes, ray, mut limit, test } = self;
        let octant = octant_of(ray.inverse);
        let mut stack = Stack::new();
        let mut group = Group::ROOT;
        loop {
            let (index, rest) = group.nearest(octant);
            let node = &nodes[index];
            if !rest.is_done() {
                stack.push(rest);
            }
            let met = boxes_met(node, ray, octant, limit);
            group = children_met(node, met);
            let mut primitives = met & PRIMITIVES;
            if AHEAD {
                prefetch(nodes, node, met, octant, test);
            }
            while primitives != 0 {
                let leaf = node.primitive_base_idx + primitives.trailing_zeros();
                primitives &= primitives - 1;
                if test.test(leaf as usize, &mut limit) {
                    return;
                }
            }
            if group.is_done() {
                let Some(next) = stack.pop() else { return };
                group = next;
            }
        }
    }
}

/// The children among those that are `met`.
#[inline(always)]
pub(super) fn children_met(node: &CwBvhNode, met: u32) -> Group {
    Group::of(node, met & CHILDREN)
}

/// Asks for the memory of all that is `met` of a node: while one of them is awaited, so are the others.
#[inline(always)]
pub(super) fn prefetch(nodes: &[CwBvhNode], node: &CwBvhNode, met: u32, octant: u32, test: &impl LeafTest) {
    // A node is five of these long, and nearly always lies in two lines of a cache.
    let parts = cast_slice::<CwBvhNode, [u8; 16]>(nodes);
    let group = children_met(node, met);
    let mut children = met & CHILDREN;
    while children != 0 {
        let first = 5 * group.index((children.trailing_zeros() - 24) ^ octant);
        prefetch_index(parts, first);
        prefetch_index(parts, first + 4);
        children &= children - 1;
    }
    let mut primitives = met & PRIMITIVES;
    while primitives != 0 {
        test.prefetch((node.primitive_base_idx + primitives.trailing_zeros()) as usize);
        primitives &= primitives - 1;
    }
}

/// The children of a node whose boxes the ray meets: nodes in the upper 8 bits, in the order of the octant, and the
/// primitives of leaves in the lower 24.
#[inline(always)]
pub(super) fn boxes_met(node: &CwBvhNode, ray: &BoxRay, octant: u32, limit: f32) -> u32 {
    let extent = Vec3::from_array(node.e.map(|e| f32::from_bits(u32::from(e) << 23)));
    let scale = extent * ray.inverse;
    let start = (node.p - ray.origin) * ray.inverse;
    let along = |axis: usize, low, high| if ray.inverse[axis] < 0.0 { (high, low) } else { (low, high) };
    let (near_x, far_x): (&[u8; 8], &[u8; 8]) = along(0, &node.child_min_x, &node.child_max_x);
    let (near_y, far_y): (&[u8; 8], &[u8; 8]) = along(1, &node.child_min_y, &node.child_max_y);
    let (near_z, far_z): (&[u8; 8], &[u8; 8]) = along(2, &node.child_min_z, &node.child_max_z);
    let x = |q: u8| f32::from(q) * scale.x + start.x;
    let y = |q: u8| f32::from(q) * scale.y + start.y;
    let z = |q: u8| f32::from(q) * scale.z + start.z;
    let mut enters = [0.0f32; 8];
    let mut leaves = [0.0f32; 8];
    for i in 0..8 {
        enters[i] = larger(larger(x(near_x[i]), y(near_y[i])), larger(z(near_z[i]), 0.0));
    }
    for i in 0..8 {
        leaves[i] = smaller(smaller(x(far_x[i]), y(far_y[i])), smaller(z(far_z[i]), limit));
    }
    let mut bits = [0u32; 8];
    for i in 0..8 {
        let meta = u32::from(node.child_meta[i]);
        // A node's bit is its slot, turned by the octant; a leaf's bits are its primitives.
        let turn = if meta & 0x18 == 0x18 { octant } else { 0 };
        let own = (meta >> 5) << ((meta ^ turn) & 31);
        bits[i] = if enters[i] <= leaves[i] { own } else { 0 };
    }
    bits.iter().fold(0, |all, own| all | own)
}

/// Of two numbers, as the processor's own instruction has it.
#[inline(always)]
fn larger(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}

#[inline(always)]
fn smaller(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}
