//! Frame rates over triangles and photons, over accumulation frames, and the cost of each parameter.

use crate::math::frame::uniform_sphere;
use crate::math::sequence::{Sampling, Sequence};
use crate::measure::realtime::run::{RunReport, RunSettings, run};
use crate::measure::realtime::statistics::{median, quantile};
use crate::photons::kd_tree::{KdTree, Nearest, NearestQuery};
use crate::realtime::{Engine, RealtimeSettings};
use crate::scene::Scene;
use glam::Vec3;
use serde::Serialize;
use std::sync::Arc;
use std::time::Instant;

/// Triangles, and photons in the map, of table 6.1.
pub const GRID: [u32; 7] = [400, 800, 1600, 3200, 6400, 12_800, 25_600];

/// Frame rates as the paper prints them, a row for each number of triangles (Kristensen and Ottosen 2003, table 6.1).
pub const PRINTED_GRID: [[f64; 7]; 7] = [
    [460.0, 298.0, 179.0, 101.0, 52.0, 26.0, 12.0],
    [344.0, 243.0, 156.0, 90.0, 49.0, 25.0, 12.0],
    [225.0, 172.0, 124.0, 78.0, 45.0, 24.0, 11.0],
    [124.0, 105.0, 83.0, 58.0, 37.0, 21.0, 10.0],
    [63.0, 56.0, 49.0, 38.0, 27.0, 17.0, 9.0],
    [30.0, 28.0, 26.0, 22.0, 17.0, 12.0, 8.0],
    [15.0, 14.0, 13.0, 11.0, 10.0, 8.0, 5.0],
];

/// Accumulation frames of table 6.2.
pub const ACCUMULATION: [u32; 7] = [1, 2, 4, 8, 16, 32, 64];

/// Its frame rates and renewal times in seconds as printed.
pub const PRINTED_ACCUMULATION: [[f64; 2]; 7] =
    [[0.63, 1.59], [1.24, 1.61], [2.41, 1.66], [4.52, 1.77], [8.25, 1.94], [12.51, 2.56], [18.01, 3.56]];

/// The settings with `photons` in the map and `triangles` in the mesh: by Russian roulette's count each light's photon is
/// stored once and once more for each reflection, by splitting as often as figure 4.3 says.
///
/// Photons are rounded up to whole ones of each frame.
pub fn with_counts(scene: &Scene, s: &RealtimeSettings, triangles: u32, photons: u32) -> RealtimeSettings {
    let one = RealtimeSettings { photons_from_light: 1, ..s.clone() };
    let per_photon = crate::realtime::settings::photon_count(&one).max(1);
    let base = scene.geometry.triangles.len() as u32 + 8 * scene.geometry.spheres.len() as u32;
    RealtimeSettings {
        photons_from_light: u64::from(photons).div_ceil(per_photon).max(1) as u32,
        mesh_refinement: triangles.saturating_sub(base),
        ..s.clone()
    }
}

/// Runs an engine with these settings.
///
/// None if `going_on` says to stop.
pub fn measured(
    scene: &Arc<Scene>,
    s: RealtimeSettings,
    how: &RunSettings,
    mut going_on: impl FnMut() -> bool,
) -> Option<RunReport> {
    let mut engine = Engine::new(scene, s);
    let (report, ..) = run(&mut engine, how, |_| going_on())?;
    (report.frames == how.frames).then_some(report)
}

/// One parameter changed, and what that does to the frame.
#[derive(Clone, Debug, Serialize)]
pub struct ParameterCost {
    /// What was set, as `KEY=VALUE`.
    pub set: String,
    /// Seconds of a frame over those of the unchanged settings in the same repeat: least, median, most.
    pub ratio: [f64; 3],
    /// Median fluctuation.
    pub fluctuation: f64,
    /// Photons in the map.
    pub photons_in_map: u64,
}

/// Seconds of frames with each of `changed` over those with `plain`, in turn, `repeats` times.
///
/// None if it was stopped.
pub fn parameter_costs(
    scene: &Arc<Scene>,
    plain: &RealtimeSettings,
    changed: &[(String, RealtimeSettings)],
    how: &RunSettings,
    repeats: u32,
    mut going_on: impl FnMut() -> bool,
) -> Option<Vec<ParameterCost>> {
    let mut ratios = vec![Vec::new(); changed.len()];
    let mut last = vec![(0.0, 0); changed.len()];
    for _ in 0..repeats {
        let base = measured(scene, plain.clone(), how, &mut going_on)?.frame_seconds[1];
        for (i, (_, s)) in changed.iter().enumerate() {
            let r = measured(scene, s.clone(), how, &mut going_on)?;
            ratios[i].push(r.frame_seconds[1] / base);
            last[i] = (r.fluctuation, r.last.photons_in_map);
        }
    }
    let rows = changed.iter().zip(&ratios).zip(&last).map(|(((set, _), r), l)| ParameterCost {
        set: set.clone(),
        ratio: [quantile(r, 0.0), median(r), quantile(r, 1.0)],
        fluctuation: l.0,
        photons_in_map: l.1,
    });
    Some(rows.collect())
}

