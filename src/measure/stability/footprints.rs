//! Photon footprints without width, without size and in any place, and what the estimators make of them.

use super::case::{F32, many};
use super::oracle::convex::covered;
use super::oracle::footprint::{largest_mean, mean_over};
use super::oracle::quadrature::integral;
use super::oracle::random::Random;
use super::oracle::svd::Ellipse;
use super::{Case, Outcome};
use crate::estimate::clip::{ClippedPolygon, MAX_VERTICES};
use crate::estimate::multi_sampled::{Grid, MultiSampled};
use crate::estimate::registry::{ESTIMATORS, estimator};
use crate::estimate::{Estimator, Lookup, View, coplanar};
use crate::photons::footprint::FilterTransform;
use crate::photons::map::{FootprintLimits, MapParts, Query};
use crate::photons::{MapPhoton, Photon, PhotonMap};
use glam::{DVec2, DVec3, Vec3};
use std::f64::consts::PI;

/// The group.
pub const CASES: &[Case] = &[
    Case {
        group: "footprints",
        name: "ellipse",
        what: "semi-axis, area and box of a photon's ellipse; relative error",
        range: "1e-12 to 1e6 m, aspect ratios to 1e8, axes parallel to 1e-7, one axis or both none; floor and ceiling",
        oracle: "one-sided Jacobi, f64",
        limit: 4.0 * F32,
        run: ellipse,
    },
    Case {
        group: "footprints",
        name: "filter-point",
        what: "backward error of the filter transform: how far the point lies that it maps exactly, over the distance",
        range: "condition 1 to 1e12, axes parallel to 1e-12, mirrored, any normal",
        oracle: "principal axes by one-sided Jacobi, f64",
        limit: 4.0 * F32,
        run: filter_point,
    },
    Case {
        group: "footprints",
        name: "own-axes",
        what: "coordinates in dα, dβ, and the half-axes that the map gives back; error in footprints",
        range: "condition 1 to 1e6, axes parallel to 1e-6, mirrored",
        oracle: "the axes that were put in, f64",
        limit: 16.0 * F32,
        run: own_axes,
    },
    Case {
        group: "footprints",
        name: "weights-at-a-point",
        what: "regular's weight at a place in filter space; error relative to the kernel's peak",
        range: "from the centre to the rim",
        oracle: "the kernel in f64",
        limit: 8.0 * F32,
        run: regular_weight,
    },
    Case {
        group: "footprints",
        name: "weights-on-a-disc",
        what: "density's weight with each kernel; error relative to its mean over the disc",
        range: "discs of 1e-9 to 1e9 m, photons from the centre to the rim and on it",
        oracle: "the kernels' formulas (Jensen 2001; Silverman 1986), normalised by quadrature, f64",
        limit: 16.0 * F32,
        run: disc_weight,
    },
    Case {
        group: "footprints",
        name: "weights-of-points",
        what: "mean over N x N points, N = 2 to 256, both grids; error relative to the footprint's largest mean",
        range: "view footprints 1e-6 to 1e3 photon radii",
        oracle: "the same points one by one, f64",
        limit: 64.0 * F32,
        run: sampled_weight,
    },
    Case {
        group: "footprints",
        name: "integrated",
        what: "integrated's weight of a photon in the scene; error over its largest and over the condition of the places",
        range: "photons 1e-5 to 1 scene radii, aspect ratios to 4e6, view footprints 1e-6 to 10, planes to 60°",
        oracle: "closed form along one axis, quadrature along the other, f64, from the photon's axes",
        limit: 16.0 * F32,
        run: integrated_weight,
    },
    Case {
        group: "footprints",
        name: "coverage",
        what: "share of the view footprint inside the photon's polygon, and its centroid; error over the largest share",
        range: "view footprints 1e-6 to 1e6 photon radii, aspect ratios to 1e6, polygons of 3 to 20 corners, touching",
        oracle: "lines across the view footprint, f64",
        limit: F32,
        run: coverage,
    },
    Case {
        group: "footprints",
        name: "projection",
        what: "view footprint projected along the ray into a photon's plane; backward error of ray and place, relative",
        range: "rays 90° to 1e-7 rad off the photon's plane, planes to 90° apart, view footprints 1e-6 to 1e3 photon radii",
        oracle: "the line of sight met with the plane, f64",
        limit: 4.0 * F32,
        run: projection,
    },
    Case {
        group: "footprints",
        name: "any-weight",
        what: "every estimator's weight lies in [0, peak]; excess relative to the peak",
        range: "photon and view footprints none, 1e-12 to 1e6 m, skew, NaN and infinite; planes to 90°; grazing rays",
        oracle: "the kernel's bounds",
        limit: 1e-6,
        run: any_weight,
    },
];

