//! The textures that egui has handed over, and changes to parts of them.

use egui::epaint::ImageDelta;
use egui::{Color32, ColorImage, ImageData, TextureId, TextureOptions};
use std::collections::HashMap;

/// An image to sample: at least one texel.
#[derive(Debug)]
pub struct Texture {
    size: [usize; 2],
    texels: Vec<Color32>,
    /// How to filter, and what lies outside.
    pub options: TextureOptions,
}

impl Texture {
    /// A copy of `image`; none if it is empty or its pixels do not match its size.
    pub fn new(image: &ColorImage, options: TextureOptions) -> Option<Self> {
        is_whole(image).then(|| Self { size: image.size, texels: image.pixels.clone(), options })
    }

    /// Width and height in texels, each at least 1.
    pub fn size(&self) -> [usize; 2] {
        self.size
    }

    /// The texel of column `x` and row `y`, premultiplied; transparent outside.
    pub fn texel(&self, x: usize, y: usize) -> [u8; 4] {
        self.texels.get(y * self.size[0] + x).copied().unwrap_or_default().to_array()
    }

    /// Replaces the part whose upper left texel is `corner`. A part that leaves the texture changes nothing.
    fn set_part(&mut self, corner: [usize; 2], image: &ColorImage) {
        let [width, height] = image.size;
        let fits = |axis: usize| corner[axis].checked_add(image.size[axis]).is_some_and(|end| end <= self.size[axis]);
        if !is_whole(image) || !fits(0) || !fits(1) {
            return;
        }
        let rows = self.texels.chunks_exact_mut(self.size[0]).skip(corner[1]).take(height);
        for (row, part) in rows.zip(image.pixels.chunks_exact(width)) {
            row[corner[0]..corner[0] + width].copy_from_slice(part);
        }
    }
}

/// Whether `image` has pixels, and as many as its size says.
fn is_whole(image: &ColorImage) -> bool {
    let [width, height] = image.size;
    width > 0 && height > 0 && width.checked_mul(height) == Some(image.pixels.len())
}

/// All textures by their names.
#[derive(Debug, Default)]
pub struct Textures {
    by_id: HashMap<TextureId, Texture>,
}

impl Textures {
    /// The texture that `id` names.
    pub fn get(&self, id: TextureId) -> Option<&Texture> {
        self.by_id.get(&id)
    }

    /// Makes or replaces a texture, or a part of one, together with its options.
    pub fn set(&mut self, id: TextureId, change: &ImageDelta) {
        let ImageData::Color(image) = &change.image;
        if let Some(corner) = change.pos {
            if let Some(texture) = self.by_id.get_mut(&id) {
                texture.options = change.options;
                texture.set_part(corner, image);
            }
        } else if let Some(texture) = Texture::new(image, change.options) {
            self.by_id.insert(id, texture);
        }
    }

    /// Forgets a texture.
    pub fn free(&mut self, id: TextureId) {
        self.by_id.remove(&id);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ID: TextureId = TextureId::Managed(1);

    fn image(size: [usize; 2], level: u8) -> ColorImage {
        ColorImage::new(size, vec![Color32::from_gray(level); size[0] * size[1]])
    }

    fn textures() -> Textures {
        let mut textures = Textures::default();
        textures.set(ID, &ImageDelta::full(image([4, 3], 10), TextureOptions::LINEAR));
        textures
    }

    fn levels(textures: &Textures) -> Vec<u8> {
        let texture = textures.get(ID).expect("the texture is set");
        (0..3).flat_map(|y| (0..4).map(move |x| texture.texel(x, y)[0])).collect()
    }

    #[test]
    fn a_part_replaces_its_texels_and_the_options() {
        let mut textures = textures();
        textures.set(ID, &ImageDelta::partial([2, 1], image([2, 1], 90), TextureOptions::NEAREST));
        assert_eq!(levels(&textures), [10, 10, 10, 10, 10, 10, 90, 90, 10, 10, 10, 10]);
        assert_eq!(textures.get(ID).map(|t| t.options), Some(TextureOptions::NEAREST));
    }

    #[test]
    fn parts_that_do_not_fit_change_no_texel() {
        let mut textures = textures();
        for corner in [[3, 1], [2, 3], [usize::MAX, 0]] {
            textures.set(ID, &ImageDelta::partial(corner, image([2, 1], 90), TextureOptions::LINEAR));
        }
        let mut torn = image([2, 1], 90);
        torn.pixels.pop();
        textures.set(ID, &ImageDelta::partial([0, 0], torn.clone(), TextureOptions::LINEAR));
        textures.set(ID, &ImageDelta::full(torn, TextureOptions::LINEAR));
        assert_eq!(levels(&textures), [10; 12]);
    }

    #[test]
    fn parts_of_unknown_textures_and_empty_images_make_no_texture() {
        let mut textures = Textures::default();
        textures.set(ID, &ImageDelta::partial([0, 0], image([1, 1], 90), TextureOptions::LINEAR));
        textures.set(ID, &ImageDelta::full(image([0, 5], 90), TextureOptions::LINEAR));
        assert!(textures.get(ID).is_none());
    }

    #[test]
    fn a_whole_image_resizes_and_free_forgets() {
        let mut textures = textures();
        textures.set(ID, &ImageDelta::full(image([1, 2], 7), TextureOptions::LINEAR));
        assert_eq!(textures.get(ID).map(Texture::size), Some([1, 2]));
        textures.free(ID);
        assert!(textures.get(ID).is_none());
    }
}