/// Time of an estimate of 50 photons in a map of so many, of `total` that are split into maps (table 5.1).
#[derive(Clone, Copy, Debug, Serialize)]
pub struct PartitionRow {
    /// Photons of all maps.
    pub total: u32,
    /// Photons of each map.
    pub each: u32,
    /// Microseconds of a search, the median.
    pub search: f64,
    /// Over that of one map of all photons, in the same repeat: least, median, most.
    pub ratio: [f64; 3],
    /// Milliseconds to build all maps, the median, one thread.
    pub balance: f64,
}

/// The estimate's expected time as printed in table 5.1: photons in each map, for a million in all, then ten thousand.
pub const PRINTED_PARTITION: [(u32, u32, f64); 8] = [
    (1_000_000, 1_000_000, 1.0),
    (1_000_000, 100_000, 0.95),
    (1_000_000, 10_000, 0.9),
    (1_000_000, 1_000, 0.86),
    (10_000, 10_000, 1.0),
    (10_000, 1_000, 0.95),
    (10_000, 100, 0.9),
    (10_000, 10, 0.84),
];

/// Measures table 5.1: photons spread over walls of equal area, each map a stretch of them, queries in turn in all maps.
pub fn partition_rows(queries: u64, repeats: u32) -> Vec<PartitionRow> {
    let numbers = Sequence::new(Sampling::Sobol, 51);
    let mut rows = Vec::new();
    for total in [1_000_000u32, 10_000] {
        let of_total: Vec<u32> = PRINTED_PARTITION.iter().filter(|p| p.0 == total).map(|p| p.1).collect();
        // A strip of the plane in which neighbours in the list are neighbours in place: map `m` has the photons of one part.
        let place = |i: u32| {
            let x = numbers.four(u64::from(i), 0);
            Vec3::new((i as f32 + x[0]) / total as f32, 0.0, x[1])
        };
        let points: Vec<Vec3> = (0..total).map(place).collect();
        let mut seconds = vec![(Vec::new(), Vec::new()); of_total.len()];
        for _ in 0..repeats {
            for (each, (search, balance)) in of_total.iter().zip(&mut seconds) {
                let started = Instant::now();
                let maps: Vec<KdTree> = points.chunks(*each as usize).map(|c| KdTree::new(c.iter().copied())).collect();
                balance.push(started.elapsed().as_secs_f64());
                let mut found = Nearest::new();
                let started = Instant::now();
                for q in 0..queries {
                    // The same places for all sizes, far apart from one to the next.
                    let at = (q * 7919 % u64::from(total)) as u32;
                    let query = NearestQuery {
                        center: points[at as usize],
                        radius: f32::INFINITY,
                        k: 50,
                        normal: Vec3::Y,
                        slice: f32::INFINITY,
                    };
                    maps[(at / each) as usize].nearest(&query, &mut found, |_| true);
                    std::hint::black_box(&found);
                }
                search.push(started.elapsed().as_secs_f64() / queries as f64);
            }
        }
        let whole = seconds[0].0.clone();
        for (each, (search, balance)) in of_total.iter().zip(&seconds) {
            let ratios: Vec<f64> = search.iter().zip(&whole).map(|(a, b)| a / b).collect();
            rows.push(PartitionRow {
                total,
                each: *each,
                search: 1e6 * median(search),
                ratio: [quantile(&ratios, 0.0), median(&ratios), quantile(&ratios, 1.0)],
                balance: 1e3 * median(balance),
            });
        }
    }
    rows
}

/// A part of a frame run by itself, over and over (an isolated test, section 4.5.1).
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Isolated {
    /// What runs.
    pub what: &'static str,
    /// How many of it in a second, all threads.
    pub per_second: f64,
}

