//! An inspection as JSON: the content of `inspect --json`.

use crate::export::Provenance;
use crate::final_gather::{GatherCounts, RecordedRay};
use crate::math::rgb::Rgb;
use crate::photons::PhotonKind;
use crate::photons::irradiance::PyramidMemory;
use crate::render::inspect::gathering::layer_of;
use crate::render::inspect::{Gathering, Inspection, PathVertex, PhotonRow, RayEnd, Situation, SurfaceKind};
use crate::render::pass::Pass;
use crate::render::settings::RenderSettings;
use crate::render::stats::StoredCounts;
use crate::render::{Gather, LightPart, Plan};
use glam::Vec3;
use serde::Serialize;
use std::collections::BTreeMap;

/// Everything that made one pixel. Positions are in metres, in the coordinates of the scene file.
#[derive(Debug, Serialize)]
pub struct InspectionReport {
    /// Where it comes from.
    #[serde(flatten)]
    provenance: Provenance,
    /// Column and row.
    pixel: [u32; 2],
    /// Number of the pass, from 1.
    pass: u32,
    gather: Gather,
    light: LightPart,
    size: [u32; 2],
    /// Factor on the axes of footprints in this pass.
    footprint_scale: f32,
    photons_emitted: u64,
    photons_stored: StoredCounts,
    estimators: Vec<Value>,
    path: Vec<Vertex>,
    hits: Vec<Hit>,
    photons: Vec<Photon>,
    final_gathering: Vec<Gathered>,
    warnings: Vec<String>,
    settings: RenderSettings,
    plan: Plan,
}

#[derive(Debug, Serialize)]
struct Value {
    name: String,
    rays_per_axis: u32,
    /// The pixel of the image, W/(m² sr).
    pixel: [f32; 3],
    direct_and_emitted: [f32; 3],
    sum: [f32; 3],
    gathered: u64,
}

#[derive(Debug, Serialize)]
struct Vertex {
    rays_per_axis: u32,
    cell: u32,
    parent: Option<usize>,
    depth: u32,
    position: [f64; 3],
    normal: [f32; 3],
    direction: [f32; 3],
    distance: f32,
    front: bool,
    material: u32,
    surface: SurfaceKind,
    throughput: [f32; 3],
    light: [f32; 3],
    footprint: [[f32; 3]; 2],
    hit: Option<usize>,
}

#[derive(Debug, Serialize)]
struct Hit {
    vertex: usize,
    rays_per_axis: u32,
    cell: u32,
    weight: [f32; 3],
    discs: Vec<Disc>,
}

#[derive(Debug, Serialize)]
struct Disc {
    estimator: usize,
    kind: PhotonKind,
    radius: f32,
}

#[derive(Debug, Serialize)]
struct Photon {
    hit: usize,
    kind: PhotonKind,
    index: u32,
    position: [f64; 3],
    direction: [f32; 3],
    normal: [f32; 3],
    power: [f32; 3],
    footprint: [[f32; 3]; 2],
    area: f32,
    distance: f32,
    condition: f64,
    situation: Situation,
    weights: Vec<f64>,
    contributions: Vec<[f32; 3]>,
    samples: Vec<u32>,
}

/// Final gathering under one estimator.
#[derive(Debug, Serialize)]
struct Gathered {
    estimator: usize,
    settings: String,
    radius: f32,
    layers: Vec<Layer>,
    memory: Option<PyramidMemory>,
    counts: GatherCounts,
    ends: BTreeMap<RayEnd, usize>,
    rays_left_out: u64,
    hits: Vec<GatheredAt>,
}

#[derive(Debug, Serialize)]
struct Layer {
    radius: f32,
    estimates: usize,
    bytes: usize,
    /// Rays that took their irradiance from it.
    rays: usize,
}

#[derive(Debug, Serialize)]
struct GatheredAt {
    hit: usize,
    irradiance: [f32; 3],
    contribution: [f32; 3],
    rays: Vec<Ray>,
}

#[derive(Debug, Serialize)]
struct Ray {
    direction: [f32; 3],
    /// Half-axis of its disc of directions.
    radius: f32,
    end: RayEnd,
    #[serde(skip_serializing_if = "Option::is_none")]
    hit: Option<RayHit>,
    layer: Option<usize>,
    /// Layer and index of the estimates that count.
    estimates: Vec<(usize, u32)>,
    irradiance: [f32; 3],
    /// What it adds to the irradiance of the hit.
    contribution: [f32; 3],
    /// What it adds to the pixel.
    pixel: [f32; 3],
}

#[derive(Debug, Serialize)]
struct RayHit {
    position: [f64; 3],
    normal: [f32; 3],
    distance: f32,
    specular: u32,
    footprint: [[f32; 3]; 2],
}

