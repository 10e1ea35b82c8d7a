//! Building: the entries put in order, and the nodes over them.

use super::{IS_LEAF, LANES, Node};
use glam::Vec3;

/// Nodes of a tree over so many entries.
pub(super) fn node_count(entries: usize, leaf: usize) -> usize {
    match entries {
        0 => 0,
        n if n <= leaf => 1,
        n => 1 + node_count(half(n, leaf), leaf) + node_count(n - half(n, leaf), leaf),
    }
}

/// Entries of the left half of `n`, more than `leaf`: whole blocks where leaves have them, so that only the last leaf of a tree
/// has one that is not full.
fn half(n: usize, leaf: usize) -> usize {
    if leaf.is_multiple_of(LANES) { (n / 2).next_multiple_of(LANES) } else { n / 2 }
}

/// Entries from which the halves of a node are built on two threads.
const PARALLEL: usize = 1 << 13;

/// Orders `entries` and fills `nodes`, of which there are [`node_count`]; the first ones of each lie at `first_entry` and
/// `first_node` of the whole tree.
pub(super) fn build(entries: &mut [(Vec3, u32)], nodes: &mut [Node], first_entry: u32, first_node: u32, leaf: usize) {
    // There is a node where there is an entry.
    let Some((node, rest)) = nodes.split_first_mut() else { return };
    if entries.len() <= leaf {
        *node = Node { split: 0.0, axis: IS_LEAF, start: first_entry, count: entries.len() as u32 };
        return;
    }
    let (low, high) =
        entries.iter().fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(l, h), (p, _)| (l.min(*p), h.max(*p)));
    let size = high - low;
    let axis = if size.x >= size.y && size.x >= size.z {
        0
    } else if size.y >= size.z {
        1
    } else {
        2
    };
    let middle = half(entries.len(), leaf);
    entries.select_nth_unstable_by(middle, |a, b| a.0[axis].total_cmp(&b.0[axis]).then(a.1.cmp(&b.1)));
    let split = entries[middle].0[axis];
    let parallel = entries.len() >= PARALLEL;
    let (left, right) = entries.split_at_mut(middle);
    let (left_nodes, right_nodes) = rest.split_at_mut(node_count(middle, leaf));
    let right_child = first_node + 1 + left_nodes.len() as u32;
    *node = Node { split, axis: axis as u32, start: right_child, count: 0 };
    let mut build_left = || build(left, left_nodes, first_entry, first_node + 1, leaf);
    let mut build_right = || build(right, right_nodes, first_entry + middle as u32, right_child, leaf);
    if parallel {
        rayon::join(build_left, build_right);
    } else {
        build_left();
        build_right();
    }
}
