//! The progressive renderer: a value that makes one pass at each step.

use crate::estimate::{Estimator, Lookup};
use crate::final_gather::GatherCounts;
use crate::render::change::{PhotonStore, World, film_is_kept, photons_are_kept};
use crate::render::error_estimate::ErrorEstimate;
use crate::render::evidence::Evidence;
use crate::render::film::{Film, Rect};
use crate::render::flat_pixels::FlatPixels;
use crate::render::memory::{MemoryNeed, foreseen};
use crate::render::pass::{Pass, gather_maps, needs_flat_pixels, scale_of};
use crate::render::photon_pass::{Emitter, PhotonMaps, PhotonPass};
use crate::render::plan::{Plan, Slot};
use crate::render::settings::{Gather, PlanMode, RenderSettings};
use crate::render::stats::{Bounded, Seconds, StoredCounts};
use crate::render::tiles::TILE;
use crate::render::totals::Totals;
use crate::render::view_pass::{PartSeconds, ViewPass, ViewResult};
use crate::render::watch::{FilmWatch, Watch};
use crate::scene::Scene;
use crate::scene::memory::Shortage;
use crate::trace::Intersector;
use rayon::prelude::*;
use std::sync::Arc;
use std::time::Instant;

/// Exponent of the shrinking of footprints (Knaus and Zwicker 2011).
pub const ALPHA: f64 = 2.0 / 3.0;

/// Area of the footprints of pass `pass` (from 0) relative to the first: `∏ (i + α)/(i + 1)`.
pub fn area_factor(pass: u32) -> f64 {
    (1..=pass).fold(1.0, next_area)
}

/// Area of the footprints of pass `pass` (from 1) after `area` in the pass before.
pub(super) fn next_area(area: f64, pass: u32) -> f64 {
    area * (f64::from(pass) + ALPHA) / (f64::from(pass) + 1.0)
}

/// Pixels across and down that one pixel of a draft stands for.
pub const DRAFT_SCALE: u32 = 4;

/// Most rays of final gathering from a hit in a draft.
pub const DRAFT_GATHER_RAYS: u32 = 16;

/// How a step ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Step {
    /// A whole pass was added to the films.
    Done,
    /// It was cancelled; the films are as they were.
    Cancelled,
}

/// A scene, its settings and estimators, and the images so far.
///
/// All estimators see the same photons in a pass of the same number. One that came later, or whose settings were
/// changed, catches up by itself before all go on together.
pub struct Renderer {
    scene: Arc<Scene>,
    intersector: Arc<Intersector>,
    settings: RenderSettings,
    estimators: Vec<Box<dyn Estimator>>,
    plan: Plan,
    evidence: Evidence,
    plan_is_stale: bool,
    films: Vec<Film>,
    /// Pixels that see one plane alone, once a pass has asked for them.
    flat: Option<Arc<FlatPixels>>,
    /// The last pass.
    last: Option<Arc<Pass>>,
    photons: PhotonStore,
    seconds: Seconds,
    estimator_seconds: Vec<PartSeconds>,
    photon_seconds: Vec<f64>,
    gathered: Vec<u64>,
    totals: Totals,
    /// Area of footprints for each pass so far.
    areas: Vec<f64>,
    /// What a pass was expected to need, when it was asked last.
    need: Option<MemoryNeed>,
}

impl Renderer {
    /// Prepares a render: builds the hierarchy and makes the plan.
    pub fn new(scene: Arc<Scene>, settings: RenderSettings, estimators: Vec<Box<dyn Estimator>>) -> Self {
        Self::planned_for(scene, settings, estimators, &[])
    }

    /// The same with a plan that also serves `also`, for passes over the same photons by other estimators.
    pub fn planned_for(
        scene: Arc<Scene>,
        settings: RenderSettings,
        estimators: Vec<Box<dyn Estimator>>,
        also: &[Slot],
    ) -> Self {
        let mut renderer = Self::unplanned(scene, settings, estimators);
        renderer.make_plan(also);
        renderer
    }

