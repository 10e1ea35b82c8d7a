//! Everything that a menu, a key or the palette can do.

use egui::{Key, KeyboardShortcut, Modifiers};

/// An act of the user.
#[derive(Clone, Debug, PartialEq)]
pub enum Action {
    /// Open a scene by its name or path.
    OpenScene(String),
    /// Open a scene, session or image that a dialog names.
    OpenDialog,
    /// Open a file, whatever it is.
    OpenFile(String),
    /// Ask for an image to compare with.
    OpenReference,
    /// Compare with the image of this file.
    SetReference(String),
    /// Compare with the scene's own reference.
    OwnReference,
    /// Save the session, to its own file if it has one.
    SaveSession,
    /// Save the session to a file that a dialog names.
    SaveSessionAs,
    /// Save the session to this file.
    SaveSessionTo(String),
    /// Save the scene with its edits as TOML.
    SaveScene,
    /// Save the scene to this file.
    SaveSceneTo(String),
    /// Export crop, sheet, timings and images.
    Export,
    /// Export them to this folder.
    ExportTo(String),
    /// Read the scene's files again.
    Reload,
    /// Close the window.
    Quit,
    /// Take a step back.
    Undo,
    /// Take a step forth again.
    Redo,
    /// Copy the readout under the pointer as text.
    CopyReadout,
    /// Pause, or go on.
    Pause,
    /// Render one tile.
    StepTile,
    /// Render to the end of a pass.
    StepPass,
    /// Start another render thread.
    RestartWorker,
    /// Show the whole image.
    Fit,
    /// One point for each pixel.
    OneToOne,
    /// Zoom by a factor about the middle.
    Zoom(f32),
    /// The real-time view, or the progressive one.
    SwitchRendering,
    /// Each panel by itself.
    Grid,
    /// Panels split against the other.
    Split,
    /// Differences to the other.
    Difference,
    /// The next kind of difference.
    NextDifference,
    /// Compare with this panel, or with the reference.
    CompareWith(Option<usize>),
    /// Brighter or darker, in stops.
    Exposure(f32),
    /// Exposure from the images, or fixed.
    AutoExposure,
    /// The next false colour, or none.
    FalseColor,
    /// An overlay on or off.
    Overlay(&'static str),
    /// Add a panel.
    AddPanel(String),
    /// Remove a panel.
    RemovePanel(usize),
    /// Let a panel fill the middle, or give it back its place.
    Maximize(usize),
    /// Ask for a pixel to go to.
    GoToPixel,
    /// Pin a pixel.
    Pin([u32; 2]),
    /// Move the pin.
    Nudge([i32; 2]),
    /// Remove all pins.
    Unpin,
    /// Drag a rectangle for the crop.
    SelectCrop,
    /// Remove the crop.
    ClearCrop,
    /// All parts of the window at their places.
    ResetLayout,
    /// The list of all actions.
    Palette,
    /// The sheet of shortcuts.
    Shortcuts,
    /// Dismiss all messages.
    DismissMessages,
}

/// A menu.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Menu {
    /// Files.
    File,
    /// Edits.
    Edit,
    /// Rendering.
    Render,
    /// What is seen.
    View,
    /// Overlays.
    Overlays,
    /// Help.
    Help,
}

/// An action on offer.
pub struct Entry {
    /// What it does.
    pub action: Action,
    /// Its name.
    pub title: &'static str,
    /// Where it is found.
    pub menu: Menu,
    /// Its key.
    pub shortcut: Option<KeyboardShortcut>,
}

const NONE: Modifiers = Modifiers::NONE;
const CTRL: Modifiers = Modifiers::COMMAND;
const CTRL_SHIFT: Modifiers = Modifiers { shift: true, ..Modifiers::COMMAND };

