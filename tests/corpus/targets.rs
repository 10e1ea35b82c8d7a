//! What the fuzz targets do with an input, and what must hold. The test that replays the corpus calls the same.
//!
//! Each function returns what the input was refused for, if it was; a panic is a finding.

use cusp::estimate::registry::estimators;
use cusp::export::report::RenderReport;
use cusp::export::session::Session;
use cusp::photons::PhotonKind;
use cusp::render::inspect::inspect;
use cusp::render::settings::PlanMode;
use cusp::render::{RenderSettings, Renderer, Silent};
use cusp::scene::load::{scene_from_map, scene_from_obj, scene_from_toml};
use cusp::scene::scene_file::RenderFile;
use cusp::scene::source::Files;
use cusp::scene::{Light, Scene};
use glam::Vec3;
use std::collections::BTreeMap;
use std::path::Path;

/// Pixels across and down.
const SIZE: [u32; 2] = [4, 4];
/// Photons of a pass.
const PHOTONS: i64 = 64;
/// Triangles and spheres up to which a scene is rendered; more would only be slow.
const SMALL: usize = 600;
/// Lights up to which it is.
const FEW: usize = 8;
/// All estimators, both gathers among them.
const ESTIMATORS: &str = "density,regular,regular_3x3:n=2,coplanar,coplanar:weight=mean,multi_sampled:n=2,integrated";

/// A scene file. A line `=== NAME` starts a file that it may name; the scene comes first.
pub fn scene(data: &[u8]) -> Result<(), String> {
    let (text, files) = parts(data)?;
    let loaded = scene_from_toml(Path::new("scene.toml"), &text, &Files::Memory(files));
    let scene = loaded.map_err(|e| refused(&e.to_string()))?;
    render(scene)
}

/// An OBJ file opened as a scene. A line `=== NAME` starts a material file or a texture.
pub fn obj(data: &[u8]) -> Result<(), String> {
    let (text, mut files) = parts(data)?;
    files.insert("mesh.obj".into(), text.clone().into_bytes());
    let loaded = scene_from_obj(Path::new("mesh.obj"), &text, &Files::Memory(files));
    let (_, scene) = loaded.map_err(|e| refused(&e.to_string()))?;
    render(scene)
}

/// A Quake 3 map opened as a scene: the bytes as they are, and the same as an archive.
pub fn map(data: &[u8]) -> Result<(), String> {
    let name = if data.starts_with(b"PK") { "map.pk3" } else { "map.bsp" };
    let files = Files::Memory(BTreeMap::from([(name.to_owned(), data.to_vec())]));
    let loaded = scene_from_map(Path::new(name), None, &files);
    let (_, scene) = loaded.map_err(|e| refused(&e.to_string()))?;
    if let Some(cells) = &scene.cells {
        for i in 0..8u32 {
            let place = Vec3::new(i as f32 - 4.0, 0.5, 4.0 - i as f32);
            let Some(cluster) = cells.cluster(place) else { continue };
            assert!(cluster < cells.cluster_count());
            cells.sees(cluster, 0);
        }
    }
    render(scene)
}

/// A session: read, written and read again, and its scene with its edits, if that is a built-in one.
pub fn session(data: &[u8]) -> Result<(), String> {
    let text = std::str::from_utf8(data).map_err(|e| e.to_string())?;
    let session = Session::parse(Path::new("s.toml"), text).map_err(|e| refused(&e.to_string()))?;
    let written = session.to_toml(Path::new("")).expect("what was read can be written");
    let again = Session::parse(Path::new("s.toml"), &written).expect("what was written can be read");
    if cusp::scene::built_in::find(&session.scene).is_none() {
        // Nothing is opened from a disk here, so a path is taken as it is.
        return Ok(());
    }
    let (_, scene) = session.open_scene().map_err(|e| refused(&e.to_string()))?;
    RenderSettings::new(&scene, &session.render, session.size, session.seed).map_err(|e| refused(&e.to_string()))?;
    // Only now: an edit that is no number is not equal to itself.
    assert_eq!(again, session, "it came back as it was");
    render(Scene { render: session.render, ..scene })
}

/// The first part as text, and the others by name.
fn parts(data: &[u8]) -> Result<(String, BTreeMap<String, Vec<u8>>), String> {
    let mut all: Vec<(String, Vec<u8>)> = vec![(String::new(), Vec::new())];
    for line in data.split_inclusive(|b| *b == b'\n') {
        match line.strip_prefix(b"=== ") {
            Some(name) => all.push((String::from_utf8_lossy(name).trim().to_owned(), Vec::new())),
            None => all.last_mut().expect("the first is there").1.extend_from_slice(line),
        }
    }
    let (_, first) = all.remove(0);
    let text = String::from_utf8(first).map_err(|e| e.to_string())?;
    Ok((text, all.into_iter().collect()))
}