    /// The same without a plan yet: the first step makes it. Until then [`Renderer::plan`] has every part on.
    pub fn unplanned(scene: Arc<Scene>, settings: RenderSettings, estimators: Vec<Box<dyn Estimator>>) -> Self {
        let start = Instant::now();
        let intersector = Arc::new(built(&scene, &settings, estimators.len()));
        let bvh = start.elapsed().as_secs_f64();
        let size = settings.size;
        let plan = {
            let full = RenderSettings { plan: PlanMode::Full, ..settings.clone() };
            Plan::new(&scene, &full, &slots(&estimators, settings.gather), &Evidence::default())
        };
        Self {
            films: estimators.par_iter().map(|_| Film::new(size)).collect(),
            estimator_seconds: vec![PartSeconds::default(); estimators.len()],
            photon_seconds: vec![0.0; estimators.len()],
            gathered: vec![0; estimators.len()],
            scene,
            intersector,
            settings,
            estimators,
            plan,
            evidence: Evidence::default(),
            plan_is_stale: true,
            flat: None,
            last: None,
            photons: PhotonStore::default(),
            seconds: Seconds { bvh, ..Default::default() },
            totals: Totals::default(),
            areas: vec![1.0],
            need: None,
        }
    }

    /// Keeps the photons of passes for estimators that come later, in at most so many bytes. By default none are kept.
    pub fn keep_photons(&mut self, bytes: usize) {
        self.photons = PhotonStore::of(bytes);
    }

    /// Goes on from films that another renderer of the same scene, settings and estimators left, and from what it had
    /// emitted, stored and spent. The next pass is the one after theirs. What was bounded is counted anew.
    ///
    /// False, and nothing is changed, if the films are of another number or size.
    pub fn go_on(&mut self, films: Vec<Film>, emitted: u64, stored: StoredCounts, seconds: Seconds) -> bool {
        let fits = films.len() == self.films.len() && films.iter().all(|f| f.size() == self.settings.size);
        if fits {
            self.films = films;
            self.totals.passes = self.passes();
            (self.totals.emitted, self.totals.stored) = (emitted, stored);
            self.seconds = Seconds { bvh: self.seconds.bvh, plan: self.seconds.plan, ..seconds };
        }
        fits
    }

    /// Goes on with another scene, settings or estimators. What the change does not touch is kept: the hierarchy while
    /// the surfaces are the same, photons while what made them is, and the image of each estimator while nothing that
    /// it depends on has changed.
    pub fn change(&mut self, scene: Arc<Scene>, settings: RenderSettings, estimators: Vec<Box<dyn Estimator>>) {
        if !Arc::ptr_eq(&scene.geometry, &self.scene.geometry) {
            let start = Instant::now();
            self.intersector = Arc::new(built(&scene, &settings, estimators.len()));
            self.seconds.bvh = start.elapsed().as_secs_f64();
        }
        let same_world = World::of(&scene) == World::of(&self.scene);
        if !same_world {
            self.flat = None;
            self.evidence = Evidence::default();
        }
        let same_photons = same_world && photons_are_kept(&self.settings, &settings);
        if !same_photons {
            self.photons.clear();
            self.forget_counts();
        }
        if settings.seed != self.settings.seed || settings.max_depth != self.settings.max_depth {
            self.evidence.pilot = None;
        }
        let (before, after) = (slots(&self.estimators, self.settings.gather), slots(&estimators, settings.gather));
        let by_overlap = |all: &[Slot]| all.iter().any(|s| s.gather == Gather::Overlap);
        // A footprint hierarchy puts the photons of a map in its own order, and sums over the k nearest follow it.
        let same_order = by_overlap(&before) == by_overlap(&after);
        let mut kept: Vec<Option<usize>> = after
            .iter()
            .map(|slot| {
                let e = slot.estimator;
                let old = self.estimators.iter().position(|o| o.name() == e.name())?;
                let kept = film_is_kept((&self.scene, &self.settings), (&scene, &settings), e);
                (same_photons && kept && (same_order || slot.gather == Gather::Overlap)).then_some(old)
            })
            .collect();
        // A film has one heir.
        for i in 1..kept.len() {
            if kept[..i].contains(&kept[i]) {
                kept[i] = None;
            }
        }
        let size = settings.size;
        let mut old = std::mem::take(&mut self.films).into_iter().map(Some).collect::<Vec<_>>();
        self.films = kept.iter().map(|k| k.and_then(|k| old[k].take()).unwrap_or_else(|| Film::new(size))).collect();
        self.photon_seconds = kept.iter().map(|k| k.map_or(0.0, |k| self.photon_seconds[k])).collect();
        self.estimator_seconds =
            kept.iter().map(|k| k.map_or(Default::default(), |k| self.estimator_seconds[k])).collect();
        self.gathered = kept.iter().map(|k| k.map_or(0, |k| self.gathered[k])).collect();
        self.scene = scene;
        self.settings = settings;
        self.estimators = estimators;
        self.plan_is_stale = true;
    }

