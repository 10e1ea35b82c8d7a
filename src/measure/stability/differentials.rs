//! Ray differentials, operation by operation, from normal to grazing incidence and at the critical angle.

use super::case::{F32, many};
use super::oracle::dual::{Dual, Dual3};
use super::oracle::random::Random;
use super::scenes::{MIRROR, glass, meet, mesh, scene};
use super::{Case, Outcome};
use crate::math::rgb::Rgb;
use crate::photons::emission::{cosine_solid_angle, emit};
use crate::photons::spread::{self, DiffuseSpread};
use crate::scene::{Camera, Geometry, Light};
use crate::trace::scatter::{fresnel, reflected, refracted, specular_weights};
use crate::trace::{Differential, Intersector, Ray};
use glam::{DVec3, Vec3};

/// Two directions in f32 and what is made of them.
const DIRECTIONS: f64 = 4.0 * F32;
/// Distance and angle that differentials are bounded to in these cases.
const BOUND: (f32, f32) = (10.0, 10.0);

/// The group.
pub const CASES: &[Case] = &[
    Case {
        group: "differentials",
        name: "transfer",
        what: "footprint where a ray meets a plane; error relative to a column or its longest term",
        range: "incidence to 1e-7 rad above the plane; ways 1e-3 to 1e3 of the footprint",
        oracle: "dual numbers through the plane, f64",
        limit: F32,
        run: transfer,
    },
    Case {
        group: "differentials",
        name: "grazing",
        what: "length of a bounded column over its bound, less 1; what is bounded must say so",
        range: "incidence 1e-6 to 1e-40 rad and in the plane; columns up to the largest of f32, infinite, no number",
        oracle: "the bound",
        limit: F32,
        run: grazing,
    },
    Case {
        group: "differentials",
        name: "reflect",
        what: "change of a reflected direction; error relative to the changes of direction and normal",
        range: "incidence to 1e-7 rad; normals that turn 1e-4 to 1e4 times as fast as the ray",
        oracle: "dual numbers through the law of reflection, f64",
        limit: F32,
        run: reflect,
    },
    Case {
        group: "differentials",
        name: "refract",
        what: "change of a refracted direction; error relative to the most that its inputs could make",
        range: "ratios 1/3 to 3; incidence to 1e-7 rad; cosine behind the surface 1 to 1e-4, at its pole",
        oracle: "dual numbers through Snell's law, f64",
        limit: F32,
        run: refract,
    },
    Case {
        group: "differentials",
        name: "total-reflection",
        what: "reflected and refracted shares and directions; absolute error",
        range: "1e-1 to 1e-9 rad to either side of the critical angle, and at grazing incidence",
        oracle: "Fresnel's sines and tangents of both angles, f64",
        limit: DIRECTIONS,
        run: total_reflection,
    },
    Case {
        group: "differentials",
        name: "camera",
        what: "change of a view ray's direction over half a pixel; relative error of a column",
        range: "fields of view 0.001° to 179°, centre to corner, 1 to 32768 pixels",
        oracle: "dual numbers through the image plane, f64",
        limit: F32,
        run: camera,
    },
    Case {
        group: "differentials",
        name: "emission",
        what: "solid angle of a photon's footprint and its angle to the axis; relative error",
        range: "1 to 1e9 photons of a light; cones 1° to 360°, falloff 0 to 1e4; area lights to grazing emission",
        oracle: "closed forms of intensity and its integral, f64",
        limit: DIRECTIONS,
        run: emission,
    },
    Case {
        group: "differentials",
        name: "diffuse-bounce",
        what: "frame of the new directions against the nearest orthonormal one; lost alignment, relative",
        range: "footprints of aspect ratio 1 to 1e8, folded, edge-on, vanishing; cosines 1 to 0",
        oracle: "the best of all rotations in closed form, f64",
        limit: DIRECTIONS,
        run: diffuse_bounce,
    },
    Case {
        group: "differentials",
        name: "smooth-normal",
        what: "change of an interpolated normal; error relative to the gradients of the corners' normals",
        range: "triangles of aspect ratio 1 to 1e4; corner normals up to 120° apart",
        oracle: "dual numbers through the plane, barycentric weights and the unit normal, f64",
        // The weights are stored in f32.
        limit: 2.0 * F32,
        run: smooth_normal,
    },
    Case {
        group: "differentials",
        name: "horizon",
        what: "how far a specular ray dips to the wrong side; cosine to the flat normal",
        range: "shading normals up to 90° off the flat one, some of no length; incidence to 1e-7 rad",
        oracle: "the flat normal; flags against the laws of reflection and refraction, f64",
        limit: F32,
        run: horizon,
    },
];

