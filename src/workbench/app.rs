//! The window: one frame from the worker's events to the next job.

use super::actions::{self, Action};
use super::analysis::Analysis;
use super::desk::{Desk, Finding, Kind, Step};
use super::document::{Change, Document, Opened};
use super::gallery::Gallery;
use super::inspector::{FoundPath, Inspected};
use super::layout::{self, Pane};
use super::messages::Messages;
use super::panes::Panes;
use super::realtime::LiveView;
use super::render::Render;
use super::watch::{self, Watch};
use super::worker::Wake;
use super::{bars, dialogs, theme};
use crate::export::session::{Panel, Session};
use egui_tiles::Tree;
use std::path::PathBuf;
use std::sync::Arc;

/// The application.
pub struct Workbench {
    pub(super) document: Document,
    pub(super) render: Render,
    pub(super) gallery: Gallery,
    pub(super) messages: Messages,
    pub(super) desk: Desk,
    pub(super) analysis: Analysis<Kind, Finding>,
    pub(super) tree: Tree<Pane>,
    /// The real-time view.
    pub(super) live: LiveView,
    /// Whether the real-time view was shown in the last frame, and whether the progressive render was paused before.
    pub(super) was_live: Option<bool>,
    /// Whether the progressive render is that of an older session.
    pub(super) stale: bool,
    context: egui::Context,
    watch: Watch,
    /// Passes and drafts whose images have been measured.
    measured: (u64, u64),
    styled: bool,
}

impl Workbench {
    /// A window on a session whose scene has been opened; `path` is the session's own file.
    ///
    /// # Errors
    /// If the system has no room for a thread.
    pub fn new(context: &egui::Context, opened: Opened, path: Option<PathBuf>) -> std::io::Result<Self> {
        let wake: Wake = {
            let context = context.clone();
            Arc::new(move || context.request_repaint())
        };
        let document = Document::new(opened, path);
        let tree = document
            .session
            .layout
            .as_deref()
            .and_then(layout::from_text)
            .unwrap_or_else(|| layout::standard(document.session.panels.len()));
        let mut workbench = Self {
            analysis: Analysis::start(Arc::clone(&wake))?,
            live: LiveView::new(Arc::clone(&wake)),
            was_live: None,
            stale: false,
            render: Render::new(wake),
            gallery: Gallery::default(),
            messages: Messages::default(),
            desk: Desk::default(),
            tree,
            document,
            context: context.clone(),
            watch: Watch::default(),
            measured: (0, 0),
            styled: false,
        };
        workbench.note_opened();
        workbench.new_scene();
        workbench.restart();
        Ok(workbench)
    }

    /// Draws a frame and does what the user asks in it.
    pub fn ui(&mut self, ui: &mut egui::Ui) {
        if !self.styled {
            theme::apply(ui.ctx());
            self.styled = true;
        }
        self.take_in();
        let live = self.is_live();
        self.enter_or_leave(live);
        for action in actions::pressed(ui.ctx(), live) {
            self.desk.ask(action);
        }
        self.desk.flipped = ui.input(|i| i.key_down(egui::Key::B)) && !ui.ctx().text_edit_focused();
        self.desk.unfinished = false;
        self.desk.hover_before = self.desk.hover.take();
        self.desk.inspector.begin();
        layout::fit(&mut self.tree, self.document.session.panels.len());
        bars::top(ui, &self.document, &self.render, &mut self.desk);
        let (document, gallery) = (&self.document, &self.gallery);
        bars::status(ui, document, gallery, &self.render, &self.messages, &mut self.desk, &mut self.tree);
        if live {
            let Self { document, desk, messages, live, .. } = self;
            live.poll(messages);
            egui::CentralPanel::default().show(ui, |ui| live.ui(ui, document, desk, messages));
            self.finish(ui);
            return;
        }
        egui::CentralPanel::default().frame(egui::Frame::new().fill(theme::SURROUND)).show(ui, |ui| {
            let mut panes = Panes {
                document: &mut self.document,
                render: &self.render,
                gallery: &mut self.gallery,
                messages: &mut self.messages,
                desk: &mut self.desk,
                started: std::time::Instant::now(),
            };
            match panes.desk.maximized {
                Some(panel) if panel < panes.document.session.panels.len() => panes.image_alone(ui, panel),
                _ => self.tree.ui(&mut panes, ui),
            }
        });
        self.finish(ui);
    }