    fn forget_counts(&mut self) {
        self.last = None;
        self.totals = Totals::default();
        self.seconds = Seconds { bvh: self.seconds.bvh, plan: self.seconds.plan, ..Default::default() };
    }

    fn make_plan(&mut self, also: &[Slot]) {
        let start = Instant::now();
        let known = std::mem::take(&mut self.evidence);
        self.evidence = Evidence::of(&self.scene, &self.intersector, &self.settings, known);
        let mut served = slots(&self.estimators, self.settings.gather);
        served.extend_from_slice(also);
        self.plan = Plan::new(&self.scene, &self.settings, &served, &self.evidence);
        self.plan_is_stale = false;
        self.seconds.plan = start.elapsed().as_secs_f64();
    }

    /// What the next pass is expected to need. It makes the plan if there is none yet, and sends the pilot's photons
    /// where the plan did not ask for them but the most that a pass can store would not fit.
    pub fn memory(&mut self) -> MemoryNeed {
        if self.plan_is_stale {
            self.make_plan(&[]);
        }
        let (scene, settings, pilot) = (&self.scene, &self.settings, self.evidence.pilot.as_ref());
        foreseen(scene, &self.intersector, settings, &self.plan, pilot, self.estimators.len(), self.passes_held())
    }

    /// What [`Renderer::check_memory`] found; None if it was not asked.
    pub fn memory_need(&self) -> Option<&MemoryNeed> {
        self.need.as_ref()
    }

    /// Makes sure that the next pass can be had; see [`Renderer::memory`].
    ///
    /// # Errors
    /// If it cannot; one line.
    pub fn check_memory(&mut self) -> Result<(), Shortage> {
        let need = self.memory();
        self.need = Some(need);
        need.check(&self.settings)
    }

    /// Passes that are in memory at once: whoever looks at one keeps it until the next is there. A report of final
    /// gathering needs the last pass, also if the next is stopped.
    fn passes_held(&self) -> usize {
        if self.photons.is_used() || self.plan.gathers() { 2 } else { 1 }
    }

