//! How far the mean of the passes is from what it tends to, judged by the passes themselves.
//!
//! Passes are taken in *groups*: all passes in which the view rays of a pixel visit each cell of the pixel once
//! ([`cells_of_pass`]). Single passes differ by where in the pixel their ray goes, and that difference drops out of
//! the mean; groups differ by their photons, and by their footprints.

use crate::math::rgb::Rgb;
use crate::render::film::{Image, Rect};
use crate::render::view_pass::cells_of_pass;
use glam::DVec3;
use rayon::prelude::*;
use serde::Serialize;

/// Groups that an estimate needs: two fix a line, one more tells what is noise. That is 12 passes.
const LEAST_GROUPS: u32 = 3;

/// Error of the mean of some passes, as the passes themselves tell it. Means are over pixels and channels.
///
/// It does not see what all passes have in common: a bias that footprints leave however small they are (an estimator
/// that is not consistent, `knn`), and what the view rays miss of a pixel. Where footprints lie over an edge it sees
/// about three quarters of the bias, where light is smooth about twice the bias.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct ErrorEstimate {
    /// Passes in the mean.
    pub passes: u32,
    /// Root of the mean squared error: noise and bias together, W/(m² sr).
    pub rmse: f64,
    /// The part that more passes of the same kind would average out, W/(m² sr).
    pub noise_rmse: f64,
    /// The part that larger footprints left, W/(m² sr).
    pub bias_rmse: f64,
    /// `rmse` over the mean of the image; 0 if both vanish.
    pub relative: f64,
}

/// Whether an estimate after so many passes is worth its time: each of the first 16, then 8 to 16 times for each
/// doubling of their number.
pub fn is_milestone(passes: u32) -> bool {
    let step = 1 << passes.max(1).ilog2().saturating_sub(3);
    passes.is_multiple_of(step)
}

/// Sums over groups of passes that variance and bias follow from, for each pixel and channel.
///
/// The mean `y` of a group has the expected value `L + B r`, `r` the mean of `√a` over its passes and `a` the area of
/// footprints relative to the first pass, and a variance that is proportional to `1/w`. That is a straight line through
/// points of the weights `w`.
#[derive(Clone, Debug)]
pub(super) struct GroupSums {
    pixels: Vec<Pixel>,
    totals: Totals,
}

#[derive(Clone, Copy, Debug, Default)]
struct Pixel {
    /// Sum of the passes up to the last group's end.
    before: DVec3,
    /// `Σ w y`, `Σ w r y`, `Σ w y²`.
    wy: DVec3,
    wry: DVec3,
    wyy: DVec3,
}

/// What is the same for all pixels.
#[derive(Clone, Copy, Debug, Default)]
struct Totals {
    passes: u32,
    groups: u32,
    /// Over all passes: `Σ √a`, `Σ 1/a`.
    radius: f64,
    inverse_area: f64,
    /// Over all groups: `Σ w`, `Σ w r`, `Σ w r²`.
    w: f64,
    wr: f64,
    wrr: f64,
    /// Over the passes of the group that has begun: their number, `Σ √a`, `Σ 1/a`.
    open: (f64, f64, f64),
}

/// The line through the groups' means, and the scatter about it.
struct Line {
    mean_r: f64,
    /// `Σ w (r - mean_r)²`.
    spread: f64,
    w: f64,
    freedom: f64,
    /// Variance of the mean of all passes for a scatter of 1.
    noise: f64,
    /// Mean of `√a` over all passes.
    radius: f64,
}

impl GroupSums {
    /// For so many pixels; none gives no estimate.
    pub fn new(pixels: usize) -> Self {
        Self { pixels: vec![Pixel::default(); pixels], totals: Totals::default() }
    }

    /// Takes in that a pass with footprints of `area` has ended, whose films hold `sums`.
    pub fn finish_pass(&mut self, area: f64, sums: &[DVec3]) {
        let t = &mut self.totals;
        let (radius, inverse) = (area.sqrt(), 1.0 / area);
        // The first pass has one cell; it takes the place of the one that its group would have.
        let cells = cells_of_pass(t.passes.max(1));
        t.passes += 1;
        t.radius += radius;
        t.inverse_area += inverse;
        t.open = (t.open.0 + 1.0, t.open.1 + radius, t.open.2 + inverse);
        if !u64::from(t.passes).is_multiple_of(u64::from(cells) * u64::from(cells)) {
            return;
        }
        let (n, radii, inverses) = std::mem::take(&mut t.open);
        // A pass has a variance like 1/a, so the mean of n has Σ(1/a)/n².
        let (r, w) = (radii / n, n * n / inverses);
        t.groups += 1;
        t.w += w;
        t.wr += w * r;
        t.wrr += w * r * r;
        // Each pixel for itself, so threads change no bit.
        self.pixels.par_iter_mut().zip(sums).with_min_len(4096).for_each(|(p, sum)| {
            let y = (*sum - p.before) / n;
            let wy = y * w;
            p.before = *sum;
            p.wy += wy;
            p.wry += wy * r;
            p.wyy += wy * y;
        });
    }

