//! Error of an image against a reference.

use crate::math::rgb::Rgb;
use crate::measure::trimmed::trimmed_mean;
use crate::render::film::{Image, Rect};
use glam::DVec3;
use serde::Serialize;

/// The pixels that count.
#[derive(Clone, Debug, PartialEq)]
pub struct Mask {
    /// Pixels across and down.
    pub size: [u32; 2],
    /// Whether each pixel counts, row by row.
    pub counts: Vec<bool>,
}

impl Mask {
    /// Lets those pixels count no more that are marked, row by row.
    pub fn leave_out(&mut self, pixels: &[bool]) {
        self.counts.iter_mut().zip(pixels).for_each(|(counts, out)| *counts &= !out);
    }

    /// All pixels.
    pub fn all(size: [u32; 2]) -> Self {
        Self { size, counts: vec![true; size[0] as usize * size[1] as usize] }
    }

    /// The pixels of this mask that lie in `rect`.
    pub fn within(&self, rect: Rect) -> Self {
        let inside = |v: u32, start: u32, length: u32| v >= start && v - start < length;
        let pixels = (0..self.size[1]).flat_map(|y| (0..self.size[0]).map(move |x| (x, y)));
        let counts = pixels
            .zip(&self.counts)
            .map(|((x, y), c)| *c && inside(x, rect.x, rect.width) && inside(y, rect.y, rect.height))
            .collect();
        Self { size: self.size, counts }
    }
}

/// Errors of an image `x` against a reference `r` over the pixels that count. Means are over pixels and channels.
///
/// All are finite for finite images; what would overflow is `f64::MAX`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct ErrorMetrics {
    /// Mean squared error, (W/(m² sr))².
    pub mse: f64,
    /// Its root, W/(m² sr).
    pub rmse: f64,
    /// RMSE over the reference's mean; 0 if both vanish.
    pub relative_rmse: f64,
    /// `mean((x - r)²/(r² + ε))` with `ε = (0.01 mean r)²`.
    pub relative_mse: f64,
    /// [`Self::mse`] without the worst 0.1 % of the pixels, rounded down; a pixel's error is the mean over its channels.
    pub trimmed_mse: f64,
    /// [`Self::relative_mse`] without the worst 0.1 % of the pixels, rounded down; `ε` is that of all that count.
    pub trimmed_relative_mse: f64,
    /// Symmetric mean absolute percentage error, 0 to 2: `mean(|x - r|/((|x| + |r|)/2))`, with 0/0 = 0.
    pub smape: f64,
    /// Mean signed error `mean(x - r)`, W/(m² sr): above 0 if the image is too bright.
    pub bias: f64,
    /// Largest `|x - r|` of a channel of a pixel, W/(m² sr).
    pub max_error: f64,
    /// Mean of the image over the reference's; 1 if both vanish.
    pub mean_ratio: f64,
    /// Pixels that counted.
    pub pixels: u64,
}

