//! Closest hit and any hit on `obvhs`, with leaf tests of our own.

use crate::math::hash::mix;
use crate::scene::Geometry;
use crate::trace::builder::{SOME_RAYS, build_parameters};
use crate::trace::interleaved::traverse_interleaved;
use crate::trace::packet::inverse_of;
use crate::trace::sphere::sphere;
use crate::trace::traversal::{BoxRay, LeafTest, is_large, traverse};
use crate::trace::triangle::ShearedRay;
use glam::{Vec3, Vec3A};
use obvhs::BvhBuildParams;
use obvhs::aabb::Aabb;
use obvhs::cwbvh::CwBvh;
use obvhs::cwbvh::builder::build_cwbvh;
use prefetch_index::prefetch_index;
use std::time::Duration;

/// A ray in local coordinates.
#[derive(Clone, Copy, Debug)]
pub struct Ray {
    /// Start, metres.
    pub origin: Vec3,
    /// Unit direction.
    pub direction: Vec3,
}

/// Where a ray meets a surface.
#[derive(Clone, Copy, Debug)]
pub struct Hit {
    /// Distance, metres, positive.
    pub t: f32,
    /// Index of the triangle or sphere, as in [`Geometry`].
    pub primitive: u32,
    /// Weights of a triangle's second and third corner.
    pub weights: [f32; 2],
}

/// A bounding volume hierarchy over a scene's surfaces.
pub struct Intersector {
    pub(super) bvh: CwBvh,
    /// Primitive of each leaf entry.
    primitives: Vec<u32>,
    /// Corners of each leaf entry, in the order in which rays meet them; for a sphere centre and radius.
    pub(super) leaves: Vec<[Vec3; 3]>,
    triangle_count: u32,
    /// Whether there is anything but triangles: what is met is looked up for nothing where there is not.
    has_spheres: bool,
    /// Power of two by which coordinates are multiplied inside; see [`SCALED_RADIUS`].
    pub(super) scale: f32,
}

/// Radius to which a scene is scaled inside the intersector, up to a factor of two.
///
/// Whatever unit a scene is in, its boxes are tested by the same numbers, far from the ends of f32; and a power of two scales
/// without rounding.
const SCALED_RADIUS: f32 = (1u32 << SCALED_EXPONENT) as f32;
const SCALED_EXPONENT: i32 = 20;

/// Boxes grow by this part of the scene's radius, so that no rounding in the box test loses a hit in the leaf test.
const PADDING: f32 = 1e-6;

/// Boxes grow by up to this part of their size, each by another: no two are alike.
///
/// The builder joins neighbours that are each other's best. In a row of surfaces that are all alike, as a finely divided ring
/// is, each has its best in the next and only one pair is joined in a turn.
const WIDEST: f32 = 1.0 / 1024.0;

/// Distance from the local origin, in scaled units, beyond which a ray's start is moved along it for the box test:
/// farther away rounding would be more than the padding.
pub(super) const FAR: f32 = 4.0 * SCALED_RADIUS;

/// Nodes of the largest hierarchy that packets of rays go through: in larger ones waiting for memory takes longer than testing.
const MOST_NODES: usize = 10_000;

/// Smallest component of a direction that the box test tells from none: at [`FAR`] it moves a ray by nothing, and its
/// inverse times a coordinate is no infinity.
pub(super) const SMALLEST_COMPONENT: f32 = 1e-20;

impl Intersector {
    /// Builds over all of `geometry`; `radius` is the scene's.
    pub fn new(geometry: &Geometry, radius: f32) -> Self {
        Self::for_rays(geometry, radius, SOME_RAYS)
    }

    /// The same for about so many rays: a better hierarchy takes longer to build.
    pub fn for_rays(geometry: &Geometry, radius: f32, rays: u64) -> Self {
        Self::by(geometry, radius, build_parameters(geometry.primitive_count(), rays))
    }

