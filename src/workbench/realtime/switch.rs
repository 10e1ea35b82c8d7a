//! From the progressive view to the real-time view and back.

use super::LiveView;
use crate::export::session::Rendering;
use crate::workbench::app::Workbench;
use crate::workbench::worker::gate::Gate;

impl Workbench {
    /// Whether the real-time view is shown.
    pub fn is_live(&self) -> bool {
        self.document.session.rendering == Rendering::Realtime
    }

    /// The progressive render rests while the real-time view is shown, and goes on from the same camera and scene.
    pub(in crate::workbench) fn enter_or_leave(&mut self, live: bool) {
        match (live, self.was_live) {
            (true, None) => {
                let paused = self.render.is_paused();
                self.render.gate().into_iter().for_each(Gate::pause);
                self.was_live = Some(paused);
            }
            (false, Some(paused)) => {
                self.live.leave();
                self.was_live = None;
                if std::mem::take(&mut self.stale) {
                    self.restart();
                }
                if !paused {
                    self.render.gate().into_iter().for_each(Gate::resume);
                }
            }
            _ => {}
        }
    }

    /// The real-time view, to be told what to show.
    pub fn live(&mut self) -> &mut LiveView {
        &mut self.live
    }

    /// As [`Self::restart`], but only notes that it must be while the real-time view is shown.
    pub(in crate::workbench) fn restart_or_note(&mut self) {
        if self.is_live() { self.stale = true } else { self.restart() }
    }
}
