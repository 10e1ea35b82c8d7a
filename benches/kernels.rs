//! The hot paths, each beside a baseline that is measured in the same run.

#![allow(clippy::expect_used, missing_docs, reason = "a failed expectation is how this program reports")]

use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};
use cusp::estimate::parallelogram::mean_over_parallelogram;
use cusp::estimate::polygon::integral_over_polygon;
use cusp::estimate::registry::{estimator, estimators};
use cusp::estimate::{Estimator, Gathered, View};
use cusp::math::angle::angle;
use cusp::math::sequence::{Sampling, Sequence};
use cusp::photons::irradiance::surface_area::SurfaceAreas;
use cusp::photons::irradiance::{GlobalPhotons, IrradiancePyramid, PyramidSettings};
use cusp::photons::kd_tree::Nearest;
use cusp::photons::map::{FootprintLimits, MapParts, Query};
use cusp::photons::together::{TOGETHER, Together};
use cusp::photons::{PhotonKind, PhotonMap, StoredPhoton};
use cusp::render::Silent;
use cusp::render::film::{Film, Rect};
use cusp::render::plan::Slot;
use cusp::render::{RenderSettings, Renderer};
use cusp::scene::open;
use cusp::scene::scene_file::RenderFile;
use cusp::trace::Ray;
use glam::{DVec2, DVec3, Vec3};
use std::hint::black_box;

/// The caustic photons of the ring and a grid of view hits inside it.
fn ring() -> (Vec<StoredPhoton>, Vec<View>) {
    let scene = open("ring").expect("built in");
    let flags = RenderFile { photons: Some(450_000), projection_map: Some("off".into()), ..Default::default() };
    let settings = RenderSettings::new(&scene, &flags, Some([64, 64]), 1).expect("valid");
    let mut renderer = Renderer::new(scene.into(), settings, vec![estimator("integrated").expect("registered")]);
    renderer.step(&Silent);
    let photons = renderer.last_pass().expect("one pass").photons.stored.caustic.clone();
    let views = (0..64)
        .flat_map(|i| (0..64).map(move |j| (i as f32 / 32.0 - 1.0, j as f32 / 32.0 - 1.0)))
        .map(|(x, z)| View {
            query: Query { center: Vec3::new(x, -0.25, z), normal: Vec3::Y, axes: [Vec3::X * 0.004, Vec3::Z * 0.006] },
            direction: Vec3::new(0.1, -0.7, -0.7).normalize(),
        })
        .collect();
    (photons, views)
}

fn gather_and_estimate(c: &mut Criterion) {
    let (photons, views) = ring();
    let limits = FootprintLimits { scale: 3.0, floor: 1e-6, ceiling: 10.0 };
    let map = PhotonMap::new(&photons, limits, MapParts { kd_tree: true, overlap: true });
    let mut heap = Nearest::new();
    let mut found = Vec::new();
    let mut group = c.benchmark_group("gather_4096_hits");
    group.bench_function("brute_force_point (baseline)", |b| {
        b.iter(|| {
            found.clear();
            for v in views.iter().step_by(64) {
                for (i, p) in map.photons().iter().enumerate() {
                    if p.to_filter(v.query.center - p.position).length_squared() < 1.0 && p.lights(v.query.normal) {
                        found.push(i as u32);
                    }
                }
            }
            found.len()
        });
    });
    group.bench_function("overlap_point", |b| {
        b.iter(|| {
            found.clear();
            views.iter().for_each(|v| map.overlapping_point(&v.query, &mut found));
            found.len()
        });
    });
    group.bench_function("overlap_parallelogram", |b| {
        b.iter(|| {
            found.clear();
            views.iter().for_each(|v| map.overlapping_parallelogram(&v.query, &mut found));
            found.len()
        });
    });
    group.bench_function("overlap_parallelogram_together", |b| {
        let mut together = Together::default();
        b.iter(|| {
            found.clear();
            for near in views.chunks(TOGETHER) {
                map.parallelograms_together(0, near.iter().map(|v| v.query), &mut together);
                for (i, v) in near.iter().enumerate() {
                    match together.of(i) {
                        Some(own) => found.extend_from_slice(own),
                        None => map.overlapping_parallelogram(&v.query, &mut found),
                    }
                }
            }
            found.len()
        });
    });
    group.bench_function("knn_50", |b| {
        b.iter(|| {
            found.clear();
            views.iter().for_each(|v| map.nearest(&v.query, 50, &mut heap, &mut found));
            found.len()
        });
    });
    group.finish();

    let lists: Vec<Vec<u32>> = views
        .iter()
        .map(|v| {
            let mut list = Vec::new();
            map.nearest(&v.query, 50, &mut heap, &mut list);
            list
        })
        .collect();
    let mut group = c.benchmark_group("estimate_4096_hits_knn_50");
    for name in ["regular", "coplanar", "multi_sampled:n=8", "multi_sampled:n=16", "integrated"] {
        let e: Box<dyn Estimator> = estimator(name).expect("registered");
        group.bench_function(BenchmarkId::from_parameter(name), |b| {
            b.iter(|| {
                let mut sum = DVec3::ZERO;
                for (v, indices) in views.iter().zip(&lists) {
                    sum += e.irradiance(&Gathered { photons: map.photons(), indices, radius: 0.0 }, v);
                }
                sum
            });
        });
    }
    group.finish();
}

