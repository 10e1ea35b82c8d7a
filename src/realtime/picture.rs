//! Blending irradiance with texture (section 3.3.2).

use crate::math::rgb::Rgb;
use crate::realtime::settings::Blending;
use std::f32::consts::PI;

/// Radiance of a pixel, W/(m² sr), from the irradiance (W/m²) and the reflectance of what it shows.
///
/// `Multiply` (eq. 3.9) is that of a diffuse surface, `ρ E/π`. `Offset` (eq. 3.8) takes `C = exposure E/π` for the light
/// of a pixel in 0 to 1 and shows `2C - 1 + ρ`, held in 0 to 1, on a screen of that exposure: it brightens what a
/// texture has as black, and whitens what is lit by more than 0.5.
#[inline]
pub fn blend(blending: Blending, irradiance: Rgb, reflectance: Rgb, exposure: f32) -> Rgb {
    let light = irradiance / PI;
    match blending {
        Blending::Multiply => light * reflectance,
        Blending::Offset => {
            let shown = (light * exposure).clamp(Rgb::ZERO, Rgb::ONE) * 2.0 - Rgb::ONE + reflectance;
            let exposure = if exposure > 0.0 { exposure } else { 1.0 };
            shown.clamp(Rgb::ZERO, Rgb::ONE) / exposure
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn offset_shows_the_texture_at_half_and_black_and_white_at_the_ends() {
        let texture = Rgb::new(0.2, 0.5, 0.9);
        let shown = |c: f32, t: Rgb| blend(Blending::Offset, Rgb::splat(c * PI / 4.0), t, 4.0) * 4.0;
        assert!((shown(0.5, texture) - texture).length() < 1e-6);
        assert_eq!(shown(0.0, Rgb::ONE), Rgb::ZERO);
        assert_eq!(shown(1.0, Rgb::ZERO), Rgb::ONE);
        assert_eq!(shown(7.0, texture), Rgb::ONE);
        assert_eq!(blend(Blending::Multiply, Rgb::splat(PI), texture, 4.0), texture);
    }
}