    /// The same by a builder of the caller's.
    pub fn by(geometry: &Geometry, radius: f32, parameters: BvhBuildParams) -> Self {
        // The exponent itself, so that a scene in units of another power of two is traced by the same numbers.
        let exponent = SCALED_EXPONENT - libm::frexpf(radius).1;
        let scale = libm::ldexpf(1.0, exponent);
        let scale = if scale.is_normal() { scale } else { 1.0 };
        let count = geometry.primitive_count();
        let padding = radius * scale * PADDING;
        let boxes: Vec<Aabb> = (0..count)
            .map(|i| {
                let (low, high) = geometry.bounds(i);
                let (low, high) = (Vec3A::from(low * scale), Vec3A::from(high * scale));
                let wider = (high - low) * (WIDEST * (mix(i as u64, 0) >> 40) as f32 / (1u32 << 24) as f32) + padding;
                Aabb::new(low - wider, high + wider)
            })
            .collect();
        let bvh = if count == 0 { CwBvh::default() } else { build_cwbvh(&boxes, parameters, &mut Duration::default()) };
        let primitives = bvh.primitive_indices.clone();
        let triangle_count = geometry.triangles.len() as u32;
        let leaves = primitives
            .iter()
            .map(|&p| {
                if p < triangle_count {
                    geometry.corners(p as usize).map(|c| c * scale)
                } else {
                    let s = geometry.spheres[(p - triangle_count) as usize];
                    [s.center * scale, Vec3::splat(s.radius * scale), Vec3::ZERO]
                }
            })
            .collect();
        Self { bvh, primitives, leaves, triangle_count, has_spheres: !geometry.spheres.is_empty(), scale }
    }

    /// The nearest surface along `ray`; of surfaces at the same distance the one of lower index. None for a ray that is
    /// not finite.
    pub fn closest(&self, ray: &Ray) -> Option<Hit> {
        let (ray, start) = self.ready(ray)?;
        let traversal = start.traversal;
        let mut closest = Closest::new(self, ray, start, 0);
        traverse(&self.bvh.nodes, &traversal, f32::INFINITY, &mut closest);
        closest.hit()
    }

    /// [`Self::closest`] of each, in `hits`. Neighbours best go about the same way: they are traced together. In a scene so large
    /// that rays wait for memory several are on their way at once instead, and wait together.
    pub fn closest_of(&self, rays: &[Ray], hits: &mut Vec<Option<Hit>>) {
        hits.clear();
        hits.resize(rays.len(), None);
        if self.bvh.nodes.len() <= MOST_NODES {
            self.closest_in_packets(rays, hits);
            return;
        }
        let mut number = 0;
        let next = || {
            while let Some(ray) = rays.get(number) {
                number += 1;
                if let Some((ray, start)) = self.ready(ray) {
                    return Some((start.traversal, f32::INFINITY, Closest::new(self, ray, start, number - 1)));
                }
            }
            None
        };
        traverse_interleaved(&self.bvh.nodes, next, |closest| hits[closest.number] = closest.hit());
    }

    /// Whether rays wait for memory most of their time, so that [`Self::closest_of`] many takes less than each alone.
    pub fn is_large(&self) -> bool {
        is_large(&self.bvh.nodes)
    }

    /// A ray in the scale of the hierarchy; None if it meets nothing.
    #[inline(always)]
    fn ready(&self, ray: &Ray) -> Option<(Ray, Start)> {
        let ray = Ray { origin: ray.origin * self.scale, ..*ray };
        Some((ray, self.start(&ray, f32::INFINITY)?))
    }

    /// Whether anything lies along `ray` before the distance `t_max`, metres.
    pub fn any(&self, ray: &Ray, t_max: f32) -> bool {
        let ray = &Ray { origin: ray.origin * self.scale, ..*ray };
        let t_max = t_max * self.scale;
        let Some(start) = self.start(ray, t_max) else {
            return false;
        };
        let sheared = ShearedRay::new(ray.origin, ray.direction);
        let mut any = Any { on: self, ray, sheared, t_max, met: false };
        traverse(&self.bvh.nodes, &start.traversal, start.before(t_max), &mut any);
        any.met
    }

    #[inline(always)]
    fn start(&self, ray: &Ray, t_max: f32) -> Option<Start> {
        // Not before a distance that is no number, either.
        let is_ahead = t_max > 0.0;
        if !is_ahead || !self.is_sound(ray) {
            return None;
        }
        let (mut origin, mut moved) = (ray.origin, 0.0);
        if origin.abs().max_element() > FAR {
            let (o, d) = (origin.as_dvec3(), ray.direction.as_dvec3());
            let along = -o.dot(d) / d.length_squared() - f64::from(FAR / 2.0);
            if along > 0.0 {
                origin = (o + d * along).as_vec3();
                moved = along as f32;
            }
        }
        Some(Start { traversal: BoxRay { origin, inverse: inverse_of(ray.direction) }, moved })
    }

