//! Cusp: a workbench for photon differentials.
//!
//! Photons and view rays carry footprints through a scene; radiance estimators turn the same photons into images,
//! with the error that each leaves and the time that it took. Data goes one way:
//! `Scene → Plan → PhotonPass → PhotonMaps → ViewPass (tiles) → Film per estimator → measure / export`.
//! A module uses those above it in this list, never those below.

pub mod estimate;
pub mod final_gather;
pub mod math;
pub mod photons;
pub mod realtime;
pub mod render;
pub mod scene;
pub mod trace;

pub mod cli;
pub mod export;
pub mod measure;
pub mod workbench;
