//! What runs long: many passes, footprints that shrink, times from a millisecond to a day.

use super::oracle::random::Random;
use super::setup::{finite_films, outcome, rendered};
use super::{Case, Outcome};
use crate::math::rgb::Rgb;
use crate::measure::reference::closed_form;
use crate::measure::study::power_law::{PowerLaw, interpolate};
use crate::render::film::Film;
use crate::render::renderer::area_factor;
use crate::render::settings::{DirectLight, LightPart};
use crate::render::stats::Seconds;
use crate::scene::source;
use std::sync::Arc;

/// The group.
pub const CASES: &[Case] = &[
    Case {
        group: "passes",
        name: "film-sums",
        what: "mean of a pixel over the passes; relative error",
        range: "100,000 passes, values from 1e-12 to 1e12 in any order",
        oracle: "sum with its rounding errors kept",
        limit: f32::EPSILON as f64,
        run: film_sums,
    },
    Case {
        group: "passes",
        name: "shrinking",
        what: "area of a pass's footprints over the first's; relative error",
        range: "pass 1 to 100,000",
        oracle: "Γ(n + 1 + α) Γ(2)/(Γ(1 + α) Γ(n + 2)), by log Γ",
        limit: 1e-9,
        run: shrinking,
    },
    Case {
        group: "passes",
        name: "many-passes",
        what: "error of an image after so many passes, over its standard error; RMSE",
        range: "100,000 passes of 64 photons, footprints shrunk 49 times in area",
        oracle: "E = Φ cos θ/(4π r²), f64",
        limit: 3.0,
        run: many_passes,
    },
    Case {
        group: "passes",
        name: "hours",
        what: "order of convergence, error between points, and parts of a time; relative error",
        range: "times from 1 ms to 100 hours, errors from 1 to 1e-8",
        oracle: "the power law that the points lie on",
        limit: 1e-10,
        run: hours,
    },
];

fn film_sums() -> Outcome {
    let mut out = Outcome::default();
    let mut film = Film::new([4, 1]);
    // Neumaier's sum and its compensation for each pixel.
    let mut exact = [[0.0f64; 2]; 4];
    let passes = 100_000u64;
    for pass in 0..passes {
        let mut random = Random::new("film-sums", pass);
        let values = [
            random.decade(-12.0, 12.0),
            1e-12 + if pass == 50_000 { 1e12 } else { 0.0 },
            random.unit(),
            if pass % 1000 == 0 { 1e8 } else { 1e-8 },
        ]
        .map(|v| v as f32);
        film.add_tile([0, 0], 4, &values.map(Rgb::splat));
        film.finish_pass(1.0);
        for (sum, v) in exact.iter_mut().zip(values.map(f64::from)) {
            let t = sum[0] + v;
            sum[1] += if sum[0].abs() >= v.abs() { (sum[0] - t) + v } else { (v - t) + sum[0] };
            sum[0] = t;
        }
    }
    for (i, (p, sum)) in film.image().pixels.iter().zip(exact).enumerate() {
        let mean = (sum[0] + sum[1]) / passes as f64;
        out.see((f64::from(p.x) / mean - 1.0).abs(), || format!("pixel {i}: {p} for {mean:e}"));
    }
    out
}

fn shrinking() -> Outcome {
    let mut out = Outcome::default();
    let alpha = 2.0 / 3.0;
    for n in (0..=100_000).step_by(997).chain([1, 2, 10, 100, 100_000]) {
        let x = f64::from(n);
        let log = libm::lgamma(x + 1.0 + alpha) - libm::lgamma(1.0 + alpha) - libm::lgamma(x + 2.0);
        let (found, exact) = (area_factor(n), libm::exp(log));
        out.see((found / exact - 1.0).abs(), || format!("pass {n}: {found:e} for {exact:e}"));
    }
    out
}

fn many_passes() -> Outcome {
    outcome(|out| {
        let scene = Arc::new(source::open("plane").map_err(|e| e.to_string())?);
        let size = [4, 4];
        let r = rendered(&scene, size, "integrated", 100_000, |s| {
            (s.photons, s.direct, s.footprint_scale) = (64, DirectLight::Photons, 0.2);
        })?;
        finite_films(&r, out);
        let Some(truth) = closed_form::reference(&scene, size, LightPart::All) else {
            return Err("no closed form".into());
        };
        let image = r.films()[0].image();
        let Some(variance) = r.films()[0].variance() else { return Err("no variance".into()) };
        let noise: f64 = variance.pixels.iter().map(|v| f64::from(v.x)).sum();
        let mut squares = 0.0;
        for (p, t) in image.pixels.iter().zip(&truth.image.pixels) {
            squares += f64::from(p.x - t.x).powi(2);
        }
        out.see((squares / noise).sqrt(), || format!("squares {squares:e}, variance {noise:e}"));
        out.expect(r.passes() == 100_000, || format!("{} passes", r.passes()));
        Ok(())
    })
}

fn hours() -> Outcome {
    let mut out = Outcome::default();
    for exponent in [-2.0 / 3.0, -1.0, -0.1] {
        let law = |t: f64| libm::pow(t / 1e-3, exponent);
        let points: Vec<(f64, f64)> =
            (0..60).map(|i| 1e-3 * libm::exp2(f64::from(i) / 2.0)).map(|t| (t, law(t))).collect();
        match PowerLaw::fit(points.iter().copied()) {
            Some(fit) => out.see((fit.exponent / exponent - 1.0).abs(), || format!("exponent {exponent}: {fit:?}")),
            None => out.expect(false, || "no fit".into()),
        }
        for i in 0..1000 {
            let t = 1e-3 * libm::exp2(29.0 * f64::from(i) / 1000.0);
            match interpolate(&points, t) {
                Some(error) => out.see((error / law(t) - 1.0).abs(), || format!("at {t} s: {error:e}")),
                None => out.expect(false, || format!("nothing at {t} s")),
            }
        }
    }
    // A hundred hours in steps of a millisecond: parts add up to the whole.
    let mut random = Random::new("hours", 0);
    let mut parts = Seconds::default();
    for _ in 0..1_000_000 {
        parts.gather += random.decade(-6.0, -1.0);
        parts.estimate += 1e-3;
    }
    let whole = Seconds { load: 1e-6, ..parts }.within(3.6e5);
    out.see((whole.sum() / whole.total - 1.0).abs(), || format!("{whole:?}"));
    out.see((whole.estimate / 1000.0 - 1.0).abs(), || format!("{whole:?}"));
    out
}
