//! Powers that are tiny, huge, or both; nothing absorbed, or all.

use super::case::F32;
use super::setup::{ALL, BEAM, built_in, finite_films, outcome, rendered, scene};
use super::{Case, Outcome};
use crate::math::rgb::Rgb;
use crate::math::sequence::{Sampling, Sequence};
use crate::photons::StoredPhoton;
use crate::photons::emission::share_photons;
use crate::render::settings::{DirectLight, LightPart, PlanMode};
use crate::scene::{Light, Material, Scene};
use std::f64::consts::PI;
use std::sync::Arc;

/// The group.
pub const CASES: &[Case] = &[
    Case {
        group: "powers",
        name: "linear-in-power",
        what: "image over power; error relative to the brightest pixel",
        range: "1e-20 to 1e20 W, all light of glass and diffuse bounces",
        oracle: "the image at 1 W",
        limit: 4.0 * F32,
        run: linear_in_power,
    },
    Case {
        group: "powers",
        name: "unequal-lights",
        what: "radiance of a floor that only the dim one of two lights reaches; relative error",
        range: "1e-20 W beside 1e20 W, and 1 W beside 1e9 W",
        oracle: "E = Φ cos θ/(4π r²), f64",
        limit: 1e-5,
        run: unequal_lights,
    },
    Case {
        group: "powers",
        name: "dim-share",
        what: "power that photons carry from a light, the mean over 2,000 seeds; relative error",
        range: "lights of 1 and 1e9 W, 1e-20 and 1e20 W; 10 to 10,000 photons",
        oracle: "the light's flux",
        limit: 1e-2,
        run: dim_share,
    },
    Case {
        group: "powers",
        name: "black",
        what: "radiance of what reflects nothing, and photons after a bounce; absolute",
        range: "cornell with every reflectance 0",
        oracle: "none",
        limit: 0.0,
        run: black,
    },
    Case {
        group: "powers",
        name: "white-box",
        what: "power stored at each bounce, and ended by the bounce limit; relative error",
        range: "closed box of reflectance 1, bounce limits 2, 20 and 1000",
        oracle: "the light's flux",
        limit: 1e-6,
        run: white_box,
    },
    Case {
        group: "powers",
        name: "beyond-f32",
        what: "pixels beyond f32 that are not counted; share of all",
        range: "1e30 W a micrometre off the floor",
        oracle: "every pixel is beyond",
        limit: 0.0,
        run: beyond_f32,
    },
];

fn linear_in_power() -> Outcome {
    outcome(|out| {
        let base = built_in("glass_ball")?;
        let image = |power: f32| -> Result<_, String> {
            let mut scene = base.clone();
            scene.lights.iter_mut().for_each(|l| scale_power(l, power));
            let r = rendered(&Arc::new(scene), [32, 24], "density,coplanar,multi_sampled,integrated", 2, |s| {
                (s.photons, s.direct) = (5_000, DirectLight::Photons);
            })?;
            Ok(r.films().iter().map(|f| f.image()).collect::<Vec<_>>())
        };
        let ones = image(1.0)?;
        for power in [1e-20f32, 1e-10, 1e-3, 1e10, 1e20] {
            for (e, (one, scaled)) in ones.iter().zip(image(power)?).enumerate() {
                let brightest = one.pixels.iter().map(|p| f64::from(p.max_element())).fold(0.0, f64::max);
                for (p, q) in one.pixels.iter().zip(&scaled.pixels) {
                    let error = (q.as_dvec3() / f64::from(power) - p.as_dvec3()).abs().max_element() / brightest;
                    out.see(error, || format!("estimator {e}, {power:e} W: {q} for {p} at 1 W"));
                }
            }
        }
        Ok(())
    })
}

fn scale_power(light: &mut Light, factor: f32) {
    match light {
        Light::Point { power, .. }
        | Light::Sphere { power, .. }
        | Light::Quad { power, .. }
        | Light::Spot { power, .. } => *power *= factor,
        Light::Directional { irradiance, .. } => *irradiance *= factor,
        Light::Mesh { radiance, .. } => *radiance *= factor,
    }
}

