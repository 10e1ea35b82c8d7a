//! Oracles that several cases share: f64, and by ways that the renderer does not take.

pub mod convex;
pub mod dual;
pub mod footprint;
pub mod placed;
pub mod quadrature;
pub mod random;
pub mod scan;
pub mod svd;