/// A footprint of long semi-axis `long` on a surface of normal `n`, with the given aspect ratio and skew.
fn footprint(random: &mut Random, n: DVec3, long: f64, aspect: f64) -> [Vec3; 2] {
    let (t, b) = n.any_orthonormal_pair();
    let (s, c) = libm::sincos(random.range(0.0, std::f64::consts::TAU));
    let (x, y) = ((t * c + b * s) * long, (b * c - t * s) * (long / aspect));
    // Any turn of the unit circle gives the same ellipse; near 0 the conjugate half-axes are at right angles.
    let (s, c) = libm::sincos(random.range(0.0, std::f64::consts::TAU));
    let mirror = if random.unit() < 0.5 { -1.0 } else { 1.0 };
    [(x * c - y * s).as_vec3(), ((x * s + y * c) * mirror).as_vec3()]
}

/// Half-axes in the tangent plane, as f64 takes them from f32.
fn in_plane(axes: [Vec3; 2], n: Vec3) -> [DVec3; 2] {
    let n = n.as_dvec3().normalize();
    axes.map(|c| c.as_dvec3() - n * n.dot(c.as_dvec3()))
}

fn ellipse() -> Outcome {
    many("ellipse", 100_000, |i, random, outcome| {
        let n = random.direction().as_vec3();
        let (floor, ceiling) = (1e-13f32, 1e7f32);
        let long = random_length(random);
        let mut axes = footprint(random, n.as_dvec3(), long, 1.0);
        match i % 5 {
            0 => axes[1] = Vec3::ZERO,
            1 => axes = [Vec3::ZERO; 2],
            2 => {
                let (long, aspect) = (random_length(random), random.decade(0.0, 8.0));
                axes = footprint(random, n.as_dvec3(), long, aspect);
            }
            3 => {
                // Parallel but for an angle, as dQ where it becomes singular.
                let tilt = n.as_dvec3().cross(axes[0].as_dvec3()) * random.decade(-7.0, -1.0);
                axes[1] = ((axes[0].as_dvec3() + tilt) * random.range(-2.0, 2.0)).as_vec3();
            }
            _ => {}
        }
        let t = FilterTransform::new(axes, n, 1.0, floor, ceiling);
        let [a, b] = in_plane(axes, n);
        let exact = Ellipse::of(a, b);
        let [long, short] = exact.lengths.map(|l| l.clamp(f64::from(floor), f64::from(ceiling)));
        outcome.bounded += u64::from(t.floored || t.capped);
        let at =
            || format!("{axes:?} on {n}: reach {:e} for {long:e}, 1/A {:e}, short {short:e}", t.reach, t.inverse_area);
        outcome.see((f64::from(t.reach) / long - 1.0).abs(), at);
        outcome.see((f64::from(t.inverse_area) * PI * long * short - 1.0).abs(), at);
        // The box: its half-size along each axis is that of the ellipsoid.
        if exact.lengths[0] == long {
            let unit = n.as_dvec3().normalize();
            let across =
                if exact.lengths[1] == short { exact.axes[1] } else { unit.cross(exact.axes[0] / long) * short };
            for k in 0..3 {
                let half = DVec3::new(exact.axes[0][k], across[k], unit[k] * long).length();
                outcome.see((f64::from(t.half_extent[k]) - half).abs() / long, at);
            }
        }
    })
}

