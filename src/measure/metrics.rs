//! Error of an image against a reference.

use crate::math::rgb::Rgb;
use crate::render::film::Image;
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
    /// All pixels.
    pub fn all(size: [u32; 2]) -> Self {
        Self { size, counts: vec![true; size[0] as usize * size[1] as usize] }
    }
}

/// Errors over the pixels that count. Each is a mean over pixels and channels.
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
    /// Mean of the image over the reference's; 1 if both vanish.
    pub mean_ratio: f64,
    /// Pixels that counted.
    pub pixels: u64,
}

/// Compares images of the same size.
///
/// # Errors
/// If sizes differ or no pixel counts.
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
    let n = 3.0 * pixels as f64;
    let sum = |v: DVec3| v.element_sum();
    let mean = |f: fn((DVec3, DVec3)) -> DVec3| counted().map(|p| sum(f(p))).sum::<f64>() / n;
    let (own, reference_mean) = (mean(|(x, _)| x), mean(|(_, r)| r));
    let mse = mean(|(x, r)| (x - r) * (x - r));
    let epsilon = (0.01 * reference_mean).powi(2).max(f64::MIN_POSITIVE);
    let relative_mse = counted().map(|(x, r)| sum((x - r) * (x - r) / (r * r + epsilon))).sum::<f64>() / n;
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
        relative_mse,
        mean_ratio: over(own, 1.0),
        pixels,
    })
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
