//! Figure 18: multi-sampled photon differentials with 2×2 to 16×16 sampling points.

use crate::cli::failure::Failure;
use crate::cli::paper::PaperFlags;
use crate::cli::paper::methods::GATHERS;
use crate::cli::paper::output::{Done, Head};
use crate::cli::paper::picture::{Picture, Strip};
use crate::cli::paper::rows::{Row, csv, rows, table};
use crate::cli::paper::test_case::{Method, Origin, TestCase};
use crate::cli::paper::variants::CarriedWeight;
use crate::estimate::multi_sampled::{Grid, MultiSampled};
use crate::render::LightPart;
use crate::render::film::Rect;
use serde::Serialize;
use std::path::Path;

/// Factor of enlargement.
const ENLARGE: u32 = 2;
/// Sampling points along each axis, as in the figure, with titles.
const POINTS: [(u32, &str); 4] = [
    (2, "(a) Multi-sampled, 2×2"),
    (4, "(b) Multi-sampled, 4×4"),
    (8, "(c) Multi-sampled, 8×8"),
    (16, "(d) Multi-sampled, 16×16"),
];

#[derive(Serialize)]
struct Report<'a> {
    #[serde(flatten)]
    head: &'a Head,
    crop: Rect,
    rows: &'a [Row],
}

/// Makes the figure.
///
/// # Errors
/// A wrong flag, a file that cannot be written, or an interruption.
pub fn run(item: &'static str, flags: &PaperFlags, folder: &Path) -> Result<Done, Failure> {
    let case = TestCase::new(item, flags, LightPart::Caustic)?;
    let crop = case.inner_band();
    let mut methods = Vec::new();
    // Of each gather: the closed grid, the cells, the listing's weights, then two to compare with.
    for gather in GATHERS {
        for (grid, origin) in [(Grid::Closed, Origin::Thesis), (Grid::Cells, Origin::Cusp)] {
            for (n, title) in POINTS {
                let estimator = Box::new(MultiSampled::new(n, grid));
                methods.push(Method { title, estimator, gather, k: None, origin });
            }
        }
        for (n, title) in POINTS {
            let estimator = Box::new(CarriedWeight::new(MultiSampled::new(n, Grid::Closed), n));
            methods.push(Method { title, estimator, gather, k: None, origin: Origin::Listing });
        }
        methods.push(Method::new("Integrated", "integrated", gather, Origin::Cusp)?);
        methods.push(Method::new("Regular", "regular", gather, Origin::Thesis)?);
    }
    let of_gather = methods.len() / 2;
    let shown = case.render(crop, &methods, item)?;
    let of_nearest = case.truth_of_nearest(crop)?;
    let truth = case.truth(crop)?;
    let rows = rows(&case, &methods, &shown, &truth, Some(&of_nearest));
    let head = Head::new(&case, item, "Pedersen 2011, figure 18, section 5.1");
    let k = case.pass.settings.k;
    let four = |first: usize| (first..first + POINTS.len()).collect::<Vec<_>>();
    // The grids differ in the errors, which the k nearest would hide; `integrated` and the truth stand there once.
    let strips = [
        Strip {
            title: format!("As listed: closed grid, weights carried from photon to photon, the {k} nearest"),
            subtitle: head.subtitle(),
            methods: four(2 * POINTS.len()),
            truth: false,
            errors: false,
        },
        Strip {
            title: "As written: closed grid; all photons that overlap".into(),
            subtitle: String::new(),
            methods: [four(of_gather), vec![of_gather + 3 * POINTS.len()]].concat(),
            truth: true,
            errors: true,
        },
        Strip {
            title: "Cell-centred grid; all photons that overlap".into(),
            subtitle: String::new(),
            methods: four(of_gather + POINTS.len()),
            truth: false,
            errors: true,
        },
    ];
    let picture =
        Picture { methods: &methods, shown: &shown, rows: &rows, truth: &truth, enlarge: ENLARGE }.draw(&strips);
    let text = format!(
        "{}\nover the crop {},{},{},{}; error: relative RMSE against regular with 16x16 view rays, all that overlap; to more rays: the same, each of the 16x16 with its own {k} nearest; mean: over the truth's; black: pixels without light where integrated finds some by overlap\nw_pd=carried: as listed, a photon's weight starts at that of the photon before, over N²\n",
        table(&rows),
        crop.x,
        crop.y,
        crop.width,
        crop.height,
    );
    Done::write(folder, &head, &picture, &csv(&rows), &Report { head: &head, crop, rows: &rows }, &text)
}
