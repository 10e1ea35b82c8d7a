//! Methods in numbers: one row for each, as a table, CSV and JSON.

use crate::cli::paper::test_case::{Method, Origin, Shown, TestCase};
use crate::cli::table::{Table, percent};
use crate::export::report::EstimatorSeconds;
use crate::math::rgb::{Rgb, luminance};
use crate::measure::metrics::{ErrorMetrics, Mask, compare};
use crate::render::film::Image;
use crate::render::settings::Gather;
use serde::Serialize;
use std::fmt::Write;

/// One method of a figure.
#[derive(Clone, Debug, Serialize)]
pub struct Row {
    /// Estimator with its settings.
    pub estimator: String,
    /// How it looked photons up.
    pub gather: Gather,
    /// How many, for `knn`.
    pub k: Option<usize>,
    /// Where it comes from.
    pub origin: Origin,
    /// Wall seconds of its view pass, beside the others.
    pub seconds: EstimatorSeconds,
    /// Those over the seconds of `regular` with the same gather, if it took part.
    pub ratio_to_regular: Option<f64>,
    /// Photons looked at for each pixel, the mean.
    pub photons_per_pixel: f64,
    /// Error against `regular` with 16×16 view rays and all photons that overlap.
    pub error: Option<ErrorMetrics>,
    /// Error against `regular` with 16×16 view rays and the same gather.
    pub error_of_rays: Option<ErrorMetrics>,
    /// Error against the scene's reference.
    pub reference_error: Option<ErrorMetrics>,
    /// Pixels that are black where `integrated` has more than a hundredth of its mean, by the same view rays
    /// and all photons that overlap.
    pub black_pixels: u64,
}

/// Rows of methods that were rendered over one region.
///
/// `of_nearest`: what `knn` leads to with 16×16 rays, if it is known.
pub fn rows(case: &TestCase, methods: &[Method], shown: &Shown, truth: &Image, of_nearest: Option<&Image>) -> Vec<Row> {
    let own = case.pass.settings.k;
    let k = |m: &Method| (m.gather == Gather::Knn).then(|| m.k.unwrap_or(own));
    let pixels = truth.pixels.len().max(1) as f64;
    let lit = methods.iter().position(|m| m.estimator.id() == "integrated" && m.gather == Gather::Overlap);
    let lit = lit.map(|i| &shown.images[i]);
    let error = |image: &Image, truth: &Image| compare(image, truth, &Mask::all(truth.size)).ok();
    let row = |(i, m): (usize, &Method)| {
        let parts = shown.seconds[i];
        let regular = methods.iter().position(|r| {
            (r.estimator.id() == "regular", r.origin, r.gather, k(r)) == (true, Origin::Thesis, m.gather, k(m))
        });
        let base = regular.map(|r| shown.seconds[r].total()).filter(|s| *s > 0.0);
        Row {
            estimator: m.estimator.name(),
            gather: m.gather,
            k: k(m),
            origin: m.origin,
            seconds: EstimatorSeconds { parts, view_pass: parts.total() },
            ratio_to_regular: base.map(|b| parts.total() / b),
            photons_per_pixel: shown.gathered[i] as f64 / pixels,
            error: error(&shown.images[i], truth),
            error_of_rays: match m.gather {
                Gather::Overlap => error(&shown.images[i], truth),
                Gather::Knn if k(m) == Some(own) => of_nearest.and_then(|t| error(&shown.images[i], t)),
                Gather::Knn => None,
            },
            reference_error: None,
            black_pixels: lit.map_or(0, |l| black_pixels(&shown.images[i], l)),
        }
    };
    methods.iter().enumerate().map(row).collect()
}

/// The thesis's black dots (section 5.1, observation 5) in a number: pixels of `image` without light, but for rounding,
/// where `lit` has more than a hundredth of its mean.
fn black_pixels(image: &Image, lit: &Image) -> u64 {
    let mean = lit.pixels.iter().map(|p| luminance(*p)).sum::<f32>() / lit.pixels.len().max(1) as f32;
    let black = |(x, l): &(&Rgb, &Rgb)| luminance(**x) <= 1e-6 * mean && luminance(**l) > 0.01 * mean;
    image.pixels.iter().zip(&lit.pixels).filter(black).count() as u64
}

