//! What the camera sees: for each pixel a place in the refined mesh, kept while nothing in it changes.

use crate::math::rgb::{Rgb, mean};
use crate::photons::path::{attenuation, medium_before};
use crate::realtime::first_hits::{FirstHits, Seen};
use crate::realtime::mesh::Mesh;
use crate::realtime::world::{World, WorldHit};
use crate::scene::geometry::NONE;
use crate::scene::{Camera, Material, Scene};
use crate::trace::scatter::{reflected, refracted, specular_weights};
use crate::trace::surface::{SELF_INTERSECTION, flat_normal, texture_coordinates};
use crate::trace::{Differential, Ray};
use glam::Vec3;
use rayon::prelude::*;

/// Specular surfaces, or triangles seen from behind, that a view ray follows at most.
const MOST_FOLLOWED: u32 = 16;

/// What one pixel shows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    /// Triangle of the mesh; [`NONE`] where no diffuse surface is seen.
    pub triangle: u32,
    /// Weights of its second and third corner.
    pub weights: [f32; 2],
    /// Whether its back is seen.
    pub back: bool,
    /// Reflectance of the surface times what specular surfaces before it let through; without a triangle the radiance
    /// that is seen, W/(m² sr).
    pub tint: Rgb,
}

const NOTHING: Sample = Sample { triangle: NONE, weights: [0.0; 2], back: false, tint: Rgb::ZERO };

/// What a pixel shows of the surfaces that do not move.
#[derive(Clone, Copy)]
struct Still {
    sample: Sample,
    /// Distance of the first surface along the view ray, metres; infinite without one.
    t: f32,
    /// Whether the ray was followed further, so that what moves may be seen elsewhere in the picture.
    followed: bool,
}

impl Default for Still {
    fn default() -> Self {
        Self { sample: NOTHING, t: f32::INFINITY, followed: false }
    }
}

/// The visibility buffer.
#[derive(Default)]
pub struct View {
    seen_by: Option<(Camera, [u32; 2], bool)>,
    first_hits: FirstHits,
    still: Vec<Still>,
    samples: Vec<Sample>,
    offsets: Vec<Vec3>,
    /// Parts of the image that what moves has covered, as left, top, right and bottom.
    covered: Vec<[u32; 4]>,
}

impl View {
    /// Brings the buffer up to date for a camera and an image size; returns the view rays that it took.
    ///
    /// None while camera and scene stand still; where something moves only the pixels that it covers, or has covered.
    pub fn update(
        &mut self,
        scene: &Scene,
        world: &World,
        mesh: &Mesh,
        camera: &Camera,
        size: [u32; 2],
        cull_back_faces: bool,
    ) -> u64 {
        let caster = Caster { scene, world, mesh, cull_back_faces };
        let seen_by = Some((*camera, size, cull_back_faces));
        let moved = self.offsets != world.offsets();
        if self.seen_by == seen_by && !moved {
            return 0;
        }
        let width = size[0].max(1) as usize;
        let all = self.seen_by != seen_by || world.is_rebuilt();
        if all {
            self.look(&caster, camera, size);
            self.samples.clear();
            self.samples.extend(self.still.iter().map(|s| s.sample));
        }
        let now: Vec<[u32; 4]> = world.moving_bounds().filter_map(|b| screen_box(camera, size, b)).collect();
        let rects: Vec<[u32; 4]> = self.covered.iter().chain(&now).copied().collect();
        let still = &self.still;
        let rays = camera.rays(size);
        let again: u64 = self
            .samples
            .par_chunks_mut(width)
            .enumerate()
            .map(|(y, row)| {
                let inside = |x: u32, all: &[[u32; 4]]| {
                    all.iter().any(|r| (r[0]..r[2]).contains(&x) && (r[1]..r[3]).contains(&(y as u32)))
                };
                let mut cast = 0;
                for (x, slot) in row.iter_mut().enumerate() {
                    let s = &still[y * width + x];
                    let (followed, covered) = (s.followed && !now.is_empty(), inside(x as u32, &now));
                    if followed || covered {
                        let (direction, _) = rays.ray(x as f32 + 0.5, y as f32 + 0.5, 0.5);
                        let ray = Ray { origin: camera.position, direction };
                        cast += 1;
                        *slot = if followed {
                            caster.sample(&ray)
                        } else {
                            world.closest_moving(scene, &ray, s.t).map_or(s.sample, |f| caster.follow(ray, f).0)
                        };
                    } else if inside(x as u32, &rects) {
                        *slot = s.sample;
                    }
                }
                cast
            })
            .sum();
        self.seen_by = seen_by;
        self.offsets.clear();
        self.offsets.extend_from_slice(world.offsets());
        self.covered = now;
        again + if all { self.still.len() as u64 } else { 0 }
    }