/// Compares images of the same size.
///
/// # Errors
/// If sizes differ, no pixel counts, or a pixel that counts is not finite: the first of them is named.
pub fn compare(image: &Image, reference: &Image, mask: &Mask) -> Result<ErrorMetrics, String> {
    if image.size != reference.size || mask.size != image.size {
        return Err(format!(
            "sizes differ: image {:?}, reference {:?}, mask {:?}",
            image.size, reference.size, mask.size
        ));
    }
    let counted = || {
        image
            .pixels
            .iter()
            .zip(&reference.pixels)
            .zip(&mask.counts)
            .filter(|(_, c)| **c)
            .map(|((x, r), _)| (x.as_dvec3(), r.as_dvec3()))
    };
    let pixels = counted().count() as u64;
    if pixels == 0 {
        return Err("the mask leaves no pixel".into());
    }
    for (what, of) in [("image", image), ("reference", reference)] {
        let is_odd = |(i, p): (usize, &Rgb)| mask.counts[i] && !p.is_finite();
        if let Some((i, p)) = of.pixels.iter().enumerate().find(|(i, p)| is_odd((*i, p))) {
            let (x, y) = (i % of.size[0] as usize, i / of.size[0] as usize);
            let [r, g, b] = p.to_array();
            return Err(format!("pixel {x},{y} of the {what} is not finite (R {r}, G {g}, B {b}); mask it out"));
        }
    }
    let n = 3.0 * pixels as f64;
    let mean = |f: fn(DVec3, DVec3) -> DVec3| counted().map(|(x, r)| f(x, r).element_sum()).sum::<f64>() / n;
    let (own, reference_mean) = (mean(|x, _| x), mean(|_, r| r));
    let mse = mean(|x, r| (x - r) * (x - r));
    let epsilon = (0.01 * reference_mean).powi(2).max(f64::MIN_POSITIVE);
    let relative = |(x, r): (DVec3, DVec3)| ((x - r) * (x - r) / (r * r + epsilon)).element_sum();
    let trimmed = |pixel: &dyn Fn((DVec3, DVec3)) -> f64| {
        let errors: Vec<f64> = counted().map(|p| pixel(p) / 3.0).collect();
        trimmed_mean(&errors).min(f64::MAX)
    };
    let over = |a: f64, zero: f64| {
        if reference_mean > 0.0 {
            a / reference_mean
        } else if a == 0.0 {
            zero
        } else {
            f64::MAX
        }
    };
    Ok(ErrorMetrics {
        mse,
        rmse: mse.sqrt(),
        relative_rmse: over(mse.sqrt(), 0.0),
        relative_mse: (counted().map(relative).sum::<f64>() / n).min(f64::MAX),
        trimmed_mse: trimmed(&|(x, r)| ((x - r) * (x - r)).element_sum()),
        trimmed_relative_mse: trimmed(&relative),
        smape: mean(symmetric),
        bias: mean(|x, r| x - r),
        max_error: counted().map(|(x, r)| (x - r).abs().max_element()).fold(0.0, f64::max),
        mean_ratio: over(own, 1.0),
        pixels,
    })
}

/// `|x - r|/((|x| + |r|)/2)` for each channel; 0 where both vanish.
fn symmetric(x: DVec3, r: DVec3) -> DVec3 {
    let part = |x: f64, r: f64| if x == 0.0 && r == 0.0 { 0.0 } else { 2.0 * (x - r).abs() / (x.abs() + r.abs()) };
    DVec3::new(part(x.x, r.x), part(x.y, r.y), part(x.z, r.z))
}

/// Averages blocks of `n`×`n` pixels over those that count; a block counts if at least half of its pixels do.
///
/// Pixels beyond the last whole block are left out.
pub fn block_average(image: &Image, mask: &Mask, n: u32) -> (Image, Mask) {
    let n = n.max(1);
    let size = [image.size[0] / n, image.size[1] / n];
    let mut out = Image::black(size);
    let mut counts = vec![false; out.pixels.len()];
    for y in 0..size[1] {
        for x in 0..size[0] {
            let mut sum = DVec3::ZERO;
            let mut valid = 0u32;
            for j in 0..n {
                for i in 0..n {
                    let at = ((y * n + j) * image.size[0] + x * n + i) as usize;
                    if mask.counts[at] {
                        sum += image.pixels[at].as_dvec3();
                        valid += 1;
                    }
                }
            }
            let to = (y * size[0] + x) as usize;
            if valid > 0 {
                out.pixels[to] = (sum / f64::from(valid)).as_vec3();
            }
            counts[to] = 2 * valid >= n * n;
        }
    }
    (out, Mask { size, counts })
}

