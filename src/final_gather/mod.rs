//! Final gathering: global light at a view hit by one more bounce of many rays. Classic, by precomputed irradiance, and
//! with ray differentials (Gjøl, Larsen and Christensen, *Final Gathering using Ray Differentials*).

pub mod directions;
pub mod gather_ray;
pub mod gatherer;
pub mod lookup;
pub mod maps;

#[cfg(test)]
mod tests;

pub use gather_ray::{GatherHit, GatherPoint, NoHit};
pub use gatherer::{FinalGatherer, GatherCounts, GatherRecorder, GatherScratch, RecordedRay, Unrecorded};
pub use lookup::Used;
pub use maps::GatherMaps;
