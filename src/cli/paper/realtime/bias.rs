//! `realtime-bias`: surface, boundary and distance bias of each search and each area, measured apart.

use super::{origin, parameters, stopped};
use crate::cli::failure::Failure;
use crate::cli::paper::PaperFlags;
use crate::cli::paper::bars::{self, Bar, Chart, Segment};
use crate::cli::paper::output::{Done, Origin};
use crate::cli::progress::{bar, interrupted};
use crate::cli::table::Table;
use crate::export::plot::INKS;
use crate::measure::Reference;
use crate::measure::realtime::bias::{BiasReport, Region, VARIANTS, bias, probes};
use crate::scene::open;
use serde::Serialize;
use std::fmt::Write;
use std::path::Path;
use std::sync::Arc;

/// Radius of a search, metres.
const RADIUS: f32 = 0.2;
/// Maps that are averaged.
const MAPS: u32 = 32;
/// Every so many pixels of the reference a place.
const STEP: usize = 4;
/// Photons emitted for each map.
const EMITTED: [u32; 2] = [8000, 80_000];

/// What is demanded of the slice and of the hull.
#[derive(Serialize)]
struct Verdict {
    photons: usize,
    surface_bias_of_sphere: f64,
    surface_bias_of_slice: f64,
    surface_bias_removed: f64,
    time_of_slice_over_sphere: [f64; 3],
    boundary_rms_of_disc: f64,
    boundary_rms_of_hull: f64,
    boundary_bias_left_by_hull: f64,
}

#[derive(Serialize)]
struct Report<'a> {
    #[serde(flatten)]
    origin: &'a Origin,
    radius_m: f32,
    reports: &'a [BiasReport],
    verdicts: &'a [Verdict],
}

/// Measures and makes the table.
///
/// # Errors
/// A wrong flag, a file that cannot be written, or an interruption.
pub fn run(item: &'static str, flags: &PaperFlags, folder: &Path) -> Result<Done, Failure> {
    let scene = Arc::new(open("cornell")?);
    let reference = Reference::built_in("cornell").map_err(Failure::Work)?.ok_or_else(|| stopped(item))?;
    // A look at other numbers of photons is quicker.
    let (maps, step) = if flags.photons.is_some() { (10, 6) } else { (MAPS, STEP) };
    let progress = bar(u64::from(maps) * 2, item, flags.quiet || flags.json);
    let places = probes(&scene, &reference, RADIUS, step);
    let mut reports = Vec::new();
    for emitted in EMITTED {
        let emitted = flags.photons.map_or(emitted, |p| p.clamp(100, 10_000_000) as u32);
        let texts = [
            format!("photons_from_light={}", emitted.div_ceil(4)),
            format!("max_search_radius={RADIUS}"),
            "accumulation_frames=4".to_owned(),
            "scattering=roulette".to_owned(),
            "recursion_depth=20".to_owned(),
        ];
        let settings = parameters(&scene, flags, &texts.each_ref().map(String::as_str))?;
        let found = bias(&scene, &settings, &places, maps, flags.repeats(), || {
            progress.inc(1);
            !interrupted()
        });
        reports.push(found.ok_or_else(|| stopped(item))?);
    }
    progress.finish_and_clear();
    let verdicts: Vec<Verdict> = reports.iter().map(verdict).collect();
    let origin = origin(item, "Kristensen and Ottosen 2003, sections 3.5.1 and 3.5.2", &scene, flags, [256, 256])?;
    let text = text(&reports, &verdicts, maps);
    let picture = bars::draw(&chart(&reports[0], &origin), 1100);
    let report = Report { origin: &origin, radius_m: RADIUS, reports: &reports, verdicts: &verdicts };
    origin.write(folder, &picture, &csv(&reports), &report, &text)
}

fn verdict(r: &BiasReport) -> Verdict {
    let at = |v: &str| r.parts(v, Region::Corner);
    let (sphere, slice, hull) = (at("sphere"), at("sphere slice"), at("slice, hull"));
    let share = |a: f64, b: f64| if b != 0.0 { a / b } else { 0.0 };
    Verdict {
        photons: r.photons,
        surface_bias_of_sphere: sphere.surface,
        surface_bias_of_slice: slice.surface,
        surface_bias_removed: 1.0 - share(slice.surface, sphere.surface),
        time_of_slice_over_sphere: r.time("sphere slice").map_or([0.0; 3], |t| t.ratio),
        boundary_rms_of_disc: slice.boundary_rms,
        boundary_rms_of_hull: hull.boundary_rms,
        boundary_bias_left_by_hull: share(hull.boundary_rms, slice.boundary_rms),
    }
}

