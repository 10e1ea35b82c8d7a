//! `realtime-figure-6.1` to `6.9`: the paper's pictures.

use super::panels::{Against, Panel, Shown, csv, draw, make, picture, reference, still, text};
use super::{origin, parameters, rooms};
use crate::cli::failure::Failure;
use crate::cli::paper::PaperFlags;
use crate::cli::paper::output::{Done, Origin};
use crate::cli::progress::bar;
use crate::estimate::registry::estimators;
use crate::measure::Mask;
use crate::realtime::RealtimeSettings;
use crate::render::{RenderSettings, Renderer, Silent};
use crate::scene::scene_file::RenderFile;
use crate::scene::{Camera, Light, Scene, open};
use glam::Vec3;
use serde::Serialize;
use std::path::Path;
use std::sync::Arc;

/// Pixels of pictures of the box: those of its reference.
const BOX: [u32; 2] = [256, 256];
/// Pixels of pictures of the level.
const LEVEL: [u32; 2] = [320, 240];
/// What the box is lit with throughout.
const IN_THE_BOX: [&str; 3] = ["mesh_refinement=20000", "accumulation_frames=10", "max_search_count=80"];

#[derive(Serialize)]
struct Report<'a> {
    #[serde(flatten)]
    origin: &'a Origin,
    printed: &'a str,
    pictures: &'a [Shown],
}

/// A figure: what it is called, what the paper says of it, and how its pictures are made.
struct Figure<'a> {
    item: &'static str,
    source: &'static str,
    title: &'a str,
    printed: &'a str,
}

fn panel<'a>(title: &'a str, common: &[&str], own: &[&str]) -> Panel<'a> {
    Panel { title, set: common.iter().chain(own).map(|s| (*s).to_owned()).collect() }
}

fn finish(
    f: &Figure,
    scene: &Scene,
    flags: &PaperFlags,
    folder: &Path,
    shown: &[Shown],
    against: Option<&Against>,
) -> Result<Done, Failure> {
    let size = shown.first().map_or(BOX, |s| s.image.size);
    let origin = origin(f.item, f.source, scene, flags, size)?;
    let picture = draw(f.title, shown, against, &origin);
    let mut table = text(shown);
    table += &format!("\nprinted: {}\n", f.printed);
    if let Some(a) = against {
        table += &format!("errors: relative RMSE of means over 8×8 pixels against the {}\n", a.name);
    }
    origin.write(
        folder,
        &picture,
        &csv(shown),
        &Report { origin: &origin, printed: f.printed, pictures: shown },
        &table,
    )
}

/// Pictures of the Cornell box against its reference.
fn in_the_box(f: &Figure, panels: &[Panel], flags: &PaperFlags, folder: &Path) -> Result<Done, Failure> {
    let scene = Arc::new(open("cornell")?);
    let size = flags.size.unwrap_or(BOX);
    let against = reference("cornell", size);
    let progress = bar(1, f.item, flags.quiet || flags.json);
    let shown = make(&scene, flags, &scene.camera, size, panels, against.as_ref())?;
    progress.finish_and_clear();
    finish(f, &scene, flags, folder, &shown, against.as_ref())
}

/// The box with and without the sphere slice.
///
/// # Errors
/// A wrong flag, or a file that cannot be written; so for all figures.
pub fn run_1(item: &'static str, flags: &PaperFlags, folder: &Path) -> Result<Done, Failure> {
    let common = [
        &IN_THE_BOX[..],
        &[
            "photons_from_light=700",
            "scattering=roulette",
            "recursion_depth=20",
            "diffuse_reflections=3",
            "max_search_radius=0.3",
            "incoming_direction=false",
        ],
    ]
    .concat();
    let f = Figure {
        item,
        source: "Kristensen and Ottosen 2003, figure 6.1",
        title: "The Cornell box with and without the sphere slice",
        printed: "with a large radius the slice removes surface leaking; 20,000 photons in figure 4.4",
    };
    let panels = [
        panel("sphere slice", &common, &["sphere_slice=true"]),
        panel("sphere", &common, &["sphere_slice=false"]),
        panel("slice and hull", &common, &["sphere_slice=true", "area=hull"]),
    ];
    in_the_box(&f, &panels, flags, folder)
}

