//! Rendering: settings, plan, photon pass, view pass, film, and the progressive renderer that drives them.

mod cells;
pub mod change;
pub mod error_estimate;
pub mod evidence;
pub mod film;
pub mod flat_pixels;
pub mod heatmap;
pub mod inspect;
pub mod memory;
pub mod pass;
pub mod photon_pass;
pub mod plan;
pub mod renderer;
pub mod settings;
pub mod stats;
pub mod stop;
pub mod tiles;
pub mod totals;
mod turns;
pub mod view;
pub mod view_pass;
pub mod watch;

pub use error_estimate::ErrorEstimate;
pub use film::Film;
pub use pass::Pass;
pub use plan::Plan;
pub use renderer::{Renderer, Step};
pub use settings::{Gather, LightPart, RenderSettings};
pub use stop::{StopRule, StoppedBy};
pub use watch::{Silent, Watch};
