//! From the file as written to a checked [`Scene`].

mod assembly;
mod lights;
mod materials;
mod surfaces;

use crate::math::rgb::Rgb;
use crate::scene::locate::Locator;
use crate::scene::scene_file::{AnimateFile, CameraFile, LightFile, RenderFile, SceneFile, ShapeFile};
use crate::scene::source::{Files, hash_of};
use crate::scene::{Camera, Light, Scene, SceneError};
use assembly::{Assembly, CameraSource, LightSource, local_geometry};
use glam::DVec3;
use std::collections::BTreeMap;
use std::path::Path;

/// Largest number of pixels of an image across or down.
pub const MAX_RESOLUTION: i64 = 32_768;
/// Largest number of pixels of an image.
pub const MAX_PIXELS: u64 = 1 << 26;
/// Largest coordinate, length or factor that a file may hold.
const MAX_LENGTH: f64 = 1e15;
/// Largest power, radiance or irradiance.
const MAX_POWER: f64 = 1e30;

type Checked<T> = Result<T, SceneError>;

/// Reads a scene from TOML text; `file` names it in errors.
///
/// # Errors
/// The first thing that is wrong, with file, line and key.
pub fn scene_from_toml(file: &Path, text: &str, files: &Files) -> Checked<Scene> {
    scene_from_file(file, text, &parse(file, text)?, files)
}

/// The text of a scene file as it is written.
///
/// # Errors
/// Text that is no TOML, an unknown key or a wrong type, with file and line.
pub fn parse(file: &Path, text: &str) -> Checked<SceneFile> {
    toml::from_str(text).map_err(|e| Locator::new(file, text).parse_error(&e))
}

/// Checks and loads a scene file; `file` and `text` place what is wrong in it.
///
/// # Errors
/// The first thing that is wrong, with file, line and key.
pub fn scene_from_file(file: &Path, text: &str, parsed: &SceneFile, files: &Files) -> Checked<Scene> {
    let mut loader = Loader::new(Locator::new(file, text), files);
    loader.texts.push(text.to_owned());
    loader.materials(&parsed.materials)?;
    for (i, shape) in parsed.shapes.iter().enumerate() {
        loader.shape(&format!("shapes[{i}]"), shape)?;
    }
    for (i, light) in parsed.lights.iter().enumerate() {
        loader.light(&format!("lights[{i}]"), light)?;
    }
    let Some(camera) = &parsed.camera else {
        return Err(loader.locator.error("camera", "there is none; add [camera] with position, target and fov_y"));
    };
    let camera = loader.camera(camera)?;
    let name = parsed.name.clone().unwrap_or_else(|| stem(file));
    loader.finish(name, &camera, parsed.render.clone())
}

/// The camera of a scene file, about a local origin that is known.
///
/// # Errors
/// Anything wrong in the camera, with file, line and key.
pub fn camera_from_file(file: &Path, text: &str, parsed: &SceneFile, files: &Files, origin: DVec3) -> Checked<Camera> {
    let loader = Loader::new(Locator::new(file, text), files);
    match &parsed.camera {
        Some(camera) => Ok(loader.camera(camera)?.local(origin)),
        None => Err(loader.locator.error("camera", "there is none; add [camera] with position, target and fov_y")),
    }
}

