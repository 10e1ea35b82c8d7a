//! Few photons and many: none, one, a million in one point, all in a line or in a plane.

use super::oracle::random::Random;
use super::setup::{ALL, BEAM, built_in, finite_films, outcome, rendered, scene};
use super::{Case, Outcome};
use crate::estimate::Gathered;
use crate::math::rgb::Rgb;
use crate::photons::kd_tree::Nearest;
use crate::photons::map::{FootprintLimits, MapParts, Query};
use crate::photons::{Photon, PhotonMap};
use crate::render::film::Rect;
use crate::render::plan::Slot;
use crate::render::settings::{DirectLight, Gather, LightPart};
use glam::Vec3;
use rayon::prelude::*;
use std::f64::consts::PI;
use std::sync::Arc;

/// The group.
pub const CASES: &[Case] = &[
    Case {
        group: "counts",
        name: "few-photons",
        what: "irradiance at every hit under every estimator and gather; relative error",
        range: "0, 1, 2 and 3 photons, k from 1 to 1,000,000",
        oracle: "the sum over all photons of the map",
        limit: 1e-12,
        run: few_photons,
    },
    Case {
        group: "counts",
        name: "crowded-maps",
        what: "photons that knn and overlap find; relative difference of what is found and what is there",
        range: "20,000 photons in a point, in a line, in a plane, in two heaps, coordinates that repeat",
        oracle: "brute force, f64",
        limit: 0.0,
        run: crowded_maps,
    },
    Case {
        group: "counts",
        name: "one-point",
        what: "radiance of the pixel that holds all light of a beam; relative error",
        range: "1,000,000 photons within 1e-7 of the floor's size",
        oracle: "flux over the pixel's area on the floor, closed form",
        limit: 1e-4,
        run: one_point,
    },
];

fn few_photons() -> Outcome {
    outcome(|out| {
        let scene = Arc::new(built_in("plane")?);
        for (photons, depth) in [(1, 2), (2, 2), (3, 2), (1, 0)] {
            for (gather, k) in [(Gather::Knn, 1), (Gather::Knn, 50), (Gather::Knn, 1_000_000), (Gather::Overlap, 50)] {
                let r = rendered(&scene, [12, 12], ALL, 2, |s| {
                    (s.photons, s.k, s.gather, s.direct) = (photons, k, gather, DirectLight::Photons);
                    // None is caustic on a bare floor: an empty map.
                    s.light = if depth == 0 { LightPart::Caustic } else { LightPart::All };
                })?;
                finite_films(&r, out);
                let Some(pass) = r.last_pass() else { return Err("no pass".into()) };
                let view = pass.view();
                for e in r.estimators() {
                    let slot = Slot { estimator: e.as_ref(), gather };
                    let tile = view.gathered(Rect::whole(r.settings().size), &slot);
                    for (hit, found) in tile.each(&pass.maps) {
                        let seen = hit.seen_by(e.as_ref());
                        // The nearest alone count for knn: no more than k, and all of them if k is as many.
                        if gather == Gather::Knn && k < found.photons.len() {
                            out.expect(found.indices.len() <= k, || format!("{}: {}", e.name(), found.indices.len()));
                            continue;
                        }
                        let lit = |i: &u32| found.photons[*i as usize].lights(seen.query.normal);
                        let everything: Vec<u32> = (0..found.photons.len() as u32).filter(lit).collect();
                        let all = Gathered { indices: &everything, ..found };
                        let (exact, sum) = (e.irradiance(&all, &seen), e.irradiance(&found, &seen));
                        let error = (sum - exact).length() / exact.length().max(f64::MIN_POSITIVE);
                        out.see(error, || format!("{}, k {k}, {photons} photons: {sum} for {exact}", e.name()));
                    }
                }
            }
        }
        Ok(())
    })
}

/// Photons whose places degenerate, with footprints of many sizes.
fn crowd(kind: u64, count: u64) -> Vec<Photon> {
    (0..count)
        .map(|i| {
            let mut random = Random::new("crowd", kind << 32 | i);
            let (x, y) = (random.range(-1.0, 1.0) as f32, random.range(-1.0, 1.0) as f32);
            let position = match kind {
                0 => Vec3::new(0.3, 0.0, -0.2),
                1 => Vec3::new(x, 0.25, x * 0.5),
                2 => Vec3::new(x, 0.0, y),
                3 => {
                    if i % 2 == 0 {
                        Vec3::splat(-0.5)
                    } else {
                        Vec3::splat(0.5)
                    }
                }
                _ => Vec3::new((x * 4.0).round() / 4.0, (y * 4.0).round() / 4.0, 0.0),
            };
            let size = random.decade(-3.0, -1.0) as f32;
            Photon {
                position,
                direction: Vec3::NEG_Y,
                normal: Vec3::Y,
                power: Rgb::ONE,
                footprint: [Vec3::X * size, Vec3::Z * (size * random.unit() as f32)],
            }
        })
        .collect()
}

