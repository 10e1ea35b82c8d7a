//! The gather itself: many rays from one point, what each brings, and their mean.

use crate::estimate::{FinalGatherMethod, FinalGathering};
use crate::final_gather::directions::{Directions, footprint_radius};
use crate::final_gather::gather_ray::{GatherHit, GatherPoint, GatherTracer, NoHit};
use crate::final_gather::lookup::{Lookup, Used};
use crate::final_gather::maps::GatherMaps;
use crate::math::frame::{cosine_hemisphere, tangents};
use crate::math::hash::mix;
use crate::math::rgb::{Rgb, in_f32};
use crate::math::sequence::{Sampling, Sequence};
use crate::photons::kd_tree::Nearest;
use crate::trace::direct::{self, Receiver};
use crate::trace::{Differential, Ray};
use glam::{DVec3, Vec3};
use serde::Serialize;
use std::f64::consts::PI;
use std::ops::AddAssign;

/// Rays of a second gather for each of the first, at least [`FEWEST_SECOND`].
const SECOND_SHARE: u32 = 16;
const FEWEST_SECOND: u32 = 8;

/// Counts of gather rays and how they ended.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct GatherCounts {
    /// Rays, those of second gathers too.
    pub rays: u64,
    /// Rays that met nothing.
    pub open: u64,
    /// Second gathers.
    pub second: u64,
    /// Footprints that held no estimate, so that the nearest took its place.
    pub empty_footprints: u64,
    /// Rays at whose end nothing is known of the light: no photon, or none on a surface that faces the ray.
    pub unknown: u64,
}

impl GatherCounts {
    /// One line for people.
    pub fn line(&self) -> String {
        let Self { rays, open, second, empty_footprints, unknown } = self;
        format!(
            "{rays} rays, {open} met nothing, {second} gathered a second time, {empty_footprints} footprints held no estimate, {unknown} ended where no light is known"
        )
    }
}

impl AddAssign for GatherCounts {
    fn add_assign(&mut self, o: Self) {
        self.rays += o.rays;
        self.open += o.open;
        self.second += o.second;
        self.empty_footprints += o.empty_footprints;
        self.unknown += o.unknown;
    }
}

/// Buffers and counts that a thread keeps from gather to gather.
#[derive(Default)]
pub struct GatherScratch {
    heap: Nearest,
    /// Counts of all gathers since the scratch was made or taken over.
    pub counts: GatherCounts,
}

/// A gather ray, as an inspector sees it.
#[derive(Clone, Debug)]
pub struct RecordedRay {
    /// Unit direction in which it leaves the point.
    pub direction: Vec3,
    /// Half-axis of the disc of directions that it stands for; 0 if it carries no differential.
    pub radius: f32,
    /// The surface at its end.
    pub hit: Option<GatherHit>,
    /// How it ended without one.
    pub missed: Option<NoHit>,
    /// What its irradiance came from.
    pub used: Used,
    /// Estimates that count: layer and index.
    pub estimates: Vec<(usize, u32)>,
    /// Whether a second gather took the place of the look-up.
    pub second: bool,
    /// Irradiance at its end, W/m².
    pub irradiance: Rgb,
    /// What it adds to the irradiance of the point, W/m²: π/N times its radiance.
    pub contribution: Rgb,
}

/// Hears of every ray of the first gather.
pub trait GatherRecorder {
    /// Whether it wants to hear at all.
    const LISTENS: bool;

    /// A ray has ended.
    fn ray(&mut self, ray: RecordedRay);
}

/// Records nothing, at no cost.
pub struct Unrecorded;

impl GatherRecorder for Unrecorded {
    const LISTENS: bool = false;

    fn ray(&mut self, _: RecordedRay) {}
}

impl GatherRecorder for Vec<RecordedRay> {
    const LISTENS: bool = true;

    fn ray(&mut self, ray: RecordedRay) {
        self.push(ray);
    }
}

/// Gathers global light by one method.
#[derive(Clone, Copy)]
pub struct FinalGatherer<'a> {
    tracer: GatherTracer<'a>,
    settings: FinalGathering,
    maps: &'a GatherMaps,
    lookup: Lookup<'a>,
}

impl<'a> FinalGatherer<'a> {
    /// With what `maps` hold for those settings.
    pub fn new(tracer: GatherTracer<'a>, settings: &FinalGathering, maps: &'a GatherMaps) -> Self {
        let lookup = match (settings.method, maps.photons(), maps.pyramid(settings)) {
            (FinalGatherMethod::Classic, Some(photons), _) => Lookup::Photons(photons, maps.search(settings)),
            (FinalGatherMethod::Precomputed, _, Some(pyramid)) => Lookup::Nearest(pyramid),
            (FinalGatherMethod::RayDifferentials, _, Some(pyramid)) => Lookup::Footprint(pyramid),
            _ => Lookup::Nothing,
        };
        Self { tracer, settings: *settings, maps, lookup }
    }

