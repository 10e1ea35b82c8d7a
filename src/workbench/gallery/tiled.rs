//! Pixels in tiles that are shared instead of copied.

use crate::math::rgb::Rgb;
use crate::render::film::{Image, Rect};
use crate::render::tiles::{TILE, tiles};
use std::sync::Arc;

/// Linear radiance in tiles of [`TILE`] pixels. A clone takes no time and stays as it was when tiles of the other come
/// in: other threads measure it while the window goes on.
#[derive(Clone, Debug)]
pub struct TiledImage {
    size: [u32; 2],
    /// Row by row, each with its pixels row by row; None where nothing has come.
    tiles: Arc<Vec<Option<Arc<Vec<Rgb>>>>>,
}

impl TiledImage {
    /// An image without pixels.
    pub fn new(size: [u32; 2]) -> Self {
        let count = columns(size) * size[1].div_ceil(TILE) as usize;
        Self { size, tiles: Arc::new(vec![None; count]) }
    }

    /// An image that is all there.
    pub fn of(image: &Image) -> Self {
        let cut = tiles(Rect::whole(image.size)).into_iter().map(|rect| Some(Arc::new(image.crop(rect).pixels)));
        Self { size: image.size, tiles: Arc::new(cut.collect()) }
    }

    /// Pixels across and down.
    pub fn size(&self) -> [u32; 2] {
        self.size
    }

    /// Tiles, row by row.
    pub fn count(&self) -> usize {
        self.tiles.len()
    }

    /// Number of the tile that holds a pixel, which must be inside.
    pub fn tile_of(&self, [x, y]: [u32; 2]) -> usize {
        (y / TILE) as usize * columns(self.size) + (x / TILE) as usize
    }

    /// Takes in the tile at `rect`, row by row; nothing if it is no tile of this image.
    pub fn put(&mut self, rect: Rect, pixels: Vec<Rgb>) {
        let at = self.tile_of([rect.x, rect.y]);
        if pixels.len() == rect.width as usize * rect.height as usize
            && let Some(tile) = Arc::make_mut(&mut self.tiles).get_mut(at)
        {
            *tile = Some(Arc::new(pixels));
        }
    }

    /// The pixel, if it is inside and its tile has come.
    pub fn at(&self, [x, y]: [u32; 2]) -> Option<Rgb> {
        if x >= self.size[0] || y >= self.size[1] {
            return None;
        }
        let tile = self.tiles.get(self.tile_of([x, y]))?.as_ref()?;
        let width = TILE.min(self.size[0] - x / TILE * TILE);
        tile.get(((y % TILE) * width + x % TILE) as usize).copied()
    }

    /// The pixels of `rect`, whose left and right edges are those of tiles, row by row in pieces; a tile that has not
    /// come has none.
    pub fn pieces(&self, rect: Rect) -> impl Iterator<Item = &[Rgb]> {
        (rect.y..rect.y + rect.height).flat_map(move |y| {
            (rect.x..rect.x + rect.width).step_by(TILE as usize).filter_map(move |x| {
                let tile = self.tiles.get(self.tile_of([x, y]))?.as_ref()?;
                let width = TILE.min(self.size[0] - x) as usize;
                tile.chunks(width).nth((y % TILE) as usize)
            })
        })
    }

    /// A copy in one piece; black where nothing has come.
    pub fn to_image(&self) -> Image {
        let mut image = Image::black(self.size);
        for (rect, tile) in tiles(Rect::whole(self.size)).into_iter().zip(self.tiles.iter()) {
            if let Some(pixels) = tile {
                image.put(rect, pixels);
            }
        }
        image
    }
}

fn columns(size: [u32; 2]) -> usize {
    size[0].div_ceil(TILE) as usize
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_clone_stays_as_it_was() {
        let image = Image { size: [70, 40], pixels: (0..2800).map(|i| Rgb::splat(i as f32)).collect() };
        let mut tiled = TiledImage::of(&image);
        let before = tiled.clone();
        tiled.put(Rect { x: 64, y: 32, width: 6, height: 8 }, vec![Rgb::NEG_ONE; 48]);
        assert_eq!(before.to_image(), image);
        for (y, x) in (0..41).flat_map(|y| (0..71).map(move |x| (y, x))) {
            let inside = x < 70 && y < 40;
            let whole = inside.then(|| image.at(x, y));
            assert_eq!(before.at([x, y]), whole);
            let other = if x > 63 && y > 31 { inside.then_some(Rgb::NEG_ONE) } else { whole };
            assert_eq!(tiled.at([x, y]), other);
        }
        let rect = Rect { x: 32, y: 30, width: 38, height: 7 };
        let pieces: Vec<Rgb> = before.pieces(rect).flatten().copied().collect();
        assert_eq!(pieces, image.crop(rect).pixels);
    }

    #[test]
    fn what_has_not_come_is_black_and_no_pixel() {
        let mut tiled = TiledImage::new([33, 33]);
        tiled.put(Rect { x: 32, y: 0, width: 1, height: 32 }, vec![Rgb::ONE; 32]);
        // Too few pixels, and no tile of the image.
        tiled.put(Rect { x: 0, y: 0, width: 32, height: 32 }, vec![Rgb::ONE; 5]);
        tiled.put(Rect { x: 0, y: 64, width: 1, height: 1 }, vec![Rgb::ONE]);
        assert_eq!((tiled.at([32, 31]), tiled.at([31, 31]), tiled.at([32, 32])), (Some(Rgb::ONE), None, None));
        let image = tiled.to_image();
        assert_eq!(image.pixels.iter().filter(|p| **p == Rgb::ONE).count(), 32);
        assert_eq!(image.at(32, 32), Rgb::ZERO);
    }
}
