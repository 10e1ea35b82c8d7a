//! The egui application: panels, overlays, inspector, and the thread that renders for them.
//!
//! It draws and asks; it holds no rendering code. In a frame, data goes one way: events of the worker come into the
//! [`render::Render`] and the [`gallery::Gallery`]; the panes draw them and edit the session of the
//! [`document::Document`], or ask for an [`actions::Action`]; at the end the document finds out what the edits ask for,
//! and a new job goes to the worker.

pub mod actions;
pub mod analysis;
pub mod app;
pub mod areas;
pub mod bars;
pub mod desk;
pub mod dialogs;
pub mod document;
pub mod edits;
mod exporting;
pub mod files;
pub mod gallery;
pub mod history;
pub mod inspector;
pub mod layout;
mod measuring;
pub mod messages;
pub mod overlays;
pub mod painter;
pub mod panes;
pub mod realtime;
pub mod recent;
pub mod render;
pub mod shot;
pub mod theme;
pub mod viewport;
pub mod views;
pub mod watch;
pub mod window;
pub mod worker;

pub use app::Workbench;