/// A vector across the unit vector `v`, of that length.
fn across(v: DVec3, length: f64, random: &mut Random) -> Vec3 {
    (v.cross(random.direction()).normalize_or(v.any_orthonormal_vector()) * length).as_vec3()
}

/// A unit normal and a unit direction towards it that lies `grazing` rad above its surface.
fn incident(grazing: f64, random: &mut Random) -> (Vec3, Vec3) {
    let n = random.direction();
    let t = n.cross(random.direction()).normalize_or(n.any_orthonormal_vector());
    let (s, c) = libm::sincos(grazing);
    ((t * c - n * s).as_vec3(), n.as_vec3())
}

/// Both, of length 1 in f64.
fn units(v: Vec3, n: Vec3) -> (DVec3, DVec3) {
    (v.as_dvec3().normalize(), n.as_dvec3().normalize())
}

/// Angle above a surface, down to 1e-7.
fn angle(i: u64, random: &mut Random) -> f64 {
    if i.is_multiple_of(2) { random.decade(-7.0, -1.0) } else { random.range(0.05, std::f64::consts::FRAC_PI_2) }
}

fn transfer() -> Outcome {
    many("transfer", 200_000, |i, random, outcome| {
        let (v, n) = incident(angle(i, random), random);
        let (vd, nd) = units(v, n);
        if vd.dot(nd) > -1e-8 {
            return;
        }
        let s = random.decade(-3.0, 3.0) as f32;
        let dp = random.direction().as_vec3();
        let dv = across(vd, random.decade(-3.0, 3.0), random);
        let d = Differential { dp: [dp, Vec3::ZERO], dv: [dv, Vec3::ZERO] };
        let found = d.transfer(v, n, s).dp[0].as_dvec3();
        let origin = Dual3 { v: DVec3::ZERO, d: dp.as_dvec3() };
        let exact = origin.to_plane(Dual3 { v: vd, d: dv.as_dvec3() }, vd * f64::from(s), nd).d;
        let terms = (dp.as_dvec3().dot(nd).abs() + f64::from(s) * dv.as_dvec3().dot(nd).abs()) / vd.dot(nd).abs();
        outcome
            .see((found - exact).length() / exact.length().max(terms), || format!("v {v} n {n}: {found} for {exact}"));
    })
}

fn grazing() -> Outcome {
    many("grazing", 50_000, |i, random, outcome| {
        let (v, n) = incident(if i % 5 == 0 { 0.0 } else { random.decade(-40.0, -6.0) }, random);
        let odd = [f32::MAX, f32::INFINITY, f32::NEG_INFINITY, f32::NAN, 1e-45, 1.0];
        let mut d = Differential {
            dp: [random.direction().as_vec3(), Vec3::splat(odd[(i % 6) as usize])],
            dv: [across(v.as_dvec3(), random.decade(-3.0, 3.0), random), Vec3::ZERO],
        };
        let start = d;
        for (step, eta) in [(0, 1.5f32), (1, 1.0 / 1.5), (2, 1.0)] {
            let dn = [Vec3::splat(random.decade(-3.0, 30.0) as f32), Vec3::ZERO];
            d = d.transfer(v, n, random.decade(-3.0, 3.0) as f32);
            d = if step == 2 { d.reflect(v, n, dn) } else { d.refract(v, n, dn, eta) };
            let free = d;
            let said = d.bound(BOUND.0, BOUND.1);
            outcome.bounded += u64::from(said);
            let columns = || d.dp.into_iter().zip([BOUND.0; 2]).chain(d.dv.into_iter().zip([BOUND.1; 2]));
            for ((c, limit), before) in columns().zip(free.dp.into_iter().chain(free.dv)) {
                let over = c.as_dvec3().length() / f64::from(limit) - 1.0;
                outcome.see(over.max(0.0), || format!("v {v} n {n} d {start:?}: {c}"));
                let endless = !before.is_finite() && !before.is_nan();
                outcome.expect(!endless || over > -1e-6, || format!("{before} became {c}"));
                outcome.expect(said || c == before, || format!("{before} became {c} and nothing is said"));
            }
        }
    })
}