fn polygon(c: &mut Criterion) {
    let sequence = Sequence::new(Sampling::Random, 1);
    let cases: Vec<[Vec3; 3]> = (0..1000)
        .map(|i| {
            let v = |s| Vec3::from_slice(&sequence.four(i, s)[..3]) * 2.0 - 1.0;
            [v(0) * 1.5, v(1), v(2)]
        })
        .collect();
    // Photons on a floor that are smaller than the pixel, as dense caustics have them.
    let small: Vec<[Vec3; 3]> = (0..1000)
        .map(|i| {
            let x = sequence.four(i, 9);
            let reach = 1.0 + 10.0 * x[3];
            let in_plane = |v: Vec3| Vec3::new(v.x, v.y, 0.0) * reach;
            let v = |s| Vec3::from_slice(&sequence.four(i, s)[..3]) * 2.0 - 1.0;
            [in_plane(v(0)), in_plane(v(1)), in_plane(v(2))]
        })
        .collect();
    let eight = cusp::estimate::multi_sampled::MultiSampled::new(8, cusp::estimate::multi_sampled::Grid::Cells);
    for (name, cases) in [("of_all_sizes", &cases), ("larger_than_photons", &small)] {
        let mut group = c.benchmark_group(format!("mean_over_1000_parallelograms_{name}"));
        group.bench_function("closed_form", |b| {
            b.iter(|| cases.iter().map(|[c, u, v]| mean_over_parallelogram(*c, *u, *v)).sum::<f64>());
        });
        group.bench_function("general_polygon (baseline)", |b| {
            b.iter(|| {
                let plane = |v: Vec3| v.truncate().as_dvec2();
                let integral = |[c, u, v]: &[Vec3; 3]| {
                    let (c, u, v) = (plane(*c), plane(*u), plane(*v));
                    integral_over_polygon(&[c - u - v, c + u - v, c + u + v, c - u + v])
                };
                cases.iter().map(integral).sum::<f64>()
            });
        });
        group.bench_function("8x8_points (baseline)", |b| {
            b.iter(|| cases.iter().map(|[c, u, v]| eight.mean(*c, *u, *v)).sum::<f64>());
        });
        group.finish();
    }
    let vectors: Vec<DVec2> = cases.iter().map(|[c, ..]| c.truncate().as_dvec2()).collect();
    let mut group = c.benchmark_group("angles_of_1000_vectors");
    group.bench_function("angle", |b| b.iter(|| vectors.iter().map(|v| angle(*v)).sum::<f64>()));
    group.bench_function("libm::atan2 (baseline)", |b| {
        b.iter(|| vectors.iter().map(|v| libm::atan2(v.y, v.x)).sum::<f64>());
    });
    group.finish();
}

