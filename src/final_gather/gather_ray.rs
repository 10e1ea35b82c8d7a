//! One gather ray: from the point by specular surfaces to the diffuse surface at its end.

use crate::math::rgb::{Rgb, mean};
use crate::photons::path::{MAX_ANGLE, attenuation, medium_before, medium_behind};
use crate::scene::{Material, Scene};
use crate::trace::scatter::{SpecularRay, reflected, refracted, specular_weights};
use crate::trace::surface::SELF_INTERSECTION;
use crate::trace::{Differential, Intersector, Ray, Surface};
use glam::Vec3;
use std::f32::consts::FRAC_1_PI;

/// A point at which light is gathered.
#[derive(Clone, Copy, Debug)]
pub struct GatherPoint {
    /// On the surface, metres.
    pub position: Vec3,
    /// Unit normal on the side that is lit.
    pub normal: Vec3,
    /// Unit direction of the ray that has found it.
    pub found_along: Vec3,
}

impl GatherPoint {
    /// Start of its gather rays: off its surface, and back along the ray that has found it, because where walls meet
    /// rounding may have put it behind the other one.
    pub fn start(&self, scene: &Scene) -> Vec3 {
        self.position + (self.normal - self.found_along) * (scene.radius * SELF_INTERSECTION)
    }
}

/// The diffuse surface at the end of a gather ray.
#[derive(Clone, Copy, Debug)]
pub struct GatherHit {
    /// Where, metres.
    pub position: Vec3,
    /// Unit normal of the flat surface, towards the ray.
    pub normal: Vec3,
    /// Unit direction of the ray on arrival.
    pub direction: Vec3,
    /// Length of the whole path, metres.
    pub distance: f32,
    /// Specular surfaces that it met before.
    pub specular: u32,
    /// Half-axes `(dα, dβ)` of its footprint in the surface's plane, metres; zero if it carries none.
    pub footprint: [Vec3; 2],
    /// Radiance that the ray brings for unit irradiance here, 1/sr: ρ/π times the throughput of the way.
    pub weight: Rgb,
}

/// How gather rays end otherwise.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NoHit {
    /// It met nothing.
    Open,
    /// It met a light: direct light if nothing specular was between, else caustic; both are counted elsewhere.
    Light,
    /// It met a surface that returns nothing, or too many specular ones.
    Lost,
}

/// What gather rays are traced through.
#[derive(Clone, Copy)]
pub struct GatherTracer<'a> {
    /// The scene.
    pub scene: &'a Scene,
    /// Its intersector.
    pub intersector: &'a Intersector,
    /// Surfaces that a ray may meet.
    pub max_depth: u32,
}

impl GatherTracer<'_> {
    /// Follows a ray to its end. Where light goes two ways `choose` gives a number in `[0, 1)` for each surface met.
    ///
    /// With a differential of none no footprint is carried.
    ///
    /// # Errors
    /// How it ended without a diffuse surface.
    pub fn trace(&self, ray: Ray, differential: Differential, choose: impl Fn(u32) -> f32) -> Result<GatherHit, NoHit> {
        let scene = self.scene;
        let carries = !differential.is_none();
        let (mut ray, mut d) = (ray, differential);
        let mut throughput = Rgb::ONE;
        let mut medium = None;
        let mut distance = 0.0;
        for depth in 0..self.max_depth {
            let hit = self.intersector.closest(&ray).ok_or(NoHit::Open)?;
            let surface = Surface::new(scene, &ray, &hit);
            let v = ray.direction;
            distance += hit.t;
            if carries {
                d = d.transfer(v, surface.normal, hit.t);
                d.bound(scene.radius, MAX_ANGLE);
            }
            medium = medium_before(scene, medium, &surface);
            if let Some(inside) = attenuation(scene, medium, hit.t) {
                throughput *= inside;
            }
            let material = &scene.materials[surface.material as usize];
            match material {
                Material::Emitter { .. } => return Err(NoHit::Light),
                Material::Diffuse { .. } => {
                    let weight = throughput * material.diffuse_reflectance(surface.uv) * FRAC_1_PI;
                    return if weight == Rgb::ZERO {
                        Err(NoHit::Lost)
                    } else {
                        Ok(GatherHit {
                            position: surface.position,
                            normal: surface.normal,
                            direction: v,
                            distance,
                            specular: depth,
                            footprint: d.dp,
                            weight,
                        })
                    };
                }
                _ => {
                    let weights = specular_weights(material, &surface, v).ok_or(NoHit::Lost)?;
                    let (r, t) = (mean(weights.reflected), mean(weights.refracted));
                    let chance = if r + t > 0.0 { r / (r + t) } else { return Err(NoHit::Lost) };
                    let next: SpecularRay;
                    // One of the two ways, by its share; radiance changes with the square of the index.
                    if choose(depth) < chance {
                        next = reflected(scene, &surface, v, &d);
                        throughput *= weights.reflected / chance;
                    } else {
                        next = refracted(scene, &surface, v, &d, weights.eta);
                        throughput *= weights.refracted * (weights.eta * weights.eta / (1.0 - chance));
                        medium = medium_behind(&surface);
                    }
                    ray = Ray { origin: next.origin, direction: next.direction };
                    if carries {
                        d = next.differential;
                    }
                }
            }
        }
        Err(NoHit::Lost)
    }
}
