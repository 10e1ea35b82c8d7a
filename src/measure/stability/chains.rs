//! Chains of reflections and refractions, along which differentials grow exponentially.

use super::oracle::dual::Dual3;
use super::oracle::random::Random;
use super::scenes::{MIRROR, glass, meet, scene, spheres};
use super::{Case, Outcome};
use crate::photons::path::MAX_ANGLE;
use crate::scene::Scene;
use crate::trace::scatter::{SpecularRay, reflected, refracted, specular_weights};
use crate::trace::surface::SELF_INTERSECTION;
use crate::trace::{Differential, Intersector, Ray, Surface};
use glam::{DVec3, Vec3};
use rayon::prelude::*;

/// Smallest cosine to a surface along a chain whose differentials are compared: below it what f32 leaves of unit
/// vectors counts too much.
const LEAST_COSINE: f64 = 0.1;
/// Smallest radius of a sphere here, over that of the scene.
const SMALLEST: f64 = 0.1;

/// What each step of a chain may add to the relative error: rays start a little off the surface, which their
/// differentials do not know, and two unit vectors in f32 meet at the least cosine.
const STEP: f64 = SELF_INTERSECTION as f64 / SMALLEST + 2.0 * f32::EPSILON as f64 / LEAST_COSINE;

/// The group.
pub const CASES: &[Case] = &[
    Case {
        group: "chains",
        name: "concave-mirrors",
        what: "differential after each bounce while it is below its bound; relative error over the bounces so far",
        range: "50 bounces between two concave mirrors, stable resonators from confocal to concentric",
        oracle: "dual numbers through the spheres, f64, along the same rays",
        limit: STEP,
        run: || chains("concave-mirrors", 50, concave),
    },
    Case {
        group: "chains",
        name: "convex-mirrors",
        what: "differential after each bounce while it is below its bound, then bounded, counted and finite",
        range: "50 bounces between convex balls in a hollow ball, until differentials are bounded and on",
        oracle: "dual numbers through the spheres, f64, along the same rays",
        limit: STEP,
        run: || chains("convex-mirrors", 50, convex),
    },
    Case {
        group: "chains",
        name: "glass-balls",
        what: "differential after each refraction while it is below its bound; relative error over those so far",
        range: "30 refractions through 15 balls in a row, stable to unstable, indices 1.1 to 2.4",
        oracle: "dual numbers through the spheres, f64, along the same rays",
        limit: STEP,
        run: || chains("glass-balls", 30, balls),
    },
    Case {
        group: "chains",
        name: "glass-shells",
        what: "differential after each refraction while it is below its bound, then bounded, counted and finite",
        range: "30 refractions through 15 shells in each other, off centre, indices 1.001 to 1.2",
        oracle: "dual numbers through the spheres, f64, along the same rays",
        limit: STEP,
        run: || chains("glass-shells", 30, shells),
    },
];

/// Two mirrors that bulge away from each other: the inside of two balls that overlap.
fn concave(random: &mut Random) -> (Scene, Ray) {
    let apart = random.range(0.05, 0.5);
    let axis = random.direction();
    let centers = [axis * apart, axis * -apart].map(|c| c.as_vec3());
    let g = spheres(centers.map(|c| (c, 1.0)));
    let direction = (axis + random.direction() * 0.3).normalize().as_vec3();
    (scene(g, MIRROR, 1.5), Ray { origin: (random.direction() * 0.1).as_vec3(), direction })
}

/// A mirror ball or more within the inside of another.
fn convex(random: &mut Random) -> (Scene, Ray) {
    let count = 2 + (random.unit() * 4.0) as usize;
    let turn = random.range(0.0, 6.0);
    let balls = (0..count).map(|i| {
        let (s, c) = libm::sincos(turn + std::f64::consts::TAU * i as f64 / count as f64);
        (DVec3::new(c * 0.55, 0.1 * s, s * 0.55).as_vec3(), random.range(SMALLEST, 0.25) as f32)
    });
    let all: Vec<(Vec3, f32)> = std::iter::once((Vec3::ZERO, 1.0)).chain(balls).collect();
    let direction = random.direction().as_vec3();
    (scene(spheres(all), MIRROR, 1.0), Ray { origin: (random.direction() * 0.05).as_vec3(), direction })
}

/// Balls of radius 1 in a row. Of focal length f, they keep a ray between them while they are less than 4f apart.
fn balls(random: &mut Random) -> (Scene, Ray) {
    let ior = random.range(1.1, 2.4);
    let focal = ior / (2.0 * (ior - 1.0));
    let apart = 2.01 + random.range(0.0, 1.1) * (4.0 * focal - 2.01).clamp(0.0, 3.0);
    let axis = random.direction();
    let g = spheres((0..15).map(|i| ((axis * (apart * (f64::from(i) - 7.0))).as_vec3(), 1.0)));
    // A scene of radius 10 at most, for the smallest of its spheres.
    let radius = (apart * 7.0 + 1.0) as f32;
    let off = axis.cross(random.direction()) * random.decade(-5.0, -1.0);
    let origin = (axis * (-apart * 7.0 - 2.0) + off).as_vec3();
    let target = axis * (-apart * 7.0);
    (scene(g, glass(ior as f32), radius), Ray { origin, direction: (target - origin.as_dvec3()).normalize().as_vec3() })
}

