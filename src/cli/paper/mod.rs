//! `cusp paper`: figures and tables of the papers, reproduced.

mod bars;
mod figure_15;
mod figure_16;
mod figure_17;
mod figure_18;
mod figure_19;
mod gathering;
mod methods;
mod output;
mod picture;
mod printed;
mod realtime;
mod rows;
mod spread;
mod table_1;
mod test_case;
mod variants;

use crate::cli::failure::Failure;
use crate::cli::flags::{CommonFlags, count, size};
use crate::cli::progress::listen_for_interrupts;
use crate::cli::{print, to_json};
use clap::{Args, ValueEnum};
use output::Done;
use serde::Serialize;
use std::path::{Path, PathBuf};

const VERSION: &str = env!("CARGO_PKG_VERSION");

/// Flags of `paper`.
#[derive(Debug, Args)]
pub struct PaperArgs {
    /// What to reproduce; a list of the items if left out
    #[arg(value_enum)]
    item: Option<ItemName>,
    #[command(flatten)]
    flags: PaperFlags,
}

/// The common flags that mean something here: they override the settings of an item.
#[derive(Clone, Debug, Default, Args)]
pub struct PaperFlags {
    /// Size of the image in pixels; if left out 512x512 for the thesis, 64x64 for gather-table, 96x96 for its figures 4 and 5
    #[arg(long, value_name = "WxH", value_parser = size)]
    size: Option<[u32; 2]>,
    /// Photons emitted; if left out 446300 for the thesis, which store the published 4978 caustic ones, 1e6 for gather-table; of the realtime items bias, fluctuation and figures 6.3, 6.5 and 6.6 take it
    #[arg(long, value_name = "N", value_parser = count, allow_negative_numbers = true)]
    photons: Option<i64>,
    /// Factor on the axes of all photon footprints; 8.86 if left out: the published size times the listing's smoothing
    #[arg(long, value_name = "S", allow_negative_numbers = true)]
    footprint_scale: Option<f64>,
    /// Photons of a density estimate; the published 50 if left out
    #[arg(long, value_name = "K", value_parser = count, allow_negative_numbers = true)]
    k: Option<i64>,
    /// Repeats of what is timed; if left out 5 for table-1 and figure-19, 1 for gather-table
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1000))]
    repeats: Option<u32>,
    /// Seed of everything random; 1 if left out
    #[arg(long, value_name = "N")]
    seed: Option<u64>,
    /// Threads; all cores if left out
    #[arg(long, value_name = "T")]
    threads: Option<usize>,
    /// Folder for files; cusp-out/paper-ITEM if left out
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Print JSON instead of a table
    #[arg(long)]
    json: bool,
    /// Print nothing but errors
    #[arg(long)]
    quiet: bool,
}

impl PaperFlags {
    /// As the flags of other commands.
    fn common(&self) -> CommonFlags {
        CommonFlags {
            size: self.size,
            photons: self.photons,
            footprint_scale: self.footprint_scale,
            k: self.k,
            seed: self.seed,
            threads: self.threads,
            out: self.out.clone(),
            json: self.json,
            quiet: self.quiet,
            ..Default::default()
        }
    }

    /// Repeats of what is timed.
    fn repeats(&self) -> u32 {
        self.repeats.unwrap_or(5)
    }
}

