//! A curve: one setting's error as its time grows, over all seeds.

use crate::measure::ErrorMetrics;
use crate::measure::study::Setting;
use crate::measure::study::power_law::PowerLaw;
use crate::render::stats::Seconds;
use serde::Serialize;

/// All metrics of one image.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct StudyError {
    /// Errors as numbers.
    #[serde(flatten)]
    pub metrics: ErrorMetrics,
    /// Mean FLIP at the study's exposure.
    pub flip: f64,
}

/// One image: one seed at one checkpoint.
#[derive(Clone, Debug, Serialize)]
pub struct SeedPoint {
    /// The seed.
    pub seed: u64,
    /// Passes in the image.
    pub passes: u32,
    /// Photons emitted.
    pub photons: u64,
    /// Wall seconds of rendering.
    pub seconds: f64,
    /// The same by part; they add up to `seconds`.
    pub parts: Seconds,
    /// Error against the reference; None if it cannot be told from the reference's own noise.
    pub error: Option<StudyError>,
}

/// Median and extremes over the seeds.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Spread {
    /// Median; of an even number of values the mean of the middle two.
    pub median: f64,
    /// Smallest.
    pub low: f64,
    /// Largest.
    pub high: f64,
}

impl Spread {
    /// Of values; None without any.
    pub fn of(values: impl IntoIterator<Item = f64>) -> Option<Self> {
        let mut all: Vec<f64> = values.into_iter().collect();
        all.sort_unstable_by(f64::total_cmp);
        let (low, high) = (*all.first()?, *all.last()?);
        let (a, b) = (all[(all.len() - 1) / 2], all[all.len() / 2]);
        Some(Self { median: (a + b) / 2.0, low, high })
    }
}

/// What an error is made of, from images that differ in their seeds alone.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct BiasAndVariance {
    /// Root of the mean variance of a pixel, over the reference's mean.
    pub relative_noise: f64,
    /// Root of the mean squared bias of a pixel, over the reference's mean; None if it cannot be told from noise, that of
    /// the reference included.
    pub relative_bias: Option<f64>,
}

/// A checkpoint over all seeds.
#[derive(Clone, Debug, Serialize)]
pub struct Summary {
    /// Passes in each image.
    pub passes: u32,
    /// Photons emitted, the most of any seed.
    pub photons: u64,
    /// Seeds that came so far.
    pub seeds: usize,
    /// Wall seconds of rendering.
    pub seconds: Spread,
    /// Relative RMSE; None if the median cannot be told from the reference's noise.
    pub relative_rmse: Option<Spread>,
    /// Mean squared error without the reference's own noise, (W/(m² sr))²; None as for `relative_rmse`.
    pub net_mse: Option<f64>,
    /// Bias and variance; None with one seed.
    pub bias_and_variance: Option<BiasAndVariance>,
}

/// One setting of a study, judged.
#[derive(Clone, Debug, Serialize)]
pub struct Curve {
    /// Name of the estimator.
    pub id: String,
    /// All settings, as the command line takes them.
    pub settings: String,
    /// A short name among those of the study.
    pub label: String,
    /// What it was, in parts.
    pub setting: Setting,
    /// Whether it tends to the truth.
    pub consistent: bool,
    /// All images.
    pub points: Vec<SeedPoint>,
    /// The checkpoints, by rising passes.
    pub summary: Vec<Summary>,
    /// Mean squared error without the reference's noise, against median seconds.
    pub convergence: Option<PowerLaw>,
}

impl Curve {
    /// Median seconds and median relative RMSE of the checkpoints whose error can be told.
    pub fn line(&self) -> Vec<(f64, f64)> {
        self.summary.iter().filter_map(|s| Some((s.seconds.median, s.relative_rmse?.median))).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn medians_lie_in_the_middle() {
        assert_eq!(Spread::of([3.0, 1.0, 2.0]), Some(Spread { median: 2.0, low: 1.0, high: 3.0 }));
        assert_eq!(Spread::of([4.0, 1.0, 2.0, 8.0]).map(|s| s.median), Some(3.0));
        assert_eq!(Spread::of([]), None);
    }
}
