//! What final gathering brings to an inspected pixel: every ray, and what it looked up.

use crate::estimate::FinalGathering;
use crate::final_gather::{GatherCounts, GatherHit, GatherRecorder, GatherScratch, NoHit, RecordedRay, Used};
use crate::math::elementary::sin_cos;
use crate::math::frame::tangents;
use crate::math::rgb::{Rgb, in_f32};
use crate::photons::irradiance::layer::Ellipse;
use crate::photons::irradiance::{IrradianceEstimate, PyramidMemory};
use crate::render::plan::Slot;
use crate::render::view::ViewHit;
use crate::render::view_pass::ViewPass;
use glam::{DVec3, Vec2, Vec3};
use std::collections::BTreeMap;
use std::f32::consts::PI;

/// Final gathering under one estimator.
#[derive(Clone, Debug)]
pub struct Gathering {
    /// Index of the estimator.
    pub estimator: usize,
    /// Method and settings.
    pub settings: FinalGathering,
    /// Radius of the first search for photons, or of the first layer, metres.
    pub radius: f32,
    /// Layers of the irradiance pyramid, the most detailed first; none where photons are looked up.
    pub layers: Vec<LayerInfo>,
    /// Memory while it was made; None where photons are looked up.
    pub memory: Option<PyramidMemory>,
    /// What was gathered at each hit of the estimator's rays.
    pub hits: Vec<GatheredHit>,
    /// Counts over all hits, second gathers with their rays included.
    pub counts: GatherCounts,
    /// Rays that were gathered but not written down, because there were too many.
    pub unrecorded: u64,
    /// Rays that may still be written down, where [`ESTIMATES`] estimates count as one more.
    room: usize,
}

/// Rays that are written down for an estimator, at most.
const MOST: usize = 1 << 19;
/// Estimates that weigh as much as a ray.
const ESTIMATES: usize = 8;

/// Writes rays down while there is room.
struct Recorder<'a> {
    rays: Vec<RecordedRay>,
    room: &'a mut usize,
    unrecorded: &'a mut u64,
}

impl GatherRecorder for Recorder<'_> {
    const LISTENS: bool = true;

    fn ray(&mut self, ray: RecordedRay) {
        let size = 1 + ray.estimates.len() / ESTIMATES;
        if size <= *self.room {
            *self.room -= size;
            self.rays.push(ray);
        } else {
            *self.unrecorded += 1;
        }
    }
}

/// A layer of the irradiance pyramid.
#[derive(Clone, Copy, Debug)]
pub struct LayerInfo {
    /// Radius of its discs, metres.
    pub radius: f32,
    /// Number of its estimates.
    pub estimates: usize,
    /// Memory that it takes, bytes.
    pub bytes: usize,
}

/// What was gathered at one hit.
#[derive(Clone, Debug)]
pub struct GatheredHit {
    /// Index of the hit.
    pub hit: usize,
    /// Global irradiance, W/m².
    pub irradiance: Rgb,
    /// What it adds to the pixel, W/(m² sr).
    pub contribution: Rgb,
    /// What one W/m² here adds to the pixel, 1/sr: the hit's weight over the rays of the pixel.
    pub weight: Rgb,
    /// Rays of the gather, in their order: all, or as many as there was room for.
    pub rays: Vec<RecordedRay>,
    /// The same in f64, so that no bit of the sum is lost.
    exact: DVec3,
}

/// How a gather ray ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum RayEnd {
    /// Met nothing.
    Open,
    /// Met a light, which is counted elsewhere.
    Light,
    /// Met a surface that returns nothing, or too many specular ones.
    Lost,
    /// Gathered a second time, because the surface was near.
    Second,
    /// Looked the nearest photons up.
    Photons,
    /// Took the nearest estimate.
    Nearest,
    /// Took the mean of the estimates inside its footprint.
    Footprint,
    /// Took the nearest estimate because its footprint held none.
    EmptyFootprint,
    /// Ended where nothing is known of the light.
    Unknown,
}

impl RayEnd {
    /// That of a ray.
    pub fn of(ray: &RecordedRay) -> Self {
        match (ray.missed, ray.second, ray.used) {
            (Some(NoHit::Open), ..) => Self::Open,
            (Some(NoHit::Light), ..) => Self::Light,
            (Some(NoHit::Lost), ..) => Self::Lost,
            (None, true, _) => Self::Second,
            (.., Used::Photons) => Self::Photons,
            (.., Used::Nearest) => Self::Nearest,
            (.., Used::Footprint(_)) => Self::Footprint,
            (.., Used::NearestOf(_)) => Self::EmptyFootprint,
            (.., Used::None) => Self::Unknown,
        }
    }

    /// Its name for people, in a word or two.
    pub fn title(self) -> &'static str {
        match self {
            Self::Open => "open",
            Self::Light => "light",
            Self::Lost => "lost",
            Self::Second => "second gather",
            Self::Photons => "photons",
            Self::Nearest => "nearest estimate",
            Self::Footprint => "footprint",
            Self::EmptyFootprint => "empty footprint",
            Self::Unknown => "unknown light",
        }
    }
}

impl Gathering {
    /// What it adds to the pixel, W/(m² sr).
    pub fn sum(&self) -> DVec3 {
        self.hits.iter().map(|h| h.exact).sum()
    }

    /// Every ray as the indices of its entry in [`Gathering::hits`] and among the rays there, by falling contribution to
    /// the pixel's mean channel.
    pub fn strongest(&self) -> Vec<[usize; 2]> {
        let each = self.hits.iter().enumerate();
        let mut all: Vec<[usize; 2]> = each.flat_map(|(h, of)| (0..of.rays.len()).map(move |r| [h, r])).collect();
        let key = |at: &[usize; 2]| self.adds(*at).element_sum();
        // The sort is stable: rays of one strength stay in their order.
        all.sort_by(|a, b| key(b).total_cmp(&key(a)));
        all
    }

