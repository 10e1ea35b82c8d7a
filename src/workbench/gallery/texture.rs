//! Textures of panels, brought up to date a few tiles at a time.

use super::image::{LiveImage, Tile};
use crate::render::film::Rect;
use egui::{Color32, ColorImage, TextureHandle, TextureOptions};

/// Pixels are seen as squares; where there are more than the screen can show they are averaged.
const OPTIONS: TextureOptions =
    TextureOptions { magnification: egui::TextureFilter::Nearest, ..TextureOptions::LINEAR };

/// The texture of one panel, with the version of each tile that is in it.
#[derive(Default)]
pub struct PanelTexture {
    handle: Option<TextureHandle>,
    size: [u32; 2],
    shown: Vec<u64>,
    /// What it was drawn with; anything else draws it all again.
    key: u64,
}

impl PanelTexture {
    /// Brings the texture up to date: tiles that are newer, or all if `key` differs from last time. `color` gives the
    /// colour of a pixel. Stops when `enough` says so; returns whether more is to be done.
    pub fn update(
        &mut self,
        context: &egui::Context,
        image: &LiveImage,
        key: u64,
        color: impl Fn(u32, u32) -> Color32,
        mut enough: impl FnMut() -> bool,
    ) -> bool {
        if self.size != image.size() || self.handle.is_none() {
            self.size = image.size();
            let blank = ColorImage::filled(self.size.map(|n| n as usize), super::super::theme::EMPTY);
            self.handle = Some(context.load_texture("panel", blank, OPTIONS));
            self.shown.clear();
        }
        if self.key != key {
            self.key = key;
            self.shown.clear();
        }
        let Some(handle) = &mut self.handle else { return false };
        let mut run: Option<Rect> = None;
        let mut upload = |rect: Rect| {
            let size = [rect.width as usize, rect.height as usize];
            let pixels = (rect.y..rect.y + rect.height)
                .flat_map(|y| (rect.x..rect.x + rect.width).map(move |x| (x, y)))
                .map(|(x, y)| color(x, y))
                .collect();
            handle.set_partial([rect.x as usize, rect.y as usize], ColorImage::new(size, pixels), OPTIONS);
        };
        for (i, (rect, tile, version)) in image.tiles().enumerate() {
            if self.shown.len() <= i {
                self.shown.push(0);
            }
            if tile == Tile::Empty || self.shown[i] == version {
                continue;
            }
            // Neighbours in a row go up together.
            match &mut run {
                Some(r) if r.y == rect.y && r.x + r.width == rect.x => r.width += rect.width,
                other => {
                    if let Some(r) = other.replace(rect) {
                        upload(r);
                    }
                    if enough() {
                        upload(rect);
                        self.shown[i] = version;
                        return true;
                    }
                }
            }
            self.shown[i] = version;
        }
        if let Some(r) = run {
            upload(r);
        }
        false
    }

    /// Shows one colour for each pixel of an image that is all there; drawn again if `key` differs from last time.
    pub fn show(&mut self, context: &egui::Context, size: [u32; 2], key: u64, color: impl Fn(usize) -> Color32) {
        if self.size == size && self.key == key && self.handle.is_some() {
            return;
        }
        let [w, h] = size.map(|n| n as usize);
        let image = ColorImage::new([w, h], (0..w * h).map(color).collect());
        match &mut self.handle {
            Some(handle) => handle.set(image, OPTIONS),
            None => self.handle = Some(context.load_texture("panel", image, OPTIONS)),
        }
        self.size = size;
        self.key = key;
        self.shown.clear();
    }

    /// The texture, once there is one.
    pub fn id(&self) -> Option<egui::TextureId> {
        self.handle.as_ref().map(TextureHandle::id)
    }
}
