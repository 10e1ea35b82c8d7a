//! The kernel's mean over a view footprint: along one axis in closed form, along the other by quadrature.

use super::quadrature::integral;
use glam::DVec3;

/// Mean of `(1 - |c + s a + t b|²)²` over `|s|, |t| ≤ 1`, 0 where the square is above 1; f64.
///
/// Nothing is projected, so footprints without width, with parallel axes or without any extent are no cases of their
/// own. The longer axis is the one that is done in closed form.
pub fn mean_over(c: DVec3, a: DVec3, b: DVec3) -> f64 {
    let (a, b) = if a.length_squared() > b.length_squared() { (b, a) } else { (a, b) };
    let bb = b.length_squared();
    let line = |s: f64| along(c + a * s, b, bb);
    if a == DVec3::ZERO {
        return line(0.0) / 2.0;
    }
    let mut breaks = vec![-1.0, 1.0];
    for corner in [c - b, c + b] {
        breaks.extend(roots(corner, a));
    }
    if bb > 0.0 {
        let across = |v: DVec3| v - b * (v.dot(b) / bb);
        breaks.extend(roots(across(c), across(a)));
    }
    breaks.retain(|s| s.abs() <= 1.0);
    breaks.sort_by(f64::total_cmp);
    let scale = breaks.windows(2).map(|w| line((w[0] + w[1]) / 2.0)).fold(0.0, f64::max);
    breaks.windows(2).map(|w| integral(&line, w[0], w[1], 1e-15 * scale * (w[1] - w[0]))).sum::<f64>() / 4.0
}

/// The largest mean that a footprint with axes `a`, `b` can have: its mean where it lies about the photon.
pub fn largest_mean(a: DVec3, b: DVec3) -> f64 {
    mean_over(DVec3::ZERO, a, b)
}

/// `∫ (1 - |p + t b|²)²₊ dt` over `|t| ≤ 1`.
fn along(p: DVec3, b: DVec3, bb: f64) -> f64 {
    if bb == 0.0 {
        return 2.0 * (1.0 - p.length_squared()).max(0.0).powi(2);
    }
    let nearest = -p.dot(b) / bb;
    let h = 1.0 - (p + b * nearest).length_squared();
    if h <= 0.0 {
        return 0.0;
    }
    let half = (h / bb).sqrt();
    let (low, high) = ((nearest - half).max(-1.0), (nearest + half).min(1.0));
    if low >= high {
        return 0.0;
    }
    // (h - bb x²)² with x from the nearest point.
    let (m, r) = ((low + high) / 2.0 - nearest, (high - low) / 2.0);
    let g = h - bb * m * m;
    2.0 * r * (g * g + r * r / 3.0 * (4.0 * bb * bb * m * m - 2.0 * bb * g) + bb * bb * r.powi(4) / 5.0)
}

/// Parameters s at which `p + s d` lies on the unit sphere.
fn roots(p: DVec3, d: DVec3) -> Vec<f64> {
    let dd = d.length_squared();
    if dd == 0.0 {
        return Vec::new();
    }
    let nearest = -p.dot(d) / dd;
    let rest = 1.0 - (p + d * nearest).length_squared();
    if rest < 0.0 {
        return Vec::new();
    }
    let half = (rest / dd).sqrt();
    vec![nearest - half, nearest + half]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn known_means_come_out() {
        let wide = mean_over(DVec3::new(0.1, 0.0, 0.0), DVec3::X * 3.0, DVec3::Y * 50.0);
        assert!((wide - std::f64::consts::PI / 3.0 / 600.0).abs() < 1e-15, "{wide}");
        assert_eq!(mean_over(DVec3::Z * 0.5, DVec3::ZERO, DVec3::ZERO), 0.5625);
        // A segment through the centre that reaches out: ∫ (1 - x²)² dx = 16/15.
        let segment = mean_over(DVec3::ZERO, DVec3::X * 4.0, DVec3::ZERO);
        assert!((segment - 16.0 / 15.0 / 8.0).abs() < 1e-15);
        // A grid.
        let (c, a, b) = (DVec3::new(0.7, -0.2, 0.3), DVec3::new(0.5, 0.3, -0.2), DVec3::new(-0.2, 0.6, 0.4));
        let n = 2000;
        let at = |i: i32| (2.0 * f64::from(i) + 1.0) / f64::from(n) - 1.0;
        let mut sum = 0.0;
        for i in 0..n {
            for j in 0..n {
                sum += (1.0 - (c + a * at(i) + b * at(j)).length_squared()).max(0.0).powi(2);
            }
        }
        assert!((mean_over(c, a, b) - sum / f64::from(n * n)).abs() < 1e-6);
    }
}
