//! Reference images: those of the binary, and those that a user gives.

use crate::measure::image_file;
use crate::measure::metrics::{self, ErrorMetrics, Mask};
use crate::render::film::Image;
use crate::scene::built_in;
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
}

impl Reference {
    /// The stored reference of a built-in scene, if it has one.
    ///
    /// # Errors
    /// A defect of the binary.
    pub fn built_in(name: &str) -> Result<Option<Self>, String> {
        let Some((exr, png)) = built_in::find(name).and_then(|b| b.reference) else {
            return Ok(None);
        };
        Ok(Some(Self {
            source: format!("built-in reference of {name} (Mitsuba 3.9.1)"),
            image: image_file::decode(exr)?,
            mask: image_file::decode_mask(png)?,
        }))
    }

    /// A reference from files, EXR or PNG (see [`image_file::read`]); without a mask all pixels count.
    ///
    /// # Errors
    /// A file that cannot be read, or a mask of another size.
    pub fn from_files(reference: &Path, mask: Option<&Path>) -> Result<Self, String> {
        let image = image_file::read(reference).map_err(|e| e.to_string())?;
        let mask = match mask {
            Some(path) => image_file::read_mask(path).map_err(|e| e.to_string())?,
            None => Mask::all(image.size),
        };
        if mask.size != image.size {
            return Err(format!(
                "the mask has {}x{} pixels, the reference {}x{}; they must be the same",
                mask.size[0], mask.size[1], image.size[0], image.size[1]
            ));
        }
        Ok(Self { source: reference.display().to_string(), image, mask })
    }

    /// Error of an image against this reference. An image that is a whole number of times as large is averaged down.
    ///
    /// # Errors
    /// If the sizes do not fit, or no pixel counts.
    pub fn error_of(&self, image: &Image) -> Result<ErrorMetrics, String> {
        let [w, h] = self.image.size;
        let fits = |a: u32, b: u32| a >= b && a.is_multiple_of(b);
        if !(fits(image.size[0], w) && fits(image.size[1], h)) {
            return Err(format!(
                "the image of {}x{} pixels is no multiple of the reference's {w}x{h}",
                image.size[0], image.size[1]
            ));
        }
        if image.size == self.image.size {
            metrics::compare(image, &self.image, &self.mask)
        } else {
            metrics::compare(&image.resampled(self.image.size), &self.image, &self.mask)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::measure::metrics::region_mean;

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
        }
        assert!(Reference::built_in("plane").expect("no defect").is_none());
    }

    #[test]
    fn a_larger_image_is_averaged_down() {
        let r = Reference { source: String::new(), image: Image::black([2, 2]), mask: Mask::all([2, 2]) };
        assert_eq!(r.error_of(&Image::black([4, 4])).expect("fits").mse, 0.0);
        assert!(r.error_of(&Image::black([3, 4])).is_err());
        assert!(r.error_of(&Image::black([1, 1])).is_err());
    }
}
