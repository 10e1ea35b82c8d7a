//! What the thesis prints (Pedersen 2011), with the place: data to compare with, never a result of this program.

use serde::Serialize;

/// Caustic photon differentials that were stored (section 5.1).
pub const STORED_CAUSTIC: u64 = 4978;
/// Global photon differentials that were stored (section 5.1).
pub const STORED_GLOBAL: u64 = 100_036;
/// Photon differentials in each point of intersection at most (section 5.1).
pub const K: i64 = 50;
/// Share of the rendering time of the coplanar method in `get_intersection` (section 5.2 and figure 19, page 41).
pub const POLYGON_SHARE: f64 = 0.915;
/// `√(π/4)`: the size of a footprint under eq. 37 and 38, in this program's footprint scale.
pub const PRINTED_SCALE: f64 = 0.886;
/// Default of `diff_smoothing` in the listing `ViewDiffTracer.h`, line 22 (appendix A, page 44).
pub const DIFF_SMOOTHING: f64 = 10.0;
/// Where the seconds stand.
pub const TABLE_1: &str = "Pedersen 2011, table 1, page 40";

/// A method of the thesis's comparison, and the seconds that table 1 gives for it.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct PrintedSeconds {
    /// As the thesis calls it.
    pub method: &'static str,
    /// This program's estimator, as the command line takes it.
    pub estimator: &'static str,
    /// Seconds of the rendering.
    pub seconds: f64,
}

/// Table 1, row by row; the first is the baseline.
pub const SECONDS: [PrintedSeconds; 4] = [
    PrintedSeconds { method: "Regular, 1×1 view rays/pixel", estimator: "regular", seconds: 20.637 },
    PrintedSeconds { method: "Regular, 3×3 view rays/pixel", estimator: "regular_3x3:n=3", seconds: 183.255 },
    PrintedSeconds {
        method: "Coplanar intersection-weighted",
        estimator: "coplanar:shape=parallelogram,weight=centroid",
        seconds: 380.045,
    },
    PrintedSeconds {
        method: "Multi-sampled, 8×8 sampling points",
        estimator: "multi_sampled:n=8,grid=closed",
        seconds: 63.671,
    },
];

/// The row of an estimator, None if the thesis does not time it.
pub fn of_estimator(name: &str) -> Option<PrintedSeconds> {
    SECONDS.into_iter().find(|s| s.estimator == name)
}

impl PrintedSeconds {
    /// Its seconds over those of the regular method with one view ray.
    pub fn ratio(&self) -> f64 {
        self.seconds / SECONDS[0].seconds
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::estimate::registry;

    /// The thesis's own words about table 1: nearly 9 times, about 19 times, about 3 times; and more than twice, and a
    /// third, of the time for 3×3 view rays.
    #[test]
    fn ratios_are_those_that_the_text_speaks_of() {
        let [regular, nine, coplanar, sampled] = SECONDS.map(|s| s.ratio());
        assert_eq!(regular, 1.0);
        assert!((nine - 8.880).abs() < 5e-4 && (coplanar - 18.416).abs() < 5e-4 && (sampled - 3.085).abs() < 5e-4);
        assert!(coplanar / nine > 2.0 && (nine / sampled - 2.878).abs() < 5e-4);
    }

    #[test]
    fn estimators_are_on_offer_by_these_names() {
        for printed in SECONDS {
            let estimator = registry::estimator(printed.estimator).expect("registered");
            assert_eq!(estimator.name(), printed.estimator);
            assert_eq!(of_estimator(&estimator.name()).map(|p| p.seconds), Some(printed.seconds));
        }
        assert!(of_estimator("integrated").is_none());
        assert!((PRINTED_SCALE - (std::f64::consts::PI / 4.0).sqrt()).abs() < 5e-4);
    }
}