    /// Fills the buffer of what does not move.
    fn look(&mut self, caster: &Caster, camera: &Camera, size: [u32; 2]) {
        let (scene, world) = (caster.scene, caster.world);
        // Without acceleration rays try every surface, view rays too.
        if world.is_linear() {
            self.still = each_pixel(camera, size, |ray, _| caster.still(ray));
            return;
        }
        let geometry = world.moved_geometry().unwrap_or(&scene.geometry);
        let seen =
            Seen { geometry, primitives: world.still_primitives(), camera, size, front_only: caster.cull_back_faces };
        let Self { first_hits, still, .. } = self;
        first_hits.each_pixel(&seen, still, |ray, hit| {
            let Some(hit) = hit else { return Still::default() };
            let offset = world.offset_of(scene, hit.primitive);
            let (sample, followed) = caster.follow(*ray, WorldHit { hit, offset });
            Still { sample, t: hit.t, followed }
        });
    }

    /// One sample for each pixel, row by row from the top.
    pub fn samples(&self) -> &[Sample] {
        &self.samples
    }

    /// Forgets what it has seen: the mesh or the materials are others.
    pub fn forget(&mut self) {
        self.seen_by = None;
    }
}

/// Something for every pixel, by its view ray through its centre.
fn each_pixel<T: Send>(camera: &Camera, size: [u32; 2], make: impl Fn(&Ray, [u32; 2]) -> T + Sync) -> Vec<T> {
    let rays = camera.rays(size);
    let width = size[0].max(1);
    (0..size[0] * size[1])
        .into_par_iter()
        .with_min_len(width as usize)
        .map(|i| {
            let [x, y] = [i % width, i / width];
            let (direction, _) = rays.ray(x as f32 + 0.5, y as f32 + 0.5, 0.5);
            make(&Ray { origin: camera.position, direction }, [x, y])
        })
        .collect()
}

/// Pixels that a box may cover, as left, top, right and bottom; none outside of the image, all if it reaches behind the
/// camera.
fn screen_box(camera: &Camera, size: [u32; 2], (low, high): (Vec3, Vec3)) -> Option<[u32; 4]> {
    if low.x > high.x {
        return None;
    }
    let (mut least, mut most) = ([f32::INFINITY; 2], [f32::NEG_INFINITY; 2]);
    for corner in 0..8u32 {
        let pick = |axis: usize| if corner >> axis & 1 == 0 { low[axis] } else { high[axis] };
        let Some(p) = camera.project(Vec3::new(pick(0), pick(1), pick(2)), size) else {
            return Some([0, 0, size[0], size[1]]);
        };
        for axis in 0..2 {
            least[axis] = least[axis].min(p[axis]);
            most[axis] = most[axis].max(p[axis]);
        }
    }
    let inside = |x: f32, axis: usize| x.clamp(0.0, size[axis] as f32) as u32;
    // A pixel more on each side for rounding.
    let rect =
        [inside(least[0] - 1.0, 0), inside(least[1] - 1.0, 1), inside(most[0] + 2.0, 0), inside(most[1] + 2.0, 1)];
    (rect[0] < rect[2] && rect[1] < rect[3]).then_some(rect)
}

struct Caster<'a> {
    scene: &'a Scene,
    world: &'a World,
    mesh: &'a Mesh,
    cull_back_faces: bool,
}