fn random_length(random: &mut Random) -> f64 {
    random.decade(-12.0, 6.0)
}

fn filter_point() -> Outcome {
    many("filter-point", 100_000, |i, random, outcome| {
        let n = random.direction().as_vec3();
        let aspect = random.decade(0.0, 12.0);
        let long = random.decade(-3.0, 3.0);
        let mut axes = footprint(random, n.as_dvec3(), long, aspect);
        if i % 2 == 0 {
            // Conjugate half-axes at right angles: f32 holds any aspect ratio.
            let x = axes[0].as_dvec3().normalize() * long;
            axes = [x.as_vec3(), (n.as_dvec3().cross(x) / aspect).as_vec3()];
        }
        let t = FilterTransform::new(axes, n, 1.0, 1e-30, 1e30);
        let [a, b] = in_plane(axes, n);
        let e = Ellipse::of(a, b);
        let unit = n.as_dvec3().normalize();
        // A point anywhere near the ellipse, or near its rim.
        let (s, c) = libm::sincos(random.range(0.0, std::f64::consts::TAU));
        let r = random.range(0.0, 2.0);
        let x = (e.axes[0] * (c * r) + e.axes[1] * (s * r) + unit * (long * random.range(-0.1, 0.1))).as_vec3();
        let found = t.rows.map(|r| f64::from(r.dot(x)));
        // The point that these coordinates belong to, along the exact axes; signs are the transform's choice.
        let along = e.axes[0] / e.lengths[0];
        let directions = [along, unit.cross(along), unit];
        let lengths = [e.lengths[0], e.lengths[1], e.lengths[0]];
        let mut moved = 0.0;
        for k in 0..3 {
            let exact = directions[k].dot(x.as_dvec3());
            let sign = t.rows[k].as_dvec3().dot(directions[k]).signum();
            moved += (found[k] * sign * lengths[k] - exact).powi(2);
        }
        // Where the ellipse is a circle its axes are anyone's.
        if e.lengths[0] > 1.01 * e.lengths[1] {
            outcome.see(moved.sqrt() / f64::from(x.length()), || format!("{axes:?} on {n} at {x}"));
        }
    })
}

/// A photon at the origin as a map has it.
fn mapped(position: Vec3, footprint: [Vec3; 2], normal: Vec3, limits: FootprintLimits) -> MapPhoton {
    let photon = Photon { position, direction: -normal, normal, power: crate::math::rgb::Rgb::ONE, footprint };
    PhotonMap::new(&[photon], limits, MapParts { kd_tree: false, overlap: false }).photons()[0]
}

const OPEN: FootprintLimits = FootprintLimits { scale: 1.0, floor: 1e-18, ceiling: 1e12 };

fn own_axes() -> Outcome {
    many("own-axes", 100_000, |_, random, outcome| {
        let n = random.direction().as_vec3();
        let (long, aspect) = (random.decade(-6.0, 3.0), random.decade(0.0, 6.0));
        let axes = footprint(random, n.as_dvec3(), long, aspect);
        let photon = mapped(Vec3::ZERO, axes, n, OPEN);
        let given = in_plane(axes, n);
        for (found, given) in photon.axes().iter().zip(given) {
            // Relative to the length along the ellipse; across it a unit in the last place of the length is rounding.
            outcome.see((found.as_dvec3() - given).length() / long, || format!("{axes:?} on {n}: {found} for {given}"));
        }
        if aspect < 100.0 {
            for (own, given) in [DVec2::X, DVec2::Y].into_iter().zip(given) {
                let f = photon.to_filter(given.as_vec3());
                let found = photon.to_own(DVec2::new(f64::from(f.x), f64::from(f.y)));
                outcome.see((found - own).length() / aspect, || format!("{axes:?} on {n}: {found} for {own}"));
            }
        }
    })
}