/// Changes of direction and normal over a footprint.
fn changes(v: DVec3, n: DVec3, random: &mut Random) -> (Vec3, Vec3) {
    let (dv, dn) = (random.decade(-4.0, 0.0), random.decade(-4.0, 0.0));
    (across(v, dv, random), across(n, dn, random))
}

fn reflect() -> Outcome {
    many("reflect", 200_000, |i, random, outcome| {
        let (v, n) = incident(angle(i, random), random);
        let (vd, nd) = units(v, n);
        let (dv, dn) = changes(vd, nd, random);
        let d = Differential { dp: [Vec3::ZERO; 2], dv: [dv, Vec3::ZERO] };
        let found = d.reflect(v, n, [dn, Vec3::ZERO]).dv[0].as_dvec3();
        let (dv, dn) = (dv.as_dvec3(), dn.as_dvec3());
        let exact = Dual3 { v: vd, d: dv }.reflected(Dual3 { v: nd, d: dn }).d;
        let size = dv.length() + dn.length();
        outcome.see((found - exact).length() / size, || format!("v {v} n {n}: {found} for {exact}"));
    })
}

fn refract() -> Outcome {
    many("refract", 200_000, |i, random, outcome| {
        let eta = random.range(1.0, 3.0);
        let eta = (if i % 4 < 2 { 1.0 / eta } else { eta }) as f32;
        // By the angle of incidence, or by the cosine behind the surface.
        let grazing = if eta <= 1.0 {
            angle(i, random)
        } else {
            let cos = if i.is_multiple_of(2) { random.decade(-4.0, 0.0) } else { random.unit() };
            let sin = (1.0 - cos * cos).sqrt() / f64::from(eta);
            libm::acos(sin)
        };
        let (v, n) = incident(grazing, random);
        let (vd, nd) = units(v, n);
        let (dv, dn) = changes(vd, nd, random);
        let d = Differential { dp: [Vec3::ZERO; 2], dv: [dv, Vec3::ZERO] };
        let found = d.refract(v, n, [dn, Vec3::ZERO], eta).dv[0].as_dvec3();
        let eta = f64::from(eta);
        let sin = vd.cross(nd).length() * eta;
        // The directions in f32 may lie nearer to the pole than those that were drawn, or beyond it.
        if sin * sin > 1.0 - 1e-8 {
            outcome.finite(found.to_array(), || format!("v {v} n {n} eta {eta}: {found}"));
            return;
        }
        let (dv, dn) = (dv.as_dvec3(), dn.as_dvec3());
        let exact = Dual3 { v: vd, d: dv }.refracted(Dual3 { v: nd, d: dn }, eta).d;
        let pole = 1.0 + eta * eta / (1.0 - sin * sin).sqrt();
        let size = (dv.length() + dn.length()) * pole;
        outcome.see((found - exact).length() / size, || format!("v {v} n {n} eta {eta}: {found} for {exact}"));
    })
}

