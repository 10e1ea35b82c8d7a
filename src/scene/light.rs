//! Light sources and their fluxes.

use crate::math::rgb::Rgb;
use glam::Vec3;
use std::f32::consts::PI;
use std::f64::consts::TAU;

/// A light source, in local coordinates and metres.
#[derive(Clone, Debug, PartialEq)]
pub enum Light {
    /// A point that shines the same in all directions.
    Point {
        /// Where it is.
        position: Vec3,
        /// Flux Φ, W.
        power: Rgb,
    },
    /// A sphere of constant radiance.
    Sphere {
        /// Centre.
        center: Vec3,
        /// Radius, positive.
        radius: f32,
        /// Flux Φ, W.
        power: Rgb,
    },
    /// A parallelogram of constant radiance on the side of `u × v`.
    Quad {
        /// Centre.
        center: Vec3,
        /// First half-edge.
        u: Vec3,
        /// Second half-edge.
        v: Vec3,
        /// Flux Φ, W.
        power: Rgb,
    },
    /// A point that shines into a cone, with intensity ∝ `cos^falloff` of the angle to the axis.
    Spot {
        /// Apex.
        position: Vec3,
        /// Unit vector along the axis.
        direction: Vec3,
        /// Cosine of half the cone's angle, below 1; f64, because of a narrow cone it is the distance to 1 that counts.
        cos_half: f64,
        /// Exponent, not negative; 0 is uniform.
        falloff: f32,
        /// Flux Φ, W.
        power: Rgb,
    },
    /// Parallel light through the disc that holds the scene.
    Directional {
        /// Unit vector along which the light travels.
        direction: Vec3,
        /// Irradiance on a plane that faces the light, W/m².
        irradiance: Rgb,
        /// Centre of the disc before the scene.
        disc_center: Vec3,
        /// Radius of the disc.
        disc_radius: f32,
    },
    /// Triangles of constant radiance on their front sides.
    Mesh {
        /// Corners of each triangle.
        triangles: Vec<[Vec3; 3]>,
        /// Sum of the areas up to and including each triangle, m².
        cumulative_area: Vec<f32>,
        /// Radiance, W/(m² sr).
        radiance: Rgb,
    },
}

impl Light {
    /// A mesh light over `triangles`; those without area are dropped.
    pub fn mesh(triangles: Vec<[Vec3; 3]>, radiance: Rgb) -> Self {
        let mut kept = Vec::new();
        let mut cumulative_area = Vec::new();
        let mut sum = 0.0f64;
        for t in triangles {
            let [a, b, c] = t.map(|p| p.as_dvec3());
            let area = (b - a).cross(c - a).length() / 2.0;
            if area > 0.0 {
                sum += area;
                kept.push(t);
                cumulative_area.push(sum as f32);
            }
        }
        Self::Mesh { triangles: kept, cumulative_area, radiance }
    }

    /// The same light at another place; parallel light is everywhere.
    pub fn moved(&self, by: Vec3) -> Self {
        let mut light = self.clone();
        match &mut light {
            Self::Point { position: p, .. }
            | Self::Spot { position: p, .. }
            | Self::Sphere { center: p, .. }
            | Self::Quad { center: p, .. } => *p += by,
            Self::Mesh { triangles, .. } => triangles.iter_mut().flatten().for_each(|p| *p += by),
            Self::Directional { .. } => {}
        }
        light
    }

    /// Radiant flux Φ per channel, W.
    pub fn flux(&self) -> Rgb {
        match self {
            Self::Point { power, .. }
            | Self::Sphere { power, .. }
            | Self::Quad { power, .. }
            | Self::Spot { power, .. } => *power,
            Self::Directional { irradiance, disc_radius, .. } => *irradiance * (PI * disc_radius * disc_radius),
            Self::Mesh { cumulative_area, radiance, .. } => {
                *radiance * (PI * cumulative_area.last().copied().unwrap_or(0.0))
            }
        }
    }

    /// Radiance of the surface of a sphere or quad light, W/(m² sr); zero for lights without area.
    pub fn radiance(&self) -> Rgb {
        match self {
            Self::Sphere { power, .. } | Self::Quad { power, .. } => *power / (PI * self.area()),
            Self::Mesh { radiance, .. } => *radiance,
            _ => Rgb::ZERO,
        }
    }

    /// Solid angle of a spot light's cone weighted by `cos^falloff`, sr: its on-axis intensity is Φ over this.
    pub fn spot_normalization(cos_half: f64, falloff: f32) -> f64 {
        let n = f64::from(falloff) + 1.0;
        // A cosine cannot be raised to a power below zero: the lobe ends at the horizon when it has a falloff.
        let c = cos_half.max(if falloff > 0.0 { 0.0 } else { -1.0 });
        let edge = if falloff > 0.0 { libm::pow(c, n) } else { c };
        TAU * (1.0 - edge) / n
    }

    /// Whether it is a surface.
    pub fn has_area(&self) -> bool {
        matches!(self, Self::Sphere { .. } | Self::Quad { .. } | Self::Mesh { .. })
    }

    /// Area of its surface, m²; 0 without one.
    pub fn area(&self) -> f32 {
        match self {
            Self::Sphere { radius, .. } => 4.0 * PI * radius * radius,
            Self::Quad { u, v, .. } => (4.0 * u.as_dvec3().cross(v.as_dvec3()).length()) as f32,
            Self::Mesh { cumulative_area, .. } => cumulative_area.last().copied().unwrap_or(0.0),
            _ => 0.0,
        }
    }

    /// The kind's name, as in the scene file.
    pub fn kind(&self) -> &'static str {
        match self {
            Self::Point { .. } => "point",
            Self::Sphere { .. } => "sphere",
            Self::Quad { .. } => "quad",
            Self::Spot { .. } => "spot",
            Self::Directional { .. } => "directional",
            Self::Mesh { .. } => "mesh",
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn uniform_spot_spreads_over_its_solid_angle() {
        let half = 0.4f64;
        let omega = TAU * (1.0 - half.cos());
        assert!((Light::spot_normalization(half.cos(), 0.0) - omega).abs() < 1e-12);
        assert!((Light::spot_normalization(-1.0, 0.0) - 2.0 * TAU).abs() < 1e-12);
        // ∫ cos θ over the hemisphere is π.
        assert!((Light::spot_normalization(0.0, 1.0) - TAU / 2.0).abs() < 1e-12);
    }

    #[test]
    fn mesh_light_drops_flat_triangles() {
        let t = [Vec3::ZERO, Vec3::X, Vec3::Y];
        let light = Light::mesh(vec![t, [Vec3::ZERO; 3], t], Rgb::ONE);
        assert!((light.flux().x - PI).abs() < 1e-6);
    }
}
