//! What specular surfaces do with a ray, in 64 bits.
//!
//! The same conventions as the renderer's, by code of its own: shading normals bend rays, the flat normal takes over
//! where a shading normal would send a ray to the wrong side, and radiance changes with the square of the index.

use crate::scene::{Material, Scene};
use crate::trace::Surface;
use glam::DVec3;

/// A ray that leaves a specular surface.
#[derive(Clone, Copy, Debug)]
pub struct Leaving {
    /// Unit direction.
    pub direction: DVec3,
    /// Flux that a photon keeps, over the probability of the choice.
    pub weight: DVec3,
    /// Factor on the radiance of a ray that runs backwards beyond `weight`: the squared ratio of the indices.
    pub bend: f64,
    /// What a beam of photons that comes back along this way gains in radiance because the shading normal is not the
    /// flat one: `|w·n| |v·s|/(|w·s| |v·n|)`, with n the flat and s the shading normal (Veach 1997, section 5.3).
    pub tilt: f64,
    /// Whether it went through the surface.
    pub through: bool,
}

/// One way on from a specular surface for a ray along the unit vector `v`; `x` in `[0, 1)` picks between reflection and
/// refraction. None at other surfaces.
pub fn specular(material: &Material, surface: &Surface, v: DVec3, x: f64) -> Option<Leaving> {
    let flat = surface.normal.as_dvec3();
    let shading = surface.shading.as_dvec3();
    let bent = if shading.dot(v) < 0.0 { shading } else { flat };
    let cos = (-v.dot(bent)).clamp(0.0, 1.0);
    match *material {
        Material::Mirror { reflectance } => Some(mirrored(v, bent, flat, reflectance.as_dvec3())),
        Material::Metal { reflectance } => {
            let r = reflectance.as_dvec3();
            let schlick = r + (DVec3::ONE - r) * (1.0 - cos).powi(5);
            Some(mirrored(v, bent, flat, schlick))
        }
        Material::Dielectric { ior, .. } => {
            let eta = if surface.front { 1.0 / f64::from(ior) } else { f64::from(ior) };
            if x < reflectance_of_glass(cos, eta) {
                Some(mirrored(v, bent, flat, DVec3::ONE))
            } else {
                Some(bent_through(v, bent, flat, eta))
            }
        }
        _ => None,
    }
}

fn mirrored(v: DVec3, bent: DVec3, flat: DVec3, weight: DVec3) -> Leaving {
    let reflect = |n: DVec3| (v - n * (2.0 * v.dot(n))).normalize();
    let w = reflect(bent);
    let (n, w) = if w.dot(flat) > 0.0 { (bent, w) } else { (flat, reflect(flat)) };
    Leaving { direction: w, weight, bend: 1.0, tilt: tilt(v, w, n, flat), through: false }
}

fn bent_through(v: DVec3, bent: DVec3, flat: DVec3, eta: f64) -> Leaving {
    let refract = |n: DVec3| {
        let cos = -v.dot(n);
        let root = (1.0 - eta * eta * (1.0 - cos * cos)).max(0.0).sqrt();
        (v * eta + n * (eta * cos - root)).normalize()
    };
    let w = refract(bent);
    let (n, w) = if w.dot(flat) < 0.0 { (bent, w) } else { (flat, refract(flat)) };
    Leaving { direction: w, weight: DVec3::ONE, bend: eta * eta, tilt: tilt(v, w, n, flat), through: true }
}

fn tilt(v: DVec3, w: DVec3, n: DVec3, flat: DVec3) -> f64 {
    if n == flat {
        return 1.0;
    }
    let ratio = (w.dot(flat) * v.dot(n)) / (w.dot(n) * v.dot(flat));
    if ratio.is_finite() { ratio.abs() } else { 1.0 }
}

