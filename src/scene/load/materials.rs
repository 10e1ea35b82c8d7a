//! Materials of a scene file.

use super::{Checked, Loader};
use crate::math::hash::{FNV_START, fnv1a};
use crate::math::rgb::Rgb;
use crate::scene::Material;
use crate::scene::scene_file::MaterialFile;
use crate::scene::texture::Texture;
use glam::DVec3;
use std::collections::BTreeMap;
use std::sync::Arc;

impl Loader<'_> {
    pub(super) fn materials(&mut self, materials: &BTreeMap<String, MaterialFile>) -> Checked<()> {
        for (name, file) in materials {
            let material = self.material(&format!("materials.{name}"), file)?;
            let index = self.assembly.add_material(name, material);
            self.material_index.insert(name.clone(), index);
        }
        Ok(())
    }

    pub(super) fn material(&mut self, key: &str, file: &MaterialFile) -> Checked<Material> {
        let at = |k: &str| format!("{key}.{k}");
        let allowed: &[&str] = match file.kind.as_str() {
            "diffuse" => &["reflectance", "texture"],
            "mirror" | "metal" => &["reflectance"],
            "dielectric" => &["ior", "transmittance"],
            "emissive" => &["radiance"],
            other => {
                return self.wrong(
                    at("kind"),
                    format!("unknown kind `{other}`; use diffuse, mirror, metal, dielectric or emissive"),
                );
            }
        };
        self.only(
            key,
            &file.kind,
            allowed,
            &[
                ("reflectance", file.reflectance.is_some()),
                ("texture", file.texture.is_some()),
                ("ior", file.ior.is_some()),
                ("transmittance", file.transmittance.is_some()),
                ("radiance", file.radiance.is_some()),
            ],
        )?;
        let unit = |k: &str, value: Option<[f64; 3]>, default: f64| -> Checked<Rgb> {
            let c = value.unwrap_or([default; 3]);
            if c.iter().all(|x| (0.0..=1.0).contains(x)) {
                Ok(DVec3::from_array(c).as_vec3())
            } else {
                self.wrong(at(k), format!("each channel must lie in [0, 1], got {c:?}"))
            }
        };
        Ok(match file.kind.as_str() {
            "diffuse" => Material::Diffuse {
                reflectance: unit("reflectance", file.reflectance, 0.8)?,
                texture: match &file.texture {
                    Some(name) => Some(Arc::new(self.texture(&at("texture"), name)?)),
                    None => None,
                },
            },
            "mirror" => Material::Mirror { reflectance: unit("reflectance", file.reflectance, 1.0)? },
            "metal" => Material::Metal { reflectance: unit("reflectance", file.reflectance, 0.9)? },
            "dielectric" => {
                let ior = file.ior.unwrap_or(1.5);
                if !(1.0..=10.0).contains(&ior) {
                    return self.wrong(at("ior"), format!("must lie in [1, 10], got {ior}"));
                }
                unit("transmittance", file.transmittance, 1.0)?;
                // Black glass keeps a coefficient that is a number.
                let coefficient = |t: f64| (-libm::log(t)).min(f64::from(f32::MAX)) as f32;
                let absorption = file.transmittance.unwrap_or([1.0; 3]).map(|t| coefficient(t).max(0.0));
                Material::Dielectric { ior: ior as f32, absorption: absorption.into() }
            }
            _ => Material::Emitter { radiance: self.power(&at("radiance"), file.radiance, "W/(m² sr)")? },
        })
    }

    pub(super) fn texture(&mut self, key: &str, name: &str) -> Checked<Texture> {
        let (path, bytes) = match self.files.bytes(name) {
            Ok(found) => found,
            Err(e) => return self.wrong(key, format!("{e}; give a PNG")),
        };
        // Its bytes belong to the scene's hash.
        self.texts.push(format!("{:016x}", fnv1a(FNV_START, &bytes)));
        Texture::decode(&bytes).or_else(|why| self.wrong(key, format!("{}: {why}; give a PNG", path.display())))
    }
}
