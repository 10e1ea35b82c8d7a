//! Bias of the irradiance estimate, its parts measured apart, against an image by an independent renderer.
//!
//! The parts of the mean over many photon maps add up: what photons of other surfaces bring (**surface**), what a wrong
//! area makes of the own ones (**boundary**), the `1/(k - 1)` of the k-th photon's disc (**count**), and what is left to
//! the truth, which is that photons come from a distance (**distance**).

use crate::measure::Reference;
use crate::measure::realtime::statistics::median;
use crate::realtime::distribution::Distribution;
use crate::realtime::estimate::{Estimator, Scratch};
use crate::realtime::settings::{Area, Search};
use crate::realtime::{Engine, RealtimeSettings};
use crate::scene::{Light, Scene};
use crate::trace::{Intersector, Ray, Surface};
use glam::Vec3;
use rayon::prelude::*;
use serde::Serialize;
use std::f64::consts::PI;
use std::sync::Arc;
use std::time::Instant;

/// One way to estimate.
#[derive(Clone, Copy, Debug)]
pub struct Variant {
    /// Its name in tables.
    pub name: &'static str,
    search: Search,
    slice: bool,
    direction: bool,
    area: Area,
}

const fn variant(name: &'static str, search: Search, slice: bool, direction: bool, area: Area) -> Variant {
    Variant { name, search, slice, direction, area }
}

/// The searches of section 3.5.1 over the disc, then the areas of figure 3.10 over the slice.
pub const VARIANTS: [Variant; 11] = [
    variant("sphere", Search::Sphere, false, false, Area::Disc),
    variant("incoming direction", Search::Sphere, false, true, Area::Disc),
    variant("sphere slice", Search::Sphere, true, false, Area::Disc),
    variant("cylinder", Search::Cylinder, false, false, Area::Disc),
    variant("ellipsoid", Search::Ellipsoid, false, false, Area::Disc),
    variant("slice, hull", Search::Sphere, true, false, Area::Hull),
    variant("slice, hull as published", Search::Sphere, true, false, Area::HullAsPublished),
    variant("slice, bounding circle", Search::Sphere, true, false, Area::Circle),
    variant("slice, axis-aligned box", Search::Sphere, true, false, Area::AlignedBox),
    variant("slice, oriented box", Search::Sphere, true, false, Area::OrientedBox),
    variant("slice, ellipse", Search::Sphere, true, false, Area::Ellipse),
];

impl Variant {
    fn of(&self, s: &RealtimeSettings) -> RealtimeSettings {
        RealtimeSettings {
            search: self.search,
            sphere_slice: self.slice,
            incoming_direction: self.direction,
            area: self.area,
            ..s.clone()
        }
    }
}

/// Where in a scene an estimate is made, by what lies within the radius of a full search.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Region {
    /// One surface, evenly lit.
    Interior,
    /// The end of a surface, with another at an angle or without.
    Edge,
    /// Two more surfaces.
    Corner,
    /// The border of a shadow on one surface.
    Shadow,
}

impl Region {
    /// All of them.
    pub const ALL: [Self; 4] = [Self::Interior, Self::Edge, Self::Corner, Self::Shadow];

    /// Its name.
    pub fn name(self) -> &'static str {
        ["interior", "edge", "corner", "shadow"][self as usize]
    }
}

/// A place with its true irradiance.
#[derive(Clone, Debug)]
pub struct Probe {
    position: Vec3,
    normal: Vec3,
    region: Region,
    truth: f64,
    reach: f32,
    /// How many of the first points of [`around`] lie on the surface itself where photons can arrive.
    open: Arc<Vec<u32>>,
}

impl Probe {
    /// Area of the surface itself within a radius up to the probe's reach, where photons can arrive, m².
    fn area(&self, radius: f32) -> f64 {
        let disc = PI * f64::from(radius).powi(2);
        let share = f64::from(radius / self.reach).min(1.0).powi(2);
        let n = ((share * f64::from(POINTS)) as usize).clamp(1, POINTS as usize);
        disc * f64::from(self.open[n - 1]) / n as f64
    }
}

/// Points of a disc by which the area of a surface within it is told.
const POINTS: u32 = 1024;

