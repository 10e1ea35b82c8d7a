//! The tracers against closed forms, against each other, and against images by another renderer.

use super::*;
use crate::math::rgb::Rgb;
use crate::measure::metrics::{block_average, compare};
use crate::scene::geometry::Sphere;
use crate::scene::{Geometry, Light, open};
use glam::Vec3;

fn never() -> bool {
    false
}

fn settings(size: [u32; 2], light: LightPart) -> ReferenceSettings {
    ReferenceSettings { size, light, max_depth: 20, seed: 1 }
}

fn traced(scene: &Scene, settings: ReferenceSettings, batches: u32) -> Reference {
    let intersector = Intersector::new(&scene.geometry, scene.radius);
    let until = Until { batches: Some(batches), ..Default::default() };
    render_reference(scene, &intersector, &settings, &until, &never, &mut |_, _| {})
}

/// Batches by the path tracer, with all that it can.
fn paths(scene: &Scene, s: ReferenceSettings, batches: u32, samples: u32) -> Batches {
    let intersector = Intersector::new(&scene.geometry, scene.radius);
    let tracer = Tracer::with_method(scene, &intersector, s, Method::Paths);
    let mut sum = Batches::new(s.size);
    (0..batches).for_each(|i| sum.add(&tracer.paths.batch(samples, mix(s.seed, u64::from(i)), &never).expect("runs")));
    sum
}

/// Batches by photons alone, direct light as well; none are aimed but those of caustics.
fn photons(scene: &Scene, s: ReferenceSettings, batches: u32, count: u64) -> Batches {
    let intersector = Intersector::new(&scene.geometry, scene.radius);
    let shows = |part| s.light == LightPart::All || s.light == part;
    let tracer = LightTracer {
        scene,
        intersector: &intersector,
        camera: Pinhole::new(&scene.camera, s.size),
        parts: Parts {
            direct: shows(LightPart::Direct),
            caustic: shows(LightPart::Caustic),
            global: shows(LightPart::Global),
        },
        specular_first: false,
        max_depth: s.max_depth,
        aim: (s.light == LightPart::Caustic).then(|| Aim::at_specular(scene, 1.0)).flatten(),
    };
    let mut sum = Batches::new(s.size);
    (0..batches).for_each(|i| sum.add(&tracer.batch(count, mix(s.seed, u64::from(i)), &never).expect("runs")));
    sum
}

fn mask_of(scene: &Scene, size: [u32; 2], method: Method) -> Mask {
    let intersector = Intersector::new(&scene.geometry, scene.radius);
    method.mask(scene, &intersector, &Pinhole::new(&scene.camera, size))
}

/// Two images of the same scene by ways that share no random number: their means, and their difference in units of the
/// noise that both measured (1 if it is noise alone).
fn difference(name: &str, a: &Batches, b: &Batches, mask: &Mask) -> f64 {
    let (va, vb) = (a.variance().expect("batches"), b.variance().expect("batches"));
    let (ia, ib) = (a.mean(), b.mean());
    let (mut apart, mut expected, mut of_sum, mut sum, mut n) = (0.0, 0.0, 0.0, [0.0; 2], 0.0);
    for i in (0..mask.counts.len()).filter(|&i| mask.counts[i]) {
        apart += (ia.pixels[i].as_dvec3() - ib.pixels[i].as_dvec3()).length_squared();
        let variance = (va.pixels[i] + vb.pixels[i]).as_dvec3();
        expected += variance.element_sum();
        // Channels are coloured by the same paths.
        of_sum += variance.map(f64::sqrt).element_sum().powi(2);
        sum[0] += ia.pixels[i].as_dvec3().element_sum();
        sum[1] += ib.pixels[i].as_dvec3().element_sum();
        n += 3.0;
    }
    let (ratio, noise) = (sum[0] / sum[1], of_sum.sqrt() / sum[1]);
    println!(
        "{name}: means {:.5} {:.5}, ratio {ratio:.5} ± {noise:.5}, difference over noise {:.3}",
        sum[0] / n,
        sum[1] / n,
        apart / expected
    );
    assert!(sum[1] > 0.0 && (ratio - 1.0).abs() < 4.0 * noise, "{name}: ratio {ratio} ± {noise}");
    apart / expected
}