    /// Whether a ray may meet anything: it is finite, and there is something.
    #[inline(always)]
    pub(super) fn is_sound(&self, ray: &Ray) -> bool {
        // The sum is no number, or infinite, if a part of it is.
        (ray.origin + ray.direction).is_finite() && ray.direction != Vec3::ZERO && !self.primitives.is_empty()
    }

    /// Asks for the memory of an entry.
    #[inline(always)]
    fn prefetch(&self, leaf: usize) {
        prefetch_index(&self.leaves, leaf);
        // Its end lies before the next one's start.
        prefetch_index(&self.leaves, leaf + 1);
    }

    #[inline(always)]
    fn leaf(&self, ray: &Ray, sheared: &ShearedRay, leaf: usize, t_max: f32) -> Option<(f32, f32, f32)> {
        if self.is_triangle(leaf) {
            sheared.intersect(&self.leaves[leaf], t_max)
        } else {
            self.sphere(ray, leaf, t_max).map(|t| (t, 0.0, 0.0))
        }
    }

    /// Whether an entry is a triangle, not a sphere.
    #[inline(always)]
    pub(super) fn is_triangle(&self, leaf: usize) -> bool {
        !self.has_spheres || self.primitives[leaf] < self.triangle_count
    }

    /// Distance to the sphere of an entry, if it is met before `t_max`.
    #[inline(always)]
    pub(super) fn sphere(&self, ray: &Ray, leaf: usize, t_max: f32) -> Option<f32> {
        let [center, radius, _] = self.leaves[leaf];
        sphere(ray, center, radius.x, t_max)
    }

    /// Whether of two surfaces in one place that of the entry `leaf` is met, and not the `other`'s, which may be none.
    #[inline(always)]
    pub(super) fn is_before(&self, leaf: usize, other: usize) -> bool {
        self.primitives.get(other).is_none_or(|other| self.primitives[leaf] < *other)
    }

    /// What a ray met last: an entry, or none, at the distance `t` of the hierarchy's scale.
    #[inline(always)]
    pub(super) fn hit(&self, leaf: usize, t: f32, weights: [f32; 2]) -> Option<Hit> {
        let primitive = *self.primitives.get(leaf)?;
        t.is_finite().then_some(Hit { t: t / self.scale, primitive, weights })
    }
}

/// A ray made ready for the box test.
struct Start {
    traversal: BoxRay,
    /// By how much its start was moved along it.
    moved: f32,
}

impl Start {
    /// Distance from the moved start at which boxes need no longer be opened for a hit at `t`.
    #[inline]
    fn before(&self, t: f32) -> f32 {
        // A part more than rounding may take from a long way.
        if self.moved > 0.0 { t * (1.0 + 4.0 * f32::EPSILON) - self.moved } else { t }
    }
}

/// The nearest of the surfaces that are met.
struct Closest<'a> {
    on: &'a Intersector,
    ray: Ray,
    sheared: ShearedRay,
    start: Start,
    /// Number of the ray among those that are asked for together.
    number: usize,
    t: f32,
    /// Its entry: what it stands for is looked up when it is known, not for each that is met on the way.
    leaf: usize,
    weights: [f32; 2],
}

impl<'a> Closest<'a> {
    #[inline(always)]
    fn new(on: &'a Intersector, ray: Ray, start: Start, number: usize) -> Self {
        let sheared = ShearedRay::new(ray.origin, ray.direction);
        Self { on, ray, sheared, start, number, t: f32::INFINITY, leaf: usize::MAX, weights: [0.0; 2] }
    }

    #[inline(always)]
    fn hit(&self) -> Option<Hit> {
        self.on.hit(self.leaf, self.t, self.weights)
    }
}

impl LeafTest for Closest<'_> {
    #[inline(always)]
    fn test(&mut self, leaf: usize, limit: &mut f32) -> bool {
        if let Some((t, b, c)) = self.on.leaf(&self.ray, &self.sheared, leaf, self.t)
            && (t < self.t || self.on.is_before(leaf, self.leaf))
        {
            (self.t, self.leaf, self.weights) = (t, leaf, [b, c]);
            *limit = self.start.before(t);
            // It is looked up in the end.
            prefetch_index(&self.on.primitives, leaf);
        }
        false
    }

    #[inline(always)]
    fn prefetch(&self, leaf: usize) {
        self.on.prefetch(leaf);
    }
}

