//! Table 1: the rendering times of the four methods, as ratios to the regular method with one view ray.

use crate::cli::failure::Failure;
use crate::cli::paper::PaperFlags;
use crate::cli::paper::bars::{self, Bar, Chart, Segment};
use crate::cli::paper::methods::{GATHERS, compared};
use crate::cli::paper::output::{Done, Head};
use crate::cli::paper::printed::{self, PrintedSeconds};
use crate::cli::paper::spread::Spread;
use crate::cli::paper::test_case::{Method, Origin, TestCase};
use crate::cli::progress::{ProgressWatch, bar};
use crate::cli::table::Table;
use crate::export::sheet::PALETTE;
use crate::render::LightPart;
use crate::render::settings::Gather;
use crate::render::tiles::tiles;
use serde::Serialize;
use std::fmt::Write;
use std::path::Path;

/// A method: what is printed and what was measured.
#[derive(Debug, Serialize)]
struct Timed {
    estimator: String,
    gather: Gather,
    origin: Origin,
    printed: Option<PrintedRow>,
    /// Wall seconds of the view pass, repeat by repeat.
    seconds: Vec<f64>,
    seconds_spread: Spread,
    /// Seconds over those of `regular` with the same gather in the same repeat.
    ratio_to_regular: Spread,
}

#[derive(Debug, Serialize)]
struct PrintedRow {
    #[serde(flatten)]
    printed: PrintedSeconds,
    ratio_to_regular: f64,
    source: &'static str,
}

#[derive(Serialize)]
struct Report<'a> {
    #[serde(flatten)]
    head: &'a Head,
    repeats: u32,
    rows: &'a [Timed],
}

/// Measures and makes the table.
///
/// # Errors
/// A wrong flag, a file that cannot be written, or an interruption.
pub fn run(item: &'static str, flags: &PaperFlags, folder: &Path) -> Result<Done, Failure> {
    let case = TestCase::new(item, flags, LightPart::Caustic)?;
    let methods = compared()?;
    let seconds = measure(&case, &methods, flags.repeats())?;
    let rows = rows(&methods, seconds);
    let head = Head::new(&case, item, printed::TABLE_1);
    let text = format!(
        "{}\nseconds of the view pass alone, {} thread(s), the median of {} repeats in turn; ratios within a repeat, with the least and the largest\nprinted: the quotients of the seconds in {}\n",
        table(&rows),
        head.origin.threads,
        flags.repeats(),
        printed::TABLE_1
    );
    let picture = bars::draw(&chart(&rows, &head), 900);
    let report = Report { head: &head, repeats: flags.repeats(), rows: &rows };
    Done::write(folder, &head, &picture, &csv(&rows), &report, &text)
}

/// Seconds of each method in each repeat. Methods take turns at being first.
fn measure(case: &TestCase, methods: &[Method], repeats: u32) -> Result<Vec<Vec<f64>>, Failure> {
    let steps = tiles(case.whole()).len() * methods.len() * repeats as usize;
    let progress = bar(steps as u64, "view passes", case.hidden());
    let watch = ProgressWatch { bar: &progress, deadline: None };
    let mut seconds = vec![Vec::new(); methods.len()];
    for repeat in 0..repeats as usize {
        for i in 0..methods.len() {
            let i = (i + repeat) % methods.len();
            match case.time(&methods[i], &watch) {
                Ok(s) => seconds[i].push(s),
                Err(stopped) => {
                    progress.finish_and_clear();
                    return Err(stopped);
                }
            }
        }
    }
    progress.finish_and_clear();
    Ok(seconds)
}

fn rows(methods: &[Method], seconds: Vec<Vec<f64>>) -> Vec<Timed> {
    let base = |gather: Gather| methods.iter().position(|m| m.estimator.id() == "regular" && m.gather == gather);
    let ratios: Vec<Vec<f64>> = methods
        .iter()
        .zip(&seconds)
        .map(|(m, own)| {
            let regular = base(m.gather).map_or(own, |i| &seconds[i]);
            own.iter().zip(regular).map(|(s, r)| s / r.max(f64::MIN_POSITIVE)).collect()
        })
        .collect();
    methods
        .iter()
        .zip(seconds)
        .zip(ratios)
        .map(|((m, seconds), ratios)| Timed {
            estimator: m.estimator.name(),
            gather: m.gather,
            origin: m.origin,
            printed: printed::of_estimator(&m.estimator.name()).map(|p| PrintedRow {
                printed: p,
                ratio_to_regular: p.ratio(),
                source: printed::TABLE_1,
            }),
            seconds_spread: Spread::of(&seconds),
            ratio_to_regular: Spread::of(&ratios),
            seconds,
        })
        .collect()
}