fn regular_weight() -> Outcome {
    let Ok(regular) = estimator("regular") else { return Outcome::default() };
    many("weights-at-a-point", 50_000, |_, random, outcome| {
        let axes = [Vec3::X, Vec3::Y];
        let photon = mapped(Vec3::ZERO, axes, Vec3::Z, OPEN);
        let r = 1.0 - random.decade(-8.0, 0.0);
        let x = (DVec2::from_angle(random.range(0.0, 6.3)) * r).as_vec2().extend(0.0);
        let weight = regular.weight(&photon, &view(x, [Vec3::ZERO; 2], Vec3::Z, Vec3::NEG_Z), 0.0);
        let exact = 3.0 * (1.0 - x.as_dvec3().length_squared()).max(0.0).powi(2) / PI;
        outcome.see((weight - exact).abs() / (3.0 / PI), || format!("at {x}: {weight:e} for {exact:e}"));
    })
}

fn view(center: Vec3, axes: [Vec3; 2], normal: Vec3, direction: Vec3) -> View {
    View { query: Query { center, normal, axes }, direction }
}

/// A kernel as its source has it, a function of distance over radius that is not normalised.
struct DiscKernel {
    name: &'static str,
    shape: fn(f64) -> f64,
}

const DISC_KERNELS: [DiscKernel; 5] = [
    DiscKernel { name: "none", shape: |_| 1.0 },
    DiscKernel { name: "cone", shape: |r| 1.0 - r },
    DiscKernel {
        name: "gaussian",
        shape: |r| 1.0 - (1.0 - libm::exp(-1.953 * r * r / 2.0)) / (1.0 - libm::exp(-1.953)),
    },
    DiscKernel { name: "epanechnikov", shape: |r| 1.0 - r * r },
    DiscKernel { name: "silverman", shape: |r| (1.0 - r * r).powi(2) },
];

fn disc_weight() -> Outcome {
    DISC_KERNELS
        .iter()
        .map(|&DiscKernel { name, shape }| {
            let Ok(density) = estimator(&format!("density:kernel={name}")) else { return Outcome::default() };
            let whole = 2.0 * PI * integral(&|r| shape(r) * r, 0.0, 1.0, 1e-15);
            many("weights-on-a-disc", 10_000, |i, random, outcome| {
                let radius = random.decade(-9.0, 9.0) as f32;
                let photon = mapped(Vec3::ZERO, [Vec3::X, Vec3::Y], Vec3::Z, OPEN);
                let r = if i % 10 == 0 { 1.0 } else { random.unit() };
                let x = (DVec2::from_angle(random.range(0.0, 6.3)) * (r * f64::from(radius))).as_vec2().extend(0.0);
                let (area, along) = (f64::from(radius).powi(2), x.as_dvec3().length() / f64::from(radius));
                let weight = density.weight(&photon, &view(x, [Vec3::ZERO; 2], Vec3::Z, Vec3::NEG_Z), radius);
                let exact = shape(along.min(1.0)) / (whole * area);
                outcome.see((weight - exact).abs() * PI * area, || format!("{name}, radius {radius:e} at {along}"));
            })
        })
        .fold(Outcome::default(), Outcome::and)
}