/// Mean over the pixels of a rectangle that count in both masks, the variance of that mean, and the number of pixels.
fn region(r: &Reference, also: &Mask, [x0, y0, x1, y1]: [u32; 4]) -> (DVec3, DVec3, f64) {
    let (mut sum, mut variance, mut n) = (DVec3::ZERO, DVec3::ZERO, 0.0);
    for y in y0..y1 {
        for i in (x0..x1).map(|x| (y * r.image.size[0] + x) as usize) {
            if r.mask.counts[i] && also.counts[i] {
                sum += r.image.pixels[i].as_dvec3();
                if let Noise::Measured(v) = &r.noise {
                    variance += v.pixels[i].as_dvec3();
                }
                n += 1.0;
            }
        }
    }
    (sum / n, variance / (n * n), n)
}

/// A traced image against the stored one: means of regions within 1 % or three deviations of the noise of both, and
/// blocks of 8×8 pixels as far apart as that noise.
fn agrees_with_stored(name: &str, batches: u32, regions: &[[u32; 4]]) {
    let stored = Reference::built_in(name).expect("decodes").expect("stored");
    let own = traced(&open(name).expect("built in"), settings([256, 256], LightPart::All), batches);
    let stated = stored.noise_mse(&stored.mask).expect("stated");
    for rect in regions {
        let (mean, variance, n) = region(&own, &stored.mask, *rect);
        let (expected, ..) = region(&stored, &own.mask, *rect);
        let limit = (expected * 0.01).max((variance + stated / n).map(f64::sqrt) * 3.0);
        println!("  {rect:?}: {mean:.5} against {expected:.5}, limit {limit:.5}");
        assert!((mean - expected).abs().cmple(limit).all(), "{name} {rect:?}: {mean} against {expected}");
    }
    let counts = own.mask.counts.iter().zip(&stored.mask.counts).map(|(a, b)| *a && *b).collect();
    let both = Mask { size: own.mask.size, counts };
    let (a, mask) = block_average(&own.image, &both, 8);
    let (b, _) = block_average(&stored.image, &both, 8);
    let error = compare(&a, &b, &mask).expect("same size");
    let noise = (own.noise_mse(&both).expect("measured") + stated).sqrt() / 8.0;
    println!(
        "{name}: blocks {:.3} % apart, ratio {:.5}; noise explains {:.3} %",
        100.0 * error.relative_rmse,
        error.mean_ratio,
        100.0 * error.relative_rmse * noise / error.rmse
    );
    assert!(error.rmse < 1.3 * noise, "{name}: {} beyond {noise}", error.rmse);
}

#[test]
fn ring_is_what_another_renderer_makes() {
    let regions =
        [[20, 20, 60, 60], [150, 138, 166, 150], [100, 120, 140, 150], [15, 120, 40, 170], [200, 170, 250, 220]];
    agrees_with_stored("ring", 3, &regions);
}

#[test]
fn ring_soft_is_what_another_renderer_makes() {
    agrees_with_stored("ring_soft", 3, &[[20, 20, 60, 60], [140, 100, 200, 150]]);
}

#[test]
fn glass_ball_is_what_another_renderer_makes() {
    agrees_with_stored("glass_ball", 3, &[[20, 150, 70, 230], [104, 123, 120, 130], [70, 110, 95, 140]]);
}

#[test]
fn cornell_is_what_another_renderer_makes() {
    let regions =
        [[90, 100, 130, 200], [60, 235, 200, 250], [20, 60, 45, 180], [215, 60, 240, 180], [145, 60, 200, 100]];
    agrees_with_stored("cornell", 3, &regions);
}

