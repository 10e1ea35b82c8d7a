//! The view pass: tile by tile, the same photons under every estimator in turn.

use crate::estimate::registry::needs_view_footprint;
use crate::estimate::{FinalGathering, Gathered, Lookup};
use crate::final_gather::gather_ray::GatherTracer;
use crate::final_gather::{FinalGatherer, GatherCounts, GatherMaps, GatherScratch, Unrecorded as Unheard};
use crate::math::hash::mix;
use crate::math::rgb::{Rgb, in_f32};
use crate::math::sequence::{Sampling, Sequence};
use crate::photons::kd_tree::Nearest;
use crate::photons::together::{TOGETHER, Together};
use crate::photons::{PhotonKind, PhotonMap};
use crate::render::cells::{cells_of_pass, parts_of_pass};
use crate::render::film::{Image, Rect};
use crate::render::flat_pixels::FlatPixels;
use crate::render::photon_pass::PhotonMaps;
use crate::render::plan::Slot;
use crate::render::settings::Gather;
use crate::render::tiles::{in_blocks, tiles_of};
use crate::render::turns::in_turn;
use crate::render::view::{
    Branch, Unrecorded, ViewCounts, ViewHit, ViewRecorder, ViewTracer, at_point, sample_position,
};
use crate::trace::Ray;
use glam::DVec3;
use std::time::Instant;

/// Seconds of one estimator's view pass by part.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize)]
pub struct PartSeconds {
    /// View rays and shadow rays.
    pub view_trace: f64,
    /// Looking photons up.
    pub gather: f64,
    /// Evaluating the estimator.
    pub estimate: f64,
    /// Final gathering: its rays and what they look up.
    pub final_gather: f64,
}

impl PartSeconds {
    /// All of it.
    pub fn total(&self) -> f64 {
        self.view_trace + self.gather + self.estimate + self.final_gather
    }

    fn add(&mut self, o: &Self, factor: f64) {
        self.view_trace += o.view_trace * factor;
        self.gather += o.gather * factor;
        self.estimate += o.estimate * factor;
        self.final_gather += o.final_gather * factor;
    }
}

/// One estimator's part of a tile.
pub struct TileImage {
    /// Radiance of its pixels, row by row.
    pub pixels: Vec<Rgb>,
    /// Thread seconds.
    pub seconds: PartSeconds,
    /// Photons looked at, for all hits.
    pub gathered: u64,
    /// Pixels with a channel beyond f32, which hold its largest number there.
    pub overflow: u64,
    /// Discs of density estimation that were raised to the resolution of f32.
    pub disc_floor: u64,
    /// Rays of final gathering.
    pub gather_counts: GatherCounts,
}

/// A finished tile.
pub struct TileResult {
    /// Where it lies.
    pub rect: Rect,
    /// One image for each slot.
    pub images: Vec<TileImage>,
    /// Thread seconds of all view rays of the tile; slots with the same rays share them.
    pub view_trace: f64,
    /// Counts of the view paths.
    pub counts: ViewCounts,
}

/// What a view pass needs.
pub struct ViewPass<'a> {
    /// View paths.
    pub tracer: ViewTracer<'a>,
    /// The photons.
    pub maps: &'a PhotonMaps,
    /// What final gathering looks up.
    pub gathering: &'a GatherMaps,
    /// Number of the pass, from 0; from 1 on rays are jittered.
    pub pass: u32,
    /// Where an exact mean may take more of the pixel than the ray's cell.
    pub flat: Option<&'a FlatPixels>,
    /// Area of footprints relative to the first pass.
    pub area_factor: f32,
    /// Most rays of final gathering from a hit; fewer than asked for in a draft.
    pub gather_rays: u32,
    /// Pixels along a tile's side, at least 1. It decides no pixel.
    pub tile: u32,
}

