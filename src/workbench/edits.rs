//! Actions that only edit the session or the desk.

use super::actions::Action;
use super::desk::Desk;
use super::dialogs::{Dialog, Purpose};
use super::gallery::Gallery;
use crate::estimate::registry;
use crate::export::false_color::ColorMap;
use crate::export::session::{Difference, Mode, Panel, Rendering, Session, View};

/// Zoom of the keys, if nothing else says where.
const LEAST_ZOOM: f32 = 1.0 / 16.0;

/// Edits `session` and `desk` as `action` asks; others are ignored.
pub fn apply(action: &Action, session: &mut Session, desk: &mut Desk, gallery: &Gallery) {
    match action {
        Action::Fit => session.view = View::default(),
        Action::OneToOne => session.view.zoom = 1.0,
        Action::Zoom(factor) => {
            let zoom = if session.view.zoom > 0.0 { session.view.zoom } else { 1.0 };
            session.view.zoom = (zoom * factor).clamp(LEAST_ZOOM, 256.0);
        }
        Action::SwitchRendering => {
            session.rendering = match session.rendering {
                Rendering::Progressive => Rendering::Realtime,
                Rendering::Realtime => Rendering::Progressive,
            };
        }
        Action::Grid => session.comparison.mode = Mode::Grid,
        Action::Split => toggle(&mut session.comparison.mode, Mode::Split),
        Action::Difference => toggle(&mut session.comparison.mode, Mode::Difference),
        Action::NextDifference => {
            session.comparison.difference = match session.comparison.difference {
                Difference::Signed => Difference::Absolute,
                Difference::Absolute => Difference::Relative,
                Difference::Relative => Difference::Flip,
                Difference::Flip => Difference::Signed,
            };
        }
        Action::OpenReference => desk.dialogs.ask_path(Purpose::Reference, ""),
        Action::SetReference(path) => (session.reference, session.mask) = (Some(path.clone()), None),
        Action::OwnReference => (session.reference, session.mask) = (None, None),
        Action::CompareWith(with) => session.comparison.with = *with,
        Action::Exposure(stops) => {
            if session.tone.auto {
                session.tone.auto = false;
                session.tone.exposure = desk.auto_exposure;
            }
            session.tone.exposure = (session.tone.exposure + stops).clamp(-40.0, 40.0);
        }
        Action::AutoExposure => {
            session.tone.auto = !session.tone.auto;
            session.tone.exposure = desk.auto_exposure;
        }
        Action::FalseColor => {
            let names: Vec<&str> = ColorMap::ALL.iter().map(|m| m.name()).collect();
            let at = session.tone.false_color.as_ref().and_then(|n| names.iter().position(|m| m == n));
            let next = at.map_or(0, |i| i + 1);
            session.tone.false_color = names.get(next).map(|n| (*n).to_owned());
        }
        Action::Overlay(id) => match session.overlays.iter().position(|o| o == id) {
            Some(at) => drop(session.overlays.remove(at)),
            None => session.overlays.push((*id).to_owned()),
        },
        Action::AddPanel(estimator) => {
            if let Ok(e) = registry::estimator(estimator) {
                session.panels.push(Panel::of(e.name()));
            }
        }
        Action::Maximize(panel) => {
            desk.maximized = if desk.maximized == Some(*panel) { None } else { Some(*panel) };
        }
        Action::Pin(pixel) => pin(session, *pixel),
        Action::Nudge(step) => nudge(session, *step, gallery),
        Action::Unpin => escape(session, desk),
        Action::SelectCrop => desk.crop_drag = Some(None),
        Action::ClearCrop => session.crop = None,
        Action::GoToPixel => desk.dialogs.open(Dialog::GoTo(String::new())),
        Action::Palette => desk.dialogs.open(Dialog::Palette(String::new())),
        Action::Shortcuts => desk.dialogs.open(Dialog::Shortcuts),
        _ => {}
    }
}

/// Ends the crop that is dragged, or else closes the dialog, or else removes the pins.
fn escape(session: &mut Session, desk: &mut Desk) {
    if desk.crop_drag.take().is_none() && !desk.dialogs.close() {
        session.pins.clear();
    }
}

fn toggle(mode: &mut Mode, to: Mode) {
    *mode = if *mode == to { Mode::Grid } else { to };
}

/// Pins a pixel, the inspected one; one that is pinned already comes to the front.
fn pin(session: &mut Session, pixel: [u32; 2]) {
    session.pins.retain(|p| *p != pixel);
    session.pins.push(pixel);
}

/// Moves the inspected pin, inside the image.
fn nudge(session: &mut Session, step: [i32; 2], gallery: &Gallery) {
    let Some(size) = session.panels.iter().find_map(|p| gallery.of(p)).map(|i| i.size()) else { return };
    if let Some(pin) = session.pins.last_mut() {
        for axis in 0..2 {
            pin[axis] = pin[axis].saturating_add_signed(step[axis]).min(size[axis].saturating_sub(1));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::render::film::Image;
    use crate::workbench::gallery::tiled::TiledImage;

    #[test]
    fn pins_move_inside_the_image() {
        let (mut session, mut desk, mut gallery) = (Session::of("ring"), Desk::default(), Gallery::default());
        gallery.put_file("a", TiledImage::of(&Image::black([10, 5])));
        session.panels = vec![Panel { image: Some("a".into()), ..Panel::of("") }];
        let mut run = |action: Action| {
            apply(&action, &mut session, &mut desk, &gallery);
            session.pins.clone()
        };
        assert_eq!(run(Action::Nudge([1, 1])), Vec::<[u32; 2]>::new());
        run(Action::Pin([9, 0]));
        assert_eq!(run(Action::Nudge([1, -1])), [[9, 0]]);
        assert_eq!(run(Action::Nudge([-10, 10])), [[0, 4]]);
        run(Action::Pin([1, 1]));
        assert_eq!(run(Action::Pin([0, 4])), [[1, 1], [0, 4]]);
        assert!(run(Action::Unpin).is_empty());
    }

    #[test]
    fn exposure_starts_from_what_is_seen() {
        let (mut session, mut desk) = (Session::of("ring"), Desk { auto_exposure: 2.0, ..Default::default() });
        apply(&Action::Exposure(0.5), &mut session, &mut desk, &Gallery::default());
        assert_eq!((session.tone.auto, session.tone.exposure), (false, 2.5));
        apply(&Action::AutoExposure, &mut session, &mut desk, &Gallery::default());
        assert!(session.tone.auto);
    }
}