/// Share of unpolarised light that smooth glass reflects, for `eta = n₁/n₂` and the cosine of the incident angle.
fn reflectance_of_glass(cos: f64, eta: f64) -> f64 {
    let sin2 = eta * eta * (1.0 - cos * cos);
    if sin2 >= 1.0 {
        return 1.0;
    }
    let inner = (1.0 - sin2).sqrt();
    let s = (eta * cos - inner) / (eta * cos + inner);
    let p = (cos - eta * inner) / (cos + eta * inner);
    let r = (s * s + p * p) / 2.0;
    if r.is_finite() { r.clamp(0.0, 1.0) } else { 1.0 }
}

/// The glass in which a path is: it knows itself in one, or it started in one and meets its inside.
pub fn medium_at(scene: &Scene, medium: Option<u32>, surface: &Surface) -> Option<u32> {
    if medium.is_some() || surface.front {
        return medium;
    }
    let glass = matches!(scene.materials[surface.material as usize], Material::Dielectric { .. });
    glass.then_some(surface.material)
}

/// The glass behind a surface that a path goes through.
pub fn medium_beyond(surface: &Surface) -> Option<u32> {
    surface.front.then_some(surface.material)
}

/// What glass lets through over `distance` metres; one outside of glass.
pub fn transmittance(scene: &Scene, medium: Option<u32>, distance: f32) -> DVec3 {
    match medium.and_then(|m| scene.materials.get(m as usize)) {
        Some(Material::Dielectric { absorption, .. }) => {
            let over = |a: f32| libm::exp(-f64::from(a) * f64::from(distance));
            DVec3::new(over(absorption.x), over(absorption.y), over(absorption.z))
        }
        _ => DVec3::ONE,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn glass_reflects_what_fresnel_says() {
        assert!((reflectance_of_glass(1.0, 1.0 / 1.5) - 0.04).abs() < 1e-12);
        assert!((reflectance_of_glass(1.0, 1.5) - 0.04).abs() < 1e-12);
        assert_eq!(reflectance_of_glass(0.5, 1.5), 1.0);
        // 45 degrees into glass of 1.5: tabulated 0.0503 (s 0.0920, p 0.0085).
        assert!((reflectance_of_glass(0.5f64.sqrt(), 1.0 / 1.5) - 0.0503).abs() < 1e-4);
    }

    #[test]
    fn rays_leave_on_the_right_side_by_the_laws_of_reflection_and_refraction() {
        let n = DVec3::Y;
        let v = DVec3::new(0.6, -0.8, 0.0);
        let r = mirrored(v, n, n, DVec3::ONE);
        assert!((r.direction - DVec3::new(0.6, 0.8, 0.0)).length() < 1e-12 && !r.through && r.tilt == 1.0);
        let t = bent_through(v, n, n, 1.0 / 1.5);
        assert!((t.direction.x - 0.4).abs() < 1e-12 && t.direction.y < 0.0 && t.through);
        assert!((t.bend * 2.25 - 1.0).abs() < 1e-12);
        // A shading normal that would send a grazing ray below the surface gives way to the flat one.
        let graze = DVec3::new(0.999, -0.01, 0.0).normalize();
        let odd = DVec3::new(0.3, 1.0, 0.0).normalize();
        let r = mirrored(graze, odd, n, DVec3::ONE);
        assert!(odd.dot(graze) > 0.0 || r.direction.y > 0.0);
    }

    /// Photons on a grid that a tilted mirror sends on: their density over area and solid angle against `tilt`.
    #[test]
    fn tilt_is_the_change_of_a_beam() {
        let flat = DVec3::Y;
        let shading = DVec3::new(0.15, 1.0, 0.1).normalize();
        let incident = DVec3::new(0.5, -0.7, 0.2).normalize();
        // The path runs backwards: along `v` to the mirror, along `w` towards the light.
        let v = -mirrored(incident, shading, flat, DVec3::ONE).direction;
        let back = mirrored(v, shading, flat, DVec3::ONE);
        assert!((back.direction + incident).length() < 1e-12);
        // Flux through the same surface: L₁ cos₁ = L₂ cos₂, as reflection keeps solid angles.
        let expected = incident.dot(flat).abs() / v.dot(flat).abs();
        assert!((back.tilt - expected).abs() < 1e-12, "{} {expected}", back.tilt);
    }
}
