//! The engine as a whole: photons over frames, maps against every photon tried, pictures kept and made afresh.

use super::photon_map::{PhotonMap, normal_class};
use super::search::Query;
use super::settings::{Area, Partition, Scattering, Search, photon_count, set};
use super::{Engine, RealtimeSettings};
use crate::math::rgb::Rgb;
use crate::math::sequence::{Sampling, Sequence};
use crate::photons::kd_tree::Nearest;
use crate::scene::scene_file::RealtimeFile;
use crate::scene::{Camera, Light, Scene, open};
use glam::{DVec3, Vec3};
use std::sync::Arc;

fn settings(scene: &Scene, texts: &[&str]) -> RealtimeSettings {
    let mut table = RealtimeFile::default();
    texts.iter().for_each(|t| set(&mut table, t).expect(t));
    RealtimeSettings::new(scene, &table, 1).expect("valid")
}

fn engine(name: &str, texts: &[&str]) -> Engine {
    let scene = Arc::new(open(name).expect("built in"));
    let s = settings(&scene, texts);
    Engine::new(&scene, s)
}

const SMALL: [u32; 2] = [64, 48];

fn run(engine: &mut Engine, frames: u64, step: f64) -> Vec<Rgb> {
    let camera = engine.scene().camera;
    let mut pixels = Vec::new();
    for _ in 0..frames {
        let time = engine.report().time + step;
        engine.step(time, &camera);
        pixels = engine.draw(&camera, SMALL, 1.0).pixels;
    }
    pixels
}

/// All regions, counts, radii and partitions find what trying every photon finds.
#[test]
fn the_map_is_the_exact_map() {
    let mut e = engine(
        "rooms",
        &["mesh_refinement=0", "photons_from_light=150", "diffuse_reflections=5", "accumulation_frames=4"],
    );
    run(&mut e, 5, 0.1);
    let frames = e.map().frames();
    assert_eq!(frames, [1, 2, 3, 4]);
    let numbers = Sequence::new(Sampling::Random, 8);
    let mut found = Nearest::new();
    let mut hits = 0;
    for (round, partition) in
        [Partition::None, Partition::Normal, Partition::Cell, Partition::None].into_iter().enumerate()
    {
        let s = RealtimeSettings { partition, stop_recursion_size: [12, 1, 30, 200][round], ..e.settings().clone() };
        let mut map = PhotonMap::new(4);
        frames.iter().for_each(|&f| drop(map.store(f, e.map().of_frame(f).to_vec())));
        let cell = |p: Vec3| ((p.x * 0.4).floor() + 40.0 * (p.z * 0.4).floor()) as i32 as u32;
        map.balance(&s, Some(&cell));
        let photons = map.photons().to_vec();
        assert!(photons.len() > 2500);
        for i in 0..600u64 {
            let x = numbers.four(i, round as u32);
            let near = photons[(x[0] * photons.len() as f32) as usize];
            let s = RealtimeSettings {
                search: [Search::Sphere, Search::Cylinder, Search::Ellipsoid][i as usize % 3],
                sphere_slice: i % 2 == 0,
                incoming_direction: i % 5 < 2,
                max_search_count: [1, 10, 50, 4000][i as usize % 4],
                slice_height: [0.02, 0.3, 1.0][(i / 3) as usize % 3],
                ..s.clone()
            };
            let radius = [0.3, 1.0, 40.0][(i / 7) as usize % 3];
            let query = Query::new(&s, near.position + Vec3::new(x[1], x[2], x[3]) * 0.1, near.normal, radius);
            map.nearest(&query, &mut found);
            let mut got: Vec<(u32, u32)> = found.iter().collect();
            got.sort_unstable();
            let mut exact = if partition == Partition::Normal {
                // Those of the same class, tried one by one, by their places in the whole list.
                let class: Vec<_> = (0u32..)
                    .zip(&photons)
                    .filter(|(_, p)| normal_class(p.normal) == normal_class(query.normal))
                    .collect();
                let own: Vec<_> = class.iter().map(|(_, p)| **p).collect();
                query.exact(&own).iter().map(|(d, i)| (d, class[i as usize].0)).collect::<Vec<_>>()
            } else {
                query.exact(&photons).iter().collect::<Vec<_>>()
            };
            exact.sort_unstable();
            assert_eq!(got, exact, "{query:?}");
            hits += got.len();
        }
    }
    assert!(hits > 100_000, "{hits}");
}

