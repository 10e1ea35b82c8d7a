//! Drawings on top of the images, each with its key and legend.

pub mod estimates;
pub mod photons;

use egui::Key;

/// An overlay on offer.
pub struct Entry {
    /// Its name in sessions.
    pub id: &'static str,
    /// Its name in menus.
    pub title: &'static str,
    /// What it shows.
    pub legend: &'static str,
    /// Its key.
    pub key: Key,
}

/// All overlays.
pub const ALL: &[Entry] = &[
    Entry {
        id: "footprint",
        title: "View footprint",
        legend: "the view footprint of the pixel under the pointer, on the surface that it sees",
        key: Key::V,
    },
    Entry {
        id: "photons",
        title: "Photon differentials",
        legend: "photon differentials as ellipses on their surfaces: caustic solid, global dashed, coloured by power",
        key: Key::P,
    },
    Entry {
        id: "samples",
        title: "Sampling points",
        legend: "sampling points of the pixel under the pointer: green inside a photon's range, red outside",
        key: Key::N,
    },
    Entry {
        id: "polygons",
        title: "Clipped polygons",
        legend: "the parts of the view footprint that photons cover, with their centroids",
        key: Key::O,
    },
    Entry { id: "tiles", title: "Tile borders", legend: "tiles with the time that each took", key: Key::T },
    Entry {
        id: "path",
        title: "View path",
        legend: "the view ray of the pinned pixel, from surface to surface",
        key: Key::R,
    },
    Entry {
        id: "gather_rays",
        title: "Gather rays",
        legend: "where the gather rays of the pinned pixel end: their footprints, coloured by what they bring",
        key: Key::H,
    },
    Entry {
        id: "irradiance",
        title: "Irradiance estimates",
        legend: "a layer of the irradiance pyramid: its discs, and the part that each stands for, coloured by irradiance",
        key: Key::I,
    },
];
