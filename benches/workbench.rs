//! The window's own work: a frame while the worker renders at full load, also at the far end of photons and pixels, and the
//! time to the first tile after the window opens and after a change.

#![allow(clippy::expect_used, missing_docs, reason = "a failed expectation is how this program reports")]

use criterion::{Criterion, criterion_group, criterion_main};
use cusp::export::session::{Mode, Session};
use cusp::workbench::Workbench;
use cusp::workbench::document::Opened;
use egui::{Context, Pos2, RawInput, Rect, vec2};
use std::sync::mpsc::{Receiver, channel};
use std::time::{Duration, Instant};

/// Points and pixels of the window.
const WINDOW: [f32; 2] = [1600.0, 1000.0];
/// Time between frames of a screen of 60 Hz.
const REFRESH: Duration = Duration::from_micros(16_667);
/// Frames and changes that are measured.
const FRAMES: usize = 600;
const CHANGES: usize = 30;
/// Windows that are opened.
const OPENINGS: usize = 20;

/// A window whose frames are run by hand, as often as a screen would.
struct Window {
    context: Context,
    workbench: Workbench,
    /// Told when a frame is asked for.
    wanted: Receiver<()>,
    last: Instant,
}

impl Window {
    fn open(scene: &str) -> Self {
        Self::of(Session { passes: 1_000_000, ..Session::of(scene) })
    }

    fn of(session: Session) -> Self {
        let context = Context::default();
        let (want, wanted) = channel();
        context.set_request_repaint_callback(move |_| {
            // The window may be gone.
            let _ = want.send(());
        });
        let workbench = Workbench::new(&context, Opened::new(session).expect("built in"), None).expect("threads");
        Self { context, workbench, wanted, last: Instant::now() }
    }

    /// One frame without painting: its time, with tessellation.
    fn frame(&mut self) -> Duration {
        let screen = Rect::from_min_size(Pos2::ZERO, vec2(WINDOW[0], WINDOW[1]));
        let input = RawInput { screen_rect: Some(screen), max_texture_side: Some(8192), ..Default::default() };
        let workbench = &mut self.workbench;
        let start = Instant::now();
        let mut output = self.context.run_ui(input, |ui| workbench.ui(ui));
        let primitives = self.context.tessellate(output.shapes, output.pixels_per_point);
        let time = start.elapsed();
        std::hint::black_box(primitives);
        output.textures_delta.clear();
        self.last = start;
        time
    }

    /// Waits for a request and for the screen, then runs a frame.
    fn paced(&mut self) -> Duration {
        let _ = self.wanted.recv_timeout(Duration::from_millis(100));
        std::thread::sleep(REFRESH.saturating_sub(self.last.elapsed()));
        while self.wanted.try_recv().is_ok() {}
        self.frame()
    }

    fn run_for(&mut self, time: Duration) {
        let start = Instant::now();
        while start.elapsed() < time {
            self.paced();
        }
    }

    /// Makes the change of that number, and waits for the first tile of it.
    fn change(&mut self, number: usize) -> Duration {
        let camera = self.workbench.document().scene_file().camera;
        let session = self.workbench.session_mut();
        let step = number as f64 * 0.01;
        match number % 3 {
            0 => session.render.footprint_scale = Some(2.0 + step),
            1 => session.render.photons = Some(150_000 + 1000 * number as i64),
            _ => {
                let mut camera = camera.expect("built-in scenes have one");
                camera.position[0] += step;
                session.camera = Some(camera);
            }
        }
        let start = Instant::now();
        // The change goes to the worker at the end of the frame in which it is made.
        self.frame();
        while self.workbench.render().first_tile().is_none() && start.elapsed() < Duration::from_secs(10) {
            self.paced();
        }
        start.elapsed()
    }
}

fn milliseconds(time: Duration) -> f64 {
    time.as_secs_f64() * 1e3
}

/// Median, 99th percentile and largest, milliseconds.
fn summary(what: &str, mut times: Vec<Duration>) {
    times.sort_unstable();
    let at = |part: f64| milliseconds(times[((times.len() - 1) as f64 * part).round() as usize]);
    println!("{what}: median {:.2} ms, 99 % {:.2} ms, worst {:.2} ms", at(0.5), at(0.99), at(1.0));
}

fn frames(c: &mut Criterion) {
    let mut window = Window::open("ring");
    window.run_for(Duration::from_secs(2));
    summary("frame at 1600x1000 under load", (0..FRAMES).map(|_| window.paced()).collect());
    assert!(!window.workbench.render().finished, "the worker is to render all the time");
    let mut group = c.benchmark_group("workbench");
    group.sample_size(10).measurement_time(Duration::from_secs(3));
    group.bench_function("frame_under_load", |b| b.iter_custom(|n| (0..n).map(|_| window.paced()).sum()));
    group.finish();
}

fn latency(_: &mut Criterion) {
    for scene in ["ring", "cornell"] {
        let mut window = Window::open(scene);
        window.run_for(Duration::from_secs(2));
        let mut all: [Vec<Duration>; 3] = Default::default();
        for number in 0..CHANGES {
            all[number % 3].push(window.change(number));
            window.run_for(Duration::from_millis(300));
        }
        for (what, times) in ["footprint scale", "photons", "camera"].iter().zip(&all) {
            summary(&format!("{scene}, {what} to first tile seen"), times.clone());
        }
        summary(&format!("{scene}, all changes to first tile seen"), all.concat());
    }
}

/// From the beginning of a new window's first frame to the frame that shows the first tile.
fn opening(_: &mut Criterion) {
    for scene in ["ring", "cornell", "glass_ball"] {
        let times = (0..OPENINGS).map(|_| {
            let mut window = Window::open(scene);
            let start = Instant::now();
            window.frame();
            while window.workbench.render().first_tile().is_none() && start.elapsed() < Duration::from_secs(10) {
                window.paced();
            }
            start.elapsed()
        });
        summary(&format!("{scene}, first frame to first tile"), times.collect());
    }
}

/// Frames while passes of ten million photons and of four million pixels are made, with differences for panels as well.
fn far_end(_: &mut Criterion) {
    let cases = [
        ("ring", 10_000_000, 2048, Mode::Grid),
        ("ring", 10_000_000, 2048, Mode::Difference),
        ("cornell", 10_000_000, 512, Mode::Grid),
    ];
    for (scene, photons, size, mode) in cases {
        let mut session = Session { size: Some([size, size]), ..Session::of(scene) };
        session.render.photons = Some(photons);
        session.comparison.mode = mode;
        let mut window = Window::of(session);
        window.run_for(Duration::from_secs(2));
        let what = format!("frame under load, {scene}, {photons} photons, {size}x{size} pixels, {mode:?}");
        summary(&what, (0..FRAMES).map(|_| window.paced()).collect());
    }
}

criterion_group!(benches, opening, frames, far_end, latency);
criterion_main!(benches);
