//! View paths: from the camera, by specular surfaces, to the diffuse surfaces where radiance is estimated.

use crate::estimate::{Estimator, View};
use crate::final_gather::{GatherCounts, GatherPoint};
use crate::math::hash::mix;
use crate::math::rgb::{Rgb, in_f32, mean};
use crate::math::sequence::Sequence;
use crate::photons::map::Query;
use crate::photons::path::{MAX_ANGLE, PathCounts, attenuation, medium_before, medium_behind};
use crate::render::plan::Plan;
use crate::render::settings::RenderSettings;
use crate::scene::{Material, Scene};
use crate::trace::direct::{self, Receiver};
use crate::trace::scatter::{SpecularRay, reflected, refracted, specular_weights};
use crate::trace::{Differential, Intersector, Ray, Surface};
use glam::{DVec3, Vec3};
use std::f32::consts::FRAC_1_PI;

/// A diffuse surface at the end of a view path.
#[derive(Clone, Copy, Debug)]
pub struct ViewHit {
    /// What estimators see.
    pub view: View,
    /// The part of the pixel that an exact mean may take instead of the ray's own cell; see
    /// [`crate::render::flat_pixels`].
    pub flat: Option<Query>,
    /// Radiance at the camera for unit irradiance here: throughput times ρ/π, 1/sr.
    pub weight: Rgb,
    /// Index of the pixel in its tile.
    pub pixel: u32,
    /// Seed of the gather rays from here.
    pub seed: u64,
}

impl ViewHit {
    /// The hit as a point at which light is gathered.
    pub fn point(&self) -> GatherPoint {
        let query = &self.view.query;
        GatherPoint { position: query.center, normal: query.normal, found_along: self.view.direction }
    }

    /// Where that estimator looks photons up.
    #[inline]
    pub fn query_of(&self, estimator: &dyn Estimator) -> Query {
        query_of(self.view.query, self.flat, estimator)
    }

    /// The hit as that estimator sees it.
    #[inline]
    pub fn seen_by(&self, estimator: &dyn Estimator) -> View {
        seen_by(self.view, self.flat, estimator)
    }
}

/// What an estimator sees at a hit of the ray's own `view` in a pixel whose part `flat` may take its place.
#[inline]
pub(super) fn seen_by(view: View, flat: Option<Query>, estimator: &dyn Estimator) -> View {
    View { query: query_of(view.query, flat, estimator), ..view }
}

#[inline]
fn query_of(own: Query, flat: Option<Query>, estimator: &dyn Estimator) -> Query {
    flat.filter(|_| estimator.is_exact_mean()).unwrap_or(own)
}

/// Counts that only view paths have.
#[derive(Clone, Copy, Debug, Default)]
pub struct ViewCounts {
    /// What was bounded.
    pub bounded: PathCounts,
    /// Camera rays that met the inside of a dielectric first.
    pub camera_inside_glass: u64,
    /// Pixels with a channel beyond f32, which hold its largest number there; one for each estimator.
    pub overflow: u64,
    /// Discs of density estimation that were raised to the resolution of f32.
    pub disc_floor: u64,
    /// Rays of final gathering.
    pub gather: GatherCounts,
}

/// What view paths need.
#[derive(Clone, Copy)]
pub struct ViewTracer<'a> {
    /// The scene.
    pub scene: &'a Scene,
    /// Its intersector.
    pub intersector: &'a Intersector,
    /// The settings.
    pub settings: &'a RenderSettings,
    /// The plan.
    pub plan: &'a Plan,
    /// Whether footprints are carried: as the plan says, unless all who look at the hits look at points.
    pub footprints: bool,
}

