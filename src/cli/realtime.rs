//! `cusp realtime`: the pi-engine's frame loop without a window.

use crate::cli::failure::Failure;
use crate::cli::flags::{CommonFlags, size};
use crate::cli::progress::{bar, interrupted, listen_for_interrupts};
use crate::cli::table::Table;
use crate::cli::{print, to_json};
use crate::export::tone::{auto_exposure, to_srgb};
use crate::export::{Provenance, png_file, whole_file};
use crate::measure::realtime::{RunReport, RunSettings, run};
use crate::realtime::settings::{PARAMETERS, Parameter, Values, photon_count, set};
use crate::realtime::{Engine, FrameReport, PhaseSeconds, RealtimeSettings};
use crate::scene::open;
use crate::scene::scene_file::RealtimeFile;
use clap::Args;
use serde::Serialize;
use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Size of the picture, as it is scaled up in the window.
pub const SIZE: [u32; 2] = [320, 240];

/// Flags of `realtime`.
#[derive(Debug, Args)]
pub struct RealtimeArgs {
    /// A built-in name, a .toml, an .obj or a Quake 3 map (.bsp, .pk3:NAME); `rooms` if left out
    #[arg(default_value = "rooms")]
    scene: String,
    /// Frames to make
    #[arg(long, value_name = "N", default_value_t = 120, value_parser = clap::value_parser!(u64).range(1..))]
    frames: u64,
    /// A parameter, as in max_search_count=100; may be given many times
    #[arg(long = "set", value_name = "KEY=VALUE")]
    set: Vec<String>,
    /// List the parameters, and make nothing
    #[arg(long)]
    parameters: bool,
    /// Seconds of the scene from one frame to the next
    #[arg(long, value_name = "S", default_value_t = 1.0 / 30.0, allow_negative_numbers = true)]
    time_step: f64,
    /// Degrees by which the camera turns from one frame to the next
    #[arg(long, value_name = "D", default_value_t = 0.0, allow_negative_numbers = true)]
    turn: f64,
    /// Size of the picture in pixels; 320x240 if left out
    #[arg(long, value_name = "WxH", value_parser = size)]
    size: Option<[u32; 2]>,
    /// Factor that brings radiance to the screen, for the picture and for blending by offset; chosen if left out
    #[arg(long, value_name = "E")]
    exposure: Option<f32>,
    /// Seed of everything random; 1 if left out
    #[arg(long, value_name = "N")]
    seed: Option<u64>,
    /// Threads; all cores if left out
    #[arg(long, value_name = "T")]
    threads: Option<usize>,
    /// Folder for frame.png, frames.csv and realtime.json
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Print JSON instead of a table
    #[arg(long)]
    json: bool,
    /// Print nothing but errors
    #[arg(long)]
    quiet: bool,
}

/// Makes frames.
///
/// # Errors
/// A wrong call, a file that cannot be written, or an interruption.
pub fn run_realtime(args: &RealtimeArgs) -> Result<(), Failure> {
    if args.parameters {
        return print(&if args.json { to_json(&listed())? } else { list() });
    }
    let exposed = args.exposure.is_none_or(|e| e > 0.0 && e.is_finite());
    if !(args.time_step.is_finite() && args.turn.is_finite() && exposed) {
        return Err(Failure::Call("--time-step, --turn and --exposure: give finite numbers".into()));
    }
    listen_for_interrupts();
    let flags = CommonFlags { threads: args.threads, size: args.size, ..CommonFlags::default() };
    flags.on_threads(|| {
        let scene = Arc::new(open(&args.scene)?);
        // Checks the size.
        let size = CommonFlags { size: Some(args.size.unwrap_or(SIZE)), ..flags.clone() }.settings(&scene)?.size;
        let mut table = RealtimeFile::default();
        for text in &args.set {
            set(&mut table, text).map_err(|e| Failure::Call(format!("--set {e}")))?;
        }
        let settings = RealtimeSettings::new(&scene, &table, args.seed.unwrap_or(1))?;
        make(args, &scene, settings, size)
    })
}

