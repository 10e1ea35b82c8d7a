//! The built-in scenes in other units and places: the image must not know.

use super::oracle::placed::Place;
use super::{Case, Outcome};
use crate::estimate::registry::estimator;
use crate::render::film::Image;
use crate::render::renderer::{Renderer, Step};
use crate::render::settings::{DirectLight, PlanMode, RenderSettings};
use crate::render::watch::Silent;
use crate::scene::built_in::BUILT_IN;
use crate::scene::scene_file::{RenderFile, SceneFile};
use crate::scene::source::Source;
use glam::DVec3;

/// The group.
pub const CASES: &[Case] = &[
    Case {
        group: "units",
        name: "powers-of-two",
        what: "share of pixels whose bits change with the unit, the square of the unit apart",
        range: "all built-in scenes, five estimators, passes 1 and 3; units 2⁻²⁰ to 2²⁰ metres",
        oracle: "the scene in metres",
        limit: 0.0,
        run: powers_of_two,
    },
    Case {
        group: "units",
        name: "scales",
        what: "RMS change of an image over its noise",
        range: "all built-in scenes, five estimators, passes 1 and 3; units 1e-6 to 1e6 metres",
        oracle: "the scene in metres; the noise is that between seeds",
        limit: ROUNDING,
        run: scales,
    },
    Case {
        group: "units",
        name: "places",
        what: "RMS change of an image over its noise",
        range: "all built-in scenes, five estimators, passes 1 and 3; moved 1e5 times their size by coordinates or keys",
        oracle: "the scene in its place; the noise is that between seeds",
        limit: ROUNDING,
        run: places,
    },
    Case {
        group: "units",
        name: "turns",
        what: "difference of block means over what chance allows at 1 % for all of them (Student's t of 6 seeds each)",
        range: "all built-in scenes, turned about odd axes by 0.1 to 3 rad",
        oracle: "the scene as it stands, by other seeds",
        limit: 1.0,
        run: turns,
    },
];

/// Rounding moves a photon by 10⁻⁷ of the scene, and sends one in some 10⁵ another way: that changes an image by the
/// root of that part of its noise. This is some times more, and far less than a wrong unit anywhere makes.
const ROUNDING: f64 = 0.02;

const ESTIMATORS: [&str; 5] = ["density", "regular", "coplanar", "multi_sampled:n=4", "integrated"];
const SIZE: [u32; 2] = [32, 24];

/// Images of one scene: of each estimator after the first and the third pass.
struct Images {
    images: Vec<Image>,
    radius: f64,
}

/// Renders `source` at a place; what went wrong, in words.
fn render(source: &Source, file: &SceneFile, estimators: &[&str], passes: u32, seed: u64) -> Result<Images, String> {
    let scene = source.edited(file, &source.scene).map_err(|e| e.to_string())?;
    let flags = RenderFile { photons: Some(6000), shadow_rays: Some(1), max_depth: Some(10), ..Default::default() };
    let mut settings = RenderSettings::new(&scene, &flags, Some(SIZE), seed).map_err(|e| e.to_string())?;
    settings.plan = PlanMode::Full;
    // Photons alone on even seeds, so that both ways of direct light are seen.
    settings.direct = if seed.is_multiple_of(2) { DirectLight::Photons } else { DirectLight::ShadowRays };
    let made: Result<Vec<_>, _> = estimators.iter().map(|e| estimator(e)).collect();
    let radius = f64::from(scene.radius);
    let mut renderer = Renderer::new(scene.into(), settings, made.map_err(|e| e.to_string())?);
    let mut images = Vec::new();
    for pass in 0..passes {
        if renderer.step(&Silent) != Step::Done {
            return Err("a pass was cancelled".into());
        }
        if pass == 0 || pass + 1 == passes {
            images.extend(renderer.films().iter().map(|f| f.image()));
        }
    }
    Ok(Images { images, radius })
}

/// Values of an image of a scene in a unit of `1/scale` as they would be in metres, for lights of the same power.
fn in_metres(image: &Image, scale: f64) -> Vec<f64> {
    image.pixels.iter().flat_map(|p| (p.as_dvec3() * (scale * scale)).to_array()).collect()
}

fn rms(values: impl Iterator<Item = f64>) -> f64 {
    let (sum, count) = values.fold((0.0, 0u32), |(sum, n), v| (sum + v * v, n + 1));
    (sum / f64::from(count.max(1))).sqrt()
}

/// Runs `one` for each built-in scene as its file has it; a scene that cannot be rendered fails the case.
fn each(one: impl Fn(&Source, &mut Outcome) -> Result<(), String>) -> Outcome {
    BUILT_IN
        .iter()
        .map(|b| {
            let mut outcome = Outcome::default();
            let done = Source::open(b.name).map_err(|e| e.to_string()).and_then(|s| one(&s, &mut outcome));
            if let Err(why) = done {
                outcome.expect(false, || format!("{}: {why}", b.name));
            }
            outcome
        })
        .fold(Outcome::default(), Outcome::and)
}

/// The same scene with clear glass: a file cannot hold the transmittance of a metre of what is tinted within a
/// micrometre.
fn clear(file: &SceneFile) -> SceneFile {
    let mut file = file.clone();
    file.materials.values_mut().for_each(|m| m.transmittance = None);
    file
}