/// A surface that a view path meets.
pub struct ViewMeeting<'a> {
    /// The surface.
    pub surface: &'a Surface,
    /// Unit direction of the ray.
    pub direction: Vec3,
    /// Length of the ray, metres.
    pub distance: f32,
    /// Footprint `(dα, dβ)` of the view differential in the surface's plane, metres; zero if the plan carries none.
    pub footprint: [Vec3; 2],
    /// What a radiance of 1 that leaves here towards the ray adds at the camera.
    pub throughput: Rgb,
    /// Surfaces that the path met before.
    pub depth: u32,
    /// Radiance at the camera of what light needs no photons here, W/(m² sr).
    pub light: Rgb,
    /// Index of the view hit that was made here.
    pub hit: Option<usize>,
}

/// Hears what view paths meet. A path's two branches come one after the other: first a surface, then all behind it.
pub trait ViewRecorder {
    /// The ray of a cell of a pixel sets out. Cells are counted row by row.
    #[inline]
    fn ray(&mut self, _cell: u32) {}

    /// It meets a surface.
    #[inline]
    fn meets(&mut self, _meeting: &ViewMeeting) {}
}

/// Records nothing, at no cost.
pub struct Unrecorded;

impl ViewRecorder for Unrecorded {}

/// A path that is still to be followed.
#[derive(Clone, Copy)]
pub struct Branch {
    ray: Ray,
    differential: Differential,
    throughput: Rgb,
    /// The dielectric that it is in.
    medium: Option<u32>,
    depth: u32,
    specular: u32,
}

