//! Photons a second on one core: many followed together, as a render does, beside each followed to its end alone; and the map
//! that is made of them. Both run in turn, and their ratio counts.

#![allow(clippy::expect_used, missing_docs, reason = "a failed expectation is how this program reports")]

use cusp::math::sequence::Sampling;
use cusp::photons::PhotonMap;
use cusp::photons::map::{FootprintLimits, MapParts};
use cusp::photons::path::PathSettings;
use cusp::photons::projection::ProjectionMap;
use cusp::photons::spread::DiffuseSpread;
use cusp::render::photon_pass::Emitter;
use cusp::scene::open;
use cusp::trace::Intersector;
use std::time::Instant;

const PHOTONS: u64 = 400_000;
/// Pairs of runs.
const PAIRS: usize = 11;

fn main() {
    rayon::ThreadPoolBuilder::new().num_threads(1).build_global().expect("the first pool");
    println!("scene: photons/s each alone; together; ratio (quartiles); together with maps, photons/s");
    for (name, global) in [("ring", false), ("ring_soft", false), ("glass_ball", false), ("cornell", true)] {
        let scene = open(name).expect("built in");
        let intersector = Intersector::new(&scene.geometry, scene.radius);
        let map = ProjectionMap::new(&scene);
        let path = PathSettings {
            max_depth: 8,
            direct: false,
            caustic: true,
            global,
            projected: map.is_some(),
            differentials: true,
            spread: DiffuseSpread::default(),
        };
        let (projection, sampling) = (map.as_ref(), Sampling::Sobol);
        let emitter =
            Emitter { scene: &scene, intersector: &intersector, path, projection, sampling, photons: PHOTONS, seed: 1 };
        let limits = FootprintLimits { scale: 1.0, floor: scene.resolution(), ceiling: scene.radius };
        let parts = MapParts { kd_tree: false, overlap: true };
        let mut runs: Vec<[f64; 3]> = (0..=PAIRS as u64)
            .map(|pass| {
                let start = Instant::now();
                std::hint::black_box(emitter.run_one_by_one(pass));
                let alone = start.elapsed().as_secs_f64();
                let start = Instant::now();
                let photons = emitter.run(pass, &|| false);
                let together = start.elapsed().as_secs_f64();
                std::hint::black_box(PhotonMap::new(&photons.stored.caustic, limits, parts));
                std::hint::black_box(PhotonMap::new(&photons.stored.global, limits, parts));
                [alone, together, start.elapsed().as_secs_f64()]
            })
            .collect();
        // The first is for the caches.
        runs.remove(0);
        let sorted = |of: &dyn Fn(&[f64; 3]) -> f64| {
            let mut all: Vec<f64> = runs.iter().map(of).collect();
            all.sort_by(f64::total_cmp);
            [all[PAIRS / 4], all[PAIRS / 2], all[PAIRS - 1 - PAIRS / 4]]
        };
        let rate = |i: usize| PHOTONS as f64 / sorted(&|run| run[i])[1] / 1e6;
        let [low, ratio, high] = sorted(&|run| run[0] / run[1]);
        let (alone, together, with_maps) = (rate(0), rate(1), rate(2));
        println!("{name}: {alone:.2} M; {together:.2} M; {ratio:.2} ({low:.2} to {high:.2}); {with_maps:.2} M");
    }
}
