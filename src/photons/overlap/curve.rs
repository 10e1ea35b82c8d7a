//! The order in which boxes are packed: by size, and among those of like size along Hilbert's curve.

use super::Bounds;
use glam::Vec3;
use rayon::prelude::*;

/// Steps along each axis, as bits.
const BITS: u32 = 18;

/// Sizes within a factor of two to the power of this many are alike.
const LIKE: u32 = 2;

/// The cube that the curve fills.
pub(super) struct Curve {
    low: Vec3,
    scale: f32,
}

impl Curve {
    /// Around the centres of boxes.
    pub(super) fn around(boxes: &[Bounds]) -> Self {
        let ends = (Vec3::INFINITY, Vec3::NEG_INFINITY);
        let join = |a: (Vec3, Vec3), b: (Vec3, Vec3)| (a.0.min(b.0), a.1.max(b.1));
        let (low, high) = boxes.par_iter().fold(|| ends, |all, b| join(all, (b.0, b.0))).reduce(|| ends, join);
        let side = (high - low).max_element();
        Self { low, scale: if side > 0.0 { (1 << BITS) as f32 * (1.0 - f32::EPSILON) / side } else { 0.0 } }
    }

    /// Where a box comes: its size above, its place on the curve below.
    pub(super) fn key(&self, (center, half): &Bounds) -> u64 {
        let size = half.max_element().to_bits() >> 23 & 0xff;
        // A cast saturates.
        let steps = ((*center - self.low) * self.scale).to_array().map(|x| (x as u32).min((1 << BITS) - 1));
        u64::from(size / LIKE) << (3 * BITS) | hilbert(steps)
    }
}

/// Place on Hilbert's curve of a point of the grid (Skilling 2004).
fn hilbert(mut x: [u32; 3]) -> u64 {
    for bit in (1..BITS).rev() {
        let below = (1 << bit) - 1;
        for axis in 0..3 {
            if x[axis] >> bit & 1 == 1 {
                x[0] ^= below;
            } else {
                let swapped = (x[0] ^ x[axis]) & below;
                x[0] ^= swapped;
                x[axis] ^= swapped;
            }
        }
    }
    // Gray's code, undone.
    x[1] ^= x[0];
    x[2] ^= x[1];
    let turn = (1..BITS).rev().filter(|bit| x[2] >> bit & 1 == 1).fold(0, |t, bit| t ^ ((1 << bit) - 1));
    let x = x.map(|v| v ^ turn);
    (0..BITS).rev().fold(0, |key, bit| x.iter().fold(key, |key, v| key << 1 | u64::from(v >> bit & 1)))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// All points of a small cube come one after the other, each a step away from the last, and fill it.
    #[test]
    fn the_curve_goes_from_neighbour_to_neighbour() {
        // The first 512 places of the curve are a cube of eight.
        let mut points: Vec<(u64, [u32; 3])> =
            (0..512u32).map(|i| [i & 7, i >> 3 & 7, i >> 6]).map(|p| (hilbert(p), p)).collect();
        points.sort_unstable();
        assert!(points.iter().map(|(key, _)| *key).eq(0..512));
        for pair in points.windows(2) {
            let steps: u32 = (0..3).map(|i| pair[0].1[i].abs_diff(pair[1].1[i])).sum();
            assert_eq!(steps, 1, "{pair:?}");
        }
    }
}
