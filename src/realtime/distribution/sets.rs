//! One function for each distribution of directions.

use crate::math::sequence::{Sampling, Sequence};
use std::f64::consts::TAU;

/// Numbers that the rejection of points takes at most for one direction; each is refused with probability 0.48.
const MAX_TRIES: u32 = 64;

/// Radius about the cube's centre whose points are refused: their directions are mostly rounding.
const LEAST_RADIUS: f64 = 1e-3;

pub(super) fn rejection(count: usize, seed: u64) -> Vec<[f32; 2]> {
    let numbers = Sequence::new(Sampling::Random, seed);
    (0..count as u64)
        .map(|i| {
            for set in 0..MAX_TRIES {
                let [x, y, z, _] = numbers.four(i, set).map(|x| 2.0 * f64::from(x) - 1.0);
                let length = (x * x + y * y + z * z).sqrt();
                if (LEAST_RADIUS..=1.0).contains(&length) {
                    let turn = libm::atan2(y, x) / TAU;
                    return square((1.0 - z / length) / 2.0, turn - turn.floor());
                }
            }
            [0.5; 2]
        })
        .collect()
}

pub(super) fn explicit(count: usize, seed: u64) -> Vec<[f32; 2]> {
    let numbers = Sequence::new(Sampling::Random, seed);
    (0..count as u64).map(|i| numbers.four(i, 0)).map(|x| [x[0], x[1]]).collect()
}

/// Saff and Kuijlaars 1997 as the paper prints it: heights from pole to pole, a step of the azimuth of `3.6/√N` over the
/// circle's radius, and the azimuth 0 at both poles.
pub(super) fn saff_kuijlaars(count: usize, seed: u64) -> Vec<[f32; 2]> {
    let n = count as f64;
    let mut azimuth = 0.0f64;
    (0..count)
        .map(|k| {
            let h = if count > 1 { 2.0 * k as f64 / (n - 1.0) - 1.0 } else { 1.0 };
            let ends = k == 0 || k + 1 == count;
            azimuth = if ends { 0.0 } else { (azimuth + 3.6 / (n * (1.0 - h * h)).sqrt()) % TAU };
            turned(h, azimuth / TAU, seed)
        })
        .collect()
}

/// Part of a turn by which the golden spiral goes on, 1 - 1/φ.
const GOLDEN_TURN: f64 = 0.381_966_011_250_105_1;

pub(super) fn spiral(count: usize, seed: u64) -> Vec<[f32; 2]> {
    (0..count)
        .map(|k| {
            let turn = k as f64 * GOLDEN_TURN;
            turned((2 * k + 1) as f64 / count as f64 - 1.0, turn - turn.floor(), seed)
        })
        .collect()
}

/// Bands of equal height where they hold as many cells; a band of more cells is as much higher, so that all cells have
/// one area.
pub(super) fn stratified(count: usize, seed: u64) -> Vec<[f32; 2]> {
    let numbers = Sequence::new(Sampling::Random, seed);
    let bands = ((count as f64).sqrt() as usize).max(1);
    let mut points = Vec::with_capacity(count);
    for band in 0..bands {
        let (first, end) = (band * count / bands, (band + 1) * count / bands);
        for cell in first..end {
            let x = numbers.four(cell as u64, 0);
            let u = (first as f64 + f64::from(x[0]) * (end - first) as f64) / count as f64;
            points.push(square(u, ((cell - first) as f64 + f64::from(x[1])) / (end - first) as f64));
        }
    }
    points
}

pub(super) fn sobol(count: usize, seed: u64) -> Vec<[f32; 2]> {
    let numbers = Sequence::new(Sampling::Sobol, seed);
    (0..count as u64).map(|i| numbers.four(i, 0)).map(|x| [x[0], x[1]]).collect()
}

/// The point of height `h` in -1 to 1 and of `turn` in turns. A seed that is not 0 shifts all points of a set alike, in
/// height and azimuth, around the square's edges (Cranley and Patterson 1976): then each of them is spread evenly over all
/// seeds, which a few points of a spiral are not.
fn turned(h: f64, turn: f64, seed: u64) -> [f32; 2] {
    let shift = if seed == 0 { [0.0; 4] } else { Sequence::new(Sampling::Random, seed).four(0, 0) };
    let (u, v) = ((1.0 - h) / 2.0 + f64::from(shift[1]), turn + f64::from(shift[0]));
    // The lower pole is the upper one then, but without a shift it stays.
    square(if seed == 0 { u } else { u - u.floor() }, v - v.floor())
}

/// Largest number in 32 bits below 1.
const BELOW_ONE: f32 = 1.0 - f32::EPSILON / 2.0;

/// A point in 32 bits, which stays below 1.
fn square(u: f64, v: f64) -> [f32; 2] {
    [(u as f32).clamp(0.0, BELOW_ONE), (v as f32).clamp(0.0, BELOW_ONE)]
}
