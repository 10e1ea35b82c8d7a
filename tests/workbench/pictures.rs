//! Pictures of the window, kept in `tests/snapshots/`: every part of it, on fixed seeds, without times.

use super::renderer::check;
use super::window::{Window, beside, images_only, lit, on_screen, open, open_at, settle, small, type_text};
use cusp::export::session::{Difference, Mode, Panel, Session};
use cusp::render::heatmap::Heatmap;
use cusp::workbench::actions::Action;
use cusp::workbench::layout::Pane;
use egui_kittest::kittest::{NodeT, Queryable};

/// Points of a window that holds little.
const LITTLE: [f32; 2] = [400.0, 300.0];
/// Points of a window beside whose image a pane stands.
const PANE: [f32; 2] = [640.0, 480.0];

/// A window of 800×600 pixels at 1.5 pixels for each point is 792×600 here, so that points are whole.
const AT_1_5: [f32; 2] = [528.0, 400.0];

fn images(panels: usize) -> Session {
    images_only(small("ring", panels))
}

fn picture(session: Session, size: [f32; 2], name: &str) {
    check(&mut open_at(session, size, 1.0), name);
}

#[test]
fn first_start() {
    picture(small("ring", 4), [800.0, 600.0], "first_start");
}

#[test]
fn first_start_at_1_5() {
    check(&mut open_at(small("ring", 4), AT_1_5, 1.5), "first_start_1_5");
}

#[test]
fn grid_at_1_5() {
    check(&mut open_at(images(4), [264.0, 200.0], 1.5), "grid_1_5");
}

fn split() -> Session {
    let mut session = images(2);
    session.comparison.mode = Mode::Split;
    session.comparison.with = Some(1);
    session.comparison.divider = 0.4;
    session
}

#[test]
fn split_panels() {
    picture(split(), LITTLE, "split");
}

#[test]
fn split_against_the_reference() {
    let mut session = images(2);
    session.comparison.mode = Mode::Split;
    picture(session, LITTLE, "split_reference");
}

#[test]
fn the_other_side() {
    let mut session = images(2);
    session.comparison.with = Some(1);
    let mut window = open_at(session, LITTLE, 1.0);
    window.key_down(egui::Key::B);
    window.step();
    settle(&mut window);
    check(&mut window, "other_side");
}

fn difference(kind: Difference, name: &str) {
    let mut session = images(2);
    session.comparison.mode = Mode::Difference;
    session.comparison.with = Some(1);
    session.comparison.difference = kind;
    picture(session, LITTLE, name);
}

#[test]
fn signed_difference() {
    difference(Difference::Signed, "difference_signed");
}

#[test]
fn absolute_difference() {
    difference(Difference::Absolute, "difference_absolute");
}

#[test]
fn relative_difference() {
    difference(Difference::Relative, "difference_relative");
}

#[test]
fn flip() {
    difference(Difference::Flip, "difference_flip");
}

#[test]
fn difference_to_the_reference() {
    let mut session = images(1);
    session.comparison.mode = Mode::Difference;
    picture(session, LITTLE, "difference_reference");
}

#[test]
fn false_color() {
    let mut session = images(1);
    session.tone.false_color = Some("viridis".into());
    picture(session, LITTLE, "false_color");
}

/// Six panels, each with another heatmap.
fn heatmaps() -> Session {
    let mut session = small("ring", 1);
    let kinds = Heatmap::ALL.iter().filter(|h| **h != Heatmap::TileMilliseconds);
    let panel = |h: &Heatmap| Panel { heatmap: Some(h.id().to_owned()), ..session.panels[0].clone() };
    session.panels = kinds.map(panel).collect();
    images_only(session)
}

#[test]
fn heatmaps_at_1() {
    picture(heatmaps(), [720.0, 420.0], "heatmaps");
}

