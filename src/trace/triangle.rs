//! A watertight ray-triangle test (Woop, Benthin and Wald 2013), in f64.

use crate::math::eights::{Row, vector};
use crate::math::lanes::bits_of_row;
use crate::trace::packet::PACKET;
use glam::{DVec3, Vec3};
use pulp::Simd;

/// A ray sheared so that it runs along its longest axis; made once for each ray.
///
/// f64, because edge functions in f32 are wrong by 6·10⁻⁸ of the squared length of a triangle: for a needle that is
/// not along an axis more than its width, and the hit slides along it.
#[derive(Clone, Copy, Debug)]
pub struct ShearedRay {
    origin: DVec3,
    /// Rows that take a point about the origin to its sheared coordinates across the ray. They have one entry 1 and one 0,
    /// so that a product with them is rounded as a difference of two numbers is.
    across: [DVec3; 2],
    /// The longest axis, and that over the direction's component along it.
    along: DVec3,
    per_length: f64,
}

/// The two axes across a direction, and the longest along it: right-handed where it goes up.
#[inline(always)]
pub fn axes_of(direction: Vec3) -> [usize; 3] {
    let a = direction.abs();
    let [x, y, along] = if a.x >= a.y && a.x >= a.z {
        [1, 2, 0]
    } else if a.y >= a.z {
        [2, 0, 1]
    } else {
        [0, 1, 2]
    };
    if direction[along] < 0.0 { [y, x, along] } else { [x, y, along] }
}

impl ShearedRay {
    /// Prepares a ray; `direction` must be finite and not zero.
    #[inline]
    pub fn new(origin: Vec3, direction: Vec3) -> Self {
        let d = direction.as_dvec3();
        let [x, y, along] = axes_of(direction).map(|axis| DVec3::AXES[axis]);
        let per_length = 1.0 / d.dot(along);
        let across = [x - along * (d.dot(x) * per_length), y - along * (d.dot(y) * per_length)];
        Self { origin: origin.as_dvec3(), across, along, per_length }
    }

    /// Distance along the ray and the weights of the second and third corner, if the triangle is met from either
    /// side at a distance in `(0, t_max]`. An edge shared by two triangles is never missed by both; a triangle that
    /// the ray runs along, or that has no area, is not met.
    #[inline(always)]
    pub fn intersect(&self, corners: &[Vec3; 3], t_max: f32) -> Option<(f32, f32, f32)> {
        let [sx, sy] = self.across;
        let [a, b, c] = [
            corners[0].as_dvec3() - self.origin,
            corners[1].as_dvec3() - self.origin,
            corners[2].as_dvec3() - self.origin,
        ];
        let (ax, ay) = (sx.dot(a), sy.dot(a));
        let (bx, by) = (sx.dot(b), sy.dot(b));
        let (cx, cy) = (sx.dot(c), sy.dot(c));
        // The neighbour across an edge has exactly the negative of its function, so that one of both is met.
        let u = cx * by - cy * bx;
        let v = ax * cy - ay * cx;
        let w = bx * ay - by * ax;
        if u.min(v).min(w) < 0.0 && u.max(v).max(w) > 0.0 {
            return None;
        }
        let det = u + v + w;
        if det == 0.0 {
            return None;
        }
        let per_det = 1.0 / det;
        let z = self.along;
        let t = ((u * z.dot(a) + v * z.dot(b) + w * z.dot(c)) * (self.per_length * per_det)) as f32;
        (t > 0.0 && t <= t_max).then_some((t, (v * per_det) as f32, (w * per_det) as f32))
    }
}

/// Several rays along one longest axis, sheared as each alone.
#[derive(Default)]
pub struct ShearedRays {
    /// The two axes across, and the longest.
    axes: [usize; 3],
    origin: [[f64; PACKET]; 3],
    /// What the two coordinates across change by on the way of one along.
    slope: [[f64; PACKET]; 2],
    per_length: [f64; PACKET],
}

/// Which rays meet a triangle, and where.
pub struct HitLanes {
    /// The bits of those that do.
    pub met: u32,
    /// Distances along the rays.
    pub t: Row,
    /// Weights of the second and third corner.
    pub weights: [Row; 2],
}

impl ShearedRays {
    /// Those of rays that go to one octant and have one longest axis.
    #[inline(always)]
    pub fn new(origin: &[Row; 3], direction: &[Row; 3]) -> Self {
        let axes = axes_of(vector(direction, 0));
        let mut all = Self { axes, ..Self::default() };
        let [x, y, along] = axes;
        for i in 0..PACKET {
            all.origin[0][i] = f64::from(origin[x][i]);
            all.origin[1][i] = f64::from(origin[y][i]);
            all.origin[2][i] = f64::from(origin[along][i]);
            let per_length = 1.0 / f64::from(direction[along][i]);
            all.per_length[i] = per_length;
            all.slope[0][i] = f64::from(direction[x][i]) * per_length;
            all.slope[1][i] = f64::from(direction[y][i]) * per_length;
        }
        all
    }