    /// What every frame ends with, whichever view it has shown.
    fn finish(&mut self, ui: &mut egui::Ui) {
        dialogs::show(ui.ctx(), &mut self.document, &mut self.desk);
        self.take_dropped(ui.ctx());
        self.watch_scene(ui.ctx());
        self.act();
        self.look_into();
        self.ask_images();
        self.ask_values();
        self.ask_photons();
        self.ask_estimates();
        let held = ui.input(|i| i.pointer.any_down()) || self.is_live() && self.live.is_walking();
        let change = self.document.settle(held);
        self.follow(change, Step::New);
        if self.desk.unfinished {
            ui.ctx().request_repaint();
        }
    }

    /// Takes in what the threads tell.
    fn take_in(&mut self) {
        self.render.poll(&mut self.gallery, &mut self.messages);
        while let Some(found) = self.analysis.poll() {
            match found {
                Ok(finding) => self.found(finding),
                Err(why) => self.messages.error(why),
            }
        }
        let seen = (self.render.passes_seen, self.render.drafts_seen);
        if seen != self.measured {
            let pass_done = seen.0 != self.measured.0;
            self.measured = seen;
            self.expose();
            if pass_done {
                self.after_pass();
            }
        }
    }

    fn found(&mut self, finding: Finding) {
        match finding {
            Finding::Opened(opened, step) => match *opened {
                Ok(opened) => {
                    match step {
                        Step::New => {
                            self.document.install(opened);
                            self.note_opened();
                        }
                        Step::Taken => {
                            // What was edited while the scene was read is not lost.
                            let wanted = self.document.session.clone();
                            self.document.install_step(opened);
                            if wanted.scene == self.document.session.scene {
                                self.document.session = wanted;
                            }
                        }
                        Step::Reloaded => {
                            self.document.install_step(opened);
                            self.messages.note(format!("reloaded {}", self.document.session.scene));
                        }
                        Step::Document(path) => {
                            self.document = Document::new(opened, path);
                            if let Some(tree) = self.document.session.layout.as_deref().and_then(layout::from_text) {
                                self.tree = tree;
                            }
                            self.note_opened();
                        }
                    }
                    self.new_scene();
                    self.restart_or_note();
                }
                Err(why) => {
                    self.document.stay();
                    self.messages.error(why);
                }
            },
            Finding::Reference(Ok(reference)) => {
                let (reference, image) = reference.unzip();
                self.gallery.set_reference(image);
                self.desk.reference = reference;
                self.desk.errors.clear();
                self.after_pass();
            }
            Finding::Reference(Err(why)) => self.messages.error(why),
            Finding::Image(path, Ok(image)) => {
                self.gallery.put_file(&path, image);
                let panels = &mut self.document.session.panels;
                if !panels.iter().any(|p| p.image.as_ref() == Some(&path)) {
                    panels.push(Panel { image: Some(path), ..Panel::of("") });
                }
            }
            Finding::Image(_, Err(why)) => self.messages.error(why),
            // A small step would only make the images flicker.
            Finding::Exposure(stops) if self.desk.untimed || (stops - self.desk.auto_exposure).abs() > 0.1 => {
                self.desk.auto_exposure = stops;
            }
            Finding::Exposure(_) => {}
            Finding::Areas(areas) => self.desk.areas = areas,
            Finding::Values(panel, Ok(values)) => drop(self.gallery.values.insert(panel, values)),
            Finding::Values(panel, Err(why)) => {
                self.gallery.values.remove(&panel);
                self.messages.error(why);
            }
            Finding::Photons(photons) => self.desk.visible_photons = photons,
            Finding::Estimates(estimates) => self.desk.visible_estimates = estimates,
            Finding::Inspected(Ok(found)) => self.desk.inspector.take(*found),
            Finding::Inspected(Err(why)) => self.messages.error(why),
            Finding::Path(path) => self.desk.inspector.path = path,
            Finding::Exported(Ok(what)) => self.messages.note(what),
            Finding::Exported(Err(why)) => self.messages.error(why),
            Finding::Errors(generation, errors) => {
                if self.render.job().is_some_and(|j| j.generation == generation) {
                    for (estimator, point) in errors {
                        let curve = self.desk.errors.entry(estimator).or_default();
                        if curve.last().is_none_or(|last| last.passes < point.passes) {
                            curve.push(point);
                        }
                    }
                }
            }
        }
    }

    /// What has to be looked at afresh when the scene is another one.
    fn new_scene(&mut self) {
        self.read_reference();
    }

    /// Sends a new job for the document as it is.
    pub(super) fn restart(&mut self) {
        self.desk.forget_errors();
        let job = self.document.job(self.render.next_generation());
        self.render.start(job, &mut self.gallery, &mut self.messages);
    }