    /// Makes the next pass of the estimators that have the fewest: photons, maps, and one image for each of them.
    ///
    /// The same settings give the same bits, whatever the number of threads.
    pub fn step(&mut self, watch: &dyn Watch) -> Step {
        if self.plan_is_stale {
            self.make_plan(&[]);
        }
        let number = self.passes();
        let now: Vec<usize> = (0..self.films.len()).filter(|&i| self.films[i].passes() == number).collect();
        if self.passes_held() == 1 {
            self.last = None;
        }
        let Some((pass, photon_trace, map_build)) = self.pass(number, watch) else {
            return Step::Cancelled;
        };
        watch.pass_started(&pass, false);
        let Some(result) = self.view(&pass, &now, false, watch) else {
            return Step::Cancelled;
        };
        self.record(&pass, &now, &result, photon_trace);
        if pass.number == self.totals.passes {
            self.count(&pass, photon_trace, map_build);
        }
        self.films.par_iter_mut().enumerate().for_each(|(i, film)| {
            let Some(slot) = now.iter().position(|&now| now == i) else { return };
            for tile in &result.tiles {
                film.add_tile([tile.rect.x, tile.rect.y], tile.rect.width, &tile.images[slot].pixels);
            }
            film.finish_pass(pass.area_factor);
        });
        self.last = Some(pass);
        Step::Done
    }

    /// Shows what the next pass may look like, with few photons, few pixels and no pilot, and keeps nothing of it.
    ///
    /// `photons` are emitted in place of the settings' number; their footprints are larger by as much. Each pixel
    /// stands for [`DRAFT_SCALE`] of them across and down.
    pub fn draft(&self, photons: u64, watch: &dyn Watch) -> Step {
        let size = self.settings.size.map(|n| n.div_ceil(DRAFT_SCALE));
        let settings = RenderSettings { photons, size, plan: PlanMode::Full, ..self.settings.clone() };
        let evidence = Evidence { pilot: None, projection: self.evidence.projection.clone() };
        let plan = Plan::new(&self.scene, &settings, &slots(&self.estimators, settings.gather), &evidence);
        let number = self.passes();
        let now: Vec<usize> = (0..self.films.len()).filter(|&i| self.films[i].passes() == number).collect();
        let photons = self.emitter(&plan, &settings).run(0, &|| watch.cancelled());
        let pass = self.pass_of(settings, plan, Arc::new(photons), 0, 1.0);
        if watch.cancelled() {
            return Step::Cancelled;
        }
        watch.pass_started(&pass, true);
        match self.view(&pass, &now, true, watch) {
            Some(_) => Step::Done,
            None => Step::Cancelled,
        }
    }

    /// Photons and maps of pass `number`, with the seconds of both; None if cancelled.
    fn pass(&mut self, number: u32, watch: &dyn Watch) -> Option<(Arc<Pass>, f64, f64)> {
        let path = self.plan.path_settings(&self.settings);
        let (photons, photon_trace) = match self.photons.get(number, &path) {
            Some(kept) => kept,
            None => {
                let start = Instant::now();
                let photons = if self.plan.needs_photons() {
                    self.emitter(&self.plan, &self.settings).run(u64::from(number), &|| watch.cancelled())
                } else {
                    PhotonPass::default()
                };
                let seconds = start.elapsed().as_secs_f64();
                if watch.cancelled() {
                    return None;
                }
                let photons = Arc::new(photons);
                self.photons.put(number, path, &photons, seconds);
                (photons, seconds)
            }
        };
        while self.areas.len() <= number as usize {
            let next = next_area(self.areas[self.areas.len() - 1], self.areas.len() as u32);
            self.areas.push(next);
        }
        self.find_flat_pixels(number);
        let start = Instant::now();
        let area = self.areas[number as usize];
        let pass = self.pass_of(self.settings.clone(), self.plan.clone(), photons, number, area);
        let map_build = start.elapsed().as_secs_f64();
        (!watch.cancelled()).then_some((pass, photon_trace, map_build))
    }

    /// Sees to it that the flat pixels are there if pass `number` asks for them; their time is that of view rays.
    fn find_flat_pixels(&mut self, number: u32) {
        let size = self.settings.size;
        let there = self.flat.as_ref().is_some_and(|f| f.is_of(&self.scene.camera, size));
        if !there && needs_flat_pixels(self.estimators.iter().map(AsRef::as_ref), &self.plan, number) {
            let start = Instant::now();
            self.flat = Some(Arc::new(FlatPixels::new(&self.scene, &self.intersector, size)));
            let seconds = start.elapsed().as_secs_f64();
            self.seconds.view_trace += seconds;
            let exact = self.estimators.iter().zip(&mut self.estimator_seconds).filter(|(e, _)| e.is_exact_mean());
            exact.for_each(|(_, s)| s.view_trace += seconds);
        }
    }

