//! Frames of a workbench without a window, run by hand.

use cusp::workbench::Workbench;
use std::time::{Duration, Instant};

/// Draws frames until `done`.
pub fn run_until(workbench: &mut Workbench, context: &egui::Context, done: impl Fn(&Workbench) -> bool) {
    let start = Instant::now();
    while !done(workbench) {
        assert!(
            start.elapsed() < Duration::from_secs(120),
            "it never ends; messages: {:?}",
            workbench.messages().all()
        );
        let mut output = context.run_ui(egui::RawInput::default(), |ui| workbench.ui(ui));
        output.textures_delta.clear();
        std::thread::sleep(Duration::from_millis(2));
    }
}
