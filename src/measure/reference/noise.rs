//! How far a reference is from the truth by itself.

use crate::measure::Mask;
use crate::render::film::Image;

/// How far the reference itself is from the truth.
#[derive(Clone, Debug, PartialEq)]
pub enum Noise {
    /// Nothing is known of it.
    Unknown,
    /// RMS of the noise over the mean of the reference, both over the reference's mask; 0 or more. Measured by the
    /// reference's maker, or stated in an EXR's header.
    Relative(f64),
    /// Variance of each pixel's mean, (W/(m² sr))², measured on the samples themselves; channels apart.
    Measured(Image),
    /// A closed form: none.
    Exact,
}

/// Mean of all channels of the pixels of an image that count; None if none counts or sizes differ.
pub(crate) fn mean_over(image: &Image, mask: &Mask) -> Option<f64> {
    if image.size != mask.size {
        return None;
    }
    let counted = image.pixels.iter().zip(&mask.counts).filter(|(_, c)| **c);
    let (sum, n) = counted.fold((0.0, 0u64), |(sum, n), (p, _)| (sum + p.as_dvec3().element_sum(), n + 3));
    (n > 0).then(|| sum / n as f64)
}
