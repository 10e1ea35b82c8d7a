//! Building: the entries put in order, and the nodes over them.

use super::{IS_LEAF, LANES, Node};
use glam::Vec3;
use rayon::prelude::*;
use std::cmp::Ordering;

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

/// Entries from which one node is cut on all threads: there are few nodes of that size, and at first only one.
const WIDE: usize = 1 << 17;

/// Entries that one thread takes of a wide node at a time.
const CHUNK: usize = 1 << 14;

/// Entries of a wide node that are sorted to guess where its cut will be.
const SAMPLE: usize = 4096;

type Entry = (Vec3, u32);

/// Entries along an axis; no two are equal.
fn order(axis: usize) -> impl Fn(&Entry, &Entry) -> Ordering + Copy {
    move |a, b| a.0[axis].total_cmp(&b.0[axis]).then(a.1.cmp(&b.1))
}

/// The axis along which a node's entries reach farthest.
fn longest_axis(entries: &[Entry]) -> usize {
    let none = (Vec3::INFINITY, Vec3::NEG_INFINITY);
    let around = |entries: &[Entry]| entries.iter().fold(none, |(l, h), (p, _)| (l.min(*p), h.max(*p)));
    let (low, high) = if entries.len() < WIDE {
        around(entries)
    } else {
        entries.par_chunks(CHUNK).map(around).reduce(|| none, |a, b| (a.0.min(b.0), a.1.max(b.1)))
    };
    let size = high - low;
    if size.x >= size.y && size.x >= size.z {
        0
    } else if size.y >= size.z {
        1
    } else {
        2
    }
}

/// Puts the `middle` least entries along an axis before the others, on all threads; returns where they part.
fn cut_wide(entries: &mut [Entry], middle: usize, axis: usize) -> f32 {
    let compare = order(axis);
    let Some(pivot) = nth(entries, middle, axis) else {
        return entries.select_nth_unstable_by(middle, compare).1.0[axis];
    };
    let is_left = |e: &Entry| compare(e, &pivot) == Ordering::Less;
    let from: Vec<Entry> = entries.par_iter().copied().collect();
    let counts: Vec<usize> = from.par_chunks(CHUNK).map(|chunk| chunk.iter().filter(|e| is_left(e)).count()).collect();
    // Each chunk has its own place in either half.
    let (mut left, mut right) = entries.split_at_mut(middle);
    let mut places = Vec::with_capacity(counts.len());
    for (chunk, count) in from.chunks(CHUNK).zip(counts) {
        let (own_left, rest_left) = left.split_at_mut(count);
        let (own_right, rest_right) = right.split_at_mut(chunk.len() - count);
        (left, right) = (rest_left, rest_right);
        places.push((chunk, own_left, own_right));
    }
    places.into_par_iter().for_each(|(chunk, left, right)| {
        let (mut left, mut right) = (left.iter_mut(), right.iter_mut());
        for e in chunk {
            // They have as many places as were counted.
            if let Some(place) = if is_left(e) { left.next() } else { right.next() } {
                *place = *e;
            }
        }
    });
    pivot.0[axis]
}

/// The entry that `middle` others come before along an axis; None if a sample guesses badly where it is.
fn nth(entries: &[Entry], middle: usize, axis: usize) -> Option<Entry> {
    let compare = order(axis);
    let mut sample: Vec<Entry> = entries.iter().step_by(entries.len() / SAMPLE).copied().collect();
    sample.sort_unstable_by(compare);
    // Four standard deviations of a random sample's rank, half of its square root, to either side.
    let (rank, off) = (middle * sample.len() / entries.len(), 2 * SAMPLE.isqrt());
    let (low, high) = (sample.get(rank.checked_sub(off)?)?, sample.get(rank + off)?);
    let sort = |(mut below, mut between): (usize, Vec<Entry>), chunk: &[Entry]| {
        for e in chunk {
            if compare(e, low) == Ordering::Less {
                below += 1;
            } else if compare(e, high) != Ordering::Greater {
                between.push(*e);
            }
        }
        (below, between)
    };
    let join = |mut a: (usize, Vec<Entry>), mut b: (usize, Vec<Entry>)| {
        a.1.append(&mut b.1);
        (a.0 + b.0, a.1)
    };
    let (below, mut between) = entries.par_chunks(CHUNK).fold(Default::default, sort).reduce(Default::default, join);
    let at = middle.checked_sub(below).filter(|at| *at < between.len())?;
    Some(*between.select_nth_unstable_by(at, compare).1)
}

/// Orders `entries` and fills `nodes`, of which there are [`node_count`]; the first ones of each lie at `first_entry` and
/// `first_node` of the whole tree.
pub(super) fn build(entries: &mut [Entry], nodes: &mut [Node], first_entry: u32, first_node: u32, leaf: usize) {
    // There is a node where there is an entry.
    let Some((node, rest)) = nodes.split_first_mut() else { return };
    if entries.len() <= leaf {
        *node = Node { split: 0.0, axis: IS_LEAF, start: first_entry, count: entries.len() as u32 };
        return;
    }
    let axis = longest_axis(entries);
    let middle = half(entries.len(), leaf);
    let split = if entries.len() < WIDE {
        entries.select_nth_unstable_by(middle, order(axis)).1.0[axis]
    } else {
        cut_wide(entries, middle, axis)
    };
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::sequence::{Sampling, Sequence};

    /// A cut on all threads parts the same entries as a sort: at random places, few places, in order, and where a sample
    /// of every few entries tells nothing.
    #[test]
    fn a_wide_cut_parts_what_a_sort_parts() {
        let sequence = Sequence::new(Sampling::Random, 6);
        let count = WIDE + 12_345;
        let stride = count / SAMPLE;
        let random = |i: usize| sequence.four(i as u64, 0)[0];
        let places: [&dyn Fn(usize) -> f32; 5] =
            [&random, &|i| (random(i) * 3.0).floor(), &|i| i as f32, &|i| -(i as f32), &|i| {
                if i.is_multiple_of(stride) { 2.0 } else { random(i) }
            }];
        for (case, place) in places.into_iter().enumerate() {
            let all: Vec<Entry> = (0..count).map(|i| (Vec3::new(0.0, place(i), 0.0), i as u32)).collect();
            let mut sorted = all.clone();
            sorted.sort_unstable_by(order(1));
            for middle in [count / 2, count / 3, 1, count - 1] {
                let mut entries = all.clone();
                let split = cut_wide(&mut entries, middle, 1);
                assert_eq!(split, sorted[middle].0.y, "case {case}");
                let (left, right) = entries.split_at_mut(middle);
                left.sort_unstable_by(order(1));
                right.sort_unstable_by(order(1));
                assert_eq!(entries, sorted, "case {case}, {middle}");
            }
        }
    }
}
