//! Final gathering against closed forms and brute force.

use super::directions::footprint_radius;
use super::gather_ray::{GatherPoint, GatherTracer, NoHit};
use super::*;
use crate::estimate::FinalGathering;
use crate::estimate::registry::final_gatherings;
use crate::math::frame::{cosine_hemisphere, tangents, uniform_sphere};
use crate::math::sequence::{Sampling, Sequence};
use crate::photons::{Photon, StoredPhotons};
use crate::scene::{Material, Scene, open};
use crate::trace::{Differential, Intersector, Ray};
use glam::{DVec3, Vec3};

const METHODS: &str = "classic:rays=400,ray-differentials:rays=400,precomputed:rays=400,\
                       ray-differentials:rays=400,reach=facing,pattern=sobol";

fn settings(text: &str) -> Vec<FinalGathering> {
    final_gatherings(text, 200).expect("valid").into_iter().flatten().collect()
}

/// The room of two lights with all surfaces of one reflectance.
fn grey_room(reflectance: f32) -> Scene {
    let mut scene = open("two_lights").expect("built in");
    for m in &mut scene.materials {
        *m = Material::Diffuse { reflectance: Vec3::splat(reflectance), texture: None };
    }
    scene
}

/// `count` photons spread evenly at random over all surfaces, on their front sides, so that irradiance is 1.
fn even_photons(scene: &Scene, count: u64) -> StoredPhotons {
    let g = &scene.geometry;
    let sequence = Sequence::new(Sampling::Sobol, 3);
    let triangle_area = |i: usize| {
        let [a, b, c] = g.corners(i);
        (b - a).cross(c - a).length() / 2.0
    };
    let mut ends = Vec::new();
    let mut total = 0.0;
    for i in 0..g.triangles.len() {
        total += triangle_area(i);
        ends.push(total);
    }
    for s in &g.spheres {
        total += 4.0 * std::f32::consts::PI * s.radius * s.radius;
        ends.push(total);
    }
    let photons = (0..count).map(|i| {
        let x = sequence.four(i, 0);
        let at = ends.partition_point(|&e| e <= x[0] * total).min(ends.len() - 1);
        let (position, normal) = match g.spheres.get(at.wrapping_sub(g.triangles.len())) {
            Some(s) => {
                let n = uniform_sphere(x[1], x[2]).normalize();
                (s.center + n * s.radius, n)
            }
            None => {
                let [a, b, c] = g.corners(at);
                let root = x[1].sqrt();
                let position = a * (1.0 - root) + b * (root * (1.0 - x[2])) + c * (root * x[2]);
                (position, (b - a).cross(c - a).normalize())
            }
        };
        let power = Vec3::splat(total / count as f32);
        Photon { position, direction: -normal, normal, power, footprint: [Vec3::ZERO; 2] }
    });
    StoredPhotons { global: photons.map(Into::into).collect(), ..Default::default() }
}

fn at(scene: &Scene, x: f64, y: f64, z: f64, normal: Vec3) -> GatherPoint {
    GatherPoint { position: (DVec3::new(x, y, z) - scene.origin).as_vec3(), normal, found_along: -normal }
}