/// Names of the items on the command line.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum ItemName {
    #[value(name = "figure-15")]
    Figure15,
    #[value(name = "figure-16")]
    Figure16,
    #[value(name = "figure-17")]
    Figure17,
    #[value(name = "figure-18")]
    Figure18,
    #[value(name = "table-1")]
    Table1,
    #[value(name = "figure-19")]
    Figure19,
    #[value(name = "gather-table")]
    GatherTable,
    #[value(name = "gather-figure-1")]
    GatherFigure1,
    #[value(name = "gather-figure-2")]
    GatherFigure2,
    #[value(name = "gather-figure-3")]
    GatherFigure3,
    #[value(name = "gather-figure-4")]
    GatherFigure4,
    #[value(name = "gather-figure-5")]
    GatherFigure5,
    #[value(name = "realtime-table-5.1")]
    RealtimeTable51,
    #[value(name = "realtime-table-6.1")]
    RealtimeTable61,
    #[value(name = "realtime-table-6.2")]
    RealtimeTable62,
    #[value(name = "realtime-figure-6.1")]
    RealtimeFigure61,
    #[value(name = "realtime-figure-6.2")]
    RealtimeFigure62,
    #[value(name = "realtime-figure-6.3")]
    RealtimeFigure63,
    #[value(name = "realtime-figure-6.4")]
    RealtimeFigure64,
    #[value(name = "realtime-figure-6.5")]
    RealtimeFigure65,
    #[value(name = "realtime-figure-6.6")]
    RealtimeFigure66,
    #[value(name = "realtime-figure-6.7")]
    RealtimeFigure67,
    #[value(name = "realtime-figure-6.8")]
    RealtimeFigure68,
    #[value(name = "realtime-figure-6.9")]
    RealtimeFigure69,
    #[value(name = "realtime-scattering")]
    RealtimeScattering,
    #[value(name = "realtime-bias")]
    RealtimeBias,
    #[value(name = "realtime-fluctuation")]
    RealtimeFluctuation,
    #[value(name = "realtime-timing")]
    RealtimeTiming,
    #[value(name = "realtime-parameters")]
    RealtimeParameters,
    All,
}

