//! What real-time photon mapping is worth: frame rates, renewal, fluctuation, bias.

pub mod bias;
pub mod fluctuation;
pub mod run;
pub mod statistics;
pub mod tables;

pub use run::{RunReport, RunSettings, run};
