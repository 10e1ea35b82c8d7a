//! The pyramid against brute force, and its flux against that of the photons.

use super::surface_area::SurfaceAreas;
use super::*;
use crate::math::sequence::Sampling;
use crate::math::sequence::Sequence;
use crate::photons::kd_tree::Nearest;
use crate::photons::path::{Flight, PathCounts, PathSettings, Unrecorded};
use crate::photons::{Photon, PhotonKind, StoredPhoton, StoredPhotons, emission};
use crate::scene::{Scene, open};
use crate::trace::Intersector;
use glam::DVec3;
use std::f64::consts::PI;

/// All photons of a scene, traced one by one.
fn traced(scene: &Scene, count: u64) -> StoredPhotons {
    let intersector = Intersector::new(&scene.geometry, scene.radius);
    let settings = PathSettings {
        max_depth: 20,
        direct: true,
        caustic: true,
        global: true,
        projected: false,
        differentials: false,
        spread: Default::default(),
    };
    let mut stored = StoredPhotons::default();
    for share in emission::share_photons(scene, count, &Sequence::new(Sampling::Random, 1)) {
        let sequence = Sequence::new(Sampling::Sobol, 5 + share.light as u64);
        let flight = Flight { scene, intersector: &intersector, settings, sequence };
        for number in 0..share.count {
            let e = emission::emit(scene, &scene.lights[share.light], share.count as f64, sequence.four(number, 0));
            let (counts, out) = (&mut PathCounts::default(), &mut stored);
            flight.trace(number, &e, share.power, share.count, out, counts, &mut Unrecorded);
        }
    }
    stored
}

fn settings(radius: f32, as_published: bool) -> PyramidSettings {
    PyramidSettings { radius, growth: 2.0, as_published, layers: usize::MAX }
}

fn pyramid(scene: &Scene, photons: &GlobalPhotons, settings: &PyramidSettings) -> IrradiancePyramid {
    let mut pyramid = IrradiancePyramid::new(&SurfaceAreas::new(scene), photons, settings);
    pyramid.grow(scene, settings);
    pyramid
}

/// Indices that a plain double loop keeps: none lies within `spacing` of one before it whose normal agrees.
fn apart(places: &[(Vec3, Vec3)], spacing: f32) -> Vec<usize> {
    let mut kept: Vec<usize> = Vec::new();
    for (i, (position, normal)) in places.iter().enumerate() {
        let near = |&j: &usize| {
            let (p, n) = places[j];
            (p - *position).length_squared() <= spacing * spacing && n.dot(*normal) >= SURFACE_AGREEMENT
        };
        if !kept.iter().any(near) {
            kept.push(i);
        }
    }
    kept
}

/// Estimates in an order that does not depend on how they were found.
fn sorted(estimates: &[IrradianceEstimate]) -> Vec<IrradianceEstimate> {
    let mut all = estimates.to_vec();
    all.sort_by_key(|e| (e.position.to_array().map(f32::to_bits), e.normal.to_array().map(f32::to_bits)));
    all
}

/// Every layer as published, estimate by estimate, against double loops in f64.
#[test]
fn layers_are_those_of_brute_force() {
    let scene = open("two_lights").expect("built in");
    let photons = GlobalPhotons::new(&traced(&scene, 1500), &PhotonKind::ALL);
    let radius = 0.4f32;
    let made = pyramid(&scene, &photons, &settings(radius, true));
    assert!(made.layers().len() >= 3, "{}", made.layers().len());

    let all = photons.photons();
    let places: Vec<(Vec3, Vec3)> = all.iter().map(|p| (p.position, p.normal)).collect();
    let first: Vec<IrradianceEstimate> = apart(&places, 0.25 * radius)
        .into_iter()
        .map(|i| {
            let inside = all.iter().filter(|p| {
                p.normal.dot(all[i].normal) >= SURFACE_AGREEMENT
                    && (p.position - all[i].position).length_squared() <= radius * radius
            });
            let sum: DVec3 = inside.map(|p| p.power.as_dvec3()).sum();
            let irradiance = (sum / (PI * f64::from(radius).powi(2))).as_vec3();
            IrradianceEstimate { position: all[i].position, normal: all[i].normal, irradiance, area: 1.0 }
        })
        .collect();
    compare(&first, &made.layers()[0], "first");

    for pair in made.layers().windows(2) {
        let [finer, coarser] = pair else { panic!("two") };
        assert_eq!(coarser.radius(), 2.0 * finer.radius());
        let all = finer.estimates();
        let places: Vec<(Vec3, Vec3)> = all.iter().map(|e| (e.position, e.normal)).collect();
        let expected: Vec<IrradianceEstimate> = apart(&places, 0.75 * finer.radius())
            .into_iter()
            .map(|i| {
                // Wholly inside: |x_i - x_j| < r_i - r_j.
                let inside: Vec<DVec3> = all
                    .iter()
                    .filter(|e| {
                        e.normal.dot(all[i].normal) >= SURFACE_AGREEMENT
                            && (e.position - all[i].position).length() < coarser.radius() - finer.radius()
                    })
                    .map(|e| e.irradiance.as_dvec3())
                    .collect();
                let mean = inside.iter().sum::<DVec3>() / inside.len() as f64;
                IrradianceEstimate { irradiance: mean.as_vec3(), ..all[i] }
            })
            .collect();
        compare(&expected, coarser, "coarser");
    }
}