impl ViewTracer<'_> {
    /// Follows one camera ray. Diffuse hits go to `hits`; what light needs no photons is returned, W/(m² sr).
    ///
    /// `sequence` and `index` give the path's numbers: set `1 + depth` decides branches. `stack` is scratch.
    /// `recorder` hears of every surface.
    #[expect(clippy::too_many_arguments, reason = "outputs and scratch that the caller keeps between rays")]
    pub fn trace(
        &self,
        ray: Ray,
        differential: Differential,
        sequence: &Sequence,
        index: u64,
        pixel: u32,
        hits: &mut Vec<ViewHit>,
        stack: &mut Vec<Branch>,
        counts: &mut ViewCounts,
        recorder: &mut impl ViewRecorder,
    ) -> DVec3 {
        let mut radiance = DVec3::ZERO;
        let before = hits.len();
        stack.clear();
        let differential = if self.footprints { differential } else { Differential::default() };
        stack.push(Branch { ray, differential, throughput: Rgb::ONE, medium: None, depth: 0, specular: 0 });
        while let Some(mut branch) = stack.pop() {
            let Some(hit) = self.intersector.closest(&branch.ray) else {
                continue;
            };
            let surface = Surface::new(self.scene, &branch.ray, &hit);
            let v = branch.ray.direction;
            if self.footprints {
                branch.differential = branch.differential.transfer(v, surface.normal, hit.t);
                let bounded = branch.differential.bound(self.scene.radius, MAX_ANGLE);
                counts.bounded.differentials += u64::from(bounded);
            }
            branch.medium = medium_before(self.scene, branch.medium, &surface);
            if let Some(inside) = attenuation(self.scene, branch.medium, hit.t) {
                branch.throughput *= inside;
            }
            let material = &self.scene.materials[surface.material as usize];
            let (mut light, mut made_hit) = (DVec3::ZERO, false);
            match material {
                Material::Emitter { radiance: emitted } => {
                    if surface.front && self.plan.emission {
                        light = (branch.throughput * *emitted).as_dvec3();
                        radiance += light;
                    }
                }
                Material::Diffuse { .. } => {
                    let weight = branch.throughput * material.diffuse_reflectance(surface.uv) * FRAC_1_PI;
                    if self.plan.shadow_rays {
                        let receiver = Receiver { position: surface.position, normal: surface.normal, found_along: v };
                        light = weight.as_dvec3()
                            * direct::irradiance(
                                self.scene,
                                self.intersector,
                                &receiver,
                                self.settings.shadow_rays,
                                sequence,
                                index,
                            );
                        radiance += light;
                    }
                    if self.plan.needs_photons() && weight != Rgb::ZERO {
                        hits.push(ViewHit {
                            view: View {
                                query: Query {
                                    center: surface.position,
                                    normal: surface.normal,
                                    axes: branch.differential.dp,
                                },
                                direction: v,
                            },
                            flat: None,
                            weight,
                            pixel,
                            seed: mix(mix(sequence.seed(), index), (hits.len() - before) as u64),
                        });
                        made_hit = true;
                    }
                }
                _ => {
                    if !surface.front && branch.depth == 0 && matches!(material, Material::Dielectric { .. }) {
                        counts.camera_inside_glass += 1;
                    }
                    self.scatter(material, &surface, branch, sequence, index, stack, counts);
                }
            }
            recorder.meets(&ViewMeeting {
                surface: &surface,
                direction: v,
                distance: hit.t,
                footprint: branch.differential.dp,
                throughput: branch.throughput,
                depth: branch.depth,
                light: in_f32(light).0,
                hit: made_hit.then(|| hits.len() - 1),
            });
        }
        radiance
    }

    /// Sends a path on from a specular surface: both ways at the first hits, one of them after that.
    #[expect(clippy::too_many_arguments, reason = "the state of a path, spelled out")]
    fn scatter(
        &self,
        material: &Material,
        surface: &Surface,
        branch: Branch,
        sequence: &Sequence,
        index: u64,
        stack: &mut Vec<Branch>,
        counts: &mut ViewCounts,
    ) {
        let v = branch.ray.direction;
        let Some(weights) = specular_weights(material, surface, v) else {
            return;
        };
        if branch.depth + 1 >= self.settings.max_depth {
            counts.bounded.depth += 1;
            return;
        }
        // Radiance changes with the square of the index, so that L/n² is the same on both sides (a view ray runs backwards).
        let bend = weights.eta * weights.eta;
        let mut follow = |next: SpecularRay, weight: Rgb, medium: Option<u32>| {
            counts.bounded.horizon += u64::from(next.beyond_horizon);
            counts.bounded.normals += u64::from(next.without_shading);
            let throughput = branch.throughput * weight;
            if throughput != Rgb::ZERO {
                stack.push(Branch {
                    ray: Ray { origin: next.origin, direction: next.direction },
                    differential: next.differential,
                    throughput,
                    medium,
                    depth: branch.depth + 1,
                    specular: branch.specular + 1,
                });
            }
        };
        let reflect = |d: &Differential| reflected(self.scene, surface, v, d);
        let refract = |d: &Differential| refracted(self.scene, surface, v, d, weights.eta);
        let d = &branch.differential;
        let (r, t) = (mean(weights.reflected), mean(weights.refracted));
        if r > 0.0 && t > 0.0 && branch.specular >= self.settings.split_depth {
            let chance = r / (r + t);
            if sequence.four(index, 1 + branch.depth)[0] < chance {
                follow(reflect(d), weights.reflected / chance, branch.medium);
            } else {
                follow(refract(d), weights.refracted * (bend / (1.0 - chance)), medium_behind(surface));
            }
            return;
        }
        if t > 0.0 {
            follow(refract(d), weights.refracted * bend, medium_behind(surface));
        }
        if r > 0.0 {
            follow(reflect(d), weights.reflected, branch.medium);
        }
    }
}

/// Position of a view ray in its pixel: the centre of cell `(i, j)` of `n`×`n`, or a random point of the cell.
pub fn sample_position(pixel: [u32; 2], cell: [u32; 2], n: u32, jitter: Option<[f32; 2]>) -> (f32, f32) {
    let [u, v] = jitter.unwrap_or([0.5; 2]);
    (pixel[0] as f32 + (cell[0] as f32 + u) / n as f32, pixel[1] as f32 + (cell[1] as f32 + v) / n as f32)
}

/// The query at a hit without its footprint.
pub fn at_point(query: &Query) -> Query {
    Query { axes: [Vec3::ZERO; 2], ..*query }
}
