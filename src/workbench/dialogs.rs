//! Dialogs: paths, go to a pixel, all actions, shortcuts.

use super::actions::{Action, entries};
use super::desk::Desk;
use super::document::Document;
use super::theme::mono;
use crossbeam_channel::{Receiver, bounded};
use egui::{Align2, Key};
use std::path::PathBuf;

/// What a path is asked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Purpose {
    /// A scene, session or image to open.
    Open,
    /// An image to compare with.
    Reference,
    /// Where to save the session.
    SaveSession,
    /// Where to save the scene.
    SaveScene,
    /// A folder for the export.
    Export,
}

impl Purpose {
    fn title(self) -> &'static str {
        match self {
            Self::Open => "Open a scene, session or image",
            Self::Reference => "Compare with a reference image (EXR or PNG)",
            Self::SaveSession => "Save the session",
            Self::SaveScene => "Save the scene as TOML",
            Self::Export => "Export to a folder",
        }
    }

    fn action(self, path: String) -> Action {
        match self {
            Self::Open => Action::OpenFile(path),
            Self::Reference => Action::SetReference(path),
            Self::SaveSession => Action::SaveSessionTo(path),
            Self::SaveScene => Action::SaveSceneTo(path),
            Self::Export => Action::ExportTo(path),
        }
    }
}

/// An open dialog.
pub enum Dialog {
    /// A path, typed or browsed for.
    Path {
        /// For what.
        purpose: Purpose,
        /// The path so far.
        text: String,
        /// Where the system's own dialog answers.
        browsing: Option<Receiver<Option<PathBuf>>>,
    },
    /// A pixel as `x, y`.
    GoTo(String),
    /// All actions, with the text to search for.
    Palette(String),
    /// The sheet of shortcuts.
    Shortcuts,
}

/// At most one dialog at a time.
#[derive(Default)]
pub struct Dialogs {
    open: Option<Dialog>,
    /// Whether it was opened in this frame and wants the keyboard.
    fresh: bool,
}

impl Dialogs {
    /// Opens a dialog in place of any other.
    pub fn open(&mut self, dialog: Dialog) {
        self.open = Some(dialog);
        self.fresh = true;
    }

    /// Asks for a path; `text` is a first suggestion.
    pub fn ask_path(&mut self, purpose: Purpose, text: &str) {
        self.open(Dialog::Path { purpose, text: text.to_owned(), browsing: None });
    }

    /// Closes it; whether there was one.
    pub fn close(&mut self) -> bool {
        self.open.take().is_some()
    }

    /// Whether one is open.
    pub fn is_open(&self) -> bool {
        self.open.is_some()
    }
}

/// What a dialog came to in a frame.
enum End {
    Open,
    Close,
    Do(Action),
}

/// Shows the open dialog; its answer becomes an action.
pub fn show(context: &egui::Context, document: &mut Document, desk: &mut Desk) {
    let Some(mut dialog) = desk.dialogs.open.take() else { return };
    let fresh = std::mem::take(&mut desk.dialogs.fresh);
    let title = match &dialog {
        Dialog::Path { purpose, .. } => purpose.title(),
        Dialog::GoTo(_) => "Go to pixel",
        Dialog::Palette(_) => "All actions",
        Dialog::Shortcuts => "Shortcuts",
    };
    let mut stays = true;
    let shown = egui::Window::new(title)
        .collapsible(false)
        .resizable(false)
        .anchor(Align2::CENTER_TOP, [0.0, 90.0])
        .open(&mut stays)
        .show(context, |ui| match &mut dialog {
            Dialog::Path { purpose, text, browsing } => path(ui, *purpose, text, browsing, fresh),
            Dialog::GoTo(text) => go_to(ui, text, document.settings().size, fresh),
            Dialog::Palette(text) => palette(ui, text, fresh),
            Dialog::Shortcuts => shortcuts(ui),
        });
    let end = shown.and_then(|s| s.inner).unwrap_or(End::Open);
    let escaped = context.input_mut(|i| i.consume_key(egui::Modifiers::NONE, Key::Escape));
    match end {
        End::Do(action) => desk.ask(action),
        End::Open if stays && !escaped => {
            // An action of this frame may have opened another.
            desk.dialogs.open.get_or_insert(dialog);
        }
        End::Open | End::Close => {}
    }
}

/// A one-line field that takes the keyboard when it appears; whether Enter was pressed in it.
fn field(ui: &mut egui::Ui, label: &str, text: &mut String, width: f32, fresh: bool) -> bool {
    let label = ui.label(label);
    let response = ui.add(egui::TextEdit::singleline(text).desired_width(width).font(egui::TextStyle::Monospace));
    let response = response.labelled_by(label.id);
    if fresh {
        response.request_focus();
    }
    response.lost_focus() && ui.input(|i| i.key_pressed(Key::Enter))
}

