//! What is worked on: the session, the scene that it opens, and the settings that both give.

use super::history::History;
use super::worker::messages::Job;
use crate::export::session::{Panel, Session};
use crate::realtime::RealtimeSettings;
use crate::render::RenderSettings;
use crate::render::memory::check_images;
use crate::scene::scene_file::SceneFile;
use crate::scene::{Scene, Source};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// What a change of the session asks for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Change {
    /// Nothing has changed.
    None,
    /// What is shown is drawn in another way.
    Look,
    /// The render goes on with other settings.
    Render,
    /// Another scene has to be opened first.
    Scene,
}

/// The session with its scene, and the steps that led to it.
pub struct Document {
    /// The session. Widgets edit it freely; [`Document::settle`] finds out what that asks for.
    pub session: Session,
    /// The session as it was when it was settled last.
    settled: Session,
    history: History,
    source: Source,
    scene: Arc<Scene>,
    settings: RenderSettings,
    path: Option<PathBuf>,
    /// The session as it was saved last.
    saved: Session,
}

/// A scene that was opened for a session, on another thread.
pub struct Opened {
    session: Session,
    source: Source,
    scene: Arc<Scene>,
    settings: RenderSettings,
}

impl Opened {
    /// Opens the scene of `session`, with its edits; takes as long as reading its files takes.
    ///
    /// # Errors
    /// One line about what is wrong in the scene, an edit or a setting.
    pub fn new(session: Session) -> Result<Self, String> {
        let (source, scene) = session.open_scene().map_err(|e| e.to_string())?;
        let settings = settings(&scene, &session)?;
        Ok(Self { session, source, scene: Arc::new(scene), settings })
    }

    /// The session.
    pub fn session(&self) -> &Session {
        &self.session
    }

    /// The settings.
    pub fn settings(&self) -> &RenderSettings {
        &self.settings
    }

    /// The same with other panels, which hold all final gathering: none is asked for beside them any more.
    pub fn with_panels(mut self, panels: Vec<Panel>) -> Self {
        self.session.panels = panels;
        (self.session.render.final_gather, self.session.render.final_gather_rays) = (None, None);
        self
    }
}

fn settings(scene: &Scene, session: &Session) -> Result<RenderSettings, String> {
    let mut settings =
        RenderSettings::new(scene, &session.render, session.size, session.seed).map_err(|e| e.to_string())?;
    settings.plan = session.plan;
    check_images(&settings, estimators(session).len()).map_err(|e| e.to_string())?;
    Ok(settings)
}

/// What decides which reference there is: its file and mask, and whether the scene is as it is built in.
pub type ReferenceOf = (Option<String>, Option<String>, bool);

impl Document {
    /// What decides which reference there is.
    pub fn reference(&self) -> ReferenceOf {
        (self.session.reference.clone(), self.session.mask.clone(), self.is_edited())
    }

    /// Whether camera, lights or materials are not those of the scene's file.
    pub fn is_edited(&self) -> bool {
        self.scene.hash != self.source.scene.hash
    }

    /// A session whose scene has been opened. `path` is the session's own file, if it has one.
    pub fn new(opened: Opened, path: Option<PathBuf>) -> Self {
        let Opened { session, source, scene, settings } = opened;
        Self {
            settled: session.clone(),
            saved: session.clone(),
            session,
            history: History::default(),
            source,
            scene,
            settings,
            path,
        }
    }

    /// Looks at what has changed since it was called last and takes it over; `ongoing` while a widget is held.
    ///
    /// # Errors
    /// An edit that can't be; the session is as it was before it.
    pub fn settle(&mut self, ongoing: bool) -> Result<Change, String> {
        if self.session == self.settled {
            if !ongoing {
                self.history.settle();
            }
            return Ok(Change::None);
        }
        if self.session.scene != self.source.name {
            return Ok(Change::Scene);
        }
        match self.take_over() {
            Ok(change) => {
                let unseen =
                    Session { view: self.settled.view, layout: self.settled.layout.clone(), ..self.session.clone() };
                if unseen != self.settled {
                    self.history.note(&self.settled, ongoing);
                }
                self.settled.clone_from(&self.session);
                Ok(change)
            }
            Err(why) => {
                self.session.clone_from(&self.settled);
                Err(why)
            }
        }
    }

    /// Scene and settings of the session as it is now.
    fn take_over(&mut self) -> Result<Change, String> {
        let (now, before) = (&self.session, &self.settled);
        let mut change = Change::Look;
        let same_world = now.materials == before.materials && now.lights == before.lights;
        if !(same_world && now.camera == before.camera) {
            let file = now.edited(&self.source.file);
            let scene = if same_world {
                self.source.with_camera(&file, &self.scene)
            } else {
                self.source.edited(&file, &self.scene)
            };
            self.scene = Arc::new(scene.map_err(|e| e.to_string())?);
            change = Change::Render;
        }
        let same_settings = now.render == before.render && now.plan == before.plan;
        if change == Change::Render || !same_settings || now.size != before.size || now.seed != before.seed {
            self.settings = settings(&self.scene, now)?;
            change = Change::Render;
        }
        if now.realtime != before.realtime || now.seed != before.seed {
            RealtimeSettings::new(&self.scene, &now.realtime, now.seed).map_err(|e| e.to_string())?;
        }
        if estimators(now) != estimators(before) || now.stop_rule() != before.stop_rule() {
            check_images(&self.settings, estimators(now).len()).map_err(|e| e.to_string())?;
            change = Change::Render;
        }
        Ok(change)
    }

    /// Takes over a scene that has been opened for a session, as a step that can be taken back.
    pub fn install(&mut self, opened: Opened) {
        self.history.note(&self.settled, false);
        let Opened { session, source, scene, settings } = opened;
        self.settled.clone_from(&session);
        (self.session, self.source, self.scene, self.settings) = (session, source, scene, settings);
    }

