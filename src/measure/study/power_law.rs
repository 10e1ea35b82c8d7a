//! Power laws through measured points: the order at which an error falls.

use serde::{Deserialize, Serialize};

/// A line through points in the log-log plane.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct PowerLaw {
    /// Exponent: y falls as `x^exponent`.
    pub exponent: f64,
    /// Standard error of the exponent from the scatter about the line; 0 for two points.
    pub standard_error: f64,
    /// Points that were used.
    pub points: usize,
    /// Largest x over smallest.
    pub range: f64,
}

impl PowerLaw {
    /// The least-squares fit to `(x, y)`; pairs that are not both positive and finite are left out. None with fewer than
    /// two different x.
    pub fn fit(points: impl IntoIterator<Item = (f64, f64)>) -> Option<Self> {
        let positive = |v: f64| v > 0.0 && v.is_finite();
        let logs: Vec<(f64, f64)> = points
            .into_iter()
            .filter(|(x, y)| positive(*x) && positive(*y))
            .map(|(x, y)| (libm::log(x), libm::log(y)))
            .collect();
        let n = logs.len() as f64;
        let (mx, my) = (logs.iter().map(|p| p.0).sum::<f64>() / n, logs.iter().map(|p| p.1).sum::<f64>() / n);
        let sxx: f64 = logs.iter().map(|p| (p.0 - mx).powi(2)).sum();
        if logs.len() < 2 || sxx <= 0.0 {
            return None;
        }
        let exponent = logs.iter().map(|p| (p.0 - mx) * (p.1 - my)).sum::<f64>() / sxx;
        let scatter: f64 = logs.iter().map(|p| (p.1 - my - exponent * (p.0 - mx)).powi(2)).sum();
        let (low, high) = logs.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |r, p| (r.0.min(p.0), r.1.max(p.0)));
        Some(Self {
            exponent,
            standard_error: if logs.len() > 2 { (scatter / (n - 2.0) / sxx).sqrt() } else { 0.0 },
            points: logs.len(),
            range: libm::exp(high - low),
        })
    }
}

/// The value at `x` on the polyline through `points` (x rising) in the log-log plane; None outside it.
pub fn interpolate(points: &[(f64, f64)], x: f64) -> Option<f64> {
    points.windows(2).find(|w| w[0].0 <= x && x <= w[1].0).map(|w| {
        let [(x0, y0), (x1, y1)] = [w[0], w[1]];
        if x0 == x1 || y0 <= 0.0 || y1 <= 0.0 {
            return y0.min(y1);
        }
        let t = libm::log(x / x0) / libm::log(x1 / x0);
        y0 * libm::exp(t * libm::log(y1 / y0))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_exact_power_comes_back() {
        let fit = PowerLaw::fit((1..9).map(|i| (f64::from(i), 3.0 * libm::pow(f64::from(i), -0.7)))).expect("a line");
        assert!((fit.exponent + 0.7).abs() < 1e-12 && fit.standard_error < 1e-10 && fit.points == 8);
        assert!((fit.range - 8.0).abs() < 1e-12);
    }

    /// Slope and standard error of a fit by hand: ln y = 0, 1, 0 at ln x = 0, 1, 2.
    #[test]
    fn scatter_is_told() {
        let e = std::f64::consts::E;
        let fit = PowerLaw::fit([(1.0, 1.0), (e, e), (e * e, 1.0)]).expect("a line");
        assert!(fit.exponent.abs() < 1e-12 && (fit.standard_error - (2.0f64 / 3.0 / 2.0).sqrt()).abs() < 1e-12);
    }

    #[test]
    fn what_has_no_logarithm_is_left_out() {
        assert!(PowerLaw::fit([(1.0, 0.0), (2.0, 1.0), (0.0, 1.0), (f64::NAN, 1.0)]).is_none());
        assert!(PowerLaw::fit([(2.0, 1.0), (2.0, 3.0)]).is_none());
        assert!(PowerLaw::fit([]).is_none());
    }

    #[test]
    fn a_polyline_is_straight_between_points_in_logarithms() {
        let points = [(1.0, 8.0), (4.0, 2.0), (16.0, 2.0)];
        assert!((interpolate(&points, 2.0).expect("inside") - 4.0).abs() < 1e-12);
        assert_eq!(interpolate(&points, 8.0), Some(2.0));
        assert_eq!(interpolate(&points, 17.0), None);
        assert_eq!(interpolate(&points, 0.5), None);
    }
}
