//! The flashlight of figure 6.9: a spot light that is carried beside the camera.

use crate::math::rgb::Rgb;
use crate::scene::{Camera, Light, Scene};
use glam::Vec3;

/// Full angle of its cone, degrees.
const CONE: f64 = 50.0;

/// How far to the right of the eye and below it the light is held, over the scene's radius: a cone from the eye itself
/// would be seen as nothing but the rim of the picture.
const HELD: f32 = 0.01;

/// Flux where a scene has no light to take it from, W/m² of the square of its radius.
const FLUX: f32 = 4.0;

/// The flashlight at a camera: it shines along the view with the flux of all lights of the scene, white.
pub fn light(scene: &Scene, camera: &Camera) -> Light {
    let [right, up, forward] = camera.frame;
    let flux = scene.total_flux() as f32;
    let power = if flux > 0.0 && flux.is_finite() { flux } else { FLUX * scene.radius * scene.radius };
    Light::Spot {
        position: camera.position + (right - up) * (HELD * scene.radius),
        direction: forward,
        cos_half: libm::cos((CONE / 2.0).to_radians()),
        falloff: 0.0,
        power: Rgb::splat(power),
    }
}

/// Points on the rim of a spot light's cone at a distance from its apex, metres; none for other lights.
pub fn cone_rim(light: &Light, distance: f32, count: u32) -> Vec<Vec3> {
    let Light::Spot { position, direction, cos_half, .. } = light else { return Vec::new() };
    (0..count)
        .map(|i| {
            let turn = std::f32::consts::TAU * i as f32 / count as f32;
            *position + crate::math::frame::direction(*direction, *cos_half as f32, turn) * distance
        })
        .collect()
}
