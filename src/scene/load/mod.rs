//! From the file as written to a checked [`Scene`].

mod assembly;
mod lights;
mod maps;
mod materials;
mod surfaces;

use crate::math::frame::unit;
use crate::math::rgb::Rgb;
use crate::scene::geometry::BYTES_PER_TRIANGLE as TRIANGLE_BYTES;
use crate::scene::geometry::BYTES_PER_VERTEX as VERTEX_BYTES;
use crate::scene::locate::Locator;
use crate::scene::memory;
use crate::scene::quake;
use crate::scene::scene_file::{AnimateFile, CameraFile, LightFile, RealtimeFile, RenderFile, SceneFile, ShapeFile};
use crate::scene::source::{Files, hash_of};
use crate::scene::{Camera, Light, Scene, SceneError, Viewpoint};
use assembly::{Assembly, CameraSource, Extent, LightSource, Moving, local_geometry};
use glam::DVec3;
use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;

/// Largest number of pixels of an image across or down.
pub const MAX_RESOLUTION: i64 = 32_768;
/// Largest number of pixels of an image.
pub const MAX_PIXELS: u64 = 1 << 26;
/// Largest coordinate, length or factor that a file may hold, and largest coordinate of a placed shape.
pub const MAX_LENGTH: f64 = 1e15;
/// Largest power, radiance or irradiance that a file may hold.
const MAX_POWER: f64 = 1e30;
/// Largest flux or radiance that follows from those: sums and products with numbers near 1 stay within 32 bits.
const MAX_FLUX: f32 = 1e36;
/// Least flux but 0: the power of one of 2³¹ photons of it still has all its digits in 32 bits.
const MIN_FLUX: f32 = 1e-20;
/// Radius of a scene, metres. Fourth powers of lengths down to its resolution and up to it stay within 32 bits.
const RADIUS: std::ops::RangeInclusive<f64> = 1e-9..=1e12;
/// Least vertical field of view, degrees: below it all pixels have one direction in 32 bits.
const MIN_FOV: f64 = 1e-3;
/// Largest vertical field of view, degrees.
const MAX_FOV: f64 = 179.99;

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
    loader.foresee(&parsed.shapes, &parsed.lights)?;
    loader.materials(&parsed.materials)?;
    for (i, shape) in parsed.shapes.iter().enumerate() {
        let (key, before) = (format!("shapes[{i}]"), loader.assembly.extent());
        loader.shape(&key, shape)?;
        loader.animate(&key, shape.animate.as_ref(), before)?;
    }
    for (i, light) in parsed.lights.iter().enumerate() {
        let (key, before) = (format!("lights[{i}]"), loader.assembly.extent());
        loader.light(&key, light)?;
        loader.animate(&key, light.animate.as_ref(), before)?;
    }
    let Some(camera) = &parsed.camera else {
        return Err(loader.locator.error("camera", "there is none; add [camera] with position, target and fov_y"));
    };
    let camera = loader.camera(camera)?;
    let name = parsed.name.clone().unwrap_or_else(|| stem(file));
    loader.finish(name, &camera, parsed.render.clone(), parsed.realtime.clone())
}