/// What the ring's inner wall mirrors, which photons can't show.
#[test]
fn mirrors_show_what_another_renderer_makes() {
    let scene = open("ring_soft").expect("built in");
    let stored = Reference::built_in("ring_soft").expect("decodes").expect("stored");
    let b = paths(&scene, settings([256, 256], LightPart::All), 3, 8);
    let own = Reference {
        source: String::new(),
        image: b.mean(),
        mask: Mask::all([256, 256]),
        noise: Noise::Measured(b.variance().expect("batches")),
    };
    let (mean, ..) = region(&own, &stored.mask, [90, 75, 190, 95]);
    assert!((mean.x / 0.07099 - 1.0).abs() < 0.02, "{mean}");
}

/// Photons and paths share the scene and the intersector alone; on the box both see everything.
#[test]
fn photons_and_paths_agree_on_the_cornell_box() {
    let scene = open("cornell").expect("built in");
    let size = [48, 48];
    let mask = mask_of(&scene, size, Method::PathsAndPhotons);
    for part in [LightPart::All, LightPart::Direct, LightPart::Global] {
        let s = settings(size, part);
        let apart = difference("cornell", &paths(&scene, s, 8, 16), &photons(&scene, s, 8, 1 << 16), &mask);
        assert!((0.9..1.1).contains(&apart), "{part:?}: {apart}");
    }
}

/// The floor of `plane` with another light, and a box of walls around it so that light also comes in twice.
fn under(light: Light) -> Scene {
    let mut scene = open("plane").expect("built in");
    let mut geometry = (*scene.geometry).clone();
    let emitter = scene.materials.len() as u32;
    scene.materials.push(Material::Emitter { radiance: light.radiance() });
    let mut add = |corners: &[Vec3], material: u32| {
        let first = geometry.positions.len() as u32;
        geometry.positions.extend_from_slice(corners);
        for i in 2..corners.len() as u32 {
            geometry.triangles.push([first, first + i - 1, first + i]);
            geometry.corner_normals.push([crate::scene::geometry::NONE; 3]);
            geometry.corner_uvs.push([crate::scene::geometry::NONE; 3]);
            geometry.triangle_materials.push(material);
        }
    };
    // A wall to the left, and a small screen that throws a shadow.
    add(
        &[Vec3::new(-1.2, 0.0, 1.5), Vec3::new(-1.2, 0.0, -1.5), Vec3::new(-1.2, 1.5, -1.5), Vec3::new(-1.2, 1.5, 1.5)],
        0,
    );
    add(&[Vec3::new(0.1, 0.4, 0.3), Vec3::new(0.5, 0.4, 0.3), Vec3::new(0.5, 0.5, -0.2)], 0);
    match &light {
        Light::Quad { center, u, v, .. } => {
            add(&[*center - *u - *v, *center + *u - *v, *center + *u + *v, *center - *u + *v], emitter);
        }
        Light::Mesh { triangles, .. } => triangles.iter().for_each(|t| add(t, emitter)),
        Light::Sphere { center, radius, .. } => {
            geometry.spheres.push(Sphere { center: *center, radius: *radius, material: emitter });
        }
        _ => {}
    }
    scene.geometry = geometry.into();
    scene.lights = vec![light];
    scene
}

fn lights() -> Vec<Light> {
    let (at, power) = (Vec3::new(0.4, 1.1, -0.3), Rgb::new(30.0, 20.0, 10.0));
    let axis = Vec3::new(-0.5, -1.0, 0.1).normalize();
    let corner = [at, at + Vec3::new(0.5, 0.1, 0.0), at + Vec3::new(0.1, 0.0, 0.5), at + Vec3::new(0.6, -0.2, 0.5)];
    vec![
        Light::Point { position: at, power },
        Light::Spot { position: at, direction: axis, cos_half: 0.7, falloff: 0.0, power },
        Light::Spot { position: at, direction: axis, cos_half: 0.2, falloff: 3.5, power },
        Light::Sphere { center: at, radius: 0.2, power },
        Light::Quad { center: at, u: Vec3::new(0.3, 0.1, 0.0), v: Vec3::new(0.0, 0.0, 0.2), power: power * 2.0 },
        Light::mesh(vec![[corner[0], corner[1], corner[2]], [corner[1], corner[3], corner[2]]], power),
        Light::Directional {
            direction: axis,
            irradiance: power,
            disc_center: axis * (-1.01 * 5.66),
            disc_radius: 5.66,
        },
    ]
}