/// Directions of emission.
///
/// # Errors
/// As [`run_1`].
pub fn run_2(item: &'static str, flags: &PaperFlags, folder: &Path) -> Result<Done, Failure> {
    let common = [&IN_THE_BOX[..], &["photons_from_light=400", "recursion_depth=0", "max_search_radius=0.2"]].concat();
    let f = Figure {
        item,
        source: "Kristensen and Ottosen 2003, figure 6.2",
        title: "Directions of emission, direct light alone",
        printed: "Saff-Kuijlaars is much better than naive rejection sampling; quasi-random sequences were not made",
    };
    let panels = [
        panel("saff_kuijlaars", &common, &["light_distribution=saff_kuijlaars"]),
        panel("rejection", &common, &["light_distribution=rejection"]),
        panel("spiral", &common, &["light_distribution=spiral"]),
        panel("stratified", &common, &["light_distribution=stratified"]),
        panel("sobol", &common, &["light_distribution=sobol"]),
    ];
    // Direct light alone has no reference: against itself with many photons.
    let scene = Arc::new(open("cornell")?);
    let size = flags.size.unwrap_or(BOX);
    let many = [&common[..], &["photons_from_light=40000", "max_search_count=2000"]].concat();
    let against = dense(&scene, flags, size, &many, "engine with a hundred times the photons")?;
    let shown = make(&scene, flags, &scene.camera, size, &panels, Some(&against))?;
    finish(&f, &scene, flags, folder, &shown, Some(&against))
}

/// The engine with many photons as a reference of its own.
fn dense(
    scene: &Arc<Scene>,
    flags: &PaperFlags,
    size: [u32; 2],
    texts: &[&str],
    name: &str,
) -> Result<Against, Failure> {
    let settings = parameters(scene, flags, texts)?;
    let image = still(scene, settings, &scene.camera, size);
    Ok(Against { image, mask: Mask::all(size), name: name.into() })
}

/// The box by the progressive renderer, with all light and with direct light.
///
/// # Errors
/// As [`run_1`].
pub fn run_3(item: &'static str, flags: &PaperFlags, folder: &Path) -> Result<Done, Failure> {
    let scene = Arc::new(open("cornell")?);
    let size = flags.size.unwrap_or(BOX);
    let against = reference("cornell", size);
    let mut shown = Vec::new();
    for (title, light, estimator) in [
        ("density, 80 photons", "all", "density"),
        ("integrated", "all", "integrated"),
        ("direct light alone", "direct", "integrated"),
    ] {
        let render = RenderFile {
            photons: Some(flags.photons.unwrap_or(250_000)),
            light: Some(light.into()),
            k: Some(80),
            ..RenderFile::default()
        };
        let settings = RenderSettings::new(&scene, &render, Some(size), flags.seed.unwrap_or(1))?;
        let chosen = estimators(estimator).map_err(|e| Failure::Call(e.to_string()))?;
        let mut renderer = Renderer::new(Arc::clone(&scene), settings, chosen);
        renderer.step(&Silent);
        let Some(image) = renderer.films().first().map(|f| f.image()) else { continue };
        let error = against.as_ref().filter(|_| light == "all").and_then(|a| a.error(&image));
        shown.push(Shown {
            title: title.into(),
            set: vec![format!("light={light}"), format!("estimator={estimator}")],
            frames_per_second: None,
            last: None,
            relative_rmse: error.map(|e| e.0),
            mean_ratio: error.map(|e| e.1),
            image,
        });
    }
    let f = Figure {
        item,
        source: "Kristensen and Ottosen 2003, figure 6.3",
        title: "The Cornell box by photon mapping in every pixel",
        printed: "RenderPark with 250,000 photons, 80 of them in an estimate: all light, and direct light alone",
    };
    finish(&f, &scene, flags, folder, &shown, against.as_ref())
}

