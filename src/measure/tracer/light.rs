//! A light tracer: photons from the lights, joined to the pinhole camera at every diffuse surface.

use crate::math::hash::mix;
use crate::math::sequence::{Sampling, Sequence};
use crate::measure::tracer::directions;
use crate::measure::tracer::emission::{Aim, start};
use crate::measure::tracer::pinhole::Pinhole;
use crate::measure::tracer::scattering::{medium_at, medium_beyond, specular, transmittance};
use crate::scene::{Material, Scene};
use crate::trace::{Intersector, Ray, Surface};
use glam::{DVec3, Vec3};
use rayon::prelude::*;
use std::f64::consts::FRAC_1_PI;
use std::sync::atomic::{AtomicBool, Ordering};

/// Photons of a chunk; chunks are added up in order, so that threads do not show.
const CHUNK: u64 = 1 << 13;

/// Photons from the lights.
///
/// A pixel gets what diffuse surfaces that it sees directly reflect; what it sees by specular surfaces stays black.
pub struct LightTracer<'a> {
    /// The scene.
    pub scene: &'a Scene,
    /// Its intersector.
    pub intersector: &'a Intersector,
    /// The camera.
    pub camera: Pinhole,
    /// Kinds of light whose photons count.
    pub parts: Parts,
    /// Whether only light counts whose first surface is specular.
    pub specular_first: bool,
    /// Surfaces that a photon may meet.
    pub max_depth: u32,
    /// Where some of the photons are aimed.
    pub aim: Option<Aim>,
}

/// Kinds of light.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Parts {
    /// Straight from the light.
    pub direct: bool,
    /// By specular surfaces alone.
    pub caustic: bool,
    /// Any other.
    pub global: bool,
}

/// What a photon adds to a pixel.
struct Splat {
    pixel: u32,
    value: Vec3,
}

impl LightTracer<'_> {
    /// One batch of `photons`, shared among the lights by flux; None if cancelled. Different seeds give independent
    /// images. Radiance in W/(m² sr), row by row.
    pub fn batch(&self, photons: u64, seed: u64, cancelled: &(dyn Fn() -> bool + Sync)) -> Option<Vec<DVec3>> {
        let [w, h] = self.camera.size();
        let mut image = vec![DVec3::ZERO; w as usize * h as usize];
        let flux = |i: usize| f64::from(self.scene.lights[i].flux().element_sum());
        let total: f64 = (0..self.scene.lights.len()).map(flux).sum();
        for light in 0..self.scene.lights.len() {
            let share = flux(light) / total;
            if share > 0.0 && share.is_finite() {
                let count = ((share * photons as f64) as u64).max(1);
                self.add_light(light, count, mix(seed, light as u64), &mut image, cancelled)?;
            }
        }
        Some(image)
    }

    fn add_light(
        &self,
        light: usize,
        count: u64,
        seed: u64,
        image: &mut [DVec3],
        cancelled: &(dyn Fn() -> bool + Sync),
    ) -> Option<()> {
        let sequence = Sequence::new(Sampling::Sobol, seed);
        let stopped = AtomicBool::new(false);
        let chunks: Vec<Vec<Splat>> = (0..count.div_ceil(CHUNK))
            .into_par_iter()
            .map(|chunk| {
                let mut splats = Vec::new();
                if stopped.load(Ordering::Relaxed) || cancelled() {
                    stopped.store(true, Ordering::Relaxed);
                    return splats;
                }
                for i in chunk * CHUNK..count.min((chunk + 1) * CHUNK) {
                    self.photon(light, i, &sequence, &mut splats);
                }
                splats
            })
            .collect();
        if stopped.load(Ordering::Relaxed) {
            return None;
        }
        let each = 1.0 / count as f64;
        for splat in chunks.iter().flatten() {
            image[splat.pixel as usize] += splat.value.as_dvec3() * each;
        }
        Some(())
    }

    /// Follows one photon that carries all of its light's flux.
    fn photon(&self, light: usize, index: u64, sequence: &Sequence, splats: &mut Vec<Splat>) {
        let light = &self.scene.lights[light];
        let Some(first) = start(self.scene, light, self.aim.as_ref(), sequence.four(index, 0)) else {
            return;
        };
        let mut ray = first.ray;
        let whole = light.flux().as_dvec3() * first.weight;
        let mut power = whole;
        let mut medium = None;
        let (mut straight, mut scattered) = (true, false);
        for bounce in 0..self.max_depth {
            let Some(hit) = self.intersector.closest(&ray) else {
                return;
            };
            let surface = Surface::new(self.scene, &ray, &hit);
            medium = medium_at(self.scene, medium, &surface);
            power *= transmittance(self.scene, medium, hit.t);
            let x = sequence.four(index, 1 + bounce);
            match &self.scene.materials[surface.material as usize] {
                Material::Emitter { .. } => return,
                Material::Diffuse { .. } if bounce == 0 && self.specular_first => return,
                material @ Material::Diffuse { .. } => {
                    let counts = match (scattered, straight) {
                        (true, _) => self.parts.global,
                        (false, true) => self.parts.direct,
                        (false, false) => self.parts.caustic,
                    };
                    let reflectance = material.diffuse_reflectance(surface.uv).as_dvec3();
                    power *= reflectance;
                    if counts {
                        self.join(&surface, power, splats);
                    }
                    if !self.parts.global {
                        return;
                    }
                    let survival = (power.max_element() / whole.max_element()).min(1.0);
                    if f64::from(x[0]) >= survival || survival.is_nan() {
                        return;
                    }
                    power /= survival;
                    scattered = true;
                    let w = directions::cosine(surface.normal.as_dvec3(), f64::from(x[2]), f64::from(x[3])).as_vec3();
                    ray = Ray { origin: surface.leave(self.scene, w), direction: w };
                }
                material => {
                    let v = ray.direction.as_dvec3();
                    let Some(next) = specular(material, &surface, v, f64::from(x[0])) else {
                        return;
                    };
                    power *= next.weight;
                    if power.max_element() <= 0.0 {
                        return;
                    }
                    if next.through {
                        medium = medium_beyond(&surface);
                    }
                    let w = next.direction.as_vec3();
                    ray = Ray { origin: surface.leave(self.scene, w), direction: w };
                }
            }
            straight = false;
        }
    }

    /// Adds what the camera sees of a diffuse surface that reflects `power`, W.
    fn join(&self, surface: &Surface, power: DVec3, splats: &mut Vec<Splat>) {
        let Some(seen) = self.camera.sees(surface.position.as_dvec3()) else {
            return;
        };
        let cos = seen.towards.dot(surface.normal.as_dvec3());
        if cos <= 0.0 {
            return;
        }
        let value = power * (FRAC_1_PI * cos * seen.importance);
        if value == DVec3::ZERO || !value.as_vec3().is_finite() {
            return;
        }
        let origin = surface.leave(self.scene, seen.towards.as_vec3());
        let way = self.camera.eye() - origin.as_dvec3();
        let distance = way.length();
        let ray = Ray { origin, direction: (way / distance).as_vec3() };
        if !self.intersector.any(&ray, distance as f32) {
            splats.push(Splat { pixel: seen.pixel, value: value.as_vec3() });
        }
    }
}
