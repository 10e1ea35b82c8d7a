//! `gather-figure-4` and `gather-figure-5`: the room without and with ray differentials, by 200 and by 800 gather rays.

use crate::cli::failure::Failure;
use crate::cli::paper::PaperFlags;
use crate::cli::paper::gathering::methods::Way;
use crate::cli::paper::gathering::output::{Head, counts};
use crate::cli::paper::gathering::reference::{Truth, TruthFacts};
use crate::cli::paper::gathering::room::{settings, two_lights};
use crate::cli::paper::output::Done;
use crate::cli::progress::{ProgressWatch, bar, interrupted};
use crate::cli::table::{Table, percent};
use crate::estimate::Estimator;
use crate::export::sheet::{self, Column, PALETTE, Sheet, signed_error};
use crate::export::tone::{Look, ToneMap, auto_exposure};
use crate::measure::ErrorMetrics;
use crate::render::Pass;
use crate::render::film::{Image, Rect};
use crate::render::plan::Slot;
use crate::render::settings::Gather;
use crate::render::stats::StoredCounts;
use crate::render::tiles::tiles;
use serde::Serialize;
use std::fmt::Write;
use std::path::Path;

/// Photons emitted by default; the paper does not say how many its figures had.
const PHOTONS: i64 = 500_000;
/// Radius of the first search and of the first layer, metres.
const RADIUS: f32 = 0.05;
/// Pixels across and down by default.
const SIZE: [u32; 2] = [96, 96];
/// Paths for each pixel of the reference at most.
const PATHS: u32 = 2048;
/// The part that is enlarged: x, y, width and height over the image's.
const CROP: [f64; 4] = [0.22, 0.44, 0.625, 0.44];
/// Width of an enlarged part, about, pixels.
const ACROSS: u32 = 320;

#[derive(Serialize)]
struct Row {
    way: Way,
    estimator: String,
    /// Seconds of the image beside the others, without the photons and what is made of them.
    image_s: f64,
    error: Option<ErrorMetrics>,
    /// Relative RMSE without the reference's own noise.
    net_relative_rmse: Option<f64>,
}

#[derive(Serialize)]
struct Report<'a> {
    #[serde(flatten)]
    head: &'a Head,
    rays: u32,
    radius_m: f32,
    photons_stored: StoredCounts,
    reference: TruthFacts,
    rows: &'a [Row],
}

/// Makes figure 4.
///
/// # Errors
/// As [`run`].
pub fn run_4(item: &'static str, flags: &PaperFlags, folder: &Path) -> Result<Done, Failure> {
    run(item, "Gjøl, Larsen and Christensen, figure 4", 200, flags, folder)
}

/// Makes figure 5.
///
/// # Errors
/// As [`run`].
pub fn run_5(item: &'static str, flags: &PaperFlags, folder: &Path) -> Result<Done, Failure> {
    run(item, "Gjøl, Larsen and Christensen, figure 5", 800, flags, folder)
}

