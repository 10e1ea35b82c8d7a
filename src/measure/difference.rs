//! Difference of an image from a reference, pixel by pixel.

use crate::measure::flip::{FlipView, flip};
use crate::measure::image_file::NotFinite;
use crate::render::film::Image;
use glam::{DVec3, Vec3};

/// What is taken of an image `x` and a reference `r`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Difference {
    /// `x - r`, W/(m² sr): above 0 where the image is too bright.
    #[default]
    Signed,
    /// `|x - r|`, W/(m² sr).
    Absolute,
    /// `(x - r)/(|r| + ε)` with `ε = 0.01 mean |r|` over all pixels and channels of the reference; no unit.
    Relative,
    /// FLIP, in [0, 1]; see [`crate::measure::flip`].
    Flip,
}

impl Difference {
    /// All of them.
    pub const ALL: [Self; 4] = [Self::Signed, Self::Absolute, Self::Relative, Self::Flip];

    /// Its name in flags and files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Signed => "signed",
            Self::Absolute => "absolute",
            Self::Relative => "relative",
            Self::Flip => "flip",
        }
    }

    /// Unit of its values, empty without.
    pub fn unit(self) -> &'static str {
        match self {
            Self::Signed | Self::Absolute => "W/(m² sr)",
            Self::Relative | Self::Flip => "",
        }
    }

    /// Whether values lie on both sides of 0.
    pub fn is_signed(self) -> bool {
        matches!(self, Self::Signed | Self::Relative)
    }
}

/// One value for each pixel, row by row: the mean over the channels of [`channels`].
///
/// * `exposure`: stops, for [`Difference::Flip`] alone.
///
/// Finite; images that are not are refused.
///
/// # Errors
/// If sizes differ, or the exposure is out of range.
pub fn difference(kind: Difference, image: &Image, reference: &Image, exposure: f32) -> Result<Vec<f32>, String> {
    if kind == Difference::Flip {
        return Ok(flip(image, reference, FlipView::exposed(exposure))?.map);
    }
    Ok(channel_values(kind, image, reference)?.map(|d| finite(d.element_sum() / 3.0)).collect())
}

/// The difference channel by channel; FLIP has the same value in all three.
///
/// * `exposure`: stops, for [`Difference::Flip`] alone.
///
/// Finite; images that are not are refused.
///
/// # Errors
/// If sizes differ, or the exposure is out of range.
pub fn channels(kind: Difference, image: &Image, reference: &Image, exposure: f32) -> Result<Image, String> {
    let pixels = if kind == Difference::Flip {
        flip(image, reference, FlipView::exposed(exposure))?.map.into_iter().map(Vec3::splat).collect()
    } else {
        channel_values(kind, image, reference)?.map(|d| d.to_array().map(finite).into()).collect()
    };
    Ok(Image { size: image.size, pixels })
}

/// Half width of a range of values around 0: the 99 % quantile of `|value|` over the pixels that count.
///
/// A few bright pixels do not decide it. Their maximum, if that quantile is 0; 1, if all values are 0.
///
/// * `counts`: whether each value counts; as many as values.
pub fn quantile_range(values: &[f32], counts: &[bool]) -> f32 {
    let mut sizes: Vec<f32> = values.iter().zip(counts).filter(|(_, c)| **c).map(|(v, _)| v.abs()).collect();
    let largest = sizes.iter().copied().fold(0.0, f32::max);
    if largest == 0.0 {
        return 1.0;
    }
    let at = (0.99 * (sizes.len() - 1) as f64) as usize;
    let (_, &mut quantile, _) = sizes.select_nth_unstable_by(at, f32::total_cmp);
    if quantile > 0.0 { quantile } else { largest }
}

