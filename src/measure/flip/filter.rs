//! Filters of FLIP: contrast sensitivity, edges and points (Andersson 2020, section 4.1 and 4.3).
//!
//! All are separable, or sums of separable ones. Beyond the border the nearest pixel counts.

use rayon::prelude::*;
use std::f64::consts::PI;

/// Largest spread of the contrast sensitivity functions, in squared degrees: it decides the radius of all three.
const WIDEST: f64 = 0.04;
/// Width of the feature detectors in degrees.
const FEATURE: f64 = 0.082;

/// One value for each pixel, row by row.
#[derive(Clone, Debug)]
pub struct Plane {
    /// Pixels across and down.
    pub size: [usize; 2],
    /// The values.
    pub values: Vec<f32>,
}

/// Weights from `-radius` to `radius`, an odd number of them.
pub type Taps = Vec<f64>;

impl Plane {
    /// Filters rows with `across`, then columns with `down`. The same bits on any number of threads.
    pub fn filtered(&self, across: &[f64], down: &[f64]) -> Self {
        let [width, height] = self.size;
        if width == 0 || height == 0 {
            return self.clone();
        }
        let mut rows = vec![0.0f32; self.values.len()];
        rows.par_chunks_mut(width)
            .zip(self.values.par_chunks(width))
            .for_each(|(to, from)| filter_row(from, across, to));
        let mut values = vec![0.0f32; rows.len()];
        let radius = down.len() / 2;
        values.par_chunks_mut(width).enumerate().for_each(|(y, to)| {
            let mut sums = vec![0.0f64; width];
            for (k, weight) in down.iter().enumerate() {
                let row = (y + k).saturating_sub(radius).min(height - 1) * width;
                for (sum, v) in sums.iter_mut().zip(&rows[row..row + width]) {
                    *sum += weight * f64::from(*v);
                }
            }
            for (t, sum) in to.iter_mut().zip(sums) {
                *t = sum as f32;
            }
        });
        Self { size: self.size, values }
    }

    /// `share` of this plane and the rest of the other, which has the same size.
    fn mixed(mut self, other: &Self, share: f64) -> Self {
        for (a, b) in self.values.iter_mut().zip(&other.values) {
            *a = (share * f64::from(*a) + (1.0 - share) * f64::from(*b)) as f32;
        }
        self
    }
}

fn filter_row(from: &[f32], taps: &[f64], to: &mut [f32]) {
    let radius = taps.len() / 2;
    let (first, last) = (from[0], from[from.len() - 1]);
    let line: Vec<f64> = std::iter::repeat_n(first, radius)
        .chain(from.iter().copied())
        .chain(std::iter::repeat_n(last, radius))
        .map(f64::from)
        .collect();
    for (t, window) in to.iter_mut().zip(line.windows(taps.len())) {
        *t = window.iter().zip(taps).map(|(v, w)| v * w).sum::<f64>() as f32;
    }
}

/// What the eye resolves of YCxCz: each plane is filtered with the contrast sensitivity of its channel.
///
/// * `planes`: Y, Cx, Cz.
/// * `pixels_per_degree`: pixels for a degree of the field of view.
pub fn contrast_sensitivity(planes: &[Plane; 3], pixels_per_degree: f64) -> [Plane; 3] {
    let radius = (3.0 * (WIDEST / (2.0 * PI * PI)).sqrt() * pixels_per_degree).ceil() as i32;
    let gaussian = |b: f64| {
        let taps: Taps = offsets(radius)
            .map(|x| {
                let degrees = x / pixels_per_degree;
                libm::exp(-PI * PI * degrees * degrees / b)
            })
            .collect();
        let sum: f64 = taps.iter().sum();
        (taps.iter().map(|t| t / sum).collect::<Taps>(), sum)
    };
    let [y, cx, cz] = planes;
    let ((achromatic, _), (red_green, _)) = (gaussian(0.0047), gaussian(0.0053));
    // Blue against yellow has two terms, 34.1 √(π/0.04) and 13.5 √(π/0.025) high.
    let ((wide, wide_sum), (narrow, narrow_sum)) = (gaussian(0.04), gaussian(0.025));
    let volume = |a: f64, b: f64, sum: f64| a * (PI / b).sqrt() * sum * sum;
    let (wide_volume, narrow_volume) = (volume(34.1, 0.04, wide_sum), volume(13.5, 0.025, narrow_sum));
    let share = wide_volume / (wide_volume + narrow_volume);
    [
        y.filtered(&achromatic, &achromatic),
        cx.filtered(&red_green, &red_green),
        cz.filtered(&wide, &wide).mixed(&cz.filtered(&narrow, &narrow), share),
    ]
}

