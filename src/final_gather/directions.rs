//! How the gather rays of one point are spread over its hemisphere, and how wide each of them is.

use crate::estimate::final_gathering::GatherPattern;
use crate::math::hash::mix;
use crate::math::sequence::{Sampling, Sequence};
use crate::photons::emission::{GRAZING_COSINE, cone_radius, cosine_solid_angle};
use std::f32::consts::PI;

/// Turns between one direction of a spiral and the next: the golden angle.
const GOLDEN_TURN: f64 = 0.618_033_988_749_894_9;

/// Numbers of a point's gather rays, cosine-weighted when mapped to the hemisphere.
pub struct Directions {
    pattern: GatherPattern,
    rays: u32,
    sequence: Sequence,
    /// Where a spiral begins: offset from centre to rim, and turn.
    start: [f64; 2],
}

impl Directions {
    /// Of `rays` rays; the same seed gives the same ones.
    pub fn new(pattern: GatherPattern, rays: u32, seed: u64) -> Self {
        let sampling = if pattern == GatherPattern::Sobol { Sampling::Sobol } else { Sampling::Random };
        let unit = |word: u64| (word >> 11) as f64 / (1u64 << 53) as f64;
        let start = [unit(mix(seed, 1)), unit(mix(seed, 2))];
        Self { pattern, rays, sequence: Sequence::new(sampling, seed), start }
    }

    /// Two numbers in `[0, 1)` for ray `i`: the squared sine of its angle to the normal, and its turn about it.
    pub fn square(&self, i: u32) -> [f32; 2] {
        let n = u64::from(self.rays);
        let i = u64::from(i);
        match self.pattern {
            GatherPattern::Sobol => {
                let x = self.sequence.four(i, 0);
                [x[0], x[1]]
            }
            GatherPattern::Spiral => {
                let turn = i as f64 * GOLDEN_TURN + self.start[1];
                [below_one((i as f64 + self.start[0]) / n as f64), below_one(turn - turn.floor())]
            }
            GatherPattern::Stratified => {
                // Rings of strata that are about as wide as long; ring r holds the rays from r N/M to (r + 1) N/M.
                let rings = ring_count(self.rays);
                let ring = ((i + 1) * rings - 1) / n;
                let (first, next) = (ring * n / rings, (ring + 1) * n / rings);
                let count = (next - first) as f64;
                let x = self.sequence.four(i, 0);
                [
                    below_one((first as f64 + f64::from(x[0]) * count) / n as f64),
                    below_one(((i - first) as f64 + f64::from(x[1])) / count),
                ]
            }
        }
    }

    /// Two more numbers in `[0, 1)` for what ray `i` meets, the `set`-th time.
    pub fn more(&self, i: u32, set: u32) -> [f32; 2] {
        let x = self.sequence.four(u64::from(i), 1 + set);
        [x[2], x[3]]
    }
}

/// Rings of the stratified pattern: `M ≈ √(N/π)` rings of about `πM` strata (Jensen 2003).
fn ring_count(rays: u32) -> u64 {
    ((f64::from(rays) / std::f64::consts::PI).sqrt().round() as u64).clamp(1, u64::from(rays.max(1)))
}

fn below_one(x: f64) -> f32 {
    (x as f32).min(1.0 - f32::EPSILON / 2.0)
}

/// Half-axis of the disc of directions that one of `rays` cosine-weighted rays with `cos` to the normal owns.
///
/// `1/√(N cos θ)`, from the solid angle `π/(N cos θ)`; as published `√(2π/N)/cos θ` (Gjøl et al., section 3). The cosine
/// counts as [`GRAZING_COSINE`] at least.
pub fn footprint_radius(rays: u32, cos: f32, as_published: bool) -> f32 {
    let n = rays as f32;
    if as_published {
        (2.0 * PI / n).sqrt() / cos.max(GRAZING_COSINE)
    } else {
        cone_radius(cosine_solid_angle(n, cos).0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::frame::cosine_hemisphere;
    use glam::Vec3;

    const PATTERNS: [GatherPattern; 3] = [GatherPattern::Stratified, GatherPattern::Sobol, GatherPattern::Spiral];

    /// Means over many seeds of functions of the direction against their integrals over the density cos θ/π.
    #[test]
    fn all_patterns_are_cosine_weighted() {
        for pattern in PATTERNS {
            for rays in [1, 7, 200] {
                let (seeds, mut sums) = (40_000 / rays, [0.0f64; 3]);
                for seed in 0..seeds {
                    let directions = Directions::new(pattern, rays, u64::from(seed));
                    for i in 0..rays {
                        let [u, v] = directions.square(i);
                        assert!((0.0..1.0).contains(&u) && (0.0..1.0).contains(&v), "{u} {v}");
                        let w = cosine_hemisphere(Vec3::Z, u, v);
                        sums[0] += f64::from(w.z);
                        sums[1] += f64::from(w.x * w.x);
                        sums[2] += f64::from(w.x * w.z);
                    }
                }
                let count = f64::from(seeds * rays);
                // ∫ cos² θ/π = 2/3; ∫ sin² θ cos² φ cos θ/π = 1/4. Five standard deviations of 40 000 random directions.
                let [a, b, c] = sums.map(|s| s / count);
                assert!((a - 2.0 / 3.0).abs() < 0.006, "{pattern:?} {rays}: {a}");
                assert!((b - 0.25).abs() < 0.006 && c.abs() < 0.008, "{pattern:?} {rays}: {b} {c}");
            }
        }
    }

    /// Each stratum of the stratified pattern holds one ray: sorted by ring and sector they are counted.
    #[test]
    fn strata_hold_one_ray_each() {
        for rays in [1u32, 2, 5, 50, 200, 777] {
            let directions = Directions::new(GatherPattern::Stratified, rays, 3);
            let (n, rings) = (u64::from(rays), ring_count(rays));
            let mut seen = std::collections::BTreeSet::new();
            for i in 0..rays {
                let [u, v] = directions.square(i);
                let ring =
                    (0..rings).find(|r| f64::from(u) * (n as f64) < ((r + 1) * n / rings) as f64).expect("a ring");
                let count = (ring + 1) * n / rings - ring * n / rings;
                seen.insert((ring, (f64::from(v) * count as f64) as u64));
            }
            // Rounding to f32 may put one across its border.
            assert!(seen.len() as u32 + 1 >= rays, "{rays}: {}", seen.len());
        }
    }

    /// Discs of the corrected radius share the hemisphere: the sum of their solid angles is 2π (one over the density's mean).
    #[test]
    fn footprints_share_the_hemisphere() {
        let rays = 4096;
        let directions = Directions::new(GatherPattern::Spiral, rays, 5);
        let sum = |published: bool| -> f64 {
            (0..rays)
                .map(|i| {
                    let [u, v] = directions.square(i);
                    let r = f64::from(footprint_radius(rays, cosine_hemisphere(Vec3::Z, u, v).z, published));
                    std::f64::consts::PI * r * r
                })
                .sum()
        };
        let whole = std::f64::consts::TAU;
        // The bound at grazing angles leaves out a strip below 1 % of the hemisphere.
        assert!((sum(false) / whole - 1.0).abs() < 0.02, "{}", sum(false) / whole);
        // As published they overlap: each has 2π times the area at the pole, and more towards the rim.
        assert!(sum(true) / whole > std::f64::consts::TAU, "{}", sum(true) / whole);
    }
}
