//! Light straight from the lights at a surface, by shadow rays.

use crate::measure::tracer::directions::Cone;
use crate::scene::{Light, Scene};
use crate::trace::surface::SELF_INTERSECTION;
use crate::trace::{Intersector, Ray, Surface};
use glam::DVec3;
use std::f64::consts::PI;

/// Up to so many lights each gets a shadow ray; of more one is chosen.
const EACH: usize = 4;

/// The lights of a scene as surfaces ask for them.
pub struct Illumination<'a> {
    scene: &'a Scene,
    intersector: &'a Intersector,
    /// Probability of each light up to and including it, if one is chosen.
    cumulative: Vec<f64>,
}

/// Light that comes from one place of a light, if nothing stands in the way.
struct Arriving {
    /// From the surface to that place, metres.
    way: DVec3,
    /// Irradiance over the density of the place, W/m².
    irradiance: DVec3,
    /// Whether the place lies on a surface of its own.
    has_area: bool,
}

impl<'a> Illumination<'a> {
    /// The lights of `scene`.
    pub fn new(scene: &'a Scene, intersector: &'a Intersector) -> Self {
        let flux = |l: &Light| f64::from(l.flux().element_sum()).max(0.0);
        let total: f64 = scene.lights.iter().map(flux).sum();
        let n = scene.lights.len() as f64;
        let mut cumulative = Vec::new();
        if scene.lights.len() > EACH && total > 0.0 && total.is_finite() {
            let mut sum = 0.0;
            for l in &scene.lights {
                // Half by flux, half evenly: a weak light may be near.
                sum += 0.5 * flux(l) / total + 0.5 / n;
                cumulative.push(sum);
            }
        }
        Self { scene, intersector, cumulative }
    }

    /// Estimate of the irradiance from all lights on the side of a surface that its normals face, W/m². A shadow ray
    /// stops at glass. `numbers` gives three numbers in `[0, 1)` for a light.
    pub fn irradiance(&self, surface: &Surface, numbers: impl Fn(usize) -> [f32; 4]) -> DVec3 {
        let lights = &self.scene.lights;
        if self.cumulative.is_empty() {
            let each = lights.iter().enumerate().map(|(i, light)| self.from(light, surface, numbers(i)));
            return each.fold(DVec3::ZERO, |sum, e| sum + e);
        }
        let x = numbers(0);
        let last = lights.len() - 1;
        let i = self.cumulative.partition_point(|&c| c <= f64::from(x[2])).min(last);
        let probability = self.cumulative[i] - if i == 0 { 0.0 } else { self.cumulative[i - 1] };
        self.from(&lights[i], surface, x) / probability
    }

    fn from(&self, light: &Light, surface: &Surface, x: [f32; 4]) -> DVec3 {
        let (p, n) = (surface.position.as_dvec3(), surface.normal.as_dvec3());
        match arriving(light, p, n, f64::from(self.scene.radius), f64::from(x[0]), f64::from(x[1])) {
            Some(a) if a.irradiance.is_finite() && !self.is_blocked(surface, &a) => a.irradiance,
            _ => DVec3::ZERO,
        }
    }

    fn is_blocked(&self, surface: &Surface, arriving: &Arriving) -> bool {
        let start = surface.leave(self.scene, arriving.way.as_vec3());
        let way = surface.position.as_dvec3() + arriving.way - start.as_dvec3();
        let length = way.length();
        if length.is_nan() || length <= 0.0 {
            return false;
        }
        // A light's own surface is no obstacle.
        let short = if arriving.has_area {
            (4.0 * f64::from(self.scene.radius * SELF_INTERSECTION) + 2e-5 * length).min(length / 2.0)
        } else {
            0.0
        };
        let ray = Ray { origin: start, direction: (way / length).as_vec3() };
        self.intersector.any(&ray, (length - short) as f32)
    }
}