/// A map of Quake 3 as a scene of its own: its lights, and a camera where a player starts. Returns the scene file that
/// says so, and the scene. `files` holds it, an archive with the map of the name `map`, or its only one.
///
/// # Errors
/// Anything wrong in the file.
pub fn scene_from_map(file: &Path, map: Option<&str>, files: &Files) -> Checked<(SceneFile, Scene)> {
    let mut name = file.file_name().map_or_else(String::new, |n| n.to_string_lossy().into_owned());
    if let Some(map) = map {
        name = format!("{name}:{map}");
    }
    let shape = ShapeFile { kind: "mesh".into(), file: Some(name), ..Default::default() };
    let mut loader = Loader::new(Locator::new(file, ""), files);
    loader.shape("mesh", &shape)?;
    let (center, radius) = loader.assembly.bounds();
    let viewpoints = quake::viewpoints(&loader.entities);
    let (lights, notes) = quake::lights(&loader.entities, &viewpoints, center);
    loader.warnings.extend(notes);
    for (i, light) in lights.iter().enumerate() {
        loader.light(&format!("lights[{i}]"), light)?;
    }
    let camera = quake::camera(&viewpoints, center, radius);
    let source = loader.camera(&camera)?;
    let title = stem(map.map_or(file, Path::new));
    let written = SceneFile {
        name: Some(title.clone()),
        camera: Some(camera),
        materials: BTreeMap::new(),
        shapes: vec![shape],
        lights,
        render: RenderFile::default(),
        realtime: RealtimeFile::default(),
    };
    loader.finish(title, &source, RenderFile::default(), RealtimeFile::default()).map(|scene| (written, scene))
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
/// scene file that says so, and the scene. `files` holds it and what it names.
///
/// # Errors
/// Anything wrong in the file.
pub fn scene_from_obj(file: &Path, text: &str, files: &Files) -> Checked<(SceneFile, Scene)> {
    let name = file.file_name().map_or_else(String::new, |n| n.to_string_lossy().into_owned());
    let mut loader = Loader::new(Locator::new(file, ""), files);
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
        realtime: RealtimeFile::default(),
    };
    loader.finish(stem(file), &source, RenderFile::default(), RealtimeFile::default()).map(|scene| (written, scene))
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
    /// Memory that could be had before the first large shape, bytes.
    memory: Option<u64>,
    /// Triangles of all shapes so far, those of the next one included.
    triangles: u64,
    /// Their vertices and normals, the more numerous of the two.
    vertices: u64,
    /// Entities of a map among the shapes.
    entities: Vec<quake::Entity>,
    /// Its cells, if it stands where its file has it.
    cells: Option<quake::Cells>,
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
            memory: None,
            triangles: 0,
            vertices: 0,
            entities: Vec::new(),
            cells: None,
        }
    }

    /// Counts a shape's triangles among all and makes sure that these can be had.
    fn reserve(&mut self, key: &str, triangles: u64, vertices: u64, advice: &str) -> Checked<()> {
        self.triangles = self.triangles.saturating_add(triangles);
        self.vertices = self.vertices.saturating_add(vertices);
        if self.triangles.max(self.vertices) >= u64::from(u32::MAX) {
            let what = format!(
                "makes {} triangles of {} vertices in all; an index of 32 bits can tell 4294967294 apart; {advice}",
                self.triangles, self.vertices
            );
            return self.wrong(key, what);
        }
        let needed = memory::bytes(self.triangles, TRIANGLE_BYTES) + memory::bytes(self.vertices, VERTEX_BYTES);
        if needed <= memory::ALWAYS {
            return Ok(());
        }
        let available = *self.memory.get_or_insert_with(memory::available);
        memory::check_against(available, format!("{} triangles in all", self.triangles), needed, advice)
            .or_else(|short| self.wrong(key, short.to_string()))
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
            self.wrong(key, format!("must be three finite numbers, {MAX_LENGTH:e} at most, got {value:?}"))
        }
    }

    fn direction(&self, key: &str, value: [f64; 3]) -> Checked<DVec3> {
        match unit(self.vector(key, value)?) {
            Some(d) => Ok(d),
            None => self.wrong(key, "has no length; give a direction"),
        }
    }

    fn positive(&self, key: &str, value: f64, unit: &str) -> Checked<f64> {
        if value > 0.0 && value <= MAX_LENGTH {
            Ok(value)
        } else {
            self.wrong(key, format!("must be positive and finite ({unit}), {MAX_LENGTH:e} at most, got {value}"))
        }
    }

    fn power(&self, key: &str, value: Option<[f64; 3]>, unit: &str) -> Checked<Rgb> {
        let Some(c) = value else {
            return self.wrong(key, format!("is missing; give three numbers in {unit}"));
        };
        if c.iter().all(|&x| (0.0..=MAX_POWER).contains(&x)) {
            Ok(DVec3::from_array(c).as_vec3())
        } else {
            self.wrong(key, format!("must be finite and not negative ({unit}), {MAX_POWER:e} at most, got {c:?}"))
        }
    }

    /// Takes note that what has come in since `before` moves.
    fn animate(&mut self, key: &str, a: Option<&AnimateFile>, before: Extent) -> Checked<()> {
        let Some(a) = a else { return Ok(()) };
        let mut path = Vec::with_capacity(a.path.len());
        for (i, p) in a.path.iter().enumerate() {
            path.push(self.vector(&format!("{key}.animate.path[{i}]"), *p)?);
        }
        let period = self.positive(&format!("{key}.animate.period"), a.period, "seconds")?;
        self.assembly.moving.push(Moving { from: before, to: self.assembly.extent(), path, period });
        Ok(())
    }

    fn camera(&self, c: &CameraFile) -> Checked<CameraSource> {
        let position = self.vector("camera.position", c.position)?;
        let target = self.vector("camera.target", c.target)?;
        let up = self.direction("camera.up", c.up.unwrap_or([0.0, 1.0, 0.0]))?;
        if !(MIN_FOV..=MAX_FOV).contains(&c.fov_y) {
            let what = format!("must lie in [{MIN_FOV}, {MAX_FOV}] degrees, got {}", c.fov_y);
            return self.wrong("camera.fov_y", what);
        }
        let Some(forward) = unit(target - position) else {
            return self.wrong("camera.target", "is where the camera stands; move one of them");
        };
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

    /// Whether a light's flux and radiance are numbers of 32 bits that can be worked with.
    fn check_light(&self, key: &str, light: &Light) -> Checked<()> {
        let (flux, radiance) = (light.flux(), light.radiance());
        for (value, what, unit) in [(flux, "flux", "W"), (radiance, "radiance", "W/(m² sr)")] {
            if !value.is_finite() || value.max_element() > MAX_FLUX {
                let larger = if what == "flux" { "smaller" } else { "larger" };
                return self.wrong(
                    key,
                    format!(
                        "its {what} must be at most {MAX_FLUX:e} {unit}, it is {:e}; lower its power or make it {larger}",
                        value.max_element()
                    ),
                );
            }
        }
        if flux.max_element() > 0.0 && flux.max_element() < MIN_FLUX {
            let what = format!(
                "its flux must be 0 or at least {MIN_FLUX:e} W, it is {:e}; raise its power or leave it out",
                flux.max_element()
            );
            return self.wrong(key, what);
        }
        if light.has_area() && flux == Rgb::ZERO && light.area() == 0.0 {
            return self.wrong(key, "has no area in 32 bits; make it larger");
        }
        Ok(())
    }

    fn finish(
        mut self,
        name: String,
        camera: &CameraSource,
        render: RenderFile,
        realtime: RealtimeFile,
    ) -> Checked<Scene> {
        let (origin, radius) = self.assembly.bounds();
        if !RADIUS.contains(&radius) {
            let what = format!(
                "the scene's radius must lie in {:e} to {:e} metres, it is {radius:e}; scale the shapes",
                RADIUS.start(),
                RADIUS.end()
            );
            return self.wrong("shapes", what);
        }
        let local = |p: DVec3| (p - origin).as_vec3();
        let (geometry, motions) = local_geometry(&self.assembly, origin, radius);
        if geometry.primitive_count() == 0 {
            self.warnings.push("the scene has no surfaces".into());
        }
        if self.assembly.lights.is_empty() {
            self.warnings.push("the scene has no light".into());
        }
        if geometry.repeated > 0 {
            self.warnings.push(format!("{} triangles in the place of others left out", geometry.repeated));
        }
        if geometry.zero_area > 0 {
            self.warnings.push(format!("{} triangles or spheres without area left out", geometry.zero_area));
        }
        let lights = self.assembly.lights.iter().map(|(_, l)| match l {
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
        let lights: Vec<Light> = lights.collect();
        for ((key, _), light) in self.assembly.lights.iter().zip(&lights) {
            self.check_light(key, light)?;
        }
        let texts: Vec<&str> = self.texts.iter().map(String::as_str).collect();
        Ok(Scene {
            name,
            hash: hash_of(&texts),
            origin,
            radius: radius as f32,
            camera: camera.local(origin),
            lights,
            geometry: geometry.into(),
            materials: self.assembly.materials,
            material_names: self.assembly.material_names,
            render,
            render_lines: self.locator.lines_of("render"),
            realtime,
            realtime_lines: self.locator.lines_of("realtime"),
            motions,
            viewpoints: quake::viewpoints(&self.entities)
                .into_iter()
                .map(|v| Viewpoint { name: v.name, position: local(v.position), target: local(v.target) })
                .collect(),
            cells: self.cells.map(|c| Arc::new(c.about(origin))),
            warnings: self.warnings,
        })
    }
}
