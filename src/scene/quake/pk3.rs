//! Archives of maps and images (zip).

use super::MapError;
use crate::scene::memory;
use std::fs::File;
use std::io::{BufReader, Cursor, Read, Seek};
use std::path::Path;
use zip::ZipArchive;

/// Bytes that a map may have unpacked, at most; large ones have some thirty million.
const MOST_OF_A_MAP: u64 = 256 << 20;

/// The same for an image.
const MOST_OF_AN_IMAGE: u64 = 64 << 20;

/// Where an archive's bytes come from.
pub(super) trait Bytes: Read + Seek + Send {}
impl<T: Read + Seek + Send> Bytes for T {}

/// An open archive.
pub struct Archive {
    zip: ZipArchive<Box<dyn Bytes>>,
}

impl Archive {
    /// An archive in memory.
    pub(super) fn new(bytes: Vec<u8>) -> Result<Self, MapError> {
        Self::of(Box::new(Cursor::new(bytes)))
    }

    /// An archive on disk.
    pub(super) fn open(path: &Path) -> Option<Self> {
        Self::of(Box::new(BufReader::new(File::open(path).ok()?))).ok()
    }

    fn of(bytes: Box<dyn Bytes>) -> Result<Self, MapError> {
        match ZipArchive::new(bytes) {
            Ok(zip) => Ok(Self { zip }),
            Err(e) => Err(MapError(format!("no pk3 archive that can be read: {e}"))),
        }
    }

    /// The map of that name (`name` or `maps/name.bsp`), or the only one.
    pub(super) fn map(&mut self, name: Option<&str>) -> Result<Vec<u8>, MapError> {
        let stem = |n: &str| {
            let lower = n.to_ascii_lowercase();
            lower.strip_suffix(".bsp").map(|s| s.rsplit('/').next().unwrap_or(s).to_owned())
        };
        let maps: Vec<(usize, String)> =
            self.zip.file_names().enumerate().filter_map(|(i, n)| Some((i, stem(&n.ok()?)?))).collect();
        let mut names: Vec<&str> = maps.iter().map(|m| m.1.as_str()).collect();
        names.sort_unstable();
        let index = match name {
            Some(name) => {
                let wanted = stem(name).unwrap_or_else(|| name.to_ascii_lowercase());
                maps.iter().find(|m| m.1 == wanted).map(|m| m.0)
            }
            None if maps.len() == 1 => Some(maps[0].0),
            None => None,
        };
        match (index, name) {
            (Some(i), _) => self.entry(i, MOST_OF_A_MAP),
            (None, _) if maps.is_empty() => Err(MapError("the archive holds no map (.bsp)".into())),
            (None, Some(name)) => {
                Err(MapError(format!("no map `{name}` in the archive; there are {}", names.join(", "))))
            }
            (None, None) => Err(MapError(format!(
                "the archive holds several maps; name one, as in FILE.pk3:{}; there are {}",
                names[0],
                names.join(", ")
            ))),
        }
    }

    /// A file by its name, without regard to upper and lower case, if it is there and can be read.
    pub(super) fn image(&mut self, name: &str) -> Option<Vec<u8>> {
        let index = match self.zip.index_for_name(name) {
            Some(i) => i,
            None => self.zip.file_names().position(|n| n.is_ok_and(|n| n.eq_ignore_ascii_case(name)))?,
        };
        self.entry(index, MOST_OF_AN_IMAGE).ok()
    }

    /// Unpacks a file, but no more than it says, and no more than `most` bytes.
    fn entry(&mut self, index: usize, most: u64) -> Result<Vec<u8>, MapError> {
        let file = self.zip.by_index(index).map_err(|e| MapError(format!("archive: {e}")))?;
        let (name, size) = (file.name().map_or_else(|_| format!("file {index}"), |n| n.into_owned()), file.size());
        if size > most {
            return Err(MapError(format!(
                "{name}: has {} unpacked, {} at most; is it a bomb?",
                memory::text(size),
                memory::text(most)
            )));
        }
        memory::check(&name, size, "give a smaller one").map_err(|e| MapError(e.to_string()))?;
        let mut bytes = Vec::new();
        // One more than it says, to see whether it lies.
        match file.take(size + 1).read_to_end(&mut bytes) {
            Err(e) => Err(MapError(format!("{name}: cannot be unpacked: {e}"))),
            Ok(_) if bytes.len() as u64 != size => {
                Err(MapError(format!("{name}: says that it has {size} bytes, and has others; the archive is damaged")))
            }
            Ok(_) => Ok(bytes),
        }
    }
}
