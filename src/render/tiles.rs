//! Tiles: the unit of work and of timing.

use crate::render::film::Rect;

/// Pixels along a tile's side.
pub const TILE: u32 = 32;

/// The tiles that cover `region`, row by row.
pub fn tiles(region: Rect) -> Vec<Rect> {
    tiles_of(region, TILE)
}

/// Tiles of `side` pixels that cover `region`, row by row.
pub fn tiles_of(region: Rect, side: u32) -> Vec<Rect> {
    let mut all = Vec::new();
    for y in (0..region.height).step_by(side as usize) {
        for x in (0..region.width).step_by(side as usize) {
            all.push(Rect {
                x: region.x + x,
                y: region.y + y,
                width: side.min(region.width - x),
                height: side.min(region.height - y),
            });
        }
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tiles_cover_each_pixel_once() {
        let region = Rect { x: 3, y: 5, width: 70, height: 33 };
        let mut seen = vec![0u8; 80 * 40];
        for t in tiles(region) {
            for y in t.y..t.y + t.height {
                for x in t.x..t.x + t.width {
                    seen[(y * 80 + x) as usize] += 1;
                }
            }
        }
        assert_eq!(seen.iter().map(|&s| u32::from(s)).sum::<u32>(), 70 * 33);
        assert!(seen.iter().all(|&s| s <= 1));
    }
}
