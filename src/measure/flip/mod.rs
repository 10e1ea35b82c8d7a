//! LDR-FLIP: how much two images differ for an eye that flips between them.
//!
//! P. Andersson, J. Nilsson, T. Akenine-Möller, M. Oskarsson, K. Åström, M. D. Fairchild: FLIP: A Difference Evaluator
//! for Alternating Images (2020), here Andersson 2020. Images are linear; each is multiplied by `2^exposure` and
//! clamped to [0, 1], which is all of the tone mapping. What is brighter than white in both images is not seen.

mod color;
mod filter;

use crate::measure::Mask;
use crate::render::film::Image;
use crate::scene::memory;
use color::{ColorSpaces, hyab};
use filter::{Plane, contrast_sensitivity, features};
use glam::DVec3;
use rayon::prelude::*;

/// Pixels for a degree of the field of view: a display 0.7 m wide with 3840 pixels, seen from 0.7 m.
pub const PIXELS_PER_DEGREE: f64 = 3840.0 * std::f64::consts::PI / 180.0;
/// Largest number of stops up or down.
pub const MAX_STOPS: f32 = 64.0;

/// Exponent of the colour difference.
/// Memory for each pixel at the highest: for both images three planes and the colours seen, two planes of features, and
/// for one image the colours before they are planes, and three filtered planes.
const BYTES_PER_PIXEL: usize = 2 * (3 * 4 + size_of::<DVec3>() + 2 * 4) + size_of::<DVec3>() + 3 * 4;

const COLOR_EXPONENT: f64 = 0.7;
/// Exponent of the feature difference.
const FEATURE_EXPONENT: f64 = 0.5;
/// Part of the largest colour difference up to which differences are spread out,
const LOW_PART: f64 = 0.4;
/// and the part of the result that these take.
const LOW_RESULT: f64 = 0.95;

/// How the images are looked at.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FlipView {
    /// Stops: radiance is multiplied by `2^exposure` before it is clamped to [0, 1]. In ±[`MAX_STOPS`].
    pub exposure: f32,
    /// Pixels for a degree of the field of view, 1 to 1000.
    pub pixels_per_degree: f64,
}

impl FlipView {
    /// That exposure on the display of [`PIXELS_PER_DEGREE`].
    pub fn exposed(exposure: f32) -> Self {
        Self { exposure, pixels_per_degree: PIXELS_PER_DEGREE }
    }

    fn check(&self) -> Result<(), String> {
        if !(-MAX_STOPS..=MAX_STOPS).contains(&self.exposure) {
            return Err(format!("exposure: must lie in -{MAX_STOPS} to {MAX_STOPS} stops, got {}", self.exposure));
        }
        if !(1.0..=1000.0).contains(&self.pixels_per_degree) {
            return Err(format!("pixels per degree: must lie in 1 to 1000, got {}", self.pixels_per_degree));
        }
        Ok(())
    }
}

/// The difference of two images, pixel by pixel.
#[derive(Clone, Debug, PartialEq)]
pub struct Flip {
    /// Pixels across and down.
    pub size: [u32; 2],
    /// Differences in [0, 1], row by row.
    pub map: Vec<f32>,
}

impl Flip {
    /// Mean over the pixels that count; None if there is none or the mask has another size.
    pub fn mean(&self, mask: &Mask) -> Option<f64> {
        if mask.size != self.size {
            return None;
        }
        let counted = || self.map.iter().zip(&mask.counts).filter(|(_, c)| **c).map(|(v, _)| f64::from(*v));
        let pixels = counted().count();
        (pixels > 0).then(|| counted().sum::<f64>() / pixels as f64)
    }
}

