//! What frames took: frame rate and fluctuation over the last frames, the time of each phase, counts.

use super::LiveView;
use crate::export::plot::INKS;
use crate::realtime::PhaseSeconds;
use crate::workbench::panes::widgets::{fact, rows};
use crate::workbench::theme::mono;
use egui::{Color32, Sense, Ui, vec2};
use egui_plot::{Legend, Line, Plot, PlotPoints};

impl LiveView {
    pub(super) fn statistics(&self, ui: &mut Ui, untimed: bool) {
        let Some(frame) = &self.last else { return };
        let r = &frame.report;
        if untimed {
            ui.weak("Times differ from run to run and are not shown in pictures.");
        } else {
            self.phases(ui);
            self.plots(ui);
        }
        rows(ui, "frame", |ui| {
            fact(ui, "frame, time of the scene", format!("{}, {:.2} s", r.frame, r.time));
            fact(ui, "picture", format!("{}x{} pixels", frame.image.size[0], frame.image.size[1]));
            fact(ui, "photons in the map", format!("{} of {} frames", r.photons_in_map, r.frames_in_map));
            fact(ui, "emitted, stored a frame", format!("{}, {}", r.photons_emitted, r.photons_stored));
            fact(ui, "photon rays, lost", format!("{}, {}", r.photon_rays, r.photon_rays_lost));
            fact(ui, "mesh", format!("{} triangles, {} vertices", frame.mesh[0], frame.mesh[1]));
            fact(ui, "visible triangles", r.triangles_visible.to_string());
            fact(ui, "estimates, view rays", format!("{}, {}", r.estimates, r.view_rays));
            fact(ui, "search radius", format!("{:.3} m", r.search_radius));
            fact(ui, "fluctuation", format!("{:.2} %", 100.0 * r.fluctuation));
        });
    }

    /// A bar of the phases of the last frames' mean, with its legend.
    fn phases(&self, ui: &mut Ui) {
        let recent = self.history.iter().rev().take(30);
        let n = recent.len().max(1) as f64;
        let mut mean = [0.0; 6];
        for h in recent {
            for (m, s) in mean.iter_mut().zip(h.seconds.all()) {
                *m += s / n;
            }
        }
        let total: f64 = mean.iter().sum();
        let rate = if total > 0.0 { 1.0 / total } else { 0.0 };
        ui.label(mono(format!("{rate:.1} frames/s   {:.2} ms", 1e3 * total)))
            .on_hover_text("the mean of the last 30 frames; the time of the window is not in it");
        let width = ui.available_width().min(380.0);
        let (rect, _) = ui.allocate_exact_size(vec2(width, 14.0), Sense::hover());
        let mut left = rect.left();
        for (s, [r, g, b]) in mean.iter().zip(INKS) {
            let wide = if total > 0.0 { (*s / total) as f32 * rect.width() } else { 0.0 };
            let part = egui::Rect::from_min_size(egui::pos2(left, rect.top()), vec2(wide, rect.height()));
            ui.painter().rect_filled(part, 0.0, Color32::from_rgb(r, g, b));
            left += wide;
        }
        ui.horizontal_wrapped(|ui| {
            for ((name, s), [r, g, b]) in PhaseSeconds::NAMES.iter().zip(mean).zip(INKS) {
                crate::workbench::panes::widgets::swatch(ui, Color32::from_rgb(r, g, b));
                ui.label(mono(format!("{name} {:.2}", 1e3 * s)));
            }
        });
    }

    fn plots(&self, ui: &mut Ui) {
        let line = |title: &str, ink: usize, f: &dyn Fn(&crate::realtime::FrameReport) -> f64| {
            let points: Vec<[f64; 2]> = self.history.iter().map(|h| [h.frame as f64, f(h)]).collect();
            let [r, g, b] = INKS[ink];
            Line::new(title.to_owned(), PlotPoints::from(points)).color(Color32::from_rgb(r, g, b))
        };
        for (id, curve) in [
            ("frame rate", line("frames/s", 5, &|h| 1.0 / h.seconds.total().max(1e-6))),
            ("fluctuation", line("fluctuation, %", 6, &|h| 100.0 * h.fluctuation)),
        ] {
            Plot::new(id)
                .height(90.0)
                .allow_scroll(false)
                .allow_drag(false)
                .allow_zoom(false)
                .allow_boxed_zoom(false)
                .include_y(0.0)
                .legend(Legend::default())
                .show(ui, |plot| plot.line(curve));
        }
    }
}
