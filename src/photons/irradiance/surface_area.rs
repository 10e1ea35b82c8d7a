//! How much of the scene's surface a ball holds: the area over which the photons in it have spread.

use crate::photons::irradiance::SURFACE_AGREEMENT;
use crate::photons::overlap::OverlapTree;
use crate::scene::Scene;
use crate::trace::surface::flat_normal;
use glam::{DVec2, DVec3, Vec3};
use std::f64::consts::PI;

/// Distance from a ball's centre below which a triangle lies in the plane of the surface there, in radii of the ball.
const IN_PLANE: f64 = 1e-3;

/// The surfaces at which photons are stored.
pub struct SurfaceAreas<'a> {
    scene: &'a Scene,
    /// Over the boxes of the diffuse surfaces.
    tree: OverlapTree,
    /// Primitive of each entry of the tree.
    primitives: Vec<u32>,
}

impl<'a> SurfaceAreas<'a> {
    /// Those of a scene.
    pub fn new(scene: &'a Scene) -> Self {
        let g = &scene.geometry;
        let diffuse: Vec<u32> =
            (0..g.primitive_count() as u32).filter(|&i| scene.materials[g.material(i as usize)].is_diffuse()).collect();
        let bounds = |&i: &u32| {
            let (low, high) = g.bounds(i as usize);
            ((low + high) / 2.0, (high - low) / 2.0)
        };
        let tree = OverlapTree::new(&diffuse.iter().map(bounds).collect::<Vec<_>>());
        let primitives = tree.order().iter().map(|&i| diffuse[i as usize]).collect();
        Self { scene, tree, primitives }
    }

    /// The scene.
    pub fn scene(&self) -> &'a Scene {
        self.scene
    }

    /// Area of all of them, one side each, m².
    pub fn total(&self) -> f64 {
        let g = &self.scene.geometry;
        let area = |&i: &u32| match g.spheres.get((i as usize).wrapping_sub(g.triangles.len())) {
            Some(s) => 4.0 * PI * f64::from(s.radius).powi(2),
            None => {
                let [a, b, c] = g.corners(i as usize).map(|v| v.as_dvec3());
                (b - a).cross(c - a).length() / 2.0
            }
        };
        self.primitives.iter().map(area).sum()
    }

    /// Area of what lies within `radius` (metres) of a place of a surface and whose normal agrees with the unit `normal`
    /// there, m².
    ///
    /// Exact for triangles, and for a sphere on which the place lies. Where surfaces do not lie in the place's plane only
    /// those count that turn the same side towards the normal as the surface there does: the far face of a slab does not.
    pub fn within(&self, position: Vec3, normal: Vec3, radius: f32) -> f64 {
        let g = &self.scene.geometry;
        let (center, n, r) = (position.as_dvec3(), normal.as_dvec3(), f64::from(radius));
        let agreement = f64::from(SURFACE_AGREEMENT);
        // Distance to the nearest plane, and the side of its triangle on which the normal is.
        let mut own = (f64::INFINITY, 1.0);
        let mut others: Vec<(f64, f64)> = Vec::new();
        let mut area = 0.0;
        self.tree.in_box(position, Vec3::splat(radius), |entry| {
            let i = self.primitives[entry as usize];
            if let Some(s) = g.spheres.get((i as usize).wrapping_sub(g.triangles.len())) {
                area += cap(s.center.as_dvec3(), f64::from(s.radius), center, n, r);
                return;
            }
            let corners = g.corners(i as usize);
            let front = flat_normal(corners);
            let facing = front.dot(n);
            if facing.abs() < agreement {
                return;
            }
            let [a, b, c] = corners.map(|v| v.as_dvec3());
            let distance = front.dot(center - a);
            let part = triangle_in_ball([a, b, c], front, center, r);
            if part <= 0.0 {
                return;
            }
            if distance.abs() < own.0 {
                own = (distance.abs(), facing.signum());
            }
            if distance.abs() <= IN_PLANE * r {
                area += part;
            } else {
                others.push((facing, part));
            }
        });
        area + others.iter().filter(|(facing, _)| facing * own.1 > 0.0).map(|(_, part)| part).sum::<f64>()
    }
}

/// Area of a sphere's surface within the ball about `center`, where its normal agrees with `n` on the side of `n`.
fn cap(sphere: DVec3, radius: f64, center: DVec3, n: DVec3, r: f64) -> f64 {
    let to = center - sphere;
    let d = to.length();
    let facing = if d > 0.0 { to.dot(n) / d } else { 0.0 };
    if facing.abs() < f64::from(SURFACE_AGREEMENT) {
        return 0.0;
    }
    // The chord of the cap squared, from where both spheres meet; on the sphere itself it is the ball's radius.
    let chord = ((r * r - (d - radius).powi(2)) * radius / d).max(0.0);
    // Where normals turn away by more than they may.
    let agreeing = 2.0 * radius * radius * (1.0 - f64::from(SURFACE_AGREEMENT));
    PI * chord.min(agreeing).min(4.0 * radius * radius)
}

