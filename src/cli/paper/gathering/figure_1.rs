//! `gather-figure-1`: an estimate whose disc sticks out over the edge of a box, by photons, and by the mean of first-layer
//! estimates that lie wholly inside.

use crate::cli::failure::Failure;
use crate::cli::paper::PaperFlags;
use crate::cli::paper::gathering::drawing::Window;
use crate::cli::paper::gathering::output::{Head, NO_IMAGE, counts};
use crate::cli::paper::gathering::room::settings;
use crate::cli::paper::gathering::table_top::{TableTop, TopTruth};
use crate::cli::paper::output::Done;
use crate::cli::progress::interrupted;
use crate::cli::table::Table;
use crate::export::text::{Canvas, Face};
use crate::math::rgb::mean;
use crate::photons::irradiance::layer::{Estimates, WeightedMean};
use crate::photons::irradiance::pyramid::PHOTON_SPACING;
use crate::photons::irradiance::surface_area::SurfaceAreas;
use crate::photons::irradiance::{GlobalPhotons, IrradianceEstimate, Layer, agree};
use crate::photons::path::PathSettings;
use crate::photons::{PhotonKind, StoredPhotons};
use crate::render::photon_pass::Emitter;
use crate::render::settings::RenderSettings;
use crate::render::stats::StoredCounts;
use crate::scene::Scene;
use crate::trace::Intersector;
use glam::{DVec3, Vec2, Vec3};
use serde::Serialize;
use std::f64::consts::PI;
use std::fmt::Write;
use std::path::Path;

const SOURCE: &str = "Gjøl, Larsen and Christensen, figure 1";
/// Photons emitted by default.
const PHOTONS: i64 = 200_000;
/// Radius of the estimate, metres.
const RADIUS: f32 = 0.2;
/// Radius of the first layer, metres.
const FIRST: f32 = 0.05;
/// Distance from the edge, metres.
const INSET: f32 = 0.05;
/// Places along each edge that are measured beside the one that is drawn, and the distance between them, metres.
const ALONG: (i32, f32) = (4, 0.05);

/// One way to estimate irradiance over a disc.
#[derive(Debug, Serialize)]
struct Row {
    /// How.
    how: &'static str,
    /// At the place that is drawn, W/m².
    irradiance: f64,
    /// Over the truth there.
    ratio: f64,
    /// Mean of that ratio over all places along the edges.
    mean_ratio: f64,
    /// RMS of its distance to 1.
    rms: f64,
}

#[derive(Serialize)]
struct Report<'a> {
    #[serde(flatten)]
    head: &'a Head,
    photons_stored: StoredCounts,
    radius_m: f32,
    first_radius_m: f32,
    inset_m: f32,
    places: usize,
    reference: &'a str,
    truth: f64,
    truth_noise: f64,
    /// Within `inset_m` of the place.
    truth_near: Option<f64>,
    rows: &'a [Row],
}

/// What estimates are made of.
struct Found<'a> {
    top: &'a TableTop,
    photons: GlobalPhotons,
    areas: SurfaceAreas<'a>,
    published: Layer,
    corrected: Layer,
}

/// Ways to estimate, in the order of [`Found::estimates`].
const WAYS: [&str; 4] = [
    "photons, whole disc (photon map)",
    "photons, surface in the disc",
    "first-layer estimates wholly inside, as published",
    "first-layer estimates wholly inside, corrected",
];

impl<'a> Found<'a> {
    fn new(top: &'a TableTop, stored: &StoredPhotons) -> Self {
        let photons = GlobalPhotons::new(stored, &PhotonKind::ALL);
        let areas = SurfaceAreas::new(&top.scene);
        let layer = |how| Layer::of_photons(&photons, FIRST, FIRST * PHOTON_SPACING, how);
        let (published, corrected) = (layer(Estimates::AsPublished), layer(Estimates::Corrected(&areas)));
        Self { top, photons, areas, published, corrected }
    }

    /// Estimates whose discs lie wholly in that of radius [`RADIUS`] about a place (section 3).
    fn inside(&self, layer: &'a Layer, at: Vec3) -> impl Iterator<Item = &'a IrradianceEstimate> {
        let near = move |e: &&IrradianceEstimate| e.position.distance(at) < RADIUS - FIRST && agree(e.normal, Vec3::Y);
        layer.estimates().iter().filter(near)
    }

    fn estimates(&'a self, p: Vec2) -> [f64; 4] {
        let at = self.top.place(p);
        let power = self.photons.power_between(at, Vec3::Y, [0.0, RADIUS]);
        let over = |area: f64| if area > 0.0 { mean_of(power) / area } else { 0.0 };
        let of_layer = |layer: &'a Layer| {
            let mut sum = WeightedMean::default();
            self.inside(layer, at).for_each(|e| sum.add(e));
            sum.value().map_or(0.0, |rgb| f64::from(mean(rgb)))
        };
        [
            over(PI * f64::from(RADIUS).powi(2)),
            over(self.areas.within(at, Vec3::Y, RADIUS)),
            of_layer(&self.published),
            of_layer(&self.corrected),
        ]
    }
}

