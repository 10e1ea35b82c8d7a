//! Where to look: the window of an image in which most happens.

use crate::math::rgb::luminance;
use crate::render::film::{Image, Rect};

/// A value for each pixel, not negative.
pub struct Interest {
    size: [u32; 2],
    values: Vec<f64>,
}

/// How much the compressed luminance changes from each pixel to the next across and down.
pub fn contours(image: &Image) -> Interest {
    let [w, h] = image.size;
    let middle = mean_luminance(image);
    let value = |x: u32, y: u32| compressed(luminance(image.at(x.min(w - 1), y.min(h - 1))), middle);
    let values = pixels(image.size)
        .map(|(x, y)| {
            let (dx, dy) = (value(x + 1, y) - value(x, y), value(x, y + 1) - value(x, y));
            (dx * dx + dy * dy).sqrt()
        })
        .collect();
    Interest { size: image.size, values }
}

/// Spread of the compressed luminance over images of the same size.
pub fn disagreement(images: &[&Image]) -> Interest {
    let Some(first) = images.first() else {
        return Interest { size: [0, 0], values: Vec::new() };
    };
    let middle = mean_luminance(first);
    let values = (0..first.pixels.len())
        .map(|i| {
            let (low, high) = images.iter().fold((f64::INFINITY, 0.0f64), |(low, high), image| {
                let v = compressed(luminance(image.pixels[i]), middle);
                (low.min(v), high.max(v))
            });
            (high - low).max(0.0)
        })
        .collect();
    Interest { size: first.size, values }
}

/// The window of at most `size` pixels with the largest sum, to the nearest four pixels; the first of equals.
pub fn busiest_window(interest: &Interest, size: [u32; 2]) -> Rect {
    let [w, h] = interest.size;
    let (width, height) = (size[0].min(w), size[1].min(h));
    // Sums over rectangles from the corner.
    let mut table = vec![0.0f64; (w as usize + 1) * (h as usize + 1)];
    let at = |x: u32, y: u32| y as usize * (w as usize + 1) + x as usize;
    for ((x, y), v) in pixels(interest.size).zip(&interest.values) {
        table[at(x + 1, y + 1)] = v + table[at(x, y + 1)] + table[at(x + 1, y)] - table[at(x, y)];
    }
    let mut best = (f64::NEG_INFINITY, 0, 0);
    for y in (0..=h - height).step_by(4) {
        for x in (0..=w - width).step_by(4) {
            let sum =
                table[at(x + width, y + height)] - table[at(x, y + height)] - table[at(x + width, y)] + table[at(x, y)];
            if sum > best.0 {
                best = (sum, x, y);
            }
        }
    }
    Rect { x: best.1, y: best.2, width, height }
}

/// From 0 to 1, so that one bright spot does not outweigh a long contour. What is negative or no number is 0.
fn compressed(luminance: f32, middle: f32) -> f64 {
    // In 64 bits, where the sum of two of the largest numbers is one.
    let (l, middle) = (f64::from(luminance), f64::from(middle).max(f64::from(f32::MIN_POSITIVE)));
    if l == f64::INFINITY {
        1.0
    } else if l > 0.0 {
        l / (l + middle)
    } else {
        0.0
    }
}

fn mean_luminance(image: &Image) -> f32 {
    let sum: f64 = image.pixels.iter().map(|p| f64::from(luminance(*p))).sum();
    (sum / image.pixels.len().max(1) as f64) as f32
}

fn pixels([w, h]: [u32; 2]) -> impl Iterator<Item = (u32, u32)> {
    (0..h).flat_map(move |y| (0..w).map(move |x| (x, y)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;

    fn disc(cx: i32, cy: i32) -> Image {
        let mut image = Image::black([256, 200]);
        for (i, (x, y)) in pixels(image.size).enumerate() {
            if (x as i32 - cx).pow(2) + (y as i32 - cy).pow(2) < 900 {
                image.pixels[i] = Vec3::ONE;
            }
        }
        image
    }

    #[test]
    fn the_busiest_window_holds_the_contour() {
        let r = busiest_window(&contours(&disc(180, 120)), [64, 64]);
        assert!(r.x <= 150 && r.x + 64 >= 210 && r.y <= 90 && r.y + 64 >= 150, "{r:?}");
        let small = Image::black([10, 5]);
        assert_eq!(busiest_window(&contours(&small), [64, 64]), Rect::whole([10, 5]));
    }

    #[test]
    fn images_disagree_where_they_differ() {
        let (mut a, b) = (disc(60, 60), disc(60, 60));
        a.pixels[150 * 256 + 200] = Vec3::ONE;
        let r = busiest_window(&disagreement(&[&a, &b]), [16, 16]);
        assert!((r.x..r.x + 16).contains(&200) && (r.y..r.y + 16).contains(&150), "{r:?}");
    }
}