/// Emission of photons and shadow rays are two pieces of code for each kind of light: they must agree on direct light and
/// on light that comes in twice.
#[test]
fn photons_and_paths_agree_under_every_kind_of_light() {
    let size = [24, 24];
    for light in lights() {
        let kind = light.kind();
        let scene = under(light);
        let mask = mask_of(&scene, size, Method::PathsAndPhotons);
        for part in [LightPart::Direct, LightPart::Global] {
            let s = settings(size, part);
            let apart = difference(kind, &paths(&scene, s, 8, 32), &photons(&scene, s, 8, 1 << 16), &mask);
            assert!((0.8..1.2).contains(&apart), "{kind} {part:?}: {apart}");
        }
    }
}

/// A built-in scene after some replacements in its text, with another material on its specular surfaces.
fn altered(name: &str, replacements: &[(&str, &str)], material: &Material) -> Scene {
    let mut text = crate::scene::built_in::find(name).expect("built in").text.to_owned();
    for (old, new) in replacements {
        assert!(text.contains(old), "{old}");
        text = text.replace(old, new);
    }
    let files = crate::scene::source::Files::BuiltIn(&[]);
    let mut scene =
        crate::scene::load::scene_from_toml(std::path::Path::new("altered.toml"), &text, &files).expect("a scene");
    scene.materials.iter_mut().filter(|m| m.is_specular()).for_each(|m| *m = material.clone());
    scene
}

/// Caustics, and the light that they throw on, against paths that find a large light by chance: mirrors, metal, coloured
/// glass, and shading normals that are some degrees off the flat ones.
#[test]
fn photons_and_paths_agree_on_caustics() {
    let colored = Rgb::new(0.9, 0.6, 0.3);
    let mirror = Material::Mirror { reflectance: colored };
    let metal = Material::Metal { reflectance: colored };
    let glass = Material::Dielectric { ior: 1.5, absorption: Rgb::new(0.5, 0.8, 0.01).map(|t| -t.ln()) };
    let ring =
        |segments| [("segments = 256", segments), ("radius = 0.2", "radius = 1.2"), ("fov_y = 35", "fov_y = 12")];
    let room = [("radius = 0.06", "radius = 0.35")];
    for (name, scene, part) in [
        ("metal ring of few facets", altered("ring_soft", &ring("segments = 24"), &metal), LightPart::Caustic),
        ("glass ring", altered("ring_soft", &ring("segments = 48"), &glass), LightPart::Caustic),
        ("glass ball", altered("glass_sphere", &room, &glass), LightPart::Caustic),
        ("glass ball", altered("glass_sphere", &room, &glass), LightPart::Global),
        ("mirror ball", altered("glass_sphere", &room, &mirror), LightPart::Global),
    ] {
        let s = settings([24, 24], part);
        let mask = mask_of(&scene, s.size, Method::PathsAndPhotons);
        let apart = difference(name, &paths(&scene, s, 16, 128), &photons(&scene, s, 8, 1 << 17), &mask);
        assert!((0.7..1.3).contains(&apart), "{name} {part:?}: {apart}");
    }
}

/// A flat mirror whose shading normals are all 19 degrees off: photons keep their flux and spread it over another area
/// than the mirror's own would, which paths must weigh in: without that they see 37 % less.
#[test]
fn photons_and_paths_agree_where_shading_normals_turn_a_mirror() {
    let light = Light::Sphere { center: Vec3::new(0.4, 1.1, -0.3), radius: 0.5, power: Rgb::splat(30.0) };
    let mut scene = under(light);
    scene.materials.push(Material::Mirror { reflectance: Rgb::ONE });
    let mut geometry = (*scene.geometry).clone();
    let at = geometry.normals.len() as u32;
    geometry.normals.push(Vec3::new(1.0, -0.35, 0.0).normalize());
    for side in [2, 3] {
        geometry.corner_normals[side] = [at; 3];
        geometry.triangle_materials[side] = scene.materials.len() as u32 - 1;
    }
    scene.geometry = geometry.into();
    let s = settings([24, 24], LightPart::Caustic);
    let mask = mask_of(&scene, s.size, Method::PathsAndPhotons);
    let apart = difference("turned mirror", &paths(&scene, s, 8, 64), &photons(&scene, s, 8, 1 << 16), &mask);
    assert!((0.7..1.3).contains(&apart), "{apart}");
}