    /// Gives up a change of scene that failed.
    pub fn stay(&mut self) {
        self.session.clone_from(&self.settled);
    }

    /// Takes a step back; what it asks for is found by [`Document::settle_step`].
    pub fn undo(&mut self) {
        if let Some(session) = self.history.undo(&self.settled) {
            self.step_to(session);
        }
    }

    /// Takes a step forth again.
    pub fn redo(&mut self) {
        if let Some(session) = self.history.redo(&self.settled) {
            self.step_to(session);
        }
    }

    fn step_to(&mut self, session: Session) {
        self.session = session;
    }

    /// As [`Document::settle`], after a step back or forth: it is no new step.
    ///
    /// # Errors
    /// As [`Document::settle`].
    pub fn settle_step(&mut self) -> Result<Change, String> {
        if self.session.scene != self.source.name {
            return Ok(Change::Scene);
        }
        let change = self.take_over()?;
        self.settled.clone_from(&self.session);
        Ok(change)
    }

    /// As [`Document::install`], after a step back or forth.
    pub fn install_step(&mut self, opened: Opened) {
        let Opened { session, source, scene, settings } = opened;
        self.settled.clone_from(&session);
        (self.session, self.source, self.scene, self.settings) = (session, source, scene, settings);
    }

    /// Reads the scene's files again, with the session's edits on top.
    ///
    /// # Errors
    /// Anything wrong in them; the scene stays as it was.
    pub fn reload(&mut self) -> Result<(), String> {
        let opened = Opened::new(self.settled.clone())?;
        self.install_step(opened);
        Ok(())
    }

    /// The job of rendering this.
    pub fn job(&self, generation: u64) -> Job {
        Job {
            generation,
            scene: Arc::clone(&self.scene),
            settings: self.settings.clone(),
            estimators: estimators(&self.settled),
            stop: self.settled.stop_rule(),
        }
    }

    /// The scene with the session's edits.
    pub fn scene(&self) -> &Arc<Scene> {
        &self.scene
    }

    /// The scene's file as it was opened.
    pub fn source(&self) -> &Source {
        &self.source
    }

    /// The scene's file with the session's edits.
    pub fn scene_file(&self) -> SceneFile {
        self.session.edited(&self.source.file)
    }

    /// The settings.
    pub fn settings(&self) -> &RenderSettings {
        &self.settings
    }

    /// The steps that can be taken back and forth.
    pub fn history(&self) -> &History {
        &self.history
    }

    /// The session's own file.
    pub fn path(&self) -> Option<&Path> {
        self.path.as_deref()
    }

    /// Notes that the session was saved.
    pub fn saved_as(&mut self, path: PathBuf) {
        self.path = Some(path);
        self.saved.clone_from(&self.session);
    }

    /// Whether there is something that has not been saved.
    pub fn is_changed(&self) -> bool {
        Session { view: self.saved.view, layout: self.saved.layout.clone(), ..self.session.clone() } != self.saved
    }
}

/// The distinct estimators of the panels, in their order.
fn estimators(session: &Session) -> Vec<String> {
    let mut names: Vec<String> = Vec::new();
    for panel in session.panels.iter().filter(|p| p.image.is_none()) {
        if !names.contains(&panel.estimator) {
            names.push(panel.estimator.clone());
        }
    }
    names
}

#[cfg(test)]
mod tests {
    use super::*;

    fn document() -> Document {
        Document::new(Opened::new(Session::of("ring")).expect("opens"), None)
    }

    #[test]
    fn changes_ask_for_no_more_than_they_need() {
        let mut d = document();
        assert_eq!(d.settle(false), Ok(Change::None));
        d.session.tone.exposure = 1.0;
        assert_eq!(d.settle(false), Ok(Change::Look));
        let scene = Arc::clone(d.scene());
        d.session.render.footprint_scale = Some(2.0);
        assert_eq!(d.settle(false), Ok(Change::Render));
        assert!(Arc::ptr_eq(&scene, d.scene()));
        let mut camera = d.scene_file().camera.expect("has one");
        camera.position[0] += 0.1;
        d.session.camera = Some(camera);
        assert_eq!(d.settle(false), Ok(Change::Render));
        assert!(Arc::ptr_eq(&scene.geometry, &d.scene().geometry) && scene.camera != d.scene().camera);
        d.session.scene = "cornell".into();
        assert_eq!(d.settle(false), Ok(Change::Scene));
    }

    #[test]
    fn steps_are_taken_back_and_forth() {
        let mut d = document();
        let first = d.settings().photons;
        d.session.render.photons = Some(1234);
        d.settle(false).expect("valid");
        d.undo();
        assert_eq!(d.settle_step(), Ok(Change::Render));
        assert_eq!(d.settings().photons, first);
        d.redo();
        d.settle_step().expect("valid");
        assert_eq!(d.settings().photons, 1234);
        // What part of the image is seen is no step.
        d.session.view.zoom = 2.0;
        d.settle(false).expect("valid");
        d.undo();
        d.settle_step().expect("valid");
        assert_eq!((d.settings().photons, d.session.view.zoom), (first, 2.0));
    }

    #[test]
    fn an_edit_that_cannot_be_is_refused() {
        let mut d = document();
        d.session.render.photons = Some(0);
        assert!(d.settle(false).is_err());
        assert_eq!(d.settle(false), Ok(Change::None));
        assert!(!d.is_changed());
        let mut lights = d.scene_file().lights;
        lights[0].power = Some([-1.0; 3]);
        d.session.lights = Some(lights);
        let why = d.settle(false).expect_err("negative");
        assert!(why.contains("power"), "{why}");
    }
}