    fn line(&self) -> Option<Line> {
        let t = &self.totals;
        if t.groups < LEAST_GROUPS || self.pixels.is_empty() {
            return None;
        }
        let (n, mean_r) = (f64::from(t.passes), t.wr / t.w);
        let spread = t.wrr - t.wr * mean_r;
        let freedom = f64::from(t.groups - 2);
        Some(Line { mean_r, spread, w: t.w, freedom, noise: t.inverse_area / (n * n), radius: t.radius / n })
    }

    /// Variance of the mean of the passes, without that of the rays' places in the pixel.
    pub fn variance(&self, size: [u32; 2]) -> Option<Image> {
        let line = self.line()?;
        let variance = |p: &Pixel| {
            let v = line.slope_and_scatter(p).1 * line.noise;
            v.min(DVec3::splat(f64::from(f32::MAX))).as_vec3()
        };
        Some(Image { size, pixels: self.pixels.iter().map(variance).collect::<Vec<Rgb>>() })
    }

    /// The error over the pixels of `rect`, which must lie inside, that `counts`; None for none, or for too few passes.
    pub fn error(
        &self,
        sums: &[DVec3],
        size: [u32; 2],
        rect: Rect,
        counts: impl Fn(usize) -> bool,
    ) -> Option<ErrorEstimate> {
        let line = self.line()?;
        let (mut noise, mut bias, mut level, mut counted) = (0.0, 0.0, 0.0, 0u64);
        for y in rect.y..rect.y + rect.height {
            let start = y as usize * size[0] as usize + rect.x as usize;
            for i in (start..start + rect.width as usize).filter(|i| counts(*i)) {
                let (slope, scatter) = line.slope_and_scatter(&self.pixels[i]);
                noise += scatter.element_sum();
                // The square of a slope is too large by the slope's own variance.
                bias += (slope * slope - scatter / line.spread).element_sum();
                level += sums[i].element_sum();
                counted += 1;
            }
        }
        if counted == 0 {
            return None;
        }
        let n = 3.0 * counted as f64;
        let noise = noise * line.noise / n;
        let bias = bias.max(0.0) * line.radius * line.radius / n;
        let mean = level / n / f64::from(self.totals.passes);
        let rmse = (noise + bias).sqrt();
        let relative = match rmse {
            0.0 => 0.0,
            _ if mean > 0.0 => (rmse / mean).min(f64::MAX),
            _ => f64::MAX,
        };
        let passes = self.totals.passes;
        Some(ErrorEstimate { passes, rmse, noise_rmse: noise.sqrt(), bias_rmse: bias.sqrt(), relative })
    }
}

