//! The phases of a frame of real-time photon mapping, each beside a baseline that is measured in the same run.

#![allow(clippy::expect_used, missing_docs, reason = "a failed expectation is how this program reports")]

use criterion::{Criterion, criterion_group, criterion_main};
use cusp::photons::kd_tree::Nearest;
use cusp::realtime::estimate::{Estimator, Scratch};
use cusp::realtime::photon_map::PhotonMap;
use cusp::realtime::search::Query;
use cusp::realtime::settings::{Area, Moving, Search, set};
use cusp::realtime::view::View;
use cusp::realtime::world::World;
use cusp::realtime::{Engine, RealtimeSettings};
use cusp::scene::open;
use cusp::scene::scene_file::RealtimeFile;
use std::hint::black_box;
use std::sync::Arc;

fn settings(texts: &[&str]) -> (Arc<cusp::scene::Scene>, RealtimeSettings) {
    let scene = Arc::new(open("rooms").expect("built in"));
    let mut table = RealtimeFile::default();
    texts.iter().for_each(|t| set(&mut table, t).expect(t));
    let s = RealtimeSettings::new(&scene, &table, 1).expect("valid");
    (scene, s)
}

/// 12,800 triangles and 12,800 photons, as in the middle of table 6.1.
const MIDDLE: [&str; 3] = ["mesh_refinement=12440", "photons_from_light=64", "diffuse_reflections=19"];

fn filled(texts: &[&str]) -> Engine {
    let (scene, s) = settings(&[&MIDDLE[..], texts].concat());
    let mut engine = Engine::new(&scene, s);
    for f in 0..10 {
        engine.step(f64::from(f) / 30.0, &scene.camera);
    }
    engine.draw(&scene.camera, [320, 240], 1.0);
    engine
}

/// What each way to follow what moves costs a frame, and what its rays cost.
fn hierarchies(c: &mut Criterion) {
    let mut group = c.benchmark_group("moving_box");
    for (name, moving) in [("rebuilt_each_frame (baseline)", Moving::Rebuild), ("instances", Moving::Instances)] {
        let (scene, s) = settings(&MIDDLE);
        let mut world = World::new(&scene, moving, true);
        let mut time = 0.0;
        group.bench_function(format!("update_{name}"), |b| {
            b.iter(|| {
                time += 0.03;
                world.update(&scene, time)
            });
        });
        let mut engine = Engine::new(&scene, RealtimeSettings { moving, ..s });
        group.bench_function(format!("frame_{name}"), |b| {
            b.iter(|| {
                time += 0.03;
                engine.step(time, &scene.camera);
                black_box(engine.draw(&scene.camera, [320, 240], 1.0));
            });
        });
    }
    group.finish();
}

/// First hits of 320×240 view rays: one by one, and by tiles.
fn first_hits(c: &mut Criterion) {
    let mut group = c.benchmark_group("view_rays_320x240");
    for (name, acceleration) in [("one_by_one_through_all_surfaces", false), ("by_tiles", true)] {
        let (scene, s) = settings(&MIDDLE);
        let world = World::new(&scene, Moving::Instances, acceleration);
        let mesh = cusp::realtime::engine::mesh(&scene, &s);
        let mut view = View::default();
        group.bench_function(name, |b| {
            b.iter(|| {
                view.forget();
                view.update(&scene, &world, &mesh, &scene.camera, [320, 240], false)
            });
        });
    }
    let (scene, _) = settings(&MIDDLE);
    let world = World::new(&scene, Moving::Instances, true);
    let rays = scene.camera.rays([320, 240]);
    group.bench_function("one_by_one_through_the_hierarchy (baseline, hits alone)", |b| {
        b.iter(|| {
            use rayon::prelude::*;
            let hit = |i: &u32| {
                let (direction, _) = rays.ray((i % 320) as f32 + 0.5, (i / 320) as f32 + 0.5, 0.5);
                world.closest(&scene, &cusp::trace::Ray { origin: scene.camera.position, direction }).is_some()
            };
            (0..76_800u32).into_par_iter().with_min_len(320).filter(hit).count()
        });
    });
    group.finish();
}