/// An error is one line with a place.
fn refused(why: &str) -> String {
    assert!(!why.contains('\n') && why.contains(':'), "no error of one line with a place: {why:?}");
    why.to_owned()
}

/// Renders a small picture of a scene that was accepted; all of it must be numbers.
fn render(scene: Scene) -> Result<(), String> {
    check_scene(&scene);
    let asked = RenderSettings::new(&scene, &RenderFile::default(), None, 1).map_err(|e| refused(&e.to_string()))?;
    if scene.geometry.primitive_count() > SMALL || scene.lights.len() > FEW {
        return Ok(());
    }
    let flags = RenderFile {
        photons: Some(PHOTONS),
        shadow_rays: Some(i64::from(asked.shadow_rays.min(2))),
        max_depth: Some(i64::from(asked.max_depth.min(12))),
        split_depth: Some(i64::from(asked.split_depth.min(3))),
        ..Default::default()
    };
    let mut settings = RenderSettings::new(&scene, &flags, Some(SIZE), 1).expect("lower than what was valid");
    // No pilot photons: they would take longer than all else.
    settings.plan = PlanMode::Full;
    let mut renderer = Renderer::new(scene.into(), settings, estimators(ESTIMATORS).expect("registered"));
    for _ in 0..2 {
        renderer.step(&Silent);
    }
    for (film, estimator) in renderer.films().iter().zip(renderer.estimators()) {
        for p in film.image().pixels {
            assert!(p.is_finite() && p.min_element() >= 0.0, "{}: a pixel of {p}", estimator.name());
        }
    }
    let pass = renderer.last_pass().expect("two were made");
    for kind in PhotonKind::ALL {
        for p in pass.photons.stored.of(kind) {
            let p = cusp::photons::Photon::from(*p);
            let vectors = [p.position, p.direction, p.normal, p.power, p.footprint[0], p.footprint[1]];
            assert!(vectors.iter().all(|v| v.is_finite()), "{p:?}");
        }
    }
    for p in pass.maps.all().flat_map(|m| m.photons()) {
        let axes = p.axes();
        assert!(p.rows.iter().chain(&axes).all(|v| v.is_finite()), "{p:?}");
        assert!(p.inverse_area.is_finite() && p.reach().is_finite() && p.condition().is_finite(), "{p:?}");
    }
    let found = inspect(pass, renderer.estimators(), [1, 2]).expect("a pixel of the image");
    for value in &found.estimators {
        assert!(value.value.is_finite() && value.base.is_finite(), "{value:?}");
    }
    let report = RenderReport::new(&renderer, "all".into(), 0.0, 0.0);
    let json = serde_json::to_value(&report).expect("a report can be written");
    // What is no number would be written as null.
    let null: Vec<&str> = ["seconds", "bounded", "settings", "photons_stored", "passes", "plan"]
        .into_iter()
        .filter(|key| json[key].to_string().contains("null"))
        .collect();
    assert!(null.is_empty(), "no numbers in {null:?}");
    Ok(())
}

/// What every kernel takes for granted.
fn check_scene(scene: &Scene) {
    assert!(scene.radius.is_normal() && scene.resolution().is_normal(), "radius {}", scene.radius);
    let g = &scene.geometry;
    assert!(g.positions.iter().all(|p| p.is_finite()), "a vertex");
    assert!(g.normals.iter().all(|n| (n.length() - 1.0).abs() < 1e-3), "a normal");
    assert!(g.uvs.iter().all(|t| t.is_finite()), "a texture coordinate");
    assert!(g.spheres.iter().all(|s| s.center.is_finite() && s.radius.is_normal()), "a sphere");
    assert!(g.used_materials().all(|m| m < scene.materials.len()), "a material");
    let unit = |v: &Vec3| (v.length() - 1.0).abs() < 1e-3;
    let camera = &scene.camera;
    assert!(camera.position.is_finite() && camera.frame.iter().all(unit) && camera.tan_half_fov_y > 0.0, "{camera:?}");
    for light in &scene.lights {
        assert!(light.flux().is_finite() && light.radiance().is_finite() && light.area().is_finite(), "{light:?}");
        if let Light::Spot { direction, .. } | Light::Directional { direction, .. } = light {
            assert!(unit(direction), "{light:?}");
        }
    }
}