/// The photons of the last frames are those of an engine that made these frames alone, and with them every pixel.
#[test]
fn a_map_is_renewed_after_exactly_its_frames() {
    let texts = ["mesh_refinement=300", "photons_from_light=60", "diffuse_reflections=4", "accumulation_frames=5"];
    let mut old = engine("rooms", &texts);
    run(&mut old, 7, 0.05);
    let moved = {
        let mut scene = (**old.scene()).clone();
        scene.lights = vec![Light::Point { position: Vec3::new(1.0, 0.5, -1.0), power: Rgb::splat(200.0) }];
        scene.motions.clear();
        Arc::new(scene)
    };
    // The light jumps, without a new engine: the photons of the frames before stay for as long as they live.
    let camera = moved.camera;
    let mut jumped = Engine::new(&moved, old.settings().clone());
    let mut lamp = (*moved).clone();
    lamp.lights[0] = lamp.lights[0].moved(Vec3::new(-2.0, 1.0, 2.0));
    let lamp = Arc::new(lamp);
    (0..7).for_each(|_| jumped.step(0.0, &camera));
    jumped.move_lights(&lamp.lights);
    let mut fresh = Engine::new(&lamp, old.settings().clone());
    (0..7).for_each(|_| fresh.step(0.0, &camera));
    for frame in 7..14u64 {
        jumped.step(0.0, &camera);
        fresh.step(0.0, &camera);
        assert_eq!(jumped.map().of_frame(frame), fresh.map().of_frame(frame), "frame {frame}");
        let renewed = jumped.map().photons() == fresh.map().photons();
        assert_eq!(renewed, frame >= 7 + 5 - 1, "frame {frame}");
        let (a, b) = (jumped.draw(&camera, SMALL, 1.0), fresh.draw(&camera, SMALL, 1.0));
        assert_eq!(a.pixels == b.pixels, renewed);
    }
}

/// A light that is moved by an edit shines from its new place in the next frame; a camera that is moved changes nothing.
#[test]
fn edits_reach_the_engine() {
    let mut e = engine("cornell", &["mesh_refinement=200", "photons_from_light=50"]);
    run(&mut e, 3, 0.0);
    let mut edited = (**e.scene()).clone();
    edited.camera.position.x += 0.1;
    assert!(e.shows(&edited));
    edited.lights = vec![Light::Point { position: Vec3::new(0.5, -0.5, 0.5), power: edited.lights[0].flux() }];
    assert!(!e.shows(&edited));
    let mesh = Arc::clone(e.mesh());
    let (before, settings) = (e.map().frames(), e.settings().clone());
    e.change(&Arc::new(edited), settings);
    assert!(Arc::ptr_eq(&mesh, e.mesh()) && e.map().frames() == before);
    run(&mut e, 1, 0.0);
    assert!(matches!(e.lights()[0], Light::Point { .. }) && e.map().frames().len() == 4);
}

/// Threads change nothing.
#[test]
fn any_number_of_threads_makes_the_same_bits() {
    let make = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        pool.install(|| {
            let mut e =
                engine("rooms", &["mesh_refinement=2000", "photons_from_light=300", "area=hull", "partition=normal"]);
            let pixels = run(&mut e, 3, 0.3);
            (pixels, e.map().photons().to_vec())
        })
    };
    let one = make(1);
    assert!(one.0.iter().any(|p| p.x > 0.0) && one.0.iter().all(|p| p.is_finite()));
    assert!(one == make(2) && one == make(5));
}

