//! The order in which boxes are packed: by size, and among those of like size along Hilbert's curve.

use super::LANES;
use crate::math::lanes::dispatch_in_eights;
use glam::Vec3;
use pulp::{Simd, WithSimd};
use rayon::prelude::*;

/// Steps along each axis, as bits.
const BITS: u32 = 18;

/// Sizes within a factor of two to the power of this many are alike.
const LIKE: u32 = 2;

/// The order in which entries are packed, `of` giving the centre of each and the longest half-side of its box.
pub(in crate::photons) fn packing_order<T: Sync>(entries: &[T], of: impl Fn(&T) -> (Vec3, f32) + Sync) -> Vec<u32> {
    let Some(last) = entries.last() else { return Vec::new() };
    let curve = Curve::around(entries.par_iter().map(|e| of(e).0));
    let keys = |(group, chunk): (usize, &[T])| {
        // A group that is not full has its last entry more than once, and too many keys.
        let keys = curve.keys(std::array::from_fn(|lane| of(chunk.get(lane).unwrap_or(last))));
        std::array::from_fn(|lane| (keys[lane], (group * LANES + lane) as u32))
    };
    let keys: Vec<[(u64, u32); LANES]> = entries.par_chunks(LANES).enumerate().map(keys).collect();
    let mut keys = keys.into_flattened();
    keys.truncate(entries.len());
    keys.par_sort_unstable();
    keys.par_iter().map(|&(_, i)| i).collect()
}

/// The cube that the curve fills.
struct Curve {
    low: Vec3,
    scale: f32,
}

impl Curve {
    /// Around centres.
    fn around(centers: impl ParallelIterator<Item = Vec3>) -> Self {
        let ends = (Vec3::INFINITY, Vec3::NEG_INFINITY);
        let join = |a: (Vec3, Vec3), b: (Vec3, Vec3)| (a.0.min(b.0), a.1.max(b.1));
        let (low, high) = centers.fold(|| ends, |all, c| join(all, (c, c))).reduce(|| ends, join);
        let side = (high - low).max_element();
        Self { low, scale: if side > 0.0 { (1 << BITS) as f32 * (1.0 - f32::EPSILON) / side } else { 0.0 } }
    }

    /// Where boxes come: their size above, their place on the curve below.
    fn keys(&self, boxes: [(Vec3, f32); LANES]) -> [u64; LANES] {
        // A cast saturates.
        let step = |x: f32| (x as u32).min((1 << BITS) - 1);
        let places = boxes.map(|(center, _)| ((center - self.low) * self.scale).to_array().map(step));
        let steps = std::array::from_fn(|axis| std::array::from_fn(|lane| places[lane][axis]));
        let along = dispatch_in_eights(Hilbert { steps });
        let class = |lane: usize| (boxes[lane].1.to_bits() >> 23 & 0xff) / LIKE;
        std::array::from_fn(|lane| u64::from(class(lane)) << (3 * BITS) | along[lane])
    }
}

/// Places on Hilbert's curve of eight points of the grid at once, by coordinates (Skilling 2004).
struct Hilbert {
    steps: [[u32; LANES]; 3],
}

impl WithSimd for Hilbert {
    type Output = [u64; LANES];

    #[inline(always)]
    #[expect(clippy::needless_range_loop, reason = "a lane of two axes, which may be the same")]
    fn with_simd<I: Simd>(self, _: I) -> [u64; LANES] {
        let mut x = self.steps;
        for bit in (1..BITS).rev() {
            let below = (1 << bit) - 1;
            for axis in 0..3 {
                for lane in 0..LANES {
                    // All bits if this one is set: both ways are taken, and one of them changes nothing.
                    let set = 0u32.wrapping_sub(x[axis][lane] >> bit & 1);
                    let swapped = (x[0][lane] ^ x[axis][lane]) & below & !set;
                    x[0][lane] ^= below & set | swapped;
                    x[axis][lane] ^= swapped;
                }
            }
        }
        let mut keys = [0; LANES];
        for (lane, key) in keys.iter_mut().enumerate() {
            // Gray's code, undone.
            let b = x[1][lane] ^ x[0][lane];
            let c = x[2][lane] ^ b;
            let mut turn = 0;
            for bit in 1..BITS {
                turn ^= 0u32.wrapping_sub(c >> bit & 1) & ((1 << bit) - 1);
            }
            *key = apart(x[0][lane] ^ turn) << 2 | apart(b ^ turn) << 1 | apart(c ^ turn);
        }
        keys
    }
}

/// The bits of a number of [`BITS`] of them, each three places from the next.
#[inline(always)]
fn apart(x: u32) -> u64 {
    let x = u64::from(x);
    let x = (x | x << 32) & 0x0003_0000_0000_ffff;
    let x = (x | x << 16) & 0x0003_0000_ff00_00ff;
    let x = (x | x << 8) & 0x0003_00f0_0f00_f00f;
    let x = (x | x << 4) & 0x00c3_0c30_c30c_30c3;
    (x | x << 2) & 0x0249_2492_4924_9249
}

#[cfg(test)]
mod tests {
    use super::*;

    /// All points of a small cube come one after the other, each a step away from the last, and fill it; and so do the
    /// parts of the whole cube, as many along each side.
    #[test]
    fn the_curve_goes_from_neighbour_to_neighbour() {
        for above in [0, BITS - 3] {
            // The first 512 places of the curve are a cube of eight.
            let row = |i: u32| [[0, 1, 2, 3, 4, 5, 6, 7], [i & 7; LANES], [i >> 3; LANES]];
            let keys = |steps: [[u32; LANES]; 3]| {
                let keys = dispatch_in_eights(Hilbert { steps: steps.map(|s| s.map(|x| x << above)) });
                std::array::from_fn(|lane| (keys[lane] >> (3 * above), steps.map(|s| s[lane])))
            };
            let rows: Vec<[(u64, [u32; 3]); LANES]> = (0..64).map(row).map(keys).collect();
            let mut points = rows.into_flattened();
            points.sort_unstable();
            assert!(points.iter().map(|(key, _)| *key).eq(0..512), "{above}");
            for pair in points.windows(2) {
                let steps: u32 = (0..3).map(|i| pair[0].1[i].abs_diff(pair[1].1[i])).sum();
                assert_eq!(steps, 1, "{above} {pair:?}");
            }
        }
    }

    #[test]
    fn bits_are_put_apart() {
        for x in (0..1 << BITS).step_by(77).chain([(1 << BITS) - 1]) {
            let expected = (0..BITS).map(|bit| u64::from(x >> bit & 1) << (3 * bit)).sum::<u64>();
            assert_eq!(apart(x), expected);
        }
    }
}
