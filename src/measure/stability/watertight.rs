//! Rays at closed meshes through their edges and vertices, and against every triangle in f64.

use super::case::F32;
use super::oracle::random::Random;
use super::scenes::{MIRROR, mesh, scene};
use super::{Case, Outcome};
use crate::scene::Geometry;
use crate::trace::{Hit, Intersector, Ray, Surface};
use glam::{DVec3, Vec3};
use rayon::prelude::*;
use std::collections::BTreeMap;

/// The group.
pub const CASES: &[Case] = &[
    Case {
        group: "watertight",
        name: "edges-and-vertices",
        what: "rays that leave a closed mesh or enter it unseen: none; distance of ray and hit over the way",
        range: "10⁷ rays from within and without, up to 1e4 radii away; needles, fans of 4096; scales 1e-6 to 1e6",
        oracle: "the mesh is closed around its centre",
        // The distance, the weights and the corners are in f32.
        limit: 2.0 * F32,
        run: edges_and_vertices,
    },
    Case {
        group: "watertight",
        name: "every-triangle",
        what: "distance to the nearest surface, and whether any is nearer; relative error, of 1e-5 of the size at least",
        range: "axis-parallel rays with zeros of both signs, starts on surfaces and 1e4 radii away; scales 1e-6 to 1e6",
        oracle: "all triangles in f64, by planes and edges",
        limit: F32,
        run: every_triangle,
    },
    Case {
        group: "watertight",
        name: "needles",
        what: "distance, normal and place on needles and triangles without area; error over the size of the scene",
        range: "aspect ratios 1 to 1e12, three corners in a line or in a point, offsets to 1e3 of their size",
        oracle: "the plane through the corners, f64",
        limit: 4.0 * F32,
        run: needles,
    },
    Case {
        group: "watertight",
        name: "duplicates",
        what: "of surfaces in one place the first is met, in any order of the hierarchy",
        range: "10 to 50 copies, shuffled; 2000 copies of one triangle; triangles nested to 2⁻¹⁰⁰ of the largest",
        oracle: "the lowest index of equal corners",
        limit: 0.0,
        run: duplicates,
    },
];

/// A mesh that is closed and seen as a whole from its centre, the local origin.
struct Star {
    name: &'static str,
    geometry: Geometry,
    /// Least distance of the surface from the centre.
    thin: f64,
    /// Rays at each scale; fewer where each meets the boxes of thousands of triangles.
    rays: u64,
}

