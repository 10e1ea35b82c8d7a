//! Error metrics and the references that they are taken against.

pub mod metrics;
pub mod reference;

pub use metrics::{ErrorMetrics, Mask};
pub use reference::Reference;