fn make(
    args: &RealtimeArgs,
    scene: &Arc<crate::scene::Scene>,
    settings: RealtimeSettings,
    size: [u32; 2],
) -> Result<(), Failure> {
    if !args.quiet && !args.json {
        scene.warnings.iter().for_each(|w| eprintln!("warning: {w}"));
    }
    let mut engine = Engine::new(scene, settings);
    let exposure = match args.exposure {
        Some(e) => e,
        None => {
            // From a frame of an engine of its own, so that the run starts at its first.
            let mut first = Engine::new(
                scene,
                RealtimeSettings {
                    blending: crate::realtime::settings::Blending::Multiply,
                    ..engine.settings().clone()
                },
            );
            first.step(0.0, &scene.camera);
            auto_exposure(&first.draw(&scene.camera, size, 1.0))
        }
    };
    let how = RunSettings { frames: args.frames, time_step: args.time_step, turn: args.turn, size, exposure };
    let progress = bar(args.frames, "frames", args.quiet);
    let result = run(&mut engine, &how, |_| {
        progress.inc(1);
        !interrupted()
    });
    progress.finish_and_clear();
    let Some((report, frames, image)) = result else {
        return Err(Failure::Interrupted("no frame was made".into()));
    };
    let document = Document {
        provenance: Provenance::new(scene, engine.settings().seed),
        size,
        threads: rayon::current_num_threads(),
        triangles: engine.mesh().triangles.len(),
        vertices: engine.mesh().vertices.len(),
        longest_edge: engine.mesh().longest_edge(),
        photons_foreseen: photon_count(engine.settings()),
        settings: engine.settings(),
        run: &report,
    };
    if let Some(folder) = &args.out {
        let picture = to_srgb(&image, exposure);
        png_file::write(&folder.join("frame.png"), size, &picture, &document.provenance)?;
        whole_file::write(&folder.join("frames.csv"), csv(&frames).as_bytes())?;
        whole_file::write(&folder.join("realtime.json"), to_json(&document)?.as_bytes())?;
    }
    if args.json {
        print(&to_json(&document)?)?;
    } else if !args.quiet {
        print(&text(&document, args.out.as_deref()))?;
    }
    if report.frames < args.frames {
        return Err(Failure::Interrupted(format!("{} of {} frames were made", report.frames, args.frames)));
    }
    Ok(())
}

/// What `--json` prints.
#[derive(Serialize)]
struct Document<'a> {
    #[serde(flatten)]
    provenance: Provenance,
    size: [u32; 2],
    threads: usize,
    triangles: usize,
    vertices: usize,
    longest_edge: f32,
    photons_foreseen: u64,
    settings: &'a RealtimeSettings,
    #[serde(flatten)]
    run: &'a RunReport,
}

fn text(d: &Document, folder: Option<&Path>) -> String {
    let r = d.run;
    let mut table = Table::new(["phase", "milliseconds", "share"]);
    let total = r.phase_seconds.total().max(f64::MIN_POSITIVE);
    for (name, s) in PhaseSeconds::NAMES.iter().zip(r.phase_seconds.all()) {
        table.row([(*name).to_owned(), format!("{:.2}", 1e3 * s), format!("{:.0} %", 100.0 * s / total)]);
    }
    let mut out = table.text();
    let [low, middle, high] = r.frame_seconds.map(|s| 1e3 * s);
    // Writing to a string cannot fail.
    let _ = write!(
        out,
        "\n{:.1} frames per second: {middle:.2} ms for the median frame ({low:.2} to {high:.2} for eight of ten), {}x{} pixels, {} threads\n\
         {} triangles, {} vertices, longest edge {:.3} m; {} of them visible, {} estimates a frame\n\
         {} photons in the map ({} foreseen), {} emitted and {} stored a frame; renewed after {} frames, {:.2} s\n\
         fluctuation of the irradiance from frame to frame: {:.3} %\n",
        r.frames_per_second,
        d.size[0],
        d.size[1],
        d.threads,
        d.triangles,
        d.vertices,
        d.longest_edge,
        r.last.triangles_visible,
        r.last.estimates,
        r.last.photons_in_map,
        d.photons_foreseen,
        r.last.photons_emitted,
        r.last.photons_stored,
        d.settings.accumulation_frames,
        r.renewal_seconds,
        100.0 * r.fluctuation,
    );
    if let Some(folder) = folder {
        let _ = writeln!(out, "files in {}: frame.png, frames.csv, realtime.json", folder.display());
    }
    out
}

fn csv(frames: &[FrameReport]) -> String {
    let mut out = format!(
        "frame,time,{},total,photons_emitted,photons_stored,photons_in_map,frames_in_map,view_rays,triangles_visible,estimates,fluctuation\n",
        PhaseSeconds::NAMES.join(",")
    );
    for f in frames {
        let seconds: Vec<String> = f.seconds.all().iter().map(|s| format!("{s:.6}")).collect();
        let _ = writeln!(
            out,
            "{},{:.4},{},{:.6},{},{},{},{},{},{},{},{:.6}",
            f.frame,
            f.time,
            seconds.join(","),
            f.seconds.total(),
            f.photons_emitted,
            f.photons_stored,
            f.photons_in_map,
            f.frames_in_map,
            f.view_rays,
            f.triangles_visible,
            f.estimates,
            f.fluctuation
        );
    }
    out
}

#[derive(Serialize)]
struct Listed {
    name: &'static str,
    number: Option<u32>,
    values: String,
    what: &'static str,
}

fn listed() -> Vec<Listed> {
    let one = |p: &Parameter| Listed { name: p.name, number: p.number, values: values(p.values), what: p.what };
    PARAMETERS.iter().map(one).collect()
}

fn values(v: Values) -> String {
    match v {
        Values::Switch => "true, false".into(),
        Values::Integer(low, high) => format!("{low} to {high}"),
        Values::Number(high) => format!("above 0, up to {high}"),
        Values::Words(words) => words.join(", "),
    }
}

fn list() -> String {
    let mut out = String::from("Parameters of real-time photon mapping; a number is that of chapter 6 of the paper.\n");
    for p in listed() {
        let number = p.number.map_or("  ".into(), |n| format!("{n:>2}"));
        let _ = writeln!(out, "{number}  {:<22} {}\n    {:<22} {}", p.name, p.what, "", p.values);
    }
    out
}
