//! Renders that stop at an estimated error, against images by an independent renderer.

#![allow(clippy::expect_used, missing_docs, reason = "a failed expectation is how this program reports")]

use cusp::estimate::registry::estimator;
use cusp::measure::metrics::compare;
use cusp::measure::{Mask, Reference};
use cusp::render::film::{Image, Rect};
use cusp::render::stop::{Standing, StopRule, StoppedBy};
use cusp::render::{RenderSettings, Renderer, Silent};
use cusp::scene::open;
use cusp::scene::scene_file::RenderFile;

/// The stored reference averaged over blocks, and the pixels whose whole block counts in it. Averages over 4×4 pixels
/// have a quarter of the reference's noise: 0.15 % in `ring`, 0.3 % in `cornell`.
fn reference(name: &str, side: u32) -> (Image, Mask) {
    let whole = Reference::built_in(name).expect("decodes").expect("stored");
    let width = whole.image.size[0];
    let n = width / side;
    assert_eq!(n * side, width);
    let pixels = (0..side).flat_map(|y| (0..side).map(move |x| (x, y)));
    let counts = pixels.map(|(x, y)| {
        let block = (0..n).flat_map(|j| (0..n).map(move |i| (i, j)));
        block.into_iter().all(|(i, j)| whole.mask.counts[((y * n + j) * width + x * n + i) as usize])
    });
    let size = [side, side];
    (whole.image.resampled(size), Mask { size, counts: counts.collect() })
}

/// Renders until the rule says stop; passes, the bound that was kept, and the true relative error.
fn until(name: &str, photons: i64, seed: u64, error: f64, most: u32) -> (u32, f64, f64) {
    let (truth, mask) = reference(name, 64);
    let scene = open(name).expect("built in");
    let flags = RenderFile { photons: Some(photons), ..Default::default() };
    let settings = RenderSettings::new(&scene, &flags, Some(truth.size), seed).expect("valid");
    let mut renderer = Renderer::new(scene.into(), settings, vec![estimator("integrated").expect("registered")]);
    let rule = StopRule { passes: Some(most), seconds: None, error: Some(error) };
    let mut now = Standing::default();
    while rule.verdict(&now).is_none() {
        renderer.step(&Silent);
        now.passes = renderer.passes();
        if rule.asks_for_error(now.passes) {
            now.error = renderer.films()[0].error_estimate(Rect::whole(truth.size), Some(&mask.counts));
        }
    }
    let true_error = compare(&renderer.films()[0].image(), &truth, &mask).expect("same size").relative_rmse;
    let bound = now.error.expect("at least 16 passes").relative_bound;
    println!("{name}, {photons} photons, seed {seed}: {} passes, bound {bound:.4}, true {true_error:.4}", now.passes);
    assert_eq!(rule.verdict(&now), Some(StoppedBy::Error), "{name}: {error} is reached in {most} passes");
    (now.passes, bound, true_error)
}

#[test]
fn ring() {}
