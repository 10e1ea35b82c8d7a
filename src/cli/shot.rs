//! `cusp shot`: the workbench drawn to a file, without a window.

use crate::cli::failure::Failure;
use crate::cli::flags::{self, CommonFlags};
use crate::cli::progress::{bar, interrupted, listen_for_interrupts};
use crate::cli::{print, to_json, window};
use crate::export::session::Rendering;
use crate::export::{Provenance, png_file};
use crate::workbench::Workbench;
use crate::workbench::actions::Action;
use crate::workbench::overlays;
use crate::workbench::shot::{NoShot, Shot};
use clap::Args;
use serde::Serialize;
use std::path::PathBuf;

/// Sides of a window that can be drawn, pixels.
const SIDES: std::ops::RangeInclusive<u32> = 200..=8192;

/// Flags of `shot`.
#[derive(Debug, Args)]
pub struct ShotArgs {
    /// A built-in name, a .toml, an .obj, a Quake 3 map (.bsp, .pk3:NAME) or a session
    #[arg(default_value = "ring")]
    scene: String,
    /// The picture: .png
    #[arg(short = 'o', long = "output", value_name = "FILE")]
    output: PathBuf,
    /// Size of the window in pixels
    #[arg(long, value_name = "WxH", value_parser = flags::size, default_value = "1600x1000")]
    window: [u32; 2],
    /// Passes to average before the picture is taken
    #[arg(long, value_name = "P", value_parser = clap::value_parser!(u32).range(1..), default_value_t = 4)]
    passes: u32,
    /// Pixel to pin and inspect, as in 256,200
    #[arg(long, value_name = "X,Y", value_parser = flags::pixel)]
    pixel: Option<[u32; 2]>,
    /// Overlays to draw: footprint, photons, samples, polygons, tiles, path, gather_rays, irradiance
    #[arg(long, value_name = "A,B", value_delimiter = ',')]
    overlays: Vec<String>,
    /// Gather ray of the pinned pixel to choose, from 1, the strongest; of the first panel with final gathering
    #[arg(long, value_name = "N", requires = "pixel", value_parser = clap::value_parser!(u32).range(1..))]
    ray: Option<u32>,
    /// Layer of the irradiance pyramid that the overlay draws, from 0, the most detailed
    #[arg(long, value_name = "N", default_value_t = 0)]
    layer: usize,
    /// The real-time view after so many frames, instead of the session's view
    #[arg(long, value_name = "N")]
    realtime: Option<u64>,
    /// Panel, from 1, that fills the middle
    #[arg(long, value_name = "N")]
    maximize: Option<usize>,
    #[command(flatten)]
    flags: CommonFlags,
}

/// What was drawn.
#[derive(Serialize)]
struct Report {
    version: &'static str,
    file: String,
    window: [u32; 2],
    size: [u32; 2],
    passes: u32,
    provenance: Provenance,
}

/// Draws the workbench.
///
/// # Errors
/// A wrong call, a file that cannot be written, or an interruption.
pub fn run(args: &ShotArgs) -> Result<(), Failure> {
    if !args.output.extension().is_some_and(|e| e.eq_ignore_ascii_case("png")) {
        return Err(Failure::Call(format!("-o {}: end the name in .png", args.output.display())));
    }
    if args.window.iter().any(|side| !SIDES.contains(side)) {
        return Err(Failure::Call(format!("--window: sides must lie in {} to {}", SIDES.start(), SIDES.end())));
    }
    let (mut session, path) = window::session(&args.scene, &args.flags)?;
    session.passes = args.passes;
    if args.realtime.is_some() {
        session.rendering = Rendering::Realtime;
    }
    for name in &args.overlays {
        if !overlays::ALL.iter().any(|o| o.id == name) {
            let known: Vec<&str> = overlays::ALL.iter().map(|o| o.id).collect();
            return Err(Failure::Call(format!("--overlays: no overlay {name:?}; there are {}", known.join(", "))));
        }
        if !session.overlays.contains(name) {
            session.overlays.push(name.clone());
        }
    }
    listen_for_interrupts();
    args.flags.set_threads()?;
    let opened = window::opened(session, &args.flags, path.is_some())?;
    let panels = opened.session().panels.len();
    if args.maximize.is_some_and(|n| !(1..=panels).contains(&n)) {
        return Err(Failure::Call(format!("--maximize: panels are numbered 1 to {panels}")));
    }
    let mut shot = Shot::new(opened, path, args.window, 1.0).map_err(|e| Failure::Work(e.to_string()))?;
    prepare(args, shot.workbench())?;
    let picture = take(args, &mut shot)?;
    let document = shot.workbench().document();
    let provenance = Provenance::new(document.scene(), document.session.seed);
    let file = args.flags.out.as_ref().map_or(args.output.clone(), |folder| folder.join(&args.output));
    let rgb: Vec<u8> = picture.pixels().flat_map(|p| [p[0], p[1], p[2]]).collect();
    png_file::write(&file, args.window, &rgb, &provenance)?;
    let report = Report {
        version: env!("CARGO_PKG_VERSION"),
        file: file.display().to_string(),
        window: args.window,
        size: document.settings().size,
        passes: args.passes,
        provenance,
    };
    if args.flags.json {
        print(&to_json(&report)?)?;
    } else if !args.flags.quiet {
        let [w, h] = args.window;
        let after = args.realtime.map_or(format!("{} passes", args.passes), |n| format!("{n} frames"));
        print(&format!("{}: {} after {after}, {w}x{h}\n", report.file, report.provenance.scene))?;
    }
    Ok(())
}

/// Pins and maximizes what the flags name.
fn prepare(args: &ShotArgs, workbench: &mut Workbench) -> Result<(), Failure> {
    if let Some(pixel) = args.pixel {
        let [w, h] = workbench.document().settings().size;
        if pixel[0] >= w || pixel[1] >= h {
            return Err(Failure::Call(format!("--pixel: lies outside the image of {w}x{h} pixels")));
        }
        workbench.run(Action::Pin(pixel));
    }
    workbench.live().step(args.realtime.unwrap_or(0));
    workbench.show_gathering(args.ray.map(|n| n as usize - 1), args.layer);
    if let Some(panel) = args.maximize {
        workbench.run(Action::Maximize(panel - 1));
    }
    Ok(())
}

fn take(args: &ShotArgs, shot: &mut Shot) -> Result<image::RgbaImage, Failure> {
    let bar = bar(u64::from(args.passes), "passes", args.flags.quiet || args.flags.json);
    let picture = shot.take(|workbench| {
        let passes = workbench.render().progress.as_ref().and_then(|p| p.passes.iter().min().copied());
        bar.set_position(u64::from(passes.unwrap_or(0)));
        interrupted()
    });
    bar.finish_and_clear();
    picture.map_err(|why| match why {
        NoShot::Stopped => Failure::Interrupted("nothing was written".into()),
        NoShot::Failed(why) => Failure::Work(why),
    })
}
