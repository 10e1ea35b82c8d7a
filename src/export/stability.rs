//! Stability cases of images: what becomes of pixels that are NaN, infinite, negative, denormal or the largest number.

use crate::export::exr_file;
use crate::export::false_color::{ColorMap, FalseColor, ValueRange};
use crate::export::session::{Curve, Tone};
use crate::export::sheet::{self, Column, Sheet};
use crate::export::tone::{Look, SrgbTable, ToneMap, auto_exposure, reinhard, to_srgb};
use crate::math::rgb::Rgb;
use crate::measure::difference::{channels, difference, quantile_range};
use crate::measure::flip::{FlipView, flip};
use crate::measure::metrics::{Mask, block_average, compare};
use crate::measure::stability::{Case, Outcome};
use crate::measure::window::{busiest_window, contours, disagreement};
use crate::measure::{Difference, Reference};
use crate::render::film::{Image, Rect};

/// All cases there are, those of kernels and renders first.
pub fn all_cases() -> Vec<Case> {
    let mut all = crate::measure::stability::cases();
    all.extend_from_slice(CASES);
    all
}

/// The cases of images.
pub const CASES: &[Case] = &[
    Case {
        group: "images",
        name: "tone-of-extremes",
        what: "bytes of every curve and colour map; bytes that differ from the limit of what surrounds the value",
        range: "NaN, ±infinity, ±f32::MAX, ±denormals, ±0; exposures -64 to 64 stops",
        oracle: "the curves' limits: below 0 black, above 1 and NaN white; false colour: NaN as the low end",
        limit: 0.0,
        run: tones,
    },
    Case {
        group: "images",
        name: "metrics-of-extremes",
        what: "every metric and difference; a number for finite pixels, refusal by pixel for others",
        range: "all pairs of f32::MAX, denormals, negative and 0 in image and reference, masked NaN",
        oracle: "finiteness; NaN that a mask leaves out changes no bit",
        limit: 0.0,
        run: metrics,
    },
    Case {
        group: "images",
        name: "files-of-extremes",
        what: "EXR written and read again, sheets, windows; bits that differ",
        range: "all finite extremes; a reference with NaN and infinities",
        oracle: "the bits that were written; the count of pixels made",
        limit: 0.0,
        run: files,
    },
];

/// What a pixel may be at the ends of 32 bits, the last four not finite.
const EXTREMES: [f32; 13] = [
    0.0,
    -0.0,
    1.0,
    -1.0,
    1e-45,
    -1e-45,
    f32::MIN_POSITIVE,
    f32::MAX,
    -f32::MAX,
    f32::NAN,
    f32::INFINITY,
    f32::NEG_INFINITY,
    -f32::NAN,
];

/// Those of [`EXTREMES`] that are finite.
const FINITE: usize = 9;

/// Each triple of a few of them as a pixel.
fn image(values: &[f32]) -> Image {
    let n = values.len() as u32;
    let pixels = values
        .iter()
        .flat_map(|&r| values.iter().flat_map(move |&g| values.iter().map(move |&b| Rgb::new(r, g, b))))
        .collect();
    Image { size: [n * n, n], pixels }
}

