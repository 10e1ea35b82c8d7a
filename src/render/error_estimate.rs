//! How far the mean of the passes is from what it tends to, judged by the passes themselves.
//!
//! Passes are taken in *groups*: all passes in which the view rays of a pixel visit each cell of the pixel once
//! ([`cells_of_pass`]). Single passes differ by where in the pixel their ray goes, and that difference drops out of
//! the mean; groups differ by their photons, and by their footprints.

use crate::math::rgb::Rgb;
use crate::render::cells::cells_of_pass;
use crate::render::film::{Image, Rect};
use glam::DVec3;
use rayon::prelude::*;
use serde::Serialize;

/// Groups that an estimate needs: two fix a line, one more tells what is noise. That is 12 passes.
const LEAST_GROUPS: u32 = 3;
/// Pixels along the side of a block. A bias that matters is wider than a pixel, since footprints are; noise of edges is
/// not, and averages out.
const BLOCK: usize = 2;
/// Blocks along the side of a region whose noise is taken to be one.
const REGION: usize = 4;

/// Standard errors of the squared bias that a bound has on top.
const STANDARD_ERRORS: f64 = 2.0;

/// Error of the mean of some passes, as the passes themselves tell it. Means are over pixels and channels.
///
/// It does not see what all passes have in common: a bias that footprints leave however small they are (an estimator
/// that is not consistent, `knn`), and what the view rays miss of a pixel. Where footprints lie over an edge it sees
/// about three quarters of their bias, where light is smooth about twice the bias.
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
    /// The same with two standard errors of the squared bias on top: the error is likely below.
    pub relative_bound: f64,
}

/// Whether an estimate after so many passes is worth its time: each of the first 16, then 8 to 16 times for each
/// doubling of their number.
pub fn is_milestone(passes: u32) -> bool {
    let step = 1 << passes.max(1).ilog2().saturating_sub(3);
    passes.is_multiple_of(step)
}

/// Sums over groups of passes that variance and bias follow from.
///
/// The mean `y` of a group has the expected value `L + B r`, `r` the mean of `√a` over its passes and `a` the area of
/// footprints relative to the first pass, and the variance `σ²/w`. Differences of groups that follow each other give
/// `σ²` for each pixel; a straight line through the means of blocks of pixels gives `B`.
///
/// Memory is taken with the first group: some 90 bytes for each pixel, which an image of few passes does not need.
#[derive(Clone, Debug)]
pub(super) struct GroupSums {
    size: [usize; 2],
    pixels: Vec<Pixel>,
    blocks: Vec<Block>,
    totals: Totals,
}

#[derive(Clone, Copy, Debug, Default)]
struct Pixel {
    /// Sum of the passes up to the last group's end.
    sum: DVec3,
    /// Mean of the last group, as accurate as an image.
    last: Rgb,
    /// Squared differences of the groups, each over its variance for `σ` = 1.
    scatter: DVec3,
}

/// The line of a block.
#[derive(Clone, Copy, Debug, Default)]
struct Block {
    /// Mean of the first group, which is not quite like the others.
    first: DVec3,
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
    line: [f64; 3],
    /// `r` and `w` of the first group, `w` of the last.
    first: (f64, f64),
    last_w: f64,
    /// Over the passes of the group that has begun: their number, `Σ √a`, `Σ 1/a`.
    open: (f64, f64, f64),
}

/// Memory for each pixel from the first group on.
pub(super) const BYTES_PER_PIXEL: usize = size_of::<Pixel>() + size_of::<Block>() / (BLOCK * BLOCK);

/// Where the groups lie along a line: weights and mean of `r`.
struct Line {
    w: f64,
    mean_r: f64,
    /// `Σ w (r - mean_r)²`.
    spread: f64,
    freedom: f64,
}

impl Line {
    fn new([w, wr, wrr]: [f64; 3], groups: u32) -> Self {
        let mean_r = wr / w;
        Self { w, mean_r, spread: wrr - wr * mean_r, freedom: f64::from(groups.saturating_sub(2)) }
    }

    /// `B²`, less what noise adds to it: the slope's own variance, by the squares that the line leaves.
    fn squared_slope(&self, b: &Block) -> f64 {
        let slope = (b.wry - b.wy * self.mean_r) / self.spread;
        let left = b.wyy - b.wy * b.wy / self.w - slope * slope * self.spread;
        let variance = left.max(DVec3::ZERO) / self.freedom / self.spread;
        (slope * slope - variance).element_sum()
    }
}

impl Block {
    /// Without the first group, whose `r` and `w` are given.
    fn later(&self, (r, w): (f64, f64)) -> Self {
        let wy = self.first * w;
        Self { wy: self.wy - wy, wry: self.wry - wy * r, wyy: self.wyy - wy * self.first, ..*self }
    }
}

impl GroupSums {
    pub fn new(size: [u32; 2]) -> Self {
        let size = size.map(|n| n as usize);
        Self { size, pixels: Vec::new(), blocks: Vec::new(), totals: Totals::default() }
    }

