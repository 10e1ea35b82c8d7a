//! The parts of the window, one file each.

mod camera;
mod display;
mod estimators;
mod final_gathering;
mod gather_overlay;
mod image;
mod inspector;
mod messages;
mod overlay;
mod overlays;
mod photons;
mod plan;
mod plots;
mod scene;
pub mod widgets;

use super::desk::Desk;
use super::document::Document;
use super::gallery::Gallery;
use super::layout::Pane;
use super::messages::Messages;
use super::render::Render;
use super::theme;
use egui_tiles::{Behavior, SimplificationOptions, TileId, UiResponse};
use std::time::{Duration, Instant};

/// Time per frame for bringing textures up to date.
const TEXTURE_TIME: Duration = Duration::from_millis(6);

/// What panes draw and edit in a frame.
pub struct Panes<'a> {
    /// The session and its scene.
    pub document: &'a mut Document,
    /// The render.
    pub render: &'a Render,
    /// The images.
    pub gallery: &'a mut Gallery,
    /// The messages.
    pub messages: &'a mut Messages,
    /// The rest.
    pub desk: &'a mut Desk,
    /// When the frame began.
    pub started: Instant,
}

impl Panes<'_> {
    /// Whether this frame has spent its time on textures.
    fn is_late(&self) -> bool {
        self.started.elapsed() > TEXTURE_TIME
    }

    /// An image panel that fills the middle.
    pub fn image_alone(&mut self, ui: &mut egui::Ui, panel: usize) {
        image::show(self, ui, panel);
    }
}

impl Behavior<Pane> for Panes<'_> {
    fn pane_ui(&mut self, ui: &mut egui::Ui, _tile: TileId, pane: &mut Pane) -> UiResponse {
        if let Pane::Image(panel) = pane {
            return if image::show(self, ui, *panel) { UiResponse::DragStarted } else { UiResponse::None };
        }
        // What a pane holds may be less than its place.
        ui.painter().rect_filled(ui.max_rect(), 0.0, ui.visuals().panel_fill);
        egui::Frame::new().inner_margin(6).show(ui, |ui| {
            let scroll = egui::ScrollArea::vertical().auto_shrink(false);
            match pane {
                Pane::ErrorPlot => plots::errors(self, ui),
                Pane::TimePlot => plots::times(self, ui),
                Pane::AreaPlot => plots::areas(self, ui),
                Pane::Inspector => inspector::show(self, ui),
                other => {
                    scroll.id_salt(other.title()).show(ui, |ui| match other {
                        Pane::Scene => scene::show(self, ui),
                        Pane::Camera => camera::show(self, ui),
                        Pane::Photons => photons::show(self, ui),
                        Pane::Estimators => estimators::show(self, ui),
                        Pane::Display => display::show(self, ui),
                        Pane::Overlays => overlays::show(self, ui),
                        Pane::Plan => plan::show(self, ui),
                        Pane::Messages => messages::show(self, ui),
                        _ => {}
                    });
                }
            }
        });
        UiResponse::None
    }

    fn tab_title_for_pane(&mut self, pane: &Pane) -> egui::WidgetText {
        match pane {
            Pane::Image(i) => match self.document.session.panels.get(*i) {
                Some(panel) => image::title(panel).into(),
                None => pane.title().into(),
            },
            _ => pane.title().into(),
        }
    }

    fn simplification_options(&self) -> SimplificationOptions {
        SimplificationOptions { all_panes_must_have_tabs: false, ..Default::default() }
    }

    fn gap_width(&self, _style: &egui::Style) -> f32 {
        3.0
    }

    fn tab_bar_color(&self, _visuals: &egui::Visuals) -> egui::Color32 {
        egui::Color32::from_gray(30)
    }

    fn dragged_overlay_color(&self, _visuals: &egui::Visuals) -> egui::Color32 {
        theme::STALE
    }
}
