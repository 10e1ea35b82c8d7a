//! Figure 15: a render of the test case in all light.

use crate::cli::failure::Failure;
use crate::cli::paper::PaperFlags;
use crate::cli::paper::output::{Done, Head};
use crate::cli::paper::picture::{Picture, Strip};
use crate::cli::paper::rows::{Row, csv, rows, table};
use crate::cli::paper::test_case::{Method, Origin, TestCase};
use crate::measure::Reference;
use crate::render::LightPart;
use crate::render::settings::Gather;
use serde::Serialize;
use std::path::Path;

#[derive(Serialize)]
struct Report<'a> {
    #[serde(flatten)]
    head: &'a Head,
    reference: Option<&'a str>,
    rows: &'a [Row],
}

/// Makes the figure.
///
/// # Errors
/// A wrong flag, a file that cannot be written, or an interruption.
pub fn run(item: &'static str, flags: &PaperFlags, folder: &Path) -> Result<Done, Failure> {
    let case = TestCase::new(item, flags, LightPart::All)?;
    let methods = [
        Method::new("Regular, the k nearest", "regular", Gather::Knn, Origin::Thesis)?,
        Method::new("Regular, all that overlap", "regular", Gather::Overlap, Origin::Thesis)?,
        Method::new("Integrated, all that overlap", "integrated", Gather::Overlap, Origin::Cusp)?,
    ];
    let shown = case.render(case.whole(), &methods, item)?;
    let truth = case.truth(case.whole())?;
    let mut rows = rows(&case, &methods, &shown, &truth, None);
    let mut head = Head::new(&case, item, "Pedersen 2011, figure 15, page 35");
    let reference = Reference::built_in("ring").map_err(Failure::Work)?;
    for (row, image) in rows.iter_mut().zip(&shown.images) {
        match reference.as_ref().map(|r| r.error_of(image)) {
            Some(Ok(error)) => row.reference_error = Some(error),
            Some(Err(why)) if head.origin.warnings.is_empty() => {
                head.origin.warnings.push(format!("no error against the built-in reference: {why}"));
            }
            _ => {}
        }
    }
    let strip = Strip {
        title: "The common test case, all light".into(),
        subtitle: head.subtitle(),
        methods: vec![0, 1, 2],
        truth: true,
        errors: false,
    };
    let picture = Picture { methods: &methods, shown: &shown, rows: &rows, truth: &truth, enlarge: 0 }.draw(&[strip]);
    let reference = reference.as_ref().map(|r| r.source.as_str()).filter(|_| rows[0].reference_error.is_some());
    let mut text = table(&rows);
    text.push_str("\nerror: relative RMSE over the whole image against regular with 16x16 view rays; the outlines of the ring are in it, which only more view rays smooth; black: pixels without light where integrated finds some by overlap\n");
    if let Some(reference) = reference {
        text.push_str(&format!("to reference: the same against the {reference}\n"));
    }
    Done::write(folder, &head, &picture, &csv(&rows), &Report { head: &head, reference, rows: &rows }, &text)
}
