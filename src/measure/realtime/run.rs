//! A run of the frame loop, timed.

use crate::measure::realtime::statistics::{median, quantile};
use crate::realtime::{Engine, FrameReport, PhaseSeconds};
use crate::render::film::Image;
use crate::render::stats::current_rss_bytes;
use crate::scene::Camera;
use glam::{Mat3, Vec3};
use serde::Serialize;

/// How a run goes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RunSettings {
    /// Frames, at least one.
    pub frames: u64,
    /// Seconds of the scene's time from one frame to the next.
    pub time_step: f64,
    /// By how much the camera turns to the left about the vertical from one frame to the next, degrees.
    pub turn: f64,
    /// Pixels across and down.
    pub size: [u32; 2],
    /// Exposure of the screen, for blending by offset.
    pub exposure: f32,
}

/// What a run came to. Times are of wall clocks; frames before the map is full are left out of them.
#[derive(Clone, Debug, Serialize)]
pub struct RunReport {
    /// Frames that were made.
    pub frames: u64,
    /// Frames per second: one over the median seconds of a frame.
    pub frames_per_second: f64,
    /// Seconds of a frame that a tenth of them, half of them and nine tenths of them stay below.
    pub frame_seconds: [f64; 3],
    /// Median seconds of each phase.
    pub phase_seconds: PhaseSeconds,
    /// Seconds from a change of a light to a map of its photons alone: as many median frames as the map holds.
    pub renewal_seconds: f64,
    /// Mean of the frames' fluctuations.
    pub fluctuation: f64,
    /// Memory of the process after a tenth of the frames, and at the end, bytes; where the system tells.
    pub rss_bytes: Option<[u64; 2]>,
    /// The last frame.
    pub last: FrameReport,
}

/// Makes frames until there are enough or `watch` says to stop; gives the run's report, each frame's, and the last image.
///
/// None if it was stopped before the first frame.
pub fn run(
    engine: &mut Engine,
    settings: &RunSettings,
    mut watch: impl FnMut(&FrameReport) -> bool,
) -> Option<(RunReport, Vec<FrameReport>, Image)> {
    let start = engine.report().time;
    let mut camera = engine.scene().camera;
    let mut reports: Vec<FrameReport> = Vec::new();
    let mut image = None;
    let mut memory = [None; 2];
    for i in 0..settings.frames {
        engine.step(start + i as f64 * settings.time_step, &camera);
        image = Some(engine.draw(&camera, settings.size, settings.exposure));
        reports.push(*engine.report());
        if i == settings.frames / 10 {
            memory[0] = current_rss_bytes();
        }
        if !watch(engine.report()) {
            break;
        }
        camera = turned(&camera, settings.turn);
    }
    memory[1] = current_rss_bytes();
    let last = *reports.last()?;
    let full: Vec<&FrameReport> = {
        let warm = engine.settings().accumulation_frames as usize;
        // A run too short to fill the map is timed as it is.
        let from = if reports.len() > 2 * warm { warm } else { reports.len() / 2 };
        reports[from..].iter().collect()
    };
    let seconds: Vec<f64> = full.iter().map(|r| r.seconds.total()).collect();
    let phase = |f: fn(&PhaseSeconds) -> f64| median(&full.iter().map(|r| f(&r.seconds)).collect::<Vec<_>>());
    let middle = median(&seconds);
    let report = RunReport {
        frames: reports.len() as u64,
        frames_per_second: if middle > 0.0 { 1.0 / middle } else { 0.0 },
        frame_seconds: [quantile(&seconds, 0.1), middle, quantile(&seconds, 0.9)],
        phase_seconds: PhaseSeconds {
            update: phase(|s| s.update),
            emit: phase(|s| s.emit),
            balance: phase(|s| s.balance),
            cull: phase(|s| s.cull),
            estimate: phase(|s| s.estimate),
            draw: phase(|s| s.draw),
        },
        renewal_seconds: middle * f64::from(engine.settings().accumulation_frames),
        fluctuation: full.iter().map(|r| r.fluctuation).sum::<f64>() / full.len().max(1) as f64,
        rss_bytes: memory[0].zip(memory[1]).map(|(a, b)| [a, b]),
        last,
    };
    image.map(|image| (report, reports, image))
}

/// A camera turned to the left about the vertical.
pub fn turned(camera: &Camera, degrees: f64) -> Camera {
    let by = Mat3::from_axis_angle(Vec3::Y, degrees.to_radians() as f32);
    Camera { frame: camera.frame.map(|v| (by * v).normalize()), ..*camera }
}