/// What is kept of a picture, of estimates and of a hierarchy shows what is made afresh.
#[test]
fn what_is_kept_is_what_would_be_made() {
    let texts = ["mesh_refinement=1500", "photons_from_light=100", "diffuse_reflections=4"];
    let mut kept = engine("rooms", &texts);
    let mut others = [
        engine("rooms", &[&texts[..], &["estimate_cache=false"]].concat()),
        engine("rooms", &[&texts[..], &["moving=rebuild"]].concat()),
        engine("rooms", &[&texts[..], &["acceleration=false"]].concat()),
    ];
    for frame in 0..6 {
        let pixels = run(&mut kept, 1, 0.4);
        // A view that has seen nothing before.
        let mut fresh = engine("rooms", &texts);
        let camera = fresh.scene().camera;
        let time = kept.report().time;
        let first = 1.max(frame + 1);
        for f in (0..first).rev() {
            fresh.step(time - 0.4 * f as f64, &camera);
        }
        let afresh = fresh.draw(&camera, SMALL, 1.0).pixels;
        let same = pixels.iter().zip(&afresh).filter(|(a, b)| a.abs_diff_eq(**b, 1e-4 * a.max_element())).count();
        assert!(same * 1000 >= pixels.len() * 995, "{same} of {} in frame {frame}", pixels.len());
        for (i, e) in others.iter_mut().enumerate() {
            let there = run(e, 1, 0.4);
            let same = pixels.iter().zip(&there).filter(|(a, b)| a.abs_diff_eq(**b, 1e-3 * a.max_element())).count();
            assert!(same * 100 >= pixels.len() * 97, "{same} of {} for {i} in frame {frame}", pixels.len());
        }
    }
    assert!(others[0].report().estimates > 3 * kept.report().estimates);
    // Drawn again without a step in between, nothing is traced and nothing estimated.
    let camera = kept.scene().camera;
    let before = kept.draw(&camera, SMALL, 1.0);
    assert_eq!((kept.report().view_rays, kept.report().estimates), (0, 0));
    assert_eq!(before, kept.draw(&camera, SMALL, 1.0));
}

/// With coherent numbers a scene that stands still is the same from round to round; without it is not.
#[test]
fn coherent_numbers_keep_a_still_scene_still() {
    for (coherent, kind) in [(true, "sobol"), (true, "saff_kuijlaars"), (false, "sobol"), (false, "rejection")] {
        let scene = {
            let mut s = open("rooms").expect("built in");
            s.motions.clear();
            Arc::new(s)
        };
        let light = format!("light_distribution={kind}");
        let text = format!("coherent={coherent}");
        let s =
            settings(&scene, &["mesh_refinement=500", "photons_from_light=80", "accumulation_frames=3", &light, &text]);
        let mut e = Engine::new(&scene, s);
        run(&mut e, 3, 0.1);
        for _ in 0..4 {
            run(&mut e, 1, 0.1);
            assert_eq!(e.report().fluctuation == 0.0, coherent, "{kind}");
        }
    }
}

/// A closed room: nothing gets lost through its corners, what is stored first is the light's flux, and each bounce keeps
/// the reflectance of it, split or by roulette.
#[test]
fn power_is_kept() {
    let scene = {
        // A room of one reflectance and no openings: the inside of a box.
        let mut s = open("rooms").expect("built in");
        s.motions.clear();
        for m in &mut s.materials {
            *m = crate::scene::Material::Diffuse { reflectance: Rgb::new(0.8, 0.5, 0.2), texture: None };
        }
        Arc::new(s)
    };
    let flux = scene.lights[0].flux().as_dvec3();
    let series = |n: i32| (0..=n).map(|k| DVec3::new(0.8f64.powi(k), 0.5f64.powi(k), 0.2f64.powi(k))).sum::<DVec3>();
    for (texts, tolerance) in [
        (vec!["recursion_depth=2", "diffuse_reflections=5", "photons_from_light=300"], 1e-3),
        (vec!["recursion_depth=2", "scattering=roulette", "photons_from_light=20000"], 2e-2),
        (vec!["recursion_depth=1", "snowball_size=4", "photons_from_light=500"], 1e-3),
        (vec!["recursion_depth=1", "store_direct_light=false", "photons_from_light=500"], 1e-3),
    ] {
        let s = settings(&scene, &[&texts[..], &["mesh_refinement=0", "accumulation_frames=3"]].concat());
        let depth = s.recursion_depth as i32;
        let expected = flux * (series(depth) - if s.store_direct_light { DVec3::ZERO } else { DVec3::ONE });
        let split = s.scattering == Scattering::Splitting;
        let mut e = Engine::new(&scene, s);
        (0..4).for_each(|_| e.step(0.0, &scene.camera));
        assert_eq!(e.report().photon_rays_lost, 0);
        let sum: DVec3 = e.map().photons().iter().map(|p| p.power.as_dvec3()).sum::<DVec3>() / 3.0;
        assert!(((sum - expected) / expected).abs().max_element() < tolerance, "{texts:?}: {sum} {expected}");
        if split {
            // A closed room stores all that figure 4.3 foresees.
            assert_eq!(e.map().photons().len() as u64, photon_count(e.settings()));
        }
    }
}

