//! Images of independent batches: their mean, and the variance of that mean from how they differ.

use crate::measure::Mask;
use crate::render::film::Image;
use glam::DVec3;

/// Sums over batches.
#[derive(Clone, Debug, PartialEq)]
pub struct Batches {
    /// Pixels across and down.
    pub(crate) size: [u32; 2],
    /// Batches.
    pub(crate) count: u32,
    /// Sum of the batches' images, W/(m² sr).
    pub(crate) sum: Vec<DVec3>,
    /// Sum of their squares.
    pub(crate) squares: Vec<DVec3>,
}

impl Batches {
    /// None yet.
    pub fn new(size: [u32; 2]) -> Self {
        let pixels = size[0] as usize * size[1] as usize;
        Self { size, count: 0, sum: vec![DVec3::ZERO; pixels], squares: vec![DVec3::ZERO; pixels] }
    }

    /// Adds the image of a batch. A pixel that is not finite counts as black.
    pub fn add(&mut self, image: &[DVec3]) {
        for ((sum, squares), p) in self.sum.iter_mut().zip(&mut self.squares).zip(image) {
            let square = *p * *p;
            if square.is_finite() {
                *sum += *p;
                *squares += square;
            }
        }
        self.count += 1;
    }

    /// Batches so far.
    pub fn count(&self) -> u32 {
        self.count
    }

    /// Mean of the batches; black without any.
    pub fn mean(&self) -> Image {
        let n = f64::from(self.count.max(1));
        Image { size: self.size, pixels: self.sum.iter().map(|s| stored(*s / n)).collect() }
    }

    /// Variance of the mean of each pixel and channel, unbiased; None with fewer than two batches.
    pub fn variance(&self) -> Option<Image> {
        (self.count >= 2).then(|| Image {
            size: self.size,
            pixels: (0..self.sum.len()).map(|i| stored(self.variance_at(i))).collect(),
        })
    }

    fn variance_at(&self, i: usize) -> DVec3 {
        let n = f64::from(self.count);
        let (sum, squares) = (self.sum[i], self.squares[i]);
        ((squares - sum * sum / n) / (n * (n - 1.0))).max(DVec3::ZERO)
    }

    /// RMS of the noise of the mean, and the mean, over the pixels of `mask` and their channels; None with fewer than two
    /// batches, without a pixel, or with a mask of another size.
    pub fn noise(&self, mask: &Mask) -> Option<(f64, f64)> {
        if self.count < 2 || mask.size != self.size {
            return None;
        }
        let counted = mask.counts.iter().enumerate().filter(|(_, c)| **c).map(|(i, _)| i);
        let (variance, sum, n) = counted.fold((0.0, 0.0, 0u64), |(v, s, n), i| {
            (v + self.variance_at(i).element_sum(), s + self.sum[i].element_sum(), n + 3)
        });
        (n > 0).then(|| ((variance / n as f64).sqrt(), sum / (n as f64 * f64::from(self.count))))
    }
}

/// As 32 bits, finite.
fn stored(v: DVec3) -> glam::Vec3 {
    let limit = f64::from(f32::MAX);
    v.clamp(DVec3::splat(-limit), DVec3::splat(limit)).as_vec3()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn mean_and_variance_match_a_case_by_hand() {
        let mut b = Batches::new([1, 1]);
        assert!(b.noise(&Mask::all([1, 1])).is_none());
        for v in [1.0, 2.0, 6.0] {
            b.add(&[DVec3::splat(v)]);
        }
        // Mean 3, squares of deviations 4 + 1 + 9 = 14, variance 7, of the mean 7/3.
        assert_eq!(b.mean().at(0, 0).x, 3.0);
        assert!((b.variance().expect("three").at(0, 0).x - 7.0 / 3.0).abs() < 1e-6);
        let (rms, mean) = b.noise(&Mask::all([1, 1])).expect("three");
        assert!((rms * rms - 7.0 / 3.0).abs() < 1e-12 && (mean - 3.0).abs() < 1e-12);
    }

    #[test]
    fn what_is_not_finite_is_left_out() {
        let mut b = Batches::new([2, 1]);
        b.add(&[DVec3::NAN, DVec3::splat(1e300)]);
        b.add(&[DVec3::INFINITY, DVec3::splat(1e60)]);
        assert!(b.mean().pixels.iter().chain(&b.variance().expect("two").pixels).all(|p| p.is_finite()));
    }
}
