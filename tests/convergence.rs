//! Progressive renders of `ring` against an independent image: consistent estimators converge, the others come to rest.

#![allow(clippy::expect_used, clippy::panic, missing_docs, reason = "a failed expectation is how this program reports")]

use cusp::estimate::registry::estimators;
use cusp::measure::metrics::{block_average, compare};
use cusp::measure::study::power_law::PowerLaw;
use cusp::measure::{Mask, Reference};
use cusp::render::film::{Image, Rect};
use cusp::render::{RenderSettings, Renderer, Silent};
use cusp::scene::open;
use cusp::scene::scene_file::RenderFile;

const PASSES: u32 = 128;

/// The stored reference in blocks of 4×4 pixels, which have a quarter of its noise, and the floor inside the ring.
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

/// The number of passes, 4, 8, 16, ..., and the MSE against the truth, for each estimator.
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

fn flags(gather: &str, footprint_scale: f64) -> RenderFile {
    RenderFile {
        photons: Some(20_000),
        footprint_scale: Some(footprint_scale),
        gather: Some(gather.into()),
        k: Some(5),
        // Some 220 caustic photons a pass, wider than pixels: with many more, sampling points see too few of them.
        projection_map: Some("off".into()),
        ..Default::default()
    }
}

/// MSE of the exact means falls as passes^(-2/3) or faster; sampling points and view rays, which see cells of the pixel,
/// are slower by less than half of that.
#[test]
fn consistent_estimators_converge() {
    let list = "regular_3x3,multi_sampled:n=8,grid=cells,coplanar:weight=mean,integrated";
    for (i, (name, curve)) in curves(list, &flags("overlap", 1.0)).into_iter().enumerate() {
        let fit = PowerLaw::fit(curve.iter().copied()).expect("points");
        println!("{name}: {fit:?}, {curve:?}");
        let limit = if i < 2 { -1.0 / 3.0 } else { -2.0 / 3.0 };
        assert!(fit.exponent <= limit, "{name}: {fit:?}");
    }
}

/// The same for the integral where a projection map makes photons a ninth as wide.
#[test]
fn the_integral_converges_with_a_projection_map() {
    let flags = RenderFile { projection_map: None, ..flags("overlap", 1.0) };
    for (name, curve) in curves("integrated", &flags) {
        let fit = PowerLaw::fit(curve.iter().copied()).expect("points");
        println!("{name}: {fit:?}, {curve:?}");
        assert!(fit.exponent <= -2.0 / 3.0, "{name}: {fit:?}");
    }
}

/// Published `coplanar`, and a k of which many times as many photons overlap, come to rest far above the error of
/// `integrated` by overlap.
#[test]
fn the_others_come_to_rest() {
    let last = |c: &[(f64, f64)]| c.last().expect("points").1;
    let published = curves("coplanar,integrated", &flags("overlap", 1.0));
    let nearest = [curves("integrated", &flags("knn", 4.0)), curves("integrated", &flags("overlap", 4.0))].concat();
    for pair in [published, nearest] {
        let [(name, curve), (_, best)] = pair.as_slice() else { panic!("two curves") };
        let late = PowerLaw::fit(curve[2..].iter().copied()).expect("points");
        println!("{name}: {late:?}, {curve:?}, integrated by overlap {:e}", last(best));
        assert!(last(curve) > 3.0 * last(best), "{name}: {curve:?} against {best:?}");
        assert!(late.exponent > -1.0 / 3.0, "{name}: {late:?}");
    }
}