fn sampled_weight() -> Outcome {
    many("weights-of-points", 4_000, |i, random, outcome| {
        let grid = if i % 2 == 0 { Grid::Closed } else { Grid::Cells };
        let n = 2u32 << (random.unit() * 7.0).min(7.0) as u32;
        let size = random.decade(-6.0, 3.0);
        let vector = |random: &mut Random, size: f64| (random.direction() * (size * random.unit())).as_vec3();
        let (a, b) = (vector(random, size), vector(random, size));
        let c = a * random.range(-1.2, 1.2) as f32 + b * random.range(-1.2, 1.2) as f32 + vector(random, 0.7);
        let found = MultiSampled::new(n, grid).mean(c, a, b);
        let at = |k: u32| match grid {
            Grid::Closed => f64::from(2 * k) / f64::from(n - 1) - 1.0,
            Grid::Cells => f64::from(2 * k + 1) / f64::from(n) - 1.0,
        };
        let mut sum = 0.0;
        for s in 0..n {
            for t in 0..n {
                let x = c.as_dvec3() + a.as_dvec3() * at(s) + b.as_dvec3() * at(t);
                sum += (1.0 - x.length_squared()).max(0.0).powi(2);
            }
        }
        let exact = sum / f64::from(n * n);
        // A point moved by the rounding of a large footprint, or the weight of one point, whichever is larger.
        let one = 1.0 / f64::from(n * n);
        let scale = largest_mean(a.as_dvec3(), b.as_dvec3()).max(one);
        outcome.see((found - exact).abs() / (scale * (1.0 + size)), || format!("n {n} {grid:?} c {c} a {a} b {b}"));
    })
}

fn integrated_weight() -> Outcome {
    let Ok(integrated) = estimator("integrated") else { return Outcome::default() };
    many("integrated", 40_000, |i, random, outcome| {
        let n = random.direction();
        let (long, aspect) = (random.decade(-5.0, 0.0), random.decade(0.0, if i % 2 == 0 { 2.0 } else { 6.6 }));
        let aspect = aspect.min(long / 2.4e-7).max(1.0);
        let axes = footprint(random, n, long, aspect);
        let position = (random.direction() * random.unit()).as_vec3();
        let limits = FootprintLimits { scale: 1.0, floor: crate::scene::RESOLUTION, ceiling: 1.0 };
        let photon = mapped(position, axes, n.as_vec3(), limits);
        // A view footprint on a plane up to 60° off, that meets the photon.
        let m = (n + n.any_orthonormal_vector() * random.range(0.0, 1.7)).normalize();
        let view_size = random.decade(-6.0, 1.0);
        let view_aspect = random.decade(0.0, 3.0);
        let edges = footprint(random, m, view_size, view_aspect);
        let [pa, pb] = in_plane(axes, n.as_vec3());
        let (s, t) = (random.range(-1.0, 1.0), random.range(-1.0, 1.0));
        let offset = edges[0] * random.range(-1.0, 1.0) as f32
            + edges[1] * random.range(-1.0, 1.0) as f32
            + (pa * s + pb * t).as_vec3();
        let center = position + offset;
        let found = integrated.weight(&photon, &view(center, edges, m.as_vec3(), -m.as_vec3()), 0.0) / 3.0
            * PI
            * f64::from(photon.reach()).powi(2)
            / photon.condition();
        // Exact, from what the map was given, with the floor on the shortest axis.
        let e = Ellipse::of(pa, pb);
        let lengths = e.lengths.map(|l| l.clamp(f64::from(limits.floor), f64::from(limits.ceiling)));
        let unit = n.as_vec3().as_dvec3().normalize();
        let along = e.axes[0].normalize();
        let rows = [along / lengths[0], unit.cross(along) / lengths[1], unit / lengths[0]];
        let to = |x: DVec3| DVec3::from_array(rows.map(|r| r.dot(x)));
        let (a, b) = (to(edges[0].as_dvec3()), to(edges[1].as_dvec3()));
        let c = center.as_dvec3() - position.as_dvec3();
        // Places and half-edges are known to a unit in the last place: how much that changes the mean, relatively.
        let sides = a.cross(b).length() / (a.length() * b.length());
        let condition = (c.length() + f64::from(edges[0].length()) + f64::from(edges[1].length())) / lengths[1] / sides;
        let exact = mean_over(to(c), a, b);
        let error = (found - exact).abs() / largest_mean(a, b);
        outcome.see(error / condition.max(1.0), || {
            format!("{axes:?} on {n} view {edges:?} on {m} at {c}: {found:e} for {exact:e}, condition {condition:e}")
        });
    })
}