impl InspectionReport {
    /// Of a pixel of a pass, with what was odd.
    pub fn new(pass: &Pass, found: &Inspection, warnings: Vec<String>) -> Self {
        let stored = &pass.photons.stored;
        let estimators = found.estimators.iter().enumerate().map(|(e, of)| Value {
            name: of.name.clone(),
            rays_per_axis: of.rays_per_axis,
            pixel: of.value.to_array(),
            direct_and_emitted: of.base.to_array(),
            sum: found.sum(e).to_array(),
            gathered: of.gathered,
        });
        let hits = found.hits.iter().map(|h| Hit {
            vertex: h.vertex,
            rays_per_axis: h.rays_per_axis,
            cell: h.cell,
            weight: h.weight.to_array(),
            discs: h.discs.iter().map(|d| Disc { estimator: d.estimator, kind: d.kind, radius: d.radius }).collect(),
        });
        Self {
            provenance: Provenance::new(&pass.scene, pass.settings.seed),
            pixel: found.pixel,
            pass: found.pass + 1,
            gather: pass.settings.gather,
            light: pass.settings.light,
            size: pass.settings.size,
            footprint_scale: pass.scale(),
            photons_emitted: pass.photons.emitted,
            photons_stored: StoredCounts {
                direct: stored.direct.len() as u64,
                caustic: stored.caustic.len() as u64,
                global: stored.global.len() as u64,
            },
            estimators: estimators.collect(),
            path: found.path.iter().map(|v| vertex(pass, v)).collect(),
            hits: hits.collect(),
            photons: found.rows.iter().map(|r| photon(pass, r)).collect(),
            final_gathering: found.gatherings.iter().map(|g| gathered(pass, g)).collect(),
            warnings,
            settings: pass.settings.clone(),
            plan: pass.plan.clone(),
        }
    }
}

fn place(pass: &Pass, position: Vec3) -> [f64; 3] {
    (position.as_dvec3() + pass.scene.origin).to_array()
}

fn axes(footprint: [Vec3; 2]) -> [[f32; 3]; 2] {
    footprint.map(|c| c.to_array())
}

fn vertex(pass: &Pass, v: &PathVertex) -> Vertex {
    Vertex {
        rays_per_axis: v.rays_per_axis,
        cell: v.cell,
        parent: v.parent,
        depth: v.depth,
        position: place(pass, v.position),
        normal: v.normal.to_array(),
        direction: v.direction.to_array(),
        distance: v.distance,
        front: v.front,
        material: v.material,
        surface: v.surface,
        throughput: v.throughput.to_array(),
        light: v.light.to_array(),
        footprint: axes(v.footprint),
        hit: v.hit,
    }
}

fn photon(pass: &Pass, r: &PhotonRow) -> Photon {
    Photon {
        hit: r.hit,
        kind: r.kind,
        index: r.index,
        position: place(pass, r.position),
        direction: r.direction.to_array(),
        normal: r.normal.to_array(),
        power: r.power.to_array(),
        footprint: axes(r.footprint),
        area: r.area,
        distance: r.distance,
        condition: r.condition,
        situation: r.situation,
        weights: r.weights.clone(),
        contributions: r.contributions.iter().map(|c| c.to_array()).collect(),
        samples: r.samples.clone(),
    }
}

fn gathered(pass: &Pass, g: &Gathering) -> Gathered {
    let layers = g.layers.iter().zip(g.rays_by_layer());
    let hits = g.hits.iter().map(|h| GatheredAt {
        hit: h.hit,
        irradiance: h.irradiance.to_array(),
        contribution: h.contribution.to_array(),
        rays: h.rays.iter().map(|r| ray(pass, r, h.weight)).collect(),
    });
    Gathered {
        estimator: g.estimator,
        settings: g.settings.to_string(),
        radius: g.radius,
        layers: layers
            .map(|(l, rays)| Layer { radius: l.radius, estimates: l.estimates, bytes: l.bytes, rays })
            .collect(),
        memory: g.memory,
        counts: g.counts,
        ends: g.ends(),
        rays_left_out: g.unrecorded,
        hits: hits.collect(),
    }
}

fn ray(pass: &Pass, r: &RecordedRay, weight: Rgb) -> Ray {
    Ray {
        direction: r.direction.to_array(),
        radius: r.radius,
        end: RayEnd::of(r),
        hit: r.hit.map(|h| RayHit {
            position: place(pass, h.position),
            normal: h.normal.to_array(),
            distance: h.distance,
            specular: h.specular,
            footprint: axes(h.footprint),
        }),
        layer: layer_of(r),
        estimates: r.estimates.clone(),
        irradiance: r.irradiance.to_array(),
        contribution: r.contribution.to_array(),
        pixel: (r.contribution * weight).to_array(),
    }
}