fn text(reports: &[BiasReport], verdicts: &[Verdict], maps: u32) -> String {
    let mut out = String::new();
    for (r, v) in reports.iter().zip(verdicts) {
        let mut table = Table::new([
            "search and area",
            "region",
            "places",
            "total",
            "surface",
            "boundary",
            "count",
            "distance",
            "boundary rms",
            "total rms",
        ]);
        for row in &r.rows {
            let p = row.parts;
            let cell = |x: f64| format!("{:.1} %", 100.0 * x);
            table.row([
                row.variant.to_owned(),
                row.region.name().to_owned(),
                row.places.to_string(),
                cell(p.total),
                cell(p.surface),
                cell(p.boundary),
                cell(p.count),
                cell(p.distance),
                cell(p.boundary_rms),
                cell(p.total_rms),
            ]);
        }
        let mut times = Table::new(["search and area", "µs an estimate", "x sphere", "least to most"]);
        for t in &r.times {
            let [least, middle, most] = t.ratio;
            times.row([
                t.variant.to_owned(),
                format!("{:.2}", t.microseconds),
                format!("{middle:.2}"),
                format!("{least:.2} to {most:.2}"),
            ]);
        }
        let [least, middle, most] = v.time_of_slice_over_sphere;
        // Writing to a string cannot fail.
        let _ = write!(
            out,
            "{} photons in each of {maps} maps, searches of 50 photons within {RADIUS} m; bias over the region's mean irradiance\n{}\n{}\nin corners the slice removes {:.1} % of the surface bias (wanted: 90) and takes {:.2} ({:.2} to {:.2}) of the sphere's time (wanted: below 1.05)\nin corners the hull leaves {:.0} % of the boundary bias of the disc (wanted: at most 50)\n\n",
            r.photons,
            table.text(),
            times.text(),
            100.0 * v.surface_bias_removed,
            middle,
            least,
            most,
            100.0 * v.boundary_bias_left_by_hull
        );
    }
    out
}

fn csv(reports: &[BiasReport]) -> String {
    let mut out =
        String::from("photons,variant,region,places,total,surface,boundary,count,distance,boundary_rms,total_rms\n");
    for r in reports {
        for row in &r.rows {
            let p = row.parts;
            let _ = writeln!(
                out,
                "{},\"{}\",{},{},{:.6},{:.6},{:.6},{:.6},{:.6},{:.6},{:.6}",
                r.photons,
                row.variant,
                row.region.name(),
                row.places,
                p.total,
                p.surface,
                p.boundary,
                p.count,
                p.distance,
                p.boundary_rms,
                p.total_rms
            );
        }
    }
    out
}

/// Bars of the parts without their signs, region by region.
fn chart(r: &BiasReport, origin: &Origin) -> Chart {
    let mut rows = Vec::new();
    for region in Region::ALL {
        rows.push(Bar { label: region.name().into(), segments: Vec::new(), number: String::new() });
        for v in VARIANTS {
            let p = r.parts(v.name, region);
            let parts = [p.surface, p.boundary, p.count, p.distance];
            rows.push(Bar {
                label: format!("  {}", v.name),
                segments: parts.iter().zip(INKS).map(|(x, color)| Segment { value: x.abs(), color }).collect(),
                number: format!("total {:+.1} %", 100.0 * p.total),
            });
        }
    }
    Chart {
        title: format!("Bias of the irradiance estimate on cornell, {} photons in the map", r.photons),
        subtitle: origin.subtitle(),
        legend: ["surface", "boundary", "count", "distance"]
            .iter()
            .zip(INKS)
            .map(|(n, c)| ((*n).to_owned(), c))
            .collect(),
        bars: rows,
        note: "lengths without their signs: parts of opposite signs cancel in the total".into(),
    }
}