/// One image with overlays, a pinned pixel and the pointer on another; zoomed in where light gathers.
fn overlays(ids: &[&str], panel: usize, zoom: f32) -> Window {
    let mut session = images(4);
    session.panels.swap(0, panel);
    session.panels.truncate(1);
    let mut session = images_only(Session { layout: None, ..session });
    session.overlays = ids.iter().map(|id| (*id).to_owned()).collect();
    let pixel = lit(&session);
    session.pins = vec![pixel];
    session.view.zoom = zoom;
    session.view.center = pixel.map(|x| (x as f32 + 0.5) / 96.0);
    let mut window = open_at(session, LITTLE, 1.0);
    let at = on_screen(&window, 0, [pixel[0] - 1, pixel[1] + 1]);
    window.hover_at(at);
    settle(&mut window);
    window
}

#[test]
fn footprint_overlay() {
    check(&mut overlays(&["footprint"], 3, 16.0), "overlay_footprint");
}

#[test]
fn photon_overlay() {
    check(&mut overlays(&["photons"], 0, 4.0), "overlay_photons");
}

#[test]
fn sample_overlay() {
    check(&mut overlays(&["samples"], 1, 64.0), "overlay_samples");
}

#[test]
fn polygon_overlay() {
    check(&mut overlays(&["polygons"], 2, 64.0), "overlay_polygons");
}

#[test]
fn tile_overlay() {
    check(&mut overlays(&["tiles"], 0, 3.0), "overlay_tiles");
}

#[test]
fn path_overlay() {
    let mut session = images_only(Session { overlays: vec!["path".into()], ..small("glass_sphere", 1) });
    session.pins = vec![[48, 48]];
    picture(session, LITTLE, "overlay_path");
}

#[test]
fn pins_and_crop() {
    let mut session = images(2);
    session.pins = vec![[10, 10], [60, 60]];
    session.crop = Some([30, 40, 40, 30]);
    picture(session, LITTLE, "pins_and_crop");
}

fn inspector(size: [f32; 2], pixels_per_point: f32, choose: bool) -> Window {
    let mut session = beside(small("ring", 4), Pane::Inspector);
    session.pins = vec![lit(&session)];
    let mut window = open_at(session, size, pixels_per_point);
    if !choose {
        return window;
    }
    let row = {
        let rows = window.query_all_by_label_contains("photon ").filter_map(|n| n.accesskit_node().label());
        rows.filter(|l| l.starts_with("photon ")).nth(1).expect("the second row is seen")
    };
    window.get_by_label(&row).click();
    settle(&mut window);
    window.remove_cursor();
    settle(&mut window);
    window
}

#[test]
fn inspector_with_a_chosen_row() {
    check(&mut inspector([800.0, 600.0], 1.0, true), "inspector");
}

#[test]
fn inspector_at_1_5() {
    check(&mut inspector([400.0, 400.0], 1.5, false), "inspector_1_5");
}

fn pane(pane: Pane, name: &str) {
    picture(beside(small("ring", 2), pane), PANE, name);
}

#[test]
fn estimators_pane() {
    pane(Pane::Estimators, "pane_estimators");
}

#[test]
fn scene_pane() {
    pane(Pane::Scene, "pane_scene");
}

#[test]
fn camera_pane() {
    pane(Pane::Camera, "pane_camera");
}

#[test]
fn photons_pane() {
    pane(Pane::Photons, "pane_photons");
}

#[test]
fn display_pane() {
    let mut session = beside(small("ring", 2), Pane::Display);
    session.tone.auto = false;
    session.tone.exposure = 1.0;
    session.tone.false_color = Some("viridis".into());
    picture(session, PANE, "pane_display");
}

#[test]
fn overlays_pane() {
    let session = Session { overlays: vec!["footprint".into()], ..small("ring", 2) };
    picture(beside(session, Pane::Overlays), PANE, "pane_overlays");
}

#[test]
fn plan_pane() {
    pane(Pane::Plan, "pane_plan");
}

