//! Many triangles as few balls: the cells of a grid that they lie in.

use super::ball_around;
use glam::DVec3;
use rayon::prelude::*;

/// Cells along the longest side of the box around all.
const FINEST: usize = 128;
/// More balls than this are made of cells twice as large.
const MOST_BALLS: usize = 60_000;
/// Triangles that one thread puts into cells at a time.
const CHUNK: usize = 4096;
/// Most halvings of a triangle that is longer than a cell.
const MOST_HALVINGS: u32 = 16;

struct Grid {
    low: DVec3,
    /// Side of a cell, metres.
    side: f64,
    counts: [usize; 3],
}

/// Balls around the cells of a grid that triangles lie in, which hold them all.
pub(super) fn balls(triangles: &(impl Fn(usize) -> [DVec3; 3] + Sync), indices: &[usize]) -> Vec<(DVec3, f64)> {
    let ends = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    let join = |a: (DVec3, DVec3), b: (DVec3, DVec3)| (a.0.min(b.0), a.1.max(b.1));
    let bounds = |&i: &usize| triangles(i).iter().fold(ends, |all, &p| join(all, (p, p)));
    let (low, high) = indices.par_iter().map(bounds).reduce(|| ends, join);
    let longest = (high - low).max_element();
    if longest <= 0.0 {
        return indices.first().map(|&i| ball_around(triangles(i))).into_iter().collect();
    }
    let mut along = FINEST;
    loop {
        let side = longest / along as f64;
        let counts = ((high - low) / side).to_array().map(|n| (n as usize + 1).min(along));
        let grid = Grid { low, side, counts };
        let cells = grid.cells(triangles, indices);
        let number: usize = cells.iter().map(|w| w.count_ones() as usize).sum();
        if number <= MOST_BALLS || along < 8 {
            return grid.balls(&cells);
        }
        along /= 2;
    }
}

impl Grid {
    /// Bits of the cells that some triangle lies in.
    fn cells(&self, triangles: &(impl Fn(usize) -> [DVec3; 3] + Sync), indices: &[usize]) -> Vec<u64> {
        let empty = || vec![0u64; self.counts.iter().product::<usize>().div_ceil(64)];
        let fill = |mut bits: Vec<u64>, chunk: &[usize]| {
            chunk.iter().for_each(|&i| self.put(triangles(i), MOST_HALVINGS, &mut bits));
            bits
        };
        let union = |mut a: Vec<u64>, b: Vec<u64>| {
            a.iter_mut().zip(b).for_each(|(a, b)| *a |= b);
            a
        };
        indices.par_chunks(CHUNK).fold(empty, fill).reduce(empty, union)
    }

    /// Sets the cells of a triangle's box, of its halves' if it is longer than two.
    fn put(&self, corners: [DVec3; 3], left: u32, bits: &mut [u64]) {
        let [a, b, c] = corners;
        let (low, high) = (a.min(b).min(c), a.max(b).max(c));
        if left > 0 && (high - low).max_element() > 2.0 * self.side {
            // Across the longest edge.
            let edges = [(a, b, c), (b, c, a), (c, a, b)];
            let squared = edges.map(|(p, q, _)| p.distance_squared(q));
            let longest = if squared[0] >= squared[1] && squared[0] >= squared[2] {
                0
            } else if squared[1] >= squared[2] {
                1
            } else {
                2
            };
            let (p, q, apex) = edges[longest];
            let middle = (p + q) / 2.0;
            self.put([p, middle, apex], left - 1, bits);
            self.put([middle, q, apex], left - 1, bits);
            return;
        }
        let cell =
            |p: DVec3, axis: usize| (((p - self.low)[axis] / self.side).max(0.0) as usize).min(self.counts[axis] - 1);
        for x in cell(low, 0)..=cell(high, 0) {
            for y in cell(low, 1)..=cell(high, 1) {
                for z in cell(low, 2)..=cell(high, 2) {
                    let i = (x * self.counts[1] + y) * self.counts[2] + z;
                    bits[i / 64] |= 1 << (i % 64);
                }
            }
        }
    }

    fn balls(&self, cells: &[u64]) -> Vec<(DVec3, f64)> {
        let [_, ny, nz] = self.counts;
        let radius = self.side * (3f64.sqrt() / 2.0 + 1e-9);
        let ball = |i: usize| {
            let place = DVec3::new((i / (ny * nz)) as f64, (i / nz % ny) as f64, (i % nz) as f64);
            (self.low + (place + 0.5) * self.side, radius)
        };
        let set = cells
            .iter()
            .enumerate()
            .flat_map(|(word, bits)| (0..64).filter(move |bit| bits >> bit & 1 == 1).map(move |bit| word * 64 + bit));
        set.map(ball).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::sequence::{Sampling, Sequence};

    /// Every place of every triangle, needles and large ones among them, lies in a ball; and there are few of them.
    #[test]
    fn balls_hold_all_triangles() {
        let sequence = Sequence::new(Sampling::Random, 4);
        let point = |i: usize, set: u32| {
            let x = sequence.four(i as u64, set);
            DVec3::new(x[0].into(), x[1].into(), (0.01 * x[2]).into())
        };
        let triangle = |i: usize| {
            let size = [1.0, 0.1, 1e-3][i % 3];
            [point(i, 0), point(i, 0) + point(i, 1) * size, point(i, 0) + point(i, 2) * size * size]
        };
        for n in [1, 20, 3000] {
            let indices: Vec<usize> = (0..n).collect();
            let balls = balls(&triangle, &indices);
            assert!(!balls.is_empty() && balls.len() <= MOST_BALLS, "{}", balls.len());
            for i in (0..n).step_by(1 + n / 40) {
                let [a, b, c] = triangle(i);
                for place in 0..50 {
                    let x = sequence.four(place, 7);
                    let (u, v) = (f64::from(x[0]), f64::from(x[1]));
                    let (u, v) = if u + v > 1.0 { (1.0 - u, 1.0 - v) } else { (u, v) };
                    let p = a + (b - a) * u + (c - a) * v;
                    assert!(balls.iter().any(|(center, r)| center.distance(p) <= *r), "{p} of {i}");
                }
            }
        }
        // All in one point.
        assert_eq!(super::balls(&|_| [DVec3::ONE; 3], &[0, 1]), [(DVec3::ONE, 0.0)]);
    }
}
