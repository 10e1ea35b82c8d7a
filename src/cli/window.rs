//! `cusp`: the workbench, or a comparison where there is no display.

use crate::cli::compare::{self, CompareArgs};
use crate::cli::failure::Failure;
use crate::cli::flags::{CommonFlags, PlanFlag};
use crate::estimate::registry;
use crate::export::session::{Panel, Session};
use crate::render::settings::PlanMode;
use crate::workbench::document::Opened;
use crate::workbench::window;
use std::path::{Path, PathBuf};

/// Opens the window on a scene or session; without a display says so and compares.
///
/// # Errors
/// A wrong call, or what the comparison returns.
pub fn run(scene: String, flags: CommonFlags) -> Result<(), Failure> {
    let (session, path) = session(&scene, &flags)?;
    let opened = Opened::new(session).map_err(Failure::Call)?;
    let why = match window::display() {
        Ok(()) => {
            flags.set_threads()?;
            match window::open(opened, path) {
                Ok(()) => return Ok(()),
                Err(why) => why,
            }
        }
        Err(why) => why,
    };
    if !flags.quiet && !flags.json {
        eprintln!("There is no window ({why}): comparing the estimators on {scene}.");
    }
    compare::run(&CompareArgs::of(scene, flags))
}

/// The session of a scene or session file with the flags on top, and the session's own file.
///
/// # Errors
/// A wrong flag, or a session file with something wrong in it.
pub fn session(scene: &str, flags: &CommonFlags) -> Result<(Session, Option<PathBuf>), Failure> {
    let path = Path::new(scene);
    let (mut session, path) =
        if Session::is_one(path) { (Session::open(path)?, Some(path.to_owned())) } else { (Session::of(scene), None) };
    flags.onto(&mut session.render);
    session.size = flags.size.or(session.size);
    session.seed = flags.seed.unwrap_or(session.seed);
    if flags.plan == PlanFlag::Full {
        session.plan = PlanMode::Full;
    }
    if let Some(list) = &flags.estimator {
        session.panels = registry::estimators(list)?.iter().map(|e| Panel::of(e.name())).collect();
        session.render.estimator = None;
    }
    Ok((session, path))
}
