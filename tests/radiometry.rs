//! Absolute radiometry and energy: stored photons against closed forms.

#![allow(clippy::expect_used, missing_docs, reason = "a failed expectation is how this program reports")]

use cusp::estimate::registry::estimator;
use cusp::math::rgb::Rgb;
use cusp::render::Silent;
use cusp::render::film::Image;
use cusp::render::{RenderSettings, Renderer};
use cusp::scene::scene_file::RenderFile;
use cusp::scene::{Camera, Light, Scene, open};
use glam::Vec3;
use std::f32::consts::{PI, TAU};

/// Direct light from stored photons on the built-in plane under `lights`, 256×256.
fn by_photons(lights: Vec<Light>, name: &str, photons: i64, passes: u32) -> (Image, Camera) {
    let mut scene = open("plane").expect("built in");
    scene.lights = lights;
    let flags = RenderFile {
        photons: Some(photons),
        direct: Some("photons".into()),
        light: Some("direct".into()),
        ..Default::default()
    };
    let settings = RenderSettings::new(&scene, &flags, Some([256, 256]), 3).expect("valid");
    let camera = scene.camera;
    let mut renderer = Renderer::new(scene.into(), settings, vec![estimator(name).expect("registered")]);
    for _ in 0..passes {
        renderer.step(&Silent);
    }
    assert_eq!(renderer.stored().caustic + renderer.stored().global, 0);
    (renderer.films()[0].image(), camera)
}

/// Means over blocks of `side`×`side` pixels of radiance against `ρ/π E`; the plane is y = 0 with ρ = 0.5, its edge out of sight.
fn check_blocks(image: &Image, camera: &Camera, irradiance: impl Fn(Vec3) -> f32, side: u32, what: &str) {
    let size = image.size;
    for by in 0..size[1] / side {
        for bx in 0..size[0] / side {
            let (mut got, mut expected) = (0.0f64, 0.0f64);
            for y in by * side..by * side + side {
                for x in bx * side..bx * side + side {
                    let (v, _) = camera.ray(x as f32 + 0.5, y as f32 + 0.5, size, 0.5);
                    let p = camera.position + v * (-camera.position.y / v.y);
                    got += f64::from(image.at(x, y).x);
                    expected += f64::from(irradiance(p)) * 0.5 / std::f64::consts::PI;
                }
            }
            let off = (got / expected - 1.0).abs();
            assert!(off < 0.01, "{what}: block {bx},{by} is off by {:.2} %", 100.0 * off);
        }
    }
}

const POWER: Rgb = Rgb::splat(50.0);

#[test]
fn point_light_has_its_closed_form_under_every_estimator() {
    let position = Vec3::new(0.3, 1.5, -0.2);
    let irradiance = |p: Vec3| {
        let o = position - p;
        50.0 * o.y / (4.0 * PI * o.length().powi(3))
    };
    for name in ["regular", "integrated", "multi_sampled:grid=cells", "coplanar:weight=mean"] {
        let (image, camera) = by_photons(vec![Light::Point { position, power: POWER }], name, 1_000_000, 1);
        check_blocks(&image, &camera, irradiance, 32, name);
    }
}

#[test]
fn each_other_light_has_its_closed_form() {
    let position = Vec3::new(0.3, 1.5, -0.2);
    let towards = |p: Vec3| position - p;

    // Light from an area needs four dimensions of numbers, and so more photons and larger blocks for the same noise.
    let sphere = Light::Sphere { center: position, radius: 0.2, power: POWER };
    let (image, camera) = by_photons(vec![sphere], "integrated", 1_000_000, 8);
    let lambertian = |p: Vec3| 50.0 * towards(p).y / (4.0 * PI * towards(p).length().powi(3));
    check_blocks(&image, &camera, lambertian, 128, "sphere");

    let direction = Vec3::NEG_Y;
    let spot = Light::Spot { position, direction, cos_half: 0.2, falloff: 0.0, power: POWER };
    let omega = TAU * 0.8;
    let (image, camera) = by_photons(vec![spot], "integrated", 1_000_000, 1);
    let cone = |p: Vec3| 50.0 / omega * towards(p).y / towards(p).length().powi(3);
    check_blocks(&image, &camera, cone, 32, "spot");

    let lobe = Light::Spot { position, direction, cos_half: 0.0, falloff: 2.0, power: POWER };
    let (image, camera) = by_photons(vec![lobe], "integrated", 1_000_000, 1);
    let cosine = |p: Vec3| {
        let (d, cos) = (towards(p).length(), towards(p).y / towards(p).length());
        50.0 * 3.0 / TAU * cos * cos * cos / (d * d)
    };
    check_blocks(&image, &camera, cosine, 32, "spot with falloff");

    let beam = Light::Directional {
        direction: Vec3::new(0.0, -0.8, 0.6),
        irradiance: Rgb::splat(10.0),
        disc_center: Vec3::new(0.0, 0.8, -0.6) * 6.0,
        disc_radius: 2.5,
    };
    let (image, camera) = by_photons(vec![beam], "integrated", 2_000_000, 1);
    check_blocks(&image, &camera, |_| 8.0, 32, "directional");

    // A small square facing down: its four quarters about the foot of the perpendicular, by form factors.
    let (h, e) = (1.5f32, 0.3f32);
    let center = Vec3::new(0.0, h, 0.0);
    let quad = Light::Quad { center, u: Vec3::X * e, v: Vec3::Z * e, power: POWER };
    let (image, camera) = by_photons(vec![quad], "integrated", 1_000_000, 8);
    let corner = |x: f32, z: f32| {
        let (a, b) = (x / h, z / h);
        let (ra, rb) = ((1.0 + a * a).sqrt(), (1.0 + b * b).sqrt());
        (a / ra * (b / ra).atan() + b / rb * (a / rb).atan()) / TAU
    };
    let factor = |p: Vec3| {
        let (x0, x1, z0, z1) = (-e - p.x, e - p.x, -e - p.z, e - p.z);
        corner(x1, z1) - corner(x0, z1) - corner(x1, z0) + corner(x0, z0)
    };
    check_blocks(&image, &camera, |p| 50.0 / (4.0 * e * e) * factor(p), 128, "quad");
}