/// Two floors with a wall between them, a lamp over each; the camera sees the left one from above.
fn two_rooms(left: f64, right: f64) -> Result<Arc<Scene>, String> {
    let quad = |center: [f64; 3], u: [f64; 3], v: [f64; 3]| {
        format!("[[shapes]]\nkind = \"quad\"\ncenter = {center:?}\nu = {u:?}\nv = {v:?}\nmaterial = \"grey\"\n")
    };
    let lamp = |x: f64, power: f64| {
        format!(
            "[[lights]]\nkind = \"point\"\nposition = [{x:?}, 1.0, 0.1]\npower = [{power:e}, {power:e}, {power:e}]\n"
        )
    };
    let text = [
        "[camera]\nposition = [-1.0, 3.0, 0.0]\ntarget = [-1.0, 0.0, 0.0]\nup = [0.0, 0.0, -1.0]\nfov_y = 20.0\n"
            .into(),
        "resolution = [8, 8]\n[materials.grey]\nkind = \"diffuse\"\nreflectance = [0.5, 0.5, 0.5]\n".into(),
        quad([0.0, 0.0, 0.0], [4.0, 0.0, 0.0], [0.0, 0.0, -4.0]),
        // As high and as wide as it must be to shade all that the camera sees.
        quad([0.0, 5.0, 0.0], [0.0, 5.0, 0.0], [0.0, 0.0, 4.0]),
        lamp(-1.2, left),
        lamp(1.2, right),
    ]
    .concat();
    scene(&text).map(Arc::new).map_err(|e| e.to_string())
}

fn unequal_lights() -> Outcome {
    outcome(|out| {
        for (dim, bright) in [(1e-20, 1e20), (1.0, 1e9), (1e20, 1e-20), (1e-3, 0.0)] {
            let scene = two_rooms(dim, bright)?;
            let r = rendered(&scene, [8, 8], "integrated", 1, |s| (s.photons, s.light) = (1000, LightPart::Direct))?;
            finite_films(&r, out);
            let Some(pass) = r.last_pass() else { return Err("no pass".into()) };
            let (image, camera) = (r.films()[0].image(), &pass.scene.camera);
            // The local origin is not the file's.
            let lamp = glam::DVec3::new(-1.2, 1.0, 0.1) - pass.scene.origin;
            let floor = -pass.scene.origin.y;
            for (i, p) in image.pixels.iter().enumerate() {
                let (v, _) = camera.ray((i % 8) as f32 + 0.5, (i / 8) as f32 + 0.5, [8, 8], 0.5);
                let (o, v) = (camera.position.as_dvec3(), v.as_dvec3());
                let x = o + v * ((floor - o.y) / v.y);
                let d = lamp - x;
                let exact = 0.5 / PI * dim * d.y / (4.0 * PI * d.length().powi(3));
                out.see((f64::from(p.x) / exact - 1.0).abs(), || {
                    format!("{dim:e} W beside {bright:e} W, pixel {i}: {p}")
                });
            }
        }
        Ok(())
    })
}

fn dim_share() -> Outcome {
    outcome(|out| {
        for (left, right) in [(1.0, 1e9), (1e-20, 1e20), (3.0, 7.0)] {
            let scene = two_rooms(left, right)?;
            for photons in [10, 333, 10_000] {
                let mut carried = [0.0f64; 2];
                let seeds = 2000;
                for seed in 0..seeds {
                    for share in share_photons(&scene, photons, &Sequence::new(Sampling::Random, seed)) {
                        carried[share.light] += share.count as f64 * f64::from(share.power.x) / seeds as f64;
                    }
                }
                for (carried, flux) in carried.into_iter().zip([left, right]) {
                    out.see((carried / flux - 1.0).abs(), || format!("{photons} photons, {flux:e} W: {carried:e}"));
                }
            }
        }
        Ok(())
    })
}

fn black() -> Outcome {
    outcome(|out| {
        let mut scene = built_in("cornell")?;
        for material in &mut scene.materials {
            if let Material::Diffuse { reflectance, texture } = material {
                (*reflectance, *texture) = (Rgb::ZERO, None);
            }
        }
        let r = rendered(&Arc::new(scene), [16, 16], ALL, 2, |s| {
            (s.photons, s.direct) = (5_000, DirectLight::Photons);
        })?;
        finite_films(&r, out);
        out.expect(r.stored().global == 0, || format!("{} photons bounced", r.stored().global));
        // The lamp itself is seen; all else is black.
        for (film, e) in r.films().iter().zip(r.estimators()) {
            let lamp = r.scene().lights.iter().map(|l| f64::from(l.radiance().max_element())).fold(0.0, f64::max);
            for (i, p) in film.image().pixels.iter().enumerate() {
                let value = f64::from(p.max_element());
                let own = if value > 0.01 * lamp { 0.0 } else { value };
                out.see(own, || format!("{}, pixel {i}: {p}", e.name()));
            }
        }
        Ok(())
    })
}

