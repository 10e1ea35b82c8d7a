//! Sets of directions: points of the unit square, which maps of equal area take to sphere, cone or hemisphere.
//!
//! With `u = (1 - z)/2` and `v = φ/2π` a set of the sphere is a set of the square and back, so that every distribution
//! serves every light, and reflections by the cosine-weighted map (Kristensen and Ottosen 2003, eq. 3.10 and section 3.4).

pub mod discrepancy;
mod sets;

use serde::Serialize;

/// How directions are spread.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Distribution {
    /// Random points of the cube, until one lies in the ball (figure 3.5); those about its centre are rejected too, and
    /// what remains is normalised.
    Rejection,
    /// Random height and azimuth.
    Explicit,
    /// The spiral of Saff and Kuijlaars 1997 (section 3.4.1). Figure 3.7 shows it with a bare band about φ = 0; the formula
    /// has none, as a test counts.
    SaffKuijlaars,
    /// A spiral that turns by the golden angle: no recurrence, no points on the poles.
    Spiral,
    /// One random point in each of as many cells of equal area (eq. 3.11).
    Stratified,
    /// Owen-scrambled Sobol points.
    Sobol,
}

impl Distribution {
    /// All of them.
    pub const ALL: [Self; 6] =
        [Self::Rejection, Self::Explicit, Self::SaffKuijlaars, Self::Spiral, Self::Stratified, Self::Sobol];

    /// Their names, in the same order.
    pub const NAMES: &[&str] = &["rejection", "explicit", "saff_kuijlaars", "spiral", "stratified", "sobol"];

    /// Its name.
    pub fn name(self) -> &'static str {
        Self::NAMES[self as usize]
    }

    /// `count` points of the unit square `[0, 1)²`; another `seed` gives another set of the same kind.
    ///
    /// The spirals are one set each for the seed 0; another seed shifts its points.
    pub fn set(self, count: usize, seed: u64) -> Vec<[f32; 2]> {
        match self {
            Self::Rejection => sets::rejection(count, seed),
            Self::Explicit => sets::explicit(count, seed),
            Self::SaffKuijlaars => sets::saff_kuijlaars(count, seed),
            Self::Spiral => sets::spiral(count, seed),
            Self::Stratified => sets::stratified(count, seed),
            Self::Sobol => sets::sobol(count, seed),
        }
    }

    /// Which of `count` points the photon `index` of slot `slot` of `slots` takes, so that the points of a slot are
    /// spread like the whole set: every `slots`-th of a spiral or of cells, one after the other of Sobol points.
    pub fn place(self, index: usize, slot: usize, slots: usize, per_slot: usize) -> usize {
        match self {
            Self::Sobol => slot * per_slot + index,
            _ => index * slots + slot,
        }
    }
}
