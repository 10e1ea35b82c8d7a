//! A watertight ray-triangle test (Woop, Benthin and Wald 2013), in f64.

use glam::Vec3;

/// A ray sheared so that it runs along its longest axis; made once for each ray.
///
/// f64, because edge functions in f32 are wrong by 6·10⁻⁸ of the squared length of a triangle: for a needle that is
/// not along an axis more than its width, and the hit slides along it.
#[derive(Clone, Copy, Debug)]
pub struct ShearedRay {
    origin: [f64; 3],
    axes: [usize; 3],
    shear: [f64; 3],
    /// Origin and shear along the two other axes in f32, for triangles that are clearly missed.
    rough: ([f32; 3], [f32; 2]),
}

/// Error of an edge function in f32 over the product of what its corners' coordinates are made of: twenty roundings at most.
const ROUGH: f32 = 16.0 * f32::EPSILON;

impl ShearedRay {
    /// Prepares a ray; `direction` must be finite and not zero.
    pub fn new(origin: Vec3, direction: Vec3) -> Self {
        let d = direction.as_dvec3().to_array();
        let a = direction.abs();
        let kz = if a.x >= a.y && a.x >= a.z {
            0
        } else if a.y >= a.z {
            1
        } else {
            2
        };
        let (mut kx, mut ky) = ((kz + 1) % 3, (kz + 2) % 3);
        if d[kz] < 0.0 {
            std::mem::swap(&mut kx, &mut ky);
        }
        let shear = [d[kx] / d[kz], d[ky] / d[kz], 1.0 / d[kz]];
        let rough = (origin.to_array(), [shear[0] as f32, shear[1] as f32]);
        Self { origin: origin.as_dvec3().to_array(), axes: [kx, ky, kz], shear, rough }
    }

    /// Distance along the ray and the weights of the second and third corner, if the triangle is met from either
    /// side at a distance in `(0, t_max]`. An edge shared by two triangles is never missed by both; a triangle that
    /// the ray runs along, or that has no area, is not met.
    #[inline]
    pub fn intersect(&self, corners: &[Vec3; 3], t_max: f32) -> Option<(f32, f32, f32)> {
        if self.clearly_misses(corners) {
            return None;
        }
        let [kx, ky, kz] = self.axes;
        let [sx, sy, sz] = self.shear;
        let mut x = [0.0f64; 3];
        let mut y = [0.0f64; 3];
        let mut z = [0.0f64; 3];
        for i in 0..3 {
            let c = corners[i].to_array();
            z[i] = f64::from(c[kz]) - self.origin[kz];
            x[i] = (f64::from(c[kx]) - self.origin[kx]) - sx * z[i];
            y[i] = (f64::from(c[ky]) - self.origin[ky]) - sy * z[i];
        }
        // The neighbour across an edge has exactly the negative of its function, so that one of both is met.
        let u = x[2] * y[1] - y[2] * x[1];
        let v = x[0] * y[2] - y[0] * x[2];
        let w = x[1] * y[0] - y[1] * x[0];
        if (u < 0.0 || v < 0.0 || w < 0.0) && (u > 0.0 || v > 0.0 || w > 0.0) {
            return None;
        }
        let det = u + v + w;
        if det == 0.0 {
            return None;
        }
        let t = ((u * z[0] + v * z[1] + w * z[2]) * sz / det) as f32;
        (t > 0.0 && t <= t_max).then(|| (t, (v / det) as f32, (w / det) as f32))
    }

    /// Whether two edge functions have different signs beyond any rounding of f32. Most triangles that a ray is tested
    /// against are missed by far.
    #[inline]
    fn clearly_misses(&self, corners: &[Vec3; 3]) -> bool {
        let [kx, ky, kz] = self.axes;
        let (o, [sx, sy]) = self.rough;
        let (mut x, mut y) = ([0.0f32; 3], [0.0f32; 3]);
        let (mut across, mut down) = (0.0f32, 0.0f32);
        for i in 0..3 {
            let c = corners[i].to_array();
            let (dx, dy, dz) = (c[kx] - o[kx], c[ky] - o[ky], c[kz] - o[kz]);
            // Shears lie in [-1, 1].
            x[i] = dx - sx * dz;
            y[i] = dy - sy * dz;
            across = across.max(dx.abs() + dz.abs());
            down = down.max(dy.abs() + dz.abs());
        }
        let u = x[2] * y[1] - y[2] * x[1];
        let v = x[0] * y[2] - y[0] * x[2];
        let w = x[1] * y[0] - y[1] * x[0];
        let doubt = ROUGH * across * down;
        u.min(v).min(w) < -doubt && u.max(v).max(w) > doubt
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
