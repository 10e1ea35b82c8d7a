//! Textures of panels, brought up to date a few tiles at a time.

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
    /// Brings the texture of an image of `size` pixels up to date: tiles that are newer, or all if `key` differs from
    /// last time. Stops when `enough` says so; returns whether more is to be done.
    ///
    /// * `tiles`: all of them, row by row, with the number of their last change; 0 where there are no pixels.
    /// * `colors`: adds the colours of a rectangle of whole tiles, row by row.
    pub fn update(
        &mut self,
        context: &egui::Context,
        size: [u32; 2],
        key: u64,
        tiles: impl Iterator<Item = (Rect, u64)>,
        colors: impl Fn(Rect, &mut Vec<Color32>),
        mut enough: impl FnMut() -> bool,
    ) -> bool {
        if self.size != size || self.handle.is_none() {
            self.size = size;
            let blank = ColorImage::filled(size.map(|n| n as usize), super::super::theme::EMPTY);
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
            let mut pixels = Vec::with_capacity(size[0] * size[1]);
            colors(rect, &mut pixels);
            handle.set_partial([rect.x as usize, rect.y as usize], ColorImage::new(size, pixels), OPTIONS);
        };
        for (i, (rect, version)) in tiles.enumerate() {
            if self.shown.len() <= i {
                self.shown.push(0);
            }
            if self.shown[i] == version {
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

    /// The texture, once there is one.
    pub fn id(&self) -> Option<egui::TextureId> {
        self.handle.as_ref().map(TextureHandle::id)
    }
}
