//! `gather-figure-3`: the footprints of gather rays on the hemisphere, seen from above, and how much of it they cover.

use crate::cli::failure::Failure;
use crate::cli::paper::PaperFlags;
use crate::cli::paper::gathering::drawing::Window;
use crate::cli::paper::gathering::output::{Head, NO_IMAGE};
use crate::cli::paper::gathering::room::{settings, two_lights};
use crate::cli::paper::output::Done;
use crate::cli::table::Table;
use crate::estimate::final_gathering::GatherPattern;
use crate::export::text::{Canvas, Face};
use crate::final_gather::directions::{Directions, footprint_radius};
use crate::math::frame::{cosine_hemisphere, uniform_sphere};
use crate::math::hash::mix;
use glam::{Vec2, Vec3};
use rayon::prelude::*;
use serde::Serialize;
use std::fmt::Write;
use std::path::Path;

const SOURCE: &str = "Gjøl, Larsen and Christensen, figure 3";
/// Gather rays.
const RAYS: u32 = 200;
/// Sets of rays that are averaged, as in the paper.
const SETS: u64 = 10;
/// Directions at which coverage is measured, spread evenly over the hemisphere.
const PROBES: u32 = 8192;

/// How wide footprints are.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
enum Width {
    /// `√(2π/N)` everywhere.
    Unscaled,
    /// `√(2π/N)/cos θ`.
    AsPublished,
    /// `1/√(N cos θ)`.
    Corrected,
}

const WIDTHS: [(Width, &str); 3] = [
    (Width::Unscaled, "√(2π/N), not scaled"),
    (Width::AsPublished, "√(2π/N)/cos θ, as published"),
    (Width::Corrected, "1/√(N cos θ), corrected"),
];
const PATTERNS: [(GatherPattern, &str); 3] =
    [(GatherPattern::Stratified, "stratified"), (GatherPattern::Sobol, "sobol"), (GatherPattern::Spiral, "spiral")];

impl Width {
    fn radius(self, cos: f32) -> f32 {
        match self {
            // The published radius at the pole.
            Self::Unscaled => footprint_radius(RAYS, 1.0, true),
            Self::AsPublished => footprint_radius(RAYS, cos, true),
            Self::Corrected => footprint_radius(RAYS, cos, false),
        }
    }
}

/// A cone of directions: its axis, and the least cosine to it.
type Footprint = (Vec3, f32);

/// Footprints of one set of rays about z.
fn footprints(pattern: GatherPattern, width: Width, seed: u64) -> Vec<Footprint> {
    let directions = Directions::new(pattern, RAYS, seed);
    (0..RAYS)
        .map(|i| {
            let [u, v] = directions.square(i);
            let axis = cosine_hemisphere(Vec3::Z, u, v);
            let r = width.radius(axis.z);
            // The disc of that radius at distance 1 is seen under the angle atan r.
            (axis, 1.0 / (1.0 + r * r).sqrt())
        })
        .collect()
}

fn covering(set: &[Footprint], direction: Vec3) -> u32 {
    set.iter().map(|(axis, least)| u32::from(axis.dot(direction) >= *least)).sum()
}

/// How a pattern with a width covers the hemisphere, the mean over the sets.
#[derive(Clone, Copy, Debug, Serialize)]
struct Coverage {
    pattern: &'static str,
    width: Width,
    /// Share of the hemisphere's solid angle under at least one footprint.
    covered: f64,
    /// Under more than one.
    more_than_once: f64,
    /// Footprints over a direction, the mean.
    mean: f64,
    /// Share under at least one, weighted by the cosine, as light counts.
    covered_by_cosine: f64,
}

/// Directions evenly spread over the hemisphere about z: a spiral of equal areas.
fn probes() -> impl Iterator<Item = Vec3> {
    (0..PROBES).map(|i| {
        let turn = f64::from(i) * 0.618_033_988_749_894_9;
        uniform_sphere((i as f32 + 0.5) / (2.0 * PROBES as f32), (turn - turn.floor()) as f32)
    })
}