impl Line {
    /// `B`, and the variance of a group of weight 1, from the squares that the line leaves.
    fn slope_and_scatter(&self, p: &Pixel) -> (DVec3, DVec3) {
        let slope = (p.wry - p.wy * self.mean_r) / self.spread;
        let left = p.wyy - p.wy * p.wy / self.w - slope * slope * self.spread;
        (slope, left.max(DVec3::ZERO) / self.freedom)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::sequence::{Sampling, Sequence};
    use crate::render::renderer::next_area;

    /// A number of mean 0 and variance 1.
    fn noise(sequence: &Sequence, pass: u32) -> f64 {
        (f64::from(sequence.four(u64::from(pass), 0)[0]) - 0.5) * 12f64.sqrt()
    }

    /// Films of `pixels` whose pass `i` has the value `of(pixel, i, area)`.
    fn passes(pixels: usize, n: u32, of: impl Fn(usize, u32, f64) -> f64) -> (GroupSums, Vec<DVec3>) {
        let mut groups = GroupSums::new(pixels);
        let mut sums = vec![DVec3::ZERO; pixels];
        let mut area = 1.0;
        for i in 0..n {
            if i > 0 {
                area = next_area(area, i);
            }
            sums.iter_mut().enumerate().for_each(|(p, s)| *s += DVec3::splat(of(p, i, area)));
            groups.finish_pass(area, &sums);
        }
        (groups, sums)
    }

    fn estimate(pixels: u32, (groups, sums): &(GroupSums, Vec<DVec3>)) -> ErrorEstimate {
        let size = [pixels, 1];
        groups.error(sums, size, Rect::whole(size), |_| true).expect("enough passes")
    }

    #[test]
    fn bias_like_the_radius_is_found_exactly() {
        let n = 48;
        let e = estimate(5, &passes(5, n, |p, _, area| 2.0 + 0.1 * (p as f64 + 1.0) * area.sqrt()));
        let mut area = 1.0;
        let radii = (0..n).map(|i| {
            area = if i > 0 { next_area(area, i) } else { area };
            area.sqrt()
        });
        let mean_radius = radii.sum::<f64>() / f64::from(n);
        let expected = 0.1 * ((1.0 + 4.0 + 9.0 + 16.0 + 25.0) / 5.0f64).sqrt() * mean_radius;
        assert!((e.bias_rmse / expected - 1.0).abs() < 1e-9, "{e:?} against {expected}");
        assert!(e.noise_rmse < 1e-6 * e.bias_rmse);
    }

    /// Independent passes of variance 1/a: the variance of their mean is known.
    #[test]
    fn noise_is_found_and_is_no_bias() {
        let pixels = 4000;
        let sequences: Vec<Sequence> = (0..pixels).map(|p| Sequence::new(Sampling::Random, p as u64)).collect();
        for n in [12, 16, 40, 300] {
            let all = passes(pixels, n, |p, i, area| 10.0 + noise(&sequences[p], i) / area.sqrt());
            let e = estimate(pixels as u32, &all);
            let mut area = 1.0;
            let mut sum = 0.0;
            for i in 0..n {
                area = if i > 0 { next_area(area, i) } else { area };
                sum += 1.0 / area;
            }
            let expected = sum.sqrt() / f64::from(n);
            // Over 4000 pixels with at least one degree of freedom the variance scatters by √(2/4000), its root by half of
            // that: 1.1 %, and these are five of them.
            assert!((e.noise_rmse / expected - 1.0).abs() < 0.06, "{n}: {e:?} against {expected}");
            // The slope's variance is some ten times that of the mean, and cancels to √(2/4000) of it.
            assert!(e.bias_rmse < 1.2 * expected, "{n}: {e:?} against {expected}");
            let true_rmse =
                (all.1.iter().map(|s| (s.x / f64::from(n) - 10.0).powi(2)).sum::<f64>() / pixels as f64).sqrt();
            assert!((true_rmse / expected - 1.0).abs() < 0.06);
        }
    }

    /// What a ray's place in the pixel adds is the same in each group, and is no noise of the mean.
    #[test]
    fn the_places_of_rays_are_no_noise() {
        let place = |i: u32, cells: u32| 10.0 + f64::from(i % cells) - f64::from(cells - 1) / 2.0;
        let e = estimate(3, &passes(3, 64, |_, i, _| place(i, if i < 16 { 4 } else { 16 })));
        // What is left is the rounding of a difference of squares: the root of 2^-52.
        assert!(e.relative < 1e-7, "{e:?}");
    }

    #[test]
    fn many_passes_stay_accurate() {
        let sequence = Sequence::new(Sampling::Random, 7);
        let n = 100_000;
        // A small noise on a high level, constant in the passes.
        let all = passes(64, n, |p, i, area| 1e3 + 1e-2 * noise(&sequence, i * 64 + p as u32) / area.sqrt());
        let e = estimate(64, &all);
        let (mut area, mut sum) = (1.0, 0.0);
        for i in 0..n {
            area = if i > 0 { next_area(area, i) } else { area };
            sum += 1.0 / area;
        }
        let expected = 1e-2 * f64::sqrt(sum) / f64::from(n);
        assert!((e.noise_rmse / expected - 1.0).abs() < 0.05, "{e:?} against {expected}");
    }

    #[test]
    fn nothing_is_defined() {
        let one = [1, 1];
        let (groups, sums) = passes(1, 11, |_, _, _| 1.0);
        assert!(groups.error(&sums, one, Rect::whole(one), |_| true).is_none() && groups.variance(one).is_none());
        let black = passes(1, 64, |_, _, _| 0.0);
        assert_eq!(estimate(1, &black).relative, 0.0);
        assert!(black.0.error(&black.1, one, Rect::whole(one), |_| false).is_none());
        let bright = passes(1, 64, |_, i, _| f64::from(f32::MAX) * f64::from(i % 3 % 2));
        let e = estimate(1, &bright);
        assert!(e.rmse.is_finite() && e.relative.is_finite(), "{e:?}");
        assert!(bright.0.variance(one).expect("enough").pixels[0].is_finite());
    }

    #[test]
    fn milestones_thin_out() {
        assert!((1..=16).all(is_milestone));
        let after: Vec<u32> = (17..=48).filter(|p| is_milestone(*p)).collect();
        assert_eq!(after, [18, 20, 22, 24, 26, 28, 30, 32, 36, 40, 44, 48]);
        assert!(is_milestone(0) && is_milestone(1 << 31));
    }
}