fn path(
    ui: &mut egui::Ui,
    purpose: Purpose,
    text: &mut String,
    browsing: &mut Option<Receiver<Option<PathBuf>>>,
    fresh: bool,
) -> End {
    let entered = field(ui, "Path", text, 420.0, fresh);
    if let Some(answer) = browsing.as_ref().and_then(|b| b.try_recv().ok()) {
        *browsing = None;
        if let Some(path) = answer {
            *text = path.to_string_lossy().into_owned();
        }
    }
    let mut end = End::Open;
    ui.horizontal(|ui| {
        let can = !text.trim().is_empty();
        let verb = if matches!(purpose, Purpose::Open | Purpose::Reference) { "Open" } else { "Save" };
        if ui.add_enabled(can, egui::Button::new(verb)).clicked() || entered && can {
            end = End::Do(purpose.action(text.trim().to_owned()));
        }
        if ui.add_enabled(browsing.is_none(), egui::Button::new("Browse…")).clicked() {
            *browsing = browse(ui.ctx(), purpose, text);
        }
        if ui.button("Cancel").clicked() {
            end = End::Close;
        }
        if browsing.is_some() {
            ui.spinner();
        }
    });
    ui.weak("If no dialog of the system comes up, type the path here, or drop the file onto the window.");
    end
}

/// The system's own dialog, on a thread of its own because it blocks.
fn browse(context: &egui::Context, purpose: Purpose, text: &str) -> Option<Receiver<Option<PathBuf>>> {
    let (answer, receiver) = bounded(1);
    let (context, text) = (context.clone(), PathBuf::from(text));
    let work = move || {
        let name = text.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
        let dialog = rfd::FileDialog::new().set_title(purpose.title());
        let picked = match purpose {
            Purpose::Open => {
                dialog.add_filter("scenes, sessions and images", &["toml", "obj", "exr", "png"]).pick_file()
            }
            Purpose::Reference => dialog.add_filter("images", &["exr", "png"]).pick_file(),
            Purpose::SaveSession | Purpose::SaveScene => {
                dialog.add_filter("TOML", &["toml"]).set_file_name(name).save_file()
            }
            Purpose::Export => dialog.pick_folder(),
        };
        let _ = answer.send(picked);
        context.request_repaint();
    };
    std::thread::Builder::new().name("cusp-dialog".into()).spawn(work).ok().map(|_| receiver)
}

fn go_to(ui: &mut egui::Ui, text: &mut String, size: [u32; 2], fresh: bool) -> End {
    let entered = field(ui, "x, y", text, 140.0, fresh);
    let numbers: Vec<u32> = text.split([',', ' ']).filter(|p| !p.is_empty()).map_while(|p| p.parse().ok()).collect();
    let pixel = match numbers.as_slice() {
        &[x, y] if x < size[0] && y < size[1] => Some([x, y]),
        _ => None,
    };
    ui.weak(format!("0, 0 is the upper left corner; the last pixel is {}, {}", size[0] - 1, size[1] - 1));
    let clicked = ui.add_enabled(pixel.is_some(), egui::Button::new("Go")).clicked();
    match pixel {
        Some(pixel) if clicked || entered => End::Do(Action::Pin(pixel)),
        _ => End::Open,
    }
}

/// Height of a list that leaves room for the rest of its dialog in a low window, points.
fn list_height(ui: &egui::Ui) -> f32 {
    (ui.ctx().content_rect().height() - 220.0).clamp(80.0, 420.0)
}

fn palette(ui: &mut egui::Ui, text: &mut String, fresh: bool) -> End {
    let entered = field(ui, "Search", text, 300.0, fresh);
    let words: Vec<String> = text.split_whitespace().map(str::to_lowercase).collect();
    let found: Vec<_> =
        entries().into_iter().filter(|e| words.iter().all(|w| e.title.to_lowercase().contains(w))).collect();
    let mut end = End::Open;
    egui::ScrollArea::vertical().max_height(list_height(ui)).show(ui, |ui| {
        egui::Grid::new("palette").num_columns(2).striped(true).show(ui, |ui| {
            for e in &found {
                if ui.add(egui::Button::new(e.title).frame(false)).clicked() {
                    end = End::Do(e.action.clone());
                }
                ui.label(mono(e.shortcut.map_or(String::new(), |s| ui.ctx().format_shortcut(&s))));
                ui.end_row();
            }
        });
        if found.is_empty() {
            ui.weak("no action of that name");
        }
    });
    match found.first() {
        Some(first) if entered => End::Do(first.action.clone()),
        _ => end,
    }
}

fn shortcuts(ui: &mut egui::Ui) -> End {
    let more = [
        ("Pin the pixel under the pointer", "click"),
        ("Move the pin by one pixel, by ten", "arrows, Shift+arrows"),
        ("Show the other side of the comparison", "hold B"),
        ("Pan", "drag"),
        ("Zoom", "wheel, pinch"),
        ("Fill the middle with a panel", "double click"),
        ("Orbit the camera", "right drag"),
    ];
    egui::ScrollArea::vertical().max_height(list_height(ui)).show(ui, |ui| {
        egui::Grid::new("shortcuts").num_columns(2).striped(true).show(ui, |ui| {
            let keys =
                entries().into_iter().filter_map(|e| e.shortcut.map(|s| (e.title, ui.ctx().format_shortcut(&s))));
            for (title, key) in keys.chain(more.map(|(t, k)| (t, k.to_owned()))).collect::<Vec<_>>() {
                ui.label(title);
                ui.label(mono(key));
                ui.end_row();
            }
        });
    });
    End::Open
}
