//! Plots: error against run time, time by phase, footprint areas.

use super::Panes;
use egui::Ui;

pub(super) fn errors(_panes: &mut Panes, ui: &mut Ui) {
    ui.weak("No reference is loaded.");
}

pub(super) fn times(_panes: &mut Panes, ui: &mut Ui) {
    ui.weak("No pass is done.");
}

pub(super) fn areas(_panes: &mut Panes, ui: &mut Ui) {
    ui.weak("No photon is stored.");
}
