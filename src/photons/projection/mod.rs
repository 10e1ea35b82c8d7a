//! Projection maps: which of a light's photons can meet a specular surface at all (Jensen 2001; Pedersen 2011, section
//! 2.2.2).
//!
//! A photon leaves its light by four numbers in `[0, 1)`, equally likely wherever they lie. A map divides their cube
//! into cells of one size and marks every cell from which some photon may meet a specular surface, never too few. A
//! photon that is drawn from the marked cells alone carries their share of the light's power and of its directions, so
//! that the estimate stays unbiased whatever the map marks too much.

mod cells;
mod marking;
mod voxels;

pub use cells::Cells;

use crate::math::rgb::mean;
use crate::scene::{Light, Scene};
use glam::DVec3;
use marking::{Marking, Marks};
use rayon::prelude::*;

/// Surfaces that one thread marks at a time.
const CHUNK: usize = 256;
/// More surfaces than this are marked by the cells of a grid that they lie in.
const MOST_TRIANGLES: usize = 20_000;

/// The cells of all lights.
#[derive(Clone, Debug)]
pub struct ProjectionMap {
    lights: Vec<Cells>,
    share: f64,
}

impl ProjectionMap {
    /// The map of a scene; None where no surface is specular or no light has power.
    pub fn new(scene: &Scene) -> Option<Self> {
        let g = &scene.geometry;
        let mut specular: Vec<usize> =
            (0..g.primitive_count()).filter(|&i| scene.materials[g.material(i)].is_specular()).collect();
        if specular.is_empty() {
            return None;
        }
        let corners = |i: usize| g.corners(i).map(|p| p.as_dvec3());
        let is_triangle = |i: &usize| *i < g.triangles.len();
        let balls: Vec<(DVec3, f64)> = if specular.len() > MOST_TRIANGLES {
            let triangles = specular.len() - specular.iter().rev().take_while(|i| !is_triangle(i)).count();
            voxels::balls(&corners, &specular.drain(..triangles).collect::<Vec<_>>())
        } else {
            Vec::new()
        };
        let mark_all = |marking: &Marking| {
            let one = |bits: &mut Marks, i: usize| match g.spheres.get(i.wrapping_sub(g.triangles.len())) {
                None => marking.triangle(corners(i), bits),
                Some(s) => marking.ball(s.center.as_dvec3(), f64::from(s.radius), bits),
            };
            let primitives = specular.par_chunks(CHUNK).map(|chunk| {
                let mut bits = marking.empty();
                chunk.iter().for_each(|&i| one(&mut bits, i));
                bits.done()
            });
            let cells = balls.par_chunks(CHUNK).map(|chunk| {
                let mut bits = marking.empty();
                chunk.iter().for_each(|(center, radius)| marking.ball(*center, *radius, &mut bits));
                bits.done()
            });
            primitives.chain(cells).reduce(|| marking.empty(), |a, b| a.or(&b))
        };
        let surfaces = specular.len() + balls.len();
        let of_light = |light: &Light| match Marking::new(light, surfaces, f64::from(scene.radius)) {
            Some(marking) => Cells::marked(marking.counts(), &marking.finished(mark_all(&marking))),
            None => Cells::whole(),
        };
        let lights: Vec<Cells> = scene.lights.iter().map(of_light).collect();
        let flux: Vec<f64> = scene.lights.iter().map(|l| f64::from(mean(l.flux()))).collect();
        let aimed: f64 = flux.iter().zip(&lights).map(|(f, c)| f * c.share()).sum();
        let share = aimed / flux.iter().sum::<f64>();
        share.is_finite().then_some(Self { lights, share })
    }

    /// The cells of a light.
    pub fn light(&self, light: usize) -> &Cells {
        &self.lights[light]
    }

    /// Share of the lights' power that leaves through marked cells, in `[0, 1]`.
    pub fn share(&self) -> f64 {
        self.share
    }
}

/// Centre and radius of a ball around a triangle.
fn ball_around(corners: [DVec3; 3]) -> (DVec3, f64) {
    let center = (corners[0] + corners[1] + corners[2]) / 3.0;
    let farthest = corners.iter().map(|p| p.distance_squared(center)).fold(0.0, f64::max);
    (center, farthest.sqrt())
}

#[cfg(test)]
mod tests;
