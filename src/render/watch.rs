//! What callers are asked and told while a pass runs, from any thread.

use crate::math::rgb::Rgb;
use crate::render::film::{Film, Rect};
use crate::render::pass::Pass;
use crate::render::renderer::DRAFT_SCALE;
use crate::render::view_pass::{PartSeconds, TileResult, TileWatch};
use std::sync::Arc;

/// Follows a render. Every method may be called from any thread, several at once.
pub trait Watch: Sync {
    /// Whether to stop. Returns at once.
    fn cancelled(&self) -> bool {
        false
    }

    /// Asked before each tile: whether to make it. It may block, which pauses the render.
    fn tile_allowed(&self) -> bool {
        !self.cancelled()
    }

    /// Photons and maps stand, and tiles follow. `draft` passes are not kept.
    fn pass_started(&self, _pass: &Arc<Pass>, _draft: bool) {}

    /// A tile is done under all the estimators of the pass.
    fn tile_done(&self, _tile: &TileDone) {}
}

/// Never stops, tells nobody.
pub struct Silent;

impl Watch for Silent {}

impl TileWatch for Silent {
    fn cancelled(&self) -> bool {
        false
    }

    fn tile_done(&self, _tile: &TileResult) {}
}

/// A finished tile, with the passes before it.
pub struct TileDone<'a> {
    /// Its images.
    pub tile: &'a TileResult,
    /// Index of the estimator of each image.
    pub estimators: &'a [usize],
    /// Finished passes of each of them.
    pub films: &'a [&'a Film],
    /// Whether it stands alone and is not kept.
    pub draft: bool,
}

impl TileDone<'_> {
    /// Where it lies in the film. The tiles of a draft have few pixels and cover many.
    pub fn rect(&self) -> Rect {
        let Rect { x, y, width, height } = self.tile.rect;
        if !self.draft {
            return self.tile.rect;
        }
        let [w, h] = self.films.first().map_or([0, 0], |f| f.size());
        let (left, top) = (x * DRAFT_SCALE, y * DRAFT_SCALE);
        let width = (width * DRAFT_SCALE).min(w.saturating_sub(left));
        let height = (height * DRAFT_SCALE).min(h.saturating_sub(top));
        Rect { x: left, y: top, width, height }
    }

    /// For each image: index of its estimator, the mean of all passes with this one over [`TileDone::rect`], and thread
    /// seconds. Of a draft, its pixels alone, each as often as it has to be.
    ///
    /// The same bits as the film's image will have when the pass is finished.
    pub fn means(&self) -> impl Iterator<Item = (usize, Vec<Rgb>, PartSeconds)> {
        let rect = self.rect();
        self.tile.images.iter().zip(self.estimators).zip(self.films).map(move |((image, &estimator), film)| {
            let pixels = if self.draft { self.enlarged(&image.pixels) } else { film.mean_with(rect, &image.pixels) };
            (estimator, pixels, image.seconds)
        })
    }

    /// The pixels of a draft over what they cover.
    fn enlarged(&self, pixels: &[Rgb]) -> Vec<Rgb> {
        let (rect, columns) = (self.rect(), self.tile.rect.width);
        let at = |x: u32, y: u32| pixels[(y / DRAFT_SCALE * columns + x / DRAFT_SCALE) as usize];
        (0..rect.height).flat_map(|y| (0..rect.width).map(move |x| at(x, y))).collect()
    }
}

/// Tells a [`Watch`] about tiles together with the films that they belong to.
pub(super) struct FilmWatch<'a> {
    pub watch: &'a dyn Watch,
    pub estimators: &'a [usize],
    pub films: &'a [&'a Film],
    pub draft: bool,
}

impl TileWatch for FilmWatch<'_> {
    fn cancelled(&self) -> bool {
        self.watch.cancelled()
    }

    fn tile_allowed(&self) -> bool {
        self.watch.tile_allowed()
    }

    fn tile_done(&self, tile: &TileResult) {
        let (estimators, films, draft) = (self.estimators, self.films, self.draft);
        self.watch.tile_done(&TileDone { tile, estimators, films, draft });
    }
}
