//! What real-time photon mapping is worth: frame rates, renewal, fluctuation, bias.

pub mod run;
pub mod statistics;

pub use run::{RunReport, RunSettings, run};
