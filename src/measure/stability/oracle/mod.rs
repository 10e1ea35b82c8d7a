//! Oracles that several cases share: f64, and by ways that the renderer does not take.

pub mod footprint;
pub mod quadrature;
pub mod random;
pub mod scan;