impl Row {
    /// `overlap`, or `knn` with its number.
    pub fn gathered(&self) -> String {
        match self.k {
            Some(k) => format!("knn k={k}"),
            None => "overlap".into(),
        }
    }

    /// Lines below its picture.
    pub fn lines(&self) -> Vec<String> {
        let ratio = self.ratio_to_regular.map_or(String::new(), |x| format!(", {x:.2} x regular"));
        vec![
            format!("{:.3} s{ratio}", self.seconds.view_pass),
            format!("error {}", percent(self.error.map(|e| e.relative_rmse))),
        ]
    }
}

/// The table for people.
pub fn table(rows: &[Row]) -> String {
    let rays = rows.iter().any(|r| r.gather == Gather::Knn && r.error_of_rays.is_some());
    let reference = rows.iter().any(|r| r.reference_error.is_some());
    let mut heading =
        vec!["estimator", "gather", "from", "view pass s", "x regular", "photons/pixel", "mean", "black", "error"];
    heading.extend(rays.then_some("to more rays"));
    heading.extend(reference.then_some("to reference"));
    let mut table = Table::new(heading);
    for r in rows {
        let mut cells = vec![
            r.estimator.clone(),
            r.gathered(),
            r.origin.name().into(),
            format!("{:.3}", r.seconds.view_pass),
            r.ratio_to_regular.map_or("-".into(), |x| format!("{x:.2}")),
            format!("{:.1}", r.photons_per_pixel),
            r.error.map_or("-".into(), |e| format!("{:.3}", e.mean_ratio)),
            r.black_pixels.to_string(),
            percent(r.error.map(|e| e.relative_rmse)),
        ];
        cells.extend(rays.then(|| percent(r.error_of_rays.map(|e| e.relative_rmse))));
        cells.extend(reference.then(|| percent(r.reference_error.map(|e| e.relative_rmse))));
        table.row(cells);
    }
    table.text()
}

/// One line for each row. Empty fields are unknown.
pub fn csv(rows: &[Row]) -> String {
    let mut csv = String::from(
        "estimator,gather,k,origin,view_trace_s,gather_s,estimate_s,final_gather_s,view_pass_s,ratio_to_regular,photons_per_pixel,mean_ratio,black_pixels,relative_rmse,relative_rmse_to_more_rays,reference_relative_rmse\n",
    );
    let number = |x: Option<f64>| x.map_or(String::new(), |x| format!("{x:.6}"));
    for r in rows {
        let s = &r.seconds;
        // Writing to a string cannot fail.
        let _ = writeln!(
            csv,
            "\"{}\",{},{},{},{:.6},{:.6},{:.6},{:.6},{:.6},{},{:.3},{},{},{},{},{}",
            r.estimator,
            if r.k.is_some() { "knn" } else { "overlap" },
            r.k.map_or(String::new(), |k| k.to_string()),
            r.origin.name(),
            s.parts.view_trace,
            s.parts.gather,
            s.parts.estimate,
            s.parts.final_gather,
            s.view_pass,
            number(r.ratio_to_regular),
            r.photons_per_pixel,
            number(r.error.map(|e| e.mean_ratio)),
            r.black_pixels,
            number(r.error.map(|e| e.relative_rmse)),
            number(r.error_of_rays.map(|e| e.relative_rmse)),
            number(r.reference_error.map(|e| e.relative_rmse)),
        );
    }
    csv
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn black_dots_are_counted_where_there_is_light() {
        let image = |v: [f32; 4]| Image { size: [4, 1], pixels: v.map(Rgb::splat).into() };
        assert_eq!(black_pixels(&image([0.0, 0.0, 1.0, 0.0]), &image([1.0, 0.0, 1.0, 1e-4])), 1);
    }
}