/// How strongly each pixel of a grey image in [0, 1] looks like an edge, and how strongly like a point.
pub fn features(grey: &Plane, pixels_per_degree: f64) -> [Plane; 2] {
    let deviation = 0.5 * FEATURE * pixels_per_degree;
    let radius = (3.0 * deviation).ceil() as i32;
    let gaussian = |x: f64| libm::exp(-x * x / (2.0 * deviation * deviation));
    let smooth: Taps = offsets(radius).map(gaussian).collect();
    let sum: f64 = smooth.iter().sum();
    let smooth: Taps = smooth.iter().map(|t| t / sum).collect();
    let edge = balanced(&offsets(radius).map(|x| -x * gaussian(x)).collect::<Taps>());
    let point =
        balanced(&offsets(radius).map(|x| (x * x / (deviation * deviation) - 1.0) * gaussian(x)).collect::<Taps>());
    [edge, point].map(|taps| {
        let (across, down) = (grey.filtered(&taps, &smooth), grey.filtered(&smooth, &taps));
        let values = across.values.iter().zip(&down.values);
        let length = |(x, y): (&f32, &f32)| {
            let (x, y) = (f64::from(*x), f64::from(*y));
            (x * x + y * y).sqrt() as f32
        };
        Plane { size: grey.size, values: values.map(length).collect() }
    })
}

/// Weights whose positive ones sum to 1 and whose negative ones sum to -1.
fn balanced(taps: &[f64]) -> Taps {
    let positive: f64 = taps.iter().filter(|t| **t > 0.0).sum();
    let negative: f64 = -taps.iter().filter(|t| **t < 0.0).sum::<f64>();
    taps.iter().map(|&t| if t > 0.0 { t / positive } else { t / negative }).collect()
}

fn offsets(radius: i32) -> impl Iterator<Item = f64> {
    (-radius..=radius).map(f64::from)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plane(size: [usize; 2], values: &[f32]) -> Plane {
        Plane { size, values: values.to_vec() }
    }

    #[test]
    fn the_nearest_pixel_counts_beyond_the_border() {
        let shift_left = [0.0, 0.0, 1.0];
        let same = [1.0];
        let p = plane([3, 2], &[1.0, 2.0, 3.0, 4.0, 5.0, 6.0]);
        assert_eq!(p.filtered(&shift_left, &same).values, [2.0, 3.0, 3.0, 5.0, 6.0, 6.0]);
        assert_eq!(p.filtered(&same, &shift_left).values, [4.0, 5.0, 6.0, 4.0, 5.0, 6.0]);
        // Weights that reach far beyond a single pixel.
        assert_eq!(plane([1, 1], &[8.0]).filtered(&[0.125; 7], &[0.5; 5]).values, [17.5]);
    }

    #[test]
    fn smoothing_keeps_a_constant_and_features_ignore_it() {
        let p = plane([5, 4], &[0.7; 20]);
        for q in contrast_sensitivity(&[p.clone(), p.clone(), p.clone()], 67.0) {
            assert!(q.values.iter().all(|v| (v - 0.7).abs() < 1e-6));
        }
        for q in features(&p, 67.0) {
            assert!(q.values.iter().all(|v| v.abs() < 1e-6));
        }
    }

    #[test]
    fn a_step_is_an_edge_of_its_height_and_a_line_a_point() {
        let step: Vec<f32> = (0..40 * 40).map(|i| if i % 40 < 20 { 0.2 } else { 0.8 }).collect();
        let [edge, point] = features(&plane([40, 40], &step), 67.0);
        // Beside the step half of the kernel but for its middle sees the other side.
        let at = |p: &Plane, x: usize| p.values[20 * 40 + x];
        assert!((at(&edge, 20) - 0.6).abs() < 1e-5, "{}", at(&edge, 20));
        assert!(at(&edge, 2) < 1e-6);
        let line: Vec<f32> = (0..40 * 40).map(|i| if i % 40 == 20 { 1.0 } else { 0.0 }).collect();
        let [line_edge, line_point] = features(&plane([40, 40], &line), 67.0);
        assert!(at(&line_edge, 20) < 1e-6 && at(&line_point, 20) > 0.1 && at(&point, 0) < 1e-6);
    }
}
