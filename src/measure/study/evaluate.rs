//! Judging: the images of a study against a reference.

use crate::estimate::registry;
use crate::measure::flip::{FlipView, flip};
use crate::measure::metrics::compare;
use crate::measure::reference::noise::mean_over;
use crate::measure::study::curve::{BiasAndVariance, Spread};
use crate::measure::study::pareto::{Best, best_of_budgets};
use crate::measure::study::power_law::PowerLaw;
use crate::measure::study::setting::labels;
use crate::measure::study::study_plan::Task;
use crate::measure::study::{Checkpoint, Curve, SeedPoint, StudyError, StudyPlan, Summary, TaskRecord};
use crate::measure::{Mask, Reference};
use crate::render::film::{Image, Rect};
use glam::DVec3;
use rayon::prelude::*;
use std::borrow::Cow;

/// How often the reference's noise an error must be, both squared, to be told from it: the noise adds to the squares.
pub const TOLD_FROM_NOISE: f64 = 2.0;

/// A reference with the part of it that counts.
pub struct Judge<'a> {
    reference: &'a Reference,
    mask: Mask,
    mean: f64,
    noise_mse: Option<f64>,
    exposure: f32,
}

impl<'a> Judge<'a> {
    /// Over the reference's mask, inside `crop` (pixels of the reference) if there is one. `exposure` is FLIP's, in stops.
    ///
    /// # Errors
    /// A crop that leaves no pixel.
    pub fn new(reference: &'a Reference, crop: Option<Rect>, exposure: f32) -> Result<Self, String> {
        let mask = crop.map_or_else(|| reference.mask.clone(), |c| reference.mask.within(c));
        let mean =
            mean_over(&reference.image, &mask).ok_or("no pixel of the reference counts; give another mask or crop")?;
        let noise_mse = reference.noise_mse(&mask);
        Ok(Self { reference, mean, mask, noise_mse, exposure })
    }

    /// Mean squared noise of the reference over the pixels that count, (W/(m² sr))²; None if unknown.
    pub fn noise_mse(&self) -> Option<f64> {
        self.noise_mse
    }

    /// The noise over the reference's mean.
    pub fn relative_noise(&self) -> Option<f64> {
        self.noise_mse.map(|n| self.relative(n))
    }

    /// Root of a mean square over the reference's mean; 0 for a black reference.
    fn relative(&self, mse: f64) -> f64 {
        if self.mean > 0.0 { (mse.max(0.0).sqrt() / self.mean).min(f64::MAX) } else { 0.0 }
    }

    /// Pixels that count.
    pub fn pixels(&self) -> usize {
        self.mask.counts.iter().filter(|c| **c).count()
    }

    /// FLIP's exposure, stops.
    pub fn exposure(&self) -> f32 {
        self.exposure
    }

    /// Whether a mean squared error can be told from the reference's noise.
    pub fn tells(&self, mse: f64) -> bool {
        self.noise_mse.is_none_or(|noise| mse >= TOLD_FROM_NOISE * noise)
    }

    /// An image in the size of the reference, as [`Reference::fitted`].
    ///
    /// # Errors
    /// A size that does not fit.
    pub fn fitted(&self, image: &Image) -> Result<Image, String> {
        self.reference.fitted(image).map(Cow::into_owned)
    }

    /// All metrics of a fitted image.
    ///
    /// # Errors
    /// Another size.
    pub fn error(&self, image: &Image) -> Result<StudyError, String> {
        let metrics = compare(image, &self.reference.image, &self.mask)?;
        let map = flip(image, &self.reference.image, FlipView::exposed(self.exposure))?;
        Ok(StudyError { metrics, flip: map.mean(&self.mask).unwrap_or(0.0) })
    }

    /// Bias and variance of fitted images of the same size; None with fewer than two.
    pub fn bias_and_variance(&self, images: &[Image]) -> Option<BiasAndVariance> {
        let n = images.len() as f64;
        if images.len() < 2 {
            return None;
        }
        let (mut variance, mut distance, mut values) = (0.0, 0.0, 0.0);
        for (i, counts) in self.mask.counts.iter().enumerate() {
            if *counts {
                let mean = images.iter().map(|m| m.pixels[i].as_dvec3()).sum::<DVec3>() / n;
                let squares = images.iter().map(|m| (m.pixels[i].as_dvec3() - mean).length_squared()).sum::<f64>();
                variance += squares / (n - 1.0);
                distance += (mean - self.reference.image.pixels[i].as_dvec3()).length_squared();
                values += 3.0;
            }
        }
        let (variance, distance) = (variance / values, distance / values);
        // The mean image keeps an nth of the variance, and the reference's noise is in the distance too.
        let noise = self.noise_mse.unwrap_or(0.0);
        let bias = distance - variance / n - noise;
        let told = bias > (noise + variance / n) / 2.0;
        Some(BiasAndVariance {
            relative_noise: self.relative(variance),
            relative_bias: told.then(|| self.relative(bias)),
        })
    }
}

