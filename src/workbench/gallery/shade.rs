//! From radiance to the colours of the screen.

use crate::export::session::Tone;
use crate::export::tone::{SrgbTable, ToneMap};
pub use crate::export::tone::{color_map, luminance_scale};
use crate::math::rgb::Rgb;
use egui::Color32;

/// A tone made ready for many pixels, in the colours of egui.
#[derive(Clone)]
pub struct Shade(ToneMap);

impl Shade {
    /// That of a tone whose exposure is `exposure` stops.
    pub fn new(tone: &Tone, exposure: f32) -> Self {
        Self(ToneMap::new(tone, exposure))
    }

    /// The colour of a radiance.
    pub fn color(&self, table: &SrgbTable, radiance: Rgb) -> Color32 {
        let [r, g, b] = self.0.bytes(table, radiance);
        Color32::from_rgb(r, g, b)
    }
}