/// Share that is reflected, by the angles; at normal incidence by its limit.
fn reflectance(incident: f64, eta: f64) -> f64 {
    let sin = libm::sin(incident) * eta;
    if sin >= 1.0 {
        return 1.0;
    }
    let behind = libm::asin(sin);
    let (sum, difference) = (incident + behind, incident - behind);
    if sum < 1e-6 {
        return ((1.0 - eta) / (1.0 + eta)).powi(2);
    }
    let s = libm::sin(difference) / libm::sin(sum);
    let p = libm::tan(difference) / libm::tan(sum);
    ((s * s + p * p) / 2.0).min(1.0)
}

fn total_reflection() -> Outcome {
    let quad = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]].map(|[x, z]: [f32; 2]| Vec3::new(x, 0.0, -z));
    let scene = scene(mesh(quad.into(), vec![[0, 1, 2], [0, 2, 3]]), glass(1.5), 1.0);
    let intersector = Intersector::new(&scene.geometry, scene.radius);
    let critical = libm::asin(1.0 / 1.5);
    many("total-reflection", 100_000, |i, random, outcome| {
        let side = if i.is_multiple_of(2) { 1.0 } else { -1.0 };
        let (theta, up) = match i % 8 {
            // From outside, to grazing incidence.
            6 | 7 => (std::f64::consts::FRAC_PI_2 - random.decade(-7.0, 0.1), -1.0),
            5 => (random.decade(-9.0, 0.1), 1.0),
            _ => (critical + side * random.decade(-9.0, -1.0), 1.0),
        };
        let (s, c) = libm::sincos(random.range(0.0, std::f64::consts::TAU));
        let (sin, cos) = libm::sincos(theta);
        let v = DVec3::new(sin * s, up * cos, sin * c).as_vec3();
        let target = Vec3::new(random.range(-0.5, 0.5) as f32, 0.0, random.range(-0.5, 0.5) as f32);
        let Some((_, surface)) = meet(&scene, &intersector, &Ray { origin: target - v, direction: v }) else {
            // A ray so flat that its start rounded into the plane.
            outcome.expect(v.y.abs() < 1e-6, || format!("{v} misses"));
            return;
        };
        let Some(weights) = specular_weights(&scene.materials[0], &surface, v) else {
            outcome.expect(false, || "glass is not specular".into());
            return;
        };
        let (vd, nd) = (v.as_dvec3().normalize(), surface.normal.as_dvec3());
        let eta = if up > 0.0 { f64::from(1.5f32) } else { f64::from(1.0f32 / 1.5) };
        let incident = libm::atan2(vd.cross(nd).length(), -vd.dot(nd));
        let exact = reflectance(incident, eta);
        let at = || format!("v {v}: reflected {} for {exact}", weights.reflected.x);
        outcome.see((f64::from(weights.reflected.x) - exact).abs(), at);
        outcome.see((f64::from(weights.reflected.x) + f64::from(weights.refracted.x) - 1.0).abs(), at);
        outcome.see((fresnel(-vd.dot(nd), eta as f32) - exact).abs(), at);
        let d = Differential { dp: [Vec3::X, Vec3::Z], dv: [Vec3::X, Vec3::Z] };
        let mirror = reflected(&scene, &surface, v, &d);
        let exact = DVec3::new(vd.x, -vd.y, vd.z);
        outcome.see((mirror.direction.as_dvec3() - exact).length(), || {
            format!("v {v}: reflected to {}", mirror.direction)
        });
        let through = refracted(&scene, &surface, v, &d, weights.eta);
        let root = (1.0 - (eta * libm::sin(incident)).powi(2)).max(0.0).sqrt();
        // Where the root is the rounding of its terms, so is the direction.
        if weights.refracted.x > 0.0 && root > 1e-7 {
            let exact = DVec3::new(vd.x * eta, root * up, vd.z * eta);
            let found = through.direction.as_dvec3();
            outcome.see((found - exact).length(), || format!("v {v}: refracted to {found} for {exact}"));
        }
        let mut columns = mirror.differential.dv.into_iter().chain(through.differential.dv);
        outcome.expect(columns.all(Vec3::is_finite), || format!("v {v}: {:?}", through.differential));
        outcome.expect(!mirror.beyond_horizon && !through.beyond_horizon, || format!("v {v} is beyond the horizon"));
    })
}