fn channel_values<'a>(
    kind: Difference,
    image: &'a Image,
    reference: &'a Image,
) -> Result<impl Iterator<Item = DVec3> + 'a, String> {
    if image.size != reference.size {
        return Err(format!("sizes differ: image {:?}, reference {:?}", image.size, reference.size));
    }
    for (what, of) in [("image", image), ("reference", reference)] {
        if let Some(odd) = NotFinite::of(of) {
            return Err(format!("the {what}: {odd}; mend it first"));
        }
    }
    let n = 3.0 * reference.pixels.len().max(1) as f64;
    let sum: f64 = reference.pixels.iter().map(|r| r.as_dvec3().abs().element_sum()).sum();
    // A black reference leaves a divisor that is small, not 0.
    let epsilon = (0.01 * sum / n).max(f64::MIN_POSITIVE);
    Ok(image.pixels.iter().zip(&reference.pixels).map(move |(x, r)| {
        let (x, r) = (x.as_dvec3(), r.as_dvec3());
        match kind {
            Difference::Absolute => (x - r).abs(),
            Difference::Relative => (x - r) / (r.abs() + epsilon),
            Difference::Signed | Difference::Flip => x - r,
        }
    }))
}

fn finite(x: f64) -> f32 {
    x.clamp(-f64::from(f32::MAX), f64::from(f32::MAX)) as f32
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pair() -> [Image; 2] {
        let image = |a: [f32; 3], b: [f32; 3]| Image { size: [2, 1], pixels: vec![a.into(), b.into()] };
        [image([1.0, 2.0, 3.0], [0.5, 0.5, 0.5]), image([2.0, 2.0, 0.0], [0.0, 0.0, 2.0])]
    }

    #[test]
    fn values_match_a_case_by_hand() {
        let [x, r] = pair();
        let of = |kind| difference(kind, &x, &r, 0.0).expect("same size");
        assert_eq!(of(Difference::Signed), [2.0 / 3.0, -0.5 / 3.0]);
        assert_eq!(of(Difference::Absolute), [4.0 / 3.0, 2.5 / 3.0]);
        // The reference's mean is 1, so ε is 0.01.
        let relative = [(-1.0 / 2.01 + 3.0 / 0.01) / 3.0, (0.5 / 0.01 + 0.5 / 0.01 - 1.5 / 2.01) / 3.0];
        for (a, b) in of(Difference::Relative).iter().zip(relative) {
            assert!((a - b).abs() < 1e-5 * b.abs(), "{a} {b}");
        }
        let map = flip(&x, &r, FlipView::exposed(0.0)).expect("same size").map;
        assert_eq!(of(Difference::Flip), map);
        assert!(difference(Difference::Signed, &x, &Image::black([1, 2]), 0.0).is_err());
    }

    #[test]
    fn channels_keep_what_the_mean_hides() {
        let [x, r] = pair();
        let of = |kind| channels(kind, &x, &r, 0.0).expect("same size").pixels;
        assert_eq!(of(Difference::Signed), [Vec3::new(-1.0, 0.0, 3.0), Vec3::new(0.5, 0.5, -1.5)]);
        assert_eq!(of(Difference::Absolute), [Vec3::new(1.0, 0.0, 3.0), Vec3::new(0.5, 0.5, 1.5)]);
        assert!(of(Difference::Flip).iter().all(|p| p.x == p.y && p.y == p.z));
    }

    #[test]
    fn nothing_is_infinite() {
        let of = |v: f32| Image { size: [1, 1], pixels: vec![Vec3::splat(v)] };
        for kind in Difference::ALL {
            for (x, r) in [(3e38, -3e38), (3e38, 0.0), (0.0, 0.0), (-1.0, 1e-45)] {
                let values = difference(kind, &of(x), &of(r), 64.0).expect("same size");
                assert!(values[0].is_finite(), "{kind:?} {x} {r}");
            }
        }
    }

    #[test]
    fn a_range_ignores_a_few_bright_pixels() {
        let mut values = vec![0.5f32; 1000];
        values[3] = -1e6;
        let counts = vec![true; 1000];
        assert_eq!(quantile_range(&values, &counts), 0.5);
        assert_eq!(quantile_range(&[0.0, -3.0], &[true, false]), 1.0);
        let mut one = vec![0.0f32; 1000];
        one[9] = -2.0;
        assert_eq!(quantile_range(&one, &counts), 2.0);
        assert_eq!(quantile_range(&[], &[]), 1.0);
    }
}