/// In a closed room of irradiance 1 and reflectance ρ every ray brings ρ/π, so that ρ is gathered: in the middle of a wall,
/// beside an edge, in a corner and on the sphere.
#[test]
fn an_even_room_gives_its_reflectance() {
    let scene = grey_room(0.5);
    let intersector = Intersector::new(&scene.geometry, scene.radius);
    let stored = even_photons(&scene, 150_000);
    let all = settings(METHODS);
    let maps = GatherMaps::new(&scene, &stored, &all, 50, 1.0);
    let points = [
        at(&scene, 0.3, 0.0, 2.1, Vec3::Y),
        at(&scene, -1.999, 1.0, 2.0, Vec3::X),
        at(&scene, 1.9, 2.6, 3.9, Vec3::NEG_Y),
        at(&scene, 0.7, 0.8, 0.3, Vec3::Y),
    ];
    let tracer = GatherTracer { scene: &scene, intersector: &intersector, max_depth: 20 };
    for f in &all {
        let gatherer = FinalGatherer::new(tracer, f, &maps);
        for (i, point) in points.iter().enumerate() {
            let mut scratch = GatherScratch::default();
            let got = gatherer.irradiance(point, i as u64, &mut scratch, &mut Unrecorded);
            // k photons are counted over the disc of the k-th: 1/(k - 1) too much, and up to all of it at edges.
            let (low, high) = if f.to_string().starts_with("classic") { (0.40, 0.54) } else { (0.49, 0.51) };
            assert!((low..high).contains(&got.x), "{f} at {i}: {got}");
            assert_eq!(scratch.counts.rays, 400);
            assert_eq!((scratch.counts.open, scratch.counts.unknown), (0, 0), "{f} at {i}");
        }
    }
}

/// The recorder hears of what the sum is made of, and the same seed gives the same bits.
#[test]
fn recorded_rays_add_up() {
    let scene = grey_room(0.7);
    let intersector = Intersector::new(&scene.geometry, scene.radius);
    let stored = even_photons(&scene, 20_000);
    let all = settings("ray-differentials:rays=300,near=0.5");
    let maps = GatherMaps::new(&scene, &stored, &all, 50, 1.0);
    let tracer = GatherTracer { scene: &scene, intersector: &intersector, max_depth: 20 };
    let gatherer = FinalGatherer::new(tracer, &all[0], &maps);
    let point = at(&scene, 1.8, 0.0, 3.0, Vec3::Y);
    let mut rays: Vec<RecordedRay> = Vec::new();
    let mut scratch = GatherScratch::default();
    let heard = gatherer.irradiance(&point, 7, &mut scratch, &mut rays);
    assert_eq!(heard, gatherer.irradiance(&point, 7, &mut GatherScratch::default(), &mut Unrecorded));
    assert_ne!(heard, gatherer.irradiance(&point, 8, &mut GatherScratch::default(), &mut Unrecorded));
    assert_eq!(rays.len(), 300);
    let sum: DVec3 = rays.iter().map(|r| r.contribution.as_dvec3()).sum();
    assert!((sum - heard).abs().max_element() < 1e-6 * heard.x, "{sum} {heard}");
    let pyramid = maps.pyramid(&all[0]).expect("made");
    let mut second = 0;
    for r in &rays {
        let hit = r.hit.expect("a closed room");
        assert_eq!(r.second, hit.distance < 0.5);
        second += u64::from(r.second);
        // The estimates that were heard of make the irradiance.
        if let Used::Footprint(layer) = r.used {
            let estimates = pyramid.layers()[layer].estimates();
            let of = |&(_, i): &(usize, u32)| estimates[i as usize];
            let weight: f64 = r.estimates.iter().map(|e| f64::from(of(e).area)).sum();
            let mean = r.estimates.iter().map(|e| of(e).irradiance.as_dvec3() * f64::from(of(e).area)).sum::<DVec3>();
            assert!((mean / weight - r.irradiance.as_dvec3()).abs().max_element() < 1e-5, "{r:?}");
        }
    }
    assert!(second > 20 && scratch.counts.second == second, "{second}");
    assert_eq!(scratch.counts.rays, 300 + second * 18);
}

