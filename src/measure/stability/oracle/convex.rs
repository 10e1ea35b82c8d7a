//! Overlap of a parallelogram and a convex polygon, line by line across the parallelogram.

use glam::DVec2;

/// Nodes and weights of the three-point rule on [-1, 1], which is exact up to the fifth power.
const GAUSS: [(f64, f64); 3] =
    [(-0.774_596_669_241_483_4, 5.0 / 9.0), (0.0, 8.0 / 9.0), (0.774_596_669_241_483_4, 5.0 / 9.0)];

/// Area of the part of the parallelogram `c + s a + t b`, `|s|, |t| ≤ 1`, inside the half-planes `normal · x ≤ distance`,
/// over the parallelogram's, and that part's centroid in `(s, t)`.
///
/// On a line of constant s each half-plane bounds t. Between the places where two bounds cross they are straight. No
/// system is solved, so that a parallelogram without width is as good as any.
pub fn covered(planes: &[(DVec2, f64)], c: DVec2, a: DVec2, b: DVec2) -> (f64, DVec2) {
    // Each bound as p + q s + r t <= 0.
    let mut bounds: Vec<[f64; 3]> = planes.iter().map(|(n, d)| [n.dot(c) - d, n.dot(a), n.dot(b)]).collect();
    bounds.extend([[-1.0, 0.0, 1.0], [-1.0, 0.0, -1.0]]);
    let mut breaks = vec![-1.0, 1.0];
    for (i, u) in bounds.iter().enumerate() {
        if u[2] == 0.0 && u[1] != 0.0 {
            breaks.push(-u[0] / u[1]);
        }
        for v in &bounds[..i] {
            let det = u[1] * v[2] - v[1] * u[2];
            if det != 0.0 {
                breaks.push((v[0] * u[2] - u[0] * v[2]) / det);
            }
        }
    }
    breaks.retain(|s| s.abs() <= 1.0);
    breaks.sort_by(f64::total_cmp);
    let (mut area, mut moment) = (0.0, DVec2::ZERO);
    for w in breaks.windows(2) {
        let (middle, radius) = ((w[0] + w[1]) / 2.0, (w[1] - w[0]) / 2.0);
        for (x, weight) in GAUSS {
            let s = middle + radius * x;
            let (mut low, mut high) = (f64::NEG_INFINITY, f64::INFINITY);
            for [p, q, r] in &bounds {
                let rest = -(p + q * s);
                if *r > 0.0 {
                    high = high.min(rest / r);
                } else if *r < 0.0 {
                    low = low.max(rest / r);
                } else if rest < 0.0 {
                    high = f64::NEG_INFINITY;
                }
            }
            if low < high {
                let length = (high - low) * weight * radius;
                area += length;
                moment += DVec2::new(s, (low + high) / 2.0) * length;
            }
        }
    }
    (area / 4.0, if area > 0.0 { moment / area } else { DVec2::ZERO })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_corner_is_cut_and_a_segment_too() {
        let square = [DVec2::X, DVec2::Y, DVec2::NEG_X, DVec2::NEG_Y].map(|n| (n, 1.0));
        for (a, b) in [(DVec2::X, DVec2::Y), (DVec2::Y, DVec2::X)] {
            let (share, centroid) = covered(&square, DVec2::ONE, a, b);
            assert!((share - 0.25).abs() < 1e-15 && (centroid - DVec2::splat(-0.5)).length() < 1e-15);
        }
        let (share, centroid) = covered(&square, DVec2::X, DVec2::X, DVec2::ZERO);
        assert!((share - 0.5).abs() < 1e-15 && (centroid - DVec2::new(-0.5, 0.0)).length() < 1e-15);
    }
}
