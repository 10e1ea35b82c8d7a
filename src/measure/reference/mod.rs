//! Reference images: those of the binary, those that a user gives, and how far they are from the truth themselves.

pub mod cache;
pub mod closed_form;
pub mod noise;

pub use noise::Noise;

use crate::measure::image_file::{self, Marked};
use crate::measure::metrics::{self, ErrorMetrics, Mask};
use crate::render::film::Image;
use crate::scene::built_in;
use std::borrow::Cow;
use std::path::Path;

/// An image to compare with, and where it counts.
#[derive(Clone, Debug)]
pub struct Reference {
    /// Where it comes from.
    pub source: String,
    /// The image.
    pub image: Image,
    /// The pixels that count.
    pub mask: Mask,
    /// How far it is from the truth.
    pub noise: Noise,
}

/// Key of where a reference comes from.
pub const SOURCE: &str = "cusp.reference.source";
/// Key of the RMS of a reference's noise over its mask, W/(m² sr).
pub const NOISE_RMSE: &str = "cusp.reference.noise_rmse";
/// Key of the same over the reference's mean.
pub const NOISE_RELATIVE: &str = "cusp.reference.noise_relative";

/// RMS of the noise of the stored references over their means, over their masks, as measured when they were made.
const BUILT_IN_NOISE: [(&str, f64); 4] =
    [("ring", 0.006), ("ring_soft", 0.044), ("glass_ball", 0.027), ("cornell", 0.012)];

impl Reference {
    /// The stored reference of a built-in scene, if it has one.
    ///
    /// # Errors
    /// A defect of the binary.
    pub fn built_in(name: &str) -> Result<Option<Self>, String> {
        let Some((exr, png)) = built_in::find(name).and_then(|b| b.reference) else {
            return Ok(None);
        };
        let known = BUILT_IN_NOISE.iter().find(|(n, _)| *n == name);
        Ok(Some(Self {
            source: format!("built-in reference of {name} (Mitsuba 3.9.1)"),
            image: image_file::decode(exr)?,
            mask: image_file::decode_mask(png)?,
            noise: known.map_or(Noise::Unknown, |(_, relative)| Noise::Relative(*relative)),
        }))
    }

    /// A reference from files, EXR or PNG (see [`image_file::read`]); without a mask all pixels count, but those that are
    /// not finite, which the source tells of.
    ///
    /// Source and noise are those that the header of an EXR states (see [`Self::facts`]); without them the source is
    /// the file and the noise is unknown.
    ///
    /// # Errors
    /// A file that cannot be read, or a mask of another size.
    pub fn from_files(reference: &Path, mask: Option<&Path>) -> Result<Self, String> {
        let Marked { image, facts, not_finite: odd } =
            image_file::read_reference(reference).map_err(|e| e.to_string())?;
        let mut mask = match mask {
            Some(path) => image_file::read_mask(path).map_err(|e| e.to_string())?,
            None => Mask::all(image.size),
        };
        if mask.size != image.size {
            return Err(format!(
                "the mask has {}x{} pixels, the reference {}x{}; they must be the same",
                mask.size[0], mask.size[1], image.size[0], image.size[1]
            ));
        }
        if let Some(odd) = &odd {
            mask.leave_out(&odd.pixels);
        }
        let fact = |key: &str| facts.iter().find(|(k, _)| k == key).map(|(_, v)| v.as_str());
        let number = |key: &str| {
            fact(key).and_then(|v| v.parse::<f64>().ok()).filter(|v| v.is_finite() && !v.is_sign_negative())
        };
        let noise = match (number(NOISE_RMSE), noise::mean_over(&image, &mask)) {
            (Some(0.0), _) => Noise::Exact,
            // A mask that is not the one of the file's maker has another mean; the noise itself stays.
            (Some(rmse), Some(mean)) if mean > 0.0 => Noise::Relative(rmse / mean),
            _ => number(NOISE_RELATIVE).map_or(Noise::Unknown, Noise::Relative),
        };
        let source = match fact(SOURCE) {
            Some(source) => format!("{} ({source})", reference.display()),
            None => reference.display().to_string(),
        };
        let source = match odd {
            Some(odd) => format!("{source}, {odd}, left out"),
            None => source,
        };
        Ok(Self { source, image, mask, noise })
    }

