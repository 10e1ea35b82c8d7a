//! Figure 17: the contours in and near the inner band of the ring, enlarged, by the four methods of the thesis.

use crate::cli::failure::Failure;
use crate::cli::paper::PaperFlags;
use crate::cli::paper::figure_16::crowding_line;
use crate::cli::paper::methods::{GATHERS, compared};
use crate::cli::paper::output::{Done, Head};
use crate::cli::paper::picture::{Picture, Strip};
use crate::cli::paper::rows::{Row, csv, rows, table};
use crate::cli::paper::test_case::{Crowding, Method, Origin, TestCase};
use crate::cli::paper::variants::ListedRadius;
use crate::estimate::registry;
use crate::render::LightPart;
use crate::render::film::Rect;
use crate::render::settings::Gather;
use serde::Serialize;
use std::path::Path;

/// Factor of enlargement.
const ENLARGE: u32 = 2;
/// Doublings of k that are tried.
const DOUBLINGS: u32 = 5;

#[derive(Serialize)]
struct Report<'a> {
    #[serde(flatten)]
    head: &'a Head,
    crop: Rect,
    crowding: Crowding,
    rows: &'a [Row],
}

/// Makes the figure.
///
/// # Errors
/// A wrong flag, a file that cannot be written, or an interruption.
pub fn run(item: &'static str, flags: &PaperFlags, folder: &Path) -> Result<Done, Failure> {
    let case = TestCase::new(item, flags, LightPart::Caustic)?;
    let crop = case.inner_band();
    let mut methods = compared()?;
    for gather in GATHERS {
        // What the corrected weight, the other grid and the listing's radius change.
        methods.push(Method::new("", "coplanar:weight=mean", gather, Origin::Cusp)?);
        methods.push(Method::new("", "multi_sampled:n=8,grid=cells", gather, Origin::Cusp)?);
        let inner = registry::estimator("multi_sampled:n=8,grid=closed")?;
        let estimator = Box::new(ListedRadius::new(inner, case.pass.maps.all()));
        methods.push(Method { title: "", estimator, gather, k: None, origin: Origin::Listing });
    }
    for doubling in 1..=DOUBLINGS {
        let k = case.pass.settings.k.saturating_mul(1 << doubling);
        let method = Method::new("", "integrated", Gather::Knn, Origin::Cusp)?;
        methods.push(Method { k: Some(k), ..method });
    }
    let shown = case.render(crop, &methods, item)?;
    let crowding = case.crowding(crop)?;
    let of_nearest = case.truth_of_nearest(crop)?;
    let truth = case.truth(crop)?;
    let rows = rows(&case, &methods, &shown, &truth, Some(&of_nearest));
    let head = Head::new(&case, item, "Pedersen 2011, figure 17, page 37");
    let strips = [
        Strip {
            title: format!("The inner band, enlarged: the {} nearest photons, as published", case.pass.settings.k),
            subtitle: head.subtitle(),
            methods: (0..5).collect(),
            truth: true,
            errors: true,
        },
        Strip {
            title: "The same photons, all that overlap".into(),
            subtitle: String::new(),
            methods: (5..10).collect(),
            truth: true,
            errors: true,
        },
    ];
    let picture =
        Picture { methods: &methods, shown: &shown, rows: &rows, truth: &truth, enlarge: ENLARGE }.draw(&strips);
    let text = format!(
        "{}\nover the crop {},{},{},{}; error: relative RMSE against regular with 16x16 view rays, all that overlap; to more rays: the same, each of the 16x16 with its own {} nearest; mean: over the truth's; black: pixels without light where integrated finds some by overlap\n{}",
        table(&rows),
        crop.x,
        crop.y,
        crop.width,
        crop.height,
        case.pass.settings.k,
        crowding_line(&crowding, case.pass.settings.k)
    );
    Done::write(folder, &head, &picture, &csv(&rows), &Report { head: &head, crop, crowding, rows: &rows }, &text)
}