fn arriving(light: &Light, p: DVec3, n: DVec3, scene_radius: f64, u: f64, v: f64) -> Option<Arriving> {
    match light {
        Light::Point { position, power } => from_point(p, n, position.as_dvec3(), |_| power.as_dvec3() / (4.0 * PI)),
        Light::Spot { position, direction, cos_half, falloff, power } => {
            let (axis, edge, exponent) = (direction.as_dvec3(), *cos_half, f64::from(*falloff));
            from_point(p, n, position.as_dvec3(), |w| power.as_dvec3() * spot_density((-w).dot(axis), edge, exponent))
        }
        Light::Directional { direction, irradiance, .. } => {
            let cos = -direction.as_dvec3().dot(n);
            (cos > 0.0).then(|| Arriving {
                way: -direction.as_dvec3() * (4.0 * scene_radius),
                irradiance: irradiance.as_dvec3() * cos,
                has_area: false,
            })
        }
        Light::Sphere { center, radius, power } => {
            let (c, r) = (center.as_dvec3(), f64::from(*radius));
            let cone = Cone::of(p, c, r)?;
            let w = cone.sample(u, v);
            let cos = w.dot(n);
            if cos <= 0.0 {
                return None;
            }
            // The near side: the smaller root of |p + w t - c|² = r².
            let to = c - p;
            let along = to.dot(w);
            let near = along - (r * r - (to - w * along).length_squared()).max(0.0).sqrt();
            let radiance = power.as_dvec3() / (4.0 * PI * PI * r * r);
            Some(Arriving { way: w * near, irradiance: radiance * (cos * cone.solid_angle()), has_area: true })
        }
        Light::Quad { center, u: half_u, v: half_v, power } => {
            let (a, b) = (half_u.as_dvec3(), half_v.as_dvec3());
            let at = center.as_dvec3() + a * (2.0 * u - 1.0) + b * (2.0 * v - 1.0);
            // Radiance times area: Φ/π.
            from_area(p, n, at, a.cross(b).normalize(), power.as_dvec3() / PI)
        }
        Light::Mesh { triangles, cumulative_area, radiance } => {
            let total = f64::from(*cumulative_area.last()?);
            let (at, front) = on_triangles(triangles, cumulative_area, u, v)?;
            from_area(p, n, at, front, radiance.as_dvec3() * total)
        }
    }
}

fn from_point(p: DVec3, n: DVec3, at: DVec3, intensity: impl Fn(DVec3) -> DVec3) -> Option<Arriving> {
    let way = at - p;
    let d2 = way.length_squared();
    let w = way / d2.sqrt();
    let cos = w.dot(n);
    (cos > 0.0 && d2 > 0.0).then(|| Arriving { way, irradiance: intensity(w) * (cos / d2), has_area: false })
}

fn from_area(p: DVec3, n: DVec3, at: DVec3, front: DVec3, radiance_area: DVec3) -> Option<Arriving> {
    let arriving = from_point(p, n, at, |w| radiance_area * (-w).dot(front).max(0.0))?;
    (arriving.irradiance != DVec3::ZERO).then_some(Arriving { has_area: true, ..arriving })
}

/// Density over solid angle of the light of a spot at the cosine `cos` to its axis: `cos^falloff` inside its cone.
pub fn spot_density(cos: f64, edge: f64, falloff: f64) -> f64 {
    if cos < edge || (falloff > 0.0 && cos <= 0.0) {
        return 0.0;
    }
    let whole = if falloff > 0.0 { 1.0 - libm::pow(edge.max(0.0), falloff + 1.0) } else { 1.0 - edge };
    libm::pow(cos, falloff) * (falloff + 1.0) / (2.0 * PI * whole)
}

/// A uniform point of triangles and the unit normal of its front; None without triangles.
pub fn on_triangles(triangles: &[[glam::Vec3; 3]], cumulative_area: &[f32], u: f64, v: f64) -> Option<(DVec3, DVec3)> {
    let total = f64::from(*cumulative_area.last()?);
    let at = u * total;
    let i = cumulative_area.partition_point(|&a| f64::from(a) <= at).min(triangles.len().checked_sub(1)?);
    let before = if i == 0 { 0.0 } else { f64::from(cumulative_area[i - 1]) };
    let own = f64::from(cumulative_area[i]) - before;
    let u = if own > 0.0 { ((at - before) / own).clamp(0.0, 1.0) } else { 0.5 };
    let [a, b, c] = triangles[i].map(|p| p.as_dvec3());
    let root = u.sqrt();
    let point = a + (b - a) * (root * (1.0 - v)) + (c - a) * (root * v);
    Some((point, (b - a).cross(c - a).try_normalize()?))
}