fn camera() -> Outcome {
    many("camera", 100_000, |i, random, outcome| {
        let forward = random.direction();
        let right = forward.cross(random.direction()).normalize_or(forward.any_orthonormal_vector());
        let up = right.cross(forward);
        let fov = if i.is_multiple_of(2) { random.range(1.0, 179.0) } else { random.decade(-3.0, 0.0) };
        let frame = [right, up, forward].map(|v| v.as_vec3());
        let size = [random.decade(0.0, 4.5) as u32 + 1, random.decade(0.0, 4.5) as u32 + 1];
        let tan_half_fov_y = libm::tan(fov.to_radians() / 2.0) as f32;
        let camera = Camera { position: Vec3::ZERO, frame, tan_half_fov_y, resolution: size };
        let (x, y) = ((random.unit() * f64::from(size[0])) as f32, (random.unit() * f64::from(size[1])) as f32);
        let half = 0.5 / (1u32 << (i % 4)) as f32;
        let (direction, d) = camera.ray(x, y, size, half);
        let [right, up, forward] = frame.map(|v| v.as_dvec3());
        let step = 2.0 * f64::from(tan_half_fov_y) / f64::from(size[1]);
        let (px, py) = (f64::from(x) - f64::from(size[0]) / 2.0, f64::from(size[1]) / 2.0 - f64::from(y));
        let at = forward + right * (px * step) + up * (py * step);
        for (axis, along) in [right, -up].into_iter().enumerate() {
            let exact = Dual3 { v: at, d: along * (step * f64::from(half)) }.normalize();
            let found = d.dv[axis].as_dvec3();
            let place = || format!("({x}, {y}) of {size:?} at {fov}°: {found} for {}", exact.d);
            outcome.see((found - exact.d).length() / exact.d.length(), place);
            outcome.see((direction.as_dvec3() - exact.v).length(), place);
        }
    })
}

fn emission() -> Outcome {
    use std::f64::consts::{PI, TAU};
    let scene = scene(mesh(Vec::new(), Vec::new()), MIRROR, 1.0);
    many("emission", 60_000, |i, random, outcome| {
        let count = random.decade(0.0, 9.0) as u64 + 1;
        let axis = random.direction().as_vec3();
        let x = [0; 4].map(|_| random.unit() as f32).map(|x| x.min(1.0 - f32::EPSILON));
        let (u, n) = (f64::from(x[0]), count as f64);
        let half = if i.is_multiple_of(2) { random.range(0.5, 180.0) } else { random.range(0.5, 2.0) }.to_radians();
        let falloff = if i % 3 == 0 { 0.0 } else { random.decade(-1.0, 4.0) as f32 };
        let light = match i % 4 {
            0 => Light::Point { position: Vec3::ZERO, power: Rgb::ONE },
            1 => Light::Quad { center: Vec3::ZERO, u: Vec3::X * 1e-12, v: Vec3::Y * 1e-13, power: Rgb::ONE },
            _ => {
                let (position, cos_half) = (Vec3::ZERO, libm::cos(half));
                Light::Spot { position, direction: axis, cos_half, falloff, power: Rgb::ONE }
            }
        };
        let sent = emit(&scene, &light, count as f64, x);
        let w = sent.direction.as_dvec3().normalize();
        let (solid_angle, exact_angle) = match i % 4 {
            0 => (4.0 * PI / n, None),
            1 => {
                let cos = w.z.max(0.01);
                outcome.bounded += u64::from(sent.bounded);
                outcome.expect(sent.bounded || w.z >= 0.0099, || format!("{w} is not counted"));
                (PI / (n * cos), None)
            }
            _ if falloff == 0.0 => {
                let versine = 2.0 * libm::sin(half / 2.0).powi(2);
                (TAU * versine / n, Some(2.0 * libm::asin((u * versine / 2.0).sqrt())))
            }
            _ => {
                let m = f64::from(falloff) + 1.0;
                let edge = libm::pow(libm::cos(half).max(0.0), m);
                let power = 1.0 - u * (1.0 - edge);
                let intensity = libm::pow(power, 1.0 - 1.0 / m);
                let versine = -libm::expm1(libm::log1p(-u * (1.0 - edge)) / m);
                let angle = 2.0 * libm::asin((versine / 2.0).sqrt());
                (TAU * (1.0 - edge) / (m * n * intensity), Some(angle))
            }
        };
        let [p, q] = sent.differential.dv.map(|c| c.as_dvec3());
        let at = || format!("{light:?} {x:?} {count}: {p} {q} along {w} for {solid_angle:e}");
        outcome.see((PI * p.length() * q.length() / solid_angle - 1.0).abs(), at);
        outcome.see(p.dot(q).abs() / (p.length() * q.length()), at);
        outcome.see(p.dot(w).abs() / p.length(), at);
        if let Some(exact) = exact_angle {
            let axis = axis.as_dvec3().normalize();
            outcome.see((libm::atan2(w.cross(axis).length(), w.dot(axis)) - exact).abs(), at);
        }
    })
}

