//! `cusp inspect`: why a pixel has its value.

use crate::cli::failure::Failure;
use crate::cli::flags::{CommonFlags, pixel};
use crate::cli::inspect_report::InspectionReport;
use crate::cli::inspect_text::text;
use crate::cli::progress::{interrupted, listen_for_interrupts};
use crate::cli::{print, to_json};
use crate::estimate::Estimator;
use crate::estimate::registry::{self, ESTIMATORS};
use crate::photons::PhotonKind;
use crate::render::inspect::{InspectError, Inspection, PhotonRow, inspect};
use crate::render::pass::Pass;
use crate::render::settings::RenderSettings;
use crate::scene::open;
use clap::Args;
use std::sync::Arc;

/// Flags of `inspect`.
#[derive(Debug, Args)]
pub struct InspectArgs {
    /// A built-in name, a .toml, an .obj or a Quake 3 map (.bsp, .pk3:NAME)
    scene: String,
    /// Column and row of the pixel, from 0; row 0 is the top
    #[arg(long, value_name = "X,Y", value_parser = pixel, allow_hyphen_values = true)]
    pixel: [u32; 2],
    /// Estimators, separated by commas; all with their defaults if left out
    #[arg(long, value_name = "A,B")]
    estimators: Option<String>,
    /// Pass to look at, from 1; later ones have smaller footprints and jittered rays
    #[arg(long, value_name = "P", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..))]
    pass: u32,
    /// Estimator whose weights order the table; the first if left out
    #[arg(long, value_name = "E")]
    sort: Option<String>,
    /// Photons in the table; 0 for all
    #[arg(long, value_name = "N", default_value_t = 20)]
    rows: usize,
    #[command(flatten)]
    flags: CommonFlags,
}

/// Inspects.
///
/// # Errors
/// A wrong call, or an interruption.
pub fn run(args: &InspectArgs) -> Result<(), Failure> {
    listen_for_interrupts();
    args.flags.on_threads(|| {
        let scene = open(&args.scene)?;
        // Here `--estimator` may be a list, like `--estimators`.
        let settings = CommonFlags { estimator: None, ..args.flags.clone() }.settings(&scene)?;
        let estimators = settings.with_final_gathering(&chosen(args, &settings)?)?;
        let sort = sort_by(args.sort.as_deref(), &estimators)?;
        // Before any photon is traced.
        let size = settings.size;
        if args.pixel[0] >= size[0] || args.pixel[1] >= size[1] {
            return Err(wrong(&InspectError::Outside { pixel: args.pixel, size }));
        }
        let pass = Pass::alone(Arc::new(scene), settings, &estimators, args.pass - 1, &interrupted)?
            .ok_or_else(|| Failure::Interrupted("nothing was found out".into()))?;
        let mut found = inspect(&pass, &estimators, args.pixel).map_err(|e| wrong(&e))?;
        sort_rows(&mut found, sort);
        if args.flags.json {
            print(&to_json(&InspectionReport::new(&pass, &found, warnings(&pass)))?)
        } else if args.flags.quiet {
            Ok(())
        } else {
            for warning in warnings(&pass) {
                eprintln!("warning: {warning}");
            }
            print(&text(&pass, &found, sort, args.rows))
        }
    })
}

/// What was defined but odd.
fn warnings(pass: &Pass) -> Vec<String> {
    let mut all = pass.scene.warnings.clone();
    let photons = &pass.photons;
    if pass.plan.needs_photons() && PhotonKind::ALL.iter().all(|kind| photons.stored.of(*kind).is_empty()) {
        all.push(format!("none of {} photons was stored", photons.emitted));
    }
    all
}

fn wrong(error: &InspectError) -> Failure {
    Failure::Call(format!("--pixel: {error}"))
}

fn chosen(args: &InspectArgs, settings: &RenderSettings) -> Result<Vec<Box<dyn Estimator>>, Failure> {
    match (&args.estimators, &args.flags.estimator) {
        (Some(_), Some(_)) => Err(Failure::Call("--estimator: is in --estimators already; give one of them".into())),
        (Some(list), None) | (None, Some(list)) => Ok(registry::estimators(list)?),
        (None, None) if settings.final_gather != "none" => Ok(vec![registry::estimator(&settings.estimator)?]),
        (None, None) => Ok(ESTIMATORS.iter().filter_map(|e| e.default_estimator()).collect()),
    }
}

/// Index of the estimator that `--sort` names, by id or with its settings.
fn sort_by(name: Option<&str>, estimators: &[Box<dyn Estimator>]) -> Result<usize, Failure> {
    let Some(name) = name else { return Ok(0) };
    let of = |full: bool| estimators.iter().position(|e| if full { e.name() == name } else { e.id() == name });
    of(true).or_else(|| of(false)).ok_or_else(|| {
        let names: Vec<_> = estimators.iter().map(|e| e.name()).collect();
        Failure::Call(format!("--sort: `{name}` is not among the estimators {}", names.join(", ")))
    })
}

/// By falling weight under one estimator; those without a weight there by their weight under the others.
fn sort_rows(found: &mut Inspection, sort: usize) {
    let key = |row: &PhotonRow| {
        let largest = row.weights.iter().fold(0.0, |m: f64, w| m.max(*w));
        (row.weights.get(sort).copied().unwrap_or(0.0), largest)
    };
    found.rows.sort_by(|a, b| {
        let ((a, a_rest), (b, b_rest)) = (key(a), key(b));
        b.total_cmp(&a).then(b_rest.total_cmp(&a_rest))
    });
}
