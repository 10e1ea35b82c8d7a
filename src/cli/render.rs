//! `cusp render`: one estimator, one image.

use crate::cli::failure::Failure;
use crate::cli::flags::CommonFlags;
use crate::cli::progress::{ProgressWatch, bar, interrupted, listen_for_interrupts};
use crate::cli::{print, to_json};
use crate::export::report::RenderReport;
use crate::export::tone::{auto_exposure, to_srgb};
use crate::export::{Provenance, exr_file, png_file, whole_file};
use crate::render::film::Rect;
use crate::render::stop::Standing;
use crate::render::tiles::tiles;
use crate::render::{Gather, Renderer, Step, StopRule, StoppedBy};
use crate::scene::open;
use clap::Args;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// Flags of `render`.
#[derive(Debug, Args)]
pub struct RenderArgs {
    /// A built-in name, a .toml, an .obj or a Quake 3 map (.bsp, .pk3:NAME)
    scene: String,
    /// The image: .exr (linear radiance) or .png
    #[arg(short = 'o', long = "output", value_name = "FILE")]
    output: PathBuf,
    /// Passes to average, at most; footprints shrink from pass to pass
    #[arg(long, value_name = "P", value_parser = clap::value_parser!(u32).range(1..))]
    passes: Option<u32>,
    /// Render for so many seconds at most, from start to end
    #[arg(long, value_name = "S", allow_negative_numbers = true)]
    seconds: Option<f64>,
    /// Render passes until the estimated error is this part of the image's mean; 0.01 is 1 %
    #[arg(long, value_name = "E", allow_negative_numbers = true)]
    until_error: Option<f64>,
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
    let start = Instant::now();
    let extension = args.output.extension().and_then(|e| e.to_str()).unwrap_or("");
    let is_png = match extension.to_ascii_lowercase().as_str() {
        "exr" => false,
        "png" => true,
        _ => return Err(Failure::Call(format!("-o {}: end the name in .exr or .png", args.output.display()))),
    };
    for (flag, value) in [("--seconds", args.seconds), ("--until-error", args.until_error)] {
        if value.is_some_and(|v| !(v > 0.0 && v.is_finite())) {
            return Err(Failure::Call(format!("{flag}: must be positive and finite")));
        }
    }
    listen_for_interrupts();
    args.flags.on_threads(|| {
        let scene = open(&args.scene)?;
        let settings = args.flags.settings(&scene)?;
        let chosen = settings.chosen().map_err(|e| Failure::Call(format!("--final-gather: {e}")))?;
        let name = chosen.name();
        let stays = !chosen.is_consistent() || settings.gather == Gather::Knn;
        let load = start.elapsed().as_secs_f64();
        let mut renderer = Renderer::new(Arc::new(scene), settings, vec![chosen]);
        renderer.check_memory()?;
        let rule = StopRule {
            passes: args.passes.or_else(|| (args.seconds.is_none() && args.until_error.is_none()).then_some(1)),
            seconds: args.seconds,
            error: args.until_error,
        };
        let (stopped_by, late) = passes(args, rule, &mut renderer, start);
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
        let mut report = RenderReport::new(&renderer, name, load, start.elapsed().as_secs_f64());
        report.stopped_by = Some(stopped_by);
        if args.until_error.is_some() && stays {
            let what =
                format!("{} by {}", report.estimator, if report.gather == Gather::Knn { "knn" } else { "overlap" });
            report.warnings.push(format!(
                "{what} leaves a bias that no number of passes removes; the estimated error does not see it"
            ));
        }
        report.warnings.extend(late);
        if let Some(stats) = &args.stats {
            whole_file::write(&placed(stats), to_json(&report)?.as_bytes())?;
        }
        if args.flags.json {
            print(&to_json(&report)?)?;
        } else if !args.flags.quiet {
            for warning in &report.warnings {
                eprintln!("warning: {warning}");
            }
            print(&summary(&report, &path.display().to_string(), &rule))?;
        }
        match stopped_by {
            StoppedBy::Interruption => Err(Failure::Interrupted(format!("{passes} passes were written"))),
            StoppedBy::Passes | StoppedBy::Seconds | StoppedBy::Error => Ok(()),
        }
    })
}

