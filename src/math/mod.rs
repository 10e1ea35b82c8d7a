//! Colour, frames, sampling sequences and deterministic elementary functions.

pub mod angle;
pub mod eights;
pub mod elementary;
pub mod frame;
pub mod hash;
pub mod lanes;
pub mod octahedron;
pub mod rgb;
pub mod sequence;