fn coverage(sets: &[Vec<Footprint>], pattern: &'static str, width: Width) -> Coverage {
    let (mut covered, mut twice, mut sum, mut by_cosine, mut cosines) = (0.0, 0.0, 0.0, 0.0, 0.0);
    for direction in probes() {
        let cos = f64::from(direction.z);
        for set in sets {
            let n = covering(set, direction);
            covered += f64::from(u8::from(n > 0));
            twice += f64::from(u8::from(n > 1));
            sum += f64::from(n);
            by_cosine += if n > 0 { cos } else { 0.0 };
            cosines += cos;
        }
    }
    let count = f64::from(PROBES) * sets.len().max(1) as f64;
    Coverage {
        pattern,
        width,
        covered: covered / count,
        more_than_once: twice / count,
        mean: sum / count,
        covered_by_cosine: by_cosine / cosines,
    }
}

#[derive(Serialize)]
struct Report<'a> {
    #[serde(flatten)]
    head: &'a Head,
    rays: u32,
    sets: u64,
    rows: &'a [Coverage],
}

/// Makes the figure.
///
/// # Errors
/// A wrong flag, or a file that cannot be written.
pub fn run(item: &'static str, flags: &PaperFlags, folder: &Path) -> Result<Done, Failure> {
    let scene = two_lights()?;
    let settings = settings(&scene, flags, flags.photons.unwrap_or(1), NO_IMAGE)?;
    let cases: Vec<_> = WIDTHS.iter().flat_map(|w| PATTERNS.iter().map(move |p| (*w, *p))).collect();
    let made: Vec<(Coverage, Vec<f32>)> = cases
        .par_iter()
        .map(|&((width, _), (pattern, name))| {
            let sets: Vec<_> = (0..SETS).map(|i| footprints(pattern, width, mix(settings.seed, i))).collect();
            (coverage(&sets, name, width), seen_from_above(&sets))
        })
        .collect();
    let rows: Vec<Coverage> = made.iter().map(|(c, _)| *c).collect();
    let mut head = Head::new(item, SOURCE, &scene, &settings);
    head.provenance.scene = "hemisphere".into();
    let picture = draw(&made, &head);
    let mut table =
        Table::new(["width, pattern", "covered", "more than once", "footprints over a direction", "covered by cosine"]);
    let mut csv = String::from("width,pattern,rays,sets,covered,more_than_once,mean,covered_by_cosine\n");
    for (c, ((width, text), _)) in rows.iter().zip(&cases) {
        let percent = |x: f64| format!("{:.1} %", 100.0 * x);
        let name = match width {
            Width::Unscaled => "unscaled",
            Width::AsPublished => "as_published",
            Width::Corrected => "corrected",
        };
        let (covered, twice, cosine) = (percent(c.covered), percent(c.more_than_once), percent(c.covered_by_cosine));
        table.row([format!("{text}, {}", c.pattern), covered, twice, format!("{:.2}", c.mean), cosine]);
        // Writing to a string cannot fail.
        let _ = writeln!(
            csv,
            "{name},{},{RAYS},{SETS},{:.6},{:.6},{:.6},{:.6}",
            c.pattern, c.covered, c.more_than_once, c.mean, c.covered_by_cosine
        );
    }
    let text =
        format!("{}\n{RAYS} rays, means over {SETS} sets; shares of the hemisphere's solid angle\n", table.text());
    head.write(folder, &picture, &csv, &Report { head: &head, rays: RAYS, sets: SETS, rows: &rows }, &text)
}

const SIDE: u32 = 280;
const GAP: u32 = 14;
const ABOVE: u32 = 92;
const BELOW: u32 = 50;
/// Counts that are shown as black and as white, in powers of two.
const RANGE: [f32; 2] = [-3.0, 4.0];

/// Footprints over each pixel of a window on the unit disc, the mean over the sets; NaN outside the disc.
fn seen_from_above(sets: &[Vec<Footprint>]) -> Vec<f32> {
    (0..SIDE * SIDE)
        .into_par_iter()
        .map(|i| {
            let at = |n: u32| (2.0 * (n as f32 + 0.5) / SIDE as f32 - 1.0) * HALF;
            let (x, y) = (at(i % SIDE), at(i / SIDE));
            let z = 1.0 - x * x - y * y;
            if z <= 0.0 {
                return f32::NAN;
            }
            let direction = Vec3::new(x, y, z.sqrt());
            sets.iter().map(|s| covering(s, direction)).sum::<u32>() as f32 / sets.len().max(1) as f32
        })
        .collect()
}