/// The unit sphere as an icosahedron whose triangles are halved `levels` times along each edge.
fn icosphere(levels: u32) -> (Vec<DVec3>, Vec<[u32; 3]>) {
    let g = (1.0 + 5f64.sqrt()) / 2.0;
    let mut points: Vec<DVec3> = [(0, 1), (1, 2), (2, 0)]
        .iter()
        .flat_map(|&(i, j)| {
            [(1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)].map(|(a, b)| {
                let mut p = DVec3::ZERO;
                p[i] = a;
                p[j] = b * g;
                p.normalize()
            })
        })
        .collect();
    // Faces are the triples of corners at the distance of neighbours.
    let edge = (1..12).map(|i| (points[i] - points[0]).length()).fold(f64::MAX, f64::min) * 1.01;
    let near = |i: usize, j: usize| (points[i] - points[j]).length() < edge;
    let mut faces = Vec::new();
    for i in 0..12 {
        for j in i + 1..12 {
            for k in j + 1..12 {
                if near(i, j) && near(j, k) && near(k, i) {
                    let out = (points[j] - points[i]).cross(points[k] - points[i]).dot(points[i]) > 0.0;
                    faces.push(if out { [i as u32, j as u32, k as u32] } else { [i as u32, k as u32, j as u32] });
                }
            }
        }
    }
    for _ in 0..levels {
        let mut middles = BTreeMap::new();
        let mut middle = |i: u32, j: u32, points: &mut Vec<DVec3>| {
            *middles.entry((i.min(j), i.max(j))).or_insert_with(|| {
                points.push((points[i as usize] + points[j as usize]).normalize());
                points.len() as u32 - 1
            })
        };
        faces = faces
            .iter()
            .flat_map(|&[a, b, c]| {
                let (ab, bc, ca) = (middle(a, b, &mut points), middle(b, c, &mut points), middle(c, a, &mut points));
                [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
            })
            .collect();
    }
    (points, faces)
}

/// Two fans of `sides` triangles over one rim.
fn bipyramid(sides: u32) -> (Vec<DVec3>, Vec<[u32; 3]>) {
    let rim = (0..sides).map(|i| {
        let (s, c) = libm::sincos(std::f64::consts::TAU * f64::from(i) / f64::from(sides));
        DVec3::new(c, 0.0, s) * 0.8
    });
    let points: Vec<DVec3> = [DVec3::Y, -DVec3::Y * 0.3].into_iter().chain(rim).collect();
    let faces = (0..sides).flat_map(|i| {
        let (a, b) = (2 + i, 2 + (i + 1) % sides);
        [[0, b, a], [1, a, b]]
    });
    (points, faces.collect())
}

fn stars() -> Vec<Star> {
    let star =
        |name, thin, rays, (points, faces): (Vec<DVec3>, Vec<[u32; 3]>), place: &dyn Fn(usize, DVec3) -> DVec3| {
            let positions = points.iter().enumerate().map(|(i, &p)| place(i, p).as_vec3()).collect();
            Star { name, geometry: mesh(positions, faces), thin, rays }
        };
    let turned = |p: DVec3| {
        let axis = DVec3::new(0.3, 0.8, -0.5).normalize();
        p * 0.6 + axis.cross(p) * 0.8 + axis * (axis.dot(p) * 0.4)
    };
    let (points, faces) = icosphere(0);
    let thrice = faces.iter().flat_map(|f| [*f, [f[1], f[2], f[0]], *f]).collect();
    vec![
        star("sphere", 0.9, 700_000, icosphere(4), &|_, p| p),
        star("thorns", 5e-3, 100_000, icosphere(3), &|i, p| p * Random::new("thorns", i as u64).decade(-2.0, 0.0)),
        star("needle sphere", 5e-5, 200_000, icosphere(1), &|_, p| turned(p * DVec3::new(1.0, 1e-2, 1e-4))),
        star("needle fan", 2e-4, 6_000, bipyramid(1024), &|_, p| turned(p * DVec3::new(1.0, 1.0, 1e-3))),
        star("fan", 0.2, 6_000, bipyramid(4096), &|_, p| p),
        star("tetrahedron", 0.1, 600_000, bipyramid(3), &|_, p| turned(p)),
        star("thrice", 0.7, 450_000, (points, thrice), &|_, p| turned(p)),
    ]
}

/// The same about the same centre, `scale` times as large, and its radius.
fn scaled(star: &Star, scale: f64) -> (Geometry, f32) {
    let positions: Vec<Vec3> = star.geometry.positions.iter().map(|p| (p.as_dvec3() * scale).as_vec3()).collect();
    let radius = positions.iter().map(|p| p.length()).fold(0.0, f32::max);
    (Geometry { positions, ..star.geometry.clone() }, radius)
}

/// Distance between the end of a ray and the place on the triangle that its hit names, f64.
fn apart(g: &Geometry, ray: &Ray, hit: &Hit) -> f64 {
    let [a, b, c] = g.corners(hit.primitive as usize).map(|p| p.as_dvec3());
    let [wb, wc] = hit.weights.map(f64::from);
    let place = a + (b - a) * wb + (c - a) * wc;
    (ray.origin.as_dvec3() + ray.direction.as_dvec3() * f64::from(hit.t) - place).length()
}

fn edges_and_vertices() -> Outcome {
    let scales = [1.0, 1e-6, 0.3e-3, 7e2, 1e6];
    let stars = stars();
    let jobs: Vec<(&Star, f64)> = stars.iter().flat_map(|s| scales.map(|k| (s, k))).collect();
    jobs.iter()
        .map(|(star, scale)| {
            let (g, radius) = scaled(star, *scale);
            let intersector = Intersector::new(&g, radius);
            let one = |mut outcome: Outcome, i: u64| {
                let mut random = Random::new(star.name, i);
                let face = g.triangles[(random.unit() * g.triangles.len() as f64) as usize];
                let [p, q] = [face[0], face[1]].map(|k| g.positions[k as usize]);
                let target = match i % 4 {
                    0 => p,
                    1 => p.lerp(q, 0.5),
                    2 => p.lerp(q, random.unit() as f32),
                    _ => random.direction().as_vec3() * radius,
                };
                let outside = i % 8 >= 4;
                // From within: from the centre or near it. From without: towards the centre, through the target.
                let inner = if i % 4 == 3 { p.lerp(q, 0.7) } else { target };
                let near = inner * if i.is_multiple_of(3) { 0.0 } else { random.range(-0.2, 0.9) as f32 * 1e-2 };
                let (origin, end) = if outside {
                    // As far away as a direction in f32 can be aimed at it from.
                    let farthest = libm::log10(star.thin / (4.0 * F32)).min(4.0);
                    let away = if i.is_multiple_of(3) { random.decade(0.0, farthest) } else { random.range(0.0, 3.0) };
                    (target + target.normalize() * (radius * (1e-3 + away as f32)), Vec3::ZERO)
                } else {
                    (near, target)
                };
                let direction = (end - origin).as_dvec3().normalize().as_vec3();
                let ray = Ray { origin, direction };
                let hit = intersector.closest(&ray);
                let way = if outside { origin.length() } else { f32::INFINITY };
                let leaks = hit.is_none_or(|h| h.t > way * (1.0 + 2.0 * f32::EPSILON));
                outcome.expect(!leaks, || format!("{} × {scale}: {ray:?} leaks at {target}", star.name));
                if let Some(hit) = hit {
                    let size = f64::from(hit.t.max(origin.length()).max(radius));
                    outcome.see(apart(&g, &ray, &hit) / size, || format!("{} × {scale}: {ray:?} {hit:?}", star.name));
                }
                outcome
            };
            let share = star.rays;
            let groups = share.div_ceil(4096);
            (0..groups)
                .into_par_iter()
                .map(|group| {
                    let numbers = group * 4096..((group + 1) * 4096).min(share);
                    numbers.fold(Outcome::default(), one)
                })
                .reduce(Outcome::default, Outcome::and)
        })
        .fold(Outcome::default(), Outcome::and)
}

/// Distance to the plane of a triangle along a ray, and the least of the three weights there, f64 (Möller and Trumbore
/// 1997). None for a ray along the plane.
fn plane(corners: [Vec3; 3], ray: &Ray) -> Option<(f64, f64)> {
    let [a, b, c] = corners.map(|p| p.as_dvec3());
    let (o, d) = (ray.origin.as_dvec3(), ray.direction.as_dvec3());
    let n = (b - a).cross(c - a);
    let across = d.dot(n);
    if across.abs() <= 1e-9 * n.length() {
        return None;
    }
    let t = (a - o).dot(n) / across;
    let p = o + d * t;
    let scale = 1.0 / n.length_squared();
    let weights = [(b, c), (c, a), (a, b)].map(|(q, r)| (r - q).cross(p - q).dot(n) * scale);
    Some((t, weights.into_iter().fold(f64::MAX, f64::min)))
}

fn every_triangle() -> Outcome {
    let scales = [1.0, 1e-6, 0.3e-3, 7e2, 1e6];
    let stars = stars();
    let jobs: Vec<(&Star, f64)> = stars.iter().flat_map(|s| scales.map(|k| (s, k))).collect();
    jobs.par_iter()
        .map(|(star, scale)| {
            let (g, radius) = scaled(star, *scale);
            let intersector = Intersector::new(&g, radius);
            let mut outcome = Outcome::default();
            let rays = (3_000_000 / g.triangles.len() as u64).clamp(200, 1200);
            for i in 0..rays {
                let random = &mut Random::new("every-triangle", i);
                let zero = if i % 2 == 0 { 0.0 } else { -0.0 };
                let direction = match i % 6 {
                    0 | 1 => {
                        let mut d = Vec3::splat(zero);
                        d[(i / 6 % 3) as usize] = if i / 18 % 2 == 0 { 1.0 } else { -1.0 };
                        d
                    }
                    2 => {
                        let mut d = random.direction();
                        d[(i / 6 % 3) as usize] = random.decade(-30.0, -6.0) * if i / 18 % 2 == 0 { 1.0 } else { -1.0 };
                        d.normalize().as_vec3()
                    }
                    3 => {
                        let mut d = random.direction().as_vec3();
                        d[(i / 6 % 3) as usize] = zero;
                        d.normalize()
                    }
                    _ => random.direction().as_vec3(),
                };
                let through = (random.direction() * (f64::from(radius) * random.range(0.0, 0.9))).as_vec3();
                let back = match i % 5 {
                    0 => 0.0,
                    1 => random.decade(0.0, 4.0),
                    2 => -2.0,
                    _ => random.range(-1.0, 3.0),
                };
                let origin = if i % 7 == 0 {
                    // On a face.
                    let [a, b, c] = g.corners((random.unit() * g.triangles.len() as f64) as usize);
                    a + (b - a) * 0.3 + (c - a) * 0.4
                } else {
                    through - direction * (radius * back as f32)
                };
                let ray = Ray { origin, direction };
                // What is met for certain, and what may be by rounding of an edge or of the start.
                let small = f64::from(radius.max(origin.length())) * 1e-7;
                let mut certain = f64::MAX;
                let mut possible = Vec::new();
                for k in 0..g.triangles.len() {
                    match plane(g.corners(k), &ray) {
                        Some((t, least)) if t > -small && least > -1e-9 => {
                            possible.push(t);
                            if t > small && least > 1e-9 {
                                certain = certain.min(t);
                            }
                        }
                        _ => {}
                    }
                }
                let hit = intersector.closest(&ray);
                let place = || format!("{} × {scale}: {ray:?} {hit:?} for {certain:e}", star.name);
                let t = hit.map_or(f64::MAX, |h| f64::from(h.t));
                outcome.expect(t <= certain * (1.0 + F32) + 1e-3 * small, || format!("{} is missed", place()));
                // A start on a face is as exact as its coordinates.
                if let Some(hit) = hit.filter(|_| t > small) {
                    let error = possible.iter().map(|p| (p - t).abs()).fold(f64::MAX, f64::min);
                    outcome.see(error / t.max(100.0 * small), place);
                    let any = |t| intersector.any(&ray, t);
                    outcome.expect(!any(hit.t) && any(hit.t * (1.0 + 2.0 * f32::EPSILON)), || {
                        format!("{}: any says {} {}", place(), any(hit.t), any(hit.t * (1.0 + 2.0 * f32::EPSILON)))
                    });
                } else if hit.is_none() {
                    outcome.expect(!intersector.any(&ray, f32::MAX), || format!("{}: any meets something", place()));
                }
            }
            outcome
        })
        .reduce(Outcome::default, Outcome::and)
}

fn needles() -> Outcome {
    (0..400u64)
        .into_par_iter()
        .map(|number| {
            let mut random = Random::new("needles", number);
            let mut outcome = Outcome::default();
            let offset = random.direction() * if number % 2 == 0 { 0.0 } else { random.decade(0.0, 3.0) };
            let mut positions = Vec::new();
            for i in 0..30 {
                let (x, y) = (random.direction(), random.direction());
                let width = random.decade(-12.0, 0.0);
                let a = offset + random.direction() * 0.2;
                let third = match i % 10 {
                    8 => a + x * random.unit(),
                    9 => a,
                    _ => a + x * random.unit() + y * width,
                };
                let second = if i % 20 == 9 { a } else { a + x };
                positions.extend([a, second, third].map(|p| p.as_vec3()));
            }
            let triangles = (0..30).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
            let radius = positions.iter().map(|p: &Vec3| p.length()).fold(0.0, f32::max);
            let scene = scene(mesh(positions, triangles), MIRROR, radius);
            let g = &scene.geometry;
            let intersector = Intersector::new(g, radius);
            for i in 0..600u64 {
                let [a, b, c] = g.corners((i % 30) as usize);
                let (u, v) = (random.unit() as f32, random.unit() as f32);
                let target = if i % 4 == 0 { a.lerp(b, u) } else { a + (b - a) * (u * (1.0 - v)) + (c - a) * (u * v) };
                let direction = random.direction().as_vec3();
                let ray = Ray { origin: target - direction * random.range(0.1, 2.0) as f32, direction };
                let Some(hit) = intersector.closest(&ray) else {
                    outcome.tried += 1;
                    continue;
                };
                let surface = Surface::new(&scene, &ray, &hit);
                let [wb, wc] = hit.weights;
                let place = || format!("{ray:?} {hit:?} {surface:?}");
                let sound = [wb, wc, 1.0 - wb - wc].iter().all(|w| (-1e-6..=1.000_001).contains(w));
                outcome.expect(sound && hit.t > 0.0, || format!("weights of {}", place()));
                let size = f64::from(radius.max(ray.origin.length()));
                outcome.see(apart(g, &ray, &hit) / size, place);
                let [a, b, c] = g.corners(hit.primitive as usize).map(|p| p.as_dvec3());
                let on = a + (b - a) * f64::from(wb) + (c - a) * f64::from(wc);
                outcome.see((surface.position.as_dvec3() - on).length() / size, place);
                // The side that the f64 normal of the corners has, whatever their area.
                let n = (c - b).cross(a - b);
                let side = if surface.front { 1.0 } else { -1.0 };
                outcome.see((surface.normal.as_dvec3() - n / n.length() * side).length(), place);
                outcome.expect(surface.normal.dot(direction) <= 0.0, place);
            }
            outcome
        })
        .reduce(Outcome::default, Outcome::and)
}

fn duplicates() -> Outcome {
    let (points, faces) = icosphere(1);
    let copies: Vec<Geometry> = (0..6u64)
        .map(|number| {
            let mut random = Random::new("duplicates", number);
            let positions: Vec<Vec3> = points.iter().map(|p| p.as_vec3()).collect();
            let mut all: Vec<[u32; 3]> = match number {
                // One triangle 2000 times, before and behind others.
                0 => [&faces[..], &[faces[7]; 2000], &faces[..]].concat(),
                _ => (0..number * 10).flat_map(|_| faces.iter().copied()).collect(),
            };
            for i in (1..all.len()).rev() {
                all.swap(i, (random.unit() * (i + 1) as f64) as usize);
            }
            mesh(positions, all)
        })
        .collect();
    let nested = {
        let corners = [DVec3::new(1.0, 0.0, 0.3), DVec3::new(-0.7, 0.8, -0.3), DVec3::new(-0.4, -0.9, 0.1)];
        let sizes = (0..300).map(|i| libm::exp2(-f64::from(i / 3)));
        let positions = sizes.flat_map(|s| corners.map(|c| (c * s).as_vec3())).collect();
        mesh(positions, (0..300).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect())
    };
    copies
        .par_iter()
        .chain(rayon::iter::once(&nested))
        .map(|g| {
            // Of those nested, the ones that a direction in f32 can be aimed at.
            let aims = if g.triangles.len() == nested.triangles.len() { 45 } else { g.triangles.len() };
            let mut outcome = Outcome::default();
            let intersector = Intersector::new(g, 1.0);
            let key = |k: usize| g.corners(k).map(|p| p.to_array().map(f32::to_bits));
            let mut first = BTreeMap::new();
            for k in 0..g.triangles.len() {
                first.entry(key(k)).or_insert(k);
            }
            for i in 0..4000 {
                let random = &mut Random::new("duplicate-rays", i);
                let [a, b, c] = g.corners((random.unit() * aims as f64) as usize);
                let target = a.lerp(b, 0.3).lerp(c, 0.1 + 0.8 * random.unit() as f32);
                let origin = (random.direction() * random.range(0.0, 3.0)).as_vec3();
                let ray = Ray { origin, direction: (target - origin).as_dvec3().normalize().as_vec3() };
                if (b - a).cross(c - a).normalize_or_zero().dot(ray.direction).abs() < 0.1 {
                    continue;
                }
                let hit = intersector.closest(&ray);
                outcome.expect(hit.is_some(), || format!("{ray:?} misses {target}"));
                if let Some(hit) = hit {
                    let lowest = first.get(&key(hit.primitive as usize)).copied();
                    outcome.expect(lowest == Some(hit.primitive as usize), || format!("{hit:?} of {lowest:?}"));
                    outcome.finite([f64::from(hit.t)], || format!("{ray:?} {hit:?}"));
                }
            }
            outcome
        })
        .reduce(Outcome::default, Outcome::and)
}