/// Area of a triangle of unit normal `front` within the ball.
fn triangle_in_ball([a, b, c]: [DVec3; 3], front: DVec3, center: DVec3, r: f64) -> f64 {
    let distance = front.dot(center - a);
    let rho2 = r * r - distance * distance;
    if rho2 <= 0.0 {
        return 0.0;
    }
    let (t, s) = front.any_orthonormal_pair();
    let flat = |v: DVec3| DVec2::new(t.dot(v - center), s.dot(v - center));
    let [p, q, w] = [flat(a), flat(b), flat(c)];
    (sector(p, q, rho2) + sector(q, w, rho2) + sector(w, p, rho2)).abs()
}

/// Signed area of the part of the triangle (origin, p, q) in the disc about the origin of that squared radius.
fn sector(p: DVec2, q: DVec2, rho2: f64) -> f64 {
    let arc = |u: DVec2, v: DVec2| libm::atan2(u.perp_dot(v), u.dot(v)) * rho2 / 2.0;
    let along = q - p;
    let (aa, pa, pp) = (along.length_squared(), p.dot(along), p.length_squared());
    let root = pa * pa - aa * (pp - rho2);
    if aa <= 0.0 || root <= 0.0 {
        return arc(p, q);
    }
    let root = root.sqrt();
    let (from, to) = (((-pa - root) / aa).clamp(0.0, 1.0), ((-pa + root) / aa).clamp(0.0, 1.0));
    if from >= to {
        return arc(p, q);
    }
    let (enter, leave) = (p + along * from, p + along * to);
    arc(p, enter) + enter.perp_dot(leave) / 2.0 + arc(leave, q)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::sequence::{Sampling, Sequence};
    use crate::scene::{built_in, source::open_built_in};

    /// The part of a triangle in a ball against a fine grid over the triangle.
    #[test]
    fn triangles_are_clipped_to_the_ball() {
        let sequence = Sequence::new(Sampling::Random, 2);
        for i in 0..60 {
            let corner = |set| {
                let x = sequence.four(i, set);
                DVec3::new(f64::from(x[0]), f64::from(x[1]), f64::from(x[2])) * 2.0 - 1.0
            };
            let [a, b, c] = [corner(0), corner(1), corner(2)];
            let (center, r) = (corner(3) * 0.5, 0.3 + 0.02 * i as f64);
            let whole = (b - a).cross(c - a);
            let n = 400;
            let mut inside = 0;
            for u in 0..n {
                for v in 0..n {
                    let (x, y) = ((f64::from(u) + 0.5) / f64::from(n), (f64::from(v) + 0.5) / f64::from(n));
                    let root = x.sqrt();
                    let at = a * (1.0 - root) + b * (root * (1.0 - y)) + c * (root * y);
                    inside += u32::from((at - center).length() < r);
                }
            }
            let expected = whole.length() / 2.0 * f64::from(inside) / f64::from(n * n);
            let got = triangle_in_ball([a, b, c], whole.normalize(), center, r);
            assert!((got - expected).abs() < 4e-3 * whole.length(), "{i}: {got} {expected}");
        }
    }

    /// In the middle of a wall the whole disc, at an edge half, in a corner of the room a quarter, on a sphere πr².
    #[test]
    fn areas_have_their_closed_forms() {
        let scene = open_built_in(built_in::find("two_lights").expect("built in")).expect("opens");
        let areas = SurfaceAreas::new(&scene);
        let at = |x: f64, y: f64, z: f64| (DVec3::new(x, y, z) - scene.origin).as_vec3();
        let r = 0.1f32;
        let disc = PI * 0.01;
        for (place, part) in [(at(1.0, 0.0, 3.0), 1.0), (at(2.0, 0.0, 2.0), 0.5), (at(-2.0, 0.0, 4.0), 0.25)] {
            let area = areas.within(place, Vec3::Y, r);
            assert!((area / (part * disc) - 1.0).abs() < 1e-5, "{place}: {area}");
        }
        let up = Vec3::new(0.6, 0.8, 0.0);
        let on_sphere = at(0.7, 0.4, 0.3) + up * 0.4;
        assert!((areas.within(on_sphere, up, r) / disc - 1.0).abs() < 1e-3);
        // As far as normals agree, and no farther.
        let agreeing = PI * 2.0 * 0.4f64.powi(2) * 0.1;
        assert!((areas.within(on_sphere, up, 0.39) / agreeing - 1.0).abs() < 1e-3);
        // On top of a slab 4 cm thick its underside does not count.
        assert!((areas.within(at(-1.6, 1.72, -0.6), Vec3::Y, r) / disc - 1.0).abs() < 1e-5);
        assert_eq!(areas.within(at(0.0, 1.3, 1.0), Vec3::Y, r), 0.0);
    }
}