/// Whether any surface is met before a distance.
struct Any<'a> {
    on: &'a Intersector,
    ray: &'a Ray,
    sheared: ShearedRay,
    t_max: f32,
    met: bool,
}

impl LeafTest for Any<'_> {
    #[inline(always)]
    fn test(&mut self, leaf: usize, _: &mut f32) -> bool {
        let hit = self.on.leaf(self.ray, &self.sheared, leaf, self.t_max);
        self.met = hit.is_some_and(|(t, ..)| t < self.t_max);
        self.met
    }

    #[inline(always)]
    fn prefetch(&self, leaf: usize) {
        self.on.prefetch(leaf);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::sequence::{Sampling, Sequence};
    use crate::scene::geometry::{NONE, Sphere};

    fn soup(triangles: usize, spheres: usize) -> Geometry {
        let sequence = Sequence::new(Sampling::Random, 5);
        let mut g = Geometry::default();
        let p = |i: usize, set| {
            let x = sequence.four(i as u64, set);
            Vec3::new(x[0], x[1], x[2])
        };
        for i in 0..triangles {
            let base = g.positions.len() as u32;
            g.positions.extend((0..3).map(|c| p(i, 0) + 0.2 * p(i, 1 + c)));
            g.triangles.push([base, base + 1, base + 2]);
            g.corner_normals.push([NONE; 3]);
            g.corner_uvs.push([NONE; 3]);
            g.triangle_materials.push(0);
        }
        for i in 0..spheres {
            g.spheres.push(Sphere { center: p(i, 9), radius: 0.03, material: 0 });
        }
        g
    }

    #[test]
    fn hits_equal_brute_force() {
        for (triangles, spheres) in [(0, 0), (1, 0), (0, 1), (2, 1), (400, 60)] {
            let g = soup(triangles, spheres);
            let intersector = Intersector::new(&g, 1.0);
            let sequence = Sequence::new(Sampling::Random, 6);
            for i in 0..3000 {
                let x = sequence.four(i, 0);
                let y = sequence.four(i, 1);
                let ray = Ray {
                    origin: Vec3::new(x[0], x[1], x[2]) * 2.0 - 0.5,
                    direction: crate::math::frame::uniform_sphere(y[0], y[1]).normalize(),
                };
                let sheared = ShearedRay::new(ray.origin, ray.direction);
                let brute = (0..g.primitive_count())
                    .filter_map(|k| {
                        if k < triangles {
                            sheared.intersect(&g.corners(k), f32::INFINITY).map(|h| h.0)
                        } else {
                            let s = g.spheres[k - triangles];
                            sphere(&ray, s.center, s.radius, f32::INFINITY)
                        }
                    })
                    .fold(f32::INFINITY, f32::min);
                let found = intersector.closest(&ray).map_or(f32::INFINITY, |h| h.t);
                assert_eq!(found, brute);
                let t_max = 0.3 + y[2];
                assert_eq!(intersector.any(&ray, t_max), brute < t_max);
            }
        }
    }

    /// A component of -0 is none: without care it turns the box test over, and the ray meets nothing.
    #[test]
    fn a_zero_has_no_sign() {
        let g = soup(200, 20);
        let intersector = Intersector::new(&g, 1.0);
        let sequence = Sequence::new(Sampling::Random, 7);
        let mut hits = 0;
        for i in 0..3000 {
            let x = sequence.four(i, 0);
            let mut d = crate::math::frame::uniform_sphere(x[3], x[0]).normalize();
            d[i as usize % 3] = 0.0;
            d[(i / 3) as usize % 3] = 0.0;
            let origin = Vec3::new(x[1], x[2], x[0]);
            let with = |zero: f32| d.map(|c| if c == 0.0 { zero } else { c });
            let [a, b] = [0.0, -0.0].map(|zero| Ray { origin, direction: with(zero) });
            let found = |r| intersector.closest(r).map(|h| (h.t, h.primitive));
            assert_eq!(found(&a), found(&b));
            assert_eq!(intersector.any(&a, 0.5), intersector.any(&b, 0.5));
            hits += u32::from(found(&a).is_some());
        }
        assert!(hits > 300, "{hits}");
    }

    /// From thousands of radii away rays meet what those meet that start nearer on the same line.
    #[test]
    fn far_starts_lose_nothing() {
        let g = soup(400, 60);
        let intersector = Intersector::new(&g, 1.0);
        let sequence = Sequence::new(Sampling::Random, 8);
        for i in 0..3000 {
            let (x, y) = (sequence.four(i, 0), sequence.four(i, 1));
            let direction = crate::math::frame::uniform_sphere(x[0], x[1]).normalize();
            let away = libm::exp2f(13.0 * x[2]);
            let origin = Vec3::new(y[0], y[1], y[2]) - direction * away;
            let ray = Ray { origin, direction };
            let sheared = ShearedRay::new(origin, direction);
            let brute = (0..400).filter_map(|k| sheared.intersect(&g.corners(k), f32::INFINITY).map(|h| h.0));
            let spheres = g.spheres.iter().filter_map(|s| sphere(&ray, s.center, s.radius, f32::INFINITY));
            let brute = brute.chain(spheres).fold(f32::INFINITY, f32::min);
            assert_eq!(intersector.closest(&ray).map_or(f32::INFINITY, |h| h.t), brute, "{ray:?}");
            assert_eq!(intersector.any(&ray, away), brute < away);
        }
    }

    #[test]
    fn of_two_surfaces_in_one_place_the_first_is_met() {
        let mut g = soup(300, 0);
        let base = g.positions.len() as u32;
        g.positions.extend([Vec3::ZERO, Vec3::X, Vec3::Y].map(|p| p * 2.0 - Vec3::Z * 0.5));
        for copy in 0..40 {
            let at = g.triangles.len() - copy * 7;
            g.triangles.insert(at, [base, base + 1, base + 2]);
        }
        let first = g.triangles.iter().position(|t| t[0] == base).expect("there") as u32;
        for v in [&mut g.corner_normals, &mut g.corner_uvs] {
            v.resize(340, [NONE; 3]);
        }
        g.triangle_materials.resize(340, 0);
        let intersector = Intersector::new(&g, 1.0);
        for i in 0..100 {
            let origin = Vec3::new(0.1 + 0.005 * i as f32, 0.3, -1.0);
            let hit = intersector.closest(&Ray { origin, direction: Vec3::Z }).expect("the wall");
            assert_eq!(hit.primitive, first);
        }
    }

    /// Many at a time are each alone, in scenes whose rays go in packets and in one where they are interleaved: fewer than go
    /// together, and more; those that miss, that start far away, that run along an axis, and those that are not finite.
    #[test]
    fn rays_together_meet_what_each_meets_alone() {
        let sequence = Sequence::new(Sampling::Random, 9);
        let mut met = 0;
        for (triangles, is_large) in [(0, false), (300, false), (20_000, true), (80_000, true)] {
            let g = soup(triangles, 60);
            let intersector = Intersector::new(&g, 1.0);
            assert_eq!(intersector.is_large(), is_large);
            let mut hits = Vec::new();
            for count in [0u64, 1, 5, 8, 9, 700] {
                let rays: Vec<Ray> = (0..count)
                    .map(|i| {
                        let (x, y) = (sequence.four(i, 0), sequence.four(i, 1));
                        let origin = Vec3::new(x[0], x[1], x[2]) * 2.0 - 0.5;
                        let mut direction = crate::math::frame::uniform_sphere(y[0], y[1]).normalize();
                        if i % 5 == 3 {
                            direction[i as usize % 3] = if i % 2 == 0 { 0.0 } else { -0.0 };
                        }
                        let origin = match i % 50 {
                            7 => Vec3::NAN,
                            11 => origin - direction * 1e5,
                            _ => origin,
                        };
                        Ray { origin, direction }
                    })
                    .collect();
                intersector.closest_of(&rays, &mut hits);
                assert_eq!(hits.len(), rays.len());
                for (ray, hit) in rays.iter().zip(&hits) {
                    let of = |hit: &Hit| (hit.t.to_bits(), hit.primitive, hit.weights.map(f32::to_bits));
                    assert_eq!(hit.as_ref().map(of), intersector.closest(ray).as_ref().map(of));
                    met += u32::from(hit.is_some());
                }
            }
        }
        assert!(met > 100, "{met}");
    }

    #[test]
    fn a_ray_that_is_not_finite_meets_nothing() {
        let intersector = Intersector::new(&soup(10, 0), 1.0);
        let ray = Ray { origin: Vec3::splat(f32::NAN), direction: Vec3::X };
        assert!(intersector.closest(&ray).is_none());
    }
}
