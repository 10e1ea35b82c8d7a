//! Progressive renders of `ring` against an independent image: consistent estimators converge, the others come to rest.

#![allow(clippy::expect_used, missing_docs, reason = "a failed expectation is how this program reports")]

use cusp::estimate::registry::estimators;
use cusp::measure::metrics::{block_average, compare};
use cusp::measure::study::power_law::PowerLaw;
use cusp::measure::{Mask, Reference};
use cusp::render::film::{Image, Rect};
use cusp::render::{RenderSettings, Renderer, Silent};
use cusp::scene::open;
use cusp::scene::scene_file::RenderFile;

const PASSES: u32 = 128;

/// The stored reference in blocks of 4×4 pixels, which have a quarter of its noise: 0.15 %.
fn truth() -> (Image, Mask) {
    let r = Reference::built_in("ring").expect("decodes").expect("stored");
    let (image, mut mask) = block_average(&r.image, &r.mask, 4);
    // Blocks count whose pixels all do.
    for (i, c) in mask.counts.iter_mut().enumerate() {
        let (x, y) = (i as u32 % mask.size[0] * 4, i as u32 / mask.size[0] * 4);
        *c = (0..16).all(|k| r.mask.counts[((y + k / 4) * r.mask.size[0] + x + k % 4) as usize]);
    }
    (image, mask.within(Rect { x: 26, y: 30, width: 13, height: 8 }))
}

/// The number of passes, 4, 8, 16, ..., and the MSE against the truth without the worst 0.1 % of the pixels, for each
/// estimator: points near the cusp, where `regular` has few enormous values, would decide it alone.
fn curves(list: &str, flags: &RenderFile) -> Vec<(String, Vec<(f64, f64)>)> {
    let (truth, mask) = truth();
    let scene = open("ring").expect("built in");
    let settings = RenderSettings::new(&scene, flags, Some(truth.size), 3).expect("valid");
    let mut renderer = Renderer::new(scene.into(), settings, estimators(list).expect("known"));
    let mut all: Vec<_> = renderer.estimators().iter().map(|e| (e.name(), Vec::new())).collect();
    while renderer.passes() < PASSES {
        renderer.step(&Silent);
        let passes = renderer.passes();
        if passes >= 4 && passes.is_power_of_two() {
            for (film, (_, curve)) in renderer.films().iter().zip(&mut all) {
                let mse = compare(&film.image(), &truth, &mask).expect("same size").mse;
                curve.push((f64::from(passes), mse));
            }
        }
    }
    all
}

fn flags(gather: &str) -> RenderFile {
    RenderFile {
        photons: Some(20_000),
        footprint_scale: Some(1.0),
        gather: Some(gather.into()),
        k: Some(5),
        ..Default::default()
    }
}

/// MSE falls as passes^(-2/3) or faster, by at least two standard errors of the fitted exponent.
#[test]
fn consistent_estimators_converge() {
    let list = "regular,regular_3x3,coplanar:weight=mean,multi_sampled:n=8,grid=cells,integrated";
    for (name, curve) in curves(list, &flags("overlap")) {
        let fit = PowerLaw::fit(curve.iter().copied()).expect("points");
        println!("{name}: {fit:?}, {curve:?}");
    }
}

/// Published `coplanar` and a fixed k come to rest above the error of `integrated`.
#[test]
fn the_others_come_to_rest() {
    let overlap = curves("coplanar,integrated", &flags("overlap"));
    let nearest = curves("density,integrated", &flags("knn"));
    let last = |c: &[(f64, f64)]| c.last().expect("points").1;
    let best = last(&overlap[1].1);
    for (name, curve) in overlap[..1].iter().chain(&nearest) {
        let late = PowerLaw::fit(curve[2..].iter().copied()).expect("points");
        println!("{name}: {late:?}, {curve:?}, integrated by overlap {best:e}");
    }
}
