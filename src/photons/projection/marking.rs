//! Marking the cells of a light from which photons may meet a surface.

use super::ball_around;
use crate::math::frame::{concentric_disc, tangents};
use crate::photons::emission::spot_cosine;
use crate::scene::Light;
use crate::trace::direct::quad_normal;
use crate::trace::surface::flat_normal;
use glam::{DVec3, Vec3};
use std::f64::consts::{PI, TAU};

/// Cells along each of the two numbers that a direction or a place on a beam's disc is made of.
const FINE: u32 = 512;
/// The same where the light has area, so that directions are charted from several places.
const COARSE: u32 = 64;
/// Patches across and along a quad.
const QUAD_PATCHES: u32 = 4;
/// Strips of the number that chooses a triangle of a mesh light.
const STRIPS: u32 = 16;
/// Most pairs of a mesh light's triangles and specular surfaces that are looked at.
const MOST_PAIRS: usize = 1 << 22;
/// Added to all angles, radians, and to distances over the scene's radius: rounding must not lose a photon.
const MARGIN: f64 = 1e-4;
/// Cells across which a triangle is large.
const LARGE: f64 = 4.0;
/// How often a triangle is quartered while it looks large.
const MOST_QUARTERED: u32 = 6;
/// A cap of directions is as good as everything from here on, radians.
const LARGEST_CAP: f64 = 1.5;

/// Most cells that a chunk of surfaces sets before all are taken as set: a light that is too close to many surfaces sees
/// them in all directions.
const MOST_WORK: usize = 1 << 23;

/// Cells that are set.
pub(super) struct Marks {
    words: Vec<u64>,
    /// Cells set so far, however often.
    work: usize,
}

impl Marks {
    #[inline]
    fn set(&mut self, cell: u32) {
        self.words[(cell >> 6) as usize] |= 1 << (cell & 63);
        self.work += 1;
    }

    /// Sets `count` cells from `first` on, both multiples of 64.
    fn fill(&mut self, first: u32, count: u32) {
        let (first, count) = (first as usize / 64, count as usize / 64);
        self.words[first..first + count].fill(u64::MAX);
        self.work += count;
    }

    fn is_full(&self) -> bool {
        self.work > MOST_WORK
    }

    /// The cells that either has set.
    pub(super) fn or(mut self, other: &Self) -> Self {
        self.words.iter_mut().zip(&other.words).for_each(|(a, b)| *a |= b);
        self
    }

    /// When a chunk is done.
    pub(super) fn done(mut self) -> Self {
        if self.is_full() {
            self.words.fill(u64::MAX);
        }
        Self { work: 0, ..self }
    }

    fn has(&self, cell: u32) -> bool {
        self.words[(cell >> 6) as usize] >> (cell & 63) & 1 == 1
    }
}

/// How the numbers of a light become directions or places.
pub(super) enum Marking {
    /// Directions from patches of the light, each with its own cells.
    Directions {
        counts: [u32; 4],
        /// Where rows of cells begin, and where the last one ends.
        rows: Vec<Row>,
        patches: Vec<Patch>,
        /// Added to all distances, metres.
        margin: f64,
    },
    /// Places on the disc of parallel light.
    Disc { center: DVec3, tangents: [DVec3; 2], radius: f64 },
}

/// A border of rows of cells.
#[derive(Clone, Copy)]
pub(super) struct Row {
    /// Angle to the axis.
    angle: f64,
    /// Its sine and cosine.
    sincos: (f64, f64),
}

/// A part of a light from which directions are charted by their angle to an axis and their turn about it.
pub(super) struct Patch {
    /// Ball that holds it.
    center: DVec3,
    radius: f64,
    axis: DVec3,
    tangents: [DVec3; 2],
    /// Its first cell.
    first: u32,
}

impl Patch {
    fn new(center: Vec3, radius: f32, axis: Vec3, first: u32) -> Self {
        let (t, b) = tangents(axis);
        let tangents = [t.as_dvec3(), b.as_dvec3()];
        Self { center: center.as_dvec3(), radius: radius.into(), axis: axis.as_dvec3(), tangents, first }
    }
}

