//! From radiance to the colours of the screen.

use crate::export::false_color::{ColorMap, FalseColor, ValueRange};
use crate::export::session::{Curve, Tone};
use crate::export::tone::{SrgbTable, reinhard};
use crate::math::rgb::{Rgb, luminance};
use egui::Color32;

/// The colour map of that name; the first for a name that is none.
pub fn color_map(name: Option<&str>) -> ColorMap {
    ColorMap::ALL.into_iter().find(|m| Some(m.name()) == name).unwrap_or_default()
}

/// The scale of false colour for luminance: the tone's range, or from 0 to what is white at that exposure.
pub fn luminance_scale(tone: &Tone, exposure: f32) -> Option<FalseColor> {
    let map = color_map(Some(tone.false_color.as_deref()?));
    let white = libm::exp2f(-exposure);
    let range = tone.range.filter(|_| !tone.auto);
    Some(FalseColor::new(map, range.map_or(ValueRange::up_to(white), |[low, high]| ValueRange { low, high })))
}

/// A tone made ready for many pixels.
#[derive(Clone)]
pub struct Shade {
    scale: Option<FalseColor>,
    factor: f32,
    offset: f32,
    curve: Curve,
}

impl Shade {
    /// That of a tone whose exposure is `exposure` stops.
    pub fn new(tone: &Tone, exposure: f32) -> Self {
        Self {
            scale: luminance_scale(tone, exposure),
            factor: libm::exp2f(exposure),
            offset: tone.offset,
            curve: tone.curve,
        }
    }

    /// The colour of a radiance.
    pub fn color(&self, table: &SrgbTable, radiance: Rgb) -> Color32 {
        if let Some(scale) = &self.scale {
            let [r, g, b] = scale.color(luminance(radiance));
            return Color32::from_rgb(r, g, b);
        }
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
