//! Emission and scattering of the photons of one frame (section 5.2).

use crate::math::frame::{concentric_disc, tangents};
use crate::math::hash::mix;
use crate::math::rgb::{Rgb, mean};
use crate::math::sequence::{Sampling, Sequence};
use crate::photons::emission::emit;
use crate::photons::path::{attenuation, medium_before};
use crate::realtime::directions::{self, Directions};
use crate::realtime::photon::Photon;
use crate::realtime::settings::{RealtimeSettings, Scattering};
use crate::realtime::world::World;
use crate::scene::{Light, Scene};
use crate::trace::scatter::{reflected, refracted, specular_weights};
use crate::trace::surface::SELF_INTERSECTION;
use crate::trace::{Differential, Ray, Surface};
use glam::Vec3;
use rayon::prelude::*;

/// Specular surfaces that a photon follows between two diffuse ones at most.
const MOST_SPECULAR: u32 = 8;

/// Least cosine by which a step back along a ray is lengthened.
const LEAST_COSINE: f32 = 0.05;

/// Radius of the disc on which a snowball's photons lie, over that of the search.
const SNOWBALL: f32 = 0.2;

/// What became of the photons of a frame.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct TraceCounts {
    /// Emitted by lights.
    pub emitted: u64,
    /// Rays traced, emitted and scattered.
    pub rays: u64,
    /// Stored.
    pub stored: u64,
    /// Rays that met nothing.
    pub lost: u64,
}

/// Photons of a light in a round of `accumulation_frames` frames.
struct Share {
    light: usize,
    count: usize,
    /// Power of each, as if its frame were the only one, W.
    power: Rgb,
    /// First of its photons among all of the round.
    first: usize,
    points: Vec<[f32; 2]>,
}

/// Traces photons frame by frame.
pub struct Tracer {
    shares: Vec<Share>,
    flux: Vec<Rgb>,
    directions: Directions,
    frames: usize,
}

impl Tracer {
    /// A tracer for these lights: each gets photons by its flux, and one a round at least.
    pub fn new(s: &RealtimeSettings, lights: &[Light]) -> Self {
        let frames = s.accumulation_frames as usize;
        let round = s.photons_from_light as usize * frames;
        let flux: Vec<Rgb> = lights.iter().map(Light::flux).collect();
        let total: f64 = flux.iter().map(|f| f64::from(mean(*f))).sum();
        let mut shares = Vec::new();
        let mut first = 0;
        for (light, f) in flux.iter().enumerate() {
            let own = f64::from(mean(*f));
            // What is no number has no photons.
            if !(own > 0.0 && total.is_finite()) {
                continue;
            }
            let count = ((own / total * round as f64).round() as usize).max(1);
            let points = if s.coherent { directions::emission(s, light, count, s.seed) } else { Vec::new() };
            let power = (f.as_dvec3() * (frames as f64 / count as f64)).as_vec3();
            shares.push(Share { light, count, power, first, points });
            first += count;
        }
        Self { shares, flux, directions: Directions::new(s, first, s.seed), frames }
    }

    /// Whether the tracer was made for lights of these fluxes.
    pub fn serves(&self, lights: &[Light]) -> bool {
        self.flux.len() == lights.len() && self.flux.iter().zip(lights).all(|(f, l)| *f == l.flux())
    }

    /// Directions that were made in advance.
    pub fn directions_kept(&self) -> usize {
        self.directions.kept()
    }

    /// Emits the photons of a frame into `store`, which is empty.
    ///
    /// They depend on the scene, the settings and the frame's number alone: with coherent numbers on that modulo
    /// `accumulation_frames`. The number of threads changes nothing.
    pub fn trace(
        &self,
        scene: &Scene,
        world: &World,
        lights: &[Light],
        s: &RealtimeSettings,
        frame: u64,
        store: &mut Vec<Photon>,
    ) -> TraceCounts {
        let slot = (frame % self.frames as u64) as usize;
        let seed = if s.coherent { s.seed } else { mix(s.seed, frame + 1) };
        let own = (!s.coherent).then(|| Directions::new(s, 0, seed));
        let directions = own.as_ref().unwrap_or(&self.directions);
        let mut starts = Vec::new();
        for share in &self.shares {
            // Photons `i` of the light with `i mod frames = slot`.
            let here = (share.count + self.frames - 1 - slot) / self.frames;
            let fresh = (!s.coherent).then(|| directions::emission(s, share.light, here, seed));
            let whole = share.count % self.frames == 0;
            for i in 0..here {
                // A round that does not divide evenly is dealt out one by one.
                let at = if whole {
                    s.light_distribution.place(i, slot, self.frames, share.count / self.frames)
                } else {
                    i * self.frames + slot
                };
                let point = fresh.as_ref().map_or_else(|| share.points[at], |p| p[i]);
                starts.push((share, at, point));
            }
        }
        let chunks: Vec<(Vec<Photon>, TraceCounts)> = starts
            .par_chunks(CHUNK)
            .map(|chunk| {
                let mut path =
                    Path { scene, world, s, directions, seed, out: Vec::new(), counts: TraceCounts::default() };
                for (share, at, point) in chunk {
                    path.emit(share, &lights[share.light], *at, *point);
                }
                (path.out, path.counts)
            })
            .collect();
        let mut counts = TraceCounts { emitted: starts.len() as u64, ..TraceCounts::default() };
        for (photons, c) in chunks {
            store.extend(photons);
            counts.rays += c.rays;
            counts.lost += c.lost;
        }
        counts.stored = store.len() as u64;
        counts
    }
}

