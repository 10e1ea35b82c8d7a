//! The progressive renderer: a value that makes one pass at each step.

use crate::estimate::Estimator;
use crate::estimate::Lookup;
use crate::render::film::{Film, Rect};
use crate::render::photon_pass::{Emitter, PhotonMaps, PhotonPass};
use crate::render::plan::{Plan, Slot};
use crate::render::settings::{Gather, RenderSettings};
use crate::render::stats::{Bounded, Seconds, StoredCounts};
use crate::render::view::ViewTracer;
use crate::render::view_pass::{PartSeconds, ViewPass, ViewResult};
use crate::scene::Scene;
use crate::trace::Intersector;
use std::time::Instant;

/// Exponent of the shrinking of footprints (Knaus and Zwicker 2011).
pub const ALPHA: f64 = 2.0 / 3.0;

/// Area of the footprints of pass `pass` (from 0) relative to the first: `∏ (i + α)/(i + 1)`.
pub fn area_factor(pass: u32) -> f64 {
    (1..=pass).fold(1.0, next_area)
}

/// Area of the footprints of pass `pass` (from 1) after `area` in the pass before.
fn next_area(area: f64, pass: u32) -> f64 {
    area * (f64::from(pass) + ALPHA) / (f64::from(pass) + 1.0)
}

/// What callers are asked and told while a pass runs, from any thread.
pub struct Watch<'a> {
    /// Whether to stop.
    pub cancelled: &'a (dyn Fn() -> bool + Sync),
    /// Called after each tile.
    pub tile_done: &'a (dyn Fn() + Sync),
}

impl Watch<'static> {
    /// Never stops, tells nobody.
    pub const SILENT: Self = Self { cancelled: &|| false, tile_done: &|| {} };
}

/// How a step ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Step {
    /// A whole pass was added to the films.
    Done,
    /// It was cancelled; the films are as they were.
    Cancelled,
}

/// A scene, its settings and estimators, and the images so far.
pub struct Renderer {
    scene: Scene,
    intersector: Intersector,
    settings: RenderSettings,
    estimators: Vec<Box<dyn Estimator>>,
    plan: Plan,
    films: Vec<Film>,
    /// Photons and maps of the last pass.
    last: Option<(PhotonPass, PhotonMaps)>,
    seconds: Seconds,
    estimator_seconds: Vec<PartSeconds>,
    gathered: Vec<u64>,
    emitted: u64,
    stored: StoredCounts,
    bounded: Bounded,
    inside_glass: u64,
    area: f64,
}

impl Renderer {
    /// Prepares a render: builds the hierarchy and makes the plan.
    pub fn new(scene: Scene, settings: RenderSettings, estimators: Vec<Box<dyn Estimator>>) -> Self {
        Self::planned_for(scene, settings, estimators, &[])
    }

    /// The same with a plan that also serves `also`, for passes over the same photons by other estimators.
    pub fn planned_for(
        scene: Scene,
        settings: RenderSettings,
        estimators: Vec<Box<dyn Estimator>>,
        also: &[Slot],
    ) -> Self {
        let start = Instant::now();
        let intersector = Intersector::new(&scene.geometry, scene.radius);
        let bvh = start.elapsed().as_secs_f64();
        let start = Instant::now();
        let mut served = slots(&estimators, settings.gather);
        served.extend_from_slice(also);
        let plan = Plan::new(&scene, &intersector, &settings, &served);
        let planned = start.elapsed().as_secs_f64();
        let size = settings.size;
        Self {
            films: estimators.iter().map(|_| Film::new(size)).collect(),
            estimator_seconds: vec![PartSeconds::default(); estimators.len()],
            gathered: vec![0; estimators.len()],
            scene,
            intersector,
            settings,
            estimators,
            plan,
            last: None,
            seconds: Seconds { bvh, plan: planned, ..Default::default() },
            emitted: 0,
            stored: StoredCounts::default(),
            bounded: Bounded::default(),
            inside_glass: 0,
            area: 1.0,
        }
    }

    /// Makes the next pass: photons, maps, and one image for each estimator.
    ///
    /// The same settings give the same bits, whatever the number of threads.
    pub fn step(&mut self, watch: &Watch) -> Step {
        let pass = self.films.first().map_or(0, Film::passes);
        let start = Instant::now();
        let photons = if self.plan.needs_photons() {
            self.emitter(&self.plan).run(u64::from(pass), watch.cancelled)
        } else {
            PhotonPass::default()
        };
        let photon_trace = start.elapsed().as_secs_f64();
        if (watch.cancelled)() {
            return Step::Cancelled;
        }
        let start = Instant::now();
        let scale = f64::from(self.settings.footprint_scale) * self.area.sqrt();
        let maps = PhotonMaps::new(&self.scene, &self.plan, &photons.stored, scale as f32);
        let map_build = start.elapsed().as_secs_f64();

        let region = Rect::whole(self.settings.size);
        let result = self.view_pass(&maps, pass).run(
            region,
            &slots(&self.estimators, self.settings.gather),
            watch.cancelled,
            watch.tile_done,
        );
        if !result.complete {
            return Step::Cancelled;
        }
        self.seconds.photon_trace += photon_trace;
        self.seconds.map_build += map_build;
        self.record(&photons, &maps, &result);
        for tile in &result.tiles {
            for (film, image) in self.films.iter_mut().zip(&tile.images) {
                film.add_tile([tile.rect.x, tile.rect.y], tile.rect.width, &image.pixels);
            }
        }
        self.films.iter_mut().for_each(Film::finish_pass);
        self.last = Some((photons, maps));
        self.area = next_area(self.area, pass + 1);
        Step::Done
    }