/// Points of the unit disc in the order of their radius: of the first n all have the same share of its area.
fn around() -> impl Iterator<Item = (f32, f32)> {
    Distribution::Spiral.set(POINTS as usize, 0).into_iter().map(|[u, v]| {
        // From the rim of the spiral's sphere to the middle of the disc.
        let (s, c) = crate::math::elementary::sin_cos(std::f32::consts::TAU * v);
        let r = (1.0 - u).max(0.0).sqrt();
        (r * c, r * s)
    })
}

/// Means over the places of a region, relative to their mean true irradiance.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Parts {
    /// Estimate less truth: the sum of the parts.
    pub total: f64,
    /// Photons of other surfaces.
    pub surface: f64,
    /// The area is not that of the surface.
    pub boundary: f64,
    /// The k-th photon's disc holds one photon too many.
    pub count: f64,
    /// The surface is lit otherwise at a distance.
    pub distance: f64,
    /// Root of the mean square of the boundary part of each place, which does not cancel.
    pub boundary_rms: f64,
    /// The same of the total.
    pub total_rms: f64,
}

/// A row of the table: a variant in a region.
#[derive(Clone, Debug, Serialize)]
pub struct BiasRow {
    /// The variant.
    pub variant: &'static str,
    /// The region.
    pub region: Region,
    /// Places in it.
    pub places: usize,
    /// Its bias.
    pub parts: Parts,
}

/// What the variants cost.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct BiasTime {
    /// The variant.
    pub variant: &'static str,
    /// Microseconds of an estimate on one thread, the median of the repeats.
    pub microseconds: f64,
    /// Over those of the sphere in the same repeat: least, median and most of the repeats.
    pub ratio: [f64; 3],
}

/// The table, and the time of each variant.
#[derive(Clone, Debug, Serialize)]
pub struct BiasReport {
    /// Photons in a map.
    pub photons: usize,
    /// Maps that were averaged.
    pub maps: u32,
    /// One row for each variant in each region.
    pub rows: Vec<BiasRow>,
    /// One for each variant.
    pub times: Vec<BiasTime>,
}

impl BiasReport {
    /// The parts of a variant in a region; zero if there is none.
    pub fn parts(&self, variant: &str, region: Region) -> Parts {
        self.rows.iter().find(|r| r.variant == variant && r.region == region).map_or(Parts::default(), |r| r.parts)
    }

    /// The time of a variant.
    pub fn time(&self, variant: &str) -> Option<&BiasTime> {
        self.times.iter().find(|t| t.variant == variant)
    }
}

/// Places on the diffuse surfaces that the pixels of a reference show, every `step`-th each way, whose neighbours show the
/// same surface; `reach` is the radius by which their region is told, metres.
pub fn probes(scene: &Scene, reference: &Reference, reach: f32, step: usize) -> Vec<Probe> {
    let size = reference.image.size;
    let intersector = Intersector::new(&scene.geometry, scene.radius);
    let rays = scene.camera.rays(size);
    let hit = |x: i64, y: i64| {
        let ray = Ray { origin: scene.camera.position, direction: rays.ray(x as f32 + 0.5, y as f32 + 0.5, 0.5).0 };
        intersector.closest(&ray).map(|h| Surface::new(scene, &ray, &h))
    };
    let [w, h] = size.map(|s| s as usize);
    let places: Vec<(usize, usize)> =
        (1..h - 1).step_by(step).flat_map(|y| (1..w - 1).step_by(step).map(move |x| (x, y))).collect();
    places
        .into_par_iter()
        .filter_map(|(x, y)| {
            let at = y * w + x;
            if !reference.mask.counts.get(at).copied().unwrap_or(false) {
                return None;
            }
            let surface = hit(x as i64, y as i64)?;
            let material = &scene.materials[surface.material as usize];
            let around = [(-1, 0), (1, 0), (0, -1), (0, 1)];
            let same = around.iter().all(|(dx, dy)| {
                hit(x as i64 + dx, y as i64 + dy).is_some_and(|s| in_one_plane(&surface, s.position, s.normal, scene))
            });
            let reflectance = material.diffuse_reflectance(surface.uv);
            if !same || reflectance.min_element() <= 0.0 {
                return None;
            }
            // The mean of the channels of the irradiance: E = π L/ρ.
            let e = (reference.image.pixels[at] / reflectance).as_dvec3() * PI;
            let truth = (e.x + e.y + e.z) / 3.0;
            let open = Arc::new(open(scene, &intersector, &surface, reach));
            let whole = open.last() == Some(&POINTS);
            let region = match region(scene, &intersector, &surface, reach)? {
                Region::Interior | Region::Shadow if !whole => Region::Edge,
                other => other,
            };
            Some(Probe { position: surface.position, normal: surface.normal, region, truth, reach, open })
        })
        .collect()
}