/// An OBJ as a scene of its own: a camera that frames it and a point light above the camera's shoulder. Returns the
/// scene file that says so, and the scene.
///
/// # Errors
/// Anything wrong in the file.
pub fn scene_from_obj(file: &Path, text: &str) -> Checked<(SceneFile, Scene)> {
    let name = file.file_name().map_or_else(String::new, |n| n.to_string_lossy().into_owned());
    let folder = file.parent().unwrap_or(Path::new("")).to_owned();
    let files = Files::Folder(folder);
    let mut loader = Loader::new(Locator::new(file, ""), &files);
    loader.texts.push(text.to_owned());
    let shape = ShapeFile { kind: "mesh".into(), file: Some(name), ..Default::default() };
    loader.shape("mesh", &shape)?;
    let (center, radius) = loader.assembly.bounds();
    let camera = CameraFile {
        position: (center + DVec3::new(0.0, 0.9, 2.8) * radius).to_array(),
        target: center.to_array(),
        up: None,
        fov_y: 45.0,
        resolution: Some([512, 512]),
    };
    let light = LightFile {
        kind: "point".into(),
        position: Some((center + DVec3::new(-1.6, 2.4, 1.2) * radius).to_array()),
        power: Some([40.0 * radius * radius; 3]),
        ..Default::default()
    };
    loader.light("lights[0]", &light)?;
    let source = loader.camera(&camera)?;
    let written = SceneFile {
        name: Some(stem(file)),
        camera: Some(camera),
        materials: BTreeMap::new(),
        shapes: vec![shape],
        lights: vec![light],
        render: RenderFile::default(),
    };
    loader.finish(stem(file), &source, RenderFile::default()).map(|scene| (written, scene))
}

fn stem(file: &Path) -> String {
    file.file_stem().map_or_else(|| "scene".into(), |s| s.to_string_lossy().into_owned())
}

struct Loader<'a> {
    locator: Locator<'a>,
    files: &'a Files,
    texts: Vec<String>,
    assembly: Assembly,
    material_index: BTreeMap<String, u32>,
    warnings: Vec<String>,
}

impl<'a> Loader<'a> {
    fn new(locator: Locator<'a>, files: &'a Files) -> Self {
        Self {
            locator,
            files,
            texts: Vec::new(),
            assembly: Assembly::default(),
            material_index: BTreeMap::new(),
            warnings: Vec::new(),
        }
    }

    fn wrong<T>(&self, key: impl Into<String>, what: impl Into<String>) -> Checked<T> {
        Err(self.locator.error(key, what))
    }

    /// Keys that this kind does not know are errors, like keys that no kind knows.
    fn only(&self, key: &str, kind: &str, allowed: &[&str], given: &[(&str, bool)]) -> Checked<()> {
        for (name, is_given) in given {
            if *is_given && !allowed.contains(name) {
                return self.wrong(
                    format!("{key}.{name}"),
                    format!("`{kind}` has no such key; it takes {}", allowed.join(", ")),
                );
            }
        }
        Ok(())
    }

    fn required<T: Copy>(&self, key: &str, name: &str, value: Option<T>) -> Checked<T> {
        match value {
            Some(v) => Ok(v),
            None => self.wrong(format!("{key}.{name}"), "is missing; add it"),
        }
    }

    fn vector(&self, key: &str, value: [f64; 3]) -> Checked<DVec3> {
        if value.iter().all(|x| x.abs() <= MAX_LENGTH) {
            Ok(DVec3::from_array(value))
        } else {
            self.wrong(key, format!("must be three finite numbers, got {value:?}"))
        }
    }

    fn direction(&self, key: &str, value: [f64; 3]) -> Checked<DVec3> {
        match self.vector(key, value)?.try_normalize() {
            Some(d) => Ok(d),
            None => self.wrong(key, "has no length; give a direction"),
        }
    }

    fn positive(&self, key: &str, value: f64, unit: &str) -> Checked<f64> {
        if value > 0.0 && value <= MAX_LENGTH {
            Ok(value)
        } else {
            self.wrong(key, format!("must be positive and finite ({unit}), got {value}"))
        }
    }

    fn power(&self, key: &str, value: Option<[f64; 3]>, unit: &str) -> Checked<Rgb> {
        let Some(c) = value else {
            return self.wrong(key, format!("is missing; give three numbers in {unit}"));
        };
        if c.iter().all(|&x| (0.0..=MAX_POWER).contains(&x)) {
            Ok(DVec3::from_array(c).as_vec3())
        } else {
            self.wrong(key, format!("must be finite and not negative ({unit}), got {c:?}"))
        }
    }

    fn animation(&self, key: &str, a: Option<&AnimateFile>) -> Checked<()> {
        let Some(a) = a else { return Ok(()) };
        for (i, p) in a.path.iter().enumerate() {
            self.vector(&format!("{key}.animate.path[{i}]"), *p)?;
        }
        self.positive(&format!("{key}.animate.period"), a.period, "seconds")?;
        Ok(())
    }