    /// Does what a change of the session asks for.
    fn follow(&mut self, change: Result<Change, String>, step: Step) {
        let reference = self.document.reference();
        if change != Ok(Change::None) && change != Ok(Change::Scene) && self.desk.reference_of != Some(reference) {
            self.read_reference();
        }
        match change {
            Ok(Change::None | Change::Look) => {}
            Ok(Change::Render) => self.restart_or_note(),
            Ok(Change::Scene) => {
                if !self.analysis.is_busy_with(&Kind::Open) {
                    let session = self.document.session.clone();
                    self.open(session, step);
                }
            }
            Err(why) => self.messages.error(why),
        }
    }

    pub(super) fn open(&mut self, session: Session, step: Step) {
        self.analysis.ask(Kind::Open, move || Finding::Opened(Box::new(Opened::new(session)), step));
    }

    /// Asks for what the inspector lacks: the pinned pixel of the pass that it looks at, the chosen photon's path.
    fn look_into(&mut self) {
        let Some(pixel) = self.document.session.pins.last().copied() else {
            if self.desk.inspector.found.is_some() {
                self.desk.inspector.clear();
            }
            return;
        };
        let inspector = &mut self.desk.inspector;
        let pass = if inspector.latest { &self.render.pass } else { &self.render.first_pass };
        let size = self.document.settings().size;
        let fits = pixel[0] < size[0] && pixel[1] < size[1];
        if let (Some(pass), Some(job)) = (pass, self.render.job())
            && !(self.render.draft && inspector.latest)
            && fits
        {
            let wanted = (Arc::as_ptr(pass) as usize, pixel, job.estimators.clone());
            if inspector.asked.as_ref() != Some(&wanted) {
                let (pass, names) = (Arc::clone(pass), job.estimators.clone());
                inspector.asked = Some(wanted);
                self.analysis
                    .ask(Kind::Inspect, move || Finding::Inspected(Inspected::new(&pass, &names, pixel).map(Box::new)));
            }
        }
        let chosen = inspector.found.as_ref().and_then(|f| {
            let row = f.inspection.rows.get(inspector.chosen?)?;
            Some((Arc::clone(&f.pass), row.kind, row.index))
        });
        let has = inspector.path.as_ref().map(|p| p.photon);
        match chosen {
            None => inspector.path = None,
            Some((pass, kind, index)) if has != Some((kind, index)) && !self.analysis.is_busy_with(&Kind::Path) => {
                self.analysis.ask(Kind::Path, move || Finding::Path(FoundPath::new(&pass, kind, index)));
            }
            Some(_) => {}
        }
    }

    /// Opens files that were dropped onto the window.
    fn take_dropped(&mut self, context: &egui::Context) {
        let dropped = context.input(|i| i.raw.dropped_files.clone());
        for file in dropped {
            self.desk.ask(Action::OpenFile(file.path().to_string_lossy().into_owned()));
        }
    }

    /// Reads the scene again when its file has changed.
    fn watch_scene(&mut self, context: &egui::Context) {
        let Some(path) = self.document.source().path() else { return };
        context.request_repaint_after(watch::INTERVAL);
        if !self.analysis.is_busy_with(&Kind::Open) && self.watch.has_changed(path, std::time::Instant::now()) {
            self.open(self.document.session.clone(), Step::Reloaded);
        }
    }

    /// Puts the session's file, or else its scene, in front of what was opened before.
    fn note_opened(&mut self) {
        let path = self.document.path().map(|p| p.to_string_lossy().into_owned());
        self.desk.recent.note(path.as_deref().unwrap_or(&self.document.session.scene));
    }

    /// Does what was asked for in this frame.
    fn act(&mut self) {
        for action in std::mem::take(&mut self.desk.actions) {
            self.run(action);
        }
    }