/// A figure or table.
struct Item {
    name: ItemName,
    id: &'static str,
    source: &'static str,
    summary: &'static str,
    run: fn(&'static str, &PaperFlags, &Path) -> Result<Done, Failure>,
}

const ITEMS: [Item; 29] = [
    Item {
        name: ItemName::Figure15,
        id: "figure-15",
        source: "Pedersen 2011, figure 15",
        summary: "the test case in all light",
        run: figure_15::run,
    },
    Item {
        name: ItemName::Figure16,
        id: "figure-16",
        source: "Pedersen 2011, figure 16",
        summary: "the caustic by the four methods, whole",
        run: figure_16::run,
    },
    Item {
        name: ItemName::Figure17,
        id: "figure-17",
        source: "Pedersen 2011, figure 17",
        summary: "its contours in the inner band of the ring, enlarged",
        run: figure_17::run,
    },
    Item {
        name: ItemName::Figure18,
        id: "figure-18",
        source: "Pedersen 2011, figure 18",
        summary: "multi-sampled with 2×2 to 16×16 points",
        run: figure_18::run,
    },
    Item {
        name: ItemName::Table1,
        id: "table-1",
        source: "Pedersen 2011, table 1",
        summary: "rendering times of the four methods",
        run: table_1::run,
    },
    Item {
        name: ItemName::Figure19,
        id: "figure-19",
        source: "Pedersen 2011, figure 19",
        summary: "time in the polygon intersection of the coplanar method",
        run: figure_19::run,
    },
    Item {
        name: ItemName::GatherTable,
        id: "gather-table",
        source: "Gjøl et al., section 5",
        summary: "final gathering: times, memory and errors, classic and with ray differentials",
        run: gathering::table::run,
    },
    Item {
        name: ItemName::GatherFigure1,
        id: "gather-figure-1",
        source: "Gjøl et al., figure 1",
        summary: "an estimate at the edge of a box: photons, and estimates wholly inside",
        run: gathering::figure_1::run,
    },
    Item {
        name: ItemName::GatherFigure2,
        id: "gather-figure-2",
        source: "Gjøl et al., figure 2",
        summary: "photons, the ones that are kept, and the first two layers of the pyramid",
        run: gathering::figure_2::run,
    },
    Item {
        name: ItemName::GatherFigure3,
        id: "gather-figure-3",
        source: "Gjøl et al., figure 3",
        summary: "footprints of gather rays on the hemisphere, and how much they cover",
        run: gathering::figure_3::run,
    },
    Item {
        name: ItemName::GatherFigure4,
        id: "gather-figure-4",
        source: "Gjøl et al., figure 4",
        summary: "the room by 200 gather rays, with errors",
        run: gathering::figures_4_5::run_4,
    },
    Item {
        name: ItemName::GatherFigure5,
        id: "gather-figure-5",
        source: "Gjøl et al., figure 5",
        summary: "the room by 800 gather rays, with errors",
        run: gathering::figures_4_5::run_5,
    },
    Item {
        name: ItemName::RealtimeTable51,
        id: "realtime-table-5.1",
        source: "Kristensen and Ottosen 2003, table 5.1",
        summary: "a search in one photon map or in several",
        run: realtime::table_5_1::run,
    },
    Item {
        name: ItemName::RealtimeTable61,
        id: "realtime-table-6.1",
        source: "Kristensen and Ottosen 2003, table 6.1",
        summary: "frames per second over triangles and photons",
        run: realtime::table_6_1::run,
    },
    Item {
        name: ItemName::RealtimeTable62,
        id: "realtime-table-6.2",
        source: "Kristensen and Ottosen 2003, table 6.2",
        summary: "frame rate and renewal time over accumulation frames",
        run: realtime::table_6_2::run,
    },
    Item {
        name: ItemName::RealtimeFigure61,
        id: "realtime-figure-6.1",
        source: "Kristensen and Ottosen 2003, figure 6.1",
        summary: "the Cornell box with and without the sphere slice",
        run: realtime::figures::run_1,
    },
    Item {
        name: ItemName::RealtimeFigure62,
        id: "realtime-figure-6.2",
        source: "Kristensen and Ottosen 2003, figure 6.2",
        summary: "directions of emission",
        run: realtime::figures::run_2,
    },
    Item {
        name: ItemName::RealtimeFigure63,
        id: "realtime-figure-6.3",
        source: "Kristensen and Ottosen 2003, figure 6.3",
        summary: "the box by photon mapping in every pixel",
        run: realtime::figures::run_3,
    },
    Item {
        name: ItemName::RealtimeFigure64,
        id: "realtime-figure-6.4",
        source: "Kristensen and Ottosen 2003, figure 6.4",
        summary: "final gathering from vertices",
        run: realtime::figures::run_4,
    },
    Item {
        name: ItemName::RealtimeFigure65,
        id: "realtime-figure-6.5",
        source: "Kristensen and Ottosen 2003, figure 6.5",
        summary: "colour bleeding at two frame rates",
        run: realtime::figures::run_5,
    },
    Item {
        name: ItemName::RealtimeFigure66,
        id: "realtime-figure-6.6",
        source: "Kristensen and Ottosen 2003, figure 6.6",
        summary: "soft shadows at two frame rates",
        run: realtime::figures::run_6,
    },
    Item {
        name: ItemName::RealtimeFigure67,
        id: "realtime-figure-6.7",
        source: "Kristensen and Ottosen 2003, figure 6.7",
        summary: "indirect light in the level, coarse meshes",
        run: realtime::figures::run_7,
    },
    Item {
        name: ItemName::RealtimeFigure68,
        id: "realtime-figure-6.8",
        source: "Kristensen and Ottosen 2003, figure 6.8",
        summary: "the same, fine meshes",
        run: realtime::figures::run_8,
    },
    Item {
        name: ItemName::RealtimeFigure69,
        id: "realtime-figure-6.9",
        source: "Kristensen and Ottosen 2003, figure 6.9",
        summary: "the flashlight",
        run: realtime::figures::run_9,
    },
    Item {
        name: ItemName::RealtimeScattering,
        id: "realtime-scattering",
        source: "Kristensen and Ottosen 2003, section 3.4",
        summary: "how even directions are; splitting against roulette",
        run: realtime::scattering::run,
    },
    Item {
        name: ItemName::RealtimeBias,
        id: "realtime-bias",
        source: "Kristensen and Ottosen 2003, section 3.5",
        summary: "bias of each search and area, in parts",
        run: realtime::bias::run,
    },
    Item {
        name: ItemName::RealtimeFluctuation,
        id: "realtime-fluctuation",
        source: "Kristensen and Ottosen 2003, section 5.2.2",
        summary: "fluctuation with and without coherent numbers",
        run: realtime::fluctuation::run,
    },
    Item {
        name: ItemName::RealtimeTiming,
        id: "realtime-timing",
        source: "Kristensen and Ottosen 2003, section 4.5.1",
        summary: "parts of a frame by themselves and in context",
        run: realtime::timing::run,
    },
    Item {
        name: ItemName::RealtimeParameters,
        id: "realtime-parameters",
        source: "Kristensen and Ottosen 2003, section 6.1",
        summary: "what each parameter costs",
        run: realtime::parameters::run,
    },
];

/// Reproduces an item, or lists them.
///
/// # Errors
/// A wrong call, a file that cannot be written, or an interruption.
pub fn run(args: &PaperArgs) -> Result<(), Failure> {
    let Some(name) = args.item else {
        return list(args.flags.json);
    };
    listen_for_interrupts();
    args.flags.common().on_threads(|| make(name, &args.flags))
}

fn make(name: ItemName, flags: &PaperFlags) -> Result<(), Failure> {
    let chosen = || ITEMS.iter().filter(|i| name == ItemName::All || i.name == name);
    let of_all = name == ItemName::All;
    let id = if of_all { "all" } else { chosen().next().map_or("", |i| i.id) };
    let folder = flags.out.clone().unwrap_or_else(|| Path::new("cusp-out").join(format!("paper-{id}")));
    let mut done = Vec::new();
    let mut written = Vec::new();
    for item in chosen() {
        let result = (item.run)(item.id, flags, &folder).map_err(|failure| match failure {
            Failure::Interrupted(why) if !written.is_empty() => {
                Failure::Interrupted(format!("{why}; {} are in {}", written.join(", "), folder.display()))
            }
            other => other,
        })?;
        written.push(item.id);
        if flags.json {
            done.push(result.json);
        } else if !flags.quiet {
            result.warnings.iter().for_each(|w| eprintln!("warning: {w}"));
            let end = format!("files in {}: {}.png, .csv, .json\n", folder.display(), item.id);
            print(&format!("{}{end}{}", result.text, if of_all { "\n" } else { "" }))?;
        }
    }
    match (flags.json, of_all) {
        (true, false) => print(&done.concat()),
        (true, true) => print(&format!("{{ \"version\": \"{VERSION}\", \"items\": [\n{}] }}\n", done.join(","))),
        (false, _) => Ok(()),
    }
}

#[derive(Serialize)]
struct Listed {
    item: &'static str,
    source: &'static str,
    summary: &'static str,
}

fn list(json: bool) -> Result<(), Failure> {
    if json {
        let items: Vec<_> = ITEMS.iter().map(|i| Listed { item: i.id, source: i.source, summary: i.summary }).collect();
        return print(&to_json(&serde_json::json!({ "version": VERSION, "items": items }))?);
    }
    let mut text = String::new();
    let widest = |f: fn(&Item) -> &str| ITEMS.iter().map(|i| f(i).chars().count()).max().unwrap_or(0);
    let (id, width) = (widest(|i| i.id), widest(|i| i.source));
    for i in &ITEMS {
        text.push_str(&format!("{:<id$}  {:<width$}  {}\n", i.id, i.source, i.summary));
    }
    text.push_str(&format!("{:<id$}  {:<width$}  every one of them\n", "all", ""));
    print(&text)
}
