//! The CPU painter: what egui tessellated, drawn to an image without window, GPU or system package.
//!
//! It follows the contract of egui's OpenGL backend (`egui_glow` 0.37): colours are multiplied and blended in gamma
//! space with premultiplied alpha, scissor rectangles are rounded to whole pixels, a pixel belongs to a triangle if
//! its centre does. Coverage is integer arithmetic, shading is plain f32 and f64 in a fixed order, so the same
//! primitives and textures give the same bits on every machine.

mod canvas;
mod clip;
mod coverage;
mod mesh;
mod plane;
mod sampler;
mod textures;

#[cfg(test)]
mod tests;

use canvas::Canvas;
use clip::Scissor;
use egui::epaint::Primitive;
use egui::{ClippedPrimitive, Color32, TexturesDelta};
use image::RgbaImage;
use textures::Textures;

/// Largest width and height of an image in pixels; larger sizes are cut.
pub const MAX_SIDE: u32 = 16_384;

/// Draws what egui tessellated, on the CPU.
///
/// A frame is: [`Painter::set_textures`], [`Painter::paint`], [`Painter::free_textures`].
#[derive(Debug, Default)]
pub struct Painter {
    textures: Textures,
}

impl Painter {
    /// A painter without textures.
    pub fn new() -> Self {
        Self::default()
    }

    /// Takes over new and changed textures; to be called before the frame is painted. Empties `delta.set`.
    ///
    /// An image whose pixels do not match its size, a part that leaves its texture, and a part of a texture that does
    /// not exist change nothing.
    pub fn set_textures(&mut self, delta: &mut TexturesDelta) {
        for (id, changes) in delta.set.drain() {
            for change in changes {
                self.textures.set(id, &change);
            }
        }
    }

    /// Forgets the textures that egui freed; to be called after the frame is painted. Empties `delta.free`.
    pub fn free_textures(&mut self, delta: &mut TexturesDelta) {
        for id in delta.free.drain() {
            self.textures.free(id);
        }
    }

    /// Paints `primitives`, in their order, over `clear`.
    ///
    /// * `size`: width and height in physical pixels, each cut to [`MAX_SIDE`].
    /// * `pixels_per_point`: physical pixels per egui point, the value that the tessellation was made with.
    /// * `clear`: the background. The image is opaque if this is.
    ///
    /// Returns gamma-space RGBA with straight alpha, row 0 on top. Left out are meshes without a texture, paint
    /// callbacks, and triangles with a vertex that is not finite.
    pub fn paint(
        &self,
        size: [u32; 2],
        pixels_per_point: f32,
        clear: Color32,
        primitives: &[ClippedPrimitive],
    ) -> RgbaImage {
        let size = size.map(|side| side.min(MAX_SIDE));
        let mut canvas = Canvas::new(size, clear);
        for ClippedPrimitive { clip_rect, primitive } in primitives {
            let Primitive::Mesh(mesh) = primitive else { continue };
            let Some(texture) = self.textures.get(mesh.texture_id) else { continue };
            let scissor = Scissor::new(*clip_rect, pixels_per_point, size);
            mesh::draw(&mut canvas, &scissor, pixels_per_point, mesh, texture);
        }
        canvas.into_image()
    }
}
