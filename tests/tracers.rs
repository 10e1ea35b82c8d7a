//! Progressive renders against references by the tracers of `measure`, which share no code with the estimators, on the
//! built-in scenes that have no stored reference.

#![allow(clippy::expect_used, missing_docs, reason = "a failed expectation is how this program reports")]

use cusp::estimate::registry::estimator;
use cusp::measure::metrics::compare;
use cusp::measure::tracer::{ReferenceSettings, Until, render_reference};
use cusp::render::{LightPart, RenderSettings, Renderer, Silent, Step};
use cusp::scene::open;
use cusp::scene::scene_file::RenderFile;
use std::sync::Arc;

const SIZE: [u32; 2] = [96, 96];

/// The mean of a progressive render is within 1 % of the reference's, over the reference's mask.
///
/// Some of that is real: where a pixel's footprint sticks out over an edge, `integrated` finds no photons there. On
/// `cornell` that took 2.0 %, 0.8 %, 0.7 % and 0.2 % of the global light at 48, 96, 192 and 384 pixels across.
fn agrees(name: &str, light: LightPart, max_depth: u32) {
    let scene = Arc::new(open(name).expect("built in"));
    let flags = RenderFile {
        photons: Some(400_000),
        shadow_rays: Some(1),
        footprint_scale: Some(1.0),
        max_depth: Some(i64::from(max_depth)),
        light: Some(format!("{light:?}").to_lowercase()),
        ..Default::default()
    };
    let settings = RenderSettings::new(&scene, &flags, Some(SIZE), 1).expect("valid");
    let mut renderer = Renderer::new(Arc::clone(&scene), settings, vec![estimator("integrated").expect("registered")]);
    assert!((0..4).all(|_| renderer.step(&Silent) == Step::Done));
    let image = renderer.films()[0].image();

    let settings = ReferenceSettings { size: SIZE, light, max_depth, seed: 1 };
    let until = Until { batches: Some(2), ..Default::default() };
    let reference = render_reference(&scene, renderer.intersector(), &settings, &until, &|| false, &mut |_, _| {});
    let error = compare(&image, &reference.image, &reference.mask).expect("same size");
    let noise = reference.relative_noise(&reference.mask).expect("measured") / (error.pixels as f64).sqrt();
    println!("{name} {light:?} to {max_depth}: ratio {:.5} ± {noise:.5}", error.mean_ratio);
    assert!((error.mean_ratio - 1.0).abs() < 0.01, "{name} {light:?} to {max_depth}: {}", error.mean_ratio);
}

#[test]
fn scenes_without_a_stored_reference() {
    agrees("glass_sphere", LightPart::All, 20);
    agrees("two_lights", LightPart::All, 20);
    agrees("prism_wall", LightPart::All, 20);
}

/// One surface more or less would change these images by several per cent.
#[test]
fn depth_means_the_same() {
    agrees("two_lights", LightPart::All, 2);
    agrees("glass_sphere", LightPart::Caustic, 3);
}
