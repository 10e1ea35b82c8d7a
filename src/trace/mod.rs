//! Rays, ray differentials, and the intersector.

pub mod differential;
pub mod intersector;
pub mod scatter;
pub mod surface;
pub mod triangle;
pub mod view_ray;

pub use differential::Differential;
pub use intersector::{Hit, Intersector, Ray};
pub use surface::Surface;