/// Times and memory, and below them what was bounded: paths that the bounce limit ended, and their power.
#[test]
fn bounded_in_the_plan() {
    let mut session = beside(small("cornell", 1), Pane::Plan);
    session.render.max_depth = Some(3);
    picture(session, [640.0, 860.0], "plan_bounded");
}

#[test]
fn areas_plot() {
    picture(beside(small("glass_sphere", 1), Pane::AreaPlot), PANE, "plot_areas");
}

#[test]
fn messages_with_an_error() {
    let mut window = open_at(beside(small("ring", 1), Pane::Messages), PANE, 1.0);
    window.state_mut().run(Action::OpenFile("no/such/scene.toml".into()));
    window.state_mut().run(Action::OpenFile("no/such/image.exr".into()));
    settle(&mut window);
    check(&mut window, "messages");
}

fn dialog(actions: &[Action], typed: &str, name: &str) {
    let mut window = open_at(images(1), PANE, 1.0);
    actions.iter().for_each(|a| window.state_mut().run(a.clone()));
    settle(&mut window);
    type_text(&mut window, typed);
    settle(&mut window);
    check(&mut window, name);
}

#[test]
fn palette() {
    dialog(&[Action::Palette], "ov", "dialog_palette");
}

#[test]
fn shortcut_sheet() {
    dialog(&[Action::Shortcuts], "", "dialog_shortcuts");
}

#[test]
fn path_dialog() {
    dialog(&[Action::OpenDialog], "scenes/ring", "dialog_path");
}

#[test]
fn go_to_pixel_dialog() {
    dialog(&[Action::GoToPixel], "12, 300", "dialog_go_to");
}

#[test]
fn a_menu() {
    let mut window = open_at(images(1), PANE, 1.0);
    window.get_by_label("View").click();
    window.remove_cursor();
    settle(&mut window);
    check(&mut window, "menu_view");
}

/// A scene with neither light nor surface.
#[test]
fn empty_scene() {
    let mut window = open(small("tests/workbench/empty.toml", 2));
    settle(&mut window);
    check(&mut window, "empty_scene");
}

/// A room under final gathering, a pixel of its floor pinned, with overlays.
fn gathering(estimator: &str, overlays: &[&str]) -> Session {
    let overlays = overlays.iter().map(|id| (*id).to_owned()).collect();
    let panels = vec![Panel::of(estimator)];
    Session { panels, overlays, pins: vec![[24, 86]], ..small("two_lights", 1) }
}

const GATHERED: &str = "integrated+ray-differentials:rays=64";

/// The hemisphere with the rays' discs, their table, and the chosen ray in the image.
#[test]
fn gather_rays_in_the_inspector() {
    let session = beside(gathering(GATHERED, &["gather_rays"]), Pane::Inspector);
    let mut window = open_at(session, [900.0, 600.0], 1.0);
    window.get_by_label("gather ray 2").click();
    settle(&mut window);
    window.remove_cursor();
    settle(&mut window);
    check(&mut window, "gather_rays");
}

#[test]
fn irradiance_overlay() {
    let session = beside(gathering(GATHERED, &["irradiance"]), Pane::Overlays);
    let mut window = open_at(Session { pins: vec![], ..session }, [900.0, 480.0], 1.0);
    window.state_mut().show_gathering(None, 1);
    settle(&mut window);
    check(&mut window, "overlay_irradiance");
}

#[test]
fn final_gathering_in_the_estimators_pane() {
    let mut session = gathering("integrated+ray-differentials:rays=64,radius=0.2,near=0.1", &[]);
    session.panels[0].heatmap = Some("photons".into());
    picture(beside(session, Pane::Estimators), PANE, "pane_final_gathering");
}

#[test]
fn final_gathering_in_the_plan() {
    picture(beside(gathering(GATHERED, &[]), Pane::Plan), [640.0, 1080.0], "plan_final_gathering");
}