    /// Takes in that a pass with footprints of `area` has ended, whose film holds `sums`.
    pub fn finish_pass(&mut self, area: f64, sums: &[DVec3]) {
        let t = &mut self.totals;
        let (radius, inverse) = (area.sqrt(), 1.0 / area);
        // The first pass goes through the pixel's centre; it takes the place of the cell that its group leaves out.
        let cells = cells_of_pass(t.passes.max(1));
        t.passes += 1;
        t.radius += radius;
        t.inverse_area += inverse;
        t.open = (t.open.0 + 1.0, t.open.1 + radius, t.open.2 + inverse);
        if !u64::from(t.passes).is_multiple_of(u64::from(cells) * u64::from(cells)) || sums.is_empty() {
            return;
        }
        let (n, radii, inverses) = std::mem::take(&mut t.open);
        // A pass has a variance like 1/a, so the mean of n has Σ(1/a)/n².
        let (r, w) = (radii / n, n * n / inverses);
        let is_first = t.groups == 0;
        if is_first {
            t.first = (r, w);
            let [columns, rows] = self.size.map(|n| n.div_ceil(BLOCK));
            self.pixels.resize(sums.len(), Pixel::default());
            self.blocks.resize(columns * rows, Block::default());
        }
        let per_difference = if is_first { 0.0 } else { 1.0 / (1.0 / w + 1.0 / t.last_w) };
        t.last_w = w;
        t.groups += 1;
        t.line = [t.line[0] + w, t.line[1] + w * r, t.line[2] + w * r * r];
        let width = self.size[0];
        // Each row of blocks for itself, so threads change no bit.
        let rows = self.pixels.par_chunks_mut(BLOCK * width).zip(sums.par_chunks(BLOCK * width));
        rows.zip(self.blocks.par_chunks_mut(width.div_ceil(BLOCK))).for_each(|((pixels, sums), blocks)| {
            let mean = |p: &Pixel, sum: &DVec3| (*sum - p.sum) / n;
            for (i, b) in blocks.iter_mut().enumerate() {
                let columns = i * BLOCK..((i + 1) * BLOCK).min(width);
                let rows = pixels.chunks(width).zip(sums.chunks(width));
                let inside = rows.flat_map(|(p, s)| p[columns.clone()].iter().zip(&s[columns.clone()]));
                let (sum, count) = inside.fold((DVec3::ZERO, 0.0), |(all, k), (p, s)| (all + mean(p, s), k + 1.0));
                let y = sum / count;
                let wy = y * w;
                let first = if is_first { y } else { b.first };
                *b = Block { first, wy: b.wy + wy, wry: b.wry + wy * r, wyy: b.wyy + wy * y };
            }
            for (p, sum) in pixels.iter_mut().zip(sums) {
                let y = mean(p, sum);
                let step = y - p.last.as_dvec3();
                *p = Pixel { sum: *sum, last: y.as_vec3(), scatter: p.scatter + step * step * per_difference };
            }
        });
    }

    /// Factor on a pixel's sum of squared differences that gives the variance of the mean; None below 12 passes.
    fn noise_factor(&self) -> Option<f64> {
        let t = &self.totals;
        let n = f64::from(t.passes);
        (t.groups >= LEAST_GROUPS).then(|| t.inverse_area / (n * n) / f64::from(t.groups - 1))
    }

    /// Variance of the mean of the passes, without that of the rays' places in the pixel.
    pub fn variance(&self) -> Option<Image> {
        let factor = self.noise_factor()?;
        let variance = |p: &Pixel| (p.scatter * factor).min(DVec3::splat(f64::from(f32::MAX))).as_vec3();
        let size = self.size.map(|n| n as u32);
        Some(Image { size, pixels: self.pixels.iter().map(variance).collect::<Vec<Rgb>>() })
    }

    /// The error over the pixels of `rect`, which must lie inside, that `counts`; None for none, or for too few passes.
    pub fn error(&self, sums: &[DVec3], rect: Rect, counts: impl Fn(usize) -> bool) -> Option<ErrorEstimate> {
        let factor = self.noise_factor()?;
        let (mut noise, mut level, mut counted) = (0.0, 0.0, 0u64);
        let width = self.size[0];
        let mut inside = vec![0u8; self.blocks.len()];
        for y in rect.y..rect.y + rect.height {
            let start = y as usize * width + rect.x as usize;
            for i in (start..start + rect.width as usize).filter(|i| counts(*i)) {
                noise += self.pixels[i].scatter.element_sum();
                level += sums[i].element_sum();
                counted += 1;
                inside[y as usize / BLOCK * width.div_ceil(BLOCK) + i % width / BLOCK] += 1;
            }
        }
        if counted == 0 {
            return None;
        }
        let n = 3.0 * counted as f64;
        let passes = self.totals.passes;
        let noise = noise * factor / n;
        let (bias, bias_bound) = self.squared_bias(&inside);
        let mean = level / n / f64::from(passes);
        let over_mean = |rmse: f64| match rmse {
            0.0 => 0.0,
            _ if mean > 0.0 => (rmse / mean).min(f64::MAX),
            _ => f64::MAX,
        };
        let rmse = (noise + bias).sqrt();
        Some(ErrorEstimate {
            passes,
            rmse,
            noise_rmse: noise.sqrt(),
            bias_rmse: bias.sqrt(),
            relative: over_mean(rmse),
            relative_bound: over_mean((noise + bias_bound).sqrt()),
        })
    }