/// Several lights at once, one of them far dimmer, share photons without a bias.
#[test]
fn lights_add_up() {
    let at = [Vec3::new(0.6, 1.2, 0.0), Vec3::new(-0.5, 1.6, 0.4), Vec3::new(0.0, 2.0, -0.5)];
    let power = [30.0, 19.0, 1.0];
    let lights = at.iter().zip(power).map(|(p, w)| Light::Point { position: *p, power: Rgb::splat(w) });
    let (image, camera) = by_photons(lights.collect(), "integrated", 1_000_000, 1);
    let irradiance = |p: Vec3| {
        at.iter().zip(power).map(|(l, w)| w * (*l - p).y / (4.0 * PI * (*l - p).length().powi(3))).sum::<f32>()
    };
    check_blocks(&image, &camera, irradiance, 32, "three lights");
}

fn load(body: &str) -> Scene {
    let files = cusp::scene::source::Files::BuiltIn(&[]);
    cusp::scene::load::scene_from_toml(std::path::Path::new("t.toml"), body, &files).expect("loads")
}

/// Mean radiance of the middle quarter of a 64×64 image.
fn middle(scene: Scene, flags: &RenderFile, passes: u32) -> f32 {
    let settings = RenderSettings::new(&scene, flags, Some([64, 64]), 2).expect("valid");
    let mut renderer = Renderer::new(scene.into(), settings, vec![estimator("integrated").expect("registered")]);
    for _ in 0..passes {
        renderer.step(&Silent);
    }
    cusp::measure::metrics::region_mean(&renderer.films()[0].image(), [16, 16, 48, 48]).x
}

/// Shadow rays to lights that have a surface of their own, close to the floor and far from it, against stored photons
/// or the equivalent point light.
#[test]
fn lights_do_not_shade_themselves() {
    let floor = |size: f32, eye: &str| {
        format!(
            "[camera]\nposition = {eye}\ntarget = [0, 0, 0]\nup = [0, 0, -1]\nfov_y = 20\n\
             [materials.a]\nkind = \"diffuse\"\nreflectance = [0.5, 0.5, 0.5]\n\
             [[shapes]]\nkind = \"quad\"\nu = [{size}, 0, 0]\nv = [0, 0, -{size}]\nmaterial = \"a\"\n"
        )
    };
    let by = |direct: &str, photons: i64| RenderFile {
        light: Some("direct".into()),
        direct: Some(direct.into()),
        photons: Some(photons),
        shadow_rays: Some(64),
        ..Default::default()
    };
    // A quad 5 cm over a floor of 40 m, seen obliquely from its side.
    let low = format!(
        "{}[[lights]]\nkind = \"quad\"\ncenter = [0, 0.05, 2]\nu = [0.5, 0, 0]\nv = [0, 0, 0.5]\npower = [9, 9, 9]\n",
        floor(20.0, "[0, 6, 0]").replace("target = [0, 0, 0]", "target = [0, 0, 0.6]")
    );
    let (rays, photons) =
        (middle(load(&low), &by("shadow_rays", 1), 4), middle(load(&low), &by("photons", 2_000_000), 2));
    assert!((rays / photons - 1.0).abs() < 0.02, "low quad: {rays} {photons}");
    // Small spheres light like points, near and far.
    for (radius, height) in [(0.02f32, 0.1f32), (0.003, 1.0), (0.05, 30.0), (0.003, 30.0), (1e-9, 30.0)] {
        let eye = "[0, 1.5, 0.001]";
        let sphere = format!(
            "{}[[lights]]\nkind = \"sphere\"\nradius = {radius}\nposition = [0.5, {height}, 0.4]\npower = [9, 9, 9]\n",
            floor(20.0, eye)
        );
        let point = sphere.replace("sphere", "point").replace(&format!("radius = {radius}\n"), "");
        let rays = by("shadow_rays", 1);
        let (sphere, point) = (middle(load(&sphere), &rays, 1), middle(load(&point), &rays, 1));
        assert!((sphere / point - 1.0).abs() < 5e-3, "sphere of {radius} at {height}: {sphere} {point}");
    }
}