/// Half of the window, the hemisphere's radius being 1.
const HALF: f32 = 1.03;

fn draw(made: &[(Coverage, Vec<f32>)], head: &Head) -> Canvas {
    let (ground, ink, faint) = ([64; 3], [235; 3], [175; 3]);
    let size = [3 * SIDE + 4 * GAP, ABOVE + 3 * (SIDE + BELOW) + 34];
    let mut canvas = Canvas::new(size, ground);
    let width = size[0] - 2 * GAP;
    let title = format!("Footprints of {RAYS} gather rays, the mean of {SETS} sets, seen from above");
    canvas.text(GAP, 8, width, 26.0, ink, Face::Proportional, &title);
    canvas.text(GAP, 40, width, 15.0, faint, Face::Proportional, &head.subtitle());
    for (i, (_, name)) in PATTERNS.iter().enumerate() {
        canvas.text(GAP + i as u32 * (SIDE + GAP), 66, SIDE, 18.0, ink, Face::Proportional, name);
    }
    for (i, (c, counts)) in made.iter().enumerate() {
        let (column, row) = (i as u32 % 3, i as u32 / 3);
        let (x, y) = (GAP + column * (SIDE + GAP), ABOVE + row * (SIDE + BELOW));
        let mut window = Window::new(&mut canvas, [x, y], SIDE, Vec2::ZERO, HALF);
        window.paint(|p| {
            let pixel = |v: f32| (((v / HALF + 1.0) / 2.0 * SIDE as f32) as u32).min(SIDE - 1);
            let count = counts[(pixel(p.y) * SIDE + pixel(p.x)) as usize];
            (!count.is_nan()).then(|| (color(count), 1.0))
        });
        let what = WIDTHS.iter().find(|(w, _)| *w == c.width).map_or("", |(_, text)| text);
        canvas.text(x, y + SIDE + 4, SIDE, 16.0, ink, Face::Proportional, what);
        let line = format!("covered {:.1} %, twice {:.1} %", 100.0 * c.covered, 100.0 * c.more_than_once);
        canvas.text(x, y + SIDE + 24, SIDE, 15.0, faint, Face::Monospace, &line);
    }
    let note = "red: no footprint in any set; black to white: 1/8 to 16 footprints over a direction, by powers of two";
    canvas.text(GAP, size[1] - 26, width, 15.0, faint, Face::Proportional, note);
    canvas
}

fn color(count: f32) -> [u8; 3] {
    if count <= 0.0 {
        return [200, 40, 30];
    }
    let t = (libm::log2f(count) - RANGE[0]) / (RANGE[1] - RANGE[0]);
    [(255.0 * t.clamp(0.0, 1.0) + 0.5) as u8; 3]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The mean count is the sum of the cones' solid angles above the horizon over 2π; far from the horizon none is cut.
    #[test]
    fn counts_are_solid_angles() {
        let set = vec![(Vec3::Z, 0.9), (Vec3::new(0.6, 0.0, 0.8), 0.95)];
        let c = coverage(&[set], "", Width::Corrected);
        // A cone of cosine c has 2π (1 - c).
        assert!((c.mean - 0.15).abs() < 2e-3, "{}", c.mean);
        // They overlap: 36.87° between the axes, 25.84° and 18.19° across.
        assert!(c.more_than_once > 0.0 && (c.covered + c.more_than_once - c.mean).abs() < 1e-9);
    }

    /// Corrected footprints hold one over each direction in the mean, but for what reaches below the horizon.
    #[test]
    fn corrected_footprints_share_the_hemisphere() {
        let sets: Vec<_> = (0..3).map(|i| footprints(GatherPattern::Spiral, Width::Corrected, i)).collect();
        let c = coverage(&sets, "", Width::Corrected);
        assert!((0.85..1.05).contains(&c.mean), "{}", c.mean);
        let published: Vec<_> = (0..3).map(|i| footprints(GatherPattern::Spiral, Width::AsPublished, i)).collect();
        assert!(coverage(&published, "", Width::AsPublished).mean > 4.0);
    }
}