impl Marking {
    /// That of a light among so many specular surfaces, in a scene of that radius; None for a mesh light that would take
    /// too long, or that has no area.
    pub(super) fn new(light: &Light, surfaces: usize, scene_radius: f64) -> Option<Self> {
        let rows = |n: u32, angle: &dyn Fn(f64) -> f64| -> Vec<Row> {
            let row = |angle: f64| Row { angle, sincos: libm::sincos(angle) };
            (0..=n).map(|i| row(angle(f64::from(i) / f64::from(n)))).collect()
        };
        let sphere = |u: f64| libm::acos(1.0 - 2.0 * u);
        let hemisphere = |u: f64| libm::asin(u.sqrt());
        let (counts, rows, patches) = match light {
            Light::Point { position, .. } => {
                ([FINE, FINE, 1, 1], rows(FINE, &sphere), vec![Patch::new(*position, 0.0, Vec3::Z, 0)])
            }
            Light::Sphere { center, radius, .. } => {
                ([FINE, FINE, 1, 1], rows(FINE, &sphere), vec![Patch::new(*center, *radius, Vec3::Z, 0)])
            }
            Light::Spot { position, direction, cos_half, falloff, .. } => {
                let angle = |u| 2.0 * libm::asin((spot_cosine(*cos_half, f64::from(*falloff), u).0 / 2.0).sqrt());
                ([FINE, FINE, 1, 1], rows(FINE, &angle), vec![Patch::new(*position, 0.0, *direction, 0)])
            }
            Light::Quad { center, u, v, .. } => {
                let n = QUAD_PATCHES;
                let at = |i: u32| (2 * i + 1) as f32 / n as f32 - 1.0;
                let radius = (*u + *v).length().max((*u - *v).length()) / n as f32;
                let normal = quad_normal(*u, *v);
                let patch = |i: u32| {
                    let place = *center + *u * at(i / n) + *v * at(i % n);
                    Patch::new(place, radius, normal, i * COARSE * COARSE)
                };
                ([n, n, COARSE, COARSE], rows(COARSE, &hemisphere), (0..n * n).map(patch).collect())
            }
            Light::Mesh { triangles, cumulative_area, .. } => {
                let whole = f64::from(*cumulative_area.last()?);
                if triangles.len().saturating_mul(surfaces) > MOST_PAIRS {
                    return None;
                }
                let mut patches = Vec::new();
                let mut before = 0.0;
                for (corners, &end) in triangles.iter().zip(cumulative_area) {
                    let strip = |area: f64, off: f64| {
                        ((area / whole + off) * f64::from(STRIPS)).clamp(0.0, f64::from(STRIPS - 1)) as u32
                    };
                    let (center, radius) = ball_around(corners.map(|p| p.as_dvec3()));
                    let normal = flat_normal(*corners).as_vec3();
                    for i in strip(before, -1e-5)..=strip(end.into(), 1e-5) {
                        let patch = Patch::new(center.as_vec3(), radius as f32, normal, i * COARSE * COARSE);
                        patches.push(patch);
                    }
                    before = f64::from(end);
                }
                ([STRIPS, 1, COARSE, COARSE], rows(COARSE, &hemisphere), patches)
            }
            Light::Directional { direction, disc_center, disc_radius, .. } => {
                let (t, b) = tangents(*direction);
                let tangents = [t.as_dvec3(), b.as_dvec3()];
                return Some(Self::Disc { center: disc_center.as_dvec3(), tangents, radius: (*disc_radius).into() });
            }
        };
        Some(Self::Directions { counts, rows, patches, margin: scene_radius * MARGIN })
    }

    /// Cells along each number.
    pub(super) fn counts(&self) -> [u32; 4] {
        match self {
            Self::Directions { counts, .. } => *counts,
            Self::Disc { .. } => [FINE, FINE, 1, 1],
        }
    }

    /// None set.
    pub(super) fn empty(&self) -> Marks {
        Marks { words: vec![0; (self.counts().iter().product::<u32>() as usize).div_ceil(64)], work: 0 }
    }

    /// Marks what may meet a triangle.
    pub(super) fn triangle(&self, corners: [DVec3; 3], bits: &mut Marks) {
        match self {
            Self::Directions { patches, .. } => {
                patches.iter().for_each(|p| self.quartered(Some(p), corners, MOST_QUARTERED, bits));
            }
            Self::Disc { .. } => self.quartered(None, corners, MOST_QUARTERED, bits),
        }
    }

    /// Marks what may meet a ball.
    pub(super) fn ball(&self, center: DVec3, radius: f64, bits: &mut Marks) {
        match self {
            Self::Directions { patches, .. } => patches.iter().for_each(|p| self.cap(p, center, radius, bits)),
            Self::Disc { .. } => self.shadow(center, radius, bits),
        }
    }

