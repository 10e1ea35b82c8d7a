//! A path tracer from the camera: box-filtered pixels, shadow rays to every kind of light.

use crate::math::hash::mix;
use crate::math::sequence::{Sampling, Sequence};
use crate::measure::tracer::directions;
use crate::measure::tracer::illumination::Illumination;
use crate::measure::tracer::pinhole::Pinhole;
use crate::measure::tracer::scattering::{medium_at, medium_beyond, specular, transmittance};
use crate::render::LightPart;
use crate::scene::{Material, Scene};
use crate::trace::{Intersector, Ray, Surface};
use glam::DVec3;
use rayon::prelude::*;
use std::f64::consts::FRAC_1_PI;
use std::sync::atomic::{AtomicBool, Ordering};

/// Dimension sets between those of one light and of the next.
const LIGHT_SETS: u32 = 4096;

/// Paths from the camera.
///
/// A path runs over specular surfaces to the first diffuse one; which part of the light it shows is decided by what lies
/// behind that. Light that reaches a diffuse surface straight comes by a shadow ray alone. Light that reaches it by way of
/// specular surfaces comes by paths that meet the light's surface alone, so there is none of lights without area.
pub struct PathTracer<'a> {
    /// The scene.
    pub scene: &'a Scene,
    /// Its intersector.
    pub intersector: &'a Intersector,
    /// Its lights.
    pub illumination: Illumination<'a>,
    /// The camera.
    pub camera: Pinhole,
    /// Which light is shown.
    pub light: LightPart,
    /// Whether light counts whose first surface is specular.
    pub specular_first: bool,
    /// Surfaces that a view path, and a path from a light, may meet; the one where they join counts in both.
    pub max_depth: u32,
}

/// A ray on its way, with the glass that it is in.
struct Way {
    ray: Ray,
    medium: Option<u32>,
    /// Numbers of surfaces met, which names its dimensions.
    met: u32,
}

