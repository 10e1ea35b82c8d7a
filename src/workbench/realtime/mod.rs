//! The real-time view: the pi-engine with a camera that walks, beside its parameters and what its frames took.

mod parameters;
mod picture;
mod statistics;
mod switch;
pub mod thread;

use super::desk::Desk;
use super::document::Document;
use super::messages::Messages;
use super::worker::Wake;
use crate::export::tone::auto_exposure;
use crate::realtime::{FrameReport, RealtimeSettings};
use crate::scene::camera::walked;
use egui::{Key, Modifiers, Panel, Ui};
use std::collections::VecDeque;
use std::sync::Arc;
use thread::{LiveFrame, LiveThread, Wish};

/// Frames that plots show.
const HISTORY: usize = 300;

/// Height of the picture while frames follow each other, pixels; it is scaled up.
const PLAYING_HEIGHT: u32 = 240;

/// Pixels of the picture at rest at most, each way.
const MOST: f32 = 1600.0;

/// Part of the scene's radius that is walked in a second at speed 1.
const STRIDE: f64 = 0.25;

/// Radians for a second of an arrow key.
const TURN: f64 = 1.2;

/// The view's state. What belongs to the session is not here.
pub struct LiveView {
    thread: Option<LiveThread>,
    wake: Wake,
    /// The newest wish; its version tells which frames are new.
    wish: Option<Wish>,
    version: u64,
    last: Option<LiveFrame>,
    texture: Option<egui::TextureHandle>,
    /// Version and frame that the texture shows.
    shown: (u64, u64, u32),
    history: VecDeque<FrameReport>,
    playing: bool,
    steps: u64,
    restarts: u64,
    /// Factor on the walking speed.
    speed: f64,
    show_photons: bool,
    show_cone: bool,
    /// Whether a key of the walk is held.
    walking: bool,
    /// Pixels of the pane, at rest.
    pane: [u32; 2],
    exposure: f32,
    failed: bool,
}

impl LiveView {
    /// A view whose thread is started when it is first shown.
    pub fn new(wake: Wake) -> Self {
        Self {
            thread: None,
            wake,
            wish: None,
            version: 0,
            last: None,
            texture: None,
            shown: (0, 0, 0),
            history: VecDeque::new(),
            playing: true,
            steps: 0,
            restarts: 0,
            speed: 1.0,
            show_photons: false,
            show_cone: true,
            walking: false,
            pane: [320, PLAYING_HEIGHT],
            exposure: 1.0,
            failed: false,
        }
    }

    /// Ends the thread; what was set stays.
    pub fn leave(&mut self) {
        self.thread = None;
        self.wish = None;
        self.last = None;
        self.failed = false;
    }

    /// Whether a key of the walk is held, so that its moves are one step.
    pub fn is_walking(&self) -> bool {
        self.walking
    }

    /// Whether it plays.
    pub fn is_playing(&self) -> bool {
        self.playing
    }

    /// Plays, or pauses.
    pub fn play(&mut self, on: bool) {
        self.playing = on;
    }

    /// Makes so many single frames, one after the other.
    pub fn step(&mut self, frames: u64) {
        self.playing = false;
        self.steps += frames;
    }

    /// Starts over at the time 0 without photons.
    pub fn restart(&mut self) {
        self.restarts += 1;
        self.history.clear();
    }

    /// The last frame.
    pub fn last(&self) -> Option<&LiveFrame> {
        self.last.as_ref()
    }

    /// Shows photons by age, or not.
    pub fn show_photons(&mut self, on: bool) {
        self.show_photons = on;
    }

    /// Whether the frame that is shown is the one that is wanted.
    pub fn is_idle(&self) -> bool {
        let granted = |f: &LiveFrame| f.version == self.version && f.steps == self.steps;
        self.failed || !self.playing && self.wish.is_some() && self.last.as_ref().is_some_and(granted)
    }

    /// Takes in what the thread has made.
    pub fn poll(&mut self, messages: &mut Messages) {
        let Some(thread) = &self.thread else { return };
        while let Some(made) = thread.poll() {
            match made {
                Ok(frame) => {
                    if self.history.back().is_none_or(|h| h.frame != frame.report.frame) {
                        self.history.push_back(frame.report);
                        while self.history.len() > HISTORY {
                            self.history.pop_front();
                        }
                    }
                    self.last = Some(frame);
                }
                Err(why) => {
                    self.failed = true;
                    messages.error(why);
                }
            }
        }
    }

    /// Draws the view and takes what the user does in it.
    pub fn ui(&mut self, ui: &mut Ui, document: &mut Document, desk: &mut Desk, messages: &mut Messages) {
        if self.thread.is_none() && !self.failed {
            match LiveThread::start(Arc::clone(&self.wake)) {
                Ok(thread) => self.thread = Some(thread),
                Err(e) => {
                    self.failed = true;
                    messages.error(format!("real-time view: {e}"));
                }
            }
        }
        self.keys(ui, document);
        Panel::right("realtime").default_size(400.0).show(ui, |ui| {
            egui::ScrollArea::vertical().show(ui, |ui| {
                self.controls(ui, document);
                ui.separator();
                self.statistics(ui, desk.untimed);
                ui.separator();
                parameters::ui(ui, document);
            });
        });
        self.picture(ui, document);
        self.expose(document, desk);
        self.send(document);
    }

