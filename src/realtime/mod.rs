//! Real-time photon mapping: the pi-engine (Kristensen and Ottosen 2003) on the tracer, lights and maps of the renderer.
//!
//! A frame goes one way: the scene is moved, the photons of this frame are emitted and join those of the frames before,
//! visible vertices are found, their irradiance is estimated, and the picture is blended from it.

pub mod area;
pub mod directions;
pub mod distribution;
pub mod engine;
pub mod estimate;
pub mod first_hits;
pub mod flashlight;
pub mod mesh;
pub mod photon;
pub mod photon_map;
pub mod picture;
pub mod search;
pub mod settings;
#[cfg(test)]
mod tests;
pub mod tracer;
pub mod view;
pub mod world;

pub use engine::{Engine, FrameReport, PhaseSeconds};
pub use settings::RealtimeSettings;
