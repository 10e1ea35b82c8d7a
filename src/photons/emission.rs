//! Emission: how many photons each light sends out, and how each of them starts.

use crate::math::frame::{concentric_disc, cosine_hemisphere, tangents, uniform_sphere};
use crate::math::rgb::{Rgb, mean};
use crate::math::sequence::Sequence;
use crate::scene::{Light, Scene};
use crate::trace::Differential;
use crate::trace::direct::{quad_normal, sample_triangles};
use crate::trace::surface::SELF_INTERSECTION;
use glam::Vec3;
use std::f32::consts::PI;

/// Cosine below which the solid angle `π/(N cos θ)` of an area light's or diffuse surface's photon grows no more.
pub const GRAZING_COSINE: f32 = 0.01;

/// The photons of one light in one pass.
#[derive(Clone, Copy, Debug)]
pub struct LightShare {
    /// Index of the light.
    pub light: usize,
    /// Photons that it sends out, at least one.
    pub count: u64,
    /// Power of each, W.
    pub power: Rgb,
}

/// Shares `total` photons among the lights by power (Pedersen 2011, eq. 2), by stochastic rounding.
///
/// All photons carry the same mean power `Φ_scene/total` (eq. 3), but those of a light too dim for a whole photon:
/// it sends one, with all its power. Lights without power send none.
pub fn share_photons(scene: &Scene, total: u64, sequence: &Sequence) -> Vec<LightShare> {
    share_among(scene, total, sequence, |_| 1.0)
}

/// The same among parts of the lights: `part` tells what share of its power each sends out, in `[0, 1]`.
pub fn share_among(scene: &Scene, total: u64, sequence: &Sequence, part: impl Fn(usize) -> f64) -> Vec<LightShare> {
    let flux: f64 = scene.lights.iter().enumerate().map(|(i, l)| f64::from(mean(l.flux())) * part(i)).sum();
    let mut shares = Vec::new();
    for (light, l) in scene.lights.iter().enumerate() {
        let whole = f64::from(mean(l.flux()));
        let own = whole * part(light);
        // Not `own <= 0`: a flux that is no number must not pass.
        if !(own > 0.0 && flux.is_finite()) {
            continue;
        }
        let expected = own / flux * total as f64;
        let (count, power) = if expected < 1.0 {
            (1, own)
        } else if scene.lights.len() == 1 {
            (total, own / total as f64)
        } else {
            let x = f64::from(sequence.four(light as u64, 0)[0]);
            ((expected + x).floor().max(1.0) as u64, flux / total as f64)
        };
        shares.push(LightShare { light, count, power: (l.flux().as_dvec3() * (power / whole)).as_vec3() });
    }
    shares
}

/// A photon as it leaves its light.
#[derive(Clone, Copy, Debug)]
pub struct Emission {
    /// Start, metres, a little off the light's surface.
    pub origin: Vec3,
    /// Unit direction.
    pub direction: Vec3,
    /// Differential at scale 1: the ellipses of the light's photons share its sphere, cone, hemisphere or beam.
    pub differential: Differential,
    /// Whether the solid angle was bounded at grazing emission.
    pub bounded: bool,
}

