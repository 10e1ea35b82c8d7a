//! One estimator's image as it comes in, tile by tile.

use super::tiled::TiledImage;
use crate::math::rgb::Rgb;
use crate::render::film::Rect;

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
    image: TiledImage,
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
        Self::of(TiledImage::new(size), Tile::Empty, 0)
    }

    /// An image that is all there.
    pub fn whole(image: TiledImage) -> Self {
        Self::of(image, Tile::Fresh, 1)
    }

    /// An image whose tiles are all in the same state since the same change.
    fn of(image: TiledImage, tile: Tile, version: u64) -> Self {
        let count = image.count();
        let (tiles, versions, seconds) = (vec![tile; count], vec![version; count], vec![0.0; count]);
        Self { image, tiles, versions, seconds, version, passes: 0 }
    }

    /// Pixels across and down.
    pub fn size(&self) -> [u32; 2] {
        self.image.size()
    }

    /// The pixels.
    pub fn pixels(&self) -> &TiledImage {
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

    /// Takes in the tile at `rect`, row by row, and its thread seconds if they are known. Nothing if it lies outside.
    pub fn put(&mut self, rect: Rect, pixels: Vec<Rgb>, seconds: Option<f64>) {
        let at = self.image.tile_of([rect.x, rect.y]);
        let (Some(tile), Some(version)) = (self.tiles.get_mut(at), self.versions.get_mut(at)) else { return };
        self.image.put(rect, pixels);
        self.version += 1;
        *tile = Tile::Fresh;
        *version = self.version;
        if let Some(seconds) = seconds {
            self.seconds[at] = seconds;
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

    /// The tiles with their rectangle, state and the number of their last change, 0 for those that are empty.
    pub fn tiles(&self) -> impl Iterator<Item = (Rect, Tile, u64)> + '_ {
        let rects = crate::render::tiles::tiles(Rect::whole(self.size()));
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
    pub fn at(&self, pixel: [u32; 2]) -> Option<Rgb> {
        self.image.at(pixel)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::render::film::Image;

    #[test]
    fn tiles_age_and_are_renewed() {
        let mut live = LiveImage::new([70, 40]);
        assert!(!live.has_pixels() && live.at([3, 3]).is_none());
        let rect = Rect { x: 64, y: 32, width: 6, height: 8 };
        live.put(rect, vec![Rgb::ONE; 48], Some(0.5));
        assert_eq!((live.at([69, 39]), live.seconds(5)), (Some(Rgb::ONE), Some(0.5)));
        assert!(live.at([63, 39]).is_none() && live.at([70, 39]).is_none());
        live.age();
        assert_eq!(live.tiles().filter(|t| t.1 == Tile::Stale).map(|t| t.0).collect::<Vec<_>>(), [rect]);
        for rect in crate::render::tiles::tiles(Rect::whole([70, 40])) {
            live.put(rect, vec![Rgb::ZERO; (rect.width * rect.height) as usize], None);
        }
        assert!(live.is_fresh());
        assert_eq!(live.tiles().map(|t| t.2).collect::<Vec<_>>(), [2, 3, 4, 5, 6, 7]);
        let whole = LiveImage::whole(TiledImage::of(&Image::black([70, 40])));
        assert!(whole.is_fresh() && whole.tiles().all(|t| t.2 == 1));
    }
}
