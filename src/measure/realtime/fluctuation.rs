//! Fluctuation of the irradiance of vertices while one object moves, with and without coherent random numbers.

use crate::math::rgb::mean;
use crate::realtime::{Engine, RealtimeSettings};
use crate::scene::Scene;
use serde::Serialize;
use std::sync::Arc;

/// How a fluctuation is measured.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FluctuationSettings {
    /// Frames that are compared, each with the one before.
    pub frames: u64,
    /// Seconds of the scene from one frame to the next.
    pub time_step: f64,
    /// Times of many more photons by which the object's influence is told.
    pub many: u32,
    /// Change of a vertex's irradiance, over itself, from which on the object has an influence on it.
    pub influence: f64,
}

/// Fluctuations with and without coherent numbers: mean change from frame to frame over the mean irradiance.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Fluctuation {
    /// Vertices that were looked at.
    pub vertices: usize,
    /// Of these, vertices on which the object has no influence.
    pub away: usize,
    /// With coherent numbers, over all vertices and over those away from the object's influence.
    pub coherent: [f64; 2],
    /// The same with numbers of each frame's own.
    pub incoherent: [f64; 2],
}

impl Fluctuation {
    /// By which share coherent numbers lower the fluctuation, over all vertices and away from the influence.
    pub fn reduction(&self) -> [f64; 2] {
        [0, 1].map(|i| if self.incoherent[i] > 0.0 { 1.0 - self.coherent[i] / self.incoherent[i] } else { 0.0 })
    }
}

/// Measures the fluctuation of all vertices of the mesh's fronts that do not move themselves. Lights stand still.
///
/// Where the object has an influence is told by an engine apart, with many more photons and coherent numbers at the same
/// times: the largest change of a vertex's irradiance between any two of a few moments.
pub fn fluctuation(scene: &Arc<Scene>, settings: &RealtimeSettings, how: &FluctuationSettings) -> Fluctuation {
    let scene = &lights_at_rest(scene);
    let many = RealtimeSettings {
        coherent: true,
        photons_from_light: settings.photons_from_light.saturating_mul(how.many),
        max_search_count: settings.max_search_count.saturating_mul(how.many),
        ..settings.clone()
    };
    let mut engine = Engine::new(scene, many);
    let vertices: Vec<(u32, bool)> = (0u32..)
        .zip(&engine.mesh().vertices)
        .filter(|(_, v)| v.motion == crate::scene::geometry::NONE)
        .map(|(i, _)| (i, false))
        .collect();
    let frames = u64::from(settings.accumulation_frames);
    let span = how.frames as f64 * how.time_step;
    let mut ends: Vec<(f32, f32)> = vec![(f32::INFINITY, 0.0); vertices.len()];
    for moment in 0..MOMENTS {
        let time = span * f64::from(moment) / f64::from(MOMENTS - 1);
        (0..frames).for_each(|_| engine.step(time, &scene.camera));
        for (e, i) in ends.iter_mut().zip(engine.irradiance_at(&vertices)) {
            *e = (e.0.min(mean(i)), e.1.max(mean(i)));
        }
    }
    drop(engine);
    let whole = ends.iter().map(|e| f64::from(e.1)).sum::<f64>() / ends.len().max(1) as f64;
    let away: Vec<bool> = ends
        .iter()
        // Where it is dark a change of nothing is none.
        .map(|(low, high)| f64::from(high - low) <= how.influence * f64::from(*high).max(DARK * whole))
        .collect();
    let of = |coherent: bool| {
        let mut engine = Engine::new(scene, RealtimeSettings { coherent, ..settings.clone() });
        (0..frames).for_each(|_| engine.step(0.0, &scene.camera));
        let mut before = engine.irradiance_at(&vertices);
        let mut sums = [[0.0f64; 2]; 2];
        for f in 1..=how.frames {
            engine.step(f as f64 * how.time_step, &scene.camera);
            let now = engine.irradiance_at(&vertices);
            for ((a, b), &far) in before.iter().zip(&now).zip(&away) {
                let change = f64::from(mean((*b - *a).abs()));
                let level = f64::from(mean(*b));
                for (sum, counts) in sums.iter_mut().zip([true, far]) {
                    if counts {
                        sum[0] += change;
                        sum[1] += level;
                    }
                }
            }
            before = now;
        }
        sums.map(|[change, level]| if level > 0.0 { change / level } else { 0.0 })
    };
    Fluctuation {
        vertices: vertices.len(),
        away: away.iter().filter(|a| **a).count(),
        coherent: of(true),
        incoherent: of(false),
    }
}

/// Moments of the object's way by which its influence is told.
const MOMENTS: u32 = 7;

/// Part of the mean of all vertices below which an irradiance counts as that much.
const DARK: f64 = 0.02;

/// The scene with lights that do not move.
fn lights_at_rest(scene: &Scene) -> Arc<Scene> {
    let mut scene = scene.clone();
    scene.motions.iter_mut().for_each(|m| m.lights.clear());
    scene.motions.retain(|m| !m.triangles.is_empty() || !m.spheres.is_empty());
    Arc::new(scene)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::realtime::settings::set;
    use crate::scene::open;
    use crate::scene::scene_file::RealtimeFile;

    /// While the box moves in the large room, coherent numbers take nine tenths of the fluctuation away where it has no
    /// influence.
    #[test]
    fn coherent_numbers_take_the_fluctuation_away() {
        let scene = Arc::new(open("rooms").expect("built in"));
        let mut table = RealtimeFile::default();
        for text in ["mesh_refinement=1500", "photons_from_light=150", "diffuse_reflections=6", "accumulation_frames=6"]
        {
            set(&mut table, text).expect(text);
        }
        let settings = RealtimeSettings::new(&scene, &table, 1).expect("valid");
        let how = FluctuationSettings { frames: 12, time_step: 1.0 / 30.0, many: 40, influence: 0.02 };
        let found = fluctuation(&scene, &settings, &how);
        assert!(found.away * 10 > found.vertices, "{found:?}");
        let [all, away] = found.reduction();
        assert!(away > 0.9 && away > all && all > 0.3, "{found:?}");
    }
}
