//! Which setting is best for which budget of time.

use crate::measure::study::Curve;
use crate::measure::study::power_law::interpolate;
use serde::Serialize;

/// The best setting for a budget.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Best {
    /// Seconds to spend.
    pub seconds: f64,
    /// Index of the curve among those of the study.
    pub curve: usize,
    /// Its label.
    pub label: String,
    /// Its relative RMSE there.
    pub relative_rmse: f64,
    /// Errors of the others over this one, in the order of the curves; 1 for itself, None where a curve has not begun.
    pub ratios: Vec<Option<f64>>,
}

/// Relative RMSE of a curve after `seconds`: between its checkpoints on a straight line in logarithms. Whoever has more
/// time than the curve can stop, so beyond its end the last value holds. None before its first checkpoint.
pub fn error_at(line: &[(f64, f64)], seconds: f64) -> Option<f64> {
    let last = line.last()?;
    if seconds >= last.0 { Some(last.1) } else { interpolate(line, seconds) }
}

/// The best curve for budgets that double, from the earliest checkpoint of any to the last of any.
pub fn best_of_budgets(curves: &[Curve]) -> Vec<Best> {
    let lines: Vec<Vec<(f64, f64)>> = curves.iter().map(Curve::line).collect();
    let times = || lines.iter().flatten().map(|p| p.0).filter(|t| *t > 0.0);
    let (low, high) = (times().fold(f64::INFINITY, f64::min), times().fold(0.0, f64::max));
    let mut all = Vec::new();
    let mut budget = round_up(low);
    while budget.is_finite() && budget <= high * 2.0 {
        let errors: Vec<Option<f64>> = lines.iter().map(|l| error_at(l, budget)).collect();
        let best = errors.iter().enumerate().filter_map(|(i, e)| Some((i, (*e)?))).min_by(|a, b| a.1.total_cmp(&b.1));
        if let Some((curve, error)) = best {
            all.push(Best {
                seconds: budget,
                curve,
                label: curves[curve].label.clone(),
                relative_rmse: error,
                ratios: errors.iter().map(|e| e.filter(|_| error > 0.0).map(|e| e / error)).collect(),
            });
        }
        budget *= 2.0;
    }
    all
}

/// The next power of two.
fn round_up(x: f64) -> f64 {
    libm::exp2(libm::ceil(libm::log2(x)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::measure::study::curve::{Spread, Summary};
    use crate::measure::study::setting::Setting;
    use crate::render::Gather;

    fn curve(label: &str, line: &[(f64, f64)]) -> Curve {
        let one = |v| Spread { median: v, low: v, high: v };
        let summary = line.iter().zip(1..).map(|(&(s, e), passes)| Summary {
            passes,
            photons: 0,
            seeds: 1,
            seconds: one(s),
            relative_rmse: Some(one(e)),
            net_mse: None,
            bias_and_variance: None,
        });
        let setting =
            Setting { estimator: label.into(), gather: Gather::Overlap, photons: 1, k: None, footprint_scale: None };
        Curve {
            id: label.into(),
            settings: String::new(),
            label: label.into(),
            setting,
            consistent: true,
            points: Vec::new(),
            summary: summary.collect(),
            convergence: None,
        }
    }

    #[test]
    fn the_best_changes_with_the_budget() {
        // One starts early and stays; the other starts late and falls.
        let curves = [curve("quick", &[(0.5, 0.2), (8.0, 0.2)]), curve("slow", &[(1.5, 0.4), (6.0, 0.1)])];
        let best = best_of_budgets(&curves);
        let names: Vec<_> = best.iter().map(|b| (b.seconds, b.label.as_str())).collect();
        assert_eq!(
            names,
            [(0.5, "quick"), (1.0, "quick"), (2.0, "quick"), (4.0, "slow"), (8.0, "slow"), (16.0, "slow")]
        );
        assert_eq!((best[0].ratios[1], best[5].ratios[0]), (None, Some(2.0)));
        assert!(best_of_budgets(&[]).is_empty() && best_of_budgets(&[curve("empty", &[])]).is_empty());
    }
}