fn diffuse_bounce() -> Outcome {
    many("diffuse-bounce", 100_000, |i, random, outcome| {
        let (w, n) = incident(angle(i, random), random);
        let w = -w;
        let size = random.decade(-20.0, 10.0);
        let (a, b) = (random.direction() * size, random.direction() * size);
        let thin = random.decade(-8.0, 0.0);
        let dp = match i % 6 {
            0 | 1 => [a, b],
            2 => [a, a * random.range(-2.0, 2.0) + b * thin],
            // Edge-on to the new ray.
            3 => [a, w.as_dvec3() * size + b * thin],
            4 => [a, DVec3::ZERO],
            _ => [DVec3::ZERO; 2],
        }
        .map(|c| c.as_vec3());
        let d = Differential { dp, dv: [Vec3::ZERO; 2] };
        let count = random.decade(0.0, 9.0) as u64 + 1;
        let cos = w.dot(n).max(0.0);
        let (next, bounded) = spread::bounce(DiffuseSpread::Polar, &d, -n, w, cos, count);
        outcome.bounded += u64::from(bounded);
        outcome.expect(bounded == (cos < 0.01) && next.dp == dp, || format!("cos {cos}: bounded {bounded}"));
        let wd = w.as_dvec3().normalize();
        let [p, q] = next.dv.map(|c| c.as_dvec3());
        let radius = (1.0 / (count as f64 * f64::from(cos.max(0.01)))).sqrt();
        let at = || format!("w {w} dp {dp:?}: {p} {q} for radius {radius}");
        for error in [p.length() / radius - 1.0, q.length() / radius - 1.0, p.dot(q) / (radius * radius)] {
            outcome.see(error.abs(), at);
        }
        outcome.see(p.dot(wd).abs().max(q.dot(wd).abs()) / radius, at);
        // Of rotations and reflections in the plane across w, the largest trace is hypot of these two.
        let (t, u) = wd.any_orthonormal_pair();
        let m = dp.map(|c| [c.as_dvec3().dot(t), c.as_dvec3().dot(u)]);
        let turned = libm::hypot(m[0][0] + m[1][1], m[0][1] - m[1][0]);
        let mirrored = libm::hypot(m[0][0] - m[1][1], m[0][1] + m[1][0]);
        let best = turned.max(mirrored);
        let found = (dp[0].as_dvec3().dot(p) + dp[1].as_dvec3().dot(q)) / radius;
        let whole = dp[0].as_dvec3().length() + dp[1].as_dvec3().length();
        if whole > 0.0 {
            outcome.see(((best - found) / whole).max(0.0), at);
        }
        let (_, edge) = cosine_solid_angle(count as f32, cos);
        outcome.expect(edge == bounded, || "the bound of emission is another".into());
    })
}