    /// Global irradiance at a point, W/m²: `π/N` times the radiance of N cosine-weighted rays. Lights that rays meet do not
    /// count, directly (shadow rays have them) or by specular surfaces (the caustic map has them).
    ///
    /// The same seed gives the same rays.
    pub fn irradiance(
        &self,
        at: &GatherPoint,
        seed: u64,
        scratch: &mut GatherScratch,
        recorder: &mut impl GatherRecorder,
    ) -> DVec3 {
        self.gather(at, self.settings.rays, self.settings.near, seed, scratch, recorder)
    }

    fn gather<R: GatherRecorder>(
        &self,
        at: &GatherPoint,
        rays: u32,
        near: f32,
        seed: u64,
        scratch: &mut GatherScratch,
        recorder: &mut R,
    ) -> DVec3 {
        let f = &self.settings;
        let directions = Directions::new(f.pattern, rays, seed);
        let origin = at.start(self.tracer.scene);
        let floor = self.tracer.scene.resolution();
        let carries = matches!(self.lookup, Lookup::Footprint(_));
        let share = PI / f64::from(rays);
        let mut sum = DVec3::ZERO;
        for i in 0..rays {
            let [u, v] = directions.square(i);
            let direction = cosine_hemisphere(at.normal, u, v);
            let radius = if carries {
                footprint_radius(rays, direction.dot(at.normal), f.differentials_as_published)
            } else {
                0.0
            };
            let (t, b) = tangents(direction);
            let differential = Differential { dp: [Vec3::ZERO; 2], dv: [t * radius, b * radius] };
            let end = self.tracer.trace(Ray { origin, direction }, differential, |set| directions.more(i, set)[0]);
            scratch.counts.rays += 1;
            let mut estimates = Vec::new();
            let (mut used, mut second, mut irradiance) = (Used::None, false, DVec3::ZERO);
            match &end {
                Err(NoHit::Open) => scratch.counts.open += 1,
                Err(_) => {}
                Ok(hit) if hit.distance < near => {
                    second = true;
                    irradiance = self.second_gather(hit, mix(seed, u64::from(i) + 16), scratch);
                }
                Ok(hit) => {
                    let mut visit = |layer: usize, index: u32| {
                        if R::LISTENS {
                            estimates.push((layer, index));
                        }
                    };
                    (irradiance, used) = self.lookup.irradiance(f, hit, floor, &mut scratch.heap, &mut visit);
                    scratch.counts.empty_footprints += u64::from(matches!(used, Used::NearestOf(_)));
                    scratch.counts.unknown += u64::from(used == Used::None);
                }
            }
            let (hit, missed) = (end.ok(), end.err());
            let contribution = hit.map_or(DVec3::ZERO, |h| irradiance * h.weight.as_dvec3() * share);
            sum += contribution;
            if R::LISTENS {
                let (irradiance, contribution) = (in_f32(irradiance).0, in_f32(contribution).0);
                recorder.ray(RecordedRay {
                    direction,
                    radius,
                    hit,
                    missed,
                    used,
                    estimates,
                    second,
                    irradiance,
                    contribution,
                });
            }
        }
        sum
    }

    /// Irradiance at a hit so near that the error of a look-up there would be seen (pi-engine, section 3.2.2): direct light by
    /// shadow rays, caustics by their photons, and global light by a gather of fewer rays.
    fn second_gather(&self, hit: &GatherHit, seed: u64, scratch: &mut GatherScratch) -> DVec3 {
        scratch.counts.second += 1;
        let (scene, intersector) = (self.tracer.scene, self.tracer.intersector);
        let receiver = Receiver { position: hit.position, normal: hit.normal, found_along: hit.direction };
        let sequence = Sequence::new(Sampling::Random, seed);
        let direct = direct::irradiance(scene, intersector, &receiver, 1, &sequence, 0);
        let caustic = self.maps.caustic().filter(|c| !c.photons().is_empty()).map_or(DVec3::ZERO, |photons| {
            photons.irradiance(hit.position, hit.normal, &self.maps.search(&self.settings), &mut scratch.heap)
        });
        let at = GatherPoint { position: hit.position, normal: hit.normal, found_along: hit.direction };
        let rays = (self.settings.rays / SECOND_SHARE).max(FEWEST_SECOND);
        direct + caustic + self.gather(&at, rays, 0.0, seed, scratch, &mut Unrecorded)
    }
}