/// Whether a photon or hit lies on the surface itself, and not on another.
fn in_one_plane(surface: &Surface, position: Vec3, normal: Vec3, scene: &Scene) -> bool {
    surface.normal.dot(normal) > 0.999 && (position - surface.position).dot(surface.normal).abs() < 1e-4 * scene.radius
}

/// How many of the first points around a place lie on its surface and not under another body, for every number of them.
fn open(scene: &Scene, intersector: &Intersector, surface: &Surface, reach: f32) -> Vec<u32> {
    let (x, y) = crate::math::frame::tangents(surface.normal);
    let lift = scene.radius * 1e-4;
    let mut count = 0;
    around()
        .map(|(a, b)| {
            let origin = surface.position + (x * a + y * b) * reach + surface.normal * lift;
            let met = |direction: Vec3| {
                let ray = Ray { origin, direction };
                intersector.closest(&ray).map(|h| (h.t, Surface::new(scene, &ray, &h).front))
            };
            let on_it = met(-surface.normal).is_some_and(|(t, _)| t < 2.0 * lift);
            // Under a body the way up meets its inside.
            let covered = met(surface.normal).is_some_and(|(_, front)| !front);
            count += u32::from(on_it && !covered);
            count
        })
        .collect()
}

/// Directions in the surface along which a region is explored.
const AROUND: u32 = 32;

fn region(scene: &Scene, intersector: &Intersector, surface: &Surface, reach: f32) -> Option<Region> {
    let (x, y) = crate::math::frame::tangents(surface.normal);
    let lift = surface.normal * (scene.radius * 1e-4);
    let (mut walls, mut ends) = (Vec::<Vec3>::new(), false);
    let mut lit = Vec::new();
    for i in 0..AROUND {
        let turn = std::f32::consts::TAU * i as f32 / AROUND as f32;
        let (s, c) = crate::math::elementary::sin_cos(turn);
        let out = (x * c + y * s).normalize();
        let ray = Ray { origin: surface.position + lift, direction: out };
        if let Some(hit) = intersector.closest(&ray)
            && hit.t < reach
        {
            let wall = Surface::new(scene, &ray, &hit).normal;
            if walls.iter().all(|w| w.dot(wall) < 0.9) {
                walls.push(wall);
            }
            continue;
        }
        for part in [0.35, 0.7, 1.0] {
            let at = surface.position + out * (reach * part);
            let down = Ray { origin: at + lift, direction: -surface.normal };
            let below = intersector.closest(&down).is_some_and(|h| h.t < 2e-4 * scene.radius);
            ends |= !below;
            if below {
                lit.push(visible_share(scene, intersector, at, surface.normal));
            }
        }
    }
    let spread = lit.iter().fold((1.0f32, 0.0f32), |(l, h), x| (l.min(*x), h.max(*x)));
    Some(match (walls.len(), ends) {
        (2.., _) => Region::Corner,
        (1, _) | (_, true) => Region::Edge,
        _ if spread.1 - spread.0 > 0.5 => Region::Shadow,
        // A faint penumbra is neither.
        _ if spread.1 - spread.0 > 0.05 => return None,
        _ => Region::Interior,
    })
}