    /// Does one action.
    pub fn run(&mut self, action: Action) {
        let context = self.context.clone();
        match action {
            Action::Undo | Action::Redo => {
                if action == Action::Undo {
                    self.document.undo()
                } else {
                    self.document.redo()
                }
                let change = self.document.settle_step();
                self.follow(change, Step::Taken);
            }
            Action::Pause if self.is_live() => self.live.play(!self.live.is_playing()),
            Action::StepTile | Action::StepPass if self.is_live() => self.live.step(1),
            Action::Pause => {
                if let Some(gate) = self.render.gate() {
                    if gate.is_paused() { gate.resume() } else { gate.pause() }
                }
            }
            Action::StepTile => self.render.gate().into_iter().for_each(super::worker::gate::Gate::step_tile),
            Action::StepPass => self.render.gate().into_iter().for_each(super::worker::gate::Gate::step_pass),
            Action::RestartWorker => self.render.restart(&mut self.gallery, &mut self.messages),
            Action::Quit => context.send_viewport_cmd(egui::ViewportCommand::Close),
            Action::RemovePanel(index) if index < self.document.session.panels.len() => {
                self.document.session.panels.remove(index);
                layout::remove_image(&mut self.tree, index);
                self.desk.maximized = None;
            }
            Action::ResetLayout => {
                self.tree = layout::standard(self.document.session.panels.len());
                self.desk.maximized = None;
            }
            Action::DismissMessages => self.messages.clear(),
            Action::CopyReadout => {
                if let Some(text) = bars::readout(&self.document, &self.gallery, &self.render, &self.desk) {
                    context.copy_text(text);
                    self.messages.note("copied the readout");
                }
            }
            other => self.run_file(other),
        }
    }

    /// Does an action that concerns files, or hands it to those that only edit.
    fn run_file(&mut self, action: Action) {
        match action {
            Action::OpenScene(name) => {
                let session = self.document.session.clone();
                self.open(super::files::session_for(&session, &name), Step::New);
            }
            Action::OpenFile(path) => self.open_file(&path),
            Action::OpenDialog => self.open_dialog(),
            Action::SaveSession => self.save_session(false),
            Action::SaveSessionAs => self.save_session(true),
            Action::SaveSessionTo(path) => self.save_session_to(path.as_ref()),
            Action::SaveScene => self.save_scene(),
            Action::SaveSceneTo(path) => self.save_scene_to(path.as_ref()),
            Action::Export => self.export(),
            Action::ExportTo(folder) => self.export_to(folder.as_ref()),
            Action::Reload => {
                if let Err(why) = self.document.reload() {
                    self.messages.error(why);
                } else {
                    self.new_scene();
                    self.restart_or_note();
                }
            }
            other => super::edits::apply(&other, &mut self.document.session, &mut self.desk, &self.gallery),
        }
    }

    /// Takes up how the window was when it was closed, unless the session says otherwise.
    pub fn recall(&mut self, storage: &dyn eframe::Storage) {
        if self.document.session.layout.is_none()
            && let Some(tree) = storage.get_string("layout").as_deref().and_then(layout::from_text)
        {
            self.tree = tree;
        }
        if let Some(text) = storage.get_string("recent") {
            self.desk.recent.recall(&text);
        }
    }

    /// Leaves out what differs from run to run: times, memory, and an exposure that lags behind the images. Once the
    /// window is idle, the same session gives the same picture.
    pub fn for_pictures(&mut self) {
        self.desk.untimed = true;
        self.live.play(false);
    }

    /// Chooses a gather ray of the pixel that is pinned next, by its place in the list from 0, and the layer of the irradiance
    /// pyramid that the overlay draws.
    pub fn show_gathering(&mut self, ray: Option<usize>, layer: usize) {
        self.desk.inspector.wanted_ray = ray;
        self.desk.shown_estimates.layer = layer;
    }

    /// The session, for tests and for saving.
    pub fn session(&self) -> &Session {
        &self.document.session
    }

    /// The session to be edited, as a widget would; what that asks for is done at the end of the next frame.
    pub fn session_mut(&mut self) -> &mut Session {
        &mut self.document.session
    }

    /// The document.
    pub fn document(&self) -> &Document {
        &self.document
    }

    /// Messages that have not been dismissed.
    pub fn messages(&self) -> &Messages {
        &self.messages
    }

    /// The render.
    pub fn render(&self) -> &Render {
        &self.render
    }

    /// The images.
    pub fn gallery(&self) -> &Gallery {
        &self.gallery
    }

    /// What is known beyond the session.
    pub fn desk(&self) -> &Desk {
        &self.desk
    }

    /// Whether nothing is left to be done: all passes are rendered and the analysis thread rests.
    pub fn is_idle(&self) -> bool {
        let drawn = if self.is_live() { self.live.is_idle() } else { self.render.finished };
        drawn && !self.analysis.is_busy() && !self.desk.unfinished
    }
}

impl eframe::App for Workbench {
    fn ui(&mut self, ui: &mut egui::Ui, _frame: &mut eframe::Frame) {
        Self::ui(self, ui);
    }

    fn save(&mut self, storage: &mut dyn eframe::Storage) {
        if let Some(text) = layout::to_text(&self.tree) {
            storage.set_string("layout", text);
        }
        storage.set_string("recent", self.desk.recent.to_text());
    }
}