impl PathTracer<'_> {
    /// One batch: the mean of `samples` paths for each pixel, row by row; None if cancelled. Different seeds give
    /// independent images.
    pub fn batch(&self, samples: u32, seed: u64, cancelled: &(dyn Fn() -> bool + Sync)) -> Option<Vec<DVec3>> {
        let [w, h] = self.camera.size();
        let mut image = vec![DVec3::ZERO; w as usize * h as usize];
        let stopped = AtomicBool::new(false);
        image.par_chunks_mut(w.max(1) as usize).enumerate().for_each(|(y, row)| {
            if stopped.load(Ordering::Relaxed) || cancelled() {
                stopped.store(true, Ordering::Relaxed);
                return;
            }
            for (x, pixel) in row.iter_mut().enumerate() {
                let index = y as u64 * u64::from(w) + x as u64;
                let sequence = Sequence::new(Sampling::Sobol, mix(seed, index));
                let sum = (0..samples).fold(DVec3::ZERO, |sum, i| sum + self.sample(x, y, &sequence, u64::from(i)));
                *pixel = sum / f64::from(samples.max(1));
            }
        });
        (!stopped.load(Ordering::Relaxed)).then_some(image)
    }

    fn shows(&self, part: LightPart) -> bool {
        self.light == LightPart::All || self.light == part
    }

    /// Radiance along one path through the pixel, W/(m² sr).
    fn sample(&self, x: usize, y: usize, sequence: &Sequence, index: u64) -> DVec3 {
        let jitter = sequence.four(index, 0);
        let ray = self.camera.ray(x as f64 + f64::from(jitter[0]), y as f64 + f64::from(jitter[1]));
        let mut way = Way { ray, medium: None, met: 0 };
        let mut throughput = DVec3::ONE;
        for depth in 1..=self.max_depth {
            let Some(surface) = self.meet(&mut way, &mut throughput) else {
                return DVec3::ZERO;
            };
            match &self.scene.materials[surface.material as usize] {
                Material::Emitter { radiance } => {
                    let seen = surface.front && self.shows(LightPart::Direct);
                    return if seen { throughput * radiance.as_dvec3() } else { DVec3::ZERO };
                }
                Material::Diffuse { .. } => return throughput * self.reflected(&surface, way, sequence, index),
                material => {
                    let choice = sequence.four(index, 1 + 2 * way.met)[0];
                    if depth == self.max_depth
                        || !self.turn(material, &surface, &mut way, choice, &mut throughput, false)
                    {
                        return DVec3::ZERO;
                    }
                }
            }
        }
        DVec3::ZERO
    }

    /// The next surface on the way, with what the glass before it lets through.
    fn meet(&self, way: &mut Way, throughput: &mut DVec3) -> Option<Surface> {
        let hit = self.intersector.closest(&way.ray)?;
        let surface = Surface::new(self.scene, &way.ray, &hit);
        way.medium = medium_at(self.scene, way.medium, &surface);
        *throughput *= transmittance(self.scene, way.medium, hit.t);
        Some(surface)
    }

    /// Sends the way on from a specular surface; whether anything is left of it. Behind the first diffuse surface a path
    /// stands for photons that come the other way.
    fn turn(
        &self,
        material: &Material,
        surface: &Surface,
        way: &mut Way,
        choice: f32,
        throughput: &mut DVec3,
        for_photons: bool,
    ) -> bool {
        let Some(next) = specular(material, surface, way.ray.direction.as_dvec3(), f64::from(choice)) else {
            return false;
        };
        *throughput *= next.weight * next.bend;
        if for_photons {
            *throughput *= next.tilt;
        }
        if next.through {
            way.medium = medium_beyond(surface);
        }
        let direction = next.direction.as_vec3();
        way.ray = Ray { origin: surface.leave(self.scene, direction), direction };
        way.met += 1;
        throughput.max_element() > 0.0
    }

    /// Radiance that a diffuse surface reflects back along the way that led there.
    fn reflected(&self, first: &Surface, mut way: Way, sequence: &Sequence, index: u64) -> DVec3 {
        let mut surface = *first;
        let mut radiance = DVec3::ZERO;
        let mut throughput = DVec3::ONE;
        // What a path from the light would have met, this surface included.
        let mut met_by_light = 1;
        let mut first_diffuse = true;
        loop {
            let reflectance =
                self.scene.materials[surface.material as usize].diffuse_reflectance(surface.uv).as_dvec3();
            throughput *= reflectance;
            if throughput.max_element() <= 0.0 {
                return radiance;
            }
            if self.shows(if first_diffuse { LightPart::Direct } else { LightPart::Global }) {
                let set = 2 + 2 * way.met;
                let arriving = self
                    .illumination
                    .irradiance(&surface, |light| sequence.four(index, set + LIGHT_SETS * light as u32));
                radiance += throughput * arriving * FRAC_1_PI;
            }
            if self.light == LightPart::Direct || (self.light == LightPart::Caustic && !self.specular_first) {
                return radiance;
            }
            let x = sequence.four(index, 1 + 2 * way.met);
            if !first_diffuse {
                let survival = throughput.max_element().clamp(0.05, 1.0);
                if f64::from(x[3]) >= survival {
                    return radiance;
                }
                throughput /= survival;
            }
            let direction = directions::cosine(surface.normal.as_dvec3(), f64::from(x[1]), f64::from(x[2])).as_vec3();
            way.ray = Ray { origin: surface.leave(self.scene, direction), direction };
            way.met += 1;
            let mut straight = true;
            surface = loop {
                let Some(surface) = self.meet(&mut way, &mut throughput) else {
                    return radiance;
                };
                let material = &self.scene.materials[surface.material as usize];
                if let Material::Emitter { radiance: emitted } = material {
                    let part = if first_diffuse { LightPart::Caustic } else { LightPart::Global };
                    if surface.front && !straight && self.specular_first && self.shows(part) {
                        radiance += throughput * emitted.as_dvec3();
                    }
                    return radiance;
                }
                met_by_light += 1;
                if met_by_light > self.max_depth {
                    return radiance;
                }
                if material.is_diffuse() {
                    break surface;
                }
                let choice = sequence.four(index, 1 + 2 * way.met)[0];
                if !self.turn(material, &surface, &mut way, choice, &mut throughput, true) {
                    return radiance;
                }
                straight = false;
            };
            if self.light == LightPart::Caustic {
                return radiance;
            }
            first_diffuse = false;
        }
    }
}
