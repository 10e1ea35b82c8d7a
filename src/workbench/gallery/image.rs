//! One estimator's image as it comes in, tile by tile.

use crate::math::rgb::Rgb;
use crate::render::film::{Image, Rect};
use crate::render::tiles::TILE;

/// What a tile of an image holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Tile {
    /// Nothing yet.
    Empty,
    /// Pixels of older settings.
    Stale,
    /// Pixels of the settings that are shown.
    Fresh,
}

/// Linear radiance with the state of its tiles. Every change counts up a version, so that whoever shows it sees what
/// is new.
pub struct LiveImage {
    image: Image,
    tiles: Vec<Tile>,
    versions: Vec<u64>,
    /// Thread seconds that each tile took last; 0 if unknown.
    seconds: Vec<f64>,
    version: u64,
    /// Passes that are in it.
    pub passes: u32,
}

impl LiveImage {
    /// An empty image.
    pub fn new(size: [u32; 2]) -> Self {
        let count = tile_columns(size) * size[1].div_ceil(TILE) as usize;
        Self {
            image: Image::black(size),
            tiles: vec![Tile::Empty; count],
            versions: vec![0; count],
            seconds: vec![0.0; count],
            version: 0,
            passes: 0,
        }
    }

    /// An image that is all there.
    pub fn whole(image: &Image) -> Self {
        let mut live = Self::new(image.size);
        let size = image.size;
        live.put(Rect::whole(size), &image.pixels);
        live
    }

    /// Pixels across and down.
    pub fn size(&self) -> [u32; 2] {
        self.image.size
    }

    /// The pixels; black where a tile is empty.
    pub fn image(&self) -> &Image {
        &self.image
    }

    /// Marks what is there as stale.
    pub fn age(&mut self) {
        for tile in &mut self.tiles {
            if *tile == Tile::Fresh {
                *tile = Tile::Stale;
            }
        }
    }

    /// Overwrites the pixels of `rect`, which lies inside and covers whole tiles.
    pub fn put(&mut self, rect: Rect, pixels: &[Rgb]) {
        self.image.put(rect, pixels);
        self.version += 1;
        let columns = tile_columns(self.image.size);
        for y in rect.y / TILE..(rect.y + rect.height).div_ceil(TILE) {
            for x in rect.x / TILE..(rect.x + rect.width).div_ceil(TILE) {
                let at = y as usize * columns + x as usize;
                self.tiles[at] = Tile::Fresh;
                self.versions[at] = self.version;
            }
        }
    }

    /// Notes the thread seconds of the tile at `rect`.
    pub fn time(&mut self, rect: Rect, seconds: f64) {
        let at = (rect.y / TILE) as usize * tile_columns(self.image.size) + (rect.x / TILE) as usize;
        if let Some(s) = self.seconds.get_mut(at) {
            *s = seconds;
        }
    }

    /// Thread seconds of the tile of that number, if known.
    pub fn seconds(&self, tile: usize) -> Option<f64> {
        self.seconds.get(tile).copied().filter(|s| *s > 0.0)
    }

    /// Number of the last change.
    pub fn version(&self) -> u64 {
        self.version
    }

    /// The tiles with their rectangle, state and the number of their last change.
    pub fn tiles(&self) -> impl Iterator<Item = (Rect, Tile, u64)> + '_ {
        let rects = crate::render::tiles::tiles(Rect::whole(self.image.size));
        rects.into_iter().zip(&self.tiles).zip(&self.versions).map(|((rect, tile), version)| (rect, *tile, *version))
    }

    /// Whether every tile is of the settings that are shown.
    pub fn is_fresh(&self) -> bool {
        self.tiles.iter().all(|t| *t == Tile::Fresh)
    }

    /// Whether any tile has pixels.
    pub fn has_pixels(&self) -> bool {
        self.tiles.iter().any(|t| *t != Tile::Empty)
    }

    /// The pixel, if its tile has pixels.
    pub fn at(&self, [x, y]: [u32; 2]) -> Option<Rgb> {
        let [w, h] = self.image.size;
        let tile = (y / TILE) as usize * tile_columns(self.image.size) + (x / TILE) as usize;
        (x < w && y < h && self.tiles[tile] != Tile::Empty).then(|| self.image.at(x, y))
    }
}

fn tile_columns(size: [u32; 2]) -> usize {
    size[0].div_ceil(TILE) as usize
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tiles_age_and_are_renewed() {
        let mut live = LiveImage::new([70, 40]);
        assert!(!live.has_pixels() && live.at([3, 3]).is_none());
        let rect = Rect { x: 64, y: 32, width: 6, height: 8 };
        live.put(rect, &[Rgb::ONE; 48]);
        assert_eq!(live.at([69, 39]), Some(Rgb::ONE));
        assert!(live.at([63, 39]).is_none() && live.at([70, 39]).is_none());
        live.age();
        assert_eq!(live.tiles().filter(|t| t.1 == Tile::Stale).map(|t| t.0).collect::<Vec<_>>(), [rect]);
        live.put(Rect::whole([70, 40]), &[Rgb::ZERO; 2800]);
        assert!(live.is_fresh() && live.tiles().all(|t| t.2 == 2));
    }
}
