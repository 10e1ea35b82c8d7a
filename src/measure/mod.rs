//! Error metrics and the references that they are taken against.

pub mod metrics;
pub mod reference;
pub mod window;

pub use metrics::{ErrorMetrics, Mask};
pub use reference::Reference;