impl Caster<'_> {
    fn still(&self, ray: &Ray) -> Still {
        match self.world.closest_still(self.scene, ray) {
            Some(found) => {
                let (sample, followed) = self.follow(*ray, found);
                Still { sample, t: found.hit.t, followed }
            }
            None => Still::default(),
        }
    }

    fn sample(&self, ray: &Ray) -> Sample {
        self.world.closest(self.scene, ray).map_or(NOTHING, |found| self.follow(*ray, found).0)
    }

    /// What is seen from the first surface on, and whether the ray went on from there.
    ///
    /// A specular surface shows the stronger of its two branches; both belong to the progressive renderer.
    fn follow(&self, mut ray: Ray, mut found: WorldHit) -> (Sample, bool) {
        let triangles = self.scene.geometry.triangles.len() as u32;
        let mut tint = Rgb::ONE;
        for step in 0..MOST_FOLLOWED {
            if !self.cull_back_faces && found.hit.primitive < triangles {
                let material = &self.scene.materials[self.scene.geometry.material(found.hit.primitive as usize)];
                if material.is_diffuse() {
                    return (self.on_triangle(&ray, &found, material, tint), step > 0);
                }
            }
            let surface = self.world.surface(self.scene, &ray, &found);
            let material = &self.scene.materials[surface.material as usize];
            if self.cull_back_faces && !surface.front {
                let on = found.hit.t * (1.0 + 4.0 * f32::EPSILON) + self.scene.radius * SELF_INTERSECTION;
                ray.origin += ray.direction * on;
            } else if material.is_diffuse() {
                return (self.diffuse(&found, &surface, material, tint), step > 0);
            } else if let Some(w) = specular_weights(material, &surface, ray.direction) {
                let medium = medium_before(self.scene, None, &surface);
                tint *= attenuation(self.scene, medium, found.hit.t).unwrap_or(Rgb::ONE);
                let none = &Differential::NONE;
                let (next, weight) = if mean(w.reflected) >= mean(w.refracted) {
                    (reflected(self.scene, &surface, ray.direction, none), w.reflected)
                } else {
                    (refracted(self.scene, &surface, ray.direction, none, w.eta), w.refracted)
                };
                tint *= weight;
                ray = Ray { origin: next.origin, direction: next.direction };
            } else {
                let Material::Emitter { radiance } = material else { return (NOTHING, step > 0) };
                let seen = if surface.front { *radiance * tint } else { Rgb::ZERO };
                return (Sample { tint: seen, ..NOTHING }, step > 0);
            }
            match self.world.closest(self.scene, &ray) {
                Some(next) => found = next,
                None => return (NOTHING, true),
            }
        }
        (NOTHING, true)
    }

    /// As [`Caster::diffuse`] on a triangle, of which it needs less than the surface at the hit.
    #[inline]
    fn on_triangle(&self, ray: &Ray, found: &WorldHit, material: &Material, tint: Rgb) -> Sample {
        let (g, index) = (&self.scene.geometry, found.hit.primitive as usize);
        let place = self.mesh.on_triangle(found.hit.primitive, found.hit.weights);
        let normal = flat_normal(g.corners(index));
        let reflectance = match material {
            Material::Diffuse { reflectance, texture: None } => *reflectance,
            other => other.diffuse_reflectance(texture_coordinates(g, index, found.hit.weights)),
        };
        Sample {
            triangle: place.triangle,
            weights: place.weights,
            back: normal.dot(ray.direction.as_dvec3()) >= 0.0,
            tint: tint * reflectance,
        }
    }

    fn diffuse(&self, found: &WorldHit, surface: &crate::trace::Surface, material: &Material, tint: Rgb) -> Sample {
        let triangles = self.scene.geometry.triangles.len() as u32;
        let primitive = found.hit.primitive;
        let place = if primitive < triangles {
            self.mesh.on_triangle(primitive, found.hit.weights)
        } else {
            let outward = if surface.front { surface.normal } else { -surface.normal };
            self.mesh.on_sphere(primitive - triangles, outward)
        };
        Sample {
            triangle: place.triangle,
            weights: place.weights,
            back: !surface.front,
            tint: tint * material.diffuse_reflectance(surface.uv),
        }
    }
}
