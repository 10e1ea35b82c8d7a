//! Direct light by shadow rays.

use crate::math::frame::tangents;
use crate::math::rgb::Rgb;
use crate::math::sequence::Sequence;
use crate::scene::{Light, Scene};
use crate::trace::surface::{SELF_INTERSECTION, flat_normal};
use crate::trace::{Intersector, Ray};
use glam::{DVec3, Vec3};
use std::f32::consts::PI;

/// How far before a light's own surface a shadow ray ends, in units of the offset at its start and of its length:
/// enough that it does not meet the light itself, however near or flat that is.
const SHORT_OF_LIGHT: (f32, f32) = (4.0, 1e-5);

/// Dimension set of a light's shadow rays; sets below belong to the view path.
const LIGHT_SETS: u32 = 1024;

/// A point that is lit.
#[derive(Clone, Copy, Debug)]
pub struct Receiver {
    /// On the surface, metres.
    pub position: Vec3,
    /// Unit normal on the side that is lit.
    pub normal: Vec3,
    /// Unit direction of the ray that has found it.
    pub found_along: Vec3,
}

/// Irradiance from all lights at a receiver, W/m², with `rays` shadow rays to each light that has an area.
///
/// A shadow ray stops at glass too: what comes through is caustic light. `index` picks the numbers of `sequence`.
pub fn irradiance(
    scene: &Scene,
    intersector: &Intersector,
    receiver: &Receiver,
    rays: u32,
    sequence: &Sequence,
    index: u64,
) -> DVec3 {
    let mut sum = DVec3::ZERO;
    for (i, light) in scene.lights.iter().enumerate() {
        let has_area = matches!(light, Light::Sphere { .. } | Light::Quad { .. } | Light::Mesh { .. });
        let count = if has_area { rays } else { 1 };
        let mut own = DVec3::ZERO;
        for ray in 0..count {
            // A light without area is one place, or one direction: no numbers are needed.
            let x = match has_area {
                true => sequence.four(index * u64::from(count) + u64::from(ray), LIGHT_SETS + i as u32),
                false => [0.0; 4],
            };
            if let Some(sample) = sample(light, receiver, scene.radius, x[0], x[1])
                && !blocked(scene, intersector, receiver, &sample)
            {
                own += sample.irradiance;
            }
        }
        sum += own / f64::from(count);
    }
    sum
}

/// Light from one place, if nothing stands in the way.
struct LightSample {
    /// From the receiver to that place, metres.
    offset: Vec3,
    /// W/m².
    irradiance: DVec3,
}

/// Whether something stands between the receiver, lifted off its surface, and a place of a light.
fn blocked(scene: &Scene, intersector: &Intersector, receiver: &Receiver, sample: &LightSample) -> bool {
    let lift = scene.radius * SELF_INTERSECTION;
    // Back along the ray too: where walls meet, rounding may have put the point behind the other one, out of which
    // its own normal does not lead.
    let lifted = (receiver.normal - receiver.found_along) * lift;
    let way = sample.offset - lifted;
    let length = way.length();
    if length.is_nan() || length <= 0.0 {
        return false;
    }
    let ray = Ray { origin: receiver.position + lifted, direction: way / length };
    // A light lower over the surface than its ray is lifted is as good as touched.
    let short = (SHORT_OF_LIGHT.0 * lift).min(length / 2.0) + SHORT_OF_LIGHT.1 * length;
    intersector.any(&ray, length - short)
}

fn sample(light: &Light, r: &Receiver, scene_radius: f32, u: f32, v: f32) -> Option<LightSample> {
    match light {
        Light::Point { position, power } => towards(r, *position, |_| *power / (4.0 * PI)),
        Light::Spot { position, direction, cos_half, falloff, power } => {
            let axial = *power / Light::spot_normalization(*cos_half, *falloff) as f32;
            towards(r, *position, |_| {
                // f64 from the places on: a narrow cone's edge, and a high power of the cosine, are near 1.
                let w = (r.position.as_dvec3() - position.as_dvec3()).normalize();
                let cos = w.dot(direction.as_dvec3().normalize());
                if cos < *cos_half || (*falloff > 0.0 && cos <= 0.0) {
                    Rgb::ZERO
                } else if *falloff == 0.0 {
                    axial
                } else {
                    axial * libm::pow(cos, f64::from(*falloff)) as f32
                }
            })
        }
        Light::Directional { direction, irradiance, .. } => {
            let cos = -direction.dot(r.normal);
            (cos > 0.0).then(|| LightSample {
                offset: -*direction * (4.0 * scene_radius),
                irradiance: irradiance.as_dvec3() * f64::from(cos),
            })
        }
        Light::Sphere { center, radius, power } => sphere(r, *center, *radius, *power, u, v),
        Light::Quad { center, u: eu, v: ev, power } => {
            let position = *center + *eu * (2.0 * u - 1.0) + *ev * (2.0 * v - 1.0);
            // L A = Φ/π, whatever the area.
            from_surface(r, position, quad_normal(*eu, *ev), *power / PI)
        }
        Light::Mesh { triangles, cumulative_area, radiance } => {
            let (position, n) = sample_triangles(triangles, cumulative_area, u, v);
            from_surface(r, position, n, *radiance * *cumulative_area.last()?)
        }
    }
}

