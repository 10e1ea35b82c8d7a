//! Figure 19: where the time of the coplanar method goes, and how much of it is the polygon intersection.
//!
//! The thesis asked a sampling profiler. Here the photons of a tile are gathered once and evaluated by more and more
//! of the estimator's own steps; a step's time is the difference of two such runs over the same photons. No clock
//! stands inside a loop over photons, where it would cost more than what it times.

use crate::cli::failure::Failure;
use crate::cli::paper::PaperFlags;
use crate::cli::paper::bars::{self, Bar, Chart, Segment};
use crate::cli::paper::methods::GATHERS;
use crate::cli::paper::output::{Done, Head};
use crate::cli::paper::printed;
use crate::cli::paper::spread::Spread;
use crate::cli::paper::test_case::TestCase;
use crate::cli::progress::{bar, interrupted};
use crate::cli::table::Table;
use crate::estimate::clip::SQUARE_VERTICES;
use crate::estimate::coplanar::{Coplanar, Shape, Weight};
use crate::estimate::{Estimator, View};
use crate::export::sheet::PALETTE;
use crate::photons::MapPhoton;
use crate::render::LightPart;
use crate::render::photon_pass::PhotonMaps;
use crate::render::plan::Slot;
use crate::render::settings::Gather;
use crate::render::tiles::tiles;
use crate::render::view_pass::GatheredTile;
use serde::Serialize;
use std::fmt::Write;
use std::hint::black_box;
use std::path::Path;
use std::time::Instant;

/// Steps of the method, in the order in which they are done.
///
/// The intersection ends with the polygon's coverage and centroid: a polygon that nobody looks at would have to be
/// stored whole to be timed, which costs more than to look at it.
const STEPS: [&str; 6] =
    ["view rays", "gather", "loop over photons", "projection", "polygon intersection", "kernel and sum"];
/// Which of them is `get_intersection`.
const INTERSECTION: usize = 4;

#[derive(Debug, Serialize)]
struct Profile {
    gather: Gather,
    /// Photons that were looked at.
    photons: u64,
    /// Photons whose projected footprint meets the view footprint's box, and which are clipped.
    clipped: u64,
    /// Seconds of one thread for the whole view pass.
    seconds: Spread,
    steps: Vec<Step>,
    /// Share of the whole in the polygon intersection.
    intersection_share: Spread,
    /// The same with the projection.
    projection_and_intersection_share: Spread,
}

#[derive(Debug, Serialize)]
struct Step {
    step: &'static str,
    /// Seconds of one thread. A step that costs less than the measurement's noise may come out below 0.
    seconds: Spread,
    /// Share of the whole.
    share: Spread,
}

#[derive(Serialize)]
struct Printed {
    function: &'static str,
    share: f64,
    source: &'static str,
}

#[derive(Serialize)]
struct Report<'a> {
    #[serde(flatten)]
    head: &'a Head,
    repeats: u32,
    printed: Printed,
    profiles: &'a [Profile],
}

/// Measures and makes the figure.
///
/// # Errors
/// A wrong flag, a file that cannot be written, or an interruption.
pub fn run(item: &'static str, flags: &PaperFlags, folder: &Path) -> Result<Done, Failure> {
    let case = TestCase::new(item, flags, LightPart::Caustic)?;
    let repeats = flags.repeats();
    let profiles = GATHERS.into_iter().map(|g| profile(&case, g, repeats)).collect::<Result<Vec<_>, _>>()?;
    let mut head = Head::new(&case, item, "Pedersen 2011, figure 19, page 41");
    // Whatever --threads says: this item's clocks are those of one thread.
    head.origin.threads = 1;
    let text = format!(
        "{}\nshares of one thread's time for the whole view pass, the median of {repeats} repeats; in brackets the range\nprinted: {:.1} % in get_intersection ({}), the polygon intersection alone\n",
        table(&profiles),
        100.0 * printed::POLYGON_SHARE,
        head.origin.source,
    );
    let printed =
        Printed { function: "get_intersection", share: printed::POLYGON_SHARE, source: "Pedersen 2011, section 5.2" };
    let picture = bars::draw(&chart(&profiles, &head), 1200);
    let report = Report { head: &head, repeats, printed, profiles: &profiles };
    Done::write(folder, &head, &picture, &csv(&profiles), &report, &text)
}