    /// What [`ShearedRay::intersect`] finds for each of those rays whose bits are set.
    #[inline(always)]
    pub fn intersect<S: Simd>(&self, simd: S, corners: &[Vec3; 3], t_max: &Row, rays: u32) -> HitLanes {
        let [a, b, c] = corners;
        let [x, y, z] = self.axes;
        let corners = [[a[x], a[y], a[z]], [b[x], b[y], b[z]], [c[x], c[y], c[z]]].map(|c| c.map(f64::from));
        let zero = [0.0; PACKET];
        let (mut us, mut vs, mut ws) = (zero, zero, zero);
        let mut may = [0.0; PACKET];
        for i in 0..PACKET {
            let (ox, oy, oz) = (self.origin[0][i], self.origin[1][i], self.origin[2][i]);
            let (sx, sy) = (self.slope[0][i], self.slope[1][i]);
            let [a, b, c] = corners;
            let (ax, ay) = ((a[0] - ox) - sx * (a[2] - oz), (a[1] - oy) - sy * (a[2] - oz));
            let (bx, by) = ((b[0] - ox) - sx * (b[2] - oz), (b[1] - oy) - sy * (b[2] - oz));
            let (cx, cy) = ((c[0] - ox) - sx * (c[2] - oz), (c[1] - oy) - sy * (c[2] - oz));
            let u = cx * by - cy * bx;
            let v = ax * cy - ay * cx;
            let w = bx * ay - by * ax;
            let misses = ((u < 0.0) | (v < 0.0) | (w < 0.0)) & ((u > 0.0) | (v > 0.0) | (w > 0.0));
            may[i] = if misses { 0.0 } else { 1.0 };
            (us[i], vs[i], ws[i]) = (u, v, w);
        }
        let may = bits_of_row(simd, &may) & rays;
        if may == 0 {
            return HitLanes { met: 0, t: [0.0; PACKET], weights: [[0.0; PACKET]; 2] };
        }
        let (mut met, mut ts, mut bs, mut cs) = ([0.0f32; PACKET], [0.0; PACKET], [0.0; PACKET], [0.0; PACKET]);
        for i in 0..PACKET {
            let (u, v, w) = (us[i], vs[i], ws[i]);
            let det = u + v + w;
            let per_det = 1.0 / det;
            let oz = self.origin[2][i];
            let [a, b, c] = corners;
            let along = u * (a[2] - oz) + v * (b[2] - oz) + w * (c[2] - oz);
            let t = (along * (self.per_length[i] * per_det)) as f32;
            met[i] = if (det != 0.0) & (t > 0.0) & (t <= t_max[i]) { 1.0 } else { 0.0 };
            ts[i] = t;
            bs[i] = (v * per_det) as f32;
            cs[i] = (w * per_det) as f32;
        }
        HitLanes { met: bits_of_row(simd, &met) & may, t: ts, weights: [bs, cs] }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::frame::{uniform_sphere, unit_or};
    use crate::math::sequence::{Sampling, Sequence};

    #[test]
    fn hits_agree_with_the_plane_equation() {
        let sequence = Sequence::new(Sampling::Random, 1);
        let mut hits = 0;
        for i in 0..20_000 {
            let p = |set| {
                let x = sequence.four(i, set);
                Vec3::new(x[0], x[1], x[2]) * 2.0 - 1.0
            };
            let corners = [p(0), p(1), p(2)];
            let o = p(3) * 3.0;
            let d = unit_or(p(4) - o, Vec3::X);
            let Some((t, b, c)) = ShearedRay::new(o, d).intersect(&corners, f32::INFINITY) else {
                continue;
            };
            hits += 1;
            let on_triangle = corners[0] * (1.0 - b - c) + corners[1] * b + corners[2] * c;
            let n = (corners[1] - corners[0]).cross(corners[2] - corners[0]).normalize();
            if n.dot(d).abs() > 1e-2 {
                assert!((o + d * t - on_triangle).length() < 2e-4 * (1.0 + t));
            }
        }
        assert!(hits > 500);
    }

    /// On a needle across all axes the place that the weights name is the one that the distance names.
    #[test]
    fn a_hit_does_not_slide_along_a_needle() {
        let along = Vec3::new(1.0, 0.9, -0.8);
        for width in [1e-2f32, 1e-4, 1e-6] {
            let corners = [-along, along, Vec3::new(-0.5, 0.6, 0.1) * width];
            for i in 0..50 {
                let target = (corners[0] + (corners[1] - corners[0]) * (0.02 * i as f32)).lerp(corners[2], 0.3);
                let o = Vec3::new(0.3, -0.4, 2.0);
                let Some((t, b, c)) = ShearedRay::new(o, target - o).intersect(&corners, f32::INFINITY) else {
                    continue;
                };
                let place = corners[0] * (1.0 - b - c) + corners[1] * b + corners[2] * c;
                assert!((o + (target - o) * t - place).length() < 1e-6, "{width} {i}: {}", place - target);
            }
        }
    }

    /// Rays from inside a closed octahedron aimed exactly at its vertices and edges never leave it.
    #[test]
    fn no_ray_leaks_through_edges_or_vertices() {
        let v = [Vec3::X, Vec3::Y, Vec3::Z, -Vec3::X, -Vec3::Y, -Vec3::Z].map(|v| v * 0.7 + 0.03);
        let faces = [[0, 1, 2], [1, 3, 2], [3, 4, 2], [4, 0, 2], [1, 0, 5], [3, 1, 5], [4, 3, 5], [0, 4, 5]];
        let sequence = Sequence::new(Sampling::Random, 2);
        for i in 0..200_000u64 {
            let x = sequence.four(i, 0);
            let o = uniform_sphere(x[0], x[1]) * 0.2 * x[2];
            let f = faces[i as usize % 8];
            let along = match i % 3 {
                0 => 0.0,
                1 => 1.0,
                _ => x[3],
            };
            let target = v[f[0]].lerp(v[f[1]], along);
            let ray = ShearedRay::new(o, (target - o).normalize());
            let met = faces.iter().any(|f| ray.intersect(&f.map(|k| v[k]), f32::INFINITY).is_some());
            assert!(met, "leak towards {target}");
        }
    }
}
