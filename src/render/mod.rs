//! Rendering: settings, plan, photon pass, view pass, film, and the progressive renderer that drives them.

pub mod direct;
pub mod film;
pub mod photon_pass;
pub mod plan;
pub mod renderer;
pub mod settings;
pub mod stats;
pub mod tiles;
pub mod view;
pub mod view_pass;

pub use film::Film;
pub use plan::Plan;
pub use renderer::Renderer;
pub use settings::{Gather, LightPart, RenderSettings};
