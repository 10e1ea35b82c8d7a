//! Discs, circles and dots of a plane, drawn with smooth edges into a part of a canvas.

use crate::export::text::Canvas;
use glam::Vec2;

/// A square window on a plane, in a canvas.
pub struct Window<'a> {
    canvas: &'a mut Canvas,
    /// Its top left corner in the canvas.
    corner: [u32; 2],
    /// Pixels across and down.
    size: u32,
    /// The plane's point in its middle.
    center: Vec2,
    /// Pixels for a unit of the plane.
    scale: f32,
}

impl<'a> Window<'a> {
    /// A window `size` pixels across and down whose top left corner is `corner`, about `center`; `half` is half of what it
    /// shows of the plane, positive. The plane's second coordinate runs down.
    pub fn new(canvas: &'a mut Canvas, corner: [u32; 2], size: u32, center: Vec2, half: f32) -> Self {
        Self { canvas, corner, size, center, scale: size as f32 / (2.0 * half) }
    }

    fn pixel(&self, p: Vec2) -> Vec2 {
        (p - self.center) * self.scale + Vec2::splat(self.size as f32 / 2.0)
    }

    /// Paints each pixel whose centre's place in the plane `color` gives a colour and an opacity for.
    pub fn paint(&mut self, color: impl Fn(Vec2) -> Option<([u8; 3], f32)>) {
        for y in 0..self.size {
            for x in 0..self.size {
                let at = Vec2::new(x as f32 + 0.5, y as f32 + 0.5) - Vec2::splat(self.size as f32 / 2.0);
                if let Some((color, opacity)) = color(self.center + at / self.scale) {
                    self.canvas.blend(self.corner[0] + x, self.corner[1] + y, color, opacity);
                }
            }
        }
    }

    /// Covers what lies within a signed distance of 0 pixels, which `distance` gives, inside the box of `reach` pixels about
    /// `at`.
    fn shape(&mut self, at: Vec2, reach: f32, color: [u8; 3], opacity: f32, distance: impl Fn(Vec2) -> f32) {
        let clamp = |v: f32| v.clamp(0.0, self.size as f32) as u32;
        let (low, high) = (at - Vec2::splat(reach + 1.0), at + Vec2::splat(reach + 2.0));
        for y in clamp(low.y)..clamp(high.y) {
            for x in clamp(low.x)..clamp(high.x) {
                let covered = 0.5 - distance(Vec2::new(x as f32 + 0.5, y as f32 + 0.5));
                if covered > 0.0 {
                    let (x, y) = (self.corner[0] + x, self.corner[1] + y);
                    self.canvas.blend(x, y, color, opacity * covered.min(1.0));
                }
            }
        }
    }

    /// A disc of that radius in the plane.
    pub fn disc(&mut self, center: Vec2, radius: f32, color: [u8; 3], opacity: f32) {
        let (at, r) = (self.pixel(center), radius * self.scale);
        self.shape(at, r, color, opacity, |p| p.distance(at) - r);
    }

    /// The outline of a disc, `width` pixels wide.
    pub fn circle(&mut self, center: Vec2, radius: f32, width: f32, color: [u8; 3], opacity: f32) {
        let (at, r) = (self.pixel(center), radius * self.scale);
        self.shape(at, r + width, color, opacity, |p| (p.distance(at) - r).abs() - width / 2.0);
    }

    /// A dot of a radius in pixels.
    pub fn dot(&mut self, center: Vec2, radius: f32, color: [u8; 3]) {
        let at = self.pixel(center);
        self.shape(at, radius, color, 1.0, |p| p.distance(at) - radius);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ink(draw: impl Fn(&mut Window)) -> f64 {
        let mut canvas = Canvas::new([120, 100], [0; 3]);
        draw(&mut Window::new(&mut canvas, [10, 0], 100, Vec2::new(5.0, 7.0), 2.0));
        canvas.rgb.iter().map(|b| f64::from(*b) / 255.0).sum::<f64>() / 3.0
    }

    /// Ink is area: πr² for a disc, 2πr times the width for a circle, and what is outside the window is cut off.
    #[test]
    fn shapes_have_their_areas() {
        let white = [255; 3];
        let disc = ink(|w| w.disc(Vec2::new(5.0, 7.0), 1.0, white, 1.0));
        assert!((disc / (std::f64::consts::PI * 625.0) - 1.0).abs() < 0.01, "{disc}");
        let half = ink(|w| w.disc(Vec2::new(3.0, 7.0), 1.0, white, 1.0));
        assert!((half / disc - 0.5).abs() < 0.01, "{half}");
        let circle = ink(|w| w.circle(Vec2::new(5.0, 7.0), 1.0, 3.0, white, 1.0));
        assert!((circle / (std::f64::consts::TAU * 75.0) - 1.0).abs() < 0.02, "{circle}");
        assert!(ink(|w| w.dot(Vec2::new(99.0, 7.0), 3.0, white)) == 0.0);
        let painted = ink(|w| w.paint(|p| (p.x > 5.0).then_some((white, 1.0))));
        assert!((painted - 5000.0).abs() < 1.0, "{painted}");
    }
}