/// Starts one photon of a light from four numbers in `[0, 1)`, where `count` photons (positive, not whole where a
/// projection map draws them from a part of the light) would share the whole of it.
pub fn emit(scene: &Scene, light: &Light, count: f64, x: [f32; 4]) -> Emission {
    let n = count as f32;
    let from_point = |origin: Vec3, direction: Vec3, solid_angle: f32| Emission {
        origin,
        direction,
        differential: cone_differential(direction, solid_angle),
        bounded: false,
    };
    let leaves = |position: Vec3, normal: Vec3, direction: Vec3| {
        let (solid_angle, bounded) = cosine_solid_angle(n, direction.dot(normal));
        Emission {
            origin: position + normal * (scene.radius * SELF_INTERSECTION),
            direction,
            differential: cone_differential(direction, solid_angle),
            bounded,
        }
    };
    let from_surface = |position: Vec3, normal: Vec3| leaves(position, normal, cosine_hemisphere(normal, x[2], x[3]));
    match light {
        Light::Point { position, .. } => from_point(*position, uniform_sphere(x[0], x[1]).normalize(), 4.0 * PI / n),
        Light::Spot { position, direction: axis, cos_half, falloff, .. } => {
            let (below, density) = spot_cosine(*cos_half, f64::from(*falloff), f64::from(x[0]));
            let whole = Light::spot_normalization(*cos_half, *falloff);
            let solid_angle = (whole / (count * density)) as f32;
            from_point(*position, near_axis(*axis, below, f64::from(x[1])), solid_angle)
        }
        Light::Sphere { center, radius, .. } => {
            // All directions are as likely, and then all places of the disc that it sees: the cosine of the normal's
            // angle to it is as likely as a diffuse surface's.
            let direction = uniform_sphere(x[0], x[1]).normalize();
            let (t, b) = tangents(direction);
            let (dx, dy) = concentric_disc(x[2], x[3]);
            let normal = (t * dx + b * dy + direction * (1.0 - dx * dx - dy * dy).max(0.0).sqrt()).normalize();
            leaves(*center + normal * *radius, normal, direction)
        }
        Light::Quad { center, u, v, .. } => {
            let position = *center + *u * (2.0 * x[0] - 1.0) + *v * (2.0 * x[1] - 1.0);
            from_surface(position, quad_normal(*u, *v))
        }
        Light::Mesh { triangles, cumulative_area, .. } => {
            let (position, normal) = sample_triangles(triangles, cumulative_area, x[0], x[1]);
            from_surface(position, normal)
        }
        Light::Directional { direction, disc_center, disc_radius, .. } => {
            let (t, b) = tangents(*direction);
            let (dx, dy) = concentric_disc(x[0], x[1]);
            let axis = disc_radius / n.sqrt();
            Emission {
                origin: *disc_center + (t * dx + b * dy) * *disc_radius,
                direction: *direction,
                differential: Differential { dp: [t * axis, b * axis], dv: [Vec3::ZERO; 2] },
                bounded: false,
            }
        }
    }
}

/// Solid angle that one of `n` cosine-weighted photons owns, `π/(n cos θ)`, and whether it was bounded.
pub fn cosine_solid_angle(n: f32, cos: f32) -> (f32, bool) {
    (PI / (n * cos.max(GRAZING_COSINE)), cos < GRAZING_COSINE)
}

/// Half-axis of the disc of directions with that solid angle: `π r² = Ω`.
#[inline(always)]
pub fn cone_radius(solid_angle: f32) -> f32 {
    (solid_angle / PI).sqrt()
}

#[inline(always)]
pub(super) fn cone_differential(direction: Vec3, solid_angle: f32) -> Differential {
    let (t, b) = tangents(direction);
    let r = cone_radius(solid_angle);
    Differential { dp: [Vec3::ZERO; 2], dv: [t * r, b * r] }
}

/// What the cosine to a spot's axis lacks of 1 for a number in `[0, 1)`, and the intensity there over that on the axis.
pub(super) fn spot_cosine(cos_half: f64, falloff: f64, u: f64) -> (f64, f64) {
    if falloff == 0.0 {
        return (u * (1.0 - cos_half), 1.0);
    }
    let edge = libm::pow(cos_half.max(0.0), falloff + 1.0);
    // cos^(falloff + 1) by its logarithm, which keeps the digits that a cosine near 1 has not.
    let log = libm::log1p(-u * (1.0 - edge)) / (falloff + 1.0);
    // The rim of a lobe that ends at the horizon has no intensity, and its photons no end of solid angle.
    (-libm::expm1(log), libm::exp(falloff * log).max(1e-30))
}

