//! Pictures of an egui interface without window or GPU, compared with those in `tests/snapshots/`.
//!
//! egui draws its glyphs with fused multiply-adds where the processor has them. On an x86-64 machine without AVX2 and
//! FMA about one glyph pixel in 100 000 differs by one level, and a picture with such a pixel fails there.

use cusp::workbench::Workbench;
use cusp::workbench::painter::Painter;
use egui::{Context, FullOutput, TexturesDelta, Ui};
use egui_kittest::{Harness, SnapshotOptions, TestRenderer};
use image::RgbaImage;
use std::path::Path;

/// Where the pictures lie, from the root of the repository, which is where cargo runs tests.
const SNAPSHOTS: &str = "tests/snapshots";

/// The CPU painter as kittest asks for it.
#[derive(Default)]
struct PainterRenderer {
    painter: Painter,
    /// Textures to forget after the current frame.
    freed: TexturesDelta,
}

impl TestRenderer for PainterRenderer {
    /// kittest paints a frame after this call, if at all: what the frame frees has to stay until the next call.
    fn handle_delta(&mut self, delta: &mut TexturesDelta) {
        self.painter.free_textures(&mut self.freed);
        self.painter.set_textures(delta);
        std::mem::swap(&mut self.freed, delta);
    }

    fn render(&mut self, context: &Context, output: &FullOutput) -> Result<RgbaImage, String> {
        let scale = output.pixels_per_point;
        let size = context.content_rect().size() * scale;
        let primitives = context.tessellate(output.shapes.clone(), scale);
        let ground = context.global_style().visuals.panel_fill;
        Ok(self.painter.paint([size.x.round() as u32, size.y.round() as u32], scale, ground, &primitives))
    }
}

impl Drop for PainterRenderer {
    fn drop(&mut self) {
        // egui asserts that no change to textures is lost.
        self.freed.clear();
    }
}

/// A harness around `ui`, in a window of `size` points.
pub fn harness<'a>(size: [f32; 2], pixels_per_point: f32, ui: impl FnMut(&mut Ui) + 'a) -> Harness<'a> {
    Harness::builder()
        .with_size(size)
        .with_pixels_per_point(pixels_per_point)
        .with_options(SnapshotOptions::new().threshold(0.0).max_failed_pixels(0).output_path(SNAPSHOTS))
        .renderer(PainterRenderer::default())
        .build_ui(ui)
}

/// A harness around the workbench, which fills a window of `size` points.
pub fn app(
    size: [f32; 2],
    pixels_per_point: f32,
    build: impl FnOnce(&Context) -> Workbench,
) -> Harness<'static, Workbench> {
    Harness::builder()
        .with_size(size)
        .with_pixels_per_point(pixels_per_point)
        .with_options(SnapshotOptions::new().threshold(0.0).max_failed_pixels(0).output_path(SNAPSHOTS))
        .renderer(PainterRenderer::default())
        .build_eframe(|creation| build(&creation.egui_ctx))
}

/// Compares the last frame with `tests/snapshots/{name}.png`, bit for bit.
///
/// `UPDATE_SNAPSHOTS=force cargo test --test workbench` writes the pictures anew; look at them before they are kept.
pub fn check<State>(harness: &mut Harness<'_, State>, name: &str) {
    if let Err(error) = harness.try_snapshot(name) {
        panic!("{error}");
    }
    // kittest passes over pixels that differ where either picture looks antialiased, at any threshold.
    let path = Path::new(SNAPSHOTS).join(format!("{name}.png"));
    let kept = image::open(&path).expect("kittest has compared with it").to_rgba8();
    let drawn = harness.render().expect("the painter does not fail");
    let differs = |(x, y, pixel): (u32, u32, &image::Rgba<u8>)| (kept.get_pixel(x, y) != pixel).then_some([x, y]);
    let differing: Vec<_> = drawn.enumerate_pixels().filter_map(differs).collect();
    if let Some(first) = differing.first() {
        let shown = path.with_extension("new.png");
        drawn.save(&shown).expect("the folder of pictures can be written to");
        panic!("{name}: {} pixels differ, the first at {first:?}; see {}", differing.len(), shown.display());
    }
}
