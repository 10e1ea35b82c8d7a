//! Specular scattering: how much light is reflected and refracted, where to, and with what differential.

use crate::math::rgb::Rgb;
use crate::scene::{Material, Scene};
use crate::trace::differential::renormalized;
use crate::trace::{Differential, Surface};
use glam::{DVec3, Vec3};

/// Share of the light that a specular surface sends into each of its two directions, in `[0, 1]` per channel.
#[derive(Clone, Copy, Debug)]
pub struct SpecularWeights {
    /// Into the mirror direction.
    pub reflected: Rgb,
    /// Through the surface.
    pub refracted: Rgb,
    /// Ratio n₁/n₂ of the indices on the incident and the other side.
    pub eta: f32,
}

/// A ray that leaves a specular surface.
#[derive(Clone, Copy, Debug)]
pub struct SpecularRay {
    /// Start, a little off the surface on the side to which it goes, metres.
    pub origin: Vec3,
    /// Unit direction.
    pub direction: Vec3,
    /// Its differential; `dp` at the surface.
    pub differential: Differential,
    /// Whether the shading normal would have sent it to the wrong side, so that the flat normal took its place.
    pub beyond_horizon: bool,
    /// Whether the corners' normals cancel there, so that the flat normal took their place.
    pub without_shading: bool,
}

/// Weights of a specular material for light along the unit direction `v`; None for other materials.
pub fn specular_weights(material: &Material, surface: &Surface, v: Vec3) -> Option<SpecularWeights> {
    let cos = -renormalized(v).dot(renormalized(shading_towards(surface, v)));
    match *material {
        Material::Mirror { reflectance } => {
            Some(SpecularWeights { reflected: reflectance, refracted: Rgb::ZERO, eta: 1.0 })
        }
        Material::Metal { reflectance } => {
            let rest = (1.0 - cos).clamp(0.0, 1.0) as f32;
            let fresnel = rest * rest * rest * rest * rest;
            Some(SpecularWeights {
                reflected: reflectance + (Rgb::ONE - reflectance) * fresnel,
                refracted: Rgb::ZERO,
                eta: 1.0,
            })
        }
        Material::Dielectric { ior, .. } => {
            let eta = if surface.front { 1.0 / ior } else { ior };
            let reflected = fresnel(cos, eta) as f32;
            Some(SpecularWeights { reflected: Rgb::splat(reflected), refracted: Rgb::splat(1.0 - reflected), eta })
        }
        _ => None,
    }
}

/// Fresnel reflectance of a smooth dielectric for unpolarised light; `cos` of the incident angle, `eta = n₁/n₂`.
///
/// 1 beyond the critical angle. f64, for it falls from 1 there like a root.
pub fn fresnel(cos: f64, eta: f32) -> f64 {
    let (cos, eta) = (cos.clamp(0.0, 1.0), f64::from(eta));
    let Some(inner) = refracted_cosine(cos, eta) else {
        return 1.0;
    };
    let parallel = (cos - eta * inner) / (cos + eta * inner);
    let perpendicular = (eta * cos - inner) / (eta * cos + inner);
    let r = (parallel * parallel + perpendicular * perpendicular) / 2.0;
    if r.is_finite() { r.clamp(0.0, 1.0) } else { 1.0 }
}

/// Cosine of the refracted angle, √ε; None from the critical angle on.
fn refracted_cosine(cos: f64, eta: f64) -> Option<f64> {
    let squared = 1.0 - eta * eta * (1.0 - cos * cos);
    (squared > 0.0).then(|| squared.sqrt())
}

/// The reflected ray. `d` is the differential transferred to the surface.
pub fn reflected(scene: &Scene, surface: &Surface, v: Vec3, d: &Differential) -> SpecularRay {
    let mirror = |n: Vec3| {
        let (v, n) = (renormalized(v), renormalized(n));
        v - n * (2.0 * v.dot(n))
    };
    let bent = shading_towards(surface, v);
    let w = mirror(bent);
    let stays = w.dot(surface.normal.as_dvec3()) > 0.0;
    let (n, w) = if stays { (bent, w) } else { (surface.normal, mirror(surface.normal)) };
    let next = if d.is_none() { *d } else { d.reflect(v, n, smooth_differential(scene, surface, n, d)) };
    leaving(scene, surface, w, next, n, true)
}

/// The refracted ray for the ratio `eta` of [`SpecularWeights`]; at total internal reflection the grazing direction.
pub fn refracted(scene: &Scene, surface: &Surface, v: Vec3, d: &Differential, eta: f32) -> SpecularRay {
    let bend = |n: Vec3| {
        let (v, n, eta) = (renormalized(v), renormalized(n), f64::from(eta));
        let vn = v.dot(n);
        let root = refracted_cosine(vn, eta).unwrap_or(0.0);
        v * eta - n * (eta * vn + root)
    };
    let bent = shading_towards(surface, v);
    let w = bend(bent);
    let stays = w.dot(surface.normal.as_dvec3()) < 0.0;
    let (n, w) = if stays { (bent, w) } else { (surface.normal, bend(surface.normal)) };
    let next = if d.is_none() { *d } else { d.refract(v, n, smooth_differential(scene, surface, n, d), eta) };
    leaving(scene, surface, w, next, n, false)
}

/// A ray that leaves along `w` by the normal `n`, before the surface or behind it.
fn leaving(
    scene: &Scene,
    surface: &Surface,
    w: DVec3,
    differential: Differential,
    n: Vec3,
    before: bool,
) -> SpecularRay {
    SpecularRay {
        // Not by the direction's sign, which rounding may turn at grazing angles.
        origin: surface.beside(scene, before),
        direction: w.normalize().as_vec3(),
        differential,
        beyond_horizon: n != surface.shading,
        without_shading: surface.without_shading,
    }
}

/// The shading normal, or the flat one where the shading normal faces away from the ray.
fn shading_towards(surface: &Surface, v: Vec3) -> Vec3 {
    if surface.shading.dot(v) < 0.0 { surface.shading } else { surface.normal }
}

fn smooth_differential(scene: &Scene, surface: &Surface, n: Vec3, d: &Differential) -> [Vec3; 2] {
    if n == surface.shading { surface.normal_differential(scene, d.dp) } else { [Vec3::ZERO; 2] }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fresnel_has_its_known_values() {
        // Normal incidence: ((n - 1)/(n + 1))² = 0.04 for 1.5; Brewster's angle: half of the perpendicular part.
        assert!((fresnel(1.0, 1.0 / 1.5) - 0.04).abs() < 1e-6);
        let brewster = (1.0f64 / (1.0 + 1.5 * 1.5)).sqrt();
        let perpendicular = ((1.5f64 * 1.5 - 1.0) / (1.5 * 1.5 + 1.0)).powi(2);
        assert!((fresnel(brewster, 1.0 / 1.5) - perpendicular / 2.0).abs() < 1e-5);
        assert_eq!(fresnel(0.3, 1.5), 1.0);
        assert_eq!(fresnel(0.0, 1.0 / 1.5), 1.0);
        assert_eq!(fresnel(0.5, 1.0), 0.0);
    }

    #[test]
    fn fresnel_is_the_same_from_both_sides() {
        for i in 1..100 {
            let cos = f64::from(i) / 100.0;
            let inner = (1.0 - (1.0 - cos * cos) / 2.25f64).sqrt();
            assert!((fresnel(cos, 1.0 / 1.5) - fresnel(inner, 1.5)).abs() < 1e-4);
        }
    }
}
