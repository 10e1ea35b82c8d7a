//! Final gathering against images by tracers that share nothing with it, and against the stored reference.

#![allow(clippy::expect_used, missing_docs, reason = "a failed expectation is how this program reports")]

use cusp::estimate::registry::{estimator, estimators};
use cusp::measure::metrics::{block_average, compare};
use cusp::measure::tracer::{ReferenceSettings, Tracer, Until};
use cusp::measure::{Mask, Reference};
use cusp::render::film::Image;
use cusp::render::settings::LightPart;
use cusp::render::{RenderSettings, Renderer, Silent};
use cusp::scene::open;
use cusp::scene::scene_file::RenderFile;
use cusp::trace::Intersector;

/// Images of a built-in scene under `list`, with the light that is named.
fn render(name: &str, size: u32, photons: i64, passes: u32, light: &str, list: &str) -> Vec<(String, Image)> {
    let scene = open(name).expect("built in");
    let flags = RenderFile { photons: Some(photons), light: Some(light.into()), ..Default::default() };
    let settings = RenderSettings::new(&scene, &flags, Some([size, size]), 1).expect("valid");
    let estimators = estimators(list).expect("registered");
    let names: Vec<String> = estimators.iter().map(|e| e.name()).collect();
    let mut renderer = Renderer::new(scene.into(), settings, estimators);
    for _ in 0..passes {
        renderer.step(&Silent);
    }
    names.into_iter().zip(renderer.films().iter().map(|f| f.image())).collect()
}

/// A reference of our own tracers, after so many batches.
fn reference(name: &str, size: u32, light: LightPart, batches: u32) -> Reference {
    let scene = open(name).expect("built in");
    let intersector = Intersector::new(&scene.geometry, scene.radius);
    let settings = ReferenceSettings { size: [size, size], light, max_depth: 20, seed: 9 };
    let mut tracer = Tracer::new(&scene, &intersector, settings);
    let until = Until { batches: Some(batches), ..Default::default() };
    tracer.refine(&until, &|| false, &mut |_, _| {});
    tracer.reference()
}

fn mean_ratio(image: &Image, truth: &Image, mask: &Mask) -> f64 {
    compare(image, truth, mask).expect("of one size").mean_ratio
}

/// A room lit indirectly: corrected, the mean is within 1 % of the truth by the nearest estimate and over footprints, at few
/// rays and many. As published it is not, and the classic density has the bias of its discs.
#[test]
fn a_room_lit_indirectly_has_its_mean() {
    let truth = reference("two_lights", 48, LightPart::Global, 24);
    let list = "integrated+ray-differentials:rays=32,integrated+ray-differentials:rays=200,integrated+precomputed:rays=64,\
                integrated+ray-differentials:rays=32,pattern=stratified,differentials=as_published,\
                estimates=as_published,reach=facing,integrated+classic:rays=32";
    for (name, image) in render("two_lights", 48, 400_000, 2, "global", list) {
        let ratio = mean_ratio(&image, &truth.image, &truth.mask);
        println!("{name}: {ratio:.4}");
        if !name.contains("as_published") && !name.contains("classic") {
            assert!((ratio - 1.0).abs() < 0.01, "{name}: {ratio}");
        } else {
            assert!((ratio - 1.0).abs() < 0.1, "{name}: {ratio}");
        }
    }
}

/// The Cornell box against the independent renderer: mean, and error of 16×16 blocks.
#[test]
fn cornell_agrees_with_its_reference() {
    let truth = Reference::built_in("cornell").expect("decodes").expect("stored");
    let list = "integrated+ray-differentials:rays=48,integrated+ray-differentials:rays=48,near=0.2";
    for (name, image) in render("cornell", 256, 200_000, 1, "all", list) {
        let ratio = mean_ratio(&image, &truth.image, &truth.mask);
        let (small, mask) = block_average(&image, &truth.mask, 16);
        let (small_truth, _) = block_average(&truth.image, &truth.mask, 16);
        let blocks = compare(&small, &small_truth, &mask).expect("of one size").relative_rmse;
        println!("{name}: {ratio:.4}, blocks {blocks:.4}");
        assert!((ratio - 1.0).abs() < 0.01, "{name}: {ratio}");
        assert!(blocks < 0.03, "{name}: {blocks}");
    }
}

/// Glass, a caustic, coloured walls and a light with area: direct light from shadow rays, caustics from their map and the
/// rest gathered make all light, and what is gathered is what a tracer finds. What came twice, or not at all, would be seen.
#[test]
fn all_light_is_counted_once() {
    let list = "integrated+ray-differentials:rays=48,integrated+precomputed:rays=48,integrated+ray-differentials:rays=48,near=0.3";
    let of = |light: &str| render("glass_sphere", 48, 400_000, 4, light, list);
    let (all, direct, caustic, global) = (of("all"), of("direct"), of("caustic"), of("global"));
    // Caustics, whose noise is of another size than what is told apart here, are those of the estimator alone.
    let own = render("glass_sphere", 48, 400_000, 4, "caustic", "integrated");
    assert!(caustic.iter().all(|(_, image)| image.pixels == own[0].1.pixels));
    let whole = Mask::all([48, 48]);
    let truth = [
        (&global, reference("glass_sphere", 48, LightPart::Global, 16), 0.015),
        (&all, reference("glass_sphere", 48, LightPart::All, 8), 0.01),
    ];
    for (i, (name, image)) in all.iter().enumerate() {
        let shares = [&direct, &caustic, &global].map(|part| mean_ratio(&part[i].1, image, &whole));
        println!("{name}: direct, caustic, global {shares:.4?}");
        assert!((shares.iter().sum::<f64>() - 1.0).abs() < 1e-3, "{name}: {shares:?}");
        for (images, truth, limit) in &truth {
            let ratio = mean_ratio(&images[i].1, &truth.image, &truth.mask);
            println!("  {ratio:.4}, noise {:?}", truth.relative_noise(&truth.mask));
            assert!((ratio - 1.0).abs() < *limit, "{name}: {ratio}");
        }
    }
}

/// Where no light comes from a diffuse surface nothing is built, and the plan says so.
#[test]
fn a_scene_that_needs_no_gathering_builds_no_pyramid() {
    let scene = open("ring").expect("built in");
    let flags = RenderFile { photons: Some(20_000), ..Default::default() };
    let settings = RenderSettings::new(&scene, &flags, Some([32, 32]), 1).expect("valid");
    let chosen = estimator("integrated+ray-differentials:rays=100").expect("registered");
    let plain = estimator("integrated").expect("registered");
    let mut renderer = Renderer::new(scene.into(), settings, vec![chosen, plain]);
    renderer.step(&Silent);
    let pass = renderer.last_pass().expect("made");
    assert!(pass.gathering.is_empty() && renderer.gather_counts().rays == 0);
    let item = |part: &str| pass.plan.items.iter().find(|i| i.part == part).expect("in the plan");
    assert!(
        !item("final gathering").on && item("final gathering").why.starts_with("there is nothing to gather: of 65536")
    );
    assert!(!item("irradiance pyramid").on);
    let [a, b] = renderer.films() else { panic!("two films") };
    assert_eq!(a.image().pixels, b.image().pixels);
}
