//! The window without a window: frames are run until nothing is left to be done, and the last is drawn by the CPU
//! painter.

use super::Workbench;
use super::document::Opened;
use super::messages::Gravity;
use super::painter::{MAX_SIDE, Painter};
use egui::{FullOutput, Pos2, RawInput, Rect, vec2};
use image::RgbaImage;
use std::path::PathBuf;
use std::time::Duration;

/// Time between frames while the threads work.
const PATIENCE: Duration = Duration::from_millis(4);
/// Idle frames in a row after which the picture stands: a frame may ask for what the next one shows.
const CALM: u32 = 4;

/// Why there is no picture.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum NoShot {
    /// The caller asked to stop.
    #[error("interrupted")]
    Stopped,
    /// A thread could not be started, or ended by a defect; one line.
    #[error("{0}")]
    Failed(String),
}

/// A workbench that is drawn to an image.
pub struct Shot {
    context: egui::Context,
    painter: Painter,
    workbench: Workbench,
    size: [u32; 2],
    pixels_per_point: f32,
}

impl Shot {
    /// A window of `size` pixels on a session whose scene has been opened; `path` is the session's own file.
    ///
    /// # Errors
    /// If the system has no room for a thread.
    pub fn new(opened: Opened, path: Option<PathBuf>, size: [u32; 2], pixels_per_point: f32) -> Result<Self, NoShot> {
        let context = egui::Context::default();
        let mut workbench = Workbench::new(&context, opened, path).map_err(|e| NoShot::Failed(e.to_string()))?;
        workbench.for_pictures();
        Ok(Self { context, painter: Painter::new(), workbench, size, pixels_per_point })
    }

    /// The workbench, to be told what to show.
    pub fn workbench(&mut self) -> &mut Workbench {
        &mut self.workbench
    }

    /// Runs frames until all passes are rendered and everything that is shown is up to date, then draws the window.
    ///
    /// * `stop`: called after each frame; true gives up.
    ///
    /// # Errors
    /// If `stop` said so, or if the render thread has ended by a defect.
    pub fn take(&mut self, mut stop: impl FnMut(&Workbench) -> bool) -> Result<RgbaImage, NoShot> {
        let mut calm = 0;
        loop {
            let output = self.frame();
            if stop(&self.workbench) {
                return Err(NoShot::Stopped);
            }
            if !self.workbench.render().is_alive() {
                let errors = self.workbench.messages().all().iter().rev().filter(|m| m.gravity == Gravity::Error);
                let why = errors.map(|m| m.text.clone()).next();
                return Err(NoShot::Failed(why.unwrap_or_else(|| "there is no render thread".into())));
            }
            if self.workbench.is_idle() {
                calm += 1;
                if calm == CALM {
                    return Ok(self.paint(output));
                }
            } else {
                calm = 0;
                std::thread::sleep(PATIENCE);
            }
        }
    }

    /// Runs one frame and takes over its textures.
    fn frame(&mut self) -> FullOutput {
        let points = vec2(self.size[0] as f32, self.size[1] as f32) / self.pixels_per_point;
        let mut input = RawInput {
            screen_rect: Some(Rect::from_min_size(Pos2::ZERO, points)),
            max_texture_side: Some(MAX_SIDE as usize),
            ..Default::default()
        };
        if let Some(viewport) = input.viewports.get_mut(&egui::ViewportId::ROOT) {
            viewport.native_pixels_per_point = Some(self.pixels_per_point);
        }
        let workbench = &mut self.workbench;
        let mut output = self.context.run_ui(input, |ui| workbench.ui(ui));
        self.painter.set_textures(&mut output.textures_delta);
        // What a frame frees it does not draw.
        self.painter.free_textures(&mut output.textures_delta);
        output
    }

    fn paint(&self, output: FullOutput) -> RgbaImage {
        let scale = output.pixels_per_point;
        let primitives = self.context.tessellate(output.shapes, scale);
        self.painter.paint(self.size, scale, self.context.global_style().visuals.panel_fill, &primitives)
    }
}
