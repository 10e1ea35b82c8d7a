//! From radiance to the colours of the screen.

use crate::export::session::{Curve, Tone};
use crate::export::tone::{SrgbTable, reinhard};
use crate::math::rgb::Rgb;
use egui::Color32;

/// A tone made ready for many pixels.
#[derive(Clone, PartialEq)]
pub struct Shade {
    factor: f32,
    offset: f32,
    curve: Curve,
}

impl Shade {
    /// That of a tone whose exposure is `exposure` stops.
    pub fn new(tone: &Tone, exposure: f32) -> Self {
        Self { factor: libm::exp2f(exposure), offset: tone.offset, curve: tone.curve }
    }

    /// The colour of a radiance.
    pub fn color(&self, table: &SrgbTable, radiance: Rgb) -> Color32 {
        let mut x = radiance * self.factor + Rgb::splat(self.offset);
        if self.curve == Curve::Reinhard {
            x = reinhard(x);
        }
        let byte = |v: f32| match self.curve {
            Curve::Srgb | Curve::Reinhard => table.byte(v),
            Curve::Gamma => (libm::powf(v.clamp(0.0, 1.0), 1.0 / 2.2) * 255.0 + 0.5) as u8,
            Curve::Linear => (v.clamp(0.0, 1.0) * 255.0 + 0.5) as u8,
        };
        Color32::from_rgb(byte(x.x), byte(x.y), byte(x.z))
    }
}
