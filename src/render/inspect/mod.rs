//! Why a pixel has its value: its view rays, its photons, and their weights under each estimator.

pub mod gathering;
mod path;
mod photon_path;
mod situation;
#[cfg(test)]
mod tests;

pub use gathering::{GatheredHit, Gathering, LayerInfo, RayEnd};
pub use path::{PathVertex, SurfaceKind};
pub use photon_path::{PhotonPath, PhotonVertex, photon_path};
pub use situation::Situation;

use crate::estimate::{Estimator, View};
use crate::math::rgb::{Rgb, in_f32};
use crate::photons::map::Query;
use crate::photons::{MapPhoton, PhotonKind};
use crate::render::film::Rect;
use crate::render::pass::Pass;
use crate::render::plan::{Plan, Slot};
use crate::render::renderer::slots;
use crate::render::view::{ViewCounts, ViewTracer, seen_by};
use crate::render::view_pass::{Scratch, ViewPass};
use crate::render::watch::Silent;
use glam::{DVec3, Vec3};
use path::PathRecorder;
use std::collections::BTreeMap;

/// Everything that made one pixel in one pass.
#[derive(Clone, Debug)]
pub struct Inspection {
    /// Column and row.
    pub pixel: [u32; 2],
    /// Number of the pass, from 0.
    pub pass: u32,
    /// The estimators, in the order in which they were asked for.
    pub estimators: Vec<EstimatorValue>,
    /// View hits of the pixel's one ray, then those of each finer grid of rays in use.
    pub hits: Vec<InspectedHit>,
    /// What those rays met, in the same order.
    pub path: Vec<PathVertex>,
    /// Photons that some estimator gathered, by hit, kind and index.
    pub rows: Vec<PhotonRow>,
    /// What final gathering brought under each estimator that gathers finally.
    pub gatherings: Vec<Gathering>,
}

/// The pixel under one estimator.
#[derive(Clone, Debug)]
pub struct EstimatorValue {
    /// Id and settings.
    pub name: String,
    /// View rays across and down the pixel.
    pub rays_per_axis: u32,
    /// Radiance, W/(m² sr): bit for bit the pixel of the pass's image.
    pub value: Rgb,
    /// The part of it that needed no photons: direct light from shadow rays, and lights that are seen.
    pub base: Rgb,
    /// Photons that it gathered, over all hits.
    pub gathered: u64,
}

/// A diffuse surface at which photons were gathered.
#[derive(Clone, Debug)]
pub struct InspectedHit {
    /// Hit point, normal, view footprint and direction.
    pub view: View,
    /// The part of the pixel that an exact mean takes in its place; None in the first pass, and where the pixel sees more
    /// than one plane.
    pub flat: Option<Query>,
    /// Radiance at the camera for unit irradiance here: throughput times ρ/π, 1/sr, before the mean over rays.
    pub weight: Rgb,
    /// View rays across and down the pixel, in the grid that the ray belongs to.
    pub rays_per_axis: u32,
    /// Cell of the ray in its grid, row by row.
    pub cell: u32,
    /// Index of its vertex in [`Inspection::path`].
    pub vertex: usize,
    /// Index of the material.
    pub material: u32,
    /// Discs that the k nearest fill, for estimators that ask for one.
    pub discs: Vec<Disc>,
}

impl InspectedHit {
    /// The hit as that estimator sees it.
    pub fn seen_by(&self, estimator: &dyn Estimator) -> View {
        seen_by(self.view, self.flat, estimator)
    }
}

/// The disc of one density estimate at a hit.
#[derive(Clone, Copy, Debug)]
pub struct Disc {
    /// Index of the estimator.
    pub estimator: usize,
    /// Which photons it holds.
    pub kind: PhotonKind,
    /// Radius, metres.
    pub radius: f32,
}

/// A photon that some estimator gathered for a hit.
#[derive(Clone, Debug)]
pub struct PhotonRow {
    /// Index of the hit.
    pub hit: usize,
    /// Its kind, which names its map.
    pub kind: PhotonKind,
    /// Index in its map.
    pub index: u32,
    /// Where it arrived, metres.
    pub position: Vec3,
    /// Unit direction in which it travelled.
    pub direction: Vec3,
    /// Unit normal of its surface.
    pub normal: Vec3,
    /// Power, W.
    pub power: Rgb,
    /// Footprint `(dα, dβ)` as in the map: scaled, in the tangent plane, after floor and ceiling, metres.
    pub footprint: [Vec3; 2],
    /// Area of its ellipse, `π ‖dα × dβ‖`, m².
    pub area: f32,
    /// Distance of the hit point in the photon's filter space; below 1 inside its ellipsoid.
    pub distance: f32,
    /// Longest over shortest semi-axis.
    pub condition: f64,
    /// How it lies to the hit's view footprint.
    pub situation: Situation,
    /// Weight under each estimator, 1/m²; 0 where the estimator did not gather it.
    pub weights: Vec<f64>,
    /// What it adds to the pixel under each estimator, W/(m² sr): weight, power and the hit's weight, over the rays.
    ///
    /// With the base, and what gather rays bring, they add up to the value: no term is negative, so the sum is within `2⁻²¹` of it, relatively.
    pub contributions: Vec<Rgb>,
    /// Points under each estimator at which the kernel is evaluated and not zero; 0 where it uses no points.
    pub samples: Vec<u32>,
}

