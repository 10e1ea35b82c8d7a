//! Photons as they leave a light, some of them aimed at what is specular.

use crate::measure::tracer::directions::{self, Cone, FRAC_1_PI};
use crate::measure::tracer::illumination::{on_triangles, spot_density};
use crate::scene::{Light, Scene};
use crate::trace::Ray;
use crate::trace::surface::SELF_INTERSECTION;
use glam::DVec3;
use std::f64::consts::PI;

/// A sphere at which a share of the photons is aimed; the rest leave as the light shines.
#[derive(Clone, Copy, Debug)]
pub struct Aim {
    /// Centre, metres.
    pub center: DVec3,
    /// Radius, metres.
    pub radius: f64,
    /// Share of the photons, above 0. With 1, photons that miss the sphere are left out.
    pub share: f64,
}

impl Aim {
    /// At the sphere around all specular surfaces; None without any.
    pub fn at_specular(scene: &Scene, share: f64) -> Option<Self> {
        let g = &scene.geometry;
        let specular = (0..g.primitive_count()).filter(|&i| scene.materials[g.material(i)].is_specular());
        let (low, high) = specular.map(|i| g.bounds(i)).reduce(|a, b| (a.0.min(b.0), a.1.max(b.1)))?;
        let (low, high) = (low.as_dvec3(), high.as_dvec3());
        // A little more than the box, so that rounding leaves nothing out.
        let radius = (high - low).length() / 2.0 + 1e-4 * f64::from(scene.radius);
        (share > 0.0).then_some(Self { center: (low + high) / 2.0, radius, share })
    }
}

/// The start of a photon, and its power over an even share of the light's flux.
pub struct Start {
    /// Its first ray.
    pub ray: Ray,
    /// Density of the light's own photons over that of these.
    pub weight: f64,
}

/// Starts a photon of a light from four numbers in `[0, 1)`; None if it carries nothing.
pub fn start(scene: &Scene, light: &Light, aim: Option<&Aim>, x: [f32; 4]) -> Option<Start> {
    let x = x.map(f64::from);
    let from = |origin: DVec3, (direction, weight): (DVec3, f64)| {
        let ray = Ray { origin: origin.as_vec3(), direction: direction.as_vec3() };
        (weight > 0.0 && weight.is_finite()).then_some(Start { ray, weight })
    };
    let off_surface = |at: DVec3, n: DVec3| {
        let own = |u, v| directions::cosine(n, u, v);
        let aimed = aimed(aim, at, own, |w| w.dot(n).max(0.0) * FRAC_1_PI, x[2], x[3]);
        from(at + n * f64::from(scene.radius * SELF_INTERSECTION), aimed)
    };
    match light {
        Light::Point { position, .. } => {
            let at = position.as_dvec3();
            from(at, aimed(aim, at, directions::sphere, |_| 1.0 / (4.0 * PI), x[0], x[1]))
        }
        Light::Spot { position, direction, cos_half, falloff, .. } => {
            let (at, axis) = (position.as_dvec3(), direction.as_dvec3());
            let (edge, falloff) = (*cos_half, f64::from(*falloff));
            let own = |u: f64, v: f64| directions::around(axis, spot_cosine(u, edge, falloff), v);
            from(at, aimed(aim, at, own, |w| spot_density(w.dot(axis), edge, falloff), x[0], x[1]))
        }
        Light::Sphere { center, radius, .. } => {
            let n = directions::sphere(x[0], x[1]);
            off_surface(center.as_dvec3() + n * f64::from(*radius), n)
        }
        Light::Quad { center, u, v, .. } => {
            let (a, b) = (u.as_dvec3(), v.as_dvec3());
            off_surface(center.as_dvec3() + a * (2.0 * x[0] - 1.0) + b * (2.0 * x[1] - 1.0), a.cross(b).normalize())
        }
        Light::Mesh { triangles, cumulative_area, .. } => {
            let (at, n) = on_triangles(triangles, cumulative_area, x[0], x[1])?;
            off_surface(at, n)
        }
        Light::Directional { direction, disc_center, disc_radius, .. } => {
            let axis = direction.as_dvec3();
            let (center, radius) = (disc_center.as_dvec3(), f64::from(*disc_radius));
            let (at, weight) = on_disc(aim, axis, center, radius, x[0], x[1]);
            from(at, (axis, weight))
        }
    }
}

/// A cosine to a spot's axis, so that directions follow its light.
fn spot_cosine(u: f64, edge: f64, falloff: f64) -> f64 {
    if falloff > 0.0 {
        let least = libm::pow(edge.max(0.0), falloff + 1.0);
        libm::pow(1.0 - u * (1.0 - least), 1.0 / (falloff + 1.0))
    } else {
        1.0 - u * (1.0 - edge)
    }
}

/// A direction from the mixture of a light's `own` directions, of that `density`, and those that are aimed.
fn aimed(
    aim: Option<&Aim>,
    from: DVec3,
    own: impl Fn(f64, f64) -> DVec3,
    density: impl Fn(DVec3) -> f64,
    u: f64,
    v: f64,
) -> (DVec3, f64) {
    let Some((share, cone)) = aim.and_then(|a| Some((a.share, Cone::of(from, a.center, a.radius)?))) else {
        return (own(u, v), 1.0);
    };
    let (w, inside) = if u < share {
        (cone.sample(u / share, v), true)
    } else {
        let w = own((u - share) / (1.0 - share), v);
        (w, cone.holds(w))
    };
    let natural = density(w);
    let mixture = (1.0 - share) * natural + if inside { share / cone.solid_angle() } else { 0.0 };
    (w, natural / mixture)
}

