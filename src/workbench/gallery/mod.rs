//! The images behind the panels: linear radiance as it streams in, and the textures that show it.

pub mod image;
pub mod shade;
pub mod texture;
pub mod tiled;
pub mod values;

use crate::export::false_color::ValueRange;
use crate::export::session::Panel;
use crate::render::film::Rect;
use crate::workbench::worker::messages::{Job, TileImage};
use image::LiveImage;
use std::collections::BTreeMap;
use texture::PanelTexture;
use tiled::TiledImage;
use values::Values;

/// All images, by what they show.
#[derive(Default)]
pub struct Gallery {
    estimators: Vec<String>,
    /// By estimator with settings.
    rendered: BTreeMap<String, LiveImage>,
    /// By path.
    files: BTreeMap<String, LiveImage>,
    /// The reference, if there is one.
    reference: Option<LiveImage>,
    /// The texture that shows it.
    pub reference_texture: PanelTexture,
    /// Numbers of panels that show a heatmap or a difference.
    pub values: BTreeMap<usize, Values>,
    /// One for each panel.
    pub textures: Vec<PanelTexture>,
}

impl Gallery {
    /// Gets ready for a job: images of estimators that it has age, others go.
    pub fn start(&mut self, job: &Job) {
        self.estimators.clone_from(&job.estimators);
        let mut before = std::mem::take(&mut self.rendered);
        for name in &job.estimators {
            let old = before.remove(name).filter(|i| i.size() == job.settings.size);
            let mut image = old.unwrap_or_else(|| LiveImage::new(job.settings.size));
            image.age();
            self.rendered.insert(name.clone(), image);
        }
    }

    /// Takes in a tile of all estimators that it has.
    pub fn tile(&mut self, rect: Rect, images: Vec<TileImage>) {
        for tile in images {
            let image = self.estimators.get(tile.estimator).and_then(|name| self.rendered.get_mut(name));
            if let Some(image) = image {
                image.put(rect, tile.pixels, Some(tile.seconds.total()).filter(|s| *s > 0.0));
            }
        }
    }

    /// Notes how many passes each estimator has.
    pub fn passes(&mut self, passes: &[u32]) {
        for (name, n) in self.estimators.iter().zip(passes) {
            if let Some(image) = self.rendered.get_mut(name) {
                image.passes = *n;
            }
        }
    }

    /// Takes in an image from a file.
    pub fn put_file(&mut self, path: &str, image: TiledImage) {
        self.files.insert(path.to_owned(), LiveImage::whole(image));
    }

    /// Whether that file's image is here.
    pub fn has_file(&self, path: &str) -> bool {
        self.files.contains_key(path)
    }

    /// Takes in another reference, or none.
    pub fn set_reference(&mut self, image: Option<TiledImage>) {
        self.reference = image.map(LiveImage::whole);
        self.reference_texture = PanelTexture::default();
    }

    /// The reference.
    pub fn reference(&self) -> Option<&LiveImage> {
        self.reference.as_ref()
    }

    /// Range of the colours of a panel's numbers: that of all panels that show the same, so that they can be compared.
    pub fn range_of(&self, panel: usize) -> Option<ValueRange> {
        let own = self.values.get(&panel)?;
        let alike = self.values.values().filter(|v| v.title == own.title);
        Some(alike.fold(own.range, |r, v| ValueRange { low: r.low.min(v.range.low), high: r.high.max(v.range.high) }))
    }

    /// The image of a panel.
    pub fn of(&self, panel: &Panel) -> Option<&LiveImage> {
        match &panel.image {
            Some(path) => self.files.get(path),
            None => self.rendered.get(&panel.estimator),
        }
    }

    /// The image of an estimator.
    pub fn of_estimator(&self, name: &str) -> Option<&LiveImage> {
        self.rendered.get(name)
    }
}
