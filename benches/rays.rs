//! Closest hits and shadow rays on large meshes, beside those of `obvhs` on the same hierarchy.

#![allow(clippy::expect_used, missing_docs, reason = "a failed expectation is how this program reports")]

use cusp::math::frame::{cosine_hemisphere, uniform_sphere};
use cusp::math::sequence::{Sampling, Sequence};
use cusp::scene::Geometry;
use cusp::scene::geometry::NONE;
use cusp::trace::surface::flat_normal;
use cusp::trace::{Intersector, Ray};
use glam::Vec3;
use obvhs::BvhBuildParams;
use obvhs::cwbvh::builder::build_cwbvh_from_tris;
use obvhs::ray::RayHit;
use obvhs::triangle::Triangle;
use std::f32::consts::{PI, TAU};
use std::time::{Duration, Instant};

/// Half the side of the box about the mesh, metres.
const SIDE: f32 = 2.0;
/// Radius of a ball that holds the box.
const RADIUS: f32 = 3.5;

/// A lumpy ball of some `4 rows²` triangles in a closed box.
fn lumpy_ball(rows: u32) -> Geometry {
    let mut g = Geometry::default();
    let columns = 2 * rows;
    for row in 0..=rows {
        for column in 0..columns {
            let (turn, down) = (TAU * column as f32 / columns as f32, PI * (0.01 + 0.98 * row as f32 / rows as f32));
            let d = Vec3::new(down.sin() * turn.cos(), down.cos(), down.sin() * turn.sin());
            let large = (9.0 * d.x).sin() * (8.0 * d.y).sin() * (10.0 * d.z).cos();
            let small = (41.0 * d.x).sin() * (37.0 * d.z).sin() + (53.0 * d.y).cos() * (43.0 * d.x).sin();
            g.positions.push(d * (1.0 + 0.15 * large + 0.03 * small));
        }
    }
    for row in 0..rows {
        for column in 0..columns {
            let at = |r: u32, c: u32| r * columns + c % columns;
            let [a, b, c, d] = [at(row, column), at(row, column + 1), at(row + 1, column + 1), at(row + 1, column)];
            g.triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
    let corner = g.positions.len() as u32;
    g.positions
        .extend((0..8u32).map(|i| Vec3::from([0, 1, 2].map(|axis| if i >> axis & 1 == 0 { -SIDE } else { SIDE }))));
    for [a, b, c, d] in [[0, 1, 3, 2], [4, 5, 7, 6], [0, 1, 5, 4], [2, 3, 7, 6], [0, 2, 6, 4], [1, 3, 7, 5]] {
        g.triangles.extend([[a, b, c], [a, c, d]].map(|t| t.map(|i: u32| corner + i)));
    }
    let count = g.triangles.len();
    g.corner_normals = vec![[NONE; 3]; count];
    g.corner_uvs = vec![[NONE; 3]; count];
    g.triangle_materials = vec![0; count];
    g
}

/// The second to fifth ray of diffuse paths that start in the box.
fn bounces(g: &Geometry, intersector: &Intersector, count: usize) -> Vec<Ray> {
    let sequence = Sequence::new(Sampling::Random, 3);
    let mut rays = Vec::with_capacity(count);
    let mut path = 0;
    while rays.len() < count {
        let (x, y) = (sequence.four(path, 0), sequence.four(path, 1));
        let mut ray = Ray {
            origin: uniform_sphere(x[0], x[1]) * (1.9 * x[2]),
            direction: uniform_sphere(y[0], y[1]).normalize(),
        };
        for bounce in 0..5 {
            if bounce > 0 {
                rays.push(ray);
            }
            let Some(hit) = intersector.closest(&ray) else { break };
            let normal = flat_normal(g.corners(hit.primitive as usize)).as_vec3();
            let normal = if normal.dot(ray.direction) > 0.0 { -normal } else { normal };
            let z = sequence.four(path, 2 + bounce);
            let origin = ray.origin + ray.direction * hit.t + normal * 1e-4;
            ray = Ray { origin, direction: cosine_hemisphere(normal, z[0], z[1]) };
        }
        path += 1;
    }
    rays.truncate(count);
    rays
}

const RAYS: usize = 100_000;
/// Rays that are asked for at a time, as the photon pass does at most.
const WAVEFRONT: usize = 4096;

fn rays() {
    let builders = [("medium", BvhBuildParams::medium_build()), ("very slow", BvhBuildParams::very_slow_build())];
    for (rows, (name, builder)) in [(50, builders[1]), (500, builders[0]), (500, builders[1])] {
        let g = lumpy_ball(rows);
        let count = g.triangles.len();
        let intersector = Intersector::by(&g, RADIUS, builder);
        let rays = bounces(&g, &intersector, RAYS);
        let corner = |t: usize| g.corners(t).map(Into::into);
        let triangles: Vec<Triangle> = (0..count).map(corner).map(|[v0, v1, v2]| Triangle { v0, v1, v2 }).collect();
        let bvh = build_cwbvh_from_tris(&triangles, builder, &mut Duration::default());
        let leaves: Vec<Triangle> = bvh.primitive_indices.iter().map(|&i| triangles[i as usize]).collect();
        let prepared = |r: &Ray| obvhs::ray::Ray::new_inf(r.origin.into(), r.direction.into());

        let theirs = |r: &Ray| {
            let mut hit = RayHit::none();
            bvh.ray_traverse(prepared(r), &mut hit, |ray, leaf| leaves[leaf].intersect(ray))
        };
        let ours = |r: &Ray| intersector.closest(r).is_some();
        let what = format!("{count} triangles, builder {name}");
        in_pairs(&format!("closest, {what}"), &rays, each(theirs), each(ours));
        let together = |rays: &[Ray]| {
            let mut hits = Vec::new();
            let met = |rays: &[Ray]| {
                intersector.closest_of(rays, &mut hits);
                hits.iter().flatten().count()
            };
            rays.chunks(WAVEFRONT).map(met).sum()
        };
        in_pairs(&format!("closest, {WAVEFRONT} at a time, {what}"), &rays, each(theirs), together);
        let theirs = |r: &Ray| {
            let ray = obvhs::ray::Ray { tmax: 1.0, ..prepared(r) };
            bvh.ray_traverse_miss(ray, |ray, leaf| leaves[leaf].intersect(ray))
        };
        let ours = |r: &Ray| !intersector.any(r, 1.0);
        in_pairs(&format!("any within 1 m, {what}"), &rays, each(theirs), each(ours));
    }
}

/// One ray after the other.
fn each(of: impl Fn(&Ray) -> bool) -> impl Fn(&[Ray]) -> usize {
    move |rays| rays.iter().filter(|r| of(r)).count()
}

/// Pairs of runs whose ratio counts.
const PAIRS: usize = 41;

/// Runs both in turn, as what a machine has to give changes by the second: rays in a second of each by its median, and the
/// median ratio of their times with its quartiles.
fn in_pairs(what: &str, rays: &[Ray], theirs: impl Fn(&[Ray]) -> usize, ours: impl Fn(&[Ray]) -> usize) {
    let timed = |of: &dyn Fn(&[Ray]) -> usize| {
        let start = Instant::now();
        std::hint::black_box(of(rays));
        start.elapsed().as_secs_f64()
    };
    // Once for the caches.
    let _ = (timed(&theirs), timed(&ours));
    let mut pairs: Vec<[f64; 3]> = (0..PAIRS)
        .map(|_| {
            let (theirs, ours) = (timed(&theirs), timed(&ours));
            [theirs, ours, theirs / ours]
        })
        .collect();
    let mut quartiles = |i: usize| {
        pairs.sort_by(|a, b| a[i].total_cmp(&b[i]));
        [1, 2, 3].map(|q| pairs[PAIRS * q / 4][i])
    };
    let rate = |seconds: f64| 1e-6 * rays.len() as f64 / seconds;
    let ([_, theirs, _], [_, ours, _], [low, ratio, high]) = (quartiles(0), quartiles(1), quartiles(2));
    println!(
        "{what}: obvhs {:.3} Mrays/s, ours {:.3}, ratio {ratio:.2} ({low:.2} to {high:.2})",
        rate(theirs),
        rate(ours)
    );
}

/// Seconds that each builder takes, and the rays that its hierarchy then takes in a second: medians of runs in turn.
fn builders() {
    let all = [
        ("very fast", BvhBuildParams::very_fast_build()),
        ("fast", BvhBuildParams::fast_build()),
        ("medium", BvhBuildParams::medium_build()),
        ("slow", BvhBuildParams::slow_build()),
        ("very slow", BvhBuildParams::very_slow_build()),
    ];
    for rows in [16, 50, 160, 500] {
        let g = lumpy_ball(rows);
        let count = g.triangles.len();
        let built = all.map(|(_, parameters)| {
            let start = Instant::now();
            let intersector = Intersector::by(&g, RADIUS, parameters);
            (intersector, start.elapsed().as_secs_f64())
        });
        let rays = bounces(&g, &built[0].0, RAYS);
        let mut times = [[0.0; TURNS]; 5];
        for turn in 0..TURNS {
            for (times, (intersector, _)) in times.iter_mut().zip(&built) {
                let start = Instant::now();
                std::hint::black_box(rays.iter().filter(|r| intersector.closest(r).is_some()).count());
                times[turn] = start.elapsed().as_secs_f64() / RAYS as f64;
            }
        }
        for (((name, _), (_, build)), times) in all.iter().zip(&built).zip(&mut times) {
            times.sort_by(f64::total_cmp);
            let [low, median, high] = [1, 2, 3].map(|q| 1e-6 / times[TURNS - 1 - TURNS * q / 4]);
            println!(
                "{count} triangles, {name}: built in {build:.4} s, {median:.3} Mrays/s ({low:.3} to {high:.3}), {:.1} rays \
                 each by which it is built",
                build * median * 1e6 / count as f64
            );
        }
    }
}

/// Runs of each builder's hierarchy in turn.
const TURNS: usize = 21;

fn main() {
    rays();
    builders();
}
