//! The scene at one moment, as rays see it.

use crate::realtime::settings::Moving;
use crate::scene::geometry::NONE;
use crate::scene::{Geometry, Light, Scene};
use crate::trace::triangle::ShearedRay;
use crate::trace::{Hit, Intersector, Ray, Surface};
use glam::Vec3;

/// Some of the surfaces with a hierarchy over them.
struct Part {
    /// Index among all triangles and spheres of each of its own.
    primitives: Vec<u32>,
    intersector: Intersector,
    /// Corners of the box around it, metres, where the scene file has it.
    bounds: (Vec3, Vec3),
}

/// All surfaces and lights of a scene, those that move at their places.
pub struct World {
    /// What does not move.
    still: Part,
    /// What moves; empty if all is in `still`.
    moving: Vec<Part>,
    offsets: Vec<Vec3>,
    /// Where everything lies now, if the hierarchy is built anew.
    rebuilt: Option<Geometry>,
    lights: Vec<Light>,
    /// Whether rays try every surface.
    linear: bool,
}

/// Where a ray meets the world.
#[derive(Clone, Copy, Debug)]
pub struct WorldHit {
    /// The hit; its primitive is that of the scene.
    pub hit: Hit,
    /// By how far the surface has moved, metres.
    pub offset: Vec3,
}

/// Which motion moves a triangle or sphere of the scene, by its index among all; [`NONE`] for none.
pub fn motion_of(scene: &Scene, primitive: u32) -> u32 {
    let triangles = scene.geometry.triangles.len() as u32;
    let found = scene.motions.iter().position(|m| {
        if primitive < triangles {
            m.triangles.contains(&primitive)
        } else {
            m.spheres.contains(&(primitive - triangles))
        }
    });
    found.map_or(NONE, |i| i as u32)
}

impl World {
    /// The world at 0 s.
    pub fn new(scene: &Scene, moving: Moving, acceleration: bool) -> Self {
        let motions: Vec<u32> = (0..scene.geometry.primitive_count() as u32).map(|p| motion_of(scene, p)).collect();
        let part = |of: Option<u32>| {
            let primitives: Vec<u32> =
                (0..motions.len() as u32).filter(|&p| of.is_none_or(|m| motions[p as usize] == m)).collect();
            Part::new(scene, primitives)
        };
        let rebuild = moving == Moving::Rebuild && !scene.motions.is_empty();
        let mut world = Self {
            still: if rebuild { part(None) } else { part(Some(NONE)) },
            moving: if rebuild { Vec::new() } else { (0..scene.motions.len() as u32).map(|m| part(Some(m))).collect() },
            offsets: vec![Vec3::ZERO; scene.motions.len()],
            rebuilt: rebuild.then(|| (*scene.geometry).clone()),
            lights: scene.lights.clone(),
            linear: !acceleration,
        };
        world.update(scene, 0.0);
        world
    }

    /// Moves everything to where it is at `seconds`; whether anything has moved.
    pub fn update(&mut self, scene: &Scene, seconds: f64) -> bool {
        let offsets: Vec<Vec3> = scene.motions.iter().map(|m| m.offset(seconds)).collect();
        if offsets == self.offsets {
            return false;
        }
        self.offsets = offsets;
        self.set_lights(scene);
        if let Some(g) = &mut self.rebuilt {
            moved_geometry(scene, &self.offsets, g);
            self.still.intersector = Intersector::new(g, scene.radius);
        }
        true
    }

    /// Takes the lights of the scene, and moves those that move to where they are.
    pub fn set_lights(&mut self, scene: &Scene) {
        self.lights.clone_from(&scene.lights);
        for (m, offset) in scene.motions.iter().zip(&self.offsets) {
            for &l in &m.lights {
                // The loader has counted them.
                if let Some(light) = self.lights.get_mut(l as usize) {
                    *light = light.moved(*offset);
                }
            }
        }
    }

    /// The lights, where they are.
    pub fn lights(&self) -> &[Light] {
        &self.lights
    }

    /// Offset of a motion, metres; zero for [`NONE`].
    pub fn offset(&self, motion: u32) -> Vec3 {
        self.offsets.get(motion as usize).copied().unwrap_or(Vec3::ZERO)
    }

    /// Offsets of all motions, metres.
    pub fn offsets(&self) -> &[Vec3] {
        &self.offsets
    }

    /// The nearest surface along a ray.
    pub fn closest(&self, scene: &Scene, ray: &Ray) -> Option<WorldHit> {
        let still = self.closest_still(scene, ray);
        let limit = still.map_or(f32::INFINITY, |s| s.hit.t);
        self.closest_moving(scene, ray, limit).or(still)
    }