/// A point light of that intensity (W/sr) in the direction from the light's point of view reversed.
fn towards(r: &Receiver, position: Vec3, intensity: impl Fn(Vec3) -> Rgb) -> Option<LightSample> {
    let offset = position - r.position;
    let distance = offset.length();
    let w = offset / distance;
    let cos = w.dot(r.normal);
    if !(cos > 0.0 && distance.is_finite()) {
        return None;
    }
    let (intensity, d) = (intensity(w), f64::from(distance));
    (intensity != Rgb::ZERO)
        .then(|| LightSample { offset, irradiance: intensity.as_dvec3() * (f64::from(cos) / (d * d)) })
}

/// One point of a surface that stands for all of it; `radiance_area` is radiance times area.
fn from_surface(r: &Receiver, position: Vec3, n: Vec3, radiance_area: Rgb) -> Option<LightSample> {
    let facing = -(position - r.position).normalize_or_zero().dot(n);
    (facing > 0.0).then(|| towards(r, position, |_| radiance_area * facing)).flatten()
}

/// A direction within the cone that a sphere fills, uniform over solid angle. In f64, and without the sphere's area,
/// so that a tiny or far sphere lights like a point.
fn sphere(r: &Receiver, center: Vec3, radius: f32, power: Rgb, u: f32, v: f32) -> Option<LightSample> {
    let towards = (center - r.position).as_dvec3();
    let d2 = towards.length_squared();
    let r2 = f64::from(radius) * f64::from(radius);
    let sin2 = r2 / d2;
    // Inside the sphere, or at no distance that can be told.
    if sin2 >= 1.0 || sin2.is_nan() {
        return None;
    }
    // 1 - cos without cancellation.
    let rest = sin2 / (1.0 + (1.0 - sin2).sqrt());
    let away = rest * f64::from(u);
    let (cos, sin) = (1.0 - away, (away * (2.0 - away)).max(0.0).sqrt());
    let axis = towards / d2.sqrt();
    let (t, b) = tangents(axis.as_vec3());
    let (s, c) = libm::sincos(std::f64::consts::TAU * f64::from(v));
    let w = axis * cos + (t.as_dvec3() * c + b.as_dvec3() * s) * sin;
    let lit = w.dot(r.normal.as_dvec3());
    if lit <= 0.0 {
        return None;
    }
    // The near side of the sphere: |w t - towards|² = r².
    let distance = d2.sqrt() * cos - (r2 - d2 * sin * sin).max(0.0).sqrt();
    // L Ω cos θ = Φ/(4π² r²) · 2π (1 - cos θ_max) cos θ.
    let scale = lit / (2.0 * std::f64::consts::PI * d2 * (1.0 + (1.0 - sin2).sqrt()));
    Some(LightSample { offset: (w * distance).as_vec3(), irradiance: power.as_dvec3() * scale })
}

/// Unit normal of a parallelogram with half-edges `u`, `v`, whose product may be too small for f32.
pub fn quad_normal(u: Vec3, v: Vec3) -> Vec3 {
    flat_normal([Vec3::ZERO, u, v]).as_vec3()
}