/// A sphere of reflectance one half with a light of intensity π in its middle: light that was scattered `k` times has
/// radiance 2⁻ᵏ, and paths of at most `n` surfaces see `1 - 2⁻ⁿ`.
#[test]
fn a_furnace_is_a_geometric_series_cut_at_the_depth() {
    let mut scene = open("plane").expect("built in");
    scene.geometry =
        Geometry { spheres: vec![Sphere { center: Vec3::ZERO, radius: 1.0, material: 0 }], ..Default::default() }
            .into();
    scene.materials = vec![Material::Diffuse { reflectance: Rgb::splat(0.5), texture: None }];
    let pi = std::f32::consts::PI;
    scene.lights = vec![Light::Point { position: Vec3::ZERO, power: Rgb::splat(4.0 * pi * pi) }];
    scene.camera.position = Vec3::new(0.1, 0.4, -0.2);
    for (depth, expected) in [(1, 0.5), (2, 0.75), (5, 0.96875), (50, 1.0)] {
        let s = ReferenceSettings { max_depth: depth, ..settings([4, 4], LightPart::All) };
        for (name, b) in [("paths", paths(&scene, s, 8, 256)), ("photons", photons(&scene, s, 8, 1 << 14))] {
            let (rms, mean) = b.noise(&Mask::all([4, 4])).expect("batches");
            println!("{name} to {depth}: {mean} ± {}", rms / 4.0);
            assert!((mean - expected).abs() < 1e-4 + 4.0 * rms / 4.0, "{name} to {depth}: {mean}");
        }
    }
}

/// A glass ball among walls that all shine: every path sees their radiance, however it turns, and so does a camera in the
/// glass, whose radiance is larger by the square of the index.
#[test]
fn glass_changes_no_radiance() {
    let mut scene = open("glass_ball").expect("built in");
    let mut geometry = (*scene.geometry).clone();
    let ball = geometry.spheres[0];
    geometry.spheres[0].material = 1;
    // The floor's two triangles, and four corners above: a tetrahedron around all, its front inside.
    geometry.triangles.clear();
    geometry.positions =
        [[9.0, 9.0, 9.0], [-9.0, -9.0, 9.0], [-9.0, 9.0, -9.0], [9.0, -9.0, -9.0]].map(Vec3::from).into();
    geometry.triangles = vec![[0, 1, 2], [0, 3, 1], [0, 2, 3], [1, 3, 2]];
    for t in &mut geometry.triangles {
        let [a, b, c] = t.map(|i| geometry.positions[i as usize]);
        if (b - a).cross(c - a).dot(a) > 0.0 {
            t.swap(1, 2);
        }
    }
    geometry.corner_normals = vec![[crate::scene::geometry::NONE; 3]; 4];
    geometry.corner_uvs = geometry.corner_normals.clone();
    geometry.triangle_materials = vec![0; 4];
    scene.geometry = geometry.into();
    scene.materials = vec![
        Material::Emitter { radiance: Rgb::new(2.0, 1.0, 0.5) },
        Material::Dielectric { ior: 1.5, absorption: Rgb::ZERO },
    ];
    scene.lights.clear();
    let s = ReferenceSettings { max_depth: 400, ..settings([16, 16], LightPart::Direct) };
    let seen = |scene: &Scene| paths(scene, s, 2, 8).mean();
    assert!(seen(&scene).pixels.iter().all(|p| (*p - Vec3::new(2.0, 1.0, 0.5)).abs().max_element() < 1e-5));
    scene.camera.position = ball.center + Vec3::new(0.01, 0.02, 0.0);
    let within = seen(&scene);
    assert!(within.pixels.iter().all(|p| (*p - Vec3::new(4.5, 2.25, 1.125)).abs().max_element() < 1e-5), "{within:?}");
}