fn compare(expected: &[IrradianceEstimate], layer: &Layer, which: &str) {
    let (expected, got) = (sorted(expected), sorted(layer.estimates()));
    assert_eq!(expected.len(), got.len(), "{which}");
    for (e, g) in expected.iter().zip(&got) {
        assert_eq!((e.position, e.normal), (g.position, g.normal), "{which}");
        // Sums in another order.
        assert!(
            (e.irradiance - g.irradiance).abs().max_element() <= 1e-5 * e.irradiance.max_element(),
            "{which} {e:?}"
        );
    }
}

/// Irradiance times the area that each estimate stands for, over all estimates, is the flux of the photons: the corrected
/// first layer keeps it, also at edges and where light is rare. As published it is far above.
#[test]
fn the_first_layer_keeps_the_flux() {
    let scene = open("two_lights").expect("built in");
    let photons = GlobalPhotons::new(&traced(&scene, 60_000), &PhotonKind::ALL);
    let flux: DVec3 = photons.photons().iter().map(|p| p.power.as_dvec3()).sum();
    let total = SurfaceAreas::new(&scene).total();
    let mean = |as_published: bool| {
        let made = pyramid(&scene, &photons, &settings(0.1, as_published));
        let means = made.layers().iter().map(|l| {
            let each = l.estimates().iter().map(|e| (e.irradiance.as_dvec3() * f64::from(e.area), f64::from(e.area)));
            let (sum, area) = each.fold((DVec3::ZERO, 0.0), |(s, a), (e, area)| (s + e, a + area));
            (sum / area).x * total / flux.x
        });
        means.collect::<Vec<f64>>()
    };
    let (corrected, published) = (mean(false), mean(true));
    assert!((corrected[0] - 1.0).abs() < 0.02 && (corrected[1] - 1.0).abs() < 0.02, "{corrected:?}");
    assert!(published[0] > 1.2, "{published:?}");
}

/// Photons spread evenly over a plane of irradiance 1, as a lattice: every estimate is 1, also at edges and corners.
#[test]
fn even_light_is_even_to_the_edges() {
    let scene = open("plane").expect("built in");
    let quad = (0..2).map(|i| scene.geometry.corners(i));
    let (low, high) = quad.flatten().fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(l, h), v| (l.min(v), h.max(v)));
    let (size, n) = (high - low, 300);
    let power = size.x * size.z / (n * n) as f32;
    let photon = |i: u32| {
        let at = |k: u32, along: f32| (k as f32 + 0.5) / n as f32 * along;
        Photon {
            position: low + Vec3::new(at(i % n, size.x), 0.0, at(i / n, size.z)),
            direction: Vec3::NEG_Y,
            normal: Vec3::Y,
            power: Vec3::splat(power),
            footprint: [Vec3::ZERO; 2],
        }
    };
    let stored = StoredPhotons { direct: (0..n * n).map(|i| photon(i).into()).collect(), ..Default::default() };
    let photons = GlobalPhotons::new(&stored, &PhotonKind::ALL);
    let radius = size.x / 25.0;
    for layer in pyramid(&scene, &photons, &settings(radius, false)).layers() {
        for e in layer.estimates() {
            assert!((e.irradiance.x - 1.0).abs() < 0.06, "{} at {}: {}", layer.radius(), e.position, e.irradiance.x);
        }
    }
    // As published a corner has a quarter of it.
    let published = pyramid(&scene, &photons, &settings(radius, true));
    let darkest = published.layers()[0].estimates().iter().map(|e| e.irradiance.x).fold(f32::INFINITY, f32::min);
    assert!(darkest < 0.3, "{darkest}");
}