    /// Play, step, what is drawn over the picture, where to look from.
    fn controls(&mut self, ui: &mut Ui, document: &mut Document) {
        ui.horizontal_wrapped(|ui| {
            let title = if self.playing { "pause" } else { "play" };
            if ui.button(title).on_hover_text("play or pause (Space)").clicked() {
                self.playing = !self.playing;
            }
            if ui.button("step").on_hover_text("make one frame, then pause (.)").clicked() {
                self.step(1);
            }
            if ui.button("start over").on_hover_text("time 0, no photons (Home)").clicked() {
                self.restart();
            }
            ui.checkbox(&mut self.show_photons, "photons by age")
                .on_hover_text("new ones yellow, old ones blue; all of them, also behind walls");
            ui.checkbox(&mut self.show_cone, "cones").on_hover_text("the cones of spot lights, in red (figure 6.9)");
        });
        ui.horizontal_wrapped(|ui| {
            ui.label("walk: W A S D, Q E down and up, arrows or drag to look");
            let drag = egui::DragValue::new(&mut self.speed).range(0.05..=20.0).speed(0.02).prefix("speed ");
            ui.add(drag).on_hover_text("factor on a quarter of the scene's radius a second");
        });
        let scene = Arc::clone(document.scene());
        if !scene.viewpoints.is_empty() {
            egui::ComboBox::from_id_salt("viewpoints").selected_text("go to a viewpoint").width(260.0).show_ui(
                ui,
                |ui| {
                    for v in &scene.viewpoints {
                        if ui.selectable_label(false, &v.name).clicked()
                            && let Some(mut camera) = document.scene_file().camera
                        {
                            camera.position = (v.position.as_dvec3() + scene.origin).to_array();
                            camera.target = (v.target.as_dvec3() + scene.origin).to_array();
                            document.session.camera = Some(camera);
                        }
                    }
                },
            );
        }
    }

    /// Keys of the walk and of the view; they mean other things elsewhere.
    fn keys(&mut self, ui: &Ui, document: &mut Document) {
        self.walking = false;
        if ui.ctx().text_edit_focused() {
            return;
        }
        let (play, step, home) = ui.input_mut(|i| {
            (
                i.consume_key(Modifiers::NONE, Key::Space),
                i.consume_key(Modifiers::NONE, Key::Period),
                i.consume_key(Modifiers::NONE, Key::Home),
            )
        });
        if play {
            self.playing = !self.playing;
        }
        if step {
            self.step(1);
        }
        if home {
            self.restart();
        }
        let pair = |plus: Key, minus: Key| {
            ui.input(|i| {
                // With Ctrl they are menu keys.
                let held = |k| f64::from(u8::from(i.key_down(k) && !i.modifiers.command));
                held(plus) - held(minus)
            })
        };
        let mut moves = [pair(Key::D, Key::A), pair(Key::E, Key::Q), pair(Key::W, Key::S)];
        let turns = [pair(Key::ArrowRight, Key::ArrowLeft), pair(Key::ArrowUp, Key::ArrowDown)];
        self.walking = moves.iter().chain(&turns).any(|m| *m != 0.0);
        if !self.walking {
            return;
        }
        let seconds = f64::from(ui.input(|i| i.stable_dt)).min(0.1);
        let stride = STRIDE * f64::from(document.scene().radius) * self.speed * seconds;
        moves.iter_mut().for_each(|m| *m *= stride);
        self.walk(document, moves, turns.map(|t| t * TURN * seconds));
        ui.ctx().request_repaint();
    }

    /// Moves the session's camera: right, up and forward in metres, to the right and up in radians.
    fn walk(&self, document: &mut Document, by: [f64; 3], turn: [f64; 2]) {
        if let Some(mut camera) = document.scene_file().camera
            && walked(&mut camera, by, turn)
        {
            document.session.camera = Some(camera);
        }
    }

    /// Exposure: the session's, or from the last frame, which it follows slowly while frames follow each other.
    fn expose(&mut self, document: &Document, desk: &mut Desk) {
        let tone = &document.session.tone;
        if !tone.auto {
            self.exposure = libm::exp2f(tone.exposure);
            return;
        }
        let Some(frame) = &self.last else { return };
        let wanted = auto_exposure(&frame.image).log2();
        let follow = if self.playing { 0.1 } else { 1.0 };
        let next = self.exposure.max(f32::MIN_POSITIVE).log2() * (1.0 - follow) + wanted * follow;
        self.exposure = libm::exp2f(if next.is_finite() { next } else { 0.0 });
        desk.auto_exposure = next;
    }

    /// Tells the thread what is wanted, if that has changed.
    fn send(&mut self, document: &Document) {
        let scene = document.scene();
        let Ok(settings) = RealtimeSettings::new(scene, &document.session.realtime, document.session.seed) else {
            return;
        };
        let size = if self.playing {
            let aspect = self.pane[0] as f32 / self.pane[1].max(1) as f32;
            [((PLAYING_HEIGHT as f32 * aspect) as u32).clamp(16, 960), PLAYING_HEIGHT]
        } else {
            self.pane
        };
        let offset = settings.blending == crate::realtime::settings::Blending::Offset;
        let wish = Wish {
            version: self.version,
            scene: Arc::clone(scene),
            settings,
            camera: scene.camera,
            size,
            // Only then does the picture itself depend on it.
            exposure: if offset { self.exposure } else { 1.0 },
            playing: self.playing,
            steps: self.steps,
            restarts: self.restarts,
            photons: self.show_photons,
        };
        let same = self.wish.as_ref().is_some_and(|w| {
            Arc::ptr_eq(&w.scene, &wish.scene)
                && w.settings == wish.settings
                && w.camera == wish.camera
                && (w.size, w.playing, w.steps, w.restarts, w.photons)
                    == (wish.size, wish.playing, wish.steps, wish.restarts, wish.photons)
                && w.exposure == wish.exposure
        });
        if same {
            return;
        }
        self.version += 1;
        let wish = Wish { version: self.version, ..wish };
        if let Some(thread) = &self.thread {
            thread.wish(wish.clone());
        }
        self.wish = Some(wish);
    }
}
