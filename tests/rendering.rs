//! What a render promises: the same bits, the same image with parts forced on, defined images of odd scenes.

#![allow(clippy::expect_used, missing_docs, reason = "a failed expectation is how this program reports")]

use cusp::estimate::registry::{estimator, estimators};
use cusp::measure::metrics::{Mask, compare};
use cusp::render::Silent;
use cusp::render::film::Image;
use cusp::render::settings::PlanMode;
use cusp::render::{RenderSettings, Renderer};
use cusp::scene::load::scene_from_toml;
use cusp::scene::scene_file::RenderFile;
use cusp::scene::source::Files;
use cusp::scene::{Scene, open};
use std::path::Path;

const ALL: &str = "density,regular,regular_3x3:n=2,coplanar,multi_sampled:n=4,integrated";

fn render(scene: Scene, flags: &RenderFile, names: &str, passes: u32, plan: PlanMode) -> Renderer {
    let mut settings = RenderSettings::new(&scene, flags, Some([64, 64]), 7).expect("valid");
    settings.plan = plan;
    let mut renderer = Renderer::new(scene.into(), settings, estimators(names).expect("registered"));
    for _ in 0..passes {
        renderer.step(&Silent);
    }
    renderer
}

fn images(r: &Renderer) -> Vec<Image> {
    r.films().iter().map(|f| f.image()).collect()
}

fn few(photons: i64) -> RenderFile {
    RenderFile { photons: Some(photons), ..Default::default() }
}

#[test]
fn same_seed_same_bits_on_any_number_of_threads() {
    for gather in ["overlap", "knn"] {
        for scene in ["ring_soft", "cornell", "glass_sphere"] {
            let flags = RenderFile { gather: Some(gather.into()), ..few(20_000) };
            let on = |threads| {
                let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
                pool.install(|| images(&render(open(scene).expect("built in"), &flags, ALL, 2, PlanMode::Needed)))
            };
            let one = on(1);
            assert!(one == on(2) && one == on(5), "{scene} {gather}");
        }
    }
}

/// An estimator's image does not depend on which others are rendered beside it.
#[test]
fn estimators_do_not_disturb_each_other() {
    let together = images(&render(open("ring").expect("built in"), &few(50_000), ALL, 1, PlanMode::Needed));
    let alone = images(&render(open("ring").expect("built in"), &few(50_000), "integrated", 1, PlanMode::Needed));
    assert_eq!(together.last(), alone.first());
}

#[test]
fn forcing_every_part_on_changes_nothing_but_the_cost() {
    let of = |mode| render(open("ring").expect("built in"), &few(100_000), "integrated", 2, mode);
    let (needed, full) = (of(PlanMode::Needed), of(PlanMode::Full));
    assert!(!needed.plan().global_map && needed.plan().caustic_map && needed.plan().shadow_rays);
    assert!(full.plan().global_map);
    assert_eq!(images(&needed), images(&full));
    assert_eq!(needed.stored(), full.stored());
}

#[test]
fn plans_follow_the_scene() {
    let plan =
        |scene: &str, names: &str| render(open(scene).expect("built in"), &few(1000), names, 0, PlanMode::Needed);
    let cornell = plan("cornell", "integrated");
    assert!(!cornell.plan().caustic_map && cornell.plan().global_map && cornell.plan().emission);
    let plane = plan("plane", "integrated");
    assert!(!plane.plan().needs_photons() && !plane.plan().photon_differentials && plane.plan().shadow_rays);
    let glass = plan("glass_sphere", "density");
    let p = glass.plan();
    assert!(p.caustic_map && p.global_map && p.kd_tree && !p.overlap && !p.photon_differentials);
    assert!(!plan("glass_sphere", "regular").plan().view_differentials);
}

/// With a view footprint that vanishes every estimator but `density` gives what `regular` gives.
#[test]
fn all_tend_to_regular_for_small_pixels() {
    let mut scene = open("ring").expect("built in");
    scene.camera.tan_half_fov_y *= 1e-3;
    let names = "regular,coplanar:weight=mean,multi_sampled:grid=cells,integrated";
    let all = images(&render(scene, &few(200_000), names, 1, PlanMode::Needed));
    for other in &all[1..] {
        let e = compare(other, &all[0], &Mask::all(all[0].size)).expect("same size");
        assert!(e.relative_rmse < 2e-3, "{}", e.relative_rmse);
    }
}

/// Light is shown in parts that add up.
#[test]
fn parts_of_light_add_up() {
    let part = |light: &str| {
        let flags = RenderFile { light: Some(light.into()), ..few(20_000) };
        images(&render(open("glass_sphere").expect("built in"), &flags, "integrated", 1, PlanMode::Needed)).remove(0)
    };
    let (all, parts) = (part("all"), ["direct", "caustic", "global"].map(part));
    for (i, p) in all.pixels.iter().enumerate() {
        let sum = parts[0].pixels[i] + parts[1].pixels[i] + parts[2].pixels[i];
        assert!((sum - *p).abs().max_element() <= 1e-4 * p.max_element() + 1e-6);
    }
}

fn from_text(body: &str) -> Scene {
    let text = format!("[camera]\nposition = [0, 2, 3]\ntarget = [0, 0, 0]\nfov_y = 50\n{body}");
    scene_from_toml(Path::new("t.toml"), &text, &Files::BuiltIn(&[])).expect("loads")
}