    /// Mean squared bias over blocks, weighted by how many pixels of each count; and the same with its
    /// standard errors on top.
    fn squared_bias(&self, inside: &[u8]) -> (f64, f64) {
        let t = &self.totals;
        // Blocks that count in part hold pixels of which nothing is asked; they stand in if there are no others.
        let full = (BLOCK * BLOCK) as u8;
        let least = if inside.contains(&full) { full } else { 1 };
        let (r0, w0) = t.first;
        let [w, wr, wrr] = t.line;
        let all = Line::new(t.line, t.groups);
        let later = Line::new([w - w0, wr - w0 * r0, wrr - w0 * r0 * r0], t.groups - 1);
        let columns = self.size[0].div_ceil(BLOCK);
        let region_columns = columns.div_ceil(REGION);
        let mut regions = vec![[0.0; 2]; region_columns * self.size[1].div_ceil(BLOCK).div_ceil(REGION)];
        let mut weight = 0.0;
        for (i, (b, &count)) in self.blocks.iter().zip(inside).enumerate().filter(|(_, (_, c))| **c >= least) {
            let count = f64::from(count);
            weight += count;
            let region = &mut regions[i / columns / REGION * region_columns + i % columns / REGION];
            region[0] += count * all.squared_slope(b);
            if later.freedom > 0.0 {
                region[1] += count * later.squared_slope(&b.later(t.first));
            }
        }
        let sum = |k: usize| regions.iter().map(|q| q[k]).sum::<f64>();
        // Each region counts as one draw, so that noise that its pixels share is not taken for less than it is.
        let bound =
            |k: usize| sum(k).max(0.0) + STANDARD_ERRORS * regions.iter().map(|q| q[k] * q[k]).sum::<f64>().sqrt();
        let (mut bias, mut upper) = (sum(0), bound(0));
        if later.freedom > 0.0 {
            // The first group is an outlier where a pixel's centre is not like the rest of it. The line without it is
            // less certain, and counts where it is lower all the same.
            bias = bias.min(bound(1));
            upper = upper.min(bound(1));
        }
        let radius = t.radius / f64::from(t.passes);
        let scale = radius * radius / (3.0 * weight);
        (bias.max(0.0) * scale, upper.max(0.0) * scale)
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
        let mut groups = GroupSums::new([pixels as u32, 1]);
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
        groups.error(sums, Rect::whole(size), |_| true).expect("enough passes")
    }

    #[test]
    fn bias_like_the_radius_is_found_exactly() {
        let n = 48;
        // The same in both pixels of a block.
        let slope = |p: usize| 0.1 * (p / BLOCK + 1) as f64;
        let e = estimate(6, &passes(6, n, |p, _, area| 2.0 + slope(p) * area.sqrt()));
        let mut area = 1.0;
        let radii = (0..n).map(|i| {
            area = if i > 0 { next_area(area, i) } else { area };
            area.sqrt()
        });
        let mean_radius = radii.sum::<f64>() / f64::from(n);
        let expected = 0.1 * ((1.0 + 4.0 + 9.0) / 3.0f64).sqrt() * mean_radius;
        assert!((e.bias_rmse / expected - 1.0).abs() < 1e-9, "{e:?} against {expected}");
        // Groups that follow each other differ by their radius, too, but by little.
        assert!(e.noise_rmse < 0.05 * e.bias_rmse);
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
        assert!(groups.error(&sums, Rect::whole(one), |_| true).is_none() && groups.variance().is_none());
        let black = passes(1, 64, |_, _, _| 0.0);
        assert_eq!(estimate(1, &black).relative, 0.0);
        assert!(black.0.error(&black.1, Rect::whole(one), |_| false).is_none());
        let bright = passes(1, 64, |_, i, _| f64::from(f32::MAX) * f64::from(i % 3 % 2));
        let e = estimate(1, &bright);
        assert!(e.rmse.is_finite() && e.relative.is_finite(), "{e:?}");
        assert!(bright.0.variance().expect("enough").pixels[0].is_finite());
    }

    #[test]
    fn milestones_thin_out() {
        assert!((1..=16).all(is_milestone));
        let after: Vec<u32> = (17..=48).filter(|p| is_milestone(*p)).collect();
        assert_eq!(after, [18, 20, 22, 24, 26, 28, 30, 32, 36, 40, 44, 48]);
        assert!(is_milestone(0) && is_milestone(1 << 31));
    }
}
