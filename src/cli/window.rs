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
    let opened = opened(session, &flags, path.is_some())?;
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

/// Opens the session's scene, and gives panels the final gathering that was asked for: by flag or in a session's `[render]`
/// those that name none, and without a session by flag or in the scene file, where it takes the place of the first four
/// panels as in `compare`.
///
/// # Errors
/// Anything wrong in the scene, an edit or a setting.
pub fn opened(session: Session, flags: &CommonFlags, of_file: bool) -> Result<Opened, Failure> {
    let named = session.render.final_gather.is_some();
    let opened = Opened::new(session).map_err(Failure::Call)?;
    let settings = opened.settings();
    if settings.final_gather == "none" || of_file && !named {
        return Ok(opened);
    }
    let panels = opened.session().panels.clone();
    // Ways of final gathering are compared under one estimator.
    let own = if of_file || flags.estimator.is_some() { panels } else { vec![Panel::of(&settings.estimator)] };
    let mut all = Vec::new();
    for panel in own {
        if panel.image.is_some() {
            all.push(panel);
            continue;
        }
        let each = settings.with_final_gathering(&[registry::estimator(&panel.estimator)?])?;
        all.extend(each.iter().map(|e| Panel { estimator: e.name(), ..panel.clone() }));
    }
    Ok(opened.with_panels(all))
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