#[test]
fn the_plane_has_its_closed_form() {
    let scene = open("plane").expect("built in");
    let s = settings([32, 32], LightPart::All);
    let exact = closed_form::reference(&scene, s.size, s.light).expect("a closed form");
    for (name, b) in [("paths", paths(&scene, s, 8, 16)), ("photons", photons(&scene, s, 8, 1 << 17))] {
        let (rms, mean) = b.noise(&exact.mask).expect("batches");
        let error = compare(&b.mean(), &exact.image, &exact.mask).expect("same size");
        println!("{name}: RMSE {} against noise {rms}, ratio {}", error.rmse, error.mean_ratio);
        assert!((error.mean_ratio - 1.0).abs() < 4.0 * rms / mean / 32.0, "{name}: {}", error.mean_ratio);
        // χ² of some 1000 independent pixels, with variances from 8 batches: a fifth is far out.
        assert!((error.rmse / rms - 1.0).abs() < 0.1, "{name}: {} {rms}", error.rmse);
    }
}

/// The parts are those of the same paths: they add up to the whole, to rounding.
#[test]
fn parts_add_up_to_all() {
    for name in ["glass_sphere", "glass_ball"] {
        let scene = open(name).expect("built in");
        let intersector = Intersector::new(&scene.geometry, scene.radius);
        for method in [Method::Paths, Method::PathsAndPhotons] {
            let image = |light| {
                let s = settings([24, 24], light);
                let mut tracer = Tracer::with_method(&scene, &intersector, s, method);
                assert!(tracer.step(&never));
                tracer.batches().sum.clone()
            };
            let [all, direct, caustic, global] =
                [LightPart::All, LightPart::Direct, LightPart::Caustic, LightPart::Global].map(image);
            for i in 0..all.len() {
                let sum = direct[i] + caustic[i] + global[i];
                assert!((sum - all[i]).abs().max_element() <= 1e-5 * all[i].max_element(), "{name} {method:?} {i}");
            }
            let total = |v: &[DVec3]| v.iter().map(|p| p.element_sum()).sum::<f64>();
            assert!(total(&direct) > 0.0 && (total(&caustic) > 0.0 || (name, method) == ("glass_ball", Method::Paths)));
            assert!(total(&global) > 0.0, "{name} {method:?}");
        }
    }
}

/// The variance that batches state against the spread of the means of 48 seeds. With 47 degrees of freedom for each of
/// many pixels a deviation of 10 % is several standard deviations.
#[test]
fn stated_variance_is_the_spread_of_seeds() {
    let size = [6, 6];
    let check = |name: &str, run: &dyn Fn(u64) -> Batches| {
        let runs: Vec<Batches> = (0..48).map(run).collect();
        let mut of_means = Batches::new(size);
        let mut stated = 0.0;
        for r in &runs {
            of_means.add(&r.sum.iter().map(|s| *s / f64::from(r.count)).collect::<Vec<_>>());
            stated += r.noise(&Mask::all(size)).expect("batches").0.powi(2) / 48.0;
        }
        // Variance of the mean of 48 means, times 48.
        let spread = of_means.noise(&Mask::all(size)).expect("runs").0.powi(2) * 48.0;
        println!("{name}: stated {stated:e}, spread {spread:e}, ratio {}", stated / spread);
        assert!((stated / spread - 1.0).abs() < 0.1, "{name}: {}", stated / spread);
    };
    let scene = open("cornell").expect("built in");
    let s = |seed| ReferenceSettings { seed: mix(99, seed), ..settings(size, LightPart::Global) };
    check("paths", &|seed| paths(&scene, s(seed), 8, 8));
    check("photons", &|seed| photons(&scene, s(seed), 8, 1 << 11));
}