fn coverage() -> Outcome {
    many("coverage", 20_000, |i, random, outcome| {
        let corners = [4, 3, 5, 8, 20][(i % 5) as usize];
        // Outward normals and distances of the polygon's edges.
        let (planes, normals): (_, Vec<(DVec2, f64)>) = if corners == 4 {
            let axes = [DVec2::X, DVec2::Y, DVec2::NEG_X, DVec2::NEG_Y];
            (crate::estimate::clip::square(), axes.map(|n| (n, 1.0)).to_vec())
        } else {
            let step = std::f64::consts::TAU / corners as f64;
            let at = |k: usize| (DVec2::from_angle((k as f64 + 0.5) * step), (step / 2.0).cos());
            (crate::estimate::clip::inscribed(corners), (0..corners).map(at).collect())
        };
        let size = random.decade(-6.0, 6.0);
        let a = DVec2::from_angle(random.range(0.0, 6.3)) * size;
        let b = a.perp() / random.decade(0.0, 6.0) + a * random.range(-1.0, 1.0);
        let c = match i % 3 {
            // A corner of the view footprint on an edge or on a corner of the square.
            0 => DVec2::new(1.0, random.range(-1.0, 1.0).round()) + a + b,
            1 => DVec2::from_angle(random.range(0.0, 6.3)) * random.unit() + a * random.range(-1.0, 1.0) + b,
            _ => a * random.range(-1.1, 1.1) + b * random.range(-1.1, 1.1),
        };
        let mut clipped = ClippedPolygon::<MAX_VERTICES>::whole(c, a, b);
        planes.iter().for_each(|p| clipped.clip(p));
        let (share, centroid) = clipped.coverage_and_centroid();
        let (exact, at) = covered(&normals, c, a, b);
        let largest = (PI / (4.0 * a.perp_dot(b).abs())).min(1.0);
        let place = || format!("{corners} corners, c {c} a {a} b {b}: {share:e} for {exact:e}, {centroid} for {at}");
        outcome.see((share - exact).abs() / largest, place);
        if exact > 1e-3 * largest {
            outcome.see((centroid - at).length() / 1e3, place);
        }
    })
}

fn projection() -> Outcome {
    many("projection", 60_000, |i, random, outcome| {
        let n = random.direction().as_vec3();
        let long = random.decade(-3.0, 0.0);
        let axes = footprint(random, n.as_dvec3(), long, 1.0);
        let photon = mapped(Vec3::ZERO, axes, n, OPEN);
        let tilt = if i % 4 == 0 { random.range(0.1, 1.0) } else { random.decade(-7.0, 0.0) };
        let ray = (n.as_dvec3().any_orthonormal_vector() - n.as_dvec3() * tilt).normalize().as_vec3();
        let m = random.direction();
        let size = long * random.decade(-6.0, 3.0);
        let edges = footprint(random, m, size, 1.0);
        // The line of sight through the photon's disc, and a footprint anywhere on it.
        let center = ((ray * random.range(-1.0, 1.0) as f32 * size as f32) + axes[0] * random.range(-1.0, 1.0) as f32)
            + edges[0] * random.range(-1.0, 1.0) as f32;
        let Some(found) = coplanar::Coplanar::projected(&photon, &view(center, edges, m.as_vec3(), ray)) else {
            return;
        };
        let (v, n) = (ray.as_dvec3(), n.as_dvec3().normalize());
        let [a, b] = in_plane(axes, n.as_vec3());
        for (found, x) in found.into_iter().zip([center, edges[0], edges[1]]) {
            let x = x.as_dvec3();
            let y = x - v * (n.dot(x) / n.dot(v));
            let exact = DVec2::new(y.dot(b.cross(n)) / a.dot(b.cross(n)), y.dot(n.cross(a)) / b.dot(n.cross(a)));
            // A unit in the last place of the normal or the ray moves the projection by the distance along the ray.
            let slack = (x.length() + (n.dot(x) / n.dot(v)).abs() * (1.0 + 1.0 / n.dot(v).abs())) / long;
            outcome.see((found - exact).length() / slack.max(1e-30), || {
                format!("ray {ray} normal {n} point {x}: {found} for {exact}")
            });
        }
    })
}

