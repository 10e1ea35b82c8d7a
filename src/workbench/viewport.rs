//! The linked view of all image panels: zoom and pan.

use crate::export::session::View;
use egui::{Pos2, Rect, Vec2, pos2, vec2};

/// Largest zoom, points for each pixel.
const MAX_ZOOM: f32 = 256.0;

/// An image of some size seen in a rectangle of the screen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Viewport {
    /// Where the panel lies on the screen, points.
    pub panel: Rect,
    /// Points for each pixel of the image.
    pub scale: f32,
    /// Where the image's upper left corner lies on the screen, points.
    pub origin: Pos2,
    size: [u32; 2],
}

impl Viewport {
    /// `view` of an image of `size` pixels in `panel`. At one-to-one and above, pixels fall on whole points of the screen.
    pub fn new(view: View, panel: Rect, size: [u32; 2]) -> Self {
        let pixels = vec2(size[0] as f32, size[1] as f32);
        let scale = if view.zoom > 0.0 { view.zoom } else { fit(panel.size(), pixels) };
        let shown = pixels * scale;
        let center = if view.zoom > 0.0 { vec2(view.center[0], view.center[1]) } else { Vec2::splat(0.5) };
        let corner = panel.center() - shown * center;
        Self { panel, scale, origin: pos2(corner.x.round(), corner.y.round()), size }
    }

    /// Rectangle of the whole image on the screen.
    pub fn image(&self) -> Rect {
        Rect::from_min_size(self.origin, vec2(self.size[0] as f32, self.size[1] as f32) * self.scale)
    }

    /// Place on the screen of a point of the image, in pixels.
    pub fn to_screen(&self, x: f32, y: f32) -> Pos2 {
        self.origin + vec2(x, y) * self.scale
    }

    /// Place in the image, in pixels, of a point on the screen.
    pub fn to_image(&self, at: Pos2) -> Vec2 {
        (at - self.origin) / self.scale
    }

    /// The pixel at a point on the screen.
    pub fn pixel(&self, at: Pos2) -> Option<[u32; 2]> {
        let p = self.to_image(at);
        let inside = p.x >= 0.0 && p.y >= 0.0 && p.x < self.size[0] as f32 && p.y < self.size[1] as f32;
        (inside && self.panel.contains(at)).then_some([p.x as u32, p.y as u32])
    }

    /// The view zoomed by `factor` so that the point under `at` stays where it is.
    pub fn zoomed(&self, factor: f32, at: Pos2) -> View {
        let least = 0.25 * fit(self.panel.size(), vec2(self.size[0] as f32, self.size[1] as f32));
        let zoom = (self.scale * factor).clamp(least.min(1.0), MAX_ZOOM);
        let under = self.to_image(at);
        self.with(zoom, under - (at - self.panel.center()) / zoom)
    }

    /// The view moved by `delta` points on the screen.
    pub fn panned(&self, delta: Vec2) -> View {
        self.with(self.scale, self.to_image(self.panel.center()) - delta / self.scale)
    }

    /// The view at `zoom` points for each pixel about the same middle.
    pub fn at_zoom(&self, zoom: f32) -> View {
        self.with(zoom, self.to_image(self.panel.center()))
    }

    /// The view with that zoom and that place (pixels) in the middle, which stays inside the image.
    fn with(&self, zoom: f32, middle: Vec2) -> View {
        let part = |x: f32, n: u32| (x / n.max(1) as f32).clamp(0.0, 1.0);
        View { zoom, center: [part(middle.x, self.size[0]), part(middle.y, self.size[1])] }
    }
}

/// Largest scale at which all pixels are seen; whole numbers above one, so that pixels stay square.
fn fit(panel: Vec2, pixels: Vec2) -> f32 {
    let scale = (panel.x / pixels.x.max(1.0)).min(panel.y / pixels.y.max(1.0)).max(1e-3);
    if scale >= 2.0 { scale.floor() } else { scale }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PANEL: Rect = Rect::from_min_max(pos2(10.0, 20.0), pos2(210.0, 120.0));

    #[test]
    fn fit_shows_everything() {
        for size in [[512, 512], [1, 1], [4000, 10], [64, 64]] {
            let v = Viewport::new(View::default(), PANEL, size);
            assert!(PANEL.expand(1.0).contains_rect(v.image()), "{size:?} {:?}", v.image());
        }
    }

    #[test]
    fn zoom_keeps_the_pixel_under_the_pointer() {
        let v = Viewport::new(View { zoom: 2.0, center: [0.5, 0.5] }, PANEL, [256, 256]);
        let at = pos2(60.0, 77.0);
        let before = v.to_image(at);
        for factor in [0.5, 1.3, 4.0] {
            let after = Viewport::new(v.zoomed(factor, at), PANEL, [256, 256]).to_image(at);
            // Rounding to whole points.
            assert!((after - before).length() < 2.0 / (2.0 * factor), "{before} {after}");
        }
    }

    #[test]
    fn pixels_are_found_where_they_are_drawn() {
        let v = Viewport::new(View { zoom: 7.0, center: [0.1, 0.9] }, PANEL, [64, 32]);
        let at = v.to_screen(5.5, 28.5);
        assert_eq!(v.pixel(at), Some([5, 28]));
        assert_eq!(v.pixel(pos2(0.0, 0.0)), None);
    }
}