/// The result of a view pass over a region.
pub struct ViewResult {
    /// Its tiles in order; fewer if cancelled.
    pub tiles: Vec<TileResult>,
    /// Wall seconds of each slot as if it were alone, scaled from thread seconds.
    pub seconds: Vec<PartSeconds>,
    /// Wall seconds of all view rays, those that slots share once.
    pub view_trace: f64,
    /// Wall seconds of everything.
    pub wall: f64,
    /// Photons looked at by each slot.
    pub gathered: Vec<u64>,
    /// Counts of all view paths.
    pub counts: ViewCounts,
    /// Whether all tiles are there.
    pub complete: bool,
}

impl ViewResult {
    /// Radiance of one slot over `region`, which is the one that was rendered; black where a tile is missing.
    pub fn image(&self, slot: usize, region: Rect) -> Image {
        let mut image = Image::black([region.width, region.height]);
        for tile in &self.tiles {
            let at = Rect { x: tile.rect.x - region.x, y: tile.rect.y - region.y, ..tile.rect };
            image.put(at, &tile.images[slot].pixels);
        }
        image
    }
}

/// The hits of a tile with the photons that were gathered for each, kept to be evaluated more than once.
pub struct GatheredTile {
    hits: Vec<ViewHit>,
    indices: Vec<u32>,
    /// As in [`Scratch`].
    spans: Vec<(usize, usize, f32)>,
    /// Whether it looked into the global map.
    global: bool,
    /// Thread seconds of its view rays and of the gather.
    pub seconds: PartSeconds,
}

impl GatheredTile {
    /// Each hit with its photons in each map. `maps` are those that they were gathered from.
    pub fn each<'a>(&'a self, maps: &'a PhotonMaps) -> impl Iterator<Item = (&'a ViewHit, Gathered<'a>)> {
        let seen = move |kind: PhotonKind| self.global || kind != PhotonKind::Global;
        let own = move || maps.by_kind().filter(move |(kind, _)| seen(*kind));
        let of_hit = self.hits.iter().flat_map(move |hit| own().map(move |(_, map)| (hit, map)));
        of_hit.zip(&self.spans).map(|((hit, map), &(from, to, radius))| {
            (hit, Gathered { photons: map.photons(), indices: &self.indices[from..to], radius })
        })
    }
}

/// Follows a view pass. Every method may be called from any thread, several at once.
pub trait TileWatch: Sync {
    /// Whether to stop. Returns at once.
    fn cancelled(&self) -> bool;

    /// Asked before each tile: whether to make it. It may block, which pauses the pass.
    fn tile_allowed(&self) -> bool {
        !self.cancelled()
    }

    /// A tile is done.
    fn tile_done(&self, tile: &TileResult);
}

/// Photons that are gathered before they are estimated; a hit's own may exceed it.
const BATCH: usize = 1 << 20;

/// Buffers that a thread keeps from tile to tile.
#[derive(Default)]
pub(super) struct Scratch {
    /// Hits of the rays that were traced last.
    pub hits: Vec<ViewHit>,
    stack: Vec<Branch>,
    indices: Vec<u32>,
    /// For each hit and map: where its indices start and end, and the radius of its disc.
    spans: Vec<(usize, usize, f32)>,
    /// The nearest photons of each map, which the search for the next hit starts from.
    nearest: [Nearest; PhotonKind::ALL.len()],
    /// Of each hit of a batch, from all maps.
    irradiances: Vec<DVec3>,
    /// What hits in a row have found in each map: neighbours see nearly the same photons.
    together: [Together; PhotonKind::ALL.len()],
    gather: GatherScratch,
}