fn crowded_maps() -> Outcome {
    let limits = FootprintLimits { scale: 1.0, floor: 1e-6, ceiling: 2.0 };
    (0..5u64)
        .into_par_iter()
        .map(|kind| {
            let mut out = Outcome::default();
            let map = PhotonMap::new(&crowd(kind, 20_000), limits, MapParts { kd_tree: true, overlap: true });
            let mut heap = Nearest::new();
            for q in 0..60 {
                let mut random = Random::new("crowded-maps", kind << 32 | q);
                // On a photon, near one, or anywhere.
                let near = map.photons()[(random.unit() * 20_000.0) as usize].position;
                let center = match q % 3 {
                    0 => near,
                    1 => near + Vec3::new(1e-4, 0.0, -2e-4),
                    _ => Vec3::new(random.range(-1.0, 1.0) as f32, 0.0, random.range(-1.0, 1.0) as f32),
                };
                let axes = [Vec3::X * random.decade(-4.0, 0.0) as f32, Vec3::Z * random.decade(-4.0, 0.0) as f32];
                let query = Query { center, normal: Vec3::Y, axes };
                for k in [1usize, 50, 30_000] {
                    map.nearest_anywhere(&query, k, &mut heap);
                    let mut found: Vec<u32> = heap.iter().map(|(_, i)| i).collect();
                    found.sort_unstable();
                    let mut all: Vec<(f32, u32)> = map
                        .photons()
                        .iter()
                        .zip(0u32..)
                        .map(|(p, i)| ((p.position - center).length_squared(), i))
                        .collect();
                    all.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
                    // Distances that are equal but for rounding may change places: their sums tell.
                    let sum = |ids: &mut dyn Iterator<Item = u32>| -> f64 {
                        ids.map(|i| (map.photons()[i as usize].position - center).as_dvec3().length_squared()).sum()
                    };
                    let (here, there) = (sum(&mut found.iter().copied()), sum(&mut all.iter().take(k).map(|a| a.1)));
                    let count = k.min(20_000);
                    out.expect(found.len() == count, || format!("crowd {kind}, k {k}: {} found", found.len()));
                    let error = if (here - there).abs() <= 1e-6 * there { 0.0 } else { (here - there).abs() / there };
                    out.see(error, || format!("crowd {kind}, k {k}, query {q}: {here:e} for {there:e}"));
                }
                let mut found = Vec::new();
                map.overlapping_point(&Query { axes: [Vec3::ZERO; 2], ..query }, &mut found);
                let inside = |p: &crate::photons::MapPhoton| -> f64 {
                    let x = (center - p.position).as_dvec3();
                    [p.rows[0], p.rows[1], p.normal * p.inverse_reach].map(|r| r.as_dvec3().dot(x).powi(2)).iter().sum()
                };
                found.sort_unstable();
                for (p, i) in map.photons().iter().zip(0u32..) {
                    let (u, there) = (inside(p), found.binary_search(&i).is_ok());
                    // On the rim rounding decides, where the kernel is 0.
                    if (u - 1.0).abs() > 1e-5 {
                        out.see(f64::from(u8::from((u < 1.0) != there)), || format!("crowd {kind}, photon {i}: {u}"));
                    }
                }
            }
            out
        })
        .reduce(Outcome::default, Outcome::and)
}

fn one_point() -> Outcome {
    outcome(|out| {
        let scene = Arc::new(scene(BEAM).map_err(|e| e.to_string())?);
        let names = "density,coplanar,coplanar:weight=mean,multi_sampled,integrated";
        let r = rendered(&scene, [15, 15], names, 1, |s| (s.photons, s.direct) = (1_000_000, DirectLight::Photons))?;
        finite_films(&r, out);
        out.bounded += r.bounded().footprint_floor + r.bounded().disc_floor;
        out.expect(r.bounded().disc_floor > 0, || "the disc of density has no radius, which is not counted".into());
        let Some(pass) = r.last_pass() else { return Err("no pass".into()) };
        for (film, e) in r.films().iter().zip(r.estimators()) {
            if e.id() != "integrated" && !e.settings().contains("mean") {
                continue;
            }
            let slot = Slot { estimator: e.as_ref(), gather: Gather::Overlap };
            let tile = pass.view().gathered(Rect::whole([15, 15]), &slot);
            let image = film.image();
            let (mut lit, mut expected) = (0.0, 0.0);
            for (hit, found) in tile.each(&pass.maps) {
                if !found.indices.is_empty() {
                    let [a, b] = hit.view.query.axes.map(|v| v.as_dvec3());
                    expected = 0.5 / PI * 7.0 / (4.0 * a.cross(b).length());
                    lit += f64::from(image.pixels[hit.pixel as usize].x);
                }
            }
            out.see((lit / expected - 1.0).abs(), || format!("{}: {lit:e} for {expected:e}", e.name()));
        }
        Ok(())
    })
}
