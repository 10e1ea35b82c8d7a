use super::*;
use crate::math::sequence::{Sampling, Sequence};

/// All entries are reported once, wherever heaps of the same box lie.
#[test]
fn heaps_of_the_same_box_are_found() {
    for heaps in [1u32, 3, 4000] {
        let place = |i: u32| Vec3::new((i % heaps) as f32, 0.0, 1.0);
        let boxes: Vec<(Vec3, Vec3)> = (0..100_000).map(|i| (place(i), Vec3::splat(0.25))).collect();
        let tree = OverlapTree::new(&boxes);
        let mut found = Vec::new();
        tree.in_box(place(heaps - 1), Vec3::ZERO, |entry| found.push(tree.order()[entry as usize]));
        found.sort_unstable();
        let expected: Vec<u32> = (0..100_000).filter(|i| i % heaps == heaps - 1).collect();
        assert_eq!(found, expected, "{heaps} heaps");
        found.clear();
        tree.in_box(Vec3::ZERO, Vec3::splat(1e5), |entry| found.push(entry));
        assert!(found.into_iter().eq(0..100_000), "{heaps} heaps");
    }
}

/// Boxes of sizes over six decades against a look at each, for numbers around those that fill a block or a level.
#[test]
fn what_meets_a_box_is_found_once() {
    for n in [0u64, 1, 7, 8, 9, 63, 64, 65, 511, 513, 3000] {
        let sequence = Sequence::new(Sampling::Random, n);
        let boxes: Vec<(Vec3, Vec3)> = (0..n)
            .map(|i| {
                let (x, y) = (sequence.four(i, 0), sequence.four(i, 1));
                let half = Vec3::new(y[0], y[1], y[2]) * (14.0 * y[3] - 14.0).exp();
                (Vec3::new(x[0] * 4.0, x[1], x[2] * 0.001), half)
            })
            .collect();
        let tree = OverlapTree::new(&boxes);
        for i in 0..60 {
            let (x, y) = (sequence.four(i, 2), sequence.four(i, 3));
            let center = Vec3::new(x[0] * 4.0, x[1], x[2] * 0.001);
            let half = if i % 2 == 0 { Vec3::ZERO } else { Vec3::new(y[0], y[1], y[2]) * 0.1 };
            let mut found = Vec::new();
            tree.in_box(center, half, |entry| found.push(tree.order()[entry as usize]));
            found.sort_unstable();
            let (low, high) = corners((center, half));
            let expected = boxes.iter().zip(0..).filter(|(b, _)| {
                let (l, h) = corners(**b);
                l.cmple(high).all() && h.cmpge(low).all()
            });
            assert!(found.iter().copied().eq(expected.map(|(_, i)| i)), "{n} boxes, query {i}");
        }
    }
}

/// Sizes that no photon has are packed as well, and found.
#[test]
fn boxes_without_size_or_with_all_of_it_are_found() {
    let halves = [0.0, f32::MIN_POSITIVE, 1e-30, 1.0, 1e30];
    let boxes: Vec<(Vec3, Vec3)> = (0..50).map(|i| (Vec3::ONE, Vec3::splat(halves[i % 5]))).collect();
    let mut found = 0;
    OverlapTree::new(&boxes).in_box(Vec3::ONE, Vec3::ZERO, |_| found += 1);
    assert_eq!(found, 50);
}