#[test]
fn threads_do_not_show() {
    for name in ["ring", "cornell"] {
        let scene = open(name).expect("built in");
        let run = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
            pool.install(|| traced(&scene, settings([33, 20], LightPart::All), 2))
        };
        let one = run(1);
        for threads in [2, 5] {
            let other = run(threads);
            assert!(one.image == other.image && one.noise == other.noise && one.mask == other.mask, "{name} {threads}");
        }
    }
}

#[test]
fn it_stops_where_it_is_told_and_goes_on_from_there() {
    let scene = open("cornell").expect("built in");
    let intersector = Intersector::new(&scene.geometry, scene.radius);
    let mut tracer = Tracer::new(&scene, &intersector, settings([12, 12], LightPart::All));
    // Cancelled at once: nothing is added.
    assert!(!tracer.refine(&Until::default(), &|| true, &mut |_, _| {}) && tracer.batches().count() == 0);
    assert_eq!(tracer.reference().noise, Noise::Unknown);
    let mut told = Vec::new();
    let mut tell = |seconds: f64, noise: Option<f64>| told.push((seconds, noise));
    assert!(tracer.refine(&Until { seconds: Some(0.0), ..Default::default() }, &never, &mut tell));
    assert_eq!((tracer.batches().count(), told.len()), (2, 2));
    assert!(told[0].1.is_none() && told[1].1.is_some() && told[0].0 <= told[1].0);
    // A target that two batches meet is trusted later; one that needs more gets more.
    assert!(tracer.refine(&Until { noise: Some(1.0), ..Default::default() }, &never, &mut |_, _| {}));
    assert_eq!(tracer.batches().count(), TRUSTED_BATCHES);
    let noise = tracer.relative_noise().expect("measured");
    let r = tracer.reference();
    assert!((r.relative_noise(&r.mask).expect("measured") / noise - 1.0).abs() < 1e-4);
    assert!(tracer.refine(&Until { noise: Some(noise * 0.9), ..Default::default() }, &never, &mut |_, _| {}));
    assert!(tracer.batches().count() > TRUSTED_BATCHES && tracer.relative_noise().expect("measured") <= noise * 0.9);
    let n = tracer.batches().count();
    let once = traced(&scene, settings([12, 12], LightPart::All), n);
    assert_eq!((once.image, once.noise), (tracer.reference().image, tracer.reference().noise), "the same as one run");
    assert!(!tracer.resume(Batches::new([3, 3]), 0.0) && tracer.batches().count() == n);
}

#[test]
fn odd_scenes_have_defined_images() {
    let mut dark = open("ring").expect("built in");
    dark.lights.clear();
    let intersector = Intersector::new(&dark.geometry, dark.radius);
    let mut tracer = Tracer::new(&dark, &intersector, settings([8, 8], LightPart::All));
    assert!(tracer.refine(&Until { noise: Some(0.01), ..Default::default() }, &never, &mut |_, _| {}));
    assert!(tracer.reference().image.pixels.iter().all(|p| *p == Vec3::ZERO) && tracer.relative_noise().is_none());
    // A camera that sees the sky alone, where photons have no pixel: there is nothing to wait for.
    let mut away = open("ring").expect("built in");
    away.camera.frame = away.camera.frame.map(|a| -a);
    let r = traced(&away, settings([8, 8], LightPart::All), 1000);
    assert!(r.mask.counts.iter().all(|c| !c) && r.noise_mse(&r.mask).is_none());
    // No surface at all, lights without power, and one at the camera.
    let mut empty = open("plane").expect("built in");
    empty.geometry = Geometry::default().into();
    assert!(traced(&empty, settings([4, 4], LightPart::All), 2).image.pixels.iter().all(|p| *p == Vec3::ZERO));
    let mut odd = open("glass_ball").expect("built in");
    odd.lights = vec![
        Light::Point { position: odd.camera.position, power: Rgb::ZERO },
        Light::Point { position: Vec3::ZERO, power: Rgb::splat(1e30) },
        Light::mesh(Vec::new(), Rgb::ONE),
    ];
    let r = traced(&odd, settings([8, 8], LightPart::All), 2);
    assert!(r.image.pixels.iter().all(|p| p.is_finite()));
}