/// A point light over a plane: `E = Φ cos θ/(4π r²)`, by every search and area, within the noise of so many photons.
#[test]
fn irradiance_is_that_of_the_closed_form() {
    let scene = Arc::new(open("plane").expect("built in"));
    let (light, power) = match scene.lights[0] {
        Light::Point { position, power } => (position, power),
        _ => panic!("a point light"),
    };
    let plane = scene.geometry.positions[0].y;
    let below = Vec3::new(light.x, plane, light.z);
    let height = light.y - plane;
    for texts in [
        &["search=sphere"][..],
        &["search=cylinder"],
        &["search=ellipsoid"],
        &["sphere_slice=false"],
        &["area=hull"],
        &["area=aligned_box", "tolerance"],
        &["radius_heuristic=true"],
        &["light_distribution=spiral"],
        &["light_distribution=stratified"],
        &["light_distribution=saff_kuijlaars"],
        &["light_distribution=explicit"],
        &["light_distribution=rejection"],
    ] {
        let texts: Vec<&str> = texts.iter().copied().filter(|t| t.contains('=')).collect();
        let mut all = vec![
            "mesh_refinement=0",
            "recursion_depth=0",
            "photons_from_light=40000",
            "accumulation_frames=4",
            "max_search_count=400",
        ];
        all.extend(&texts);
        let mut s = settings(&scene, &all);
        s.max_search_radius = height / 3.0;
        // A box along the axes about points in a disc is 4/π of it.
        let factor = if s.area == Area::AlignedBox { std::f32::consts::FRAC_PI_4 } else { 1.0 };
        let mut e = Engine::new(&scene, s);
        (0..4).for_each(|_| e.step(0.0, &scene.camera));
        let estimator = e.estimator();
        let (mut sum, mut exact) = (0.0, 0.0);
        let mut scratch = Default::default();
        for i in 0..40 {
            let turn = i as f32 * 2.4;
            let at = below + Vec3::new(turn.cos(), 0.0, turn.sin()) * (height * 0.5 * (i as f32 / 40.0));
            let r2 = (light - at).length_squared();
            exact += power.x * (height / r2.sqrt()) / (4.0 * std::f32::consts::PI * r2) * factor;
            sum += estimator.direct_gathering(at, Vec3::Y, &mut scratch).irradiance.x;
        }
        assert!((sum / exact - 1.0).abs() < 0.04, "{texts:?}: {}", sum / exact);
    }
}

/// Reflections by every distribution keep the mean irradiance of a box's walls, few directions at a time too.
#[test]
fn every_distribution_of_reflections_is_free_of_bias() {
    let scene = Arc::new(open("cornell").expect("built in"));
    let power_on_walls = |kind: &str, children: &str| {
        let texts =
            ["mesh_refinement=0", "accumulation_frames=2", "photons_from_light=6000", "store_direct_light=false"];
        let s = settings(&scene, &[&texts[..], &[kind, children]].concat());
        let mut e = Engine::new(&scene, s);
        (0..2).for_each(|_| e.step(0.0, &scene.camera));
        // Power by the height at which it arrives, in thirds.
        let mut sums = [0.0f64; 3];
        for p in e.map().photons() {
            let at = ((p.position.y + 1.0) * 1.5).clamp(0.0, 2.9) as usize;
            sums[at] += f64::from(p.power.x);
        }
        sums
    };
    let expected = power_on_walls("diffuse_distribution=explicit", "diffuse_reflections=16");
    for kind in ["rejection", "saff_kuijlaars", "spiral", "stratified", "sobol"] {
        for children in ["diffuse_reflections=1", "diffuse_reflections=3"] {
            let found = power_on_walls(&format!("diffuse_distribution={kind}"), children);
            for (a, b) in found.iter().zip(expected) {
                assert!((a / b - 1.0).abs() < 0.04, "{kind} {children}: {found:?} {expected:?}");
            }
        }
    }
}