/// All actions that need no argument, in the order of the menus.
pub fn entries() -> Vec<Entry> {
    let entry = |menu, title, action, shortcut: Option<(Modifiers, Key)>| Entry {
        action,
        title,
        menu,
        shortcut: shortcut.map(|(m, k)| KeyboardShortcut::new(m, k)),
    };
    let mut all = vec![
        entry(Menu::File, "Open…", Action::OpenDialog, Some((CTRL, Key::O))),
        entry(Menu::File, "Compare with a reference image…", Action::OpenReference, None),
        entry(Menu::File, "Compare with the scene's own reference", Action::OwnReference, None),
        entry(Menu::File, "Save session", Action::SaveSession, Some((CTRL, Key::S))),
        entry(Menu::File, "Save session as…", Action::SaveSessionAs, Some((CTRL_SHIFT, Key::S))),
        entry(Menu::File, "Save scene as TOML…", Action::SaveScene, None),
        entry(Menu::File, "Export crop, sheet and timings…", Action::Export, Some((CTRL, Key::E))),
        entry(Menu::File, "Reload the scene", Action::Reload, Some((CTRL, Key::R))),
        entry(Menu::File, "Quit", Action::Quit, Some((CTRL, Key::Q))),
        entry(Menu::Edit, "Undo", Action::Undo, Some((CTRL, Key::Z))),
        entry(Menu::Edit, "Redo", Action::Redo, Some((CTRL_SHIFT, Key::Z))),
        entry(Menu::Edit, "Copy the readout", Action::CopyReadout, Some((CTRL_SHIFT, Key::C))),
        entry(Menu::Edit, "Select a crop", Action::SelectCrop, Some((NONE, Key::C))),
        entry(Menu::Edit, "Remove the crop", Action::ClearCrop, None),
        entry(Menu::Render, "Pause or go on", Action::Pause, Some((NONE, Key::Space))),
        entry(Menu::Render, "Step one tile", Action::StepTile, Some((NONE, Key::Period))),
        entry(Menu::Render, "Step one pass", Action::StepPass, Some((NONE, Key::Comma))),
        entry(Menu::Render, "Restart the render thread", Action::RestartWorker, None),
        entry(Menu::View, "Real-time or progressive", Action::SwitchRendering, Some((NONE, Key::F5))),
        entry(Menu::View, "Fit", Action::Fit, Some((NONE, Key::F))),
        entry(Menu::View, "One to one", Action::OneToOne, Some((NONE, Key::Num1))),
        entry(Menu::View, "Zoom in", Action::Zoom(2.0), Some((NONE, Key::Plus))),
        entry(Menu::View, "Zoom out", Action::Zoom(0.5), Some((NONE, Key::Minus))),
        entry(Menu::View, "Grid", Action::Grid, Some((NONE, Key::G))),
        entry(Menu::View, "Split", Action::Split, Some((NONE, Key::S))),
        entry(Menu::View, "Difference", Action::Difference, Some((NONE, Key::D))),
        entry(Menu::View, "Next kind of difference", Action::NextDifference, Some((Modifiers::SHIFT, Key::D))),
        entry(Menu::View, "Brighter", Action::Exposure(0.5), Some((NONE, Key::E))),
        entry(Menu::View, "Darker", Action::Exposure(-0.5), Some((Modifiers::SHIFT, Key::E))),
        entry(Menu::View, "Automatic exposure and range", Action::AutoExposure, Some((NONE, Key::A))),
        entry(Menu::View, "Next false colour", Action::FalseColor, Some((NONE, Key::M))),
        entry(Menu::View, "Go to pixel…", Action::GoToPixel, Some((CTRL, Key::G))),
        entry(Menu::View, "Remove all pins", Action::Unpin, Some((NONE, Key::Escape))),
        entry(Menu::View, "Reset the layout", Action::ResetLayout, None),
    ];
    all.extend(
        super::overlays::ALL.iter().map(|o| entry(Menu::Overlays, o.title, Action::Overlay(o.id), Some((NONE, o.key)))),
    );
    all.extend([
        entry(Menu::Help, "All actions…", Action::Palette, Some((CTRL, Key::P))),
        entry(Menu::Help, "Shortcuts", Action::Shortcuts, Some((NONE, Key::F1))),
        entry(Menu::Help, "Dismiss all messages", Action::DismissMessages, None),
    ]);
    all
}

/// The actions whose keys were pressed in this frame; none while text is typed. Plain letters and arrows are left to the
/// walk while the real-time view is shown (`live`).
pub fn pressed(context: &egui::Context, live: bool) -> Vec<Action> {
    let typing = context.text_edit_focused();
    let focused = context.memory(|m| m.focused().is_some());
    let mut all = Vec::new();
    context.input_mut(|input| {
        let mut offers: Vec<(KeyboardShortcut, Action)> =
            entries().into_iter().filter_map(|e| e.shortcut.map(|s| (s, e.action))).collect();
        // A shortcut also matches when more modifiers are held, so those with Shift come first.
        offers.sort_by_key(|(s, _)| !s.modifiers.shift);
        for (shortcut, action) in offers {
            let plain = !shortcut.modifiers.command;
            let function = matches!(shortcut.logical_key, Key::F1 | Key::F5 | Key::Space | Key::Period);
            if live && plain && !function {
                continue;
            }
            if !(typing && plain) && input.consume_shortcut(&shortcut) {
                all.push(action);
            }
        }
        for (key, step) in
            [(Key::ArrowLeft, [-1, 0]), (Key::ArrowRight, [1, 0]), (Key::ArrowUp, [0, -1]), (Key::ArrowDown, [0, 1])]
        {
            for (modifiers, by) in [(Modifiers::SHIFT, 10), (NONE, 1)] {
                if !focused && !live && input.consume_key(modifiers, key) {
                    all.push(Action::Nudge(step.map(|s| s * by)));
                }
            }
        }
    });
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_two_actions_share_a_key() {
        let all = entries();
        for (i, a) in all.iter().enumerate() {
            for b in &all[..i] {
                assert!(a.shortcut.is_none() || a.shortcut != b.shortcut, "{} and {}", a.title, b.title);
                assert!(a.title != b.title);
            }
        }
    }
}