/// Shells about nearly one centre, each of glass against the next.
fn shells(random: &mut Random) -> (Scene, Ray) {
    let g = spheres((0..15).map(|i| {
        let center = random.direction() * 0.01;
        (center.as_vec3(), (1.0 - 0.06 * f64::from(i)) as f32)
    }));
    let from = random.direction();
    let target = random.direction() * random.range(0.0, 0.14);
    let direction = (target - from * 2.0).normalize().as_vec3();
    (scene(g, glass(random.range(1.001, 1.2) as f32), 1.0), Ray { origin: (from * 2.0).as_vec3(), direction })
}

/// A differential in f64.
type Exact = [(DVec3, DVec3); 2];

/// One meeting by dual numbers: the footprint, and what leaves in the way of the kernel's `next`.
fn step(scene: &Scene, ray: &Ray, surface: &Surface, exact: &Exact, eta: Option<f64>) -> (Exact, f64) {
    let sphere = scene.geometry.spheres[surface.primitive as usize];
    let (center, radius) = (sphere.center.as_dvec3(), f64::from(sphere.radius));
    let mut cosine = 0.0;
    let next = exact.map(|(dp, dv)| {
        // Of length 1 in first order too: the kernel's rays are not to their last digit those of the step before.
        let v = Dual3 { v: ray.direction.as_dvec3(), d: dv }.normalize();
        let hit = Dual3 { v: ray.origin.as_dvec3(), d: dp }.to_sphere(v, center, radius, !surface.front);
        let n = (hit - Dual3::from(center)).normalize() * (if surface.front { 1.0 } else { -1.0 }).into();
        cosine = -v.v.dot(n.v);
        let w = match eta {
            Some(eta) => v.refracted(n, eta),
            None => v.reflected(n),
        };
        (hit.d, w.d)
    });
    (next, cosine)
}

fn size(d: &Exact) -> f64 {
    d.iter().map(|(p, v)| p.length_squared() + v.length_squared()).sum::<f64>().sqrt()
}

fn chains(name: &'static str, steps: u32, make: fn(&mut Random) -> (Scene, Ray)) -> Outcome {
    (0..30u64)
        .into_par_iter()
        .map(|part| {
            let mut outcome = Outcome::default();
            for number in part * 100..part * 100 + 100 {
                let mut random = Random::new(name, number);
                let (scene, ray) = make(&mut random);
                follow(&scene, ray, steps, random.decade(-6.0, -1.0), &mut outcome);
            }
            outcome
        })
        .reduce(Outcome::default, Outcome::and)
}

fn follow(scene: &Scene, mut ray: Ray, steps: u32, spread: f64, outcome: &mut Outcome) {
    let intersector = Intersector::new(&scene.geometry, scene.radius);
    let (t, b) = ray.direction.as_dvec3().any_orthonormal_pair();
    let mut d = Differential { dp: [Vec3::ZERO; 2], dv: [t, b].map(|c| (c * spread).as_vec3()) };
    let mut exact: Exact = d.dv.map(|c| (DVec3::ZERO, c.as_dvec3()));
    let (mut compared, mut said_once) = (true, false);
    for number in 1..=steps {
        let Some((distance, surface)) = meet(scene, &intersector, &ray) else { return };
        let v = ray.direction;
        d = d.transfer(v, surface.normal, distance);
        let said = d.bound(scene.radius, MAX_ANGLE);
        outcome.bounded += u64::from(said);
        said_once |= said;
        let within = d.dp.iter().all(|c| c.length() <= scene.radius * 1.000_01)
            && d.dv.iter().all(|c| c.length() <= MAX_ANGLE * 1.000_01);
        outcome.expect(within, || format!("step {number} of {ray:?}: {d:?} is longer than its bound"));
        let Some(weights) = specular_weights(&scene.materials[0], &surface, v) else { return };
        let through = weights.refracted.x > 0.0;
        let next: SpecularRay = match through {
            true => refracted(scene, &surface, v, &d, weights.eta),
            false => reflected(scene, &surface, v, &d),
        };
        let eta = through.then_some(f64::from(weights.eta));
        let (carried, cosine) = step(scene, &ray, &surface, &exact, eta);
        let behind = next.direction.dot(surface.normal).abs();
        let endless = carried.iter().any(|(p, _)| p.length() > 1.01 * f64::from(scene.radius));
        outcome.expect(said_once || !compared || !endless, || {
            format!("step {number} of {ray:?}: {carried:?} is bounded and nothing is said")
        });
        compared &= cosine > LEAST_COSINE && f64::from(behind) > LEAST_COSINE && !said_once;
        if compared {
            exact = carried;
        }
        let at = || format!("step {number} of {ray:?}: {:?} for {exact:?}", next.differential);
        if compared {
            let parts = [0, 1].map(|i| {
                let (p, w) = exact[i];
                (next.differential.dp[i].as_dvec3() - p, next.differential.dv[i].as_dvec3() - w)
            });
            outcome.see(size(&parts) / size(&exact) / f64::from(number), at);
        }
        let all = next.differential.dp.into_iter().chain(next.differential.dv);
        outcome.finite(all.flat_map(|c| c.as_dvec3().to_array()), at);
        d = next.differential;
        ray = Ray { origin: next.origin, direction: next.direction };
    }
}