/// Seconds of all steps, repeat by repeat.
fn profile(case: &TestCase, gather: Gather, repeats: u32) -> Result<Profile, Failure> {
    let coplanar = Coplanar::new(Shape::Parallelogram, Weight::Centroid);
    let slot = Slot { estimator: &coplanar, gather };
    let (view, maps) = (case.pass.view(), &case.pass.maps);
    let all = tiles(case.whole());
    let what = format!("coplanar, {}", gather.name());
    let progress = bar(all.len() as u64 * u64::from(repeats), &what, case.hidden());
    let mut seconds = vec![[0.0; STEPS.len()]; repeats as usize];
    let (mut photons, mut clipped) = (0, 0);
    for (repeat, sums) in seconds.iter_mut().enumerate() {
        for (number, tile) in all.iter().enumerate() {
            if interrupted() {
                progress.finish_and_clear();
                return Err(case.stopped());
            }
            let tile = view.gathered(*tile, &slot);
            let own = steps(&coplanar, &tile, maps, number + repeat);
            sums.iter_mut().zip(own).for_each(|(sum, s)| *sum += s);
            if repeat == 0 {
                for (hit, found) in tile.each(maps) {
                    let meets = |&&i: &&u32| Coplanar::projected(&found.photons[i as usize], &hit.view).is_some();
                    photons += found.indices.len() as u64;
                    clipped += found.indices.iter().filter(meets).count() as u64;
                }
            }
            progress.inc(1);
        }
    }
    progress.finish_and_clear();
    let total = |s: &[f64; STEPS.len()]| s.iter().sum::<f64>().max(f64::MIN_POSITIVE);
    let spread = |f: &dyn Fn(&[f64; STEPS.len()]) -> f64| Spread::of(&seconds.iter().map(f).collect::<Vec<_>>());
    let step = |(i, step)| Step { step, seconds: spread(&|s| s[i]), share: spread(&|s| s[i] / total(s)) };
    Ok(Profile {
        gather,
        photons,
        clipped,
        seconds: spread(&total),
        steps: STEPS.into_iter().enumerate().map(step).collect(),
        intersection_share: spread(&|s| s[INTERSECTION] / total(s)),
        projection_and_intersection_share: spread(&|s| (s[INTERSECTION] + s[INTERSECTION - 1]) / total(s)),
    })
}

/// Seconds of each step for one tile. The runs take turns at being first, by `turn`.
fn steps(coplanar: &Coplanar, tile: &GatheredTile, maps: &PhotonMaps, turn: usize) -> [f64; STEPS.len()] {
    const RUNS: usize = 4;
    let mut until = [0.0; RUNS];
    for run in 0..RUNS {
        let run = (run + turn) % RUNS;
        until[run] = match run {
            0 => timed(tile, maps, |p, _| f64::from(p.inverse_area)),
            1 => timed(tile, maps, |p, v| match Coplanar::projected(p, v) {
                Some(projected) => black_box(&projected)[0].x,
                None => 0.0,
            }),
            2 => timed(tile, maps, |p, v| match Coplanar::projected(p, v) {
                Some(projected) => {
                    let (coverage, centroid) = coplanar.clipped::<SQUARE_VERTICES>(projected).coverage_and_centroid();
                    coverage + centroid.x + centroid.y
                }
                None => 0.0,
            }),
            _ => {
                let start = Instant::now();
                for (hit, found) in tile.each(maps) {
                    black_box(coplanar.irradiance(&found, &hit.view));
                }
                start.elapsed().as_secs_f64()
            }
        };
    }
    let s = &tile.seconds;
    [s.view_trace, s.gather, until[0], until[1] - until[0], until[2] - until[1], until[3] - until[2]]
}