fn tracing(c: &mut Criterion) {
    let mut group = c.benchmark_group("trace");
    group.sample_size(20);
    for name in ["ring", "cornell", "glass_sphere"] {
        let scene = open(name).expect("built in");
        let flags = RenderFile { photons: Some(100_000), ..Default::default() };
        let settings = RenderSettings::new(&scene, &flags, Some([128, 128]), 1).expect("valid");
        let renderer = Renderer::new(scene.into(), settings, vec![estimator("integrated").expect("registered")]);
        let one = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a pool");
        group.bench_function(BenchmarkId::new("100000_photons_one_thread", name), |b| {
            b.iter(|| one.install(|| renderer.emitter(renderer.plan(), renderer.settings()).run(0, &|| false).emitted));
        });
        let scene = renderer.scene();
        let sequence = Sequence::new(Sampling::Random, 2);
        let rays: Vec<Ray> = (0..10_000)
            .map(|i| {
                let x = sequence.four(i, 0);
                let direction = cusp::math::frame::uniform_sphere(x[0], x[1]).normalize();
                Ray { origin: Vec3::Y * (0.2 * scene.radius), direction }
            })
            .collect();
        group.bench_function(BenchmarkId::new("10000_closest_hits", name), |b| {
            b.iter(|| rays.iter().filter(|r| renderer.intersector().closest(black_box(r)).is_some()).count());
        });
    }
    group.finish();
}

/// What the error estimate adds to a pass, over 16 passes with their four groups, which is where groups are densest.
fn film(c: &mut Criterion) {
    let size = [512, 512];
    let scene = open("ring").expect("built in");
    let settings = RenderSettings::new(&scene, &RenderFile::default(), Some(size), 1).expect("valid");
    let mut renderer = Renderer::new(scene.into(), settings, vec![estimator("integrated").expect("registered")]);
    let mut group = c.benchmark_group("film_512x512");
    group.sample_size(10);
    group.bench_function("16_passes_of_ring (baseline)", |b| {
        b.iter(|| (0..16).for_each(|_| _ = renderer.step(&Silent)));
    });
    let image = renderer.films()[0].image();
    let passes = |estimated: bool| {
        let mut film = Film::new(size);
        for i in 0..16 {
            film.add_tile([0, 0], size[0], &image.pixels);
            if estimated {
                film.finish_pass(1.0 / f64::from(i + 1));
            }
        }
        film
    };
    group.bench_function("sums_of_16_passes", |b| b.iter(|| passes(false)));
    group.bench_function("sums_of_16_passes_and_groups", |b| b.iter(|| passes(true)));
    let film = passes(true);
    group.bench_function("one_error_estimate", |b| b.iter(|| film.error_estimate(Rect::whole(size), None)));
    group.finish();
}

/// 64 points with 200 gather rays each, by what is looked up at their ends, and what the look-ups are built in.
fn final_gathering(c: &mut Criterion) {
    let scene = open("two_lights").expect("built in");
    let flags = RenderFile { photons: Some(200_000), ..Default::default() };
    let settings = RenderSettings::new(&scene, &flags, Some([8, 8]), 1).expect("valid");
    let list = "integrated+classic:rays=200,integrated+precomputed:rays=200,integrated+ray-differentials:rays=200";
    let mut renderer = Renderer::new(scene.into(), settings, estimators(list).expect("registered"));
    renderer.step(&Silent);
    let pass = renderer.last_pass().expect("one pass");
    let one = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a pool");
    let mut group = c.benchmark_group("final_gathering");
    group.sample_size(10);
    for (name, estimator) in
        ["classic (baseline)", "precomputed", "ray_differentials"].iter().zip(renderer.estimators())
    {
        let slot = Slot::new(estimator.as_ref(), pass.settings.gather);
        group.bench_function(format!("64_points_200_rays/{name}"), |b| {
            b.iter(|| one.install(|| pass.view().run(Rect::whole([8, 8]), &[slot], &Silent).wall));
        });
    }
    let photons = &pass.photons.stored;
    group.bench_function("build/tree_over_photons (baseline)", |b| {
        b.iter(|| GlobalPhotons::new(photons, &PhotonKind::ALL).photons().len());
    });
    for (name, as_published) in [("pyramid", false), ("pyramid_as_published", true)] {
        let tree = GlobalPhotons::new(photons, &PhotonKind::ALL);
        let settings = PyramidSettings { radius: 0.08, growth: 2.0, as_published, layers: usize::MAX };
        group.bench_function(format!("build/{name}"), |b| {
            b.iter(|| {
                let mut pyramid = IrradiancePyramid::new(&SurfaceAreas::new(&pass.scene), &tree, &settings);
                pyramid.grow(&pass.scene, &settings);
                pyramid.layers().len()
            });
        });
    }
    group.finish();
}

criterion_group!(benches, gather_and_estimate, polygon, tracing, film, final_gathering);
criterion_main!(benches);
