//! `gather-figure-2`: photons, the ones that are kept, and the first two layers, on a piece of the back wall.

use crate::cli::failure::Failure;
use crate::cli::paper::PaperFlags;
use crate::cli::paper::gathering::drawing::Window;
use crate::cli::paper::gathering::figure_1::emitted;
use crate::cli::paper::gathering::output::{Head, NO_IMAGE, counts};
use crate::cli::paper::gathering::room::{settings, two_lights};
use crate::cli::paper::output::Done;
use crate::cli::progress::interrupted;
use crate::cli::table::Table;
use crate::export::text::{Canvas, Face};
use crate::photons::PhotonKind;
use crate::photons::irradiance::pyramid::{ESTIMATE_SPACING, PHOTON_SPACING};
use crate::photons::irradiance::surface_area::SurfaceAreas;
use crate::photons::irradiance::{GlobalPhotons, IrradiancePyramid, Layer, PyramidSettings};
use crate::render::stats::StoredCounts;
use crate::scene::Scene;
use glam::{DVec3, Vec2, Vec3};
use serde::Serialize;
use std::fmt::Write;
use std::path::Path;

const SOURCE: &str = "Gjøl, Larsen and Christensen, figure 2";
/// Photons emitted by default.
const PHOTONS: i64 = 100_000;
/// Radius of the first layer, metres.
const RADIUS: f32 = 0.08;
/// Ratio of radii.
const GROWTH: f32 = 2.0;
/// Middle of the piece of wall, in the scene file's coordinates, metres.
const PLACE: DVec3 = DVec3::new(0.9, 1.6, -2.0);
/// Half of what is shown of it, metres.
const HALF: f32 = 0.32;

/// What lies on the piece of wall.
#[derive(Debug, Serialize)]
struct Row {
    what: &'static str,
    /// On the piece.
    shown: usize,
    /// In the whole room.
    all: usize,
    /// Radius of its discs, metres; 0 for photons.
    radius_m: f32,
    /// Discs over a place of the piece, the mean.
    overlap: f64,
    /// Least distance between two of a related surface in the room over what they keep, at least 1.
    spacing: Option<f32>,
    /// That distance, metres.
    spacing_m: f32,
}

#[derive(Serialize)]
struct Report<'a> {
    #[serde(flatten)]
    head: &'a Head,
    photons_stored: StoredCounts,
    rows: &'a [Row],
}

/// Places on the piece of wall, in its plane.
fn on_piece(scene: &Scene, all: impl Iterator<Item = (Vec3, Vec3)>) -> Vec<Vec2> {
    let middle = (PLACE - scene.origin).as_vec3();
    all.filter(|(p, n)| n.z > 0.9 && (p.z - middle.z).abs() < 1e-3)
        // Down is positive.
        .map(|(p, _)| Vec2::new(p.x - middle.x, middle.y - p.y))
        .collect()
}

fn shown(places: &[Vec2]) -> usize {
    places.iter().filter(|p| p.abs().max_element() <= HALF).count()
}

/// Least distance between a layer's estimates on related surfaces.
fn least_distance(layer: &Layer) -> Option<f32> {
    let all = layer.estimates();
    let nearest = |e: &crate::photons::irradiance::IrradianceEstimate| {
        let other = |o: &crate::photons::irradiance::IrradianceEstimate| {
            o.position != e.position && crate::photons::irradiance::agree(o.normal, e.normal)
        };
        layer.nearest(e.position, other).map(|i| all[i as usize].position.distance(e.position))
    };
    all.iter().filter_map(nearest).min_by(f32::total_cmp)
}

/// Makes the figure.
///
/// # Errors
/// A wrong flag, a file that cannot be written, or an interruption.
pub fn run(item: &'static str, flags: &PaperFlags, folder: &Path) -> Result<Done, Failure> {
    let scene = two_lights()?;
    let settings = settings(&scene, flags, flags.photons.unwrap_or(PHOTONS), NO_IMAGE)?;
    let stored = emitted(&scene, &settings);
    if interrupted() {
        return Err(Failure::Interrupted(format!("nothing of {item} was written")));
    }
    let photons = GlobalPhotons::new(&stored, &PhotonKind::ALL);
    let wanted = PyramidSettings { radius: RADIUS, growth: GROWTH, as_published: true, layers: 2 };
    let mut pyramid = IrradiancePyramid::new(&SurfaceAreas::new(&scene), &photons, &wanted);
    pyramid.grow(&scene, &wanted);
    let of_layer = |l: &Layer| on_piece(&scene, l.estimates().iter().map(|e| (e.position, e.normal)));
    let own = on_piece(&scene, photons.photons().iter().map(|p| (p.position, p.normal)));
    let layers: Vec<Vec<Vec2>> = pyramid.layers().iter().map(of_layer).collect();
    let area = f64::from(4.0 * HALF * HALF);
    let photon_row = Row {
        what: "photons",
        shown: shown(&own),
        all: photons.photons().len(),
        radius_m: 0.0,
        overlap: 0.0,
        spacing: None,
        spacing_m: 0.0,
    };
    let layer_row = |(i, (layer, places)): (usize, (&Layer, &Vec<Vec2>))| {
        let keep = if i == 0 { PHOTON_SPACING * RADIUS } else { ESTIMATE_SPACING * RADIUS };
        let disc = std::f64::consts::PI * f64::from(layer.radius()).powi(2);
        Row {
            what: if i == 0 { "kept photons, first layer" } else { "kept estimates, second layer" },
            shown: shown(places),
            all: layer.estimates().len(),
            radius_m: layer.radius(),
            overlap: shown(places) as f64 * disc / area,
            spacing: least_distance(layer).map(|d| d / keep),
            spacing_m: keep,
        }
    };
    let rows: Vec<Row> =
        std::iter::once(photon_row).chain(pyramid.layers().iter().zip(&layers).enumerate().map(layer_row)).collect();
    let head = Head::new(item, SOURCE, &scene, &settings);
    let picture = draw(&own, &layers, &rows, &head);
    let mut table = Table::new([
        "on the piece of wall",
        "shown",
        "in the room",
        "radius m",
        "discs over a place",
        "least distance",
    ]);
    let mut csv = String::from("what,shown,all,radius_m,overlap,least_distance_over_spacing,spacing_m\n");
    for r in &rows {
        let least = r.spacing.map_or("-".into(), |s| format!("{s:.3} x {:.3} m", r.spacing_m));
        let (shown, all) = (r.shown.to_string(), r.all.to_string());
        table.row([r.what.into(), shown, all, format!("{}", r.radius_m), format!("{:.1}", r.overlap), least]);
        let spacing = r.spacing.map_or(String::new(), |s| format!("{s:.6}"));
        // Writing to a string cannot fail.
        let _ = writeln!(
            csv,
            "\"{}\",{},{},{},{:.4},{spacing},{}",
            r.what, r.shown, r.all, r.radius_m, r.overlap, r.spacing_m
        );
    }
    let side = 2.0 * HALF;
    let text =
        format!("{}\na piece of the back wall, {side}x{side} m, {} photons emitted\n", table.text(), settings.photons);
    let report = Report { head: &head, photons_stored: counts(&stored), rows: &rows };
    head.write(folder, &picture, &csv, &report, &text)
}