    /// A triangle as one ball, or as four triangles while it looks large from the patch, or on the disc.
    fn quartered(&self, patch: Option<&Patch>, corners: [DVec3; 3], left: u32, bits: &mut Marks) {
        if bits.is_full() {
            return;
        }
        let (center, radius) = ball_around(corners);
        let is_large = match (self, patch) {
            (Self::Directions { rows, .. }, Some(p)) => {
                let distance = p.center.distance(center) - p.radius;
                radius > p.radius / 2.0 && radius > distance * LARGE * rows[rows.len() - 1].angle / rows.len() as f64
            }
            (Self::Disc { radius: whole, .. }, _) => radius > whole * LARGE / f64::from(FINE),
            _ => false,
        };
        if is_large && left > 0 {
            let [a, b, c] = corners;
            let [ab, bc, ca] = [(a + b) / 2.0, (b + c) / 2.0, (c + a) / 2.0];
            for part in [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]] {
                self.quartered(patch, part, left - 1, bits);
            }
        } else if let Some(p) = patch {
            self.cap(p, center, radius, bits);
        } else {
            self.shadow(center, radius, bits);
        }
    }

    /// Marks the directions from anywhere in a patch to anywhere in a ball: a cap of the sphere of directions.
    fn cap(&self, patch: &Patch, center: DVec3, radius: f64, bits: &mut Marks) {
        let Self::Directions { counts, rows, margin, .. } = self else { return };
        if bits.is_full() {
            return;
        }
        let columns = if counts[2] == 1 { counts[1] } else { counts[3] };
        let to = center - patch.center;
        let distance = to.length();
        let reach = radius + patch.radius + margin;
        let cap = if distance > reach { libm::asin(reach / distance) + MARGIN } else { PI };
        if cap >= LARGEST_CAP {
            bits.fill(patch.first, (rows.len() as u32 - 1) * columns);
            return;
        }
        let along = to / distance;
        let angle = libm::acos(along.dot(patch.axis).clamp(-1.0, 1.0));
        let turn = libm::atan2(along.dot(patch.tangents[1]), along.dot(patch.tangents[0]));
        let (low, high) = (angle - cap, angle + cap);
        // Where a cap is widest about the axis it touches a meridian.
        let widest = libm::acos((libm::cos(angle) / libm::cos(cap)).clamp(-1.0, 1.0));
        let (cap_cos, (sin, cos)) = (libm::cos(cap), libm::sincos(angle));
        let half_width = |(at_sin, at_cos): (f64, f64)| {
            let across = at_sin * sin;
            if across < 1e-12 { PI } else { libm::acos(((cap_cos - at_cos * cos) / across).clamp(-1.0, 1.0)) }
        };
        let first = rows.partition_point(|r| r.angle <= low).saturating_sub(1);
        let mut from = rows[first].angle.max(low);
        let mut half_from = half_width(libm::sincos(from));
        for (row, next) in rows[1..].iter().enumerate().skip(first) {
            if rows[row].angle > high {
                break;
            }
            let (to, at) = if next.angle <= high { (next.angle, next.sincos) } else { (high, libm::sincos(high)) };
            let half_to = half_width(at);
            let mut half = half_from.max(half_to);
            if (from..=to).contains(&widest) {
                half = half.max(half_width(libm::sincos(widest)));
            }
            (from, half_from) = (to, half_to);
            let half = (half + MARGIN).min(PI);
            let scale = f64::from(columns) / TAU;
            let (left, right) = (((turn - half) * scale).floor() as i64, ((turn + half) * scale).floor() as i64);
            let row = patch.first + row as u32 * columns;
            for column in left..=right.min(left + i64::from(columns) - 1) {
                bits.set(row + column.rem_euclid(i64::from(columns)) as u32);
            }
        }
    }

    /// Marks the squares of the disc's plane, of [`FINE`] a side, that a ball's shadow meets.
    fn shadow(&self, center: DVec3, radius: f64, bits: &mut Marks) {
        let Self::Disc { center: disc, tangents, radius: whole } = self else { return };
        if bits.is_full() {
            return;
        }
        let to = (center - disc) / whole;
        let reach = radius / whole + MARGIN;
        let [rows, columns] = tangents.map(|t| squares(to.dot(t), reach));
        for row in rows {
            for column in columns.clone() {
                bits.set(row * FINE + column);
            }
        }
    }

    /// Bits of cells from what was set.
    pub(super) fn finished(&self, bits: Marks) -> Vec<u64> {
        if let Self::Directions { .. } = self {
            return bits.words;
        }
        let mut cells = self.empty();
        // The concentric map stretches no length by more than 1.5.
        let reach = 1.5 * std::f64::consts::SQRT_2 / f64::from(FINE);
        for cell in 0..FINE * FINE {
            let middle = |i: u32| (i as f32 + 0.5) / FINE as f32;
            let (x, y) = concentric_disc(middle(cell / FINE), middle(cell % FINE));
            let columns = squares(y.into(), reach);
            let mut met = squares(x.into(), reach).flat_map(|r| columns.clone().map(move |c| r * FINE + c));
            if met.any(|i| bits.has(i)) {
                cells.set(cell);
            }
        }
        cells.words
    }
}

/// The squares along a side of the disc's plane, `[-1, 1]`, from `at - reach` to `at + reach`.
fn squares(at: f64, reach: f64) -> std::ops::RangeInclusive<u32> {
    let square = |x: f64| ((x + 1.0) / 2.0 * f64::from(FINE)).clamp(0.0, f64::from(FINE - 1)) as u32;
    square(at - reach)..=square(at + reach)
}
