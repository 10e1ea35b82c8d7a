//! Photons: emission, paths, storage, and the maps that look them up.

mod arrivals;
pub mod ellipsoid;
pub mod emission;
pub mod emission_group;
pub mod footprint;
pub mod irradiance;
pub mod kd_tree;
pub mod map;
pub mod overlap;
pub mod path;
pub mod photon;
pub mod projection;
pub mod spread;
pub mod together;
pub mod wavefront;

pub use map::{MapPhoton, PhotonMap};
pub use photon::{Photon, PhotonKind, StoredPhoton, StoredPhotons};
