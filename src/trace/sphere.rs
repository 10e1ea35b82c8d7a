//! Where a ray meets a sphere.

use crate::trace::Ray;
use glam::Vec3;

/// Distance to a sphere from outside or inside, in `(0, t_max]`; f64, because the discriminant cancels.
pub fn sphere(ray: &Ray, center: Vec3, radius: f32, t_max: f32) -> Option<f32> {
    let d = ray.direction.as_dvec3();
    let o = ray.origin.as_dvec3() - center.as_dvec3();
    let a = d.length_squared();
    let b = o.dot(d);
    // |o - (o·d)d|² against r² keeps its digits for far origins.
    let off = (o - d * (b / a)).length_squared();
    let rest = f64::from(radius).powi(2) - off;
    if rest < 0.0 {
        return None;
    }
    let half = (rest / a).sqrt();
    let (near, far) = ((-b / a - half) as f32, (-b / a + half) as f32);
    let t = if near > 0.0 { near } else { far };
    (t > 0.0 && t <= t_max).then_some(t)
}
