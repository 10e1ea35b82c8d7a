//! `realtime-parameters`: what each parameter costs.

use super::{origin, parameters, rooms, run_settings, stopped};
use crate::cli::failure::Failure;
use crate::cli::paper::PaperFlags;
use crate::cli::paper::bars::{self, Bar, Chart, Segment};
use crate::cli::paper::output::{Done, Origin};
use crate::cli::progress::{bar, interrupted};
use crate::cli::realtime::SIZE;
use crate::cli::table::Table;
use crate::export::plot::INKS;
use crate::measure::realtime::tables::{ParameterCost, parameter_costs};
use crate::realtime::RealtimeSettings;
use crate::realtime::settings::PARAMETERS;
use serde::Serialize;
use std::fmt::Write;
use std::path::Path;

/// Frames of each run.
const FRAMES: u64 = 30;

/// One change of each parameter, in the order of chapter 6, then ours.
const CHANGES: [&str; 38] = [
    "acceleration=false",
    "mesh_refinement=3000",
    "mesh_refinement=48000",
    "estimate_cache=false",
    "max_search_count=20",
    "max_search_count=200",
    "max_search_radius=0.4",
    "max_search_radius=1.6",
    "radius_heuristic=true",
    "sphere_slice=false",
    "final_gathering=true",
    "photons_from_light=250",
    "photons_from_light=4000",
    "accumulation_frames=5",
    "accumulation_frames=20",
    "store_direct_light=false",
    "recursion_depth=0",
    "recursion_depth=2",
    "diffuse_reflections=1",
    "diffuse_reflections=16",
    "snowball_size=4",
    "light_distribution=rejection",
    "light_distribution=saff_kuijlaars",
    "diffuse_distribution=rejection",
    "diffuse_distribution=stratified",
    "scattering=roulette",
    "coherent=false",
    "search=cylinder",
    "search=ellipsoid",
    "incoming_direction=false",
    "area=hull",
    "area=circle",
    "area=ellipse",
    "partition=normal",
    "stop_recursion_size=1",
    "moving=rebuild",
    "blending=offset",
    "cull_back_faces=true",
];

#[derive(Serialize)]
struct Report<'a> {
    #[serde(flatten)]
    origin: &'a Origin,
    repeats: u32,
    plain: &'a RealtimeSettings,
    rows: &'a [ParameterCost],
}

/// Measures and makes the table.
///
/// # Errors
/// A wrong flag, a file that cannot be written, or an interruption.
pub fn run(item: &'static str, flags: &PaperFlags, folder: &Path) -> Result<Done, Failure> {
    let scene = rooms()?;
    let repeats = flags.repeats.unwrap_or(3);
    let plain = parameters(&scene, flags, &[])?;
    let mut changed = Vec::new();
    for text in CHANGES {
        changed.push((text.to_owned(), parameters(&scene, flags, &[text])?));
    }
    let progress = bar((changed.len() as u64 + 1) * FRAMES * u64::from(repeats), item, flags.quiet || flags.json);
    let going_on = || {
        progress.inc(1);
        !interrupted()
    };
    let how = run_settings(flags, FRAMES, 0.0);
    let rows = parameter_costs(&scene, &plain, &changed, &how, repeats, going_on).ok_or_else(|| stopped(item))?;
    progress.finish_and_clear();
    let origin = origin(item, "Kristensen and Ottosen 2003, section 6.1", &scene, flags, SIZE)?;
    let number = |set: &str| {
        let name = set.split('=').next().unwrap_or("");
        PARAMETERS.iter().find(|p| p.name == name).and_then(|p| p.number).map_or(String::new(), |n| n.to_string())
    };
    let mut table = Table::new(["changed", "number", "frame time", "least to most", "fluctuation", "photons in map"]);
    let mut csv = String::from("changed,number,ratio,least,most,fluctuation,photons_in_map\n");
    let mut chart = Vec::new();
    for r in &rows {
        let [least, middle, most] = r.ratio;
        table.row([
            r.set.clone(),
            number(&r.set),
            format!("x {middle:.2}"),
            format!("{least:.2} to {most:.2}"),
            format!("{:.2} %", 100.0 * r.fluctuation),
            r.photons_in_map.to_string(),
        ]);
        // Writing to a string cannot fail.
        let _ = writeln!(
            csv,
            "{},{},{middle:.4},{least:.4},{most:.4},{:.6},{}",
            r.set,
            number(&r.set),
            r.fluctuation,
            r.photons_in_map
        );
        // What is far slower than all else would make the rest too short to see.
        let cut = middle.min(6.0);
        chart.push(Bar {
            label: r.set.clone(),
            segments: vec![Segment { value: cut, color: INKS[usize::from(middle > 1.0)] }],
            number: format!("x {middle:.2}"),
        });
    }
    let text = format!(
        "{}\none parameter of rooms changed at a time, {FRAMES} frames, over the unchanged run of the same repeat; {repeats} repeats, {} threads\n",
        table.text(),
        origin.threads
    );
    let picture = bars::draw(
        &Chart {
            title: "What each parameter costs: frame time over that of rooms as it is".into(),
            subtitle: origin.subtitle(),
            legend: Vec::new(),
            bars: chart,
            note: "bars end at 6; the box and the light move, the camera stands still".into(),
        },
        1000,
    );
    let report = Report { origin: &origin, repeats, plain: &plain, rows: &rows };
    origin.write(folder, &picture, &csv, &report, &text)
}