/// Columns of a footprint are the finite differences of the hit over the disc of directions.
#[test]
fn footprints_are_finite_differences() {
    let scene = open("two_lights").expect("built in");
    let intersector = Intersector::new(&scene.geometry, scene.radius);
    let tracer = GatherTracer { scene: &scene, intersector: &intersector, max_depth: 20 };
    let origin = at(&scene, 0.0, 1.0, 1.0, Vec3::Y).position;
    let mut checked = 0;
    for i in 0..40 {
        let direction = cosine_hemisphere(Vec3::Z, (i as f32 + 0.5) / 40.0, 0.37 * i as f32);
        let r = footprint_radius(800, direction.z, false);
        let (t, b) = tangents(direction);
        let dv = [t * r, b * r];
        let trace = |direction: Vec3, dv: [Vec3; 2]| {
            tracer.trace(Ray { origin, direction }, Differential { dp: [Vec3::ZERO; 2], dv }, |_| 0.0)
        };
        let hit = trace(direction, dv).expect("a closed room");
        for axis in 0..2 {
            let h = 0.02;
            let beside = |s: f32| trace((direction + dv[axis] * s).normalize(), dv).expect("a closed room");
            let (plus, minus) = (beside(h), beside(-h));
            if plus.normal != hit.normal || minus.normal != hit.normal {
                continue;
            }
            let finite = (plus.position - minus.position) / (2.0 * h);
            assert!((finite - hit.footprint[axis]).length() < 2e-3 * hit.footprint[axis].length(), "{i} {axis}");
            checked += 1;
        }
    }
    assert!(checked > 60, "{checked}");
}

/// Lights that rays meet bring nothing, directly or in a mirror: shadow rays and the caustic map have that light.
#[test]
fn lights_are_not_gathered() {
    let mut scene = open("cornell").expect("built in");
    let up = |scene: &Scene| {
        let origin = (DVec3::new(0.0, 1.0, 0.0) - scene.origin).as_vec3();
        Ray { origin, direction: Vec3::Y }
    };
    let none = Differential::default();
    let end = |scene: &Scene, ray: Ray| {
        let intersector = Intersector::new(&scene.geometry, scene.radius);
        GatherTracer { scene, intersector: &intersector, max_depth: 20 }.trace(ray, none, |_| 0.5).map(|h| h.specular)
    };
    assert_eq!(end(&scene, up(&scene)), Err(NoHit::Light));
    // The floor as a mirror: down, and up to the light.
    let floor = scene.geometry.material(0);
    scene.materials[floor] = Material::Mirror { reflectance: Vec3::ONE };
    let down = Ray { direction: Vec3::NEG_Y, ..up(&scene) };
    assert_eq!(end(&scene, down), Err(NoHit::Light));
    // Beside the light there is the ceiling, which is the same white as the floor here.
    scene.materials[floor] = Material::Diffuse { reflectance: Vec3::ONE, texture: None };
    assert_eq!(end(&scene, down), Ok(0));
}

/// Open space, rooms without a photon, and with one: a defined light, and counts that say what is missing.
#[test]
fn empty_rooms_are_dark_and_say_so() {
    let plane = open("plane").expect("built in");
    let room = grey_room(0.5);
    let stored = even_photons(&room, 100);
    let one = StoredPhotons { global: stored.global[..1].to_vec(), ..Default::default() };
    for f in &settings(METHODS) {
        for (scene, stored, open) in [
            (&plane, StoredPhotons::default(), true),
            (&room, StoredPhotons::default(), false),
            (&room, one.clone(), false),
        ] {
            let intersector = Intersector::new(&scene.geometry, scene.radius);
            let maps = GatherMaps::new(scene, &stored, &[*f], 50, 1.0);
            let tracer = GatherTracer { scene, intersector: &intersector, max_depth: 20 };
            let mut scratch = GatherScratch::default();
            let point = at(scene, 0.3, 0.0, 0.5, Vec3::Y);
            let got = FinalGatherer::new(tracer, f, &maps).irradiance(&point, 1, &mut scratch, &mut Unrecorded);
            assert!(got.is_finite() && got.min_element() >= 0.0, "{f}: {got}");
            let counts = scratch.counts;
            assert_eq!(counts.open, if open { counts.rays } else { 0 }, "{f}");
            if stored.global.is_empty() {
                assert_eq!(got, DVec3::ZERO);
            }
        }
    }
}
