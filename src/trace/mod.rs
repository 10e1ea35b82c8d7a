//! Rays, ray differentials, the intersector, and direct light by shadow rays.

pub mod builder;
pub mod differential;
pub mod direct;
mod grouping;
mod interleaved;
pub mod intersector;
pub mod packet;
pub mod scatter;
pub mod sphere;
pub mod surface;
pub mod traversal;
pub mod triangle;
pub mod view_ray;

pub use differential::Differential;
pub use intersector::{Hit, Intersector, Ray};
pub use surface::Surface;
