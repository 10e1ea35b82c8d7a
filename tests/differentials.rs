//! Photon footprints against finite differences of rays traced through real scenes.

#![allow(clippy::expect_used, missing_docs, reason = "a failed expectation is how this program reports")]

use cusp::math::frame::tangents;
use cusp::scene::{Material, Scene, open};
use cusp::trace::scatter::{reflected, refracted, specular_weights};
use cusp::trace::{Differential, Intersector, Ray, Surface};
use glam::Vec3;

/// Follows a ray by mirror or refraction to the first diffuse surface: where, by which primitives, with what footprint.
fn follow(scene: &Scene, intersector: &Intersector, ray: Ray, d: Differential) -> Option<(Vec3, Vec<u32>, [Vec3; 2])> {
    let (mut ray, mut d) = (ray, d);
    let mut primitives = Vec::new();
    for _ in 0..8 {
        let hit = intersector.closest(&ray)?;
        let surface = Surface::new(scene, &ray, &hit);
        primitives.push(surface.primitive);
        d = d.transfer(ray.direction, surface.normal, hit.t);
        let material = &scene.materials[surface.material as usize];
        let weights = match material {
            Material::Diffuse { .. } => return Some((surface.position, primitives, d.dp)),
            m => specular_weights(m, &surface, ray.direction)?,
        };
        let next = if weights.refracted.x > 0.0 {
            refracted(scene, &surface, ray.direction, &d, weights.eta)
        } else {
            reflected(scene, &surface, ray.direction, &d)
        };
        d = next.differential;
        ray = Ray { origin: surface.leave(scene, next.direction), direction: next.direction };
    }
    None
}

fn check(name: &str, origin: Vec3, target: impl Fn(u32) -> Vec3, least: usize) {
    let scene = open(name).expect("built in");
    let intersector = Intersector::new(&scene.geometry, scene.radius);
    let local = scene.origin.as_vec3();
    let mut checked = 0;
    for i in 0..200 {
        let o = origin - local;
        let v = (target(i) - origin).normalize();
        let (t, b) = tangents(v);
        let d = Differential { dp: [Vec3::ZERO; 2], dv: [t, b] };
        let start = |w: Vec3| Ray { origin: o, direction: w.normalize() };
        let Some((_, path, dq)) = follow(&scene, &intersector, start(v), d) else { continue };
        if path.len() < 2 {
            continue;
        }
        let h = 2e-4;
        for (axis, column) in [t, b].into_iter().zip(dq) {
            let end = |s: f32| follow(&scene, &intersector, start(v + axis * s), Differential::default());
            let (Some(p), Some(m)) = (end(h), end(-h)) else { continue };
            // Only neighbours on the same facets are differentiable.
            if p.1 != path || m.1 != path {
                continue;
            }
            let finite = (p.0 - m.0) / (2.0 * h);
            let error = (finite - column).length();
            assert!(error < 0.03 * column.length() + 0.02, "{name} {i}: {finite} {column}");
            checked += 1;
        }
    }
    assert!(checked >= least, "{name}: only {checked}");
}

#[test]
fn footprints_of_the_rings_caustic_match_traced_neighbours() {
    let around = |i: u32| {
        let a = i as f32 * 0.0314;
        Vec3::new(a.cos(), 0.1 + 0.3 * ((i * 7 % 10) as f32 / 10.0), a.sin())
    };
    check("ring", Vec3::new(-2.5, 2.2, -1.2), around, 100);
}

#[test]
fn footprints_through_the_glass_ball_match_traced_neighbours() {
    let disc = |i: u32| {
        let (r, a) = (0.33 * (i as f32 / 200.0).sqrt(), i as f32 * 2.4);
        Vec3::new(0.2 + r * a.cos(), 0.5 + r * a.sin(), -0.1)
    };
    check("glass_ball", Vec3::new(1.2, 2.6, 1.0), disc, 200);
}

#[test]
fn footprints_through_the_flat_prism_match_traced_neighbours() {
    let spots = |i: u32| Vec3::new(-0.2 + 0.4 * (i % 20) as f32 / 20.0, 0.2 + 0.3 * (i / 20) as f32 / 10.0, 0.1);
    check("prism_wall", Vec3::new(-1.6, 1.5, 1.7), spots, 50);
}
