//! How even a set of directions is: χ² over cells of equal area, star discrepancy of the square, cap discrepancy of the
//! sphere.

use glam::DVec3;
use serde::Serialize;
use std::f64::consts::TAU;

/// χ² of the counts in cells of equal area.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct ChiSquare {
    /// The statistic; its mean over sets of random points is that of the degrees of freedom.
    pub statistic: f64,
    /// Cells less one.
    pub degrees: u32,
    /// Standard deviations by which it lies above what random points have (Wilson and Hilferty 1931); far below zero for
    /// points that are more even.
    pub deviations: f64,
}

/// χ² of points of the unit square over `bands` × `columns` cells.
pub fn chi_square(points: &[[f32; 2]], bands: usize, columns: usize) -> ChiSquare {
    let mut cells = vec![0u32; bands * columns];
    for [u, v] in points {
        let at = |x: f32, n: usize| ((f64::from(x) * n as f64) as usize).min(n - 1);
        cells[at(*u, bands) * columns + at(*v, columns)] += 1;
    }
    let expected = points.len() as f64 / cells.len() as f64;
    let statistic =
        if expected > 0.0 { cells.iter().map(|&c| (f64::from(c) - expected).powi(2) / expected).sum() } else { 0.0 };
    let degrees = (cells.len() - 1) as f64;
    let spread = 2.0 / (9.0 * degrees);
    let deviations = (libm::cbrt(statistic / degrees) - (1.0 - spread)) / spread.sqrt();
    ChiSquare { statistic, degrees: degrees as u32, deviations }
}

/// Star discrepancy of points of the unit square: the largest difference between the share of points in a rectangle from
/// the corner (0, 0) and its area, over all rectangles. Exact; its time goes with the square of the number of points.
pub fn star_discrepancy(points: &[[f32; 2]]) -> f64 {
    let n = points.len() as f64;
    let mut by_u: Vec<[f64; 2]> = points.iter().map(|p| p.map(f64::from)).collect();
    by_u.sort_unstable_by(|a, b| a[0].total_cmp(&b[0]));
    let mut worst = 0.0f64;
    // Second coordinates of the points up to the current one, sorted.
    let mut heights: Vec<f64> = Vec::with_capacity(points.len());
    let mut at_width = |width: f64, heights: &[f64]| {
        for (i, h) in heights.iter().chain([&1.0]).enumerate() {
            // The rectangle that just leaves out the point of this height, and the one that just holds it.
            worst = worst.max((width * h - i as f64 / n).abs());
            let held = (i + 1).min(heights.len()) as f64;
            worst = worst.max((held / n - width * h).abs());
        }
    };
    for (i, p) in by_u.iter().enumerate() {
        // Widths that just leave out what is at this place and beyond.
        if i == 0 || by_u[i - 1][0] < p[0] {
            at_width(p[0], &heights);
        }
        let place = heights.partition_point(|h| *h <= p[1]);
        heights.insert(place, p[1]);
        if by_u.get(i + 1).is_none_or(|q| q[0] > p[0]) {
            at_width(p[0], &heights);
        }
    }
    at_width(1.0, &heights);
    worst
}

/// Cap discrepancy of the directions of the sphere: the largest difference between the share of points in a cap and its
/// share of the area, over all caps about `axes` axes that are spread evenly.
pub fn cap_discrepancy(points: &[[f32; 2]], axes: usize) -> f64 {
    let directions: Vec<DVec3> = points.iter().map(|p| on_sphere(*p)).collect();
    let n = directions.len() as f64;
    let mut heights = vec![0.0f64; directions.len()];
    let mut worst = 0.0f64;
    for axis in super::Distribution::Spiral.set(axes, 0).iter().map(|p| on_sphere(*p)) {
        heights.iter_mut().zip(&directions).for_each(|(h, d)| *h = d.dot(axis).clamp(-1.0, 1.0));
        heights.sort_unstable_by(f64::total_cmp);
        for (i, h) in heights.iter().enumerate() {
            // The cap below a height has a share of the area that grows as the height.
            let area = (1.0 + h) / 2.0;
            worst = worst.max((area - i as f64 / n).abs()).max(((i + 1) as f64 / n - area).abs());
        }
    }
    worst
}