    /// What the header of an EXR file of this reference should say: source and, if known, noise over the mask.
    pub fn facts(&self) -> Vec<(&'static str, String)> {
        let mut facts = vec![(SOURCE, self.source.split_whitespace().collect::<Vec<_>>().join(" "))];
        if let Some(mse) = self.noise_mse(&self.mask) {
            facts.push((NOISE_RMSE, format!("{:e}", mse.sqrt())));
            if let Some(relative) = self.relative_noise(&self.mask) {
                facts.push((NOISE_RELATIVE, format!("{relative:e}")));
            }
        }
        facts
    }

    /// Mean squared noise over the pixels of `mask`, which has the reference's size, (W/(m² sr))²; None if unknown.
    ///
    /// That much of an image's mean squared error is the reference's own. Of [`Noise::Relative`] only the value over
    /// the reference's own mask is known; it stands for every mask.
    pub fn noise_mse(&self, mask: &Mask) -> Option<f64> {
        match &self.noise {
            Noise::Unknown => None,
            Noise::Relative(relative) => {
                noise::mean_over(&self.image, &self.mask).map(|mean| (relative * mean) * (relative * mean))
            }
            Noise::Measured(variance) => noise::mean_over(variance, mask),
            Noise::Exact => Some(0.0),
        }
    }

    /// RMS of the noise over the mean of the reference, both over `mask`; None if unknown or if the mean vanishes.
    pub fn relative_noise(&self, mask: &Mask) -> Option<f64> {
        let mean = noise::mean_over(&self.image, mask)?;
        let mse = self.noise_mse(mask)?;
        (mean > 0.0).then(|| mse.sqrt() / mean)
    }