/// FLIP of an image against a reference of the same size; the two can change places.
///
/// The same bits on any number of threads. A value that is no number counts as 0.
///
/// # Errors
/// If sizes differ, or the exposure or the pixels per degree are out of range.
pub fn flip(image: &Image, reference: &Image, view: FlipView) -> Result<Flip, String> {
    view.check()?;
    if image.size != reference.size {
        return Err(format!("sizes differ: image {:?}, reference {:?}", image.size, reference.size));
    }
    let pixels = u64::from(image.size[0]) * u64::from(image.size[1]);
    let asked = format!("FLIP of {}x{} pixels", image.size[0], image.size[1]);
    memory::check(asked, memory::bytes(pixels, BYTES_PER_PIXEL), "compare smaller images")
        .map_err(|e| e.to_string())?;
    let spaces = ColorSpaces::new();
    let color = |plane_of: &[Plane; 3]| seen(&spaces, plane_of, view.pixels_per_degree);
    let (a, b) = (opponent_planes(&spaces, image, view.exposure), opponent_planes(&spaces, reference, view.exposure));
    let (lab_a, lab_b) = (color(&a), color(&b));
    let (features_a, features_b) =
        (features(&grey(&a), view.pixels_per_degree), features(&grey(&b), view.pixels_per_degree));
    let largest = libm::pow(hyab(spaces.hunt_lab(DVec3::Y), spaces.hunt_lab(DVec3::Z)), COLOR_EXPONENT);
    let map = (0..lab_a.len())
        .into_par_iter()
        .map(|i| {
            let color = redistributed(libm::pow(hyab(lab_a[i], lab_b[i]), COLOR_EXPONENT), largest);
            let [edge, point] = [0, 1].map(|f| f64::from(features_a[f].values[i] - features_b[f].values[i]).abs());
            let feature = libm::pow(edge.max(point) / std::f64::consts::SQRT_2, FEATURE_EXPONENT).min(1.0);
            libm::pow(color, 1.0 - feature).clamp(0.0, 1.0) as f32
        })
        .collect();
    Ok(Flip { size: image.size, map })
}

/// Factor on radiance of that many stops.
pub fn exposure_factor(stops: f32) -> f64 {
    libm::exp2(f64::from(stops))
}

/// Y, Cx and Cz of the exposed image.
fn opponent_planes(spaces: &ColorSpaces, image: &Image, exposure: f32) -> [Plane; 3] {
    let factor = exposure_factor(exposure);
    let pixels: Vec<DVec3> = image
        .pixels
        .par_iter()
        .map(|p| {
            // What is no number is not above 0 either.
            let shown = (p.as_dvec3() * factor).to_array().map(|c| if c > 0.0 { c.min(1.0) } else { 0.0 });
            spaces.ycxcz(shown.into())
        })
        .collect();
    let size = image.size.map(|n| n as usize);
    [0, 1, 2].map(|c| Plane { size, values: pixels.iter().map(|p| p[c] as f32).collect() })
}

/// What the eye sees of the planes, in CIELab with Hunt's adjustment.
fn seen(spaces: &ColorSpaces, planes: &[Plane; 3], pixels_per_degree: f64) -> Vec<DVec3> {
    let [y, cx, cz] = contrast_sensitivity(planes, pixels_per_degree);
    (0..y.values.len())
        .into_par_iter()
        .map(|i| {
            let ycxcz = DVec3::new(f64::from(y.values[i]), f64::from(cx.values[i]), f64::from(cz.values[i]));
            spaces.hunt_lab(spaces.rgb(ycxcz).clamp(DVec3::ZERO, DVec3::ONE))
        })
        .collect()
}

/// Lightness in [0, 1], in which features are sought.
fn grey(planes: &[Plane; 3]) -> Plane {
    let values = planes[0].values.iter().map(|y| ((f64::from(*y) + 16.0) / 116.0) as f32).collect();
    Plane { size: planes[0].size, values }
}

