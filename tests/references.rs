//! Progressive renders against images by an independent renderer.

#![allow(clippy::expect_used, missing_docs, reason = "a failed expectation is how this program reports")]

use cusp::estimate::registry::estimator;
use cusp::measure::metrics::{block_average, compare, region_mean};
use cusp::measure::{Mask, Reference};
use cusp::render::Silent;
use cusp::render::film::Image;
use cusp::render::{RenderSettings, Renderer};
use cusp::scene::scene_file::RenderFile;
use cusp::scene::{Light, Scene, open};
use glam::{DVec3, Vec3};

/// Small footprints: less of the light leaks over edges, and many photons make up for the noise.
fn flags(photons: i64, footprint_scale: f64) -> RenderFile {
    RenderFile {
        photons: Some(photons),
        shadow_rays: Some(1),
        footprint_scale: Some(footprint_scale),
        ..Default::default()
    }
}

/// A progressive render of a built-in scene with `integrated`, 256×256.
fn render(name: &str, passes: u32, flags: &RenderFile) -> Image {
    render_scene(open(name).expect("built in"), passes, flags)
}

fn render_scene(scene: Scene, passes: u32, flags: &RenderFile) -> Image {
    let settings = RenderSettings::new(&scene, flags, Some([256, 256]), 1).expect("valid");
    let mut renderer = Renderer::new(scene.into(), settings, vec![estimator("integrated").expect("registered")]);
    let start = std::time::Instant::now();
    for _ in 0..passes {
        renderer.step(&Silent);
    }
    println!(
        "{}: {passes} passes in {:.1} s, {:?}",
        renderer.scene().name,
        start.elapsed().as_secs_f64(),
        renderer.seconds()
    );
    renderer.films()[0].image()
}

/// A rectangle, and what the reference's maker measured in it.
type Region = ([u32; 4], [f32; 3]);

/// Mean over the pixels of a rectangle that count.
fn masked_mean(image: &Image, mask: &Mask, [x0, y0, x1, y1]: [u32; 4]) -> Vec3 {
    let inside = (y0..y1).flat_map(|y| (x0..x1).map(move |x| (x, y)));
    let counted = inside.filter(|(x, y)| mask.counts[(y * mask.size[0] + x) as usize]);
    let (sum, n) = counted.fold((DVec3::ZERO, 0.0), |(sum, n), (x, y)| (sum + image.at(x, y).as_dvec3(), n + 1.0));
    (sum / n).as_vec3()
}

/// Checks the mean of each region within 1 %, and the relative RMSE of 4×4 blocks.
fn check(name: &str, image: &Image, regions: &[Region], limit: f64) {
    let reference = Reference::built_in(name).expect("decodes").expect("stored");
    let (small, mask) = block_average(image, &reference.mask, 4);
    let (small_reference, _) = block_average(&reference.image, &reference.mask, 4);
    let error = compare(&small, &small_reference, &mask).expect("same size");
    println!("{name}: relative RMSE {:.3} %, mean ratio {:.4}", 100.0 * error.relative_rmse, error.mean_ratio);
    let mut wrong = Vec::new();
    for (rect, measured) in regions {
        let whole = region_mean(&reference.image, *rect);
        assert!((whole - Vec3::from(*measured)).abs().max_element() < 1e-4, "{rect:?} is the region that was measured");
        let (mean, expected) =
            (masked_mean(image, &reference.mask, *rect), masked_mean(&reference.image, &reference.mask, *rect));
        let off = (mean - expected) / expected.max(Vec3::splat(1e-6));
        println!("  {rect:?}: {mean} against {expected}, {:+.2} %", 100.0 * off.x);
        if off.abs().max_element() > 0.01 {
            wrong.push(rect);
        }
    }
    assert!(wrong.is_empty(), "{name}: regions {wrong:?}");
    assert!(error.relative_rmse <= limit, "{name}: {}", error.relative_rmse);
}

fn agrees(name: &str, passes: u32, photons: i64, regions: &[Region], limit: f64) {
    check(name, &render(name, passes, &flags(photons, 1.5)), regions, limit);
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
    agrees("ring", 48, 1_500_000, &regions, 0.03);
}

#[test]
fn ring_soft() {
    let regions =
        [([20, 20, 60, 60], grey(0.19118)), ([140, 100, 200, 150], grey(0.16876)), ([90, 75, 190, 95], grey(0.07099))];
    agrees("ring_soft", 48, 1_500_000, &regions, 0.06);
}

/// The light of the ball's caustic alone: the point light's flux into a cone that holds the ball. What misses the ball
/// cannot become caustic, so the image of caustic light is the same, and no photon is wasted.
fn aimed_at_the_ball(scene: &mut Scene) {
    assert!(matches!(scene.lights[..], [Light::Point { .. }]), "one point light");
    let Light::Point { position, power } = scene.lights[0].clone() else { return };
    let ball = scene.geometry.spheres[0];
    let way = ball.center - position;
    let sine = ball.radius / way.length();
    let cos_half = (1.0 - sine * sine).sqrt();
    let fraction = (1.0 - cos_half) / 2.0;
    let direction = way.normalize();
    scene.lights =
        vec![Light::Spot { position, direction, cos_half: f64::from(cos_half), falloff: 0.0, power: power * fraction }];
}

/// The focus holds an eighth of the light on a few pixels, and the region of stray light very little: the three parts of
/// the light are rendered alone and added up. A ninth of the stray light is global, by some five hundred photons: what is
/// left of the deviation is within their noise.
#[test]
fn glass_ball() {
    let regions = [
        ([20, 150, 70, 230], grey(0.11126)),
        ([104, 123, 120, 130], grey(2.05469)),
        ([70, 110, 95, 140], grey(0.00882)),
    ];
    let parts = [("direct", 1, 1.0), ("caustic", 500_000, 1.0), ("global", 4_000_000, 0.5)];
    let images = parts.map(|(light, photons, scale)| {
        let flags = RenderFile { light: Some(light.into()), ..flags(photons, scale) };
        let mut scene = open("glass_ball").expect("built in");
        if light == "caustic" {
            aimed_at_the_ball(&mut scene);
        }
        render_scene(scene, 48, &flags)
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
    agrees("cornell", 32, 300_000, &regions, 0.03);
}
