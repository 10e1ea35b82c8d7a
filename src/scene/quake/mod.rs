//! Maps of Quake 3 (IBSP 46): `.bsp` files, and `.pk3` archives that hold them.
//!
//! Read are what is drawn, what lights, where players start, and the cells of visibility. Collision, light maps and the
//! lists of leaves are left out: Cusp lights the map itself.

mod cells;
mod entities;
mod faces;
mod images;
mod lights;
mod lumps;
mod patch;
mod pk3;
#[cfg(test)]
pub(crate) mod test_map;
#[cfg(test)]
mod tests;

pub use cells::Cells;
pub use entities::Entity;
pub use images::Images;
pub use lights::{camera, lights, viewpoints};

use crate::scene::SceneError;
use crate::scene::memory::{self, ALWAYS};
use crate::scene::shapes::Mesh;
use glam::DVec3;
use std::path::{Path, PathBuf};

/// Units of the game in a metre: a player of 56 units is 1.75 m high.
pub const UNITS_PER_METRE: f64 = 32.0;

/// What a map file is wrong in: which lump and what.
#[derive(Debug, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct MapError(pub String);

/// A map as it was read, in metres, y up.
pub struct QuakeMap {
    /// What is drawn.
    pub mesh: Mesh,
    /// Names of its textures; the mesh's materials index into them.
    pub textures: Vec<String>,
    /// Cells of visibility.
    pub cells: Cells,
    /// Entities.
    pub entities: Vec<Entity>,
    /// How many triangles came in and what was left out, one line; then what else was odd.
    pub notes: Vec<String>,
}

/// Whether a file's name is that of a map or an archive of maps.
pub fn is_map(name: &str) -> bool {
    let (file, _) = split_name(name);
    let extension = Path::new(file).extension().and_then(|e| e.to_str()).unwrap_or("").to_ascii_lowercase();
    extension == "bsp" || extension == "pk3"
}

/// `archive.pk3:map` as the archive and the map; other names as they are.
pub fn split_name(name: &str) -> (&str, Option<&str>) {
    match name.rsplit_once(':') {
        Some((file, map)) if file.to_ascii_lowercase().ends_with(".pk3") => (file, Some(map)),
        _ => (name, None),
    }
}

/// The bytes of the map that `name` calls, and where images are looked for. `read` gives the bytes of a file beside it.
///
/// # Errors
/// A file that cannot be read, an archive that is damaged or has no such map, a map that would not fit into memory.
pub fn open(
    name: &str,
    folder: Option<&Path>,
    read: impl FnOnce(&str) -> Result<(PathBuf, Vec<u8>), SceneError>,
) -> Result<(PathBuf, Vec<u8>, Images), SceneError> {
    let (file, map) = split_name(name);
    let (path, bytes) = read(file)?;
    let wrong = |e: MapError| SceneError::Whole { file: path.clone(), what: e.0 };
    let is_archive = file.to_ascii_lowercase().ends_with(".pk3");
    let (bytes, images) = if is_archive {
        let mut archive = pk3::Archive::new(bytes).map_err(wrong)?;
        let map = archive.map(map).map_err(wrong)?;
        let at = folder.map(|f| f.join(file));
        (map, Images::new(Some(archive), at.as_deref(), None))
    } else {
        // Archives and loose images lie in the folder above `maps`.
        let above = folder.map(|f| f.join(file)).and_then(|p| Some(p.parent()?.parent()?.to_owned()));
        (bytes, Images::new(None, None, above))
    };
    Ok((path, bytes, images))
}

/// Reads a map.
///
/// # Errors
/// The first thing that is wrong, with the lump and the place in it.
pub fn read(bytes: &[u8]) -> Result<QuakeMap, MapError> {
    let lumps = lumps::Lumps::new(bytes)?;
    let needed = lumps.vertexes.len() as u64 * 8 + lumps.meshverts.len() as u64 * 64;
    if needed > ALWAYS {
        memory::check("the map", needed, "give a smaller one").map_err(|e| MapError(e.to_string()))?;
    }
    let entities = entities::parse(&String::from_utf8_lossy(lumps.entities))?;
    let textures = lumps.textures()?;
    let (mesh, mut notes) = faces::mesh(&lumps, &textures, &entities)?;
    let (cells, note) = Cells::read(&lumps)?;
    notes.extend(note);
    let textures = textures.into_iter().map(|t| t.name).collect();
    Ok(QuakeMap { mesh, textures, cells, entities, notes })
}

/// A place or direction of the game, x east, y north, z up, as ours, y up.
pub(super) fn turned(v: DVec3) -> DVec3 {
    DVec3::new(v.x, v.z, -v.y)
}
