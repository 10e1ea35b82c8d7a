//! Tables and figures of Kristensen and Ottosen 2003, *The pi-engine, part 2*.

pub mod bias;
pub mod figures;
pub mod fluctuation;
mod panels;
pub mod parameters;
pub mod scattering;
pub mod table_5_1;
pub mod table_6_1;
pub mod table_6_2;
pub mod timing;

use crate::cli::failure::Failure;
use crate::cli::paper::PaperFlags;
use crate::cli::paper::output::Origin;
use crate::cli::realtime::SIZE;
use crate::measure::realtime::RunSettings;
use crate::realtime::RealtimeSettings;
use crate::realtime::settings::set;
use crate::scene::scene_file::{RealtimeFile, RenderFile};
use crate::scene::{Scene, open};
use std::sync::Arc;

/// The level in which the paper measures, or ours in its place.
fn rooms() -> Result<Arc<Scene>, Failure> {
    Ok(Arc::new(open("rooms")?))
}

/// The parameters of a scene with `texts`, as in `KEY=VALUE`, on top, and the seed of the flags.
fn parameters(scene: &Scene, flags: &PaperFlags, texts: &[&str]) -> Result<RealtimeSettings, Failure> {
    let mut table = RealtimeFile::default();
    for text in texts {
        set(&mut table, text).map_err(Failure::Call)?;
    }
    Ok(RealtimeSettings::new(scene, &table, flags.seed.unwrap_or(1))?)
}

/// A run of so many frames, 30 a second of the scene's time, at the size of the flags.
fn run_settings(flags: &PaperFlags, frames: u64, turn: f64) -> RunSettings {
    RunSettings { frames, time_step: 1.0 / 30.0, turn, size: flags.size.unwrap_or(SIZE), exposure: 1.0 }
}

/// The start of an item's JSON.
fn origin(
    item: &'static str,
    source: &'static str,
    scene: &Scene,
    flags: &PaperFlags,
    size: [u32; 2],
) -> Result<Origin, Failure> {
    let common = crate::cli::flags::CommonFlags { size: Some(flags.size.unwrap_or(size)), ..flags.common() };
    let mut render = RenderFile::default();
    common.onto(&mut render);
    let settings = crate::render::RenderSettings::new(scene, &render, common.size, common.seed.unwrap_or(1))?;
    Ok(Origin::new(item, source, scene, &settings))
}

/// Nothing of an item was written.
fn stopped(item: &str) -> Failure {
    Failure::Interrupted(format!("nothing of {item} was written"))
}