/// Share of the first light, if it has an area, that a place sees.
fn visible_share(scene: &Scene, intersector: &Intersector, at: Vec3, normal: Vec3) -> f32 {
    let origin = at + normal * (scene.radius * 1e-4);
    let points: Vec<Vec3> = match scene.lights.first() {
        Some(Light::Quad { center, u, v, .. }) => {
            let side = [-0.75, -0.25, 0.25, 0.75];
            side.iter().flat_map(|a| side.iter().map(move |b| *center + *u * *a + *v * *b)).collect()
        }
        Some(Light::Point { position, .. } | Light::Spot { position, .. }) => vec![*position],
        Some(Light::Sphere { center, .. }) => vec![*center],
        _ => return 1.0,
    };
    let seen = points.iter().filter(|p| {
        let to = **p - origin;
        let distance = to.length();
        !intersector.any(&Ray { origin, direction: to / distance }, distance * 0.999)
    });
    seen.count() as f32 / points.len() as f32
}

/// Measures every variant at the probes over `maps` photon maps of `settings`, each with a seed of its own; `watch` is
/// told of each map, and says whether to go on.
///
/// None if it was stopped.
pub fn bias(
    scene: &Arc<Scene>,
    settings: &RealtimeSettings,
    probes: &[Probe],
    maps: u32,
    repeats: u32,
    mut watch: impl FnMut() -> bool,
) -> Option<BiasReport> {
    let mut sums = vec![[Sum::default(); VARIANTS.len()]; probes.len()];
    let mut photons = 0;
    let mut last = None;
    for map in 0..maps {
        let seed = settings.seed + u64::from(map);
        let mut engine = Engine::new(scene, RealtimeSettings { seed, mesh_refinement: 0, ..settings.clone() });
        (0..settings.accumulation_frames).for_each(|_| engine.step(0.0, &scene.camera));
        for (v, variant) in VARIANTS.iter().enumerate() {
            let s = variant.of(settings);
            let estimator = Estimator::new(scene, engine.world(), engine.map(), &s);
            sums.par_iter_mut().zip(probes).for_each_init(Scratch::default, |scratch, (sums, probe)| {
                sums[v].add(&estimator, &engine, probe, s.max_search_count, scratch);
            });
        }
        photons = engine.map().photons().len();
        last = Some(engine);
        if !watch() {
            return None;
        }
    }
    let times = time(scene, &last?, settings, probes, repeats);
    let mut rows = Vec::new();
    for (v, variant) in VARIANTS.iter().enumerate() {
        for region in Region::ALL {
            let of: Vec<(&Probe, &Sum)> =
                probes.iter().zip(&sums).filter(|(p, _)| p.region == region).map(|(p, s)| (p, &s[v])).collect();
            rows.push(BiasRow { variant: variant.name, region, places: of.len(), parts: parts(&of, f64::from(maps)) });
        }
    }
    Some(BiasReport { photons, maps, rows, times })
}

/// Sums over the maps at one place.
#[derive(Clone, Copy, Default)]
struct Sum {
    estimate: f64,
    own: f64,
    over_true_area: f64,
    counted: f64,
}

impl Sum {
    fn add(&mut self, estimator: &Estimator, engine: &Engine, probe: &Probe, k: u32, scratch: &mut Scratch) {
        let found = estimator.direct_gathering(probe.position, probe.normal, scratch);
        let (photons, radius) = (engine.map().photons(), engine.scene().radius);
        let (mut all, mut own) = (0.0, 0.0);
        for (_, i) in scratch.found().iter() {
            let p = &photons[i as usize];
            let power = p.power.as_dvec3();
            let power = (power.x + power.y + power.z) / 3.0 * estimator.scale();
            all += power;
            let in_plane = p.normal.dot(probe.normal) > 0.999
                && (p.position - probe.position).dot(probe.normal).abs() < 1e-4 * radius;
            own += if in_plane { power } else { 0.0 };
        }
        let area = probe.area(found.radius).max(f64::MIN_POSITIVE);
        self.estimate += all / found.area;
        self.own += own / found.area;
        self.over_true_area += own / area;
        // With the k-th photon on the rim, k - 1 lie inside.
        let full = found.count == k && k > 1;
        self.counted += own / area * if full { f64::from(k - 1) / f64::from(k) } else { 1.0 };
    }
}