/// Mean radiance over a rectangle, corners `x0, y0` included and `x1, y1` excluded.
pub fn region_mean(image: &Image, [x0, y0, x1, y1]: [u32; 4]) -> Rgb {
    let mut sum = DVec3::ZERO;
    for y in y0..y1 {
        for x in x0..x1 {
            sum += image.at(x, y).as_dvec3();
        }
    }
    (sum / f64::from((x1 - x0) * (y1 - y0))).as_vec3()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn grey(size: [u32; 2], values: &[f32]) -> Image {
        Image { size, pixels: values.iter().map(|v| Rgb::splat(*v)).collect() }
    }

    #[test]
    fn metrics_match_a_case_by_hand() {
        let image = grey([2, 1], &[1.0, 4.0]);
        let reference = grey([2, 1], &[2.0, 2.0]);
        let e = compare(&image, &reference, &Mask::all([2, 1])).expect("same size");
        assert!((e.mse - 2.5).abs() < 1e-12);
        assert!((e.relative_rmse - 2.5f64.sqrt() / 2.0).abs() < 1e-12);
        let epsilon = 0.02f64 * 0.02;
        assert!((e.relative_mse - 2.5 / (4.0 + epsilon)).abs() < 1e-12);
        assert!((e.mean_ratio - 1.25).abs() < 1e-12 && e.pixels == 2);
        // 1/1.5 and 2/3, the signs of the errors differ.
        assert!((e.smape - 2.0 / 3.0).abs() < 1e-12);
        assert_eq!((e.bias, e.max_error, e.trimmed_mse), (0.5, 2.0, e.mse));
        assert!((e.trimmed_relative_mse - e.relative_mse).abs() < 1e-12);
    }

    #[test]
    fn channels_count_one_by_one() {
        let image = Image { size: [1, 1], pixels: vec![Rgb::new(0.0, 3.0, -1.0)] };
        let reference = Image { size: [1, 1], pixels: vec![Rgb::new(0.0, 1.0, 1.0)] };
        let e = compare(&image, &reference, &Mask::all([1, 1])).expect("same size");
        // 0/0, 2/2 and 2/1.
        assert_eq!((e.smape, e.bias, e.max_error), (1.0, 0.0, 2.0));
        assert!((e.mse - 8.0 / 3.0).abs() < 1e-12);
    }

    #[test]
    fn one_firefly_in_a_thousand_does_not_count_as_trimmed() {
        let mut image = grey([40, 25], &[1.5; 1000]);
        image.pixels[77] = Rgb::splat(1e4);
        let e = compare(&image, &grey([40, 25], &[1.0; 1000]), &Mask::all([40, 25])).expect("same size");
        assert!((e.trimmed_mse - 0.25).abs() < 1e-12 && (e.trimmed_relative_mse - 0.25 / 1.0001).abs() < 1e-12);
        assert!(e.mse > 9e4 && e.max_error == 9999.0);
    }

    #[test]
    fn a_crop_counts_its_pixels_of_the_mask() {
        let mut mask = Mask::all([4, 3]);
        mask.counts[5] = false;
        let counts = mask.within(Rect { x: 1, y: 1, width: 2, height: 9 }).counts;
        let expected = [0, 0, 0, 0, 0, 0, 1, 0, 0, 1, 1, 0].map(|c| c == 1);
        assert_eq!(counts, expected);
    }

    #[test]
    fn nothing_overflows() {
        let (huge, black) = (grey([1, 2], &[3e38, 1.0]), grey([1, 2], &[0.0, 0.0]));
        for (x, r) in [(&huge, &black), (&black, &huge)] {
            let e = compare(x, r, &Mask::all([1, 2])).expect("same size");
            let all = [e.mse, e.rmse, e.relative_rmse, e.relative_mse, e.trimmed_mse, e.trimmed_relative_mse];
            assert!(all.iter().chain(&[e.smape, e.bias, e.max_error, e.mean_ratio]).all(|v| v.is_finite()), "{e:?}");
        }
    }

    #[test]
    fn masked_pixels_do_not_count() {
        let image = grey([2, 1], &[1.0, 99.0]);
        let reference = grey([2, 1], &[1.0, 2.0]);
        let mask = Mask { size: [2, 1], counts: vec![true, false] };
        assert_eq!(compare(&image, &reference, &mask).expect("one pixel").mse, 0.0);
        let none = Mask { size: [2, 1], counts: vec![false; 2] };
        assert!(compare(&image, &reference, &none).is_err());
        assert!(compare(&image, &grey([1, 1], &[0.0]), &mask).is_err());
    }

    #[test]
    fn black_against_black_is_no_error() {
        let black = grey([1, 1], &[0.0]);
        let e = compare(&black, &black, &Mask::all([1, 1])).expect("one pixel");
        assert_eq!((e.relative_rmse, e.relative_mse, e.mean_ratio), (0.0, 0.0, 1.0));
    }

    #[test]
    fn blocks_average_their_valid_pixels() {
        let image = grey([4, 2], &[1.0, 3.0, 5.0, 7.0, 9.0, 9.0, 9.0, 9.0]);
        let mask = Mask { size: [4, 2], counts: vec![true, true, true, false, false, false, false, false] };
        let (small, kept) = block_average(&image, &mask, 2);
        assert_eq!(small.at(0, 0).x, 2.0);
        assert_eq!(kept.counts, vec![true, false]);
        assert_eq!(region_mean(&image, [0, 0, 2, 1]).x, 2.0);
    }
}