fn tones() -> Outcome {
    let mut outcome = Outcome::default();
    let table = SrgbTable::new();
    let expected = |x: f64| -> u8 {
        if x.is_nan() || x >= 1.0 {
            255
        } else if x <= 0.0 {
            0
        } else {
            255
        }
    };
    for stops in [-64.0f32, -1.0, 0.0, 1.0, 64.0] {
        for value in EXTREMES {
            // Values near the middle of a curve are not what is asked for here.
            let seen = f64::from(value * libm::exp2f(stops));
            if seen > 1e-30 && seen < 1.0 {
                continue;
            }
            let want = if seen > 0.0 && seen < 1.0 { 0 } else { expected(seen) };
            for curve in [Curve::Srgb, Curve::Gamma, Curve::Linear] {
                let tone = Tone { curve, auto: false, ..Tone::default() };
                let bytes = ToneMap::new(&tone, stops).bytes(&table, Rgb::splat(value));
                let error = bytes.iter().map(|b| f64::from(b.abs_diff(want))).fold(0.0, f64::max);
                // The power 1/2.2 takes 1e-30 to 2e-14, which is black too.
                outcome.see(error, || format!("{curve:?} of {value} at {stops} stops: {bytes:?}"));
            }
            // x/(1 + x): above 2^8 it is white, and it keeps the order.
            if seen >= 1.0 || seen.is_nan() {
                let bright = reinhard(Rgb::splat(seen as f32)).max_element();
                outcome.expect(bright.is_nan() || (0.5..=1.0).contains(&bright), || format!("{seen} becomes {bright}"));
            }
        }
    }
    for map in ColorMap::ALL {
        for range in
            [[0.0, 1.0], [-f32::MAX, f32::MAX], [f32::NAN, 1.0], [1.0, 1.0], [0.0, f32::INFINITY], [0.0, 1e-45]]
        {
            let scale = FalseColor::new(map, ValueRange { low: range[0], high: range[1] });
            let low = scale.color(f32::NEG_INFINITY);
            for value in EXTREMES {
                let color = scale.color(value);
                outcome.expect(map.table().contains(&color), || format!("{map:?} {range:?}: {value} is {color:?}"));
                outcome.expect(!value.is_nan() || color == low, || format!("{map:?} {range:?}: NaN is {color:?}"));
            }
        }
    }
    for values in [&EXTREMES[..], &EXTREMES[..FINITE], &EXTREMES[FINITE..], &[1e-45]] {
        let image = image(values);
        let exposure = auto_exposure(&image);
        outcome.expect(exposure.is_finite() && exposure > 0.0, || format!("exposure {exposure}"));
        let bytes = to_srgb(&image, exposure);
        outcome.expect(bytes.len() == 3 * image.pixels.len(), || "a pixel was dropped".into());
    }
    outcome
}

fn metrics() -> Outcome {
    let mut outcome = Outcome::default();
    let finite = |o: &mut Outcome, values: &[f64], what: &dyn Fn() -> String| o.finite(values.iter().copied(), what);
    for (a, &x) in EXTREMES.iter().enumerate() {
        for (b, &r) in EXTREMES.iter().enumerate() {
            let of = |v: f32| Image { size: [3, 2], pixels: [0.5, v, 0.25, v, 0.0, 1.0].map(Rgb::splat).to_vec() };
            let (image, reference) = (of(x), of(r));
            let all = Mask::all(image.size);
            let what = || format!("{x} against {r}");
            let found = compare(&image, &reference, &all);
            outcome.expect(found.is_ok() == (a < FINITE && b < FINITE), || format!("{}: {found:?}", what()));
            match found {
                Ok(e) => {
                    let means = [e.mse, e.rmse, e.relative_rmse, e.relative_mse, e.trimmed_mse, e.trimmed_relative_mse];
                    finite(&mut outcome, &means, &what);
                    finite(&mut outcome, &[e.smape, e.bias, e.max_error, e.mean_ratio], &what);
                }
                Err(why) => outcome.expect(why.starts_with("pixel 1,0 of the "), || format!("{}: {why}", what())),
            }
            for kind in Difference::ALL {
                let values = difference(kind, &image, &reference, 64.0);
                let pixels = channels(kind, &image, &reference, 64.0);
                // FLIP takes NaN for black and infinity for white.
                let wanted = kind == Difference::Flip || (a < FINITE && b < FINITE);
                let is_same = values.is_ok() == wanted && pixels.is_ok() == wanted;
                outcome.expect(is_same, || format!("{kind:?} of {}: {values:?}", what()));
                if let (Ok(values), Ok(pixels)) = (values, pixels) {
                    let numbers: Vec<f64> = values.iter().map(|v| f64::from(*v)).collect();
                    finite(&mut outcome, &numbers, &what);
                    let channels = pixels.pixels.iter().flat_map(|p| p.to_array()).map(f64::from).collect::<Vec<_>>();
                    finite(&mut outcome, &channels, &what);
                    finite(&mut outcome, &[f64::from(quantile_range(&values, &all.counts))], &what);
                }
            }
            for stops in [-64.0, 0.0, 64.0] {
                let mean = flip(&image, &reference, FlipView::exposed(stops)).ok().and_then(|f| f.mean(&all));
                outcome
                    .expect(mean.is_some_and(|m| (0.0..=1.0).contains(&m)), || format!("FLIP {mean:?} of {}", what()));
            }
            // What a mask leaves out changes no bit.
            let mut mask = all.clone();
            (mask.counts[1], mask.counts[3]) = (false, false);
            let masked = compare(&image, &reference, &mask);
            let without = compare(&of(0.0), &of(0.0), &mask);
            outcome.expect(masked == without, || format!("masked, {}: {masked:?}", what()));
            let (blocks, counts) = block_average(&image, &mask, 2);
            let kept = blocks.pixels.iter().zip(&counts.counts).filter(|(_, c)| **c).map(|(p, _)| f64::from(p.x));
            finite(&mut outcome, &kept.collect::<Vec<_>>(), &what);
            let window = busiest_window(&contours(&image), [2, 2]);
            let other = busiest_window(&disagreement(&[&image, &reference]), [2, 2]);
            for w in [window, other] {
                outcome.expect(w.x + w.width <= 3 && w.y + w.height <= 2, || format!("{w:?} for {}", what()));
            }
        }
    }
    outcome
}

