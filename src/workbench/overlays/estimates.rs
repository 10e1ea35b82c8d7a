//! The irradiance estimates of a layer that the camera sees, chosen for drawing.

use super::photons::is_seen;
use crate::estimate::FinalGathering;
use crate::math::hash::mix;
use crate::math::rgb::mean;
use crate::photons::irradiance::pyramid::{ESTIMATE_SPACING, PHOTON_SPACING};
use crate::photons::irradiance::{IrradianceEstimate, PyramidMemory};
use crate::render::Pass;
use glam::Vec3;

/// Estimates that are looked at, at most; what a panel draws is fewer.
const MOST: usize = 40_000;

/// Which estimates of a pass are drawn.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Shown {
    /// Number of the final gathering among those of the plan that have a pyramid.
    pub gathering: usize,
    /// Layer, from 0, the most detailed; those beyond the last stand for it.
    pub layer: usize,
}

/// The final gatherings of a pass that look irradiance up, in the order of its plan.
pub fn with_pyramid(pass: &Pass) -> Vec<FinalGathering> {
    pass.plan.final_gatherings.iter().filter(|f| pass.gathering.pyramid(f).is_some()).copied().collect()
}

/// An estimate to be drawn.
#[derive(Clone, Copy, Debug)]
pub struct VisibleEstimate {
    /// Centre of its disc, metres.
    pub position: Vec3,
    /// Unit normal there.
    pub normal: Vec3,
    /// Mean channel of the irradiance, W/m².
    pub irradiance: f32,
    /// Radius of a disc as large as the surface that it stands for, metres; as published, where all count the same, half of
    /// the distance that estimates keep.
    pub own_radius: f32,
}

/// Estimates that are not hidden, in an order that thins evenly.
#[derive(Clone, Debug, Default)]
pub struct VisibleEstimates {
    /// The estimates.
    pub estimates: Vec<VisibleEstimate>,
    /// Method and settings of the final gathering.
    pub settings: String,
    /// Layer that they are of, and how many there are.
    pub layer: [usize; 2],
    /// Estimates of the layer, hidden ones too.
    pub all: usize,
    /// Radius of the discs, metres.
    pub radius: f32,
    /// Smallest and largest irradiance above 0 that is seen, the mean channel, W/m²; equal if there is none.
    pub range: [f32; 2],
    /// Memory while the pyramid was made.
    pub memory: PyramidMemory,
}

impl VisibleEstimates {
    /// Those of a layer of a pass, as its camera sees them; None without a pyramid.
    pub fn of(pass: &Pass, shown: Shown) -> Option<Self> {
        let all = with_pyramid(pass);
        let f = all.get(shown.gathering).or(all.last())?;
        let pyramid = pass.gathering.pyramid(f)?;
        let count = pyramid.layers().len();
        let index = shown.layer.min(count.checked_sub(1)?);
        let layer = pyramid.layers().get(index)?;
        let spacing = match index.checked_sub(1).and_then(|finer| pyramid.layers().get(finer)) {
            Some(finer) => finer.radius() * ESTIMATE_SPACING,
            None => layer.radius() * PHOTON_SPACING,
        };
        let mut chosen: Vec<(u64, &IrradianceEstimate)> =
            layer.estimates().iter().enumerate().map(|(i, e)| (mix(index as u64, i as u64), e)).collect();
        chosen.sort_unstable_by_key(|c| c.0);
        let estimates: Vec<VisibleEstimate> = chosen
            .into_iter()
            .take(MOST)
            .filter(|(_, e)| is_seen(pass, e.position, e.normal))
            .map(|(_, e)| {
                let own_radius = match f.estimates_as_published {
                    true => spacing / 2.0,
                    false => (e.area / std::f32::consts::PI).sqrt().min(layer.radius()),
                };
                VisibleEstimate { position: e.position, normal: e.normal, irradiance: mean(e.irradiance), own_radius }
            })
            .collect();
        let lit = || estimates.iter().map(|e| e.irradiance).filter(|e| *e > 0.0);
        let high = lit().fold(0.0, f32::max);
        // What is darker than a thousandth of the brightest tells nothing.
        let low = lit().fold(high, f32::min).max(high * 1e-3);
        Some(Self {
            settings: f.to_string(),
            layer: [index, count],
            all: layer.estimates().len(),
            radius: layer.radius(),
            range: [low, high],
            memory: *pyramid.memory(),
            estimates,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::render::{RenderSettings, Renderer, Silent};
    use crate::scene::open;
    use crate::scene::scene_file::RenderFile;

    /// Every estimate that is drawn is one of the layer and lies on what the camera sees there.
    #[test]
    fn estimates_that_are_drawn_are_seen() {
        let scene = open("cornell").expect("built in");
        let flags = RenderFile { photons: Some(5_000), ..Default::default() };
        let settings = RenderSettings::new(&scene, &flags, Some([16, 16]), 1).expect("valid");
        let names = "integrated+classic:rays=2,integrated+ray-differentials:rays=2";
        let estimators = crate::estimate::registry::estimators(names).expect("registered");
        let mut renderer = Renderer::new(scene.into(), settings, estimators);
        renderer.step(&Silent);
        let pass = renderer.last_pass().expect("one");
        let pyramid = pass.gathering.pyramids().next().expect("one");
        for layer in [0, 1, 99] {
            let seen = VisibleEstimates::of(pass, Shown { gathering: 0, layer }).expect("a pyramid");
            assert_eq!(seen.settings, "ray-differentials:rays=2");
            let own = &pyramid.layers()[seen.layer[0]];
            assert_eq!(
                (seen.radius, seen.all, seen.layer[1]),
                (own.radius(), own.estimates().len(), pyramid.layers().len())
            );
            assert!(!seen.estimates.is_empty() && seen.estimates.len() < seen.all && seen.range[0] <= seen.range[1]);
            for e in &seen.estimates {
                assert!(own.estimates().iter().any(|o| o.position == e.position && mean(o.irradiance) == e.irradiance));
                let camera = &pass.scene.camera;
                let [x, y] = camera.project(e.position, [16, 16]).expect("before the camera");
                let (direction, _) = camera.ray(x, y, [16, 16], 0.5);
                let hit = pass.intersector.closest(&crate::trace::Ray { origin: camera.position, direction });
                let at = camera.position + direction * hit.expect("hits").t;
                assert!((at - e.position).length() < 1e-2, "{at} {}", e.position);
            }
        }
    }
}
