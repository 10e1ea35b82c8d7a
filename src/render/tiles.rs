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

/// Pixels of a rectangle, which are numbered row by row, in blocks of four by two: those that follow each other lie together.
pub fn in_blocks(width: u32, height: u32) -> impl Iterator<Item = usize> {
    let block = move |x: u32, y: u32| {
        let rows = y..(y + 2).min(height);
        rows.flat_map(move |row| (x..(x + 4).min(width)).map(move |column| (row * width + column) as usize))
    };
    let corners = (0..height).step_by(2).flat_map(move |y| (0..width).step_by(4).map(move |x| (x, y)));
    corners.flat_map(move |(x, y)| block(x, y))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn blocks_hold_each_pixel_once() {
        assert_eq!(in_blocks(5, 3).collect::<Vec<_>>(), [0, 1, 2, 3, 5, 6, 7, 8, 4, 9, 10, 11, 12, 13, 14]);
        for (width, height) in [(32, 32), (1, 1), (7, 9), (0, 3)] {
            let mut all: Vec<usize> = in_blocks(width, height).collect();
            all.sort_unstable();
            assert!(all.into_iter().eq(0..(width * height) as usize));
        }
    }

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