/// The radius of eq. 3.7, and that a place without photons is dark.
#[test]
fn searches_reach_as_far_as_they_should() {
    let mut e =
        engine("rooms", &["mesh_refinement=0", "radius_heuristic=true", "radius_alpha=0.5", "max_search_count=20"]);
    e.step(0.0, &e.scene().camera.clone());
    let map = e.map();
    let center = map
        .photons()
        .iter()
        .fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(l, h), p| (l.min(p.position), h.max(p.position)));
    let center = center.0.midpoint(center.1);
    let all = map.photons().iter().map(|p| p.position.distance(center)).fold(0.0, f32::max);
    let expected = (20.0 * all * all / (0.5 * map.photons().len() as f32)).sqrt();
    assert!((e.estimator().radius() / expected - 1.0).abs() < 1e-4);
    let far = e.estimator().direct_gathering(Vec3::splat(500.0), Vec3::Y, &mut Default::default());
    assert_eq!((far.irradiance, far.count), (Rgb::ZERO, 0));
}

/// Final gathering in a closed room of one reflectance: each bounce adds what it should in the mean over the room.
#[test]
fn final_gathering_sees_one_bounce_more() {
    let scene = {
        let mut s = open("rooms").expect("built in");
        s.motions.clear();
        for m in &mut s.materials {
            *m = crate::scene::Material::Diffuse { reflectance: Rgb::splat(0.6), texture: None };
        }
        Arc::new(s)
    };
    let common = [
        "mesh_refinement=3000",
        "photons_from_light=8000",
        "diffuse_reflections=2",
        "accumulation_frames=2",
        "area=hull",
    ];
    let mean = |texts: &[&str]| {
        let s = settings(&scene, &[&common[..], texts].concat());
        let mut e = Engine::new(&scene, s);
        (0..2).for_each(|_| e.step(0.0, &scene.camera));
        // By area: the irradiance of all surfaces is the power that arrives.
        let vertices: Vec<(u32, bool)> = (0..e.mesh().vertices.len() as u32).map(|v| (v, false)).collect();
        let irradiance = e.irradiance_at(&vertices);
        let mesh = e.mesh();
        let place = |v: u32| mesh.vertices[v as usize].position;
        mesh.triangles
            .iter()
            .map(|t| {
                let [a, b, c] = t.map(place);
                let area = f64::from((b - a).cross(c - a).length()) / 2.0;
                area * t.iter().map(|&v| f64::from(irradiance[v as usize].x)).sum::<f64>() / 3.0
            })
            .sum::<f64>()
    };
    let gathered = mean(&["final_gathering=true", "final_gathering_rays=16", "recursion_depth=0"]);
    let traced = mean(&["recursion_depth=1", "store_direct_light=false"]);
    assert!((gathered / traced - 1.0).abs() < 0.05, "{gathered} {traced}");
}

/// A camera that moves, a flashlight that moves with it, and a picture of one pixel.
#[test]
fn odd_views_are_drawn() {
    let mut e = engine(
        "rooms",
        &[
            "mesh_refinement=200",
            "flashlight=true",
            "photons_from_light=500",
            "cull_back_faces=true",
            "blending=offset",
        ],
    );
    let mut camera = e.scene().camera;
    for i in 0..5 {
        e.step(0.1 * f64::from(i), &camera);
        let image = e.draw(&camera, [1, 1], 0.5);
        assert!(image.pixels[0].is_finite());
        let wide = e.draw(&camera, [33, 1], 0.5);
        assert!(wide.pixels.iter().all(|p| p.is_finite()));
        camera = Camera { position: camera.position + Vec3::X * 3.0, ..camera };
    }
    assert!(
        matches!(e.lights()[0], Light::Spot { position, .. } if (position - camera.position + Vec3::X * 3.0).length() < 1.0)
    );
}