/// Final gathering, with direct light in the map and without.
///
/// # Errors
/// As [`run_1`].
pub fn run_4(item: &'static str, flags: &PaperFlags, folder: &Path) -> Result<Done, Failure> {
    let common = [
        "mesh_refinement=6000",
        "final_gathering=true",
        "final_gathering_rays=625",
        "photons_from_light=250",
        "diffuse_reflections=3",
        "accumulation_frames=10",
        "max_search_radius=0.3",
    ];
    let f = Figure {
        item,
        source: "Kristensen and Ottosen 2003, figure 6.4",
        title: "Final gathering: 625 rays from each vertex",
        printed: "10,000 photons, 625 rays; no shadows; corners have a problem that is not resolved",
    };
    let panels = [
        panel("direct light in the map", &common, &["store_direct_light=true"]),
        panel("indirect light alone", &common, &["store_direct_light=false"]),
    ];
    // Light straight from the lamp is not gathered, so that no reference shows the same.
    let scene = Arc::new(open("cornell")?);
    let size = flags.size.unwrap_or(BOX);
    let shown = make(&scene, flags, &scene.camera, size, &panels, None)?;
    finish(&f, &scene, flags, folder, &shown, None)
}

/// The number of emitted photons for which a frame takes about `seconds`, by proportion to one that was measured.
fn budget(scene: &Arc<Scene>, s: &RealtimeSettings, size: [u32; 2], seconds: f64) -> u32 {
    let mut settings = s.clone();
    for _ in 0..2 {
        let (_, _, took) = picture(scene, settings.clone(), &scene.camera, size, 1.0);
        let next = f64::from(settings.photons_from_light) * seconds / took.max(1e-9);
        settings.photons_from_light = next.clamp(1.0, 2e5) as u32;
    }
    settings.photons_from_light
}

fn at_two_rates(
    f: &Figure,
    common: &[&str],
    flags: &PaperFlags,
    folder: &Path,
    all_light: bool,
) -> Result<Done, Failure> {
    let scene = Arc::new(open("cornell")?);
    let size = flags.size.unwrap_or(BOX);
    let start = parameters(&scene, flags, common)?;
    let against = if all_light { reference("cornell", size) } else { None };
    let mut panels = Vec::new();
    // A frame of a second would be long to measure ten of them: half of one.
    for (title, seconds) in [("about 20 frames a second", 0.05), ("about 2 frames a second", 0.5)] {
        // The flag is what a frame at the higher rate emits; the lower one has ten times as many.
        let emitted = match flags.photons {
            Some(p) => (p as f64 * seconds / 0.05).clamp(1.0, 2e5) as u32,
            None => budget(&scene, &start, size, seconds),
        };
        let photons = format!("photons_from_light={emitted}");
        panels.push(panel(title, common, &[&photons]));
    }
    let shown = make(&scene, flags, &scene.camera, size, &panels, against.as_ref())?;
    finish(f, &scene, flags, folder, &shown, against.as_ref())
}

/// Colour bleeding, fast and slow.
///
/// # Errors
/// As [`run_1`].
pub fn run_5(item: &'static str, flags: &PaperFlags, folder: &Path) -> Result<Done, Failure> {
    let common =
        [&IN_THE_BOX[..], &["photons_from_light=1000", "diffuse_reflections=4", "max_search_radius=0.2", "area=hull"]]
            .concat();
    let f = Figure {
        item,
        source: "Kristensen and Ottosen 2003, figure 6.5",
        title: "Colour bleeding with one diffuse reflection",
        printed: "20 frames per second give results similar to 1 frame per second",
    };
    at_two_rates(&f, &common, flags, folder, true)
}

/// Soft shadows: direct light alone, fast and slow.
///
/// # Errors
/// As [`run_1`].
pub fn run_6(item: &'static str, flags: &PaperFlags, folder: &Path) -> Result<Done, Failure> {
    let common =
        [&IN_THE_BOX[..], &["photons_from_light=2000", "recursion_depth=0", "max_search_radius=0.2", "area=hull"]]
            .concat();
    let f = Figure {
        item,
        source: "Kristensen and Ottosen 2003, figure 6.6",
        title: "Soft shadows: direct light alone is stored",
        printed: "20 and 1 frames per second; shadows slightly softer than they should be",
    };
    at_two_rates(&f, &common, flags, folder, false)
}

/// The level from above with a spot light from its middle to the roof, which is culled.
fn lit_from_below() -> Result<(Arc<Scene>, Camera), Failure> {
    let mut scene = (*rooms()?).clone();
    scene.motions.clear();
    let floor = scene.geometry.positions.iter().map(|p| p.y).fold(f32::INFINITY, f32::min);
    scene.lights = vec![Light::Spot {
        // Above the box that stands there.
        position: Vec3::new(0.0, floor + 1.8, 0.0),
        direction: Vec3::Y,
        cos_half: libm::cos(0.7),
        falloff: 0.0,
        power: Vec3::splat(400.0),
    }];
    let camera = Camera {
        position: Vec3::new(0.0, 17.0, 9.0),
        frame: {
            let forward = Vec3::new(0.0, -17.0, -9.0).normalize();
            [Vec3::X, Vec3::X.cross(forward), forward]
        },
        tan_half_fov_y: 0.45,
        ..scene.camera
    };
    Ok((Arc::new(scene), camera))
}