fn parts(of: &[(&Probe, &Sum)], maps: f64) -> Parts {
    let n = of.len().max(1) as f64;
    let truth = of.iter().map(|(p, _)| p.truth).sum::<f64>() / n;
    if truth <= 0.0 {
        return Parts::default();
    }
    let mean = |f: &dyn Fn(&Probe, &Sum) -> f64| of.iter().map(|(p, s)| f(p, s)).sum::<f64>() / (n * maps * truth);
    let rms = |f: &dyn Fn(&Probe, &Sum) -> f64| {
        (of.iter().map(|(p, s)| (f(p, s) / maps).powi(2)).sum::<f64>() / n).sqrt() / truth
    };
    Parts {
        total: mean(&|p, s| s.estimate - maps * p.truth),
        surface: mean(&|_, s| s.estimate - s.own),
        boundary: mean(&|_, s| s.own - s.over_true_area),
        count: mean(&|_, s| s.over_true_area - s.counted),
        distance: mean(&|p, s| s.counted - maps * p.truth),
        boundary_rms: rms(&|_, s| s.own - s.over_true_area),
        total_rms: rms(&|p, s| s.estimate - maps * p.truth),
    }
}

/// Times the variants in turn on one map, `repeats` times, one thread.
fn time(scene: &Scene, engine: &Engine, settings: &RealtimeSettings, probes: &[Probe], repeats: u32) -> Vec<BiasTime> {
    let mut seconds = vec![Vec::new(); VARIANTS.len()];
    let mut scratch = Scratch::default();
    for _ in 0..repeats {
        for (v, variant) in VARIANTS.iter().enumerate() {
            let s = variant.of(settings);
            let estimator = Estimator::new(scene, engine.world(), engine.map(), &s);
            let started = Instant::now();
            for p in probes {
                std::hint::black_box(estimator.direct_gathering(p.position, p.normal, &mut scratch));
            }
            seconds[v].push(started.elapsed().as_secs_f64() / probes.len().max(1) as f64);
        }
    }
    VARIANTS
        .iter()
        .zip(&seconds)
        .map(|(v, own)| {
            let ratios: Vec<f64> = own.iter().zip(&seconds[0]).map(|(a, b)| a / b).collect();
            let ends = |f: fn(f64, f64) -> f64, from: f64| ratios.iter().copied().fold(from, f);
            BiasTime {
                variant: v.name,
                microseconds: 1e6 * median(own),
                ratio: [ends(f64::min, f64::INFINITY), median(&ratios), ends(f64::max, 0.0)],
            }
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::realtime::settings::set;
    use crate::scene::open;
    use crate::scene::scene_file::RealtimeFile;

    /// On `cornell` the parts add up, the sphere leaks in corners, the slice hardly does, and the hull mends its area.
    #[test]
    fn biases_are_where_they_are_looked_for() {
        let scene = Arc::new(open("cornell").expect("built in"));
        let reference = Reference::built_in("cornell").expect("reads").expect("is there");
        let mut table = RealtimeFile::default();
        for text in [
            "photons_from_light=1500",
            "accumulation_frames=4",
            "scattering=roulette",
            "recursion_depth=20",
            "max_search_radius=0.25",
        ] {
            set(&mut table, text).expect(text);
        }
        let settings = RealtimeSettings::new(&scene, &table, 1).expect("valid");
        let probes = probes(&scene, &reference, 0.25, 7);
        for region in Region::ALL {
            assert!(probes.iter().filter(|p| p.region == region).count() > 4, "{region:?}");
        }
        let report = bias(&scene, &settings, &probes, 16, 1, || true).expect("not stopped");
        for r in &report.rows {
            let p = r.parts;
            assert!((p.total - (p.surface + p.boundary + p.count + p.distance)).abs() < 1e-9);
        }
        let inside = report.parts("sphere slice", Region::Interior);
        assert!(inside.surface.abs() < 1e-9 && inside.boundary.abs() < 1e-6 && inside.total.abs() < 0.1, "{inside:?}");
        let [sphere, slice] = ["sphere", "sphere slice"].map(|v| report.parts(v, Region::Corner));
        assert!(sphere.surface > 0.2 && slice.surface < 0.1 * sphere.surface, "{sphere:?} {slice:?}");
        let hull = report.parts("slice, hull", Region::Corner);
        assert!(slice.boundary < -0.2 && hull.boundary_rms < 0.5 * slice.boundary_rms, "{slice:?} {hull:?}");
    }
}
