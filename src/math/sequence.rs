//! Sampling sequences: four numbers in `[0, 1)` for an index and a dimension set.
//!
//! A path asks for set 0 at its start and for set `1 + b` at bounce `b`, so that no two decisions share a dimension.

use crate::math::hash::mix;
use rand_core::Rng;
use rand_pcg::Lcg64Xsh32;
use serde::{Deserialize, Serialize};

/// Which numbers a path is made of.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Default)]
#[serde(rename_all = "snake_case")]
pub enum Sampling {
    /// Owen-scrambled Sobol points.
    #[default]
    Sobol,
    /// Pseudo-random numbers (PCG).
    Random,
}

/// A seeded sequence, the same for the same kind and seed on every machine.
#[derive(Clone, Copy, Debug)]
pub struct Sequence {
    sampling: Sampling,
    seed: u64,
}

/// The Sobol points come in blocks of 2¹⁶ (the library's limit), each with a scramble of its own.
const BLOCK_BITS: u32 = 16;
/// Dimension sets of the library; sets beyond it are scrambled anew.
const SETS: u32 = sobol_burley::NUM_DIMENSION_SETS_4D;

impl Sequence {
    /// A sequence of that kind; different seeds give independent sequences.
    pub fn new(sampling: Sampling, seed: u64) -> Self {
        Self { sampling, seed }
    }

    /// The seed that it was made with.
    pub fn seed(&self) -> u64 {
        self.seed
    }

    /// Four numbers in `[0, 1)` for point `index` in dimension set `set`.
    pub fn four(&self, index: u64, set: u32) -> [f32; 4] {
        match self.sampling {
            Sampling::Sobol => {
                let block = (index >> BLOCK_BITS) | (u64::from(set / SETS) << 48);
                let scramble = mix(self.seed, block);
                sobol_burley::sample_4d(
                    (index & ((1 << BLOCK_BITS) - 1)) as u32,
                    set % SETS,
                    (scramble ^ (scramble >> 32)) as u32,
                )
            }
            Sampling::Random => {
                let mut rng = Lcg64Xsh32::new(mix(self.seed, index), u64::from(set));
                std::array::from_fn(|_| (rng.next_u32() >> 8) as f32 / (1u32 << 24) as f32)
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Variance over cells of a 16×16 grid of the projection on two dimensions: χ² of the counts.
    fn chi_square(sampling: Sampling, first: u64, count: u64, dims: (usize, usize)) -> f64 {
        let sequence = Sequence::new(sampling, 7);
        let mut cells = [0.0f64; 256];
        for i in first..first + count {
            let x = sequence.four(i, 1);
            assert!(x.iter().all(|v| (0.0..1.0).contains(v)));
            cells[(x[dims.0] * 16.0) as usize * 16 + (x[dims.1] * 16.0) as usize] += 1.0;
        }
        let expected = count as f64 / 256.0;
        cells.iter().map(|c| (c - expected).powi(2) / expected).sum()
    }

    #[test]
    fn random_numbers_pass_a_chi_square_test() {
        // 255 degrees of freedom: mean 255, standard deviation 22.6; five of them either side.
        for dims in [(0, 1), (0, 2), (1, 3), (2, 3)] {
            let x = chi_square(Sampling::Random, 0, 100_000, dims);
            assert!((142.0..368.0).contains(&x), "{x}");
        }
    }

    #[test]
    fn sobol_points_are_far_more_even_than_chance() {
        for dims in [(0, 1), (0, 2), (1, 3), (2, 3)] {
            let x = chi_square(Sampling::Sobol, 0, 65_536, dims);
            assert!(x < 20.0, "{x}");
        }
    }

    #[test]
    fn blocks_do_not_repeat() {
        let sequence = Sequence::new(Sampling::Sobol, 3);
        assert_ne!(sequence.four(5, 0), sequence.four(5 + 65_536, 0));
        assert_ne!(sequence.four(5, 0), sequence.four(5, SETS));
    }
}