/// A triangle of that aspect ratio with a normal at each corner up to `spread` rad off the flat one.
fn smooth(aspect: f64, spread: f64, random: &mut Random) -> Geometry {
    let n = random.direction();
    let (t, b) = n.any_orthonormal_pair();
    let (s, c) = libm::sincos(random.range(0.0, std::f64::consts::TAU));
    let (x, y) = (t * c + b * s, b * c - t * s);
    let corners = [-x, x, x * random.range(-0.9, 0.9) + y / aspect].map(|p| p.as_vec3());
    let normals = [0, 1, 2].map(|_| {
        let (sin, cos) = libm::sincos(random.range(0.0, spread));
        let phi = random.range(0.0, std::f64::consts::TAU);
        (n * cos + (x * libm::cos(phi) + y * libm::sin(phi)) * sin).as_vec3()
    });
    Geometry { normals: normals.into(), corner_normals: vec![[0, 1, 2]], ..mesh(corners.into(), vec![[0, 1, 2]]) }
}

fn smooth_normal() -> Outcome {
    many("smooth-normal", 40_000, |i, random, outcome| {
        let aspect = if i.is_multiple_of(2) { random.decade(0.0, 4.0) } else { 1.0 };
        let scene = scene(smooth(aspect, std::f64::consts::FRAC_PI_3, random), MIRROR, 1.0);
        let intersector = Intersector::new(&scene.geometry, scene.radius);
        let [a, b, c] = scene.geometry.corners(0).map(|p| p.as_dvec3());
        let weights = [0.05 + 0.4 * random.unit(), 0.05 + 0.4 * random.unit()];
        let at = a + (b - a) * weights[0] + (c - a) * weights[1];
        let flat = (b - a).cross(c - a).normalize();
        let side = if i % 3 == 0 { -1.0 } else { 1.0 };
        let direction = (random.direction() * 0.3 - flat * side).normalize().as_vec3();
        let ray = Ray { origin: (at - direction.as_dvec3()).as_vec3(), direction };
        let Some((_, surface)) = meet(&scene, &intersector, &ray) else { return };
        let dq = across(flat, 1.0, random);
        // In the plane in f64: across a needle what an f32 sticks out of it is much.
        let moved = dq.as_dvec3() - flat * flat.dot(dq.as_dvec3());
        let found = surface.normal_differential(&scene, [dq, -dq])[0].as_dvec3();
        // The weights of the second and third corner as dual numbers, where the ray meets the plane.
        let (e1, e2) = (b - a, c - a);
        let v = direction.as_dvec3();
        let start = Dual3 { v: ray.origin.as_dvec3(), d: moved };
        let hit = start.to_plane(Dual3::from(v), a, flat) - Dual3::from(a);
        let twice = e1.cross(e2);
        let over = Dual::from(1.0 / twice.length_squared());
        let weight = |row: DVec3| hit.dot(Dual3::from(row)) * over;
        let (wb, wc) = (weight(e2.cross(twice)), weight(twice.cross(e1)));
        let [na, nb, nc] = [0, 1, 2].map(|k| Dual3::from(scene.geometry.normals[k].as_dvec3()));
        let sum = na * (Dual::from(1.0) - wb - wc) + nb * wb + nc * wc;
        let sign = sum.v.dot(surface.shading.as_dvec3()).signum();
        let exact = sum.normalize().d * sign;
        let gradient = (nb.v - na.v).length() * wb.d.abs() + (nc.v - na.v).length() * wc.d.abs();
        let size = gradient / sum.v.length_squared();
        let place = || format!("aspect {aspect:.0} weights {weights:?}: {found} for {exact}");
        outcome.see((found - exact).length() / size, place);
        let unit = sum.v.normalize() * sign;
        outcome.see((surface.shading.as_dvec3() - unit).length() * sum.v.length() / 2.0, place);
    })
}

