//! A row of the inspector's lists: bright under the pointer, chosen by a click, with its cells of text.

use crate::workbench::theme::mono;
use egui::{Align, Color32, Layout, Rect, Response, Sense, Ui, Vec2, pos2, vec2};

/// What is picked in a list, by place.
pub struct Picks<'a> {
    /// Under the pointer in this frame.
    pub hovered: &'a mut Option<usize>,
    /// Clicked.
    pub chosen: &'a mut Option<usize>,
    /// Drawn bright: under the pointer in the frame before.
    pub bright: Option<usize>,
}

/// Makes room of `size` points for row `index`, whose name is `name`, and draws what lies behind its cells.
pub fn row(ui: &mut Ui, size: Vec2, name: &str, index: usize, picks: &mut Picks) -> (Rect, Response) {
    let (rect, response) = ui.allocate_exact_size(size, Sense::click());
    response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Button, true, name));
    if response.hovered() {
        *picks.hovered = Some(index);
    }
    if response.clicked() {
        *picks.chosen = if *picks.chosen == Some(index) { None } else { Some(index) };
    }
    if *picks.chosen == Some(index) {
        ui.painter().rect_filled(rect, 2.0, Color32::from_rgb(30, 70, 100));
    } else if picks.bright == Some(index) {
        ui.painter().rect_filled(rect, 2.0, Color32::from_gray(64));
    }
    (rect, response)
}

/// Draws the text of the cell of a row that begins at `left` and is `width` points wide.
pub fn cell(ui: &mut Ui, row: Rect, left: f32, width: f32, align: Align, text: String) {
    let cell = Rect::from_min_size(pos2(left, row.top()), vec2(width - 4.0, row.height()));
    let mut ui = ui.new_child(egui::UiBuilder::new().max_rect(cell).layout(Layout::top_down(align)));
    ui.add(egui::Label::new(mono(text).size(11.0)).truncate().selectable(false));
}