    fn pass_of(
        &self,
        settings: RenderSettings,
        plan: Plan,
        photons: Arc<PhotonPass>,
        number: u32,
        area_factor: f64,
    ) -> Arc<Pass> {
        let maps = PhotonMaps::new(&self.scene, &plan, &photons.stored, scale_of(&settings, area_factor));
        let gathering = gather_maps(&self.scene, &plan, &settings, &photons, area_factor);
        let (scene, intersector) = (Arc::clone(&self.scene), Arc::clone(&self.intersector));
        let flat = self.flat.as_ref().map(Arc::clone).filter(|f| number > 0 && f.is_of(&scene.camera, settings.size));
        Arc::new(Pass { scene, intersector, settings, plan, photons, maps, gathering, number, area_factor, flat })
    }

    /// Views of a pass by the estimators `now`; None if cancelled.
    fn view(&self, pass: &Pass, now: &[usize], draft: bool, watch: &dyn Watch) -> Option<ViewResult> {
        let all = slots(&self.estimators, self.settings.gather);
        let chosen: Vec<Slot> = now.iter().map(|&i| all[i]).collect();
        let films: Vec<&Film> = now.iter().map(|&i| &self.films[i]).collect();
        let watch = FilmWatch { watch, estimators: now, films: &films, draft };
        // The tiles of a draft cover those of a pass, so that its first ones come soon.
        let tile = if draft { TILE / DRAFT_SCALE } else { TILE };
        let gather_rays = if draft { DRAFT_GATHER_RAYS } else { u32::MAX };
        let view = ViewPass { tile, gather_rays, ..pass.view() };
        let result = view.run(Rect::whole(pass.settings.size), &chosen, &watch);
        result.complete.then_some(result)
    }

    /// Adds up what the estimators `now` cost.
    fn record(&mut self, pass: &Pass, now: &[usize], result: &ViewResult, photon_trace: f64) {
        self.totals.add_views(&result.counts);
        self.seconds.view_trace += result.view_trace;
        for (slot, &i) in now.iter().enumerate() {
            let s = &result.seconds[slot];
            self.estimator_seconds[i].view_trace += s.view_trace;
            self.estimator_seconds[i].gather += s.gather;
            self.estimator_seconds[i].estimate += s.estimate;
            self.estimator_seconds[i].final_gather += s.final_gather;
            let estimator = self.estimators[i].as_ref();
            // Each estimator is charged with what it looks up, as if it were alone.
            let gathering = pass.plan.final_gathering(estimator).map_or(0.0, |f| pass.gathering.seconds(f));
            let own = photon_trace + pass.maps.seconds(estimator) + gathering;
            self.photon_seconds[i] += if pass.plan.needs_photons() { own } else { 0.0 };
            self.gathered[i] += result.gathered[slot];
            self.seconds.gather += s.gather;
            self.seconds.estimate += s.estimate;
            self.seconds.final_gather += s.final_gather;
        }
    }

    /// Adds up the photons of a pass that is seen for the first time.
    fn count(&mut self, pass: &Pass, photon_trace: f64, map_build: f64) {
        self.totals.add_photons(pass);
        self.seconds.photon_trace += photon_trace;
        self.seconds.map_build += map_build;
    }

    /// What traces photons under `plan` and `settings`, which may ask for another number of photons.
    pub fn emitter<'a>(&'a self, plan: &'a Plan, settings: &RenderSettings) -> Emitter<'a> {
        Emitter {
            scene: &self.scene,
            intersector: &self.intersector,
            path: plan.path_settings(settings),
            projection: plan.projection.as_deref(),
            sampling: settings.sampling,
            photons: settings.photons,
            seed: settings.seed,
        }
    }

