//! `cusp render`: one estimator, one image.

use crate::cli::failure::Failure;
use crate::cli::flags::CommonFlags;
use crate::cli::progress::{ProgressWatch, bar, listen_for_interrupts};
use crate::cli::{print, to_json};
use crate::estimate::registry::estimator;
use crate::export::report::RenderReport;
use crate::export::tone::{auto_exposure, to_srgb};
use crate::export::{Provenance, exr_file, png_file, whole_file};
use crate::render::Renderer;
use crate::render::Step;
use crate::render::film::Rect;
use crate::render::tiles::tiles;
use crate::scene::open;
use clap::Args;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Instant;

/// Flags of `render`.
#[derive(Debug, Args)]
pub struct RenderArgs {
    /// A built-in name, a .toml or an .obj
    scene: String,
    /// The image: .exr (linear radiance) or .png
    #[arg(short = 'o', long = "output", value_name = "FILE")]
    output: PathBuf,
    /// Passes to average; footprints shrink from pass to pass
    #[arg(long, value_name = "P", value_parser = clap::value_parser!(u32).range(1..), conflicts_with = "seconds")]
    passes: Option<u32>,
    /// Render passes for so many seconds; the pass that is running is finished
    #[arg(long, value_name = "S", allow_negative_numbers = true)]
    seconds: Option<f64>,
    /// Write what it cost and what was left out
    #[arg(long, value_name = "FILE")]
    stats: Option<PathBuf>,
    #[command(flatten)]
    flags: CommonFlags,
}

/// Renders.
///
/// # Errors
/// A wrong call, a file that cannot be written, or an interruption before the first pass was done.
pub fn run(args: &RenderArgs) -> Result<(), Failure> {
    let extension = args.output.extension().and_then(|e| e.to_str()).unwrap_or("");
    let is_png = match extension.to_ascii_lowercase().as_str() {
        "exr" => false,
        "png" => true,
        _ => return Err(Failure::Call(format!("-o {}: end the name in .exr or .png", args.output.display()))),
    };
    if args.seconds.is_some_and(|s| !(s > 0.0 && s.is_finite())) {
        return Err(Failure::Call("--seconds: must be positive".into()));
    }
    listen_for_interrupts();
    args.flags.on_threads(|| {
        let start = Instant::now();
        let scene = open(&args.scene)?;
        let settings = args.flags.settings(&scene)?;
        let chosen = estimator(&settings.estimator)?;
        let name = chosen.name();
        let load = start.elapsed().as_secs_f64();
        let mut renderer = Renderer::new(Arc::new(scene), settings, vec![chosen]);
        let finished = passes(args, &mut renderer, &start);
        let passes = renderer.passes();
        if passes == 0 {
            return Err(Failure::Interrupted("nothing was written".into()));
        }
        let image = renderer.films()[0].image();
        let provenance = Provenance::new(renderer.scene(), renderer.settings().seed);
        let placed = |file: &PathBuf| args.flags.out.as_ref().map_or(file.clone(), |folder| folder.join(file));
        let path = placed(&args.output);
        if is_png {
            png_file::write(&path, image.size, &to_srgb(&image, auto_exposure(&image)), &provenance)?;
        } else {
            exr_file::write(&path, &image, &provenance)?;
        }
        let report = RenderReport::new(&renderer, name, load, start.elapsed().as_secs_f64());
        if let Some(stats) = &args.stats {
            whole_file::write(&placed(stats), to_json(&report)?.as_bytes())?;
        }
        if args.flags.json {
            print(&to_json(&report)?)?;
        } else if !args.flags.quiet {
            for warning in &report.warnings {
                eprintln!("warning: {warning}");
            }
            print(&summary(&report, &path.display().to_string()))?;
        }
        if finished { Ok(()) } else { Err(Failure::Interrupted(format!("{passes} passes were written"))) }
    })
}

/// Steps until enough is done; false if interrupted.
fn passes(args: &RenderArgs, renderer: &mut Renderer, start: &Instant) -> bool {
    let wanted = match (args.passes, args.seconds) {
        (Some(p), _) => p,
        (None, Some(_)) => u32::MAX,
        (None, None) => 1,
    };
    let per_pass = tiles(Rect::whole(renderer.settings().size)).len() as u64;
    let shown = if wanted == u32::MAX { 1 } else { wanted };
    let bar = bar(per_pass * u64::from(shown), "render", args.flags.quiet || args.flags.json);
    let watch = ProgressWatch { bar: &bar };
    let mut finished = true;
    while renderer.passes() < wanted {
        if args.seconds.is_some_and(|s| renderer.passes() > 0 && start.elapsed().as_secs_f64() >= s) {
            break;
        }
        if wanted == u32::MAX {
            bar.set_position(0);
            bar.set_message(format!("pass {}", renderer.passes() + 1));
        }
        if renderer.step(&watch) == Step::Cancelled {
            finished = false;
            break;
        }
    }
    bar.finish_and_clear();
    finished
}

fn summary(r: &RenderReport, path: &str) -> String {
    let s = &r.seconds;
    let stored = &r.photons_stored;
    format!(
        "{path}: {} by {}, {}x{}, {} passes\n\
         photons: {} emitted; stored {} direct, {} caustic, {} global\n\
         seconds: load {:.3}, bvh {:.3}, plan {:.3}, photons {:.3}, maps {:.3}, view rays {:.3}, gather {:.3}, estimate {:.3}; total {:.3}\n",
        r.provenance.scene,
        r.estimator,
        r.size[0],
        r.size[1],
        r.passes,
        r.photons_emitted,
        stored.direct,
        stored.caustic,
        stored.global,
        s.load,
        s.bvh,
        s.plan,
        s.photon_trace,
        s.map_build,
        s.view_trace,
        s.gather,
        s.estimate,
        s.total
    )
}