/// A study, judged.
pub struct Evaluation {
    /// One curve for each setting with at least one finished task.
    pub curves: Vec<Curve>,
    /// Which setting is best for each budget of time.
    pub pareto: Vec<Best>,
}

impl Evaluation {
    /// Judges all finished tasks. `image` reads the image of a task after so many passes.
    ///
    /// # Errors
    /// What `image` returns, or images that do not fit the reference.
    pub fn new(
        plan: &StudyPlan,
        records: &[TaskRecord],
        judge: &Judge,
        image: &(dyn Fn(Task, u32) -> Result<Image, String> + Sync),
    ) -> Result<Self, String> {
        let names = labels(&plan.settings);
        let judged: Result<Vec<Vec<Group>>, String> = (0..plan.settings.len())
            .map(|setting| {
                let own: Vec<&TaskRecord> = records.iter().filter(|r| r.setting == setting).collect();
                let mut passes: Vec<u32> = own.iter().flat_map(|r| r.points.iter().map(|p| p.passes)).collect();
                passes.sort_unstable();
                passes.dedup();
                passes.into_par_iter().map(|p| Group::new(&own, p, judge, image)).collect()
            })
            .collect();
        let judged = judged?;
        let curves: Vec<Curve> = judged
            .into_iter()
            .zip(plan.settings.iter().zip(names))
            .filter(|(groups, _)| !groups.is_empty())
            .map(|(groups, (setting, label))| {
                let (points, summary): (Vec<_>, Vec<_>) = groups.into_iter().map(|g| (g.points, g.summary)).unzip();
                let (_, own, gathering) = registry::parts(&setting.estimator);
                let all = [own, gathering, &setting.rest()]
                    .into_iter()
                    .filter(|s| !s.is_empty())
                    .collect::<Vec<_>>()
                    .join(",");
                Curve {
                    id: setting.id(),
                    settings: all,
                    label,
                    setting: setting.clone(),
                    consistent: setting.is_consistent(),
                    convergence: PowerLaw::fit(summary.iter().filter_map(|s| Some((s.seconds.median, s.net_mse?)))),
                    points: points.into_iter().flatten().collect(),
                    summary,
                }
            })
            .collect();
        let pareto = best_of_budgets(&curves);
        Ok(Self { curves, pareto })
    }
}

/// Smallest relative RMSE of any image of the tasks, the reference's noise taken out; None without an image. So good
/// must a reference be, and better.
///
/// # Errors
/// As [`Evaluation::new`].
pub fn smallest_error(
    records: &[TaskRecord],
    judge: &Judge,
    image: &(dyn Fn(Task, u32) -> Result<Image, String> + Sync),
) -> Result<Option<f64>, String> {
    let of = |r: &TaskRecord| {
        let task = Task { setting: r.setting, seed: r.seed };
        r.points.iter().map(move |p| (task, p.passes)).collect::<Vec<_>>()
    };
    let all: Vec<(Task, u32)> = records.iter().flat_map(of).collect();
    let errors: Result<Vec<f64>, String> = all
        .par_iter()
        .map(|&(task, passes)| {
            let fitted = judge.fitted(&image(task, passes)?)?;
            let mse = compare(&fitted, &judge.reference.image, &judge.mask)?.mse;
            Ok(judge.relative(mse - judge.noise_mse.unwrap_or(0.0)))
        })
        .collect();
    Ok(errors?.into_iter().min_by(f64::total_cmp))
}

/// All seeds of a setting at one checkpoint.
struct Group {
    points: Vec<SeedPoint>,
    summary: Summary,
}