    fn record(&mut self, photons: &PhotonPass, maps: &PhotonMaps, result: &ViewResult) {
        self.emitted += photons.emitted;
        self.stored.direct += photons.stored.direct.len() as u64;
        self.stored.caustic += photons.stored.caustic.len() as u64;
        self.stored.global += photons.stored.global.len() as u64;
        self.bounded.photons += photons.counts;
        self.bounded.views += result.counts.bounded;
        let (floor, ceiling) = maps.limited();
        self.bounded.footprint_floor += floor;
        self.bounded.footprint_ceiling += ceiling;
        self.inside_glass += result.counts.camera_inside_glass;
        self.seconds.view_trace += result.view_trace;
        for (i, s) in result.seconds.iter().enumerate() {
            self.estimator_seconds[i].view_trace += s.view_trace;
            self.estimator_seconds[i].gather += s.gather;
            self.estimator_seconds[i].estimate += s.estimate;
            self.gathered[i] += result.gathered[i];
            self.seconds.gather += s.gather;
            self.seconds.estimate += s.estimate;
        }
    }

    /// What traces photons under `plan`.
    pub fn emitter(&self, plan: &Plan) -> Emitter<'_> {
        Emitter {
            scene: &self.scene,
            intersector: &self.intersector,
            path: plan.path_settings(&self.settings),
            sampling: self.settings.sampling,
            photons: self.settings.photons,
            seed: self.settings.seed,
        }
    }

    /// What renders views of `maps` in pass number `pass`.
    pub fn view_pass<'a>(&'a self, maps: &'a PhotonMaps, pass: u32) -> ViewPass<'a> {
        ViewPass {
            tracer: ViewTracer {
                scene: &self.scene,
                intersector: &self.intersector,
                settings: &self.settings,
                plan: &self.plan,
            },
            maps,
            pass,
            area_factor: self.area as f32,
        }
    }

    /// The scene.
    pub fn scene(&self) -> &Scene {
        &self.scene
    }

    /// Its intersector.
    pub fn intersector(&self) -> &Intersector {
        &self.intersector
    }

    /// The settings.
    pub fn settings(&self) -> &RenderSettings {
        &self.settings
    }

    /// The plan.
    pub fn plan(&self) -> &Plan {
        &self.plan
    }

    /// The estimators.
    pub fn estimators(&self) -> &[Box<dyn Estimator>] {
        &self.estimators
    }

    /// One film for each estimator.
    pub fn films(&self) -> &[Film] {
        &self.films
    }

    /// Finished passes.
    pub fn passes(&self) -> u32 {
        self.films.first().map_or(0, Film::passes)
    }

    /// Photons and maps of the last pass.
    pub fn last_pass(&self) -> Option<&(PhotonPass, PhotonMaps)> {
        self.last.as_ref()
    }

    /// Seconds of all passes.
    pub fn seconds(&self) -> &Seconds {
        &self.seconds
    }

    /// Seconds of each estimator's view passes.
    pub fn estimator_seconds(&self) -> &[PartSeconds] {
        &self.estimator_seconds
    }

    /// Photons looked at by each estimator.
    pub fn gathered(&self) -> &[u64] {
        &self.gathered
    }

    /// Photons emitted in all passes.
    pub fn emitted(&self) -> u64 {
        self.emitted
    }

    /// Photons stored in all passes.
    pub fn stored(&self) -> StoredCounts {
        self.stored
    }

    /// What was bounded in all passes.
    pub fn bounded(&self) -> &Bounded {
        &self.bounded
    }

    /// What was defined but odd: the scene's warnings, and what the passes met.
    pub fn warnings(&self) -> Vec<String> {
        let mut all = self.scene.warnings.clone();
        if self.passes() > 0 && self.plan.needs_photons() && self.stored == StoredCounts::default() {
            all.push(format!("none of {} photons was stored", self.emitted));
        }
        if self.inside_glass > 0 {
            all.push(format!("the camera stands inside glass: {} view rays start there", self.inside_glass));
        }
        all
    }
}

/// Estimators with the gather that they use.
pub fn slots(estimators: &[Box<dyn Estimator>], gather: Gather) -> Vec<Slot<'_>> {
    estimators
        .iter()
        .map(|e| Slot { estimator: e.as_ref(), gather: if e.lookup() == Lookup::Disc { Gather::Knn } else { gather } })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn footprints_shrink_as_the_passes_to_the_minus_one_third() {
        assert_eq!(area_factor(0), 1.0);
        assert!((area_factor(1) - (1.0 + ALPHA) / 2.0).abs() < 1e-15);
        // ∏ (i + α)/(i + 1) = Γ(n + 1 + α)/(Γ(1 + α) Γ(n + 2)) ~ n^(α-1)/Γ(1 + α).
        let gamma = 0.902_745_292_950_933_6;
        for n in [1000, 100_000] {
            let expected = f64::from(n).powf(ALPHA - 1.0) / gamma;
            assert!((area_factor(n) / expected - 1.0).abs() < 2e-3, "{n}");
        }
    }
}
