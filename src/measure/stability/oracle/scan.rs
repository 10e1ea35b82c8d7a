//! The kernel over polygon ∩ disc by scan lines: along a line in closed form, across them by quadrature.

use super::quadrature::integral;
use glam::DVec2;

/// Integral of `(1 - x² - y²)²` over the part of a convex polygon inside the unit disc, f64.
///
/// Between the heights at which vertices lie, edges cross the circle, and the circle begins or ends, the integrand
/// across the lines is smooth but for roots at the ends.
pub fn kernel_over(vertices: &[DVec2]) -> f64 {
    let n = vertices.len();
    let edges = || (0..n).map(|i| (vertices[i], vertices[(i + 1) % n]));
    let mut heights = vec![-1.0, 1.0];
    heights.extend(vertices.iter().map(|v| v.y));
    for (p, q) in edges() {
        let d = q - p;
        let (a, b, c) = (d.length_squared(), p.dot(d), p.length_squared() - 1.0);
        let rest = b * b - a * c;
        if a > 0.0 && rest > 0.0 {
            heights.extend([-1.0, 1.0].map(|s| p.y + d.y * (-b + s * rest.sqrt()) / a));
        }
    }
    heights.retain(|y| y.is_finite() && y.abs() <= 1.0);
    heights.sort_by(f64::total_cmp);
    heights.dedup();
    let line = |y: f64| {
        let half = (1.0 - y * y).max(0.0).sqrt();
        let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
        for (p, q) in edges() {
            if (p.y <= y) != (q.y <= y) {
                let x = p.x + (q.x - p.x) * ((y - p.y) / (q.y - p.y));
                low = low.min(x);
                high = high.max(x);
            }
        }
        let (low, high) = (low.max(-half), high.min(half));
        if low >= high {
            return 0.0;
        }
        // ∫ (h - x²)² dx with h = 1 - y², about the middle so that short ways keep their digits.
        let (h, m, r) = (1.0 - y * y, (low + high) / 2.0, (high - low) / 2.0);
        let g = h - m * m;
        2.0 * r * (g * g + r * r / 3.0 * (4.0 * m * m - 2.0 * g) + r.powi(4) / 5.0)
    };
    heights.windows(2).map(|w| integral(&line, w[0], w[1], 1e-15 * (w[1] - w[0]).max(1e-3))).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn whole_disc_and_half() {
        let square = |h: f64| [DVec2::splat(-h), DVec2::new(h, -h), DVec2::splat(h), DVec2::new(-h, h)];
        assert!((kernel_over(&square(2.0)) - std::f64::consts::PI / 3.0).abs() < 1e-12);
        let half = square(2.0).map(|v| v + DVec2::X * 2.0);
        assert!((kernel_over(&half) - std::f64::consts::PI / 6.0).abs() < 1e-12);
        // Inside: ∫∫ (1 - x² - y²)² over [-h, h]².
        let h = 0.3f64;
        let exact = 4.0 * (h * h - 4.0 * h.powi(4) / 3.0 + 2.0 * h.powi(6) / 5.0 + 2.0 * h.powi(6) / 9.0);
        assert!((kernel_over(&square(h)) - exact).abs() < 1e-14, "{} {exact}", kernel_over(&square(h)));
    }
}