/// Rays from the eye, rays of random paths, estimates, and balanced photons in a second.
pub fn isolated(scene: &Arc<Scene>, settings: &RealtimeSettings, seconds: f64) -> Vec<Isolated> {
    use crate::trace::Ray;
    use rayon::prelude::*;
    let mut engine = Engine::new(scene, settings.clone());
    for f in 0..settings.accumulation_frames {
        engine.step(f64::from(f) / 30.0, &scene.camera);
    }
    engine.draw(&scene.camera, [320, 240], 1.0);
    let rate = |work: &mut dyn FnMut() -> u64| {
        let (started, mut count) = (Instant::now(), work());
        while started.elapsed().as_secs_f64() < seconds {
            count += work();
        }
        count as f64 / started.elapsed().as_secs_f64()
    };
    let world = engine.world();
    let rays = scene.camera.rays([320, 240]);
    let single = rate(&mut || {
        let hits: usize = (0..76_800u32)
            .into_par_iter()
            .with_min_len(320)
            .filter(|i| {
                let (direction, _) = rays.ray((i % 320) as f32 + 0.5, (i / 320) as f32 + 0.5, 0.5);
                world.closest(scene, &Ray { origin: scene.camera.position, direction }).is_some()
            })
            .count();
        std::hint::black_box(hits);
        76_800
    });
    let numbers = Sequence::new(Sampling::Random, 3);
    let random: Vec<Ray> = (0..20_000u64)
        .map(|i| {
            let x = numbers.four(i, 0);
            let direction = uniform_sphere(x[0], x[1]).normalize();
            Ray { origin: scene.camera.position, direction }
        })
        .collect();
    let scattered = rate(&mut || {
        let hits = random.par_iter().with_min_len(64).filter(|r| world.closest(scene, r).is_some()).count();
        std::hint::black_box(hits);
        random.len() as u64
    });
    let vertices: Vec<(u32, bool)> = (0..engine.mesh().vertices.len() as u32).map(|v| (v, false)).collect();
    let estimates = rate(&mut || {
        std::hint::black_box(engine.irradiance_at(&vertices));
        vertices.len() as u64
    });
    let mut map = crate::realtime::photon_map::PhotonMap::new(settings.accumulation_frames);
    for f in engine.map().frames() {
        map.store(f, engine.map().of_frame(f).to_vec());
    }
    let balanced = rate(&mut || {
        map.balance(settings, None);
        map.photons().len() as u64
    });
    let mut view = crate::realtime::view::View::default();
    let tiled = rate(&mut || {
        view.forget();
        view.update(scene, world, engine.mesh(), &scene.camera, [320, 240], false)
    });
    vec![
        Isolated { what: "view rays, one by one through the hierarchy", per_second: single },
        Isolated { what: "view rays, by tiles, with their places in the mesh", per_second: tiled },
        Isolated { what: "rays in random directions", per_second: scattered },
        Isolated { what: "irradiance estimates", per_second: estimates },
        Isolated { what: "photons balanced", per_second: balanced },
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::open;
    use crate::scene::scene_file::RealtimeFile;

    #[test]
    fn counts_are_those_asked_for() {
        let scene = Arc::new(open("rooms").expect("built in"));
        let plain = RealtimeSettings::new(&scene, &RealtimeFile::default(), 1).expect("valid");
        for (triangles, photons) in [(400, 400), (3200, 25_600)] {
            let s =
                with_counts(&scene, &RealtimeSettings { diffuse_reflections: 3, ..plain.clone() }, triangles, photons);
            let mut e = Engine::new(&scene, s.clone());
            (0..s.accumulation_frames).for_each(|_| e.step(0.0, &scene.camera));
            let found = e.map().photons().len() as u32;
            assert!((photons..photons + 40).contains(&found), "{found}");
            let t = e.mesh().triangles.len() as u32;
            assert!((triangles..triangles + 8).contains(&t), "{t}");
        }
    }

    #[test]
    fn a_run_counts_and_times_its_frames() {
        let scene = Arc::new(open("rooms").expect("built in"));
        let plain = RealtimeSettings::new(&scene, &RealtimeFile::default(), 1).expect("valid");
        let s = with_counts(&scene, &plain, 400, 400);
        let how = RunSettings { frames: 30, time_step: 0.03, turn: 3.0, size: [40, 30], exposure: 1.0 };
        let r = measured(&scene, s, &how, || true).expect("not stopped");
        assert_eq!((r.frames, r.last.frame), (30, 29));
        assert!(r.frames_per_second > 0.0 && r.frame_seconds[0] <= r.frame_seconds[2]);
        assert!((r.renewal_seconds - 10.0 * r.frame_seconds[1]).abs() < 1e-12);
        let mut left = 5;
        let stopped = measured(&scene, with_counts(&scene, &plain, 400, 400), &how, || {
            left -= 1;
            left > 0
        });
        assert!(stopped.is_none());
    }

    #[test]
    fn the_rows_of_table_5_1_are_measured() {
        let rows = partition_rows(50, 1);
        assert_eq!(rows.len(), PRINTED_PARTITION.len());
        for (r, p) in rows.iter().zip(PRINTED_PARTITION) {
            assert_eq!((r.total, r.each), (p.0, p.1));
            assert!(r.search > 0.0 && r.balance > 0.0);
        }
    }
}