fn table(rows: &[Timed]) -> String {
    let mut table =
        Table::new(["estimator", "gather", "printed s", "printed x regular", "s", "x regular", "least", "largest"]);
    for r in rows {
        let ratio = |x: f64| format!("{x:.2}");
        let printed = r.printed.as_ref();
        table.row([
            r.estimator.clone(),
            r.gather.name().into(),
            printed.map_or("-".into(), |p| format!("{:.3}", p.printed.seconds)),
            printed.map_or("-".into(), |p| ratio(p.ratio_to_regular)),
            format!("{:.3}", r.seconds_spread.median),
            ratio(r.ratio_to_regular.median),
            ratio(r.ratio_to_regular.least),
            ratio(r.ratio_to_regular.most),
        ]);
    }
    table.text()
}

fn csv(rows: &[Timed]) -> String {
    let mut csv = String::from(
        "estimator,gather,printed_s,printed_ratio,median_s,least_s,largest_s,median_ratio,least_ratio,largest_ratio\n",
    );
    let number = |x: Option<f64>| x.map_or(String::new(), |x| format!("{x:.6}"));
    for r in rows {
        let (s, x, p) = (r.seconds_spread, r.ratio_to_regular, r.printed.as_ref());
        // Writing to a string cannot fail.
        let _ = writeln!(
            csv,
            "\"{}\",{},{},{},{:.6},{:.6},{:.6},{:.6},{:.6},{:.6}",
            r.estimator,
            r.gather.name(),
            number(p.map(|p| p.printed.seconds)),
            number(p.map(|p| p.ratio_to_regular)),
            s.median,
            s.least,
            s.most,
            x.median,
            x.least,
            x.most
        );
    }
    csv
}

fn chart(rows: &[Timed], head: &Head) -> Chart {
    let colors = [PALETTE[7], PALETTE[0], PALETTE[1]];
    let legend = [
        "printed".to_owned(),
        format!("measured, the {} nearest as published", head.origin.settings.k),
        "measured, all that overlap".to_owned(),
    ];
    let mut bars = Vec::new();
    let single = |label: &str, value: f64, color: [u8; 3], number: String| Bar {
        label: label.into(),
        segments: vec![Segment { value, color }],
        number,
    };
    for first in rows.iter().filter(|r| r.gather == GATHERS[0]) {
        let label = first.printed.as_ref().map_or("Integrated (this program)", |p| p.printed.method);
        bars.push(Bar { label: label.into(), segments: vec![], number: String::new() });
        if let Some(p) = &first.printed {
            bars.push(single("    printed", p.ratio_to_regular, colors[0], format!("{:.2}", p.ratio_to_regular)));
        }
        for r in rows.iter().filter(|r| r.estimator == first.estimator) {
            let color = if r.gather == Gather::Knn { colors[1] } else { colors[2] };
            let x = r.ratio_to_regular;
            let number = format!("{:.2} ({:.2} to {:.2})", x.median, x.least, x.most);
            bars.push(single(&format!("    {}", r.gather.name()), x.median, color, number));
        }
    }
    Chart {
        title: "Rendering time over that of the regular method".into(),
        subtitle: head.subtitle(),
        legend: legend.into_iter().zip(colors).collect(),
        bars,
        note: "each gather over its own regular method with one view ray; medians, in brackets the range".into(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ratios_are_taken_within_a_repeat() {
        let methods = compared().expect("registered");
        let mut seconds: Vec<Vec<f64>> = vec![vec![1.0, 1.0, 1.0]; methods.len()];
        // The machine was slow in the last repeat, which both methods felt.
        seconds[0] = vec![2.0, 2.0, 20.0];
        seconds[1] = vec![16.0, 18.0, 160.0];
        let rows = rows(&methods, seconds);
        assert_eq!(rows[0].ratio_to_regular, Spread { median: 1.0, least: 1.0, most: 1.0 });
        assert_eq!(rows[1].ratio_to_regular, Spread { median: 8.0, least: 8.0, most: 9.0 });
        assert_eq!(rows[6].ratio_to_regular.median, 1.0);
        let printed = rows[2].printed.as_ref().expect("in table 1");
        assert_eq!(printed.ratio_to_regular, 380.045 / 20.637);
        assert!(rows[4].printed.is_none());
        assert_eq!(csv(&rows).lines().count(), 11);
    }
}