fn refinement(f: &Figure, triangles: &[u32], flags: &PaperFlags, folder: &Path) -> Result<Done, Failure> {
    let (scene, camera) = lit_from_below()?;
    let size = flags.size.unwrap_or(LEVEL);
    let base = scene.geometry.triangles.len() as u32;
    // 3200 photons in the map: the indirect ones alone reach what is seen.
    let common = [
        "photons_from_light=32",
        "diffuse_reflections=9",
        "accumulation_frames=10",
        "store_direct_light=true",
        "light_distribution=rejection",
        "diffuse_distribution=rejection",
        "cull_back_faces=true",
        "max_search_radius=1.2",
    ];
    let many = [
        &common[..],
        &[
            "photons_from_light=5000",
            "mesh_refinement=60000",
            "max_search_count=1000",
            "light_distribution=sobol",
            "diffuse_distribution=sobol",
        ],
    ]
    .concat();
    let dense = parameters(&scene, flags, &many)?;
    let image = still(&scene, dense, &camera, size);
    let against =
        Against { image, mask: Mask::all(size), name: "engine with 60,000 triangles and 500,000 photons".into() };
    let titles: Vec<String> = triangles.iter().map(|t| format!("{t} triangles")).collect();
    let panels: Vec<Panel> = triangles
        .iter()
        .zip(&titles)
        .map(|(t, title)| panel(title, &common, &[&format!("mesh_refinement={}", t.saturating_sub(base))]))
        .collect();
    let shown = make(&scene, flags, &camera, size, &panels, Some(&against))?;
    finish(f, &scene, flags, folder, &shown, Some(&against))
}

/// Indirect light in the level: 1,600 and 3,200 triangles.
///
/// # Errors
/// As [`run_1`].
pub fn run_7(item: &'static str, flags: &PaperFlags, folder: &Path) -> Result<Done, Failure> {
    let f = Figure {
        item,
        source: "Kristensen and Ottosen 2003, figure 6.7",
        title: "Indirect light in the level, coarse meshes",
        printed: "3,200 photons: speckled, and twice the triangles change little",
    };
    refinement(&f, &[1600, 3200], flags, folder)
}

/// The same with 6,400 and 12,800 triangles.
///
/// # Errors
/// As [`run_1`].
pub fn run_8(item: &'static str, flags: &PaperFlags, folder: &Path) -> Result<Done, Failure> {
    let f = Figure {
        item,
        source: "Kristensen and Ottosen 2003, figure 6.8",
        title: "Indirect light in the level, fine meshes",
        printed: "3,200 photons: from 6,400 to 12,800 triangles the impact is large",
    };
    refinement(&f, &[6400, 12_800], flags, folder)
}

/// The flashlight, with and without the estimate cache.
///
/// # Errors
/// As [`run_1`].
pub fn run_9(item: &'static str, flags: &PaperFlags, folder: &Path) -> Result<Done, Failure> {
    let scene = rooms()?;
    let size = flags.size.unwrap_or(LEVEL);
    let refined = format!("mesh_refinement={}", 10_369 - scene.geometry.triangles.len());
    let common =
        [refined.as_str(), "flashlight=true", "photons_from_light=100", "diffuse_reflections=9", "max_search_count=50"];
    let panels = [
        panel("estimate cache", &common, &[]),
        panel("no estimate cache", &common, &["estimate_cache=false"]),
        panel("ten times the photons, hull", &common, &["photons_from_light=1000", "area=hull"]),
    ];
    let shown = make(&scene, flags, &scene.camera, size, &panels, None)?;
    let f = Figure {
        item,
        source: "Kristensen and Ottosen 2003, figure 6.9",
        title: "The flashlight: 10,369 triangles, 100 photons a frame, 9 reflections each",
        printed: "30 frames per second, 21 without the estimate cache",
    };
    finish(&f, &scene, flags, folder, &shown, None)
}
