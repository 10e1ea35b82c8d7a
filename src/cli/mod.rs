//! The command line: one file for each command.

pub mod compare;
mod compare_table;
pub mod diff;
pub mod failure;
pub mod flags;
pub mod inspect;
mod inspect_rays;
mod inspect_report;
mod inspect_text;
pub mod lists;
pub mod paper;
pub mod progress;
pub mod realtime;
pub mod render;
pub mod shot;
pub mod stress;
pub mod study;
pub mod table;
pub mod window;

use clap::{Parser, Subcommand};
use failure::Failure;
use flags::CommonFlags;
use std::ffi::OsString;
use std::process::ExitCode;

/// A workbench for photon differentials: what each radiance estimator makes of the same photons.
#[derive(Debug, Parser)]
#[command(name = "cusp", version, about, args_conflicts_with_subcommands = true, max_term_width = 110)]
struct Cli {
    #[command(subcommand)]
    command: Option<Command>,
    /// Opens the workbench on a built-in scene, a .toml, an .obj, a Quake 3 map (.bsp, .pk3:NAME) or a session; without a display it compares instead
    scene: Option<String>,
    #[command(flatten)]
    flags: CommonFlags,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Estimators side by side: sheet.png, crops, images (EXR and PNG), timings.csv, report.json
    Compare(compare::CompareArgs),
    /// One estimator, one image
    Render(render::RenderArgs),
    /// Why a pixel has its value: its view path, its photons, their weights under each estimator, the plan
    Inspect(inspect::InspectArgs),
    /// Every metric of an image against another, and the difference image
    Diff(diff::DiffArgs),
    /// Error against run time: study.csv, study.json, study.png
    Study(study::StudyArgs),
    /// The shards of a study as one
    Merge(study::merge::MergeArgs),
    /// Real-time photon mapping without a window: frame rate, renewal time, fluctuation
    Realtime(realtime::RealtimeArgs),
    /// The stability cases: worst errors of kernels and renders on stiff and extreme input; exit 1 if one fails
    Stress(stress::StressArgs),
    /// A figure or table of the papers, reproduced
    Paper(paper::PaperArgs),
    /// The workbench drawn to a file, without a window
    Shot(shot::ShotArgs),
    /// The built-in scenes
    Scenes(lists::ListArgs),
    /// The estimators and their settings
    Estimators(lists::ListArgs),
}

/// Runs the program on its arguments (the first is the program's name) and says how it ended:
/// 0 done, 1 the work failed, 2 the call was wrong, 130 interrupted.
pub fn main(args: impl IntoIterator<Item = OsString>) -> ExitCode {
    let cli = match Cli::try_parse_from(args) {
        Ok(cli) => cli,
        Err(e) if e.use_stderr() => {
            eprintln!("cusp: {}", one_line(&e));
            return ExitCode::from(2);
        }
        Err(help) => {
            // Help or version; a closed pipe is not a failure.
            let _ = help.print();
            return ExitCode::SUCCESS;
        }
    };
    let result = match cli.command {
        Some(Command::Compare(args)) => compare::run(&args),
        Some(Command::Render(args)) => render::run(&args),
        Some(Command::Inspect(args)) => inspect::run(&args),
        Some(Command::Diff(args)) => diff::run(&args),
        Some(Command::Study(args)) => study::run(&args),
        Some(Command::Merge(args)) => study::merge::run(&args),
        Some(Command::Realtime(args)) => realtime::run_realtime(&args),
        Some(Command::Stress(args)) => stress::run(&args),
        Some(Command::Paper(args)) => paper::run(&args),
        Some(Command::Shot(args)) => shot::run(&args),
        Some(Command::Scenes(args)) => lists::scenes(&args),
        Some(Command::Estimators(args)) => lists::estimators(&args),
        None => window::run(cli.scene.unwrap_or_else(|| "ring".into()), cli.flags),
    };
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => {
            eprintln!("cusp: {failure}");
            ExitCode::from(failure.code())
        }
    }
}

/// The first paragraph of a parser's complaint as one line, and where to read more.
fn one_line(error: &clap::Error) -> String {
    let text = error.to_string();
    let what: Vec<&str> = text
        .lines()
        .map(str::trim)
        .take_while(|l| !l.starts_with("Usage:") && !l.starts_with("For more"))
        .filter(|l| !l.is_empty())
        .collect();
    let what = what.join(" ");
    format!("{}; see `cusp --help`", what.strip_prefix("error: ").unwrap_or(&what))
}

/// Writes text to standard output; a reader that has gone away is no failure.
///
/// # Errors
/// Anything else that the system refuses.
fn print(text: &str) -> Result<(), Failure> {
    use std::io::Write;
    let mut out = std::io::stdout();
    // What is left in the buffer at the end would fail without a word.
    match out.write_all(text.as_bytes()).and_then(|()| out.flush()) {
        Err(e) if e.kind() != std::io::ErrorKind::BrokenPipe => Err(Failure::Work(format!("standard output: {e}"))),
        _ => Ok(()),
    }
}

/// A value as indented JSON with a line end.
///
/// # Errors
/// A value that JSON cannot hold, which would be a defect.
fn to_json<T: serde::Serialize>(value: &T) -> Result<String, Failure> {
    serde_json::to_string_pretty(value).map(|s| s + "\n").map_err(|e| Failure::Work(format!("JSON: {e}")))
}
