//! The hot loops do not allocate: what is allocated follows chunks of photons and tiles, never photons, hits or pixels.

#![allow(clippy::expect_used, missing_docs, reason = "tests")]

use allocation_counter::measure;
use cusp::estimate::registry::estimators;
use cusp::render::film::Rect;
use cusp::render::plan::Slot;
use cusp::render::{Pass, RenderSettings, Silent};
use cusp::scene::open;
use cusp::scene::scene_file::RenderFile;

/// One thread, this one, whose allocations are counted.
fn alone<T>(work: impl FnOnce() -> T + Send) -> T
where
    T: Send,
{
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).use_current_thread().build().expect("a pool");
    pool.install(work)
}

fn pass(scene: &str, list: &str, gather: &str, photons: i64) -> Pass {
    let scene = open(scene).expect("built in");
    let flags = RenderFile { photons: Some(photons), gather: Some(gather.into()), ..Default::default() };
    let settings = RenderSettings::new(&scene, &flags, Some([128, 128]), 1).expect("valid");
    let list = estimators(list).expect("registered");
    Pass::alone(scene.into(), settings, &list, 0, &|| false).expect("fits").expect("not cancelled")
}

/// A tile of 32×32 pixels: buffers grow to their size within the first ones, and the rest is the tile's own image.
#[test]
fn a_view_pass_allocates_by_tiles() {
    alone(|| {
        for (gather, names) in [("overlap", "regular,coplanar,multi_sampled,integrated"), ("knn", "density,integrated")]
        {
            for name in names.split(',') {
                let pass = pass("cornell", name, gather, 5_000);
                let list = estimators(name).expect("registered");
                let slots = [Slot::new(list[0].as_ref(), pass.settings.gather)];
                let allocated = |size: u32| {
                    let region = Rect { x: 0, y: 0, width: size, height: size };
                    let mut hits = 0;
                    let count = measure(|| hits = pass.view().run(region, &slots, &Silent).gathered[0]).count_total;
                    (count, hits)
                };
                let ((few, _), (many, gathered)) = (allocated(64), allocated(128));
                // 12 tiles more, of 1024 pixels each.
                let each = (many - few) as f64 / 12.0;
                assert!(each < 24.0, "{name} by {gather}: {each} for a tile");
                assert!(gathered > 100_000, "{name} by {gather}: {gathered} photons");
            }
        }
    });
}

/// A chunk of 4096 photons: its lists grow by doubling, and are cut to size.
#[test]
fn a_photon_pass_allocates_by_chunks() {
    alone(|| {
        let allocated = |photons: i64| {
            let pass = pass("cornell", "integrated", "overlap", photons);
            let mut stored = 0;
            let count = measure(|| {
                let emitter = cusp::render::photon_pass::Emitter {
                    scene: &pass.scene,
                    intersector: &pass.intersector,
                    path: pass.plan.path_settings(&pass.settings),
                    projection: pass.plan.projection.as_deref(),
                    sampling: pass.settings.sampling,
                    photons: pass.settings.photons,
                    seed: pass.settings.seed,
                };
                stored = emitter.run(0, &|| false).stored.global.len();
            });
            (count.count_total, stored)
        };
        let ((few, _), (many, stored)) = (allocated(4096), allocated(41 * 4096));
        let each = (many - few) as f64 / 40.0;
        assert!(each < 32.0, "{each} for a chunk");
        assert!(stored > 100_000, "{stored}");
    });
}