fn horizon() -> Outcome {
    many("horizon", 60_000, |i, random, outcome| {
        let mut geometry = smooth(1.0, std::f64::consts::FRAC_PI_2, random);
        let cancels = i % 7 == 0;
        if cancels {
            // At the middle of an edge, two opposite normals.
            geometry.normals[1] = -geometry.normals[0];
        }
        let material = if i.is_multiple_of(2) { MIRROR } else { glass(1.5) };
        let scene = scene(geometry, material, 1.0);
        let intersector = Intersector::new(&scene.geometry, scene.radius);
        let [a, b, c] = scene.geometry.corners(0).map(|p| p.as_dvec3());
        let (wb, wc) = if cancels { (0.5, 0.0) } else { (0.4 * random.unit(), 0.5 * random.unit()) };
        let at = a + (b - a) * wb + (c - a) * wc;
        let flat = (b - a).cross(c - a).normalize() * if i % 4 < 2 { 1.0 } else { -1.0 };
        let (sin, cos) = libm::sincos(angle(i / 4, random));
        let along = flat.cross(random.direction()).normalize_or(flat.any_orthonormal_vector());
        let v = (along * cos - flat * sin).as_vec3();
        let Some((_, surface)) =
            meet(&scene, &intersector, &Ray { origin: (at - v.as_dvec3()).as_vec3(), direction: v })
        else {
            return;
        };
        let d = Differential { dp: [Vec3::X, Vec3::Y], dv: [Vec3::X, Vec3::Y] };
        let n = surface.normal.as_dvec3();
        let place = || format!("v {v} normal {n} shading {}", surface.shading);
        outcome.expect(surface.shading.is_finite() && surface.shading.dot(surface.normal) >= -1e-6, place);
        outcome.expect(!surface.without_shading || surface.shading == surface.normal, place);
        let Some(weights) = specular_weights(&scene.materials[0], &surface, v) else { return };
        let shares = weights.reflected.x + weights.refracted.x;
        outcome.expect((shares - 1.0).abs() < 1e-6, || format!("shares {shares}"));
        let (vd, sd) = units(v, surface.shading);
        let mirror = reflected(&scene, &surface, v, &d);
        let towards = vd.dot(sd) < 0.0;
        let clear = vd.dot(sd).abs() > 1e-6;
        let expected = (vd - sd * (2.0 * vd.dot(sd))).dot(n);
        let mut rays = vec![(mirror, 1.0, expected)];
        if weights.refracted.x > 0.0 {
            let (eta, vs) = (f64::from(weights.eta), vd.dot(sd));
            let root = (1.0 - eta * eta * (1.0 - vs * vs)).max(0.0).sqrt();
            let expected = (sd * (eta * vs + root) - vd * eta).dot(n);
            rays.push((refracted(&scene, &surface, v, &d, weights.eta), -1.0, expected));
        }
        for (ray, side, expected) in rays {
            outcome.bounded += u64::from(ray.beyond_horizon);
            outcome.see((-ray.direction.as_dvec3().dot(n) * side).max(0.0), place);
            outcome.expect((ray.origin - surface.position).dot(surface.normal) * (side as f32) > 0.0, || {
                format!("{} starts on the wrong side", place())
            });
            // A cosine that is rounding may be judged either way.
            let beyond = (!towards || expected <= 0.0) && surface.shading != surface.normal;
            let judged = clear && (!towards || expected.abs() > 1e-6);
            outcome.expect(ray.beyond_horizon == beyond || !judged, || {
                format!("{} is flagged {} at {expected}", place(), ray.beyond_horizon)
            });
            outcome.expect(ray.without_shading == surface.without_shading, place);
            let finite = ray.differential.dv.into_iter().chain(ray.differential.dp).all(Vec3::is_finite);
            outcome.expect(finite && ray.direction.is_finite(), || format!("{}: {:?}", place(), ray.differential));
        }
    })
}