/// Photons that a thread takes at a time.
const CHUNK: usize = 32;

struct Path<'a> {
    scene: &'a Scene,
    world: &'a World,
    s: &'a RealtimeSettings,
    directions: &'a Directions,
    seed: u64,
    out: Vec<Photon>,
    counts: TraceCounts,
}

impl Path<'_> {
    fn emit(&mut self, share: &Share, light: &Light, at: usize, [u, v]: [f32; 2]) {
        let branch = (share.first + at) as u64;
        // Where a light has area the distribution gives the direction, and Sobol points the place.
        let x = if light.has_area() {
            let x = Sequence::new(Sampling::Sobol, mix(self.seed, share.light as u64)).four(at as u64, 1);
            [x[0], x[1], u, v]
        } else {
            [u, v, 0.0, 0.0]
        };
        let start = emit(self.scene, light, share.count as f64, x);
        let ray = Ray { origin: start.origin, direction: start.direction };
        self.follow(ray, share.power, 0, branch, self.s.store_direct_light);
    }

    /// Follows a photon to a diffuse surface, stores it if `stored`, and sends on what is reflected there.
    fn follow(&mut self, mut ray: Ray, mut power: Rgb, level: u32, branch: u64, stored: bool) {
        let mut specular = 0;
        let (surface, t) = loop {
            self.counts.rays += 1;
            let Some(found) = self.world.closest(self.scene, &ray) else {
                self.counts.lost += 1;
                return;
            };
            let surface = self.world.surface(self.scene, &ray, &found);
            let material = &self.scene.materials[surface.material as usize];
            if material.is_diffuse() {
                break (surface, found.hit.t);
            }
            // Light that arrives at a light's surface ends there.
            let Some(w) = specular_weights(material, &surface, ray.direction) else { return };
            specular += 1;
            if specular > MOST_SPECULAR {
                return;
            }
            let medium = medium_before(self.scene, None, &surface);
            power *= attenuation(self.scene, medium, found.hit.t).unwrap_or(Rgb::ONE);
            let (a, b) = (mean(w.reflected), mean(w.refracted));
            let x = self.directions.choices(level, branch, specular)[0];
            let none = &Differential::NONE;
            let (next, share) = if x * (a + b) < a {
                (reflected(self.scene, &surface, ray.direction, none), w.reflected * ((a + b) / a))
            } else {
                (refracted(self.scene, &surface, ray.direction, none, w.eta), w.refracted * ((a + b) / b))
            };
            power *= share;
            let powerless = !(power.is_finite() && power.max_element() > 0.0);
            if powerless {
                return;
            }
            ray = Ray { origin: next.origin, direction: next.direction };
        };
        if stored {
            self.store(&surface, power, ray.direction, level, branch);
        }
        if level >= self.s.recursion_depth {
            return;
        }
        // Photons take the mean colour of a texture with them.
        let mut reflectance = self.scene.materials[surface.material as usize].average_reflectance();
        match self.s.scattering {
            Scattering::Splitting => reflectance /= self.s.diffuse_reflections as f32,
            Scattering::Roulette => {
                let survival = reflectance.max_element();
                let gone = self.directions.choices(level, branch, 0)[0] >= survival;
                if gone {
                    return;
                }
                reflectance /= survival;
            }
        }
        let power = power * reflectance;
        if power.max_element() <= 0.0 {
            return;
        }
        let origin = step_back(self.scene, &surface, &ray, t);
        let directions = self.directions;
        directions.reflections(level, branch, surface.normal, |twig, direction| {
            self.follow(Ray { origin, direction }, power, level + 1, twig, true);
        });
    }

    /// Stores a photon, or a snowball of them on a small disc about it (parameter 14).
    fn store(&mut self, surface: &Surface, power: Rgb, direction: Vec3, level: u32, branch: u64) {
        let photon = Photon { position: surface.position, power, direction, normal: surface.normal };
        let size = self.s.snowball_size;
        if size == 1 {
            self.out.push(photon);
            return;
        }
        let radius = self.s.max_search_radius * SNOWBALL;
        let (x, y) = tangents(surface.normal);
        let numbers = Sequence::new(Sampling::Sobol, mix(self.seed, mix(u64::from(level), branch)));
        for i in 0..size {
            let n = numbers.four(u64::from(i), 2);
            let (a, b) = concentric_disc(n[0], n[1]);
            let position = surface.position + (x * a + y * b) * radius;
            self.out.push(Photon { position, power: power / size as f32, ..photon });
        }
    }
}

/// Start of a path that leaves a surface: a step back along the ray that came, which stays in front of every other
/// surface in a narrow corner, where a step along the normal does not (figure 5.4). At grazing rays it is longer, so that
/// it leaves the surface by more than rounding, and never more than half the way back.
fn step_back(scene: &Scene, surface: &Surface, ray: &Ray, t: f32) -> Vec3 {
    let cosine = surface.normal.dot(ray.direction).abs().max(LEAST_COSINE);
    let step = (scene.radius * SELF_INTERSECTION / cosine).min(t / 2.0);
    surface.position - ray.direction * step
}