impl ViewPass<'_> {
    /// Renders `region` for every slot; `watch` is asked and told from the threads that make the tiles.
    pub fn run(&self, region: Rect, slots: &[Slot], watch: &dyn TileWatch) -> ViewResult {
        let start = Instant::now();
        let all = tiles_of(region, self.tile);
        let results = in_turn(all.len(), Scratch::default, |scratch, number| {
            if !watch.tile_allowed() {
                return None;
            }
            let tile = self.tile(all[number], number, slots, scratch, watch)?;
            watch.tile_done(&tile);
            Some(tile)
        });
        let wall = start.elapsed().as_secs_f64();
        let tiles: Vec<TileResult> = results.into_iter().flatten().collect();
        let complete = tiles.len() == all.len();
        let view_trace: f64 = tiles.iter().map(|t| t.view_trace).sum();
        let others = tiles.iter().flat_map(|t| t.images.iter().map(|i| i.seconds.total() - i.seconds.view_trace));
        let spent = view_trace + others.sum::<f64>();
        let scale = if spent > 0.0 { wall / spent } else { 0.0 };
        let mut seconds = vec![PartSeconds::default(); slots.len()];
        let mut gathered = vec![0; slots.len()];
        let mut counts = ViewCounts::default();
        for tile in &tiles {
            counts.bounded += tile.counts.bounded;
            counts.camera_inside_glass += tile.counts.camera_inside_glass;
            counts.overflow += tile.counts.overflow;
            counts.disc_floor += tile.counts.disc_floor;
            counts.gather += tile.counts.gather;
            for (i, image) in tile.images.iter().enumerate() {
                seconds[i].add(&image.seconds, scale);
                gathered[i] += image.gathered;
            }
        }
        ViewResult { view_trace: view_trace * scale, tiles, seconds, wall, gathered, counts, complete }
    }

    /// One tile, whose place among the others is `number`; None if cancelled. Slots take turns at being first, so that none always finds the caches cold.
    pub(super) fn tile(
        &self,
        rect: Rect,
        number: usize,
        slots: &[Slot],
        scratch: &mut Scratch,
        watch: &dyn TileWatch,
    ) -> Option<TileResult> {
        let mut counts = ViewCounts::default();
        let mut images: Vec<Option<TileImage>> = slots.iter().map(|_| None).collect();
        let mut rays: Vec<u32> = slots.iter().map(|s| s.estimator.rays_per_axis()).collect();
        rays.sort_unstable();
        rays.dedup();
        let mut all_rays = 0.0;
        for n in rays {
            let start = Instant::now();
            let mut by_n = slots.iter().filter(|s| s.estimator.rays_per_axis() == n);
            let footprints = self.tracer.footprints && by_n.any(|s| needs_view_footprint(s.estimator));
            let view = ViewPass { tracer: ViewTracer { footprints, ..self.tracer }, ..*self };
            let base = view.trace(rect, n, scratch, &mut counts, &mut Unrecorded);
            let view_trace = start.elapsed().as_secs_f64();
            all_rays += view_trace;
            for k in 0..slots.len() {
                let i = (k + number) % slots.len();
                if slots[i].estimator.rays_per_axis() == n {
                    if watch.cancelled() {
                        return None;
                    }
                    let mut image = self.estimate(&base, n, &slots[i], scratch, &|| watch.cancelled())?;
                    image.seconds.view_trace = view_trace;
                    counts.overflow += image.overflow;
                    counts.disc_floor += image.disc_floor;
                    counts.gather += image.gather_counts;
                    images[i] = Some(image);
                }
            }
        }
        Some(TileResult {
            rect,
            // Each slot's number of rays is in the list that was just gone through.
            images: images.into_iter().flatten().collect(),
            view_trace: all_rays,
            counts,
        })
    }

    /// Traces `n`×`n` rays for each pixel; hits go to the scratch, the sum of other light to the result.
    ///
    /// Everything about a pixel follows from its place in the image, not from `rect`.
    pub(super) fn trace(
        &self,
        rect: Rect,
        n: u32,
        scratch: &mut Scratch,
        counts: &mut ViewCounts,
        recorder: &mut impl ViewRecorder,
    ) -> Vec<DVec3> {
        let t = &self.tracer;
        let camera = &t.scene.camera;
        let rays = camera.rays(t.settings.size);
        // A random cell of a grid that grows finer, seen through a footprint of the cell's size: every pass is an
        // unbiased sample of the box-filtered pixel, and edges of surfaces are resolved in the end.
        let cells = cells_of_pass(self.pass) as f32;
        let half = 0.5 / (n as f32 * cells);
        let mut base = vec![DVec3::ZERO; (rect.width * rect.height) as usize];
        scratch.hits.clear();
        for pixel in in_blocks(rect.width, rect.height) {
            let x = rect.x + pixel as u32 % rect.width;
            let y = rect.y + pixel as u32 / rect.width;
            let seed = mix(mix(t.settings.seed, 0x76_6965_7773), u64::from(y) << 32 | u64::from(x));
            let index = u64::from(self.pass);
            for cell in 0..n * n {
                // Each ray of a pixel has a sequence of its own, whose points follow each other from pass to pass.
                let sequence = Sequence::new(Sampling::Sobol, mix(seed, u64::from(cell)));
                let jitter = (self.pass > 0).then(|| {
                    let x = sequence.four(index, 0);
                    [((x[0] * cells).floor() + 0.5) / cells, ((x[1] * cells).floor() + 0.5) / cells]
                });
                let (px, py) = sample_position([x, y], [cell % n, cell / n], n, jitter);
                let (direction, differential) = rays.ray(px, py, half);
                let ray = Ray { origin: camera.position, direction };
                recorder.ray(cell);
                let before = scratch.hits.len();
                base[pixel] += t.trace(
                    ray,
                    differential,
                    &sequence,
                    index,
                    pixel as u32,
                    &mut scratch.hits,
                    &mut scratch.stack,
                    counts,
                    recorder,
                );
                if let (Some(flat), Some(at), 1) = (self.flat, jitter, n)
                    && let [hit] = &mut scratch.hits[before..]
                {
                    let parts = parts_of_pass(self.pass) as f32;
                    let low = at.map(|v| (v * parts).floor() / parts);
                    hit.flat = flat.part([x, y], low, low.map(|v| v + 1.0 / parts), &hit.view.query);
                }
            }
        }
        base
    }

    /// Gathers and estimates for the scratch's hits in batches, each part of a batch timed as a whole. A tile is one
    /// batch unless photons overlap by the thousand, so that memory stays bounded.
    ///
    /// None if it was cancelled while it gathered finally, which may take many seconds for a tile.
    pub(super) fn estimate(
        &self,
        base: &[DVec3],
        n: u32,
        slot: &Slot,
        scratch: &mut Scratch,
        cancelled: &dyn Fn() -> bool,
    ) -> Option<TileImage> {
        let mut sums = base.to_vec();
        let mut seconds = PartSeconds::default();
        let (mut gathered, mut disc_floor) = (0, 0);
        let resolution = self.tracer.scene.resolution();
        scratch.together.iter_mut().for_each(Together::clear);
        let mut next = 0;
        while next < scratch.hits.len() {
            let start = Instant::now();
            let first = next;
            scratch.indices.clear();
            scratch.spans.clear();
            while next < scratch.hits.len() && scratch.indices.len() < BATCH {
                for map in self.maps.of_estimator(slot.estimator) {
                    let from = scratch.indices.len();
                    let radius = self.gather(map, slot, next, scratch);
                    disc_floor += u64::from(radius > 0.0 && radius <= resolution);
                    scratch.spans.push((from, scratch.indices.len(), radius));
                }
                next += 1;
            }
            seconds.gather += start.elapsed().as_secs_f64();
            gathered += scratch.indices.len() as u64;

            let start = Instant::now();
            let hits = &scratch.hits[first..next];
            scratch.irradiances.clear();
            scratch.irradiances.resize(hits.len(), DVec3::ZERO);
            let maps = self.maps.of_estimator(slot.estimator).count();
            for (number, (_, map)) in self.maps.of_estimator(slot.estimator).enumerate() {
                // Most hits find nothing in most scenes.
                let spans = || scratch.spans.iter().skip(number).step_by(maps);
                let found = |&&(from, to, _): &&(usize, usize, f32)| from < to;
                let mut gathered = hits.iter().zip(spans()).filter(|(_, span)| found(span)).map(|(hit, span)| {
                    let &(from, to, radius) = span;
                    let indices = &scratch.indices[from..to];
                    (Gathered { photons: map.photons(), indices, radius }, hit.seen_by(slot.estimator))
                });
                let mut sums = scratch.irradiances.iter_mut().zip(spans()).filter(|(_, span)| found(span));
                slot.estimator.irradiances(&mut gathered, &mut |irradiance| {
                    if let Some((sum, _)) = sums.next() {
                        *sum += irradiance;
                    }
                });
            }
            for (hit, irradiance) in hits.iter().zip(&scratch.irradiances) {
                sums[hit.pixel as usize] += *irradiance * hit.weight.as_dvec3();
            }
            seconds.estimate += start.elapsed().as_secs_f64();
        }
        let start = Instant::now();
        scratch.gather.counts = GatherCounts::default();
        if let Some(gatherer) = self.gatherer(slot) {
            for hit in &scratch.hits {
                if cancelled() {
                    return None;
                }
                let irradiance = gatherer.irradiance(&hit.point(), hit.seed, &mut scratch.gather, &mut Unheard);
                sums[hit.pixel as usize] += irradiance * hit.weight.as_dvec3();
            }
            seconds.final_gather = start.elapsed().as_secs_f64();
        }
        let scale = 1.0 / f64::from(n * n);
        let mut overflow = 0;
        let pixels = sums
            .into_iter()
            .map(|s| {
                let (pixel, bounded) = in_f32(s * scale);
                overflow += u64::from(bounded);
                pixel
            })
            .collect();
        Some(TileImage { pixels, seconds, gathered, overflow, disc_floor, gather_counts: scratch.gather.counts })
    }

    /// What gathers global light for a slot, if final gathering does.
    pub fn gatherer(&self, slot: &Slot) -> Option<FinalGatherer<'_>> {
        let t = &self.tracer;
        let asked = t.plan.final_gathering(slot.estimator)?;
        let settings = FinalGathering { rays: asked.rays.min(self.gather_rays), ..*asked };
        let tracer = GatherTracer { scene: t.scene, intersector: t.intersector, max_depth: t.settings.max_depth };
        Some(FinalGatherer::new(tracer, &settings, self.gathering))
    }

    /// Traces and gathers for a tile as [`ViewPass::run`] does, and keeps what was found: four bytes for each photon of
    /// each hit.
    pub fn gathered(&self, rect: Rect, slot: &Slot) -> GatheredTile {
        let mut scratch = Scratch::default();
        let start = Instant::now();
        let rays = slot.estimator.rays_per_axis();
        self.trace(rect, rays, &mut scratch, &mut ViewCounts::default(), &mut Unrecorded);
        let view_trace = start.elapsed().as_secs_f64();
        let start = Instant::now();
        scratch.together.iter_mut().for_each(Together::clear);
        for hit in 0..scratch.hits.len() {
            for map in self.maps.of_estimator(slot.estimator) {
                let from = scratch.indices.len();
                let radius = self.gather(map, slot, hit, &mut scratch);
                scratch.spans.push((from, scratch.indices.len(), radius));
            }
        }
        let seconds = PartSeconds { view_trace, gather: start.elapsed().as_secs_f64(), ..Default::default() };
        let global = slot.estimator.final_gathering().is_none();
        GatheredTile { hits: scratch.hits, indices: scratch.indices, spans: scratch.spans, global, seconds }
    }

    /// Calls `visit` with the photons of each of the scratch's hits (its index) in each map, as `estimate` sees them.
    pub(super) fn each_gathered(
        &self,
        slot: &Slot,
        scratch: &mut Scratch,
        mut visit: impl FnMut(usize, &ViewHit, PhotonKind, &Gathered),
    ) {
        scratch.together.iter_mut().for_each(Together::clear);
        for hit in 0..scratch.hits.len() {
            for (kind, map) in self.maps.of_estimator(slot.estimator) {
                scratch.indices.clear();
                let radius = self.gather((kind, map), slot, hit, scratch);
                let gathered = Gathered { photons: map.photons(), indices: &scratch.indices, radius };
                let seen = ViewHit { view: scratch.hits[hit].seen_by(slot.estimator), ..scratch.hits[hit] };
                visit(hit, &seen, kind, &gathered);
            }
        }
    }

    /// Appends the photons of one hit to the scratch's indices; returns the radius of the disc, if it asks for one.
    fn gather(&self, (kind, map): (PhotonKind, &PhotonMap), slot: &Slot, hit: usize, scratch: &mut Scratch) -> f32 {
        let indices = &mut scratch.indices;
        if slot.gather == Gather::Overlap {
            let together = &mut scratch.together[kind as usize];
            if !together.holds(hit) {
                let next = scratch.hits[hit..].iter().take(TOGETHER);
                let seen = next.map(|hit| hit.query_of(slot.estimator));
                match slot.estimator.lookup() {
                    Lookup::Point => map.points_together(hit, seen.map(|query| at_point(&query)), together),
                    Lookup::Parallelogram => map.parallelograms_together(hit, seen, together),
                    Lookup::Disc => {}
                }
            }
            if let Some(found) = together.of(hit) {
                indices.extend_from_slice(found);
                return 0.0;
            }
        }
        let query = scratch.hits[hit].query_of(slot.estimator);
        let nearest = &mut scratch.nearest[kind as usize];
        let k = self.tracer.settings.k;
        match (slot.estimator.lookup(), slot.gather) {
            (Lookup::Disc, _) => {
                map.nearest_anywhere(&query, k, nearest);
                let Some((bits, _)) = nearest.farthest() else { return 0.0 };
                indices.extend(nearest.iter().map(|(_, i)| i));
                let radius = (f32::from_bits(bits) * self.area_factor).sqrt();
                return radius.max(self.tracer.scene.resolution());
            }
            (Lookup::Point, Gather::Overlap) => map.overlapping_point(&query, indices),
            (Lookup::Parallelogram, Gather::Overlap) => map.overlapping_parallelogram(&query, indices),
            (Lookup::Point, Gather::Knn) => map.nearest(&at_point(&query), k, nearest, indices),
            (Lookup::Parallelogram, Gather::Knn) => map.nearest(&query, k, nearest, indices),
        }
        0.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// As many hits, fewer rays from each, never more than were asked for.
    #[test]
    fn rays_of_final_gathering_can_be_capped() {
        let scene = crate::scene::open("cornell").expect("built in");
        let flags = crate::scene::scene_file::RenderFile { photons: Some(500), ..Default::default() };
        let settings = crate::render::RenderSettings::new(&scene, &flags, Some([16, 12]), 1).expect("valid");
        let list = crate::estimate::registry::estimators("integrated+classic:rays=40").expect("registered");
        let pass = crate::render::Pass::alone(scene.into(), settings, &list, 0, &|| false);
        let pass = pass.expect("fits").expect("not cancelled");
        let rays = |gather_rays| {
            let view = ViewPass { gather_rays, ..pass.view() };
            let slots = crate::render::renderer::slots(&list, Gather::Overlap);
            view.run(Rect::whole([16, 12]), &slots, &crate::render::watch::Silent).counts.gather.rays
        };
        let [few, all] = [16, u32::MAX].map(rays);
        assert!(few > 0 && few * 40 == all * 16, "{few} {all}");
    }
}