impl Group {
    fn new(
        records: &[&TaskRecord],
        passes: u32,
        judge: &Judge,
        image: &(dyn Fn(Task, u32) -> Result<Image, String> + Sync),
    ) -> Result<Self, String> {
        let mut at: Vec<(&TaskRecord, &Checkpoint)> =
            records.iter().filter_map(|r| r.points.iter().find(|p| p.passes == passes).map(|p| (*r, p))).collect();
        at.sort_by_key(|(r, _)| r.seed);
        let mut images = Vec::new();
        let mut errors = Vec::new();
        for (record, _) in &at {
            let task = Task { setting: record.setting, seed: record.seed };
            let fitted = judge.fitted(&image(task, passes)?)?;
            errors.push(judge.error(&fitted)?);
            images.push(fitted);
        }
        let points = at
            .iter()
            .zip(&errors)
            .map(|((record, p), e)| SeedPoint {
                seed: record.seed,
                passes,
                photons: p.photons,
                seconds: p.seconds.total,
                parts: p.seconds,
                error: judge.tells(e.metrics.mse).then_some(*e),
            })
            .collect();
        // A group has at least the record that its passes were found in.
        let spread = |f: &dyn Fn(&StudyError) -> f64| Spread::of(errors.iter().map(f));
        let mse = spread(&|e| e.metrics.mse).map_or(0.0, |s| s.median);
        let told = judge.tells(mse);
        let noise = judge.noise_mse().unwrap_or(0.0);
        let seconds = Spread::of(at.iter().map(|(_, p)| p.seconds.total));
        let summary = Summary {
            passes,
            photons: at.iter().map(|(_, p)| p.photons).max().unwrap_or(0),
            seeds: at.len(),
            seconds: seconds.unwrap_or(Spread { median: 0.0, low: 0.0, high: 0.0 }),
            relative_rmse: if told { spread(&|e| e.metrics.relative_rmse) } else { None },
            net_mse: told.then_some(mse - noise),
            bias_and_variance: judge.bias_and_variance(&images),
        };
        Ok(Self { points, summary })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::measure::reference::Noise;
    use glam::Vec3;

    fn reference(noise: Noise) -> Reference {
        let image = Image { size: [2, 2], pixels: [1.0, 2.0, 3.0, 2.0].map(Vec3::splat).to_vec() };
        Reference { source: "by hand".into(), mask: Mask::all(image.size), image, noise }
    }

    fn plus(reference: &Reference, errors: [f32; 4]) -> Image {
        let pixels = reference.image.pixels.iter().zip(errors).map(|(p, e)| *p + e).collect();
        Image { size: reference.image.size, pixels }
    }

    /// Bias 0.5 everywhere and two images at ±0.3 about it: variance 0.18, distance 0.25.
    #[test]
    fn bias_and_variance_of_a_case_by_hand() {
        let r = reference(Noise::Exact);
        let judge = Judge::new(&r, None, 0.0).expect("pixels");
        let images = [plus(&r, [0.8, 0.2, 0.8, 0.2]), plus(&r, [0.2, 0.8, 0.2, 0.8])];
        let parts = judge.bias_and_variance(&images).expect("two");
        assert!((parts.relative_noise - 0.18f64.sqrt() / 2.0).abs() < 1e-6);
        let bias = parts.relative_bias.expect("told");
        assert!((bias - (0.25f64 - 0.09).sqrt() / 2.0).abs() < 1e-6, "{bias}");
        assert!(judge.bias_and_variance(&images[..1]).is_none());
        // Errors without a common part show no bias.
        let images = [plus(&r, [0.3, -0.3, 0.3, -0.3]), plus(&r, [-0.3, 0.3, -0.3, 0.3])];
        assert_eq!(judge.bias_and_variance(&images).expect("two").relative_bias, None);
    }

    #[test]
    fn errors_below_the_noise_are_not_told() {
        let r = reference(Noise::Relative(0.1));
        let judge = Judge::new(&r, None, 0.0).expect("pixels");
        let noise = judge.noise_mse().expect("known");
        assert!((noise - 0.04).abs() < 1e-12 && (judge.relative_noise().expect("known") - 0.1).abs() < 1e-12);
        assert!(!judge.tells(1.9 * noise) && judge.tells(2.1 * noise));
        let unknown = reference(Noise::Unknown);
        assert!(Judge::new(&unknown, None, 0.0).expect("pixels").tells(0.0));
    }

    #[test]
    fn sizes_must_fit() {
        let r = reference(Noise::Exact);
        let judge = Judge::new(&r, Some(Rect { x: 1, y: 0, width: 1, height: 2 }), 0.0).expect("pixels");
        assert_eq!(judge.pixels(), 2);
        let large = Image { size: [4, 4], pixels: vec![Vec3::ONE; 16] };
        assert_eq!(judge.fitted(&large).expect("fits").size, [2, 2]);
        assert!(judge.fitted(&Image::black([3, 2])).is_err());
        assert!(Judge::new(&r, Some(Rect { x: 5, y: 0, width: 1, height: 1 }), 0.0).is_err());
    }
}