fn powers_of_two() -> Outcome {
    each(|source, outcome| {
        let file = clear(&source.file);
        let own = render(source, &file, &ESTIMATORS, 3, 1)?;
        for exponent in [-20, -10, -1, 11, 20] {
            let scale = libm::exp2(f64::from(exponent));
            let place = Place { scale, by_keys: exponent % 2 == 0, ..Place::NONE };
            let other = render(source, &place.of(&file), &ESTIMATORS, 3, 1)?;
            for (i, (a, b)) in own.images.iter().zip(&other.images).enumerate() {
                let (a, b) = (in_metres(a, 1.0), in_metres(b, scale));
                let name = ESTIMATORS[i % ESTIMATORS.len()];
                let apart = a.iter().zip(&b).filter(|(a, b)| a != b).count();
                outcome.see(apart as f64 / a.len() as f64, || format!("{} by {name} at 2^{exponent}", source.name));
                outcome.finite(b, || format!("{} by {name} at 2^{exponent}", source.name));
            }
        }
        Ok(())
    })
}

/// The RMS change of every image at `places`, over the noise between two seeds.
fn against_noise(source: &Source, file: &SceneFile, places: &[Place], outcome: &mut Outcome) -> Result<(), String> {
    for seed in [1, 2] {
        let own = render(source, file, &ESTIMATORS, 3, seed)?;
        let noise = render(source, file, &ESTIMATORS, 3, seed + 2)?;
        for place in places {
            let other = render(source, &place.of(file), &ESTIMATORS, 3, seed)?;
            outcome.expect((other.radius / (own.radius * place.scale) - 1.0).abs() < 1e-6, || {
                format!("{}: radius {} at {place:?}", source.name, other.radius)
            });
            for (i, ((a, b), c)) in own.images.iter().zip(&other.images).zip(&noise.images).enumerate() {
                let (a, b, c) = (in_metres(a, 1.0), in_metres(b, place.scale), in_metres(c, 1.0));
                let at = || format!("{} by {} seed {seed} at {place:?}", source.name, ESTIMATORS[i % ESTIMATORS.len()]);
                // Two images without noise may differ by rounding alone.
                let noise = rms(a.iter().zip(&c).map(|(a, c)| a - c)) / 2f64.sqrt();
                let rounding = 1e-5 * rms(a.iter().copied());
                let change = rms(a.iter().zip(&b).map(|(a, b)| a - b));
                let error = if change <= rounding { 0.0 } else { change / noise.max(rounding) };
                outcome.see(error, at);
                outcome.finite(b, at);
            }
        }
    }
    Ok(())
}

fn scales() -> Outcome {
    let at = |scale: f64, by_keys| Place { scale, by_keys, ..Place::NONE };
    each(|source, outcome| {
        against_noise(source, &source.file, &[at(1e-3, true), at(1e3, false), at(1e6, true)], outcome)?;
        against_noise(source, &clear(&source.file), &[at(1e-6, false)], outcome)
    })
}

fn places() -> Outcome {
    let at = |offset: DVec3, by_keys| Place { offset, by_keys, ..Place::NONE };
    each(|source, outcome| {
        let size = f64::from(source.scene.radius) * 2.0;
        let places = [
            at(DVec3::new(0.37, -1.3, 0.71) * size, false),
            at(DVec3::new(-61_803.4, 31_415.9, 71_414.2) * size, true),
            at(DVec3::new(100_000.1, 100_000.3, -99_999.7) * size, false),
        ];
        against_noise(source, &source.file, &places, outcome)
    })
}

/// Seeds on each side of the test of [`turns`].
const SEEDS: u64 = 6;
/// Pixels along a block's side.
const BLOCK: usize = 8;

fn turns() -> Outcome {
    let turns = [(DVec3::new(0.3, 0.8, -0.5), 0.37), (DVec3::new(-0.6, 0.1, 0.7), 2.71)];
    each(|source, outcome| {
        let means = |place: Place, first: u64| -> Result<Vec<Vec<f64>>, String> {
            let file = place.of(&source.file);
            (0..SEEDS)
                .map(|seed| render(source, &file, &["integrated"], 1, first + seed).map(|i| blocks(&i.images[0])))
                .collect()
        };
        let own = means(Place::NONE, 100)?;
        for (number, (axis, angle)) in turns.into_iter().enumerate() {
            let turn = (axis.normalize(), angle);
            let other = means(Place { turn, ..Place::NONE }, 200 + 100 * number as u64)?;
            for block in 0..own[0].len() {
                let (m, v) = mean_and_variance(own.iter().map(|b| b[block]));
                let (n, w) = mean_and_variance(other.iter().map(|b| b[block]));
                // Edges of surfaces and shadows are seen by the same rays up to rounding, which is no noise.
                let least = 1e-4 * m.max(n);
                let deviation = ((v + w) / SEEDS as f64 + least * least).sqrt();
                let t = if deviation > 0.0 { (m - n).abs() / deviation } else { 0.0 };
                outcome.see(t / CRITICAL, || format!("{} block {block} turned {angle}: {m} and {n}", source.name));
            }
        }
        Ok(())
    })
}

/// Student's t of 10 degrees of freedom that one of the 8 · 2 · 12 blocks exceeds by chance with 1 %: that of a
/// two-sided level of 0.01/192.
const CRITICAL: f64 = 6.72;

fn blocks(image: &Image) -> Vec<f64> {
    let [w, h] = SIZE.map(|n| n as usize);
    let mut means = vec![0.0; (w / BLOCK) * (h / BLOCK)];
    for (i, p) in image.pixels.iter().enumerate() {
        let (x, y) = (i % w / BLOCK, i / w / BLOCK);
        means[y * (w / BLOCK) + x] += p.as_dvec3().element_sum() / (3 * BLOCK * BLOCK) as f64;
    }
    means
}

fn mean_and_variance(values: impl Iterator<Item = f64> + Clone) -> (f64, f64) {
    let n = SEEDS as f64;
    let mean = values.clone().sum::<f64>() / n;
    (mean, values.map(|v| (v - mean).powi(2)).sum::<f64>() / (n - 1.0))
}