/// Steps until the rule says stop. Returns what it was, and a warning if the first pass took longer than there was time.
fn passes(args: &RenderArgs, rule: StopRule, renderer: &mut Renderer, start: Instant) -> (StoppedBy, Option<String>) {
    let per_pass = tiles(Rect::whole(renderer.settings().size)).len() as u64;
    let bar = bar(per_pass * u64::from(rule.passes.unwrap_or(1)), "render", args.flags.quiet || args.flags.json);
    if let Some(need) = renderer.memory_need() {
        bar.println(need.text());
    }
    let mut now = Standing::default();
    let mut late = None;
    let stopped_by = loop {
        now.seconds = start.elapsed().as_secs_f64();
        if let Some(why) = rule.verdict(&now) {
            break why;
        }
        if rule.passes.is_none() {
            bar.set_position(0);
            let error = now.error.map_or(String::new(), |e| format!(", error {:.2} %", 100.0 * e.relative));
            bar.set_message(format!("pass {}{error}", now.passes + 1));
        }
        // A moment beyond what the clock can hold is none.
        let deadline = rule.deadline(now.passes).and_then(|s| start.checked_add(Duration::try_from_secs_f64(s).ok()?));
        let began = Instant::now();
        if renderer.step(&ProgressWatch { bar: &bar, deadline }) == Step::Cancelled {
            break if interrupted() { StoppedBy::Interruption } else { StoppedBy::Seconds };
        }
        now.passes = renderer.passes();
        if rule.asks_for_error(now.passes) {
            now.error = renderer.error_estimate();
        }
        now.next_pass = began.elapsed().as_secs_f64();
        let took = start.elapsed().as_secs_f64();
        if let Some(limit) = rule.seconds.filter(|s| now.passes == 1 && took > *s) {
            late = Some(format!("the first pass ended after {took:.2} s of {limit} s; there is no image without one"));
        }
    };
    bar.finish_and_clear();
    (stopped_by, late)
}

/// What ended the render, and how large its error may be.
fn stop_line(r: &RenderReport, rule: &StopRule) -> String {
    let why = match r.stopped_by {
        Some(StoppedBy::Error) => "the error is low enough",
        Some(StoppedBy::Seconds) => "the time is up",
        Some(StoppedBy::Interruption) => "interrupted",
        Some(StoppedBy::Passes) | None => "all passes are done",
    };
    let percent = |x: f64| format!("{:.3} %", 100.0 * x);
    let error = r.error_estimate.map_or(String::from("unknown below 12 passes"), |e| {
        let of_mean = |x: f64| percent(if e.rmse > 0.0 { e.relative * x / e.rmse } else { 0.0 });
        let (noise, bias) = (of_mean(e.noise_rmse), of_mean(e.bias_rmse));
        format!(
            "{} of the mean (noise {noise}, bias {bias}), likely below {}",
            percent(e.relative),
            percent(e.relative_bound)
        )
    });
    let wanted = rule.error.map_or(String::new(), |limit| {
        let reached = if r.stopped_by == Some(StoppedBy::Error) { "reached" } else { "not reached" };
        format!("; {} was asked for and {reached}", percent(limit))
    });
    format!("stopped: {why}\nestimated error: {error}{wanted}\n")
}

fn summary(r: &RenderReport, path: &str, rule: &StopRule) -> String {
    let s = &r.seconds;
    let stored = &r.photons_stored;
    let final_gather = match s.final_gather {
        0.0 => String::new(),
        t => format!("final gathering {t:.3}, "),
    };
    let gathered = r
        .final_gather
        .as_ref()
        .map_or(String::new(), |f| format!("final gathering: {}\n  {}\n", r.gather_counts.line(), f.line()));
    format!(
        "{path}: {} by {}, {}x{}, {} passes\n\
         photons: {} emitted; stored {} direct, {} caustic, {} global\n\
         seconds: load {:.3}, bvh {:.3}, plan {:.3}, photons {:.3}, maps {:.3}, view rays {:.3}, gather {:.3}, estimate {:.3}, {final_gather}other {:.3}; total {:.3}\n{}",
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
        s.other,
        s.total,
        stop_line(r, rule)
    ) + &gathered
        + &r.bounded.lines().iter().map(|l| format!("{l}\n")).collect::<String>()
}
