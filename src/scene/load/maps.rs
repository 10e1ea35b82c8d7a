//! Quake 3 maps as shapes of a scene.

use super::{Checked, Loader};
use crate::math::hash::{FNV_START, fnv1a};
use crate::math::rgb::Rgb;
use crate::scene::quake::{self, Images};
use crate::scene::shapes::Placement;
use crate::scene::source::Files;
use crate::scene::texture::Texture;
use crate::scene::{Material, SceneError};
use glam::{DMat3, DVec3};
use image::ImageFormat;
use std::collections::HashMap;
use std::sync::Arc;

/// Reflectance of surfaces whose image is not there.
const GREY: f32 = 0.5;

impl Loader<'_> {
    /// Reads a map; `material` takes the place of its own materials.
    pub(super) fn map(&mut self, key: &str, name: &str, place: &Placement, material: Option<u32>) -> Checked<()> {
        let files = self.files;
        let folder = match files {
            Files::Folder(folder) => Some(folder.as_path()),
            _ => None,
        };
        let opened = quake::open(name, folder, |file| files.bytes(file));
        let (path, bytes, mut images) = match opened {
            Ok(found) => found,
            Err(SceneError::Unreadable { file, why }) if key != "mesh" => {
                return self.wrong(format!("{key}.file"), format!("{}: {why}", file.display()));
            }
            Err(e) => return Err(e),
        };
        self.texts.push(format!("{:016x}", fnv1a(FNV_START, &bytes)));
        let map = quake::read(&bytes).map_err(|e| SceneError::Whole { file: path.clone(), what: e.0 })?;
        let (triangles, vertices) = (map.mesh.triangles.len() as u64, map.mesh.positions.len() as u64);
        self.reserve(&format!("{key}.file"), triangles, vertices, "give a smaller map, or leave shapes out")?;
        self.warnings.extend(map.notes.iter().map(|n| format!("{}: {n}", path.display())));
        let mesh = map.mesh.placed(place);
        self.within(key, &mesh.positions)?;
        let where_it_is = place.scale == 1.0 && place.rotation == DMat3::IDENTITY && place.translation == DVec3::ZERO;
        if where_it_is {
            self.cells = Some(map.cells);
            self.entities = map.entities;
        }
        if let Some(material) = material {
            self.assembly.add_mesh(mesh, |_| material);
            return Ok(());
        }
        let mut own = HashMap::new();
        let mut missing = 0;
        for &m in &mesh.materials {
            own.entry(m).or_insert_with(|| {
                let texture = &map.textures[m as usize];
                let found = image_of(&mut images, texture);
                missing += usize::from(found.is_none());
                let reflectance = if found.is_some() { Rgb::ONE } else { Rgb::splat(GREY) };
                let material = Material::Diffuse { reflectance, texture: found.map(Arc::new) };
                self.assembly.add_material(texture.clone(), material)
            });
        }
        if missing > 0 {
            let all = own.len();
            self.warnings
                .push(format!("{}: {missing} of {all} textures have no image here; they are grey", path.display()));
        }
        self.assembly.add_mesh(mesh, |m| own.get(&m).copied().unwrap_or(0));
        Ok(())
    }
}

/// The image of a texture, if it is there and can be decoded.
fn image_of(images: &mut Images, texture: &str) -> Option<Texture> {
    let (bytes, ending) = images.find(texture)?;
    let format = match ending {
        "tga" => ImageFormat::Tga,
        "png" => ImageFormat::Png,
        _ => ImageFormat::Jpeg,
    };
    Texture::decode_as(&bytes, format).ok()
}