/// The same for places on the disc of parallel light along `axis`.
fn on_disc(aim: Option<&Aim>, axis: DVec3, center: DVec3, radius: f64, u: f64, v: f64) -> (DVec3, f64) {
    let (t, b) = axis.any_orthonormal_pair();
    let place = |middle: DVec3, r: f64, u: f64| {
        let [x, y] = directions::disc(u, v);
        middle + (t * x + b * y) * r
    };
    let Some(aim) = aim else {
        return (place(center, radius, u), 1.0);
    };
    let off = aim.center - center;
    let middle = center + off - axis * off.dot(axis);
    let (at, inside) = if u < aim.share {
        (place(middle, aim.radius, u / aim.share), true)
    } else {
        let at = place(center, radius, (u - aim.share) / (1.0 - aim.share));
        (at, at.distance(middle) <= aim.radius)
    };
    let natural = if at.distance(center) <= radius * (1.0 + 1e-12) { 1.0 / (PI * radius * radius) } else { 0.0 };
    let mixture = (1.0 - aim.share) * natural + if inside { aim.share / (PI * aim.radius * aim.radius) } else { 0.0 };
    (at, natural / mixture)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::rgb::Rgb;
    use crate::math::sequence::{Sampling, Sequence};
    use crate::scene::open;
    use glam::Vec3;

    /// Aimed or not, weights have the mean 1, and so has any function of the direction the same mean.
    #[test]
    fn aimed_photons_carry_the_same_light() {
        let scene = open("ring").expect("built in");
        let axis = Vec3::new(0.5, -0.4, 0.2).normalize();
        let at = Vec3::new(-2.5, 2.2, -1.2);
        let lights = [
            Light::Point { position: at, power: Rgb::ONE },
            Light::Spot { position: at, direction: axis, cos_half: 0.3, falloff: 2.0, power: Rgb::ONE },
            Light::Spot { position: at, direction: axis, cos_half: 0.9, falloff: 0.0, power: Rgb::ONE },
            Light::Sphere { center: at, radius: 0.4, power: Rgb::ONE },
            Light::Quad { center: at, u: Vec3::new(0.4, 0.1, 0.0), v: Vec3::new(0.0, -0.3, -0.3), power: Rgb::ONE },
            Light::mesh(vec![[at, at + Vec3::Z * 0.5, at + Vec3::X * 0.7]], Rgb::ONE),
            Light::Directional {
                direction: axis,
                irradiance: Rgb::ONE,
                disc_center: -axis * (1.01 * scene.radius),
                disc_radius: scene.radius,
            },
        ];
        let n = 1u64 << 17;
        // The height and the sideways place of the photon 2 m on its way: both densities would show.
        let means = |light: &Light, share: Option<f64>, seed: u64| {
            let aim = share.and_then(|s| Aim::at_specular(&scene, s));
            let sequence = Sequence::new(Sampling::Sobol, seed);
            let mut sums = [0.0; 3];
            for i in 0..n {
                if let Some(s) = start(&scene, light, aim.as_ref(), sequence.four(i, 0)) {
                    let p = (s.ray.origin + s.ray.direction * 2.0).as_dvec3();
                    assert!(s.weight < 2.0001 || share != Some(0.5), "{}", s.weight);
                    sums[0] += s.weight;
                    sums[1] += s.weight * p.y * p.y;
                    sums[2] += s.weight * (p.x - 0.3 * p.z);
                }
            }
            sums.map(|s| s / n as f64)
        };
        for light in &lights {
            let plain = means(light, None, 1);
            let mixed = means(light, Some(0.5), 2);
            assert!((plain[0] - 1.0).abs() < 1e-12, "{}", light.kind());
            for (a, b) in plain.iter().zip(&mixed) {
                assert!((a - b).abs() < 4e-3 * a.abs().max(1.0), "{}: {plain:?} {mixed:?}", light.kind());
            }
        }
    }

    /// With all photons aimed, the weight is the light's share of what it sends into the cone.
    #[test]
    fn photons_aimed_at_a_sphere_carry_the_light_that_meets_it() {
        let scene = open("glass_ball").expect("built in");
        let aim = Aim::at_specular(&scene, 1.0).expect("glass");
        let light = &scene.lights[0];
        let Light::Point { position, .. } = light else { panic!("a point light") };
        let sequence = Sequence::new(Sampling::Sobol, 3);
        let n = 1000u64;
        let mean = (0..n).filter_map(|i| start(&scene, light, Some(&aim), sequence.four(i, 0))).map(|s| s.weight);
        let mean = mean.sum::<f64>() / n as f64;
        let sine = aim.radius / position.as_dvec3().distance(aim.center);
        let expected = (1.0 - (1.0 - sine * sine).sqrt()) / 2.0;
        assert!((mean / expected - 1.0).abs() < 1e-9, "{mean} {expected}");
    }
}