const FLOOR: &str =
    "[materials.a]\nkind = \"diffuse\"\n[[shapes]]\nkind = \"quad\"\nu = [2, 0, 0]\nv = [0, 0, -2]\nmaterial = \"a\"\n";
const LIGHT: &str = "[[lights]]\nkind = \"point\"\nposition = [0, 1.5, 0]\npower = [10, 10, 10]\n";

#[test]
fn odd_scenes_have_a_defined_image_and_a_warning() {
    let glass = "[materials.g]\nkind = \"dielectric\"\n[[shapes]]\nkind = \"sphere\"\ncenter = [0, 2, 3]\nradius = 0.5\nmaterial = \"g\"\n";
    let flat = "[[shapes]]\nkind = \"quad\"\ncenter = [0, 1, 0]\nu = [1, 0, 0]\nv = [0, 0, 0]\nmaterial = \"a\"\n";
    let cases = [
        (String::new(), "no surfaces"),
        (FLOOR.to_owned(), "no light"),
        (format!("{FLOOR}{LIGHT}{flat}"), "without area"),
        (format!("{FLOOR}{LIGHT}{glass}"), "inside glass"),
    ];
    for (body, warning) in cases {
        let r = render(from_text(&body), &few(2000), ALL, 2, PlanMode::Needed);
        assert!(r.warnings().iter().any(|w| w.contains(warning)), "{warning}: {:?}", r.warnings());
        for image in images(&r) {
            assert!(image.pixels.iter().all(|p| p.is_finite() && p.min_element() >= 0.0), "{warning}");
        }
    }
}

#[test]
fn one_photon_and_a_huge_k_are_fine() {
    for photons in [1, 2, 3] {
        let flags =
            RenderFile { k: Some(100_000), gather: Some("knn".into()), direct: Some("photons".into()), ..few(photons) };
        let r = render(from_text(&format!("{FLOOR}{LIGHT}")), &flags, ALL, 1, PlanMode::Needed);
        for image in images(&r) {
            assert!(image.pixels.iter().all(|p| p.is_finite() && p.min_element() >= 0.0));
        }
    }
}

/// Scaling a scene by s leaves its picture but for 1/s²; moving it leaves the picture.
#[test]
fn pictures_do_not_depend_on_unit_or_place() {
    let body = |s: f64, at: f64| {
        format!(
            "[camera]\nposition = [{at}, {}, {}]\ntarget = [{at}, 0, 0]\nfov_y = 40\n\
             [materials.a]\nkind = \"diffuse\"\n[materials.m]\nkind = \"mirror\"\n\
             [[shapes]]\nkind = \"quad\"\nu = [2, 0, 0]\nv = [0, 0, -2]\nmaterial = \"a\"\nscale = {s}\ntranslate = [{at}, 0, 0]\n\
             [[shapes]]\nkind = \"ring\"\ninner = 0.6\nouter = 0.7\nheight = 0.4\nmaterial = \"m\"\nscale = {s}\ntranslate = [{at}, 0, 0]\n\
             [[lights]]\nkind = \"point\"\nposition = [{}, {}, 0]\npower = [10, 10, 10]\n",
            2.0 * s,
            3.0 * s,
            at + 1.2 * s,
            1.5 * s
        )
    };
    let of = |s: f64, at: f64| {
        let scene = scene_from_toml(Path::new("t.toml"), &body(s, at), &Files::BuiltIn(&[])).expect("loads");
        images(&render(scene, &few(50_000), "integrated", 1, PlanMode::Needed)).remove(0)
    };
    let plain = of(1.0, 0.0);
    for (s, at) in [(1e-6, 0.0), (0.125, 0.0), (1e6, 0.0), (1.0, 65536.0), (1e-3, 100.0)] {
        let mut image = of(s, at);
        image.pixels.iter_mut().for_each(|p| *p *= (s * s) as f32);
        let e = compare(&image, &plain, &Mask::all(plain.size)).expect("same size");
        assert!(e.relative_rmse < 0.02 && (e.mean_ratio - 1.0).abs() < 1e-3, "{s} {at}: {e:?}");
        if s == 0.125 {
            assert_eq!(e.rmse, 0.0, "powers of two scale without rounding");
        }
    }
}

/// The progressive render of a consistent estimator keeps getting better; the image has no spots left behind.
#[test]
fn progressive_passes_converge() {
    let scene = open("ring").expect("built in");
    let flags = RenderFile { footprint_scale: Some(1.5), ..few(200_000) };
    let settings = RenderSettings::new(&scene, &flags, Some([128, 128]), 1).expect("valid");
    let mut renderer = Renderer::new(scene.into(), settings, vec![estimator("integrated").expect("registered")]);
    let reference = cusp::measure::Reference::built_in("ring").expect("decodes").expect("stored");
    let small = reference.image.resampled([128, 128]);
    let (_, mask) = cusp::measure::metrics::block_average(&reference.image, &reference.mask, 2);
    let mut errors = Vec::new();
    for pass in 1..=32u32 {
        renderer.step(&Silent);
        if pass.is_power_of_two() {
            errors.push(compare(&renderer.films()[0].image(), &small, &mask).expect("same size").mse);
        }
    }
    println!("{errors:?}");
    // t^(-2/3) over four doublings from the second pass, when rays are first jittered, is a factor of 6.3.
    assert!(errors[5] < errors[1] / 5.0, "{errors:?}");
}