/// A closed cube of reflectance 1 with a lamp in it.
const WHITE_BOX: &str = r#"
[camera]
position = [0.0, 0.0, 0.4]
target = [0.0, 0.0, -0.5]
up = [0.0, 1.0, 0.0]
fov_y = 60.0
resolution = [8, 8]
[materials.white]
kind = "diffuse"
reflectance = [1.0, 1.0, 1.0]
[[shapes]]
kind = "box"
half_size = [0.5, 0.5, 0.5]
material = "white"
[[lights]]
kind = "point"
position = [-0.2, 0.1, -0.1]
power = [5.0, 5.0, 5.0]
"#;

fn white_box() -> Outcome {
    outcome(|out| {
        let scene = Arc::new(scene(WHITE_BOX).map_err(|e| e.to_string())?);
        for depth in [2u32, 20, 1000] {
            let photons = if depth == 1000 { 20 } else { 2_000 };
            let r = rendered(&scene, [8, 8], "density,integrated", 1, |s| {
                (s.photons, s.max_depth, s.direct) = (photons, depth, DirectLight::Photons);
                // A pilot follows many more photons.
                s.plan = PlanMode::Full;
            })?;
            finite_films(&r, out);
            let Some(pass) = r.last_pass() else { return Err("no pass".into()) };
            let power = |photons: &[StoredPhoton]| photons.iter().map(|p| f64::from(p.power.x)).sum::<f64>();
            let at = |what: &str, found: f64, exact: f64| format!("bounce limit {depth}, {what}: {found} for {exact}");
            let stored = &pass.photons.stored;
            let bounces = f64::from(depth - 1);
            for (what, found, exact) in [
                ("direct", power(&stored.direct), 5.0),
                ("global", power(&stored.global), 5.0 * bounces),
                ("cut off", r.bounded().cut_off_power, 5.0),
            ] {
                out.see((found - exact).abs() / exact.max(1.0), || at(what, found, exact));
            }
            out.expect(r.bounded().photons.depth == photons, || {
                at("paths", r.bounded().photons.depth as f64, photons as f64)
            });
            out.bounded += r.bounded().photons.depth;
        }
        Ok(())
    })
}

fn beyond_f32() -> Outcome {
    outcome(|out| {
        let text = BEAM
            .replace(
                "kind = \"spot\"\nposition = [0.0, 1e-5, 0.0]\ndirection = [0.0, -1.0, 0.0]\ncone = 1.0\nfalloff = 0.0",
                "kind = \"point\"\nposition = [0.0, 1e-6, 0.0]",
            )
            .replace("power = [7.0, 7.0, 7.0]", "power = [1e30, 1e30, 1e30]");
        // In micrometres, so that all of the floor is that near.
        let small = text
            .replace("[0.0, 4.0, 0.0]", "[0.0, 4e-6, 0.0]")
            .replace("[4.0, 0.0, 0.0]", "[4e-6, 0.0, 0.0]")
            .replace("-4.0]", "-4e-6]");
        let scene = Arc::new(scene(&small).map_err(|e| e.to_string())?);
        for direct in [DirectLight::ShadowRays, DirectLight::Photons] {
            let r = rendered(&scene, [16, 16], "integrated", 1, |s| (s.photons, s.direct) = (100_000, direct))?;
            finite_films(&r, out);
            let pixels = r.films()[0].image().pixels;
            let beyond = pixels.iter().filter(|p| p.max_element() == f32::MAX).count() as f64;
            let counted = r.bounded().overflow as f64;
            out.bounded += r.bounded().overflow;
            out.expect(counted > 0.0, || "none is beyond".into());
            out.see((beyond - counted).abs() / pixels.len() as f64, || {
                format!("{direct:?}: {beyond} beyond, {counted} counted")
            });
        }
        Ok(())
    })
}