/// Uniform point on triangles: position and unit normal of the front side.
pub fn sample_triangles(triangles: &[[Vec3; 3]], cumulative: &[f32], u: f32, v: f32) -> (Vec3, Vec3) {
    let Some(total) = cumulative.last() else {
        return (Vec3::ZERO, Vec3::Y);
    };
    let target = u * total;
    let i = cumulative.partition_point(|&a| a <= target).min(cumulative.len() - 1);
    let before = if i == 0 { 0.0 } else { cumulative[i - 1] };
    let u = ((target - before) / (cumulative[i] - before)).clamp(0.0, 1.0);
    let [a, b, c] = triangles[i];
    let root = u.sqrt();
    let position = a * (1.0 - root) + b * (root * (1.0 - v)) + c * (root * v);
    (position, flat_normal([a, b, c]).as_vec3())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::sequence::Sampling;
    use crate::scene::{built_in, source::open_built_in};
    use std::f32::consts::TAU;

    fn lit_by(light: Light, position: Vec3, rays: u32) -> f32 {
        let b = built_in::find("plane").expect("built in");
        let mut scene = open_built_in(b).expect("opens");
        scene.lights = vec![light];
        let intersector = Intersector::new(&scene.geometry, scene.radius);
        let receiver = Receiver { position, normal: Vec3::Y, found_along: Vec3::NEG_Y };
        let sequence = Sequence::new(Sampling::Sobol, 1);
        irradiance(&scene, &intersector, &receiver, rays, &sequence, 0).x as f32
    }

    /// Each kind of light against its closed form.
    #[test]
    fn irradiance_has_its_closed_forms() {
        let at = Vec3::new(0.4, 0.0, -0.3);
        let position = Vec3::new(-0.2, 1.1, 0.5);
        let offset = position - at;
        let d = offset.length();
        let cos = offset.y / d;
        let power = Rgb::splat(30.0);
        let point = lit_by(Light::Point { position, power }, at, 1);
        let expected = 30.0 * cos / (4.0 * PI * d * d);
        assert!((point / expected - 1.0).abs() < 1e-5);

        // A Lambertian sphere above the horizon lights like its centre.
        let sphere = lit_by(Light::Sphere { center: position, radius: 0.3, power }, at, 4096);
        assert!((sphere / expected - 1.0).abs() < 1e-3, "{sphere} {expected}");

        // A parallel square above: the form factor from a differential element to a rectangle at its corner.
        let (h, e) = (1.5f32, 0.4f32);
        let quad = lit_by(
            Light::Quad { center: Vec3::new(0.0, h, 0.0), u: Vec3::X * e, v: Vec3::Z * e, power },
            Vec3::ZERO,
            4096,
        );
        let x = e / h;
        let corner = x / (1.0 + x * x).sqrt() * (x / (1.0 + x * x).sqrt()).atan() / PI;
        let radiosity = 30.0 / (4.0 * e * e);
        assert!((quad / (4.0 * corner * radiosity) - 1.0).abs() < 1e-3, "{quad}");

        let half = 0.5f32;
        let axis = -offset.normalize();
        let spot = |falloff| {
            lit_by(Light::Spot { position, direction: axis, cos_half: f64::from(half).cos(), falloff, power }, at, 1)
        };
        let omega = TAU * (1.0 - half.cos());
        assert!((spot(0.0) / (30.0 / omega * cos / (d * d)) - 1.0).abs() < 1e-4);
        let lobe = TAU * (1.0 - half.cos().powi(5)) / 5.0;
        assert!((spot(4.0) / (30.0 / lobe * cos / (d * d)) - 1.0).abs() < 1e-4);

        let beam = lit_by(
            Light::Directional {
                direction: Vec3::new(0.0, -0.8, 0.6),
                irradiance: Rgb::splat(5.0),
                disc_center: Vec3::Y * 9.0,
                disc_radius: 6.0,
            },
            at,
            1,
        );
        assert!((beam - 4.0).abs() < 1e-5);

        // Two triangles make the quad.
        let c = [Vec3::new(-e, h, -e), Vec3::new(e, h, -e), Vec3::new(e, h, e), Vec3::new(-e, h, e)];
        let mesh = Light::mesh(vec![[c[0], c[1], c[2]], [c[0], c[2], c[3]]], Rgb::splat(radiosity / PI));
        let mesh = lit_by(mesh, Vec3::ZERO, 4096);
        assert!((mesh / quad - 1.0).abs() < 5e-3, "{mesh} {quad}");
    }

    /// Where floor and wall meet, rounding puts a point on the floor behind the wall: it is lit as its neighbour is.
    #[test]
    fn a_point_in_a_corner_is_not_in_the_dark() {
        let scene = open_built_in(built_in::find("cornell").expect("built in")).expect("opens");
        let intersector = Intersector::new(&scene.geometry, scene.radius);
        let sequence = Sequence::new(Sampling::Sobol, 1);
        let mut lit = 0;
        for i in 0..200 {
            let at = |x: f32| {
                let position = Vec3::new(x, 0.0, 0.9 - 0.008 * i as f32) - scene.origin.as_vec3();
                let found_along = Vec3::new(-0.5, -0.6, -0.4).normalize();
                let receiver = Receiver { position, normal: Vec3::Y, found_along };
                irradiance(&scene, &intersector, &receiver, 1, &sequence, i).x
            };
            let (corner, beside) = (at(-1.0 - 1e-7), at(-1.0 + 1e-4));
            assert!((corner - beside).abs() <= 2e-3 * beside, "{i}: {corner} {beside}");
            lit += u32::from(beside > 0.0);
        }
        assert!(lit > 50, "{lit}");
    }

    #[test]
    fn light_from_behind_or_within_gives_nothing() {
        let power = Rgb::ONE;
        assert_eq!(lit_by(Light::Point { position: Vec3::NEG_Y, power }, Vec3::ZERO, 1), 0.0);
        assert_eq!(lit_by(Light::Sphere { center: Vec3::ZERO, radius: 1.0, power }, Vec3::ZERO, 1), 0.0);
        assert_eq!(lit_by(Light::Point { position: Vec3::ZERO, power }, Vec3::ZERO, 1), 0.0);
    }
}