fn mean_of(v: DVec3) -> f64 {
    v.element_sum() / 3.0
}

/// The photons of a pass of those settings, all kinds, without footprints.
pub fn emitted(scene: &Scene, settings: &RenderSettings) -> StoredPhotons {
    let intersector = Intersector::new(&scene.geometry, scene.radius);
    let path = PathSettings {
        max_depth: settings.max_depth,
        direct: true,
        caustic: true,
        global: true,
        projected: false,
        differentials: false,
        spread: settings.diffuse_spread,
    };
    let (sampling, photons, seed) = (settings.sampling, settings.photons, settings.seed);
    Emitter { scene, intersector: &intersector, path, projection: None, sampling, photons, seed }
        .run(0, &interrupted)
        .stored
}

/// Places at the same distance from all four edges; the one that is drawn is the first.
fn places(half: Vec2) -> Vec<Vec2> {
    let (n, step) = ALONG;
    let steps = std::iter::once(0).chain((1..=n).flat_map(|i| [i, -i]));
    let edges = |t: f32| {
        let (x, y) = (half.x - INSET, half.y - INSET);
        [Vec2::new(x, t), Vec2::new(-x, t), Vec2::new(t, y), Vec2::new(t, -y)]
    };
    steps.flat_map(|i| edges(i as f32 * step)).collect()
}

/// Makes the figure.
///
/// # Errors
/// A wrong flag, a file that cannot be written, or an interruption.
pub fn run(item: &'static str, flags: &PaperFlags, folder: &Path) -> Result<Done, Failure> {
    let top = TableTop::new()?;
    let settings = settings(&top.scene, flags, flags.photons.unwrap_or(PHOTONS), NO_IMAGE)?;
    let truth = TopTruth::new(&top, settings.max_depth, flags.quiet || flags.json, item)?;
    let stored = emitted(&top.scene, &settings);
    if interrupted() {
        return Err(Failure::Interrupted(format!("nothing of {item} was written")));
    }
    let found = Found::new(&top, &stored);
    let places = places(top.half());
    let measured: Vec<([f64; 4], f64)> = places
        .iter()
        .filter_map(|&p| truth.mean(&top, p, RADIUS).map(|(t, _)| (found.estimates(p), t)))
        .filter(|(_, t)| *t > 0.0)
        .collect();
    let drawn = places[0];
    let (value, noise) = truth.mean(&top, drawn, RADIUS).unwrap_or((0.0, 0.0));
    let own = found.estimates(drawn);
    let n = measured.len().max(1) as f64;
    let rows: Vec<Row> = (0..WAYS.len())
        .map(|i| {
            let ratios = || measured.iter().map(|(e, t)| e[i] / t);
            Row {
                how: WAYS[i],
                irradiance: own[i],
                ratio: if value > 0.0 { own[i] / value } else { 0.0 },
                mean_ratio: ratios().sum::<f64>() / n,
                rms: (ratios().map(|r| (r - 1.0) * (r - 1.0)).sum::<f64>() / n).sqrt(),
            }
        })
        .collect();
    let mut head = Head::new(item, SOURCE, &top.scene, &settings);
    head.warnings.extend(truth.warnings().iter().cloned());
    let picture = draw(&found, &truth, drawn, &rows, value, &head);
    let report = Report {
        head: &head,
        photons_stored: counts(&stored),
        radius_m: RADIUS,
        first_radius_m: FIRST,
        inset_m: INSET,
        places: measured.len(),
        reference: truth.source(),
        truth: value,
        truth_noise: noise,
        truth_near: truth.mean(&top, drawn, INSET).map(|(near, _)| near),
        rows: &rows,
    };
    let mut table = Table::new(["estimate of irradiance", "W/m²", "over the truth", "mean over the edges", "rms"]);
    let mut csv = String::from("estimate,irradiance_w_m2,ratio,mean_ratio,rms\n");
    for r in &rows {
        let percent = |x: f64| format!("{:.1} %", 100.0 * x);
        table.row([
            r.how.into(),
            format!("{:.4}", r.irradiance),
            percent(r.ratio),
            percent(r.mean_ratio),
            percent(r.rms),
        ]);
        // Writing to a string cannot fail.
        let _ = writeln!(csv, "\"{}\",{:.6},{:.6},{:.6},{:.6}", r.how, r.irradiance, r.ratio, r.mean_ratio, r.rms);
    }
    let text = format!(
        "{}\na disc of radius {RADIUS} m whose middle is {INSET} m from the edge of the box, {} photons emitted; first layer of radius {FIRST} m\ntruth there, over the surface in the disc: {value:.4} W/m² with {:.2} % of noise ({}); mean and rms over {} places along the four edges\n",
        table.text(),
        settings.photons,
        100.0 * noise,
        truth.source(),
        measured.len()
    );
    head.write(folder, &picture, &csv, &report, &text)
}