/// Unit direction whose cosine to the unit vector `axis` is `below` less than 1, at `turn` of a full turn about it.
fn near_axis(axis: Vec3, below: f64, turn: f64) -> Vec3 {
    let (t, b) = tangents(axis);
    let (s, c) = libm::sincos(std::f64::consts::TAU * turn);
    let sin = (below * (2.0 - below)).max(0.0).sqrt();
    let across = t.as_dvec3() * c + b.as_dvec3() * s;
    (axis.as_dvec3() * (1.0 - below) + across * sin).normalize().as_vec3()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::sequence::Sampling;
    use crate::scene::built_in;
    use crate::scene::source::open_built_in;

    fn plane_with(lights: Vec<Light>) -> Scene {
        let b = built_in::find("plane").expect("built in");
        let mut scene = open_built_in(b).expect("opens");
        scene.lights = lights;
        scene
    }

    fn point(power: f32) -> Light {
        Light::Point { position: Vec3::Y, power: Rgb::splat(power) }
    }

    #[test]
    fn photons_of_one_pass_carry_equal_power() {
        let scene = plane_with(vec![point(10.0), point(25.0), point(65.0)]);
        for seed in 0..20 {
            let shares = share_photons(&scene, 1003, &Sequence::new(Sampling::Random, seed));
            for (s, expected) in shares.iter().zip([100.3, 250.75, 651.95]) {
                assert!((s.count as f64 - expected).abs() < 1.0);
                assert!((s.power.x - 100.0 / 1003.0).abs() < 1e-6);
            }
        }
    }

    #[test]
    fn shares_are_unbiased_and_a_dim_light_is_not_lost() {
        let scene = plane_with(vec![point(1e-6), point(33.0), point(67.0)]);
        let mut power = [0.0f64; 3];
        let seeds = 4000;
        for seed in 0..seeds {
            let shares = share_photons(&scene, 10, &Sequence::new(Sampling::Random, seed));
            assert_eq!(shares.len(), 3);
            for s in &shares {
                power[s.light] += s.count as f64 * f64::from(s.power.x) / seeds as f64;
            }
        }
        assert!((power[0] - 1e-6).abs() < 1e-9);
        assert!((power[1] - 33.0).abs() < 0.3 && (power[2] - 67.0).abs() < 0.3, "{power:?}");
    }

    /// The footprints' solid angles, summed over a light's photons, are the light's sphere, cone or hemisphere.
    #[test]
    fn footprints_share_the_solid_angle_of_the_light() {
        let n = 4096u64;
        let cone = 0.8f32;
        let lights = [
            (point(1.0), 4.0 * PI),
            (
                Light::Spot {
                    position: Vec3::Y,
                    direction: Vec3::NEG_Y,
                    cos_half: f64::from(cone).cos(),
                    falloff: 0.0,
                    power: Rgb::ONE,
                },
                2.0 * PI * (1.0 - cone.cos()),
            ),
        ];
        let sequence = Sequence::new(Sampling::Sobol, 1);
        for (light, omega) in lights {
            let scene = plane_with(vec![light.clone()]);
            let mut sum = 0.0;
            for i in 0..n {
                let e = emit(&scene, &light, n as f64, sequence.four(i, 0));
                sum += PI * e.differential.dv[0].cross(e.differential.dv[1]).length();
            }
            assert!((sum / omega - 1.0).abs() < 1e-3, "{sum} {omega}");
        }
        let r = cone_radius(4.0 * PI / n as f32);
        assert!((r - (4.0 / n as f32).sqrt()).abs() < 1e-7);
    }

    #[test]
    fn directional_footprints_share_the_beam() {
        let light = Light::Directional {
            direction: Vec3::NEG_Y,
            irradiance: Rgb::ONE,
            disc_center: Vec3::Y * 5.0,
            disc_radius: 2.0,
        };
        let scene = plane_with(vec![light.clone()]);
        let e = emit(&scene, &light, 100.0, [0.2, 0.3, 0.0, 0.0]);
        let area = PI * e.differential.dp[0].cross(e.differential.dp[1]).length();
        assert!((area - PI * 4.0 / 100.0).abs() < 1e-5);
        assert_eq!(e.differential.dv, [Vec3::ZERO; 2]);
    }

    /// Emitted directions follow the intensity: mean cosines against integrals.
    #[test]
    fn spot_directions_follow_the_falloff() {
        let n = 16_384;
        let sequence = Sequence::new(Sampling::Sobol, 4);
        for (half, falloff) in [(0.6f32, 0.0f32), (0.6, 8.0), (1.4, 3.0)] {
            let light = Light::Spot {
                position: Vec3::Y,
                direction: Vec3::NEG_Y,
                cos_half: f64::from(half).cos(),
                falloff,
                power: Rgb::ONE,
            };
            let scene = plane_with(vec![light.clone()]);
            let mean: f64 = (0..n)
                .map(|i| f64::from(-emit(&scene, &light, n as f64, sequence.four(i, 0)).direction.y))
                .sum::<f64>()
                / n as f64;
            let c = f64::from(half.cos());
            let m = f64::from(falloff);
            let expected = (1.0 - c.powf(m + 2.0)) / (m + 2.0) * (m + 1.0) / (1.0 - c.powf(m + 1.0));
            assert!((mean - expected).abs() < 1e-4, "{mean} {expected}");
        }
    }
}