fn files() -> Outcome {
    let mut outcome = Outcome::default();
    match written() {
        Ok(differ) => outcome.see(differ, || "an EXR that was written and read".into()),
        Err(why) => outcome.expect(false, || why),
    }
    let image = image(&EXTREMES);
    let truth = Image { pixels: image.pixels.iter().rev().copied().collect(), ..image.clone() };
    let crop = Rect { x: 3, y: 1, width: 20, height: 9 };
    for exposure in [0.0, 1.0, f32::MAX, auto_exposure(&image)] {
        for with_error in [false, true] {
            let column = Column {
                title: "extremes".into(),
                lines: Vec::new(),
                color: [1, 2, 3],
                image: image.clone(),
                look: Look::Tone(ToneMap::srgb(exposure)),
                error: with_error.then(|| sheet::signed_error(&image.crop(crop), &truth.crop(crop))),
            };
            let (title, columns) = (String::new(), vec![column]);
            let canvas = sheet::draw(&Sheet { title, subtitle: String::new(), columns, crop, enlarge: 2 });
            let bytes = 3 * canvas.size[0] as usize * canvas.size[1] as usize;
            outcome.expect(canvas.rgb.len() == bytes, || "a sheet without some of its bytes".into());
        }
    }
    outcome
}

/// Pixels that came back otherwise than they were written; what should have been refused and was not is an error.
fn written() -> Result<f64, String> {
    let folder = tempfile::tempdir().map_err(|e| e.to_string())?;
    let path = folder.path().join("extremes.exr");
    let good = image(&EXTREMES[..FINITE]);
    exr_file::write_with(&path, &good, &[]).map_err(|e| e.to_string())?;
    let back = Reference::from_files(&path, None)?;
    let bits = |i: &Image| -> Vec<[u32; 3]> { i.pixels.iter().map(|p| p.to_array().map(f32::to_bits)).collect() };
    let mut differ = bits(&good).iter().zip(bits(&back.image)).filter(|(a, b)| *a != b).count();

    let bad = image(&EXTREMES);
    match exr_file::write_with(&path, &bad, &[]) {
        Ok(()) => return Err("an EXR with NaN was written".into()),
        Err(why) if !why.to_string().contains("not finite") => return Err(why.to_string()),
        Err(_) => {}
    }
    if Reference::from_files(&path, None)?.image != back.image {
        return Err("a refusal took the older file away".into());
    }
    // Written by others: such pixels are left out, and counted.
    let [w, h] = bad.size;
    let buffer = image::ImageBuffer::from_fn(w, h, |x, y| image::Rgb(bad.at(x, y).to_array()));
    image::DynamicImage::ImageRgb32F(buffer)
        .save_with_format(&path, image::ImageFormat::OpenExr)
        .map_err(|e| e.to_string())?;
    let read = Reference::from_files(&path, None)?;
    let odd = bad.pixels.iter().filter(|p| !p.is_finite()).count();
    let left = read.mask.counts.iter().filter(|c| **c).count();
    differ += (left + odd).abs_diff(bad.pixels.len());
    if !read.source.contains(&format!("{odd} pixels are not finite, the first at ")) {
        return Err(format!("the source does not count: {}", read.source));
    }
    Ok(differ as f64)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::measure::stability::Verdict;

    #[test]
    fn every_case_holds() {
        for case in CASES {
            let judged = case.judge();
            assert_eq!(judged.verdict(), Verdict::Holds, "{}: {:?}", case.name, judged.outcome);
        }
    }
}