/// Why a pass cannot be inspected so; one line.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum InspectError {
    /// The pixel is not in the image.
    #[error("pixel {},{} lies outside the image of {}x{} pixels; columns and rows count from 0", .pixel[0], .pixel[1], .size[0], .size[1])]
    Outside {
        /// The pixel.
        pixel: [u32; 2],
        /// Size of the image.
        size: [u32; 2],
    },
    /// The pass was planned for other estimators.
    #[error("{estimator}: this pass was made without {part}; make one that is planned for it")]
    Lacks {
        /// Name of the estimator.
        estimator: String,
        /// What it needs.
        part: &'static str,
    },
}

/// Takes apart what a pixel of a pass shows under each estimator.
///
/// The values come from the code that renders; the rows are an account of their own, which [`Inspection::sum`] adds up.
///
/// # Errors
/// A pixel outside the image, or a pass that lacks what an estimator needs.
pub fn inspect(pass: &Pass, estimators: &[Box<dyn Estimator>], pixel: [u32; 2]) -> Result<Inspection, InspectError> {
    let size = pass.settings.size;
    if pixel[0] >= size[0] || pixel[1] >= size[1] {
        return Err(InspectError::Outside { pixel, size });
    }
    let slots = slots(estimators, pass.settings.gather);
    for slot in &slots {
        check(pass, slot)?;
    }
    let rect = Rect { x: pixel[0], y: pixel[1], width: 1, height: 1 };
    let view = pass.view();
    let images: Vec<_> = view.run(rect, &slots, &Silent).tiles.into_iter().flat_map(|t| t.images).collect();
    let mut account = Account::new(&view, &slots);
    account.gatherings = gathering::all(&view, &slots);
    let mut grids: Vec<u32> = std::iter::once(1).chain(slots.iter().map(|s| s.estimator.rays_per_axis())).collect();
    grids.sort_unstable();
    grids.dedup();
    let bases: BTreeMap<u32, Rgb> = grids.into_iter().map(|n| (n, account.add_rays(rect, n))).collect();
    let values = slots.iter().zip(images).map(|(slot, image)| {
        let rays_per_axis = slot.estimator.rays_per_axis();
        EstimatorValue {
            name: slot.estimator.name(),
            rays_per_axis,
            value: image.pixels.first().copied().unwrap_or_default(),
            base: bases.get(&rays_per_axis).copied().unwrap_or_default(),
            gathered: image.gathered,
        }
    });
    let estimators = values.collect();
    let rows = account.rows();
    let Account { hits, path, gatherings, .. } = account;
    Ok(Inspection { pixel, pass: pass.number, estimators, hits, path, rows, gatherings })
}

/// The surfaces that the one ray of a pixel meets, with view footprints whether or not the pass needed them.
///
/// Follows one ray, so it may be asked for in every frame. Light is left out of the vertices.
///
/// # Errors
/// A pixel outside the image.
pub fn view_path(pass: &Pass, pixel: [u32; 2]) -> Result<Vec<PathVertex>, InspectError> {
    let size = pass.settings.size;
    if pixel[0] >= size[0] || pixel[1] >= size[1] {
        return Err(InspectError::Outside { pixel, size });
    }
    let plan = Plan { view_differentials: true, shadow_rays: false, ..pass.plan.clone() };
    let own = pass.view();
    let view = ViewPass { tracer: ViewTracer { plan: &plan, footprints: true, ..own.tracer }, ..own };
    let mut account = Account::new(&view, &[]);
    account.add_rays(Rect { x: pixel[0], y: pixel[1], width: 1, height: 1 }, 1);
    Ok(account.path)
}

impl Inspection {
    /// Base, contributions of photons, and what gather rays bring under one estimator, added up in f64.
    pub fn sum(&self, estimator: usize) -> Rgb {
        let base = self.estimators.get(estimator).map_or(Rgb::ZERO, |e| e.base);
        let photons = self.rows.iter().filter_map(|r| r.contributions.get(estimator));
        let sum = photons.fold(base.as_dvec3(), |sum, c| sum + c.as_dvec3());
        in_f32(sum + self.gathering(estimator).map_or(DVec3::ZERO, Gathering::sum)).0
    }