    /// The ray of those indices.
    pub fn ray(&self, [hit, ray]: [usize; 2]) -> Option<&RecordedRay> {
        self.hits.get(hit)?.rays.get(ray)
    }

    /// What the ray of those indices adds to the pixel, W/(m² sr).
    pub fn adds(&self, at: [usize; 2]) -> Rgb {
        self.ray(at).map_or(Rgb::ZERO, |ray| ray.contribution * self.hits[at[0]].weight)
    }

    /// How many rays ended in which way; ways that none took are not there.
    pub fn ends(&self) -> BTreeMap<RayEnd, usize> {
        let mut ends = BTreeMap::new();
        for ray in self.hits.iter().flat_map(|h| &h.rays) {
            *ends.entry(RayEnd::of(ray)).or_insert(0) += 1;
        }
        ends
    }

    /// Rays that used each layer, in the order of the layers; those of the nearest estimate used the first.
    pub fn rays_by_layer(&self) -> Vec<usize> {
        let mut used = vec![0; self.layers.len()];
        for ray in self.hits.iter().flat_map(|h| &h.rays) {
            if let Some(n) = layer_of(ray).and_then(|l| used.get_mut(l)) {
                *n += 1;
            }
        }
        used
    }

    /// Adds what was gathered at `hits`, whose first is number `first` of the inspection.
    pub(super) fn add(&mut self, view: &ViewPass, slot: &Slot, hits: &[ViewHit], first: usize, rays_per_pixel: u32) {
        let Some(gatherer) = view.gatherer(slot) else { return };
        let mut scratch = GatherScratch::default();
        for (i, hit) in hits.iter().enumerate() {
            let mut recorder = Recorder { rays: Vec::new(), room: &mut self.room, unrecorded: &mut self.unrecorded };
            let irradiance = gatherer.irradiance(&hit.point(), hit.seed, &mut scratch, &mut recorder);
            let rays = recorder.rays;
            let weight = hit.weight.as_dvec3() / f64::from(rays_per_pixel);
            let exact = irradiance * weight;
            self.hits.push(GatheredHit {
                hit: first + i,
                irradiance: in_f32(irradiance).0,
                contribution: in_f32(exact).0,
                weight: in_f32(weight).0,
                rays,
                exact,
            });
        }
        self.counts += scratch.counts;
    }
}

/// Layer that a ray's irradiance came from; None if from none.
pub fn layer_of(ray: &RecordedRay) -> Option<usize> {
    match ray.used {
        Used::Nearest => Some(0),
        Used::Footprint(layer) | Used::NearestOf(layer) => Some(layer),
        Used::Photons | Used::None => None,
    }
}

/// Longest and shortest semi-axis of the footprint that a ray has where it ends, as the look-up takes it, metres. Below
/// `floor` (metres) they are raised to it.
pub fn semi_axes(hit: &GatherHit, floor: f32) -> [f32; 2] {
    let longest = Ellipse::new(hit.position, hit.footprint, hit.normal, floor);
    let area = longest.transform.inverse_area.recip();
    [longest.longest(), area / (PI * longest.longest())]
}

/// The disc of directions that a ray stands for as the hemisphere over a surface of unit `normal` shows it, seen along the
/// normal: a polygon in the unit disc, along the tangents of [`tangents`]. What lies below the surface is drawn on the rim.
/// A ray without a disc gives a single point.
pub fn disc_of_directions(normal: Vec3, ray: &RecordedRay, sides: usize) -> Vec<Vec2> {
    let (x, y) = tangents(normal);
    let seen = |direction: Vec3| {
        let flat = Vec2::new(direction.dot(x), direction.dot(y));
        if direction.dot(normal) < 0.0 { flat.normalize_or_zero() } else { flat }
    };
    if ray.radius <= 0.0 {
        return vec![seen(ray.direction)];
    }
    let (t, b) = tangents(ray.direction);
    let turn = std::f32::consts::TAU / sides as f32;
    let on_rim = |i: usize| {
        let (sin, cos) = sin_cos(i as f32 * turn);
        seen((ray.direction + (t * cos + b * sin) * ray.radius).normalize())
    };
    (0..sides).map(on_rim).collect()
}

/// Final gatherings of those slots that gather finally, without hits yet.
pub(super) fn all(view: &ViewPass, slots: &[Slot]) -> Vec<Gathering> {
    let each = slots.iter().enumerate();
    each.filter_map(|(estimator, slot)| {
        let settings = *view.tracer.plan.final_gathering(slot.estimator)?;
        let pyramid = view.gathering.pyramid(&settings);
        Some(Gathering {
            estimator,
            settings,
            radius: view.gathering.radius(&settings),
            layers: pyramid.map_or(&[][..], |p| p.layers()).iter().map(LayerInfo::of).collect(),
            memory: pyramid.map(|p| *p.memory()),
            hits: Vec::new(),
            counts: GatherCounts::default(),
            unrecorded: 0,
            room: MOST,
        })
    })
    .collect()
}

impl LayerInfo {
    fn of(layer: &crate::photons::irradiance::Layer) -> Self {
        Self { radius: layer.radius(), estimates: layer.estimates().len(), bytes: layer.bytes() }
    }
}

/// Radius and estimate of an index that a ray recorded; None if it is not of that pyramid.
pub fn estimate(
    maps: &crate::final_gather::GatherMaps,
    settings: &FinalGathering,
    (layer, index): (usize, u32),
) -> Option<(f32, IrradianceEstimate)> {
    let layer = maps.pyramid(settings)?.layers().get(layer)?;
    Some((layer.radius(), *layer.estimates().get(index as usize)?))
}