/// Estimates at all vertices of the mesh, by each search and area; and by trying every photon.
fn estimates(c: &mut Criterion) {
    let engine = filled(&[]);
    let plain = RealtimeSettings { sphere_slice: false, incoming_direction: false, ..engine.settings().clone() };
    let mut scratch = Scratch::default();
    let vertices: Vec<_> = engine.mesh().vertices.iter().step_by(16).copied().collect();
    let mut group = c.benchmark_group("irradiance_473_vertices");
    group.bench_function("every_photon_tried (baseline)", |b| {
        b.iter(|| {
            for v in vertices.iter().step_by(32) {
                let query = Query::new(&plain, v.position, v.normal, plain.max_search_radius);
                black_box(query.exact(engine.map().photons()));
            }
        });
    });
    let with =
        |name: &str, group: &mut criterion::BenchmarkGroup<'_, _>, s: RealtimeSettings, scratch: &mut Scratch| {
            let estimator = Estimator::new(engine.scene(), engine.world(), engine.map(), &s);
            group.bench_function(name, |b| {
                b.iter(|| {
                    for v in &vertices {
                        black_box(estimator.direct_gathering(v.position, v.normal, scratch));
                    }
                });
            });
        };
    with("sphere", &mut group, plain.clone(), &mut scratch);
    let slice = RealtimeSettings { sphere_slice: true, ..plain.clone() };
    with("sphere_slice", &mut group, slice.clone(), &mut scratch);
    with("cylinder", &mut group, RealtimeSettings { search: Search::Cylinder, ..plain.clone() }, &mut scratch);
    with("ellipsoid", &mut group, RealtimeSettings { search: Search::Ellipsoid, ..plain }, &mut scratch);
    for (name, area) in [("hull", Area::Hull), ("circle", Area::Circle), ("ellipse", Area::Ellipse)] {
        with(&format!("sphere_slice_{name}"), &mut group, RealtimeSettings { area, ..slice.clone() }, &mut scratch);
    }
    group.finish();
}

/// Photons of a frame with directions made in advance and made anew; a map balanced; a search in it.
fn photons(c: &mut Criterion) {
    let mut group = c.benchmark_group("photons");
    for (name, coherent) in
        [("directions_made_anew (baseline)", "coherent=false"), ("directions_made_once", "coherent=true")]
    {
        let (scene, s) = settings(&["mesh_refinement=0", "photons_from_light=640", "diffuse_reflections=19", coherent]);
        let world = World::new(&scene, s.moving, true);
        let tracer = cusp::realtime::tracer::Tracer::new(&s, world.lights());
        let mut store = Vec::new();
        let mut frame = 0;
        group.bench_function(format!("trace_12800_{name}"), |b| {
            b.iter(|| {
                store.clear();
                frame += 1;
                tracer.trace(&scene, &world, world.lights(), &s, frame, &mut store)
            });
        });
    }
    let engine = filled(&["photons_from_light=640"]);
    let mut map = PhotonMap::new(10);
    engine.map().frames().iter().for_each(|&f| drop(map.store(f, engine.map().of_frame(f).to_vec())));
    for (name, leaf) in [("balance_128000", 12), ("balance_128000_leaves_of_1 (baseline)", 1)] {
        let s = RealtimeSettings { stop_recursion_size: leaf, ..engine.settings().clone() };
        group.bench_function(name, |b| b.iter(|| map.balance(&s, None)));
    }
    let mut found = Nearest::new();
    let v = engine.mesh().vertices[100];
    let query = Query::new(engine.settings(), v.position, v.normal, engine.settings().max_search_radius);
    group.bench_function("search_of_80", |b| b.iter(|| map.nearest(&query, &mut found)));
    group.finish();
}

criterion_group!(benches, hierarchies, first_hits, estimates, photons);
criterion_main!(benches);
