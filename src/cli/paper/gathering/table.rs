//! `gather-table`: the three tables of the benchmark (section 5), measured, with errors and memory beside the times.

use crate::cli::failure::Failure;
use crate::cli::paper::PaperFlags;
use crate::cli::paper::bars;
use crate::cli::paper::gathering::chart::chart;
use crate::cli::paper::gathering::layers::verdict;
use crate::cli::paper::gathering::measured::measure;
use crate::cli::paper::gathering::methods::Way;
use crate::cli::paper::gathering::output::Head;
use crate::cli::paper::gathering::printed::{PRINTED, TABLES};
use crate::cli::paper::gathering::reference::{Truth, TruthFacts};
use crate::cli::paper::gathering::room::{one_large_light, settings};
use crate::cli::paper::gathering::rows::{Section, csv, memory_text, summary, text};
use crate::cli::paper::output::Done;
use crate::cli::progress::{ProgressWatch, bar};
use crate::render::film::Rect;
use crate::render::settings::MAX_PHOTONS;
use crate::render::tiles::tiles;
use serde::Serialize;
use std::path::Path;

/// Pixels across and down by default: all nine cells by three ways then take a few minutes on two cores.
const SIZE: [u32; 2] = [64, 64];
/// Paths for each pixel of the reference at most.
const PATHS: u32 = 4096;

#[derive(Serialize)]
struct Report<'a> {
    #[serde(flatten)]
    head: &'a Head,
    repeats: u32,
    reference: TruthFacts,
    tables: &'a [Section],
    layers_on_disk: String,
}

/// Measures and makes the table.
///
/// # Errors
/// A wrong flag, a file that cannot be written, or an interruption.
pub fn run(item: &'static str, flags: &PaperFlags, folder: &Path) -> Result<Done, Failure> {
    let scene = one_large_light()?;
    let largest = PRINTED.iter().map(|t| t.photons).max().unwrap_or(1);
    let common = flags.common();
    let (hidden, repeats) = (common.quiet || common.json, flags.repeats.unwrap_or(1));
    // The flag is the number of the first table; the others keep their share of it.
    let asked = settings(&scene, flags, flags.photons.unwrap_or(largest), SIZE)?;
    let stopped = || Failure::Interrupted(format!("nothing of {item} was written"));
    let truth = Truth::new(&scene, asked.size, asked.max_depth, PATHS, hidden, item)?;
    let cells = PRINTED.iter().map(|t| t.rows.len() * Way::TIMED.len()).sum::<usize>();
    let steps = tiles(Rect::whole(asked.size)).len() * cells * repeats as usize;
    let progress = bar(steps as u64, item, hidden);
    let watch = ProgressWatch { bar: &progress, deadline: None };
    let mut sections = Vec::new();
    for printed in PRINTED {
        let photons = (asked.photons as f64 * printed.photons as f64 / largest as f64).round();
        let own = settings(&scene, flags, (photons as i64).clamp(1, MAX_PHOTONS), SIZE)?;
        let measured = measure(&scene, own, printed, repeats, &watch, &stopped);
        if measured.is_err() {
            progress.finish_and_clear();
        }
        sections.push(Section::new(measured?, &truth));
    }
    progress.finish_and_clear();
    let mut head = Head::new(item, TABLES, &scene, &asked);
    head.warnings.extend(truth.warnings.iter().cloned());
    let facts = truth.facts();
    let layers_on_disk = verdict(sections.iter().flat_map(|s| s.memory.iter().map(|m| &m.bytes)));
    let tables: Vec<String> = sections.iter().map(text).collect();
    let printed = format!(
        "{}\n{}\n{}\ntotal: trees, layers and image with direct light, without the photons, as in print; {} thread(s), the median of {repeats} repeat(s), ways in turn; ratios within a repeat; net: the error without the reference's own noise\n{}\n{layers_on_disk}\n",
        tables.join("\n"),
        memory_text(&sections),
        summary(&sections),
        head.threads,
        facts.line()
    );
    let picture = bars::draw(&chart(&sections, &head, facts.line()), 1000);
    let report = Report { head: &head, repeats, reference: facts, tables: &sections, layers_on_disk };
    head.write(folder, &picture, &csv(&sections), &report, &printed)
}