/// A colour difference on [0, 1]: small ones are spread out, large ones are pressed together (section 4.1).
fn redistributed(difference: f64, largest: f64) -> f64 {
    let knee = LOW_PART * largest;
    if difference < knee {
        LOW_RESULT / knee * difference
    } else {
        LOW_RESULT + (difference - knee) / (largest - knee) * (1.0 - LOW_RESULT)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;

    fn drawn(size: [u32; 2], pixel: impl Fn(u32, u32) -> Vec3) -> Image {
        let pixels = (0..size[1]).flat_map(|y| (0..size[0]).map(move |x| (x, y))).map(|(x, y)| pixel(x, y)).collect();
        Image { size, pixels }
    }

    fn mean(image: &Image, reference: &Image, exposure: f32) -> f64 {
        let flip = flip(image, reference, FlipView::exposed(exposure)).expect("same size");
        assert!(flip.map.iter().all(|v| (0.0..=1.0).contains(v)));
        flip.mean(&Mask::all(image.size)).expect("pixels")
    }

    fn ramps(x: u32, y: u32) -> Vec3 {
        Vec3::new(x as f32 / 64.0, y as f32 / 32.0, 0.5)
    }

    fn squares() -> [Image; 2] {
        let size = [48, 32];
        let lifted = |x: u32, y: u32| ramps(x, y) + Vec3::splat(0.125 * ((x / 4 + y / 4) % 2) as f32);
        [drawn(size, lifted), drawn(size, ramps)]
    }

    /// The numbers are means that the authors' `flip-evaluator` 1.7 (PyPI) gives for the same arrays, made by the same
    /// formulas in float32: `evaluate(reference, image, "LDR", inputsRGB=False, applyMagma=False)`, with the arrays
    /// multiplied by 0.5 and clamped to [0, 1] beforehand for the third.
    #[test]
    fn means_are_those_of_the_published_implementation() {
        let [image, reference] = squares();
        let squares = mean(&image, &reference, 0.0);
        assert!((squares - 0.206_339_76).abs() < 2e-6, "{squares}");
        // Smaller than the filters.
        let grey = drawn([7, 5], |_, _| Vec3::splat(0.25));
        let point = drawn([7, 5], |x, y| Vec3::splat(if (x, y) == (3, 2) { 1.0 } else { 0.25 }));
        let point = mean(&point, &grey, 0.0);
        assert!((point - 0.106_220_36).abs() < 2e-6, "{point}");
        // Coloured noise up to radiance 2, one stop down.
        let noise = drawn([40, 24], |x, y| {
            let k = (7 * x + 13 * y + (x * y) % 11) % 16;
            Vec3::new(k as f32, ((5 * k) % 16) as f32, ((11 * k) % 16) as f32) / 8.0
        });
        let noise = mean(&noise, &drawn([40, 24], |_, _| Vec3::splat(0.75)), -1.0);
        assert!((noise - 0.437_502_09).abs() < 2e-6, "{noise}");
    }

    #[test]
    fn equal_images_do_not_differ_and_order_does_not_matter() {
        let [image, reference] = squares();
        assert_eq!(mean(&image, &image, 0.0), 0.0);
        assert_eq!(mean(&image, &reference, 0.0), mean(&reference, &image, 0.0));
        // Beyond white there is nothing to see.
        let bright = |v: f32| drawn([9, 9], move |_, _| Vec3::splat(v));
        assert_eq!(mean(&bright(3.0), &bright(2.0), 0.0), 0.0);
        assert!(mean(&bright(3.0), &bright(2.0), -2.0) > 0.1);
        let white_on_black = mean(&bright(1.0), &bright(0.0), 0.0);
        assert!(white_on_black > 0.9, "{white_on_black}");
    }

    #[test]
    fn bits_do_not_depend_on_the_number_of_threads() {
        let [image, reference] = squares();
        let on = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
            pool.install(|| flip(&image, &reference, FlipView::exposed(0.5)).expect("same size"))
        };
        assert_eq!(on(1), on(5));
    }

    #[test]
    fn odd_input_is_defined_or_refused() {
        let [image, reference] = squares();
        let odd = drawn(image.size, |x, _| Vec3::new(f32::NAN, f32::INFINITY, if x == 0 { -1.0 } else { 1e38 }));
        assert!(mean(&odd, &reference, 64.0).is_finite());
        assert!(flip(&Image::black([2, 2]), &image, FlipView::exposed(0.0)).is_err());
        for exposure in [f32::NAN, 65.0, f32::NEG_INFINITY] {
            assert!(flip(&image, &image, FlipView::exposed(exposure)).is_err());
        }
        let view = FlipView { exposure: 0.0, pixels_per_degree: 0.0 };
        assert!(flip(&image, &image, view).is_err());
        let near = FlipView { exposure: 0.0, pixels_per_degree: 1.0 };
        assert!(flip(&image, &reference, near).expect("in range").map.iter().all(|v| v.is_finite()));
        let none = flip(&Image::black([0, 0]), &Image::black([0, 0]), near).expect("empty");
        assert_eq!((none.map.len(), none.mean(&Mask::all([0, 0]))), (0, None));
    }
}
