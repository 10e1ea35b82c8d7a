//! The photons that the camera sees, chosen for drawing.

use crate::math::hash::mix;
use crate::math::rgb::{Rgb, mean};
use crate::photons::{MapPhoton, PhotonKind};
use crate::render::Pass;
use crate::trace::Ray;
use egui::Color32;
use glam::Vec3;

/// Photons that are looked at, at most; what a panel draws is fewer.
const MOST: usize = 40_000;

/// A photon to be drawn.
#[derive(Clone, Copy, Debug)]
pub struct VisiblePhoton {
    /// Its kind.
    pub kind: PhotonKind,
    /// Where it lies, metres.
    pub position: Vec3,
    /// Half-axes of its footprint as in the map, metres.
    pub axes: [Vec3; 2],
    /// Colour of its power.
    pub color: Color32,
}

/// Photons that are not hidden, in an order that thins evenly.
#[derive(Clone, Debug, Default)]
pub struct VisiblePhotons {
    /// The photons.
    pub photons: Vec<VisiblePhoton>,
}

impl VisiblePhotons {
    /// Those of a pass, as its camera sees them.
    pub fn of(pass: &Pass) -> Self {
        let mut chosen: Vec<(u64, PhotonKind, &MapPhoton)> = Vec::new();
        for (kind, map) in pass.maps.by_kind() {
            let photons = map.photons();
            // Numbers that have nothing to do with a place make any first part an even sample.
            chosen.extend(photons.iter().enumerate().map(|(i, p)| (mix(kind as u64, i as u64), kind, p)));
        }
        chosen.sort_unstable_by_key(|c| c.0);
        let brightest = chosen.iter().map(|c| mean(c.2.power)).fold(0.0, f32::max);
        let photons =
            chosen.into_iter().take(MOST).filter(|c| is_seen(pass, c.2.position, c.2.normal)).map(|(_, kind, p)| {
                VisiblePhoton { kind, position: p.position, axes: p.axes(), color: color(p.power, brightest) }
            });
        Self { photons: photons.collect() }
    }
}

/// Whether nothing stands between the camera and a place of a surface of unit `normal`, which faces the camera.
pub fn is_seen(pass: &Pass, position: Vec3, normal: Vec3) -> bool {
    let to = position - pass.scene.camera.position;
    let distance = to.length();
    if to.dot(normal) >= 0.0 || distance <= 0.0 {
        return false;
    }
    let ray = Ray { origin: pass.scene.camera.position, direction: to / distance };
    !pass.intersector.any(&ray, distance * (1.0 - 1e-4) - 8.0 * pass.scene.resolution())
}

/// The power's own hue, never so dark that it can't be seen.
fn color(power: Rgb, brightest: f32) -> Color32 {
    let most = power.max_element();
    if most <= 0.0 || brightest <= 0.0 {
        return Color32::from_gray(120);
    }
    let strength = 0.45 + 0.55 * (mean(power) / brightest).sqrt();
    let [r, g, b] = (power / most * strength).to_array().map(|x| (x * 255.0) as u8);
    Color32::from_rgb(r, g, b)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::render::{RenderSettings, Renderer, Silent};
    use crate::scene::open;
    use crate::scene::scene_file::RenderFile;

    /// Photons behind the ring's walls are not drawn, those on the open floor are, as they are stored.
    #[test]
    fn hidden_photons_are_left_out() {
        let scene = open("ring").expect("built in");
        let flags = RenderFile { photons: Some(20_000), ..Default::default() };
        let settings = RenderSettings::new(&scene, &flags, Some([16, 16]), 1).expect("valid");
        let estimators = crate::estimate::registry::estimators("regular").expect("registered");
        let mut renderer = Renderer::new(scene.into(), settings, estimators);
        renderer.step(&Silent);
        let pass = renderer.last_pass().expect("one");
        let seen = VisiblePhotons::of(pass);
        let all = pass.maps.caustic.as_ref().expect("planned").photons();
        assert!(!seen.photons.is_empty() && seen.photons.len() < all.len());
        for p in &seen.photons {
            assert!(all.iter().any(|m| m.position == p.position && m.axes() == p.axes));
            let [x, y] = pass.scene.camera.project(p.position, [16, 16]).expect("before the camera");
            // A ray through that place meets the photon's surface there.
            let (direction, _) = pass.scene.camera.ray(x, y, [16, 16], 0.5);
            let hit = pass.intersector.closest(&Ray { origin: pass.scene.camera.position, direction }).expect("hits");
            let at = pass.scene.camera.position + direction * hit.t;
            assert!((at - p.position).length() < 1e-2, "{at} {}", p.position);
        }
    }
}