    /// Whether the next step can begin without tracing photons.
    pub fn has_next_photons(&self) -> bool {
        let path = self.plan.path_settings(&self.settings);
        !self.plan_is_stale && (!self.plan.needs_photons() || self.photons.get(self.passes(), &path).is_some())
    }

    /// The scene.
    pub fn scene(&self) -> &Arc<Scene> {
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

    /// Estimated error of the first estimator's image; None below 12 passes.
    pub fn error_estimate(&self) -> Option<ErrorEstimate> {
        self.films.first()?.error_estimate(Rect::whole(self.settings.size), None)
    }

    /// Passes that all estimators have finished.
    pub fn passes(&self) -> u32 {
        self.films.iter().map(Film::passes).min().unwrap_or(0)
    }

    /// Photons and maps of the last pass.
    pub fn last_pass(&self) -> Option<&Arc<Pass>> {
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

    /// Seconds of photons and maps of each estimator's passes, also of those that it shared with others.
    pub fn photon_seconds(&self) -> &[f64] {
        &self.photon_seconds
    }

    /// Photons looked at by each estimator.
    pub fn gathered(&self) -> &[u64] {
        &self.gathered
    }

    /// Photons emitted in all passes.
    pub fn emitted(&self) -> u64 {
        self.totals.emitted
    }

    /// Photons stored in all passes.
    pub fn stored(&self) -> StoredCounts {
        self.totals.stored
    }

    /// Rays of final gathering in all passes, and how they ended.
    pub fn gather_counts(&self) -> &GatherCounts {
        &self.totals.gather
    }

    /// What was bounded in all passes.
    pub fn bounded(&self) -> &Bounded {
        &self.totals.bounded
    }

    /// What was defined but odd: the scene's warnings, and what the passes met.
    pub fn warnings(&self) -> Vec<String> {
        self.totals.warnings(&self.scene, &self.plan)
    }
}

/// Passes that a render is expected to make: how many is known only when it ends.
const EXPECTED_PASSES: u64 = 16;

fn built(scene: &Scene, settings: &RenderSettings, estimators: usize) -> Intersector {
    let rays = settings.rays_of_pass(estimators).saturating_mul(EXPECTED_PASSES);
    Intersector::for_rays(&scene.geometry, scene.radius, rays)
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
    use crate::render::watch::TileDone;
    use crate::scene::open;
    use crate::scene::scene_file::RenderFile;
    use std::sync::Mutex;

    /// Counts how often each pixel comes in.
    struct Coverage(Mutex<Vec<u32>>, u32);

    impl Watch for Coverage {
        fn tile_done(&self, tile: &TileDone) {
            let r = tile.rect();
            for (_, pixels, _) in tile.means() {
                assert_eq!(pixels.len(), (r.width * r.height) as usize);
                let mut seen = self.0.lock().expect("not poisoned");
                for i in 0..r.width * r.height {
                    seen[((r.y + i / r.width) * self.1 + r.x + i % r.width) as usize] += 1;
                }
            }
        }
    }

    #[test]
    fn a_draft_covers_the_film_and_leaves_it_alone() {
        let scene = open("ring").expect("built in");
        let flags = RenderFile { photons: Some(30_000), ..Default::default() };
        let settings = RenderSettings::new(&scene, &flags, Some([150, 131]), 1).expect("valid");
        let estimators = crate::estimate::registry::estimators("regular,integrated").expect("registered");
        let renderer = Renderer::unplanned(scene.into(), settings, estimators);
        let coverage = Coverage(Mutex::new(vec![0; 150 * 131]), 150);
        assert_eq!(renderer.draft(2000, &coverage), Step::Done);
        assert!(coverage.0.lock().expect("not poisoned").iter().all(|n| *n == 2));
        assert!(renderer.films().iter().all(|f| f.passes() == 0));
    }

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