/// A floor under a plane of tinted glass: radiance falls by n² on its way out, and both ways absorb.
#[test]
fn light_leaves_a_medium_by_its_index_squared() {
    for (tint, ways) in [(1.0f32, 1.0f32), (0.5, 0.25)] {
        let scene = load(&format!(
            "[camera]\nposition = [0, 5, 0]\ntarget = [0, 0, 0]\nup = [0, 0, -1]\nfov_y = 4\n\
             [materials.a]\nkind = \"diffuse\"\nreflectance = [0.5, 0.5, 0.5]\n\
             [materials.g]\nkind = \"dielectric\"\nior = 1.5\ntransmittance = [{tint}, {tint}, {tint}]\n\
             [[shapes]]\nkind = \"quad\"\nu = [2, 0, 0]\nv = [0, 0, -2]\nmaterial = \"a\"\n\
             [[shapes]]\nkind = \"quad\"\ncenter = [0, 1, 0]\nu = [2, 0, 0]\nv = [0, 0, -2]\nmaterial = \"g\"\n\
             [[lights]]\nkind = \"directional\"\ndirection = [0, -1, 0]\nirradiance = [10, 10, 10]\n"
        ));
        let flags = RenderFile {
            photons: Some(1_000_000),
            light: Some("caustic".into()),
            split_depth: Some(2),
            ..Default::default()
        };
        let got = middle(scene, &flags, 1);
        let through = 1.0 - cusp::trace::scatter::fresnel(1.0, 1.0 / 1.5) as f32;
        let expected = 10.0 * through * 0.5 / PI * through / 2.25 * ways;
        assert!((got / expected - 1.0).abs() < 0.02, "tint {tint}: {got} {expected}");
    }
}

fn closed_box(reflectance: f32) -> Scene {
    let text = format!(
        "[camera]\nposition = [0.5, 0.2, 0]\ntarget = [0, 0, 0]\nfov_y = 60\n\
         [materials.wall]\nkind = \"diffuse\"\nreflectance = [{reflectance}, {reflectance}, {reflectance}]\n\
         [[shapes]]\nkind = \"box\"\nhalf_size = [1, 0.7, 1.3]\nmaterial = \"wall\"\n\
         [[lights]]\nkind = \"point\"\nposition = [0.1, 0.2, 0.3]\npower = [10, 10, 10]\n"
    );
    let files = cusp::scene::source::Files::BuiltIn(&[]);
    cusp::scene::load::scene_from_toml(std::path::Path::new("box.toml"), &text, &files).expect("loads")
}

/// The power stored at bounce b of a closed diffuse box is Φ ρᵇ.
#[test]
fn a_closed_box_gives_the_geometric_series() {
    let (reflectance, photons) = (0.6f64, 200_000i64);
    let mut before = 0.0;
    for depth in 1..=6u32 {
        let scene = closed_box(reflectance as f32);
        let flags = RenderFile {
            photons: Some(photons),
            max_depth: Some(i64::from(depth)),
            direct: Some("photons".into()),
            ..Default::default()
        };
        let settings = RenderSettings::new(&scene, &flags, Some([8, 8]), 5).expect("valid");
        let renderer = Renderer::new(scene.into(), settings, vec![estimator("regular").expect("registered")]);
        let mut path = renderer.plan().path_settings(renderer.settings());
        (path.direct, path.global) = (true, true);
        let mut emitter = renderer.emitter(renderer.plan(), renderer.settings());
        emitter.path = path;
        let pass = emitter.run(0, &|| false);
        let all = pass.stored.direct.iter().chain(&pass.stored.global);
        let total: f64 = all.clone().map(|p| f64::from(p.power.x)).sum();
        for p in all {
            assert!((f64::from(p.power.x) - 10.0 / photons as f64).abs() < 1e-9, "photons carry equal power");
        }
        let expected = 10.0 * reflectance.powi(depth as i32 - 1);
        let deviation = 10.0 * (reflectance.powi(depth as i32 - 1) / photons as f64).sqrt();
        assert!((total - before - expected).abs() <= 4.0 * deviation + 1e-6, "bounce {depth}: {}", total - before);
        before = total;
    }
}