    /// An image in the size of this reference: itself, or averaged down if it is a whole number of times as large.
    ///
    /// # Errors
    /// Any other size.
    pub fn fitted<'i>(&self, image: &'i Image) -> Result<Cow<'i, Image>, String> {
        let ([a, b], [w, h]) = (image.size, self.image.size);
        let fits = |a: u32, b: u32| a >= b && a.is_multiple_of(b);
        if image.size == self.image.size {
            Ok(Cow::Borrowed(image))
        } else if fits(a, w) && fits(b, h) {
            Ok(Cow::Owned(image.resampled(self.image.size)))
        } else {
            Err(format!("the image of {a}x{b} pixels is no multiple of the reference's {w}x{h}"))
        }
    }

    /// Error of an image against this reference. An image that is a whole number of times as large is averaged down.
    ///
    /// # Errors
    /// If the sizes do not fit, or no pixel counts.
    pub fn error_of(&self, image: &Image) -> Result<ErrorMetrics, String> {
        metrics::compare(&*self.fitted(image)?, &self.image, &self.mask)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::measure::metrics::region_mean;
    use exr::prelude::{
        AttributeValue, Encoding, Image as ExrImage, Layer, LayerAttributes, SpecificChannels, Text, Vec2,
        WritableImage,
    };
    use glam::Vec3;

    /// Means that were measured when the references were made.
    #[test]
    fn stored_references_hold_what_was_measured() {
        for (name, rect, mean) in [
            ("ring", [150, 138, 166, 150], 0.36305),
            ("ring_soft", [140, 100, 200, 150], 0.16876),
            ("glass_ball", [104, 123, 120, 130], 2.05469),
            ("cornell", [20, 60, 45, 180], 0.41913),
        ] {
            let r = Reference::built_in(name).expect("decodes").expect("is there");
            assert!((region_mean(&r.image, rect).x - mean).abs() < 1e-4, "{name}");
            assert_eq!(r.mask.size, r.image.size);
            assert!(r.relative_noise(&r.mask).is_some_and(|n| (0.005..0.05).contains(&n)), "{name}");
        }
        assert!(Reference::built_in("plane").expect("no defect").is_none());
    }

    fn reference(image: Image, noise: Noise) -> Reference {
        Reference { source: "a\n test".into(), mask: Mask::all(image.size), image, noise }
    }

    #[test]
    fn a_larger_image_is_averaged_down() {
        let r = reference(Image::black([2, 2]), Noise::Unknown);
        assert_eq!(r.error_of(&Image::black([4, 4])).expect("fits").mse, 0.0);
        assert!(r.error_of(&Image::black([3, 4])).is_err());
        assert!(r.error_of(&Image::black([1, 1])).is_err());
    }

    #[test]
    fn noise_is_taken_over_the_mask() {
        let image = Image { size: [2, 1], pixels: vec![Vec3::splat(1.0), Vec3::splat(3.0)] };
        let first = Mask { size: [2, 1], counts: vec![true, false] };
        let variance = Image { size: [2, 1], pixels: vec![Vec3::new(0.01, 0.04, 0.04), Vec3::splat(1.0)] };
        let r = reference(image.clone(), Noise::Measured(variance));
        assert!((r.noise_mse(&first).expect("known") - 0.03).abs() < 1e-8);
        assert!((r.relative_noise(&first).expect("known") - 0.03f64.sqrt()).abs() < 1e-8);
        assert!((r.noise_mse(&r.mask).expect("known") - 0.515).abs() < 1e-7);
        let r = reference(image.clone(), Noise::Relative(0.1));
        assert!((r.noise_mse(&r.mask).expect("known") - 0.04).abs() < 1e-12);
        assert_eq!(reference(image.clone(), Noise::Exact).noise_mse(&first), Some(0.0));
        assert_eq!(reference(image, Noise::Unknown).noise_mse(&first), None);
        // Another size, and no pixel at all.
        assert_eq!(r.relative_noise(&Mask::all([1, 1])), None);
        assert_eq!(r.relative_noise(&Mask { size: [2, 1], counts: vec![false; 2] }), None);
    }

    fn write(path: &Path, image: &Image, facts: &[(&str, String)]) {
        let channels = SpecificChannels::rgb(|Vec2(x, y)| {
            let p = image.at(x as u32, y as u32);
            (p.x, p.y, p.z)
        });
        let mut attributes = LayerAttributes::default();
        let text: Vec<String> = facts.iter().map(|(k, v)| format!("{k} = {v}")).collect();
        attributes.other.insert(Text::from("cusp"), AttributeValue::Text(Text::from(text.join("\n").as_str())));
        let size = (image.size[0] as usize, image.size[1] as usize);
        let layer = Layer::new(size, attributes, Encoding::SMALL_LOSSLESS, channels);
        ExrImage::from_layer(layer).write().to_file(path).expect("writes");
    }

    #[test]
    fn an_exr_brings_its_source_and_noise_back() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let path = folder.path().join("a.exr");
        let image = Image { size: [2, 1], pixels: vec![Vec3::splat(1.0), Vec3::splat(3.0)] };
        for noise in [
            Noise::Measured(Image { size: [2, 1], pixels: vec![Vec3::splat(0.01); 2] }),
            Noise::Relative(0.05),
            Noise::Exact,
        ] {
            let r = reference(image.clone(), noise);
            write(&path, &image, &r.facts());
            let back = Reference::from_files(&path, None).expect("reads");
            assert!(back.source.ends_with("a.exr (a test)"), "{}", back.source);
            let (own, read) = (r.noise_mse(&r.mask).expect("known"), back.noise_mse(&back.mask).expect("known"));
            assert!((own - read).abs() < 1e-9, "{own} {read}");
            assert_eq!(r.noise == Noise::Exact, back.noise == Noise::Exact);
        }
        for odd in ["-1", "nan", "inf", "much", ""] {
            write(&path, &image, &[(NOISE_RMSE, odd.into())]);
            assert_eq!(Reference::from_files(&path, None).expect("reads").noise, Noise::Unknown, "{odd}");
        }
    }
}