const GROUND: [u8; 3] = [64; 3];
const INK: [u8; 3] = [235; 3];
const FAINT: [u8; 3] = [175; 3];
const TOP: [u8; 3] = [205; 3];
const BEYOND: [u8; 3] = [40; 3];
const PHOTON: [u8; 3] = [20, 60, 130];
const DISC: [u8; 3] = [0, 90, 60];
const ERROR: [u8; 3] = [220, 40, 30];
/// Pixels across and down of a window, and between windows.
const SIDE: u32 = 420;
const GAP: u32 = 14;
const ABOVE: u32 = 92;

fn draw(found: &Found, truth: &TopTruth, at: Vec2, rows: &[Row], value: f64, head: &Head) -> Canvas {
    let top = found.top;
    let mut canvas = Canvas::new([3 * SIDE + 4 * GAP, ABOVE + SIDE + 62], GROUND);
    let width = canvas.size[0] - 2 * GAP;
    let title = "An estimate at the edge of a box: photons over the disc, and estimates wholly inside it";
    canvas.text(GAP, 8, width, 26.0, INK, Face::Proportional, title);
    canvas.text(GAP, 40, width, 15.0, FAINT, Face::Proportional, &head.subtitle());
    let center = top.place(at);
    let half = 1.2 * RADIUS;
    let plane = |p: Vec2| Some((if top.holds(p) { TOP } else { BEYOND }, 1.0));
    let red = |p: Vec2| (p.distance(at) <= RADIUS && !top.holds(p)).then_some((ERROR, 0.75));
    for (i, title) in ["Photons in the disc", "First-layer discs wholly inside", "Irradiance by the path tracer"]
        .into_iter()
        .enumerate()
    {
        let x = GAP + i as u32 * (SIDE + GAP);
        canvas.text(x, 66, SIDE, 18.0, INK, Face::Proportional, title);
        let mut window = Window::new(&mut canvas, [x, ABOVE], SIDE, at, half);
        window.paint(plane);
        match i {
            0 => {
                window.paint(red);
                for p in found.photons.photons().iter().filter(|p| top.has(p.position, p.normal)) {
                    window.dot(top.flat(p.position), 1.6, PHOTON);
                }
            }
            1 => {
                let discs: Vec<Vec2> = found.inside(&found.published, center).map(|e| top.flat(e.position)).collect();
                let over = |p: Vec2| !top.holds(p) && discs.iter().any(|d| d.distance(p) <= FIRST);
                window.paint(|p| over(p).then_some((ERROR, 0.75)));
                discs.iter().for_each(|d| window.circle(*d, FIRST, 1.0, DISC, 0.35));
                discs.iter().for_each(|d| window.dot(*d, 2.0, DISC));
            }
            _ => {
                let scale = if value > 0.0 { 0.6 / value } else { 0.0 };
                window.paint(|p| {
                    let e = truth.at(top, p).filter(|_| top.holds(p))?;
                    let gray = (255.0 * (e * scale).clamp(0.0, 1.0)) as u8;
                    Some(([gray; 3], 1.0))
                });
            }
        }
        window.circle(at, RADIUS, 2.0, if i == 2 { [255, 210, 60] } else { [120, 20, 110] }, 1.0);
        window.dot(at, 4.0, [120, 20, 110]);
    }
    let percent = |r: &Row| format!("{:.1} % ({:.1} %)", 100.0 * r.ratio, 100.0 * r.mean_ratio);
    let lines = [
        [
            format!("over the whole disc: {} of the truth", percent(&rows[0])),
            format!("over the surface in the disc: {}", percent(&rows[1])),
        ],
        [format!("as published: {} of the truth", percent(&rows[2])), format!("corrected: {}", percent(&rows[3]))],
        [
            format!("{value:.4} W/m² over the surface in the disc"),
            "red: divided by, but no surface; in brackets means over all edges".into(),
        ],
    ];
    for (i, two) in lines.iter().enumerate() {
        for (l, line) in two.iter().enumerate() {
            let x = GAP + i as u32 * (SIDE + GAP);
            canvas.text(x, ABOVE + SIDE + 8 + 24 * l as u32, SIDE, 15.5, INK, Face::Proportional, line);
        }
    }
    canvas
}