    /// The nearest surface of those that do not move; of all, if the hierarchy is built anew.
    pub fn closest_still(&self, scene: &Scene, ray: &Ray) -> Option<WorldHit> {
        let hit = self.still.closest(scene, ray, self.linear, self.rebuilt.as_ref())?;
        Some(WorldHit { hit, offset: self.offset_of(scene, hit.primitive) })
    }

    /// By how far a surface of [`World::closest_still`] has moved, metres.
    pub fn offset_of(&self, scene: &Scene, primitive: u32) -> Vec3 {
        if self.rebuilt.is_some() { self.offset(motion_of(scene, primitive)) } else { Vec3::ZERO }
    }

    /// The nearest surface of those that move, if one is met before the distance `limit`, metres.
    pub fn closest_moving(&self, scene: &Scene, ray: &Ray, limit: f32) -> Option<WorldHit> {
        let mut best: Option<WorldHit> = None;
        for (part, &offset) in self.moving.iter().zip(&self.offsets) {
            let moved = Ray { origin: ray.origin - offset, ..*ray };
            let limit = best.map_or(limit, |b| b.hit.t);
            if !meets_box(&moved, part.bounds, limit) {
                continue;
            }
            if let Some(hit) = part.closest(scene, &moved, self.linear, None)
                && hit.t < limit
            {
                best = Some(WorldHit { hit, offset });
            }
        }
        best
    }

    /// Indices of the surfaces that do not move; of all, if the hierarchy is built anew.
    pub fn still_primitives(&self) -> &[u32] {
        &self.still.primitives
    }

    /// Surfaces where they are, if the hierarchy is built anew.
    pub fn moved_geometry(&self) -> Option<&Geometry> {
        self.rebuilt.as_ref()
    }

    /// Whether rays try every surface.
    pub fn is_linear(&self) -> bool {
        self.linear
    }

    /// Corners of the boxes around the parts that move, where they are now, metres.
    pub fn moving_bounds(&self) -> impl Iterator<Item = (Vec3, Vec3)> + '_ {
        self.moving.iter().zip(&self.offsets).map(|(p, o)| (p.bounds.0 + *o, p.bounds.1 + *o))
    }

    /// Whether one hierarchy over all surfaces is built anew when something moves.
    pub fn is_rebuilt(&self) -> bool {
        self.rebuilt.is_some()
    }

    /// The surface at a hit, where it is now.
    pub fn surface(&self, scene: &Scene, ray: &Ray, found: &WorldHit) -> Surface {
        let there = Ray { origin: ray.origin - found.offset, ..*ray };
        let mut surface = Surface::new(scene, &there, &found.hit);
        surface.position += found.offset;
        surface
    }
}

impl Part {
    fn new(scene: &Scene, primitives: Vec<u32>) -> Self {
        let g = &scene.geometry;
        let count = g.triangles.len() as u32;
        let mut own = Geometry { positions: g.positions.clone(), ..Geometry::default() };
        let mut bounds = (Vec3::INFINITY, Vec3::NEG_INFINITY);
        for &p in &primitives {
            let (low, high) = g.bounds(p as usize);
            bounds = (bounds.0.min(low), bounds.1.max(high));
            if p < count {
                own.triangles.push(g.triangles[p as usize]);
                own.triangle_materials.push(g.triangle_materials[p as usize]);
            } else {
                own.spheres.push(g.spheres[(p - count) as usize]);
            }
        }
        Self { intersector: Intersector::new(&own, scene.radius), primitives, bounds }
    }

    fn closest(&self, scene: &Scene, ray: &Ray, linear: bool, moved: Option<&Geometry>) -> Option<Hit> {
        if linear {
            return self.closest_of_all(moved.unwrap_or(&scene.geometry), ray);
        }
        let hit = self.intersector.closest(ray)?;
        Some(Hit { primitive: self.primitives[hit.primitive as usize], ..hit })
    }