fn any_weight() -> Outcome {
    let extra = ["coplanar:shape=ellipse:20,weight=mean", "multi_sampled:n=5,grid=cells", "coplanar:weight=mean"];
    let names = ESTIMATORS.iter().map(|e| e.id).chain(extra);
    let all: Vec<Box<dyn Estimator>> = names.filter_map(|name| estimator(name).ok()).collect();
    many("any-weight", 40_000, |i, random, outcome| {
        let n = random.direction();
        let size = |random: &mut Random| match (random.unit() * 6.0) as u32 {
            0 => 0.0,
            _ => random.decade(-12.0, 6.0),
        };
        let some = |random: &mut Random, n: DVec3| {
            let (long, aspect) = (size(random), random.decade(0.0, 8.0));
            let mut axes = footprint(random, n, long, aspect);
            match (random.unit() * 40.0) as u32 {
                0 => axes[1] = Vec3::ZERO,
                1 => axes[0] = Vec3::NAN,
                2 => axes[1] = Vec3::INFINITY,
                3 => axes[1] = axes[0],
                _ => {}
            }
            axes
        };
        let limits = FootprintLimits { scale: 3.0, floor: crate::scene::RESOLUTION, ceiling: 1.0 };
        let photon = mapped(Vec3::ZERO, some(random, n), n.as_vec3(), limits);
        // Planes at any angle; rays that graze the photon's plane or the view's.
        let m = if i % 4 == 0 { n.any_orthonormal_vector() } else { random.direction() };
        let ray = match i % 3 {
            0 => (n.any_orthonormal_vector() - n * random.decade(-9.0, 0.0)).normalize(),
            1 => (m.any_orthonormal_vector() - m * random.decade(-9.0, 0.0)).normalize(),
            _ => random.direction(),
        };
        let edges = some(random, m).map(|e| if e.is_finite() { e } else { Vec3::ZERO });
        let center = (random.direction() * size(random)).as_vec3();
        let radius = size(random).clamp(f64::from(limits.floor), 1.0) as f32;
        let v = view(center, edges, m.as_vec3(), ray.as_vec3());
        let peak = 3.0 * f64::from(photon.inverse_area);
        for e in &all {
            let weight = e.weight(&photon, &v, radius);
            let at = || {
                format!("{}: {weight:e} of {peak:e}; reach {:e} view {edges:?} at {center}", e.name(), photon.reach())
            };
            // Density's peak is that of its own disc; published multi-sampling and centroids keep below the kernel's.
            let most = if e.lookup() == Lookup::Disc { 3.0 / (PI * f64::from(radius).powi(2)) } else { peak };
            outcome
                .see(if weight.is_nan() { f64::NAN } else { (weight / most - 1.0).max(-weight / most).max(0.0) }, at);
            let c = e.construction(&photon, &v);
            let points = c.points.iter().map(|p| p.position).chain(c.covered.iter().copied()).chain(c.centroid);
            outcome.finite(points.map(|p| if p.is_finite() { 0.0 } else { f64::NAN }), at);
            outcome.expect((0.0..=1.0).contains(&c.coverage), || format!("{}: coverage {}", e.name(), c.coverage));
        }
        let projected = coplanar::Coplanar::projected(&photon, &v);
        outcome.finite(projected.iter().flatten().flat_map(|p| p.to_array()), || format!("projected {projected:?}"));
    })
}