const GROUND: [u8; 3] = [64; 3];
const INK: [u8; 3] = [235; 3];
const FAINT: [u8; 3] = [175; 3];
const WALL: [u8; 3] = [225; 3];
const PHOTON: [u8; 3] = [120; 3];
const KEPT: [u8; 3] = [213, 94, 0];
const SECOND: [u8; 3] = [0, 90, 160];
const SIDE: u32 = 440;
const GAP: u32 = 14;
const ABOVE: u32 = 92;

fn draw(photons: &[Vec2], layers: &[Vec<Vec2>], rows: &[Row], head: &Head) -> Canvas {
    let mut canvas = Canvas::new([3 * SIDE + 4 * GAP, ABOVE + SIDE + 62], GROUND);
    let width = canvas.size[0] - 2 * GAP;
    canvas.text(GAP, 8, width, 26.0, INK, Face::Proportional, "Photons, and the first two layers made of them");
    canvas.text(GAP, 40, width, 15.0, FAINT, Face::Proportional, &head.subtitle());
    let none = Vec::new();
    let (first, second) = (layers.first().unwrap_or(&none), layers.get(1).unwrap_or(&none));
    let number = |i: usize, f: fn(&Row) -> String| rows.get(i).map_or(String::new(), f);
    let panels = [
        (
            "Photons, and the ones that are kept",
            format!(
                "{} photons, {} kept (orange)",
                number(0, |r| r.shown.to_string()),
                number(1, |r| r.shown.to_string())
            ),
            format!("circles: r/4 = {} m, where others are marked", PHOTON_SPACING * RADIUS),
        ),
        (
            "First layer, and the estimates that are kept",
            format!("discs of {RADIUS} m, {} over each place", number(1, |r| format!("{:.1}", r.overlap))),
            format!("thick: 3r/4 = {} m about those kept (blue)", ESTIMATE_SPACING * RADIUS),
        ),
        (
            "Second layer",
            format!("discs of {} m, {} over each place", RADIUS * GROWTH, number(2, |r| format!("{:.1}", r.overlap))),
            format!("{} estimates on the piece", number(2, |r| r.shown.to_string())),
        ),
    ];
    for (i, (title, line, more)) in panels.into_iter().enumerate() {
        let x = GAP + i as u32 * (SIDE + GAP);
        canvas.text(x, 66, SIDE, 18.0, INK, Face::Proportional, title);
        let mut window = Window::new(&mut canvas, [x, ABOVE], SIDE, Vec2::ZERO, HALF);
        window.paint(|_| Some((WALL, 1.0)));
        match i {
            0 => {
                photons.iter().for_each(|p| window.dot(*p, 1.7, PHOTON));
                for p in first {
                    window.circle(*p, PHOTON_SPACING * RADIUS, 1.0, KEPT, 0.8);
                    window.dot(*p, 2.4, KEPT);
                }
            }
            1 => {
                for p in first {
                    window.circle(*p, RADIUS, 1.0, KEPT, 0.2);
                    window.dot(*p, 2.0, KEPT);
                }
                for p in second {
                    window.circle(*p, ESTIMATE_SPACING * RADIUS, 2.0, SECOND, 0.9);
                    window.dot(*p, 4.0, SECOND);
                }
            }
            _ => {
                for p in second {
                    window.disc(*p, RADIUS * GROWTH, SECOND, 0.02);
                    window.circle(*p, RADIUS * GROWTH, 1.5, SECOND, 0.6);
                    window.dot(*p, 4.0, SECOND);
                }
            }
        }
        canvas.text(x, ABOVE + SIDE + 8, SIDE, 17.0, INK, Face::Proportional, &line);
        canvas.text(x, ABOVE + SIDE + 32, SIDE, 16.0, FAINT, Face::Proportional, &more);
    }
    canvas
}
