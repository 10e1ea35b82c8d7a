//! Progressive renders against images by an independent renderer.

#![allow(clippy::expect_used, missing_docs, reason = "a failed expectation is how this program reports")]

use cusp::estimate::registry::estimator;
use cusp::measure::Reference;
use cusp::measure::metrics::{block_average, compare, region_mean};
use cusp::render::film::Image;
use cusp::render::renderer::Watch;
use cusp::render::{RenderSettings, Renderer};
use cusp::scene::open;
use cusp::scene::scene_file::RenderFile;

fn flags(photons: i64) -> RenderFile {
    RenderFile { photons: Some(photons), shadow_rays: Some(1), ..Default::default() }
}

/// A progressive render of a built-in scene with `integrated`, 256×256.
fn render(name: &str, passes: u32, flags: &RenderFile) -> Image {
    let scene = open(name).expect("built in");
    let settings = RenderSettings::new(&scene, flags, Some([256, 256]), 1).expect("valid");
    let mut renderer = Renderer::new(scene, settings, vec![estimator("integrated").expect("registered")]);
    let start = std::time::Instant::now();
    for _ in 0..passes {
        renderer.step(&Watch::SILENT);
    }
    println!("{name}: {passes} passes in {:.1} s, {:?}", start.elapsed().as_secs_f64(), renderer.seconds());
    renderer.films()[0].image()
}

/// Checks the mean of each region within 1 %, and the relative RMSE of 4×4 blocks.
fn check(name: &str, image: &Image, regions: &[([u32; 4], [f32; 3])], limit: f64) {
    let reference = Reference::built_in(name).expect("decodes").expect("stored");
    let (small, mask) = block_average(image, &reference.mask, 4);
    let (small_reference, _) = block_average(&reference.image, &reference.mask, 4);
    let error = compare(&small, &small_reference, &mask).expect("same size");
    println!("relative RMSE {:.3} %, mean ratio {:.4}", 100.0 * error.relative_rmse, error.mean_ratio);
    let means = regions.iter().map(|(rect, expected)| (rect, region_mean(image, *rect), expected));
    for (rect, mean, expected) in means.clone() {
        println!("  {rect:?}: {mean} against {expected:?}, {:+.2} %", 100.0 * (mean.x / expected[0] - 1.0));
    }
    for (rect, mean, expected) in means {
        for (x, e) in mean.to_array().iter().zip(expected) {
            assert!((x - e).abs() <= 0.01 * e, "{name} {rect:?}: {mean} is not {expected:?}");
        }
    }
    assert!(error.relative_rmse <= limit, "{name}: {}", error.relative_rmse);
}

fn agrees(name: &str, passes: u32, photons: i64, regions: &[([u32; 4], [f32; 3])], limit: f64) {
    check(name, &render(name, passes, &flags(photons)), regions, limit);
}

fn grey(value: f32) -> [f32; 3] {
    [value; 3]
}

#[test]
fn ring() {
    let regions = [
        ([20, 20, 60, 60], grey(0.19116)),
        ([150, 138, 166, 150], grey(0.36305)),
        ([100, 120, 140, 150], grey(0.12868)),
        ([15, 120, 40, 170], grey(0.28678)),
        ([200, 170, 250, 220], grey(0.0)),
    ];
    agrees("ring", 40, 400_000, &regions, 0.03);
}

#[test]
fn ring_soft() {
    let regions =
        [([20, 20, 60, 60], grey(0.19118)), ([140, 100, 200, 150], grey(0.16876)), ([90, 75, 190, 95], grey(0.07099))];
    agrees("ring_soft", 40, 400_000, &regions, 0.06);
}

/// The focus holds an eighth of the light on a few pixels, and the region of stray light very little: caustic photons
/// are followed alone, a thousand million of them, and the three parts of the light added up.
#[test]
fn glass_ball() {
    let regions = [
        ([20, 150, 70, 230], grey(0.11126)),
        ([104, 123, 120, 130], grey(2.05469)),
        ([70, 110, 95, 140], grey(0.00882)),
    ];
    let parts = [("direct", 1), ("caustic", 20_000_000), ("global", 2_500_000)];
    let images = parts.map(|(light, photons)| {
        let flags = RenderFile { light: Some(light.into()), ..flags(photons) };
        render("glass_ball", 50, &flags)
    });
    let mut sum = images[0].clone();
    for part in &images[1..] {
        sum.pixels.iter_mut().zip(&part.pixels).for_each(|(s, p)| *s += *p);
    }
    check("glass_ball", &sum, &regions, 0.03);
}

#[test]
fn cornell() {
    let regions = [
        ([90, 100, 130, 200], [0.23759, 0.22457, 0.20645]),
        ([60, 235, 200, 250], [0.21411, 0.18417, 0.17657]),
        ([20, 60, 45, 180], [0.41913, 0.02955, 0.02815]),
        ([215, 60, 240, 180], [0.08551, 0.30774, 0.09757]),
        ([145, 60, 200, 100], [0.36333, 0.39188, 0.33829]),
    ];
    agrees("cornell", 30, 200_000, &regions, 0.03);
}
