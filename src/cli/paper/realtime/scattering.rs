//! `realtime-scattering`: how even each distribution of directions is, and splitting against Russian roulette.

use super::panels::{picture, reference};
use super::{origin, parameters, stopped};
use crate::cli::failure::Failure;
use crate::cli::paper::PaperFlags;
use crate::cli::paper::output::{Done, Origin};
use crate::cli::progress::{bar, interrupted};
use crate::cli::table::{Table, percent};
use crate::export::plot::{Axes, Plot, Series, draw, ink};
use crate::realtime::distribution::Distribution;
use crate::realtime::distribution::discrepancy::{ChiSquare, cap_discrepancy, chi_square, star_discrepancy};
use crate::scene::open;
use serde::Serialize;
use std::fmt::Write;
use std::path::Path;
use std::sync::Arc;

/// Numbers of directions.
const COUNTS: [usize; 5] = [100, 316, 1000, 3162, 10_000];
/// Axes of the caps.
const AXES: usize = 300;
/// Seeds that are averaged.
const SEEDS: u64 = 4;

#[derive(Serialize)]
struct Evenness {
    distribution: &'static str,
    count: usize,
    chi_square: ChiSquare,
    star_discrepancy: f64,
    cap_discrepancy: f64,
}

#[derive(Serialize)]
struct Scattered {
    scattering: String,
    light_distribution: &'static str,
    photon_rays: u64,
    photons: u64,
    relative_rmse: Option<f64>,
    mean_ratio: Option<f64>,
}

#[derive(Serialize)]
struct Report<'a> {
    #[serde(flatten)]
    origin: &'a Origin,
    evenness: &'a [Evenness],
    scattering: &'a [Scattered],
}

/// Measures and makes the table.
///
/// # Errors
/// A wrong flag, a file that cannot be written, or an interruption.
pub fn run(item: &'static str, flags: &PaperFlags, folder: &Path) -> Result<Done, Failure> {
    let progress = bar((Distribution::ALL.len() * (COUNTS.len() + 2)) as u64, item, flags.quiet || flags.json);
    let mut evenness = Vec::new();
    for kind in Distribution::ALL {
        for count in COUNTS {
            if interrupted() {
                return Err(stopped(item));
            }
            evenness.push(even(kind, count));
            progress.inc(1);
        }
    }
    let scene = Arc::new(open("cornell")?);
    let size = flags.size.unwrap_or([128, 128]);
    let against = reference("cornell", size);
    let mut scattering = Vec::new();
    for kind in Distribution::ALL {
        // About as many rays either way, and as many reflections: 12 by splitting 3 and 9, or two by roulette.
        for (name, own) in [
            (
                "splitting",
                ["photons_from_light=400", "diffuse_reflections=3", "recursion_depth=2", "scattering=splitting"],
            ),
            (
                "roulette",
                ["photons_from_light=2400", "diffuse_reflections=1", "recursion_depth=2", "scattering=roulette"],
            ),
        ] {
            let (light, diffuse) =
                (format!("light_distribution={}", kind.name()), format!("diffuse_distribution={}", kind.name()));
            let common = [
                "mesh_refinement=10000",
                "max_search_count=80",
                "max_search_radius=0.2",
                "area=hull",
                &light,
                &diffuse,
            ];
            let settings = parameters(&scene, flags, &[&common[..], &own].concat())?;
            let (image, last, _) = picture(&scene, settings, &scene.camera, size, 1.0);
            let error = against.as_ref().and_then(|a| a.error(&image));
            scattering.push(Scattered {
                scattering: name.into(),
                light_distribution: kind.name(),
                photon_rays: last.photon_rays,
                photons: last.photons_in_map,
                relative_rmse: error.map(|e| e.0),
                mean_ratio: error.map(|e| e.1),
            });
            progress.inc(1);
        }
    }
    progress.finish_and_clear();
    let origin = origin(item, "Kristensen and Ottosen 2003, sections 3.4 and 7.4", &scene, flags, size)?;
    let picture = draw(&plot(&evenness, &origin)).map_err(Failure::Work)?;
    let text = text(&evenness, &scattering);
    let report = Report { origin: &origin, evenness: &evenness, scattering: &scattering };
    origin.write(folder, &picture, &csv(&evenness), &report, &text)
}

/// The mean over some seeds; χ² of the first.
fn even(kind: Distribution, count: usize) -> Evenness {
    let sets: Vec<Vec<[f32; 2]>> = (1..=SEEDS).map(|seed| kind.set(count, seed)).collect();
    let mean = |f: &dyn Fn(&[[f32; 2]]) -> f64| sets.iter().map(|s| f(s)).sum::<f64>() / SEEDS as f64;
    Evenness {
        distribution: kind.name(),
        count,
        chi_square: chi_square(&sets[0], 8, 12),
        star_discrepancy: mean(&|s| star_discrepancy(s)),
        cap_discrepancy: mean(&|s| cap_discrepancy(s, AXES)),
    }
}

fn text(evenness: &[Evenness], scattering: &[Scattered]) -> String {
    let mut table =
        Table::new(["distribution", "directions", "chi² of 95", "deviations", "star discrepancy", "cap discrepancy"]);
    for e in evenness {
        table.row([
            e.distribution.to_owned(),
            e.count.to_string(),
            format!("{:.1}", e.chi_square.statistic),
            format!("{:+.1}", e.chi_square.deviations),
            format!("{:.5}", e.star_discrepancy),
            format!("{:.5}", e.cap_discrepancy),
        ]);
    }
    let mut rays = Table::new(["directions", "scattering", "photon rays a frame", "photons", "error", "mean"]);
    for s in scattering {
        rays.row([
            s.light_distribution.to_owned(),
            s.scattering.clone(),
            s.photon_rays.to_string(),
            s.photons.to_string(),
            percent(s.relative_rmse),
            s.mean_ratio.map_or("-".into(), |m| format!("{m:.3}")),
        ]);
    }
    format!(
        "{}\nchi²: 8 x 12 cells of equal area, deviations from what random directions have; discrepancies: the mean of {SEEDS} seeds\n\n{}\ncornell with two reflections, so without the light of more; relative RMSE of 8×8 means\n",
        table.text(),
        rays.text()
    )
}

fn csv(evenness: &[Evenness]) -> String {
    let mut out = String::from("distribution,directions,chi_square,deviations,star_discrepancy,cap_discrepancy\n");
    for e in evenness {
        // Writing to a string cannot fail.
        let _ = writeln!(
            out,
            "{},{},{:.4},{:.4},{:.6},{:.6}",
            e.distribution,
            e.count,
            e.chi_square.statistic,
            e.chi_square.deviations,
            e.star_discrepancy,
            e.cap_discrepancy
        );
    }
    out
}

fn plot(evenness: &[Evenness], origin: &Origin) -> Plot {
    let axes = |title: &str, f: fn(&Evenness) -> f64| Axes {
        title: title.into(),
        x: "directions".into(),
        y: title.into(),
        series: Distribution::ALL
            .iter()
            .enumerate()
            .map(|(i, kind)| Series {
                name: kind.name().into(),
                color: ink(i),
                line: evenness
                    .iter()
                    .filter(|e| e.distribution == kind.name())
                    .map(|e| (e.count as f64, f(e)))
                    .collect(),
                marks: true,
                ..Series::default()
            })
            .collect(),
        levels: Vec::new(),
    };
    Plot {
        title: "How even directions are".into(),
        subtitle: origin.subtitle(),
        axes: vec![axes("cap discrepancy", |e| e.cap_discrepancy), axes("star discrepancy", |e| e.star_discrepancy)],
    }
}
