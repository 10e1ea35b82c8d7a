//! The files of a study: its folder, its tables, its pictures.

pub mod picture;
pub mod report;
pub mod store;

pub use report::StudyReport;
pub use store::Store;