/// The k nearest over their disc in f64, whatever radius the search starts with.
#[test]
fn densities_are_those_of_brute_force() {
    let scene = open("two_lights").expect("built in");
    let photons = GlobalPhotons::new(&traced(&scene, 1000), &PhotonKind::ALL);
    let mut heap = Nearest::new();
    let mut tested = 0;
    for p in photons.photons().iter().step_by(40) {
        let mut near: Vec<(f32, DVec3)> = photons
            .photons()
            .iter()
            .filter(|o| o.normal.dot(p.normal) >= SURFACE_AGREEMENT)
            .map(|o| ((o.position - p.position).length(), o.power.as_dvec3()))
            .collect();
        near.sort_by(|a, b| a.0.total_cmp(&b.0));
        // A side of a box may have met fewer.
        if near.len() < 20 {
            continue;
        }
        tested += 1;
        let sum: DVec3 = near[..20].iter().map(|(_, power)| *power).sum();
        let expected = sum / (PI * f64::from(near[19].0).powi(2));
        for radius in [1e-3f32, 0.3, 50.0] {
            let search = global_photons::Search { k: 20, radius, farthest: 20.0, smallest: 1e-6 };
            let got = photons.irradiance(p.position, p.normal, &search, &mut heap);
            assert!((got - expected).abs().max_element() < 1e-5 * expected.max_element(), "{radius}: {got} {expected}");
        }
    }
    assert!(tested > 40, "{tested}");
}

/// No photon, one photon, all on one triangle or in one point, a first radius of nothing: finite and defined.
#[test]
fn odd_rooms_have_a_pyramid() {
    let scene = open("two_lights").expect("built in");
    let stored = traced(&scene, 400);
    let one = stored.global[0];
    let normal = |p: StoredPhoton| Photon::from(p).normal;
    let first = normal(stored.direct[0]);
    let triangle: Vec<StoredPhoton> = stored.direct.iter().filter(|p| normal(**p) == first).copied().collect();
    let sets = [vec![], vec![one], vec![one; 500], triangle, stored.global];
    for global in sets {
        let count = global.len();
        let stored = StoredPhotons { global, ..Default::default() };
        let photons = GlobalPhotons::new(&stored, &PhotonKind::ALL);
        for radius in [0.0, 1e-30, 0.1, 1e30] {
            for as_published in [false, true] {
                let made = pyramid(&scene, &photons, &settings(radius, as_published));
                assert!(!made.layers().is_empty());
                assert_eq!(made.layers()[0].estimates().is_empty(), count == 0);
                for e in made.layers().iter().flat_map(Layer::estimates) {
                    assert!(e.irradiance.is_finite() && e.irradiance.min_element() >= 0.0 && e.area > 0.0, "{e:?}");
                }
            }
        }
    }
}

/// The layer whose radius is nearest to the footprint, as published to half of it, and none below the first.
#[test]
fn footprints_find_their_layer() {
    let scene = open("two_lights").expect("built in");
    let photons = GlobalPhotons::new(&traced(&scene, 20_000), &PhotonKind::ALL);
    for (as_published, half) in [(true, 1.0), (false, 0.5)] {
        let made = pyramid(&scene, &photons, &settings(0.05, as_published));
        let last = made.layers().len() - 1;
        let cases =
            [(0.10, Some(0)), (0.13, Some(0)), (0.15, Some(1)), (0.2, Some(1)), (0.4, Some(2)), (1e9, Some(last))];
        for (longest, layer) in cases {
            assert_eq!(made.layer_for(longest * half), layer, "{longest} {as_published}");
        }
        assert_eq!(made.layer_for(0.049), None);
        assert_eq!(made.layer_for(f32::NAN), None);
    }
}
