//! Error metrics and the references that they are taken against.

pub mod difference;
pub mod exr_header;
pub mod flip;
pub mod image_file;
pub mod metrics;
pub mod realtime;
pub mod reference;
pub mod stability;
pub mod study;
pub mod tracer;
pub mod trimmed;
pub mod truth;
pub mod window;

pub use difference::Difference;
pub use metrics::{ErrorMetrics, Mask};
pub use reference::{Noise, Reference};