    /// Tries every surface (parameter 1 switched off).
    fn closest_of_all(&self, g: &Geometry, ray: &Ray) -> Option<Hit> {
        if !(ray.origin + ray.direction).is_finite() || ray.direction == Vec3::ZERO {
            return None;
        }
        let sheared = ShearedRay::new(ray.origin, ray.direction);
        let mut best = Hit { t: f32::INFINITY, primitive: u32::MAX, weights: [0.0; 2] };
        for &p in &self.primitives {
            let met = match g.spheres.get((p as usize).wrapping_sub(g.triangles.len())) {
                Some(s) => crate::trace::sphere::sphere(ray, s.center, s.radius, best.t).map(|t| (t, 0.0, 0.0)),
                None => sheared.intersect(&g.corners(p as usize), best.t),
            };
            if let Some((t, b, c)) = met
                && t < best.t
            {
                best = Hit { t, primitive: p, weights: [b, c] };
            }
        }
        best.t.is_finite().then_some(best)
    }
}

/// Puts every moving surface of `g` where it is.
fn moved_geometry(scene: &Scene, offsets: &[Vec3], g: &mut Geometry) {
    for (m, &offset) in scene.motions.iter().zip(offsets) {
        for t in m.triangles.clone() {
            // A shape has its vertices for itself.
            for v in scene.geometry.triangles[t as usize] {
                g.positions[v as usize] = scene.geometry.positions[v as usize] + offset;
            }
        }
        for s in m.spheres.clone() {
            g.spheres[s as usize].center = scene.geometry.spheres[s as usize].center + offset;
        }
    }
}

/// Whether a ray may meet a box before `limit`; boxes are padded, so that rounding loses nothing.
fn meets_box(ray: &Ray, (low, high): (Vec3, Vec3), limit: f32) -> bool {
    let pad = (high - low).max_element() * 1e-4 + ray.origin.abs().max_element() * 1e-6;
    let inverse = ray.direction.recip();
    let (a, b) = ((low - pad - ray.origin) * inverse, (high + pad - ray.origin) * inverse);
    // `min` and `max` leave out what is no number: a ray within the plane of a side.
    let (enter, leave) = (a.min(b).max_element().max(0.0), a.max(b).min_element());
    low.x <= high.x && enter <= leave.min(limit)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::frame::uniform_sphere;
    use crate::math::sequence::{Sampling, Sequence};
    use crate::scene::Motion;
    use crate::scene::open;

    fn with_motion() -> Scene {
        let mut scene = open("cornell").expect("built in");
        let count = scene.geometry.triangles.len() as u32;
        let motion = |triangles, path: Vec<glam::DVec3>| Motion {
            triangles,
            spheres: 0..0,
            lights: Vec::new(),
            path,
            period: 4.0,
        };
        let (a, b) = (glam::DVec3::ZERO, glam::DVec3::new(0.3, 0.4, -0.2));
        scene.motions = vec![motion(count - 24..count - 12, vec![a, b]), motion(count - 12..count, vec![b, a])];
        scene
    }

    /// Hierarchies that move, one that is built anew and no hierarchy at all show the same world.
    #[test]
    fn all_ways_to_follow_meet_the_same_surfaces() {
        let scene = with_motion();
        let mut worlds =
            [(Moving::Instances, true), (Moving::Rebuild, true), (Moving::Instances, false), (Moving::Rebuild, false)]
                .map(|(moving, fast)| World::new(&scene, moving, fast));
        let numbers = Sequence::new(Sampling::Random, 5);
        let mut on_moving = 0;
        for (frame, seconds) in [0.0, 0.7, 1.9, 3.3].into_iter().enumerate() {
            for w in &mut worlds {
                assert!(w.update(&scene, seconds) == (frame > 0));
            }
            for i in 0..2000 {
                let (x, y) = (numbers.four(i, 2 * frame as u32), numbers.four(i, 2 * frame as u32 + 1));
                let origin = Vec3::new(x[0], x[1], x[2]) * 1.8 - 0.9;
                let ray = Ray { origin, direction: uniform_sphere(y[0], y[1]).normalize() };
                let found = worlds.each_ref().map(|w| w.closest(&scene, &ray));
                for f in &found[1..] {
                    match (found[0], f) {
                        (Some(a), Some(b)) => {
                            assert!((a.hit.t - b.hit.t).abs() < 1e-5, "{a:?} {b:?}");
                            let [pa, pb] = [a, *b].map(|h| worlds[0].surface(&scene, &ray, &h).position);
                            assert!((pa - (ray.origin + ray.direction * a.hit.t)).length() < 1e-5);
                            assert!((pa - pb).length() < 1e-5);
                        }
                        (None, None) => {}
                        _ => panic!("{found:?}"),
                    }
                }
                on_moving += usize::from(found[0].is_some_and(|f| motion_of(&scene, f.hit.primitive) != NONE));
            }
        }
        assert!(on_moving > 500, "{on_moving}");
    }
}