/// The direction of a point of the square.
pub fn on_sphere([u, v]: [f32; 2]) -> DVec3 {
    let z = 1.0 - 2.0 * f64::from(u);
    let r = (1.0 - z * z).max(0.0).sqrt();
    let (s, c) = libm::sincos(TAU * f64::from(v));
    DVec3::new(r * c, r * s, z)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::realtime::distribution::Distribution;

    /// By trying every corner that the points' coordinates make.
    fn star_by_brute_force(points: &[[f32; 2]]) -> f64 {
        let mut worst = 0.0f64;
        let ends = |axis: usize| points.iter().map(move |p| f64::from(p[axis])).chain([1.0]);
        for a in ends(0) {
            for b in ends(1) {
                let share = |inside: fn(f64, f64) -> bool| {
                    points.iter().filter(|p| inside(f64::from(p[0]), a) && inside(f64::from(p[1]), b)).count() as f64
                        / points.len() as f64
                };
                let (open, closed) = (share(|x, y| x < y), share(|x, y| x <= y));
                worst = worst.max((a * b - open).abs()).max((closed - a * b).abs());
            }
        }
        worst
    }

    #[test]
    fn star_discrepancies_are_those_of_brute_force() {
        for kind in Distribution::ALL {
            for n in [1, 2, 7, 60] {
                let points = kind.set(n, 5);
                let (fast, slow) = (star_discrepancy(&points), star_by_brute_force(&points));
                assert!((fast - slow).abs() < 1e-12, "{kind:?} {n}: {fast} {slow}");
            }
        }
        // Points that share coordinates.
        let grid: Vec<[f32; 2]> = (0..25).map(|i| [(i % 5) as f32 / 5.0, (i / 5) as f32 / 5.0]).collect();
        assert!((star_discrepancy(&grid) - star_by_brute_force(&grid)).abs() < 1e-12);
    }

    #[test]
    fn one_point_on_the_pole_leaves_all_of_a_cap_or_nothing() {
        assert!((cap_discrepancy(&[[0.0, 0.0]], 50) - 1.0).abs() < 0.02);
    }

    /// Random directions pass; the others are far more even than chance.
    #[test]
    fn every_distribution_has_its_chi_square() {
        for seed in 1..4 {
            for kind in [Distribution::Rejection, Distribution::Explicit] {
                let c = chi_square(&kind.set(20_000, seed), 16, 32);
                assert!(c.deviations.abs() < 4.0, "{kind:?} {c:?}");
            }
            for kind in
                [Distribution::SaffKuijlaars, Distribution::Spiral, Distribution::Stratified, Distribution::Sobol]
            {
                let c = chi_square(&kind.set(20_000, seed), 16, 32);
                assert!(c.deviations < -10.0, "{kind:?} {c:?}");
            }
        }
    }

    /// Points of both spirals about φ = 0, where figure 3.7 shows a bare band: as many as their share of the area.
    #[test]
    fn no_spiral_has_a_bare_band() {
        for kind in [Distribution::SaffKuijlaars, Distribution::Spiral] {
            for n in [500, 1000, 5000] {
                for width in [0.01, 0.03] {
                    let points = kind.set(n, 0);
                    let inside = |p: &[f32; 2]| p[0] > 0.1 && p[0] < 0.9 && (p[1] < width || p[1] > 1.0 - width);
                    let found = points.iter().filter(|p| inside(p)).count() as f32;
                    let expected = n as f32 * 0.8 * 2.0 * width;
                    assert!((found - expected).abs() <= 2.0 + 0.07 * expected, "{kind:?} {n}: {found} of {expected}");
                }
            }
        }
    }

    #[test]
    fn even_sets_have_small_discrepancies() {
        let n = 1024;
        let star = |k: Distribution| star_discrepancy(&k.set(n, 3));
        let cap = |k: Distribution| cap_discrepancy(&k.set(n, 3), 200);
        for random in [Distribution::Rejection, Distribution::Explicit] {
            assert!(star(Distribution::Sobol) < star(random) / 4.0);
            for even in
                [Distribution::Sobol, Distribution::Spiral, Distribution::Stratified, Distribution::SaffKuijlaars]
            {
                assert!(cap(even) < cap(random) / 1.5, "{even:?} {} {random:?} {}", cap(even), cap(random));
            }
        }
    }

    /// Every set has as many points as asked for, all in the square.
    #[test]
    fn sets_are_whole() {
        for kind in Distribution::ALL {
            for n in [0, 1, 2, 3, 36, 1000] {
                for seed in [0, 9] {
                    let points = kind.set(n, seed);
                    assert_eq!(points.len(), n);
                    assert!(points.iter().flatten().all(|x| (0.0..1.0).contains(x)), "{kind:?}");
                }
            }
        }
    }
}
