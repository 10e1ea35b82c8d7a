//! Figure 16: the caustic by the four methods of the thesis, the whole image.

use crate::cli::failure::Failure;
use crate::cli::paper::PaperFlags;
use crate::cli::paper::methods::compared;
use crate::cli::paper::output::{Done, Head};
use crate::cli::paper::picture::{Picture, Strip};
use crate::cli::paper::rows::{Row, csv, rows, table};
use crate::cli::paper::test_case::{Crowding, TestCase};
use crate::render::LightPart;
use serde::Serialize;
use std::path::Path;

#[derive(Serialize)]
struct Report<'a> {
    #[serde(flatten)]
    head: &'a Head,
    crowding: Crowding,
    rows: &'a [Row],
}

/// Makes the figure.
///
/// # Errors
/// A wrong flag, a file that cannot be written, or an interruption.
pub fn run(item: &'static str, flags: &PaperFlags, folder: &Path) -> Result<Done, Failure> {
    let case = TestCase::new(item, flags, LightPart::Caustic)?;
    let methods = compared()?;
    let shown = case.render(case.whole(), &methods, item)?;
    let crowding = case.crowding(case.whole())?;
    let truth = case.truth(case.whole())?;
    let rows = rows(&case, &methods, &shown, &truth, None);
    let head = Head::new(&case, item, "Pedersen 2011, figure 16, page 36");
    let strips = [
        Strip {
            title: format!("The caustic, whole: the {} nearest photons, as published", case.pass.settings.k),
            subtitle: head.subtitle(),
            methods: (0..5).collect(),
            truth: true,
            errors: false,
        },
        Strip {
            title: "The same photons, all that overlap".into(),
            subtitle: String::new(),
            methods: (5..10).collect(),
            truth: true,
            errors: false,
        },
    ];
    let picture = Picture { methods: &methods, shown: &shown, rows: &rows, truth: &truth, enlarge: 0 }.draw(&strips);
    let text = format!(
        "{}\nerror: relative RMSE over the whole image against regular with 16x16 view rays, all that overlap; mean: over the truth's; black: pixels without light where integrated finds some by overlap\n{}",
        table(&rows),
        crowding_line(&crowding, case.pass.settings.k)
    );
    Done::write(folder, &head, &picture, &csv(&rows), &Report { head: &head, crowding, rows: &rows }, &text)
}

/// Whether k is enough, in a sentence.
pub fn crowding_line(c: &Crowding, k: usize) -> String {
    format!(
        "photons that overlap at a lit view hit: {:.1} in the mean, {} at most; more than {k} at {:.1} % of the lit hits\n",
        c.mean,
        c.most,
        100.0 * c.share_above_k
    )
}
