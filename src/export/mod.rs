//! Files: images, crops, sheets, tables and reports, written whole or not at all.

pub mod exr_file;
pub mod false_color;
pub mod final_gather;
pub mod names;
pub mod panel_files;
pub mod plot;
pub mod png_file;
pub mod provenance;
pub mod report;
pub mod session;
pub mod sheet;
pub mod stability;
pub mod study;
pub mod text;
pub mod timings;
pub mod tone;
pub mod whole_file;

pub use provenance::Provenance;
