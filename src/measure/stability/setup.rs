//! Scenes and renders of cases.

use super::Outcome;
use crate::estimate::registry::estimators;
use crate::render::watch::Silent;
use crate::render::{RenderSettings, Renderer};
use crate::scene::scene_file::RenderFile;
use crate::scene::source::Files;
use crate::scene::{Scene, SceneError, load, source};
use std::path::Path;
use std::sync::Arc;

/// A scene from the text of a scene file.
///
/// # Errors
/// Anything wrong in it.
pub fn scene(text: &str) -> Result<Scene, SceneError> {
    load::scene_from_toml(Path::new("case.toml"), text, &Files::BuiltIn(&[]))
}

/// A render of `scene` with the settings as `change` leaves them, after `passes` passes.
///
/// # Errors
/// One line: a setting or an estimator that can't be, which would be a defect of the case.
pub fn rendered(
    scene: &Arc<Scene>,
    size: [u32; 2],
    names: &str,
    passes: u32,
    change: impl FnOnce(&mut RenderSettings),
) -> Result<Renderer, String> {
    let mut settings = RenderSettings::new(scene, &RenderFile::default(), Some(size), 0).map_err(|e| e.to_string())?;
    change(&mut settings);
    let estimators = estimators(names).map_err(|e| e.to_string())?;
    let mut renderer = Renderer::new(Arc::clone(scene), settings, estimators);
    for _ in 0..passes {
        renderer.step(&Silent);
    }
    Ok(renderer)
}

/// The outcome that `run` leaves; what it could not do fails the case.
pub fn outcome(run: impl FnOnce(&mut Outcome) -> Result<(), String>) -> Outcome {
    let mut outcome = Outcome::default();
    if let Err(why) = run(&mut outcome) {
        outcome.expect(false, || why);
    }
    outcome
}

/// Notes that every pixel of a render's images is a number.
pub fn finite_films(renderer: &Renderer, outcome: &mut Outcome) {
    for (film, e) in renderer.films().iter().zip(renderer.estimators()) {
        for (i, p) in film.image().pixels.iter().enumerate() {
            outcome.finite(p.to_array().map(f64::from), || format!("{}, pixel {i}: {p}", e.name()));
        }
    }
}

/// A floor seen from above in 16 by 16 pixels, lit by a beam.
pub const BEAM: &str = r#"
[camera]
position = [0.0, 4.0, 0.0]
target = [0.0, 0.0, 0.0]
up = [0.0, 0.0, -1.0]
fov_y = 40.0
resolution = [16, 16]
[materials.floor]
kind = "diffuse"
reflectance = [0.5, 0.5, 0.5]
[[shapes]]
kind = "quad"
center = [0.0, 0.0, 0.0]
u = [4.0, 0.0, 0.0]
v = [0.0, 0.0, -4.0]
material = "floor"
[[lights]]
kind = "spot"
position = [0.0, 1e-5, 0.0]
direction = [0.0, -1.0, 0.0]
cone = 1.0
falloff = 0.0
power = [7.0, 7.0, 7.0]
"#;

/// Every estimator, with the settings that differ.
pub const ALL: &str = "density,regular,regular_3x3,coplanar,coplanar:shape=ellipse:20,weight=mean,multi_sampled,\
    multi_sampled:n=8,grid=cells,integrated";

/// A built-in scene.
///
/// # Errors
/// A defect of the binary.
pub fn built_in(name: &str) -> Result<Scene, String> {
    source::open(name).map_err(|e| e.to_string())
}
