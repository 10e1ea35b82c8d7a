//! What surfaces do with light.

use crate::math::rgb::Rgb;
use crate::scene::texture::Texture;
use glam::Vec2;
use std::sync::Arc;

/// A surface's material. Reflectances lie in `[0, 1]`.
#[derive(Clone, Debug, PartialEq)]
pub enum Material {
    /// Lambertian reflection.
    Diffuse {
        /// Reflectance ρ.
        reflectance: Rgb,
        /// Multiplies the reflectance.
        texture: Option<Arc<Texture>>,
    },
    /// Perfect reflection from both sides, the same at every angle.
    Mirror {
        /// Reflectance.
        reflectance: Rgb,
    },
    /// Perfect reflection from both sides with Schlick's Fresnel term (Schlick 1994).
    Metal {
        /// Reflectance at normal incidence.
        reflectance: Rgb,
    },
    /// A smooth boundary to a medium; the front side is outside.
    Dielectric {
        /// Refractive index against the outside, at least 1.
        ior: f32,
        /// Absorption coefficient inside, -ln of the transmittance per metre, per channel, 1/m. Not the transmittance
        /// itself, whose digits vanish in f32 beside 1 or 0 where the scene's unit is far from a metre.
        absorption: Rgb,
    },
    /// A light's surface: black to light that arrives, radiant on its front side.
    Emitter {
        /// Radiance, W/(m² sr).
        radiance: Rgb,
    },
}

impl Material {
    /// Whether light leaves in at most two directions.
    pub fn is_specular(&self) -> bool {
        matches!(self, Self::Mirror { .. } | Self::Metal { .. } | Self::Dielectric { .. })
    }

    /// Whether it scatters light in all directions.
    pub fn is_diffuse(&self) -> bool {
        matches!(self, Self::Diffuse { .. })
    }

    /// Transmittance of a way of `distance` metres inside, per channel, in `[0, 1]`; 1 for other kinds.
    pub fn transmittance(&self, distance: f32) -> Rgb {
        match self {
            Self::Dielectric { absorption, .. } => {
                let over = |a: f32| libm::exp(-f64::from(a) * f64::from(distance)) as f32;
                Rgb::new(over(absorption.x), over(absorption.y), over(absorption.z))
            }
            _ => Rgb::ONE,
        }
    }

    /// Diffuse reflectance at the texture coordinates `uv`; black for other kinds.
    pub fn diffuse_reflectance(&self, uv: Vec2) -> Rgb {
        match self {
            Self::Diffuse { reflectance, texture } => match texture {
                Some(t) => *reflectance * t.sample(uv),
                None => *reflectance,
            },
            _ => Rgb::ZERO,
        }
    }
}

impl Material {
    /// Whether it is the same material with the same texture in memory; textures are not looked into.
    pub fn is_same(&self, other: &Self) -> bool {
        match (self, other) {
            (
                Self::Diffuse { reflectance: a, texture: Some(s) },
                Self::Diffuse { reflectance: b, texture: Some(t) },
            ) => a == b && Arc::ptr_eq(s, t),
            _ => self == other,
        }
    }

    /// Diffuse reflectance with the mean of its texture; black for other kinds.
    pub fn average_reflectance(&self) -> Rgb {
        match self {
            Self::Diffuse { reflectance, texture } => {
                texture.as_ref().map_or(*reflectance, |t| *reflectance * t.average())
            }
            _ => Rgb::ZERO,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Tinted glass in millimetres, kilometres and beyond lets the same through from side to side.
    #[test]
    fn tint_does_not_know_the_unit() {
        for unit in [1e-9f64, 1e-3, 1.0, 1e3, 1e9] {
            let absorption = Rgb::splat((-libm::log(0.75) * unit) as f32);
            let through = Material::Dielectric { ior: 1.5, absorption }.transmittance((2.0 / unit) as f32);
            assert!((through.x - 0.5625).abs() < 1e-6, "{unit}: {through}");
        }
        let black = Material::Dielectric { ior: 1.5, absorption: Rgb::splat(f32::MAX) };
        assert_eq!((black.transmittance(0.0), black.transmittance(1e-3)), (Rgb::ONE, Rgb::ZERO));
    }
}