/// Seconds of `f` for all photons of all hits.
fn timed(tile: &GatheredTile, maps: &PhotonMaps, f: impl Fn(&MapPhoton, &View) -> f64) -> f64 {
    let start = Instant::now();
    for (hit, found) in tile.each(maps) {
        let mut sum = 0.0;
        for &i in found.indices {
            sum += f(&found.photons[i as usize], &hit.view);
        }
        black_box(sum);
    }
    start.elapsed().as_secs_f64()
}

fn table(profiles: &[Profile]) -> String {
    let heading = profiles.iter().flat_map(|p| [format!("{} s", p.gather.name()), "share".into(), String::new()]);
    let mut table = Table::new(std::iter::once("step".to_owned()).chain(heading));
    let cells = |seconds: &Spread, share: &Spread| {
        let percent = |x: f64| format!("{:.1}", 100.0 * x);
        [
            format!("{:.3}", seconds.median),
            format!("{} %", percent(share.median)),
            format!("({} to {})", percent(share.least), percent(share.most)),
        ]
    };
    for (i, step) in STEPS.into_iter().enumerate() {
        let numbers = profiles.iter().flat_map(|p| cells(&p.steps[i].seconds, &p.steps[i].share));
        table.row(std::iter::once(step.to_owned()).chain(numbers));
    }
    let all = profiles.iter().flat_map(|p| [format!("{:.3}", p.seconds.median), String::new(), String::new()]);
    table.row(std::iter::once("all".to_owned()).chain(all));
    table.text()
}

fn csv(profiles: &[Profile]) -> String {
    let mut csv = String::from("gather,step,median_s,least_s,largest_s,median_share,least_share,largest_share\n");
    for p in profiles {
        for step in &p.steps {
            let (s, x) = (step.seconds, step.share);
            // Writing to a string cannot fail.
            let _ = writeln!(
                csv,
                "{},{},{:.6},{:.6},{:.6},{:.6},{:.6},{:.6}",
                p.gather.name(),
                step.step,
                s.median,
                s.least,
                s.most,
                x.median,
                x.least,
                x.most
            );
        }
    }
    csv
}

fn chart(profiles: &[Profile], head: &Head) -> Chart {
    const REST: [u8; 3] = [110; 3];
    let colors: Vec<[u8; 3]> =
        (0..STEPS.len()).map(|i| if i == INTERSECTION { PALETTE[5] } else { PALETTE[[7, 1, 3, 2, 5, 0][i]] }).collect();
    let share = printed::POLYGON_SHARE;
    let mut bars = vec![Bar {
        label: "printed (get_intersection, rest)".into(),
        segments: vec![
            Segment { value: share, color: colors[INTERSECTION] },
            Segment { value: 1.0 - share, color: REST },
        ],
        number: format!("{:.1} %", 100.0 * share),
    }];
    bars.extend(profiles.iter().map(|p| Bar {
        label: match p.gather {
            Gather::Knn => format!("measured, the {} nearest", head.origin.settings.k),
            Gather::Overlap => "measured, all that overlap".into(),
        },
        segments: p.steps.iter().zip(&colors).map(|(s, c)| Segment { value: s.share.median, color: *c }).collect(),
        number: format!("{:.1} %", 100.0 * p.intersection_share.median),
    }));
    Chart {
        title: "Where the time of the coplanar method goes".into(),
        subtitle: head.subtitle(),
        legend: STEPS.iter().map(|s| (*s).to_owned()).zip(colors.iter().copied()).collect(),
        bars,
        note: "share of the time of the whole view pass; numbers: the polygon intersection".into(),
    }
}
