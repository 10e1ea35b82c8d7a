//! The window of the system around the workbench.

use super::Workbench;
use super::document::Opened;
use std::path::PathBuf;

/// Size of the window at its first start, points.
pub const SIZE: [f32; 2] = [1600.0, 1000.0];

/// Whether there is a display to open a window on.
///
/// # Errors
/// Why not.
pub fn display() -> Result<(), String> {
    let set = |name: &str| std::env::var_os(name).is_some_and(|v| !v.is_empty());
    let needs_variable = cfg!(all(unix, not(target_os = "macos")));
    if needs_variable && !set("DISPLAY") && !set("WAYLAND_DISPLAY") {
        return Err("no display: neither DISPLAY nor WAYLAND_DISPLAY is set".into());
    }
    Ok(())
}

/// Opens the window and returns when it is closed.
///
/// # Errors
/// If the system gives no window, in one line.
pub fn open(opened: Opened, path: Option<PathBuf>) -> Result<(), String> {
    let options = eframe::NativeOptions {
        viewport: egui::ViewportBuilder::default()
            .with_title("Cusp")
            .with_app_id("cusp")
            .with_inner_size(SIZE)
            .with_min_inner_size([640.0, 400.0])
            .with_drag_and_drop(true),
        renderer: eframe::Renderer::Glow,
        persist_window: true,
        ..Default::default()
    };
    let create: eframe::AppCreator = Box::new(move |context| {
        let mut workbench = Workbench::new(&context.egui_ctx, opened, path)?;
        if let Some(storage) = context.storage {
            workbench.recall(storage);
        }
        Ok(Box::new(workbench))
    });
    eframe::run_native("cusp", options, create).map_err(|e| e.to_string().replace('\n', "; "))
}