    /// What final gathering brought under one estimator; None if it gathers nothing finally.
    pub fn gathering(&self, estimator: usize) -> Option<&Gathering> {
        self.gatherings.iter().find(|g| g.estimator == estimator)
    }
}

/// Whether a pass has what a slot needs.
///
/// # Errors
/// The first part that is missing.
pub(super) fn check(pass: &Pass, slot: &Slot) -> Result<(), InspectError> {
    match pass.plan.lacks(slot) {
        Some(part) => Err(InspectError::Lacks { estimator: slot.estimator.name(), part }),
        None => Ok(()),
    }
}

/// The parts of an inspection while it is made.
struct Account<'a> {
    view: &'a ViewPass<'a>,
    slots: &'a [Slot<'a>],
    hits: Vec<InspectedHit>,
    path: Vec<PathVertex>,
    /// Weights of each photon, by hit, kind and index.
    rows: BTreeMap<(usize, PhotonKind, u32), Vec<f64>>,
    gatherings: Vec<Gathering>,
}

impl<'a> Account<'a> {
    fn new(view: &'a ViewPass<'a>, slots: &'a [Slot<'a>]) -> Self {
        let (hits, path, rows, gatherings) = (Vec::new(), Vec::new(), BTreeMap::new(), Vec::new());
        Self { view, slots, hits, path, rows, gatherings }
    }

    /// Adds a grid of `n`×`n` rays with the photons of the slots that use it; returns the light that needs no photons.
    fn add_rays(&mut self, rect: Rect, n: u32) -> Rgb {
        let mut scratch = Scratch::default();
        let (first_hit, first_vertex) = (self.hits.len(), self.path.len());
        let mut recorder = PathRecorder::new(self.view.tracer.scene, &mut self.path, n, first_hit);
        let base = self.view.trace(rect, n, &mut scratch, &mut ViewCounts::default(), &mut recorder);
        for (vertex, v) in self.path.iter().enumerate().skip(first_vertex) {
            let Some(hit) = v.hit.and_then(|h| scratch.hits.get(h - first_hit)) else {
                continue;
            };
            self.hits.push(InspectedHit {
                view: hit.view,
                flat: hit.flat,
                weight: hit.weight,
                rays_per_axis: n,
                cell: v.cell,
                vertex,
                material: v.material,
                discs: Vec::new(),
            });
        }
        for (e, slot) in self.slots.iter().enumerate().filter(|(_, s)| s.estimator.rays_per_axis() == n) {
            let (hits, rows, all) = (&mut self.hits, &mut self.rows, self.slots.len());
            self.view.each_gathered(slot, &mut scratch, |hit, view_hit, kind, gathered| {
                if gathered.radius > 0.0 {
                    hits[first_hit + hit].discs.push(Disc { estimator: e, kind, radius: gathered.radius });
                }
                for &i in gathered.indices {
                    let weights = rows.entry((first_hit + hit, kind, i)).or_insert_with(|| vec![0.0; all]);
                    let photon = &gathered.photons[i as usize];
                    weights[e] = slot.estimator.weight(photon, &view_hit.view, gathered.radius);
                }
            });
            if let Some(gathering) = self.gatherings.iter_mut().find(|g| g.estimator == e) {
                gathering.add(self.view, slot, &scratch.hits, first_hit, n * n);
            }
        }
        in_f32(base.first().copied().unwrap_or_default() / f64::from(n * n)).0
    }

    fn rows(&mut self) -> Vec<PhotonRow> {
        let rows = std::mem::take(&mut self.rows);
        rows.into_iter()
            .filter_map(|((hit, kind, index), weights)| {
                let photon = self.view.maps.of(kind)?.photons().get(index as usize)?;
                Some(self.row(hit, kind, index, photon, weights))
            })
            .collect()
    }

    fn row(&self, hit: usize, kind: PhotonKind, index: u32, photon: &MapPhoton, weights: Vec<f64>) -> PhotonRow {
        let at = &self.hits[hit];
        let query = &at.view.query;
        let light = photon.power.as_dvec3() * at.weight.as_dvec3() / f64::from(at.rays_per_axis * at.rays_per_axis);
        let samples = self.slots.iter().map(|s| match s.estimator.rays_per_axis() == at.rays_per_axis {
            true => s.estimator.construction(photon, &at.seen_by(s.estimator)).points_inside(),
            false => 0,
        });
        PhotonRow {
            hit,
            kind,
            index,
            position: photon.position,
            direction: photon.direction,
            normal: photon.normal,
            power: photon.power,
            footprint: photon.axes(),
            area: photon.area(),
            distance: photon.to_filter(query.center - photon.position).length(),
            condition: photon.condition(),
            situation: Situation::of(photon, query),
            contributions: weights.iter().map(|w| in_f32(light * *w).0).collect(),
            samples: samples.collect(),
            weights,
        }
    }
}
