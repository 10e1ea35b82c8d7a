//! The egui application: panels, overlays, inspector, and the thread that renders for them.
//!
//! It draws and asks; it holds no rendering code.

pub mod painter;
pub mod worker;