/// # Errors
/// A wrong flag, a file that cannot be written, or an interruption.
fn run(
    item: &'static str,
    source: &'static str,
    rays: u32,
    flags: &PaperFlags,
    folder: &Path,
) -> Result<Done, Failure> {
    let scene = two_lights()?;
    let settings = settings(&scene, flags, flags.photons.unwrap_or(PHOTONS), SIZE)?;
    let hidden = flags.quiet || flags.json;
    let stopped = || Failure::Interrupted(format!("nothing of {item} was written"));
    let truth = Truth::new(&scene, settings.size, settings.max_depth, PATHS, hidden, item)?;
    let estimators: Result<Vec<Box<dyn Estimator>>, _> =
        Way::SHOWN.iter().map(|way| way.estimator(rays, RADIUS)).collect();
    let estimators = estimators?;
    let slots: Vec<Slot> = estimators.iter().map(|e| Slot::new(e.as_ref(), Gather::Overlap)).collect();
    let pass = Pass::for_slots(scene, settings, &slots, 0, &interrupted)?.ok_or_else(stopped)?;
    let whole = Rect::whole(pass.settings.size);
    let progress = bar(tiles(whole).len() as u64, item, hidden);
    let result = pass.view().run(whole, &slots, &ProgressWatch { bar: &progress, deadline: None });
    progress.finish_and_clear();
    if !result.complete {
        return Err(stopped());
    }
    let images: Vec<Image> = (0..slots.len()).map(|i| result.image(i, whole)).collect();
    let rows: Vec<Row> = (0..slots.len())
        .map(|i| {
            let error = truth.error(&images[i]);
            Row {
                way: Way::SHOWN[i],
                estimator: estimators[i].name(),
                image_s: result.seconds[i].total(),
                error,
                net_relative_rmse: error.and_then(|e| truth.net(e.relative_rmse)),
            }
        })
        .collect();
    let mut head = Head::new(item, source, &pass.scene, &pass.settings);
    head.warnings.extend(truth.warnings.iter().cloned());
    let facts = truth.facts();
    let picture = draw(&images, &rows, &truth, rays, &head);
    let mut table = Table::new(["final gathering", "image s", "x classic", "error", "net", "mean"]);
    let mut csv = String::from("rays,way,estimator,image_s,relative_rmse,net_relative_rmse,mean_ratio\n");
    let classic = rows.first().map_or(0.0, |r| r.image_s).max(f64::MIN_POSITIVE);
    for r in &rows {
        table.row([
            r.way.title().into(),
            format!("{:.2}", r.image_s),
            format!("{:.2}", r.image_s / classic),
            percent(r.error.map(|e| e.relative_rmse)),
            percent(r.net_relative_rmse),
            r.error.map_or("-".into(), |e| format!("{:.3}", e.mean_ratio)),
        ]);
        let of = |f: fn(&ErrorMetrics) -> f64| r.error.as_ref().map_or(String::new(), |e| format!("{:.6}", f(e)));
        let net = r.net_relative_rmse.map_or(String::new(), |e| format!("{e:.6}"));
        let (error, mean) = (of(|e| e.relative_rmse), of(|e| e.mean_ratio));
        // Writing to a string cannot fail.
        let _ = writeln!(csv, "{rays},{},\"{}\",{:.6},{error},{net},{mean}", r.way.name(), r.estimator, r.image_s);
    }
    let text = format!(
        "{}\n{rays} gather rays, {} photons emitted, first radius {RADIUS} m; net: the error without the reference's own noise\n{}\n",
        table.text(),
        pass.photons.emitted,
        facts.line()
    );
    let photons_stored = counts(&pass.photons.stored);
    let report = Report { head: &head, rays, radius_m: RADIUS, photons_stored, reference: facts, rows: &rows };
    head.write(folder, &picture, &csv, &report, &text)
}

fn draw(images: &[Image], rows: &[Row], truth: &Truth, rays: u32, head: &Head) -> crate::export::text::Canvas {
    let reference = &truth.reference.image;
    let [w, h] = reference.size.map(f64::from);
    let at = |v: f64| v.floor().max(0.0) as u32;
    let crop =
        Rect { x: at(CROP[0] * w), y: at(CROP[1] * h), width: at(CROP[2] * w).max(1), height: at(CROP[3] * h).max(1) };
    let crop = crop.within(reference.size);
    let look = || Look::Tone(ToneMap::srgb(auto_exposure(reference)));
    let of_way = |(i, r): (usize, &Row)| Column {
        title: r.way.title().into(),
        lines: vec![format!("error {}", percent(r.error.map(|e| e.relative_rmse))), format!("{:.2} s", r.image_s)],
        color: PALETTE[i],
        image: images[i].clone(),
        look: look(),
        error: Some(signed_error(&images[i].crop(crop), &reference.crop(crop))),
    };
    let mut columns: Vec<Column> = rows.iter().enumerate().map(of_way).collect();
    let facts = truth.facts();
    columns.push(Column {
        title: "reference".into(),
        lines: vec![format!("noise {}", percent(facts.relative_noise)), "path tracer".into()],
        color: PALETTE[7],
        image: reference.clone(),
        look: look(),
        error: None,
    });
    let sheet = Sheet {
        title: format!("The room by {rays} gather rays from each view hit, without and with ray differentials"),
        subtitle: head.subtitle(),
        columns,
        crop,
        enlarge: (ACROSS / crop.width.max(1)).max(1),
    };
    sheet::draw_against(&sheet, "the reference")
}