    fn camera(&self, c: &CameraFile) -> Checked<CameraSource> {
        let position = self.vector("camera.position", c.position)?;
        let target = self.vector("camera.target", c.target)?;
        let up = self.direction("camera.up", c.up.unwrap_or([0.0, 1.0, 0.0]))?;
        if !(c.fov_y > 0.0 && c.fov_y < 180.0) {
            return self.wrong("camera.fov_y", format!("must lie in (0, 180) degrees, got {}", c.fov_y));
        }
        let forward = (target - position).normalize_or_zero();
        if forward == DVec3::ZERO {
            return self.wrong("camera.target", "is where the camera stands; move one of them");
        }
        if forward.cross(up).length() < 1e-9 {
            return self.wrong("camera.up", "is parallel to the view; turn it");
        }
        let resolution = c.resolution.unwrap_or([512, 512]);
        if resolution.iter().any(|r| !(1..=MAX_RESOLUTION).contains(r)) {
            return self.wrong("camera.resolution", format!("must lie in 1 to {MAX_RESOLUTION}, got {resolution:?}"));
        }
        let pixels = resolution.iter().product::<i64>() as u64;
        if pixels > MAX_PIXELS {
            let most = MAX_PIXELS >> 20;
            return self.wrong("camera.resolution", format!("has {pixels} pixels; {most} million (of 2²⁰) at most"));
        }
        Ok(CameraSource { position, target, up, fov_y: c.fov_y, resolution: resolution.map(|r| r as u32) })
    }

    fn finish(mut self, name: String, camera: &CameraSource, render: RenderFile) -> Checked<Scene> {
        let (origin, radius) = self.assembly.bounds();
        let local = |p: DVec3| (p - origin).as_vec3();
        let geometry = local_geometry(&self.assembly, origin, radius);
        if geometry.primitive_count() == 0 {
            self.warnings.push("the scene has no surfaces".into());
        }
        if self.assembly.lights.is_empty() {
            self.warnings.push("the scene has no light".into());
        }
        if geometry.zero_area > 0 {
            self.warnings.push(format!("{} triangles without area left out", geometry.zero_area));
        }
        let lights = self.assembly.lights.iter().map(|l| match l {
            LightSource::Point { position, power } => Light::Point { position: local(*position), power: *power },
            LightSource::Sphere { center, radius, power } => {
                Light::Sphere { center: local(*center), radius: *radius as f32, power: *power }
            }
            LightSource::Quad { center, u, v, power } => {
                Light::Quad { center: local(*center), u: u.as_vec3(), v: v.as_vec3(), power: *power }
            }
            LightSource::Spot { position, direction, half, falloff, power } => Light::Spot {
                position: local(*position),
                direction: direction.as_vec3(),
                cos_half: libm::cos(*half),
                falloff: *falloff as f32,
                power: *power,
            },
            LightSource::Directional { direction, irradiance } => Light::Directional {
                direction: direction.as_vec3(),
                irradiance: *irradiance,
                disc_center: (-*direction * (1.01 * radius)).as_vec3(),
                disc_radius: radius as f32,
            },
            LightSource::Mesh { first, count, radiance } => Light::mesh(
                (*first..first + count)
                    .map(|t| self.assembly.mesh.triangles[t].map(|i| local(self.assembly.mesh.positions[i as usize])))
                    .collect(),
                *radiance,
            ),
        });
        let texts: Vec<&str> = self.texts.iter().map(String::as_str).collect();
        Ok(Scene {
            name,
            hash: hash_of(&texts),
            origin,
            radius: radius as f32,
            camera: camera.local(origin),
            lights: lights.collect(),
            geometry: geometry.into(),
            materials: self.assembly.materials,
            material_names: self.assembly.material_names,
            render,
            render_lines: self.locator.lines_of("render"),
            warnings: self.warnings,
        })
    }
}
