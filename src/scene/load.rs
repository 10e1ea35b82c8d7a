//! From the file as written to a checked [`Scene`].

use crate::math::rgb::Rgb;
use crate::scene::geometry::{Geometry, NONE, Sphere};
use crate::scene::locate::Locator;
use crate::scene::obj::{self, CREASE_ANGLE};
use crate::scene::scene_file::{
    CameraFile, LightFile, MaterialFile, RenderFile, RotateFile, SceneFile, ShapeFile,
};
use crate::scene::shapes::{self, Mesh, Placement};
use crate::scene::source::{Files, hash_of};
use crate::scene::texture::Texture;
use crate::scene::{Camera, Light, Material, Scene, SceneError};
use glam::{DMat3, DVec3, Vec3};
use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;

/// Largest number of pixels of an image across or down.
pub const MAX_RESOLUTION: i64 = 32_768;
/// Largest coordinate, length or factor that a file may hold.
const MAX_LENGTH: f64 = 1e30;

type Checked<T> = Result<T, SceneError>;

/// Reads a scene from TOML text; `file` names it in errors.
///
/// # Errors
/// The first thing that is wrong, with file, line and key.
pub fn scene_from_toml(file: &Path, text: &str, files: &Files) -> Checked<Scene> {
    let locator = Locator::new(file, text);
    let parsed: SceneFile = toml::from_str(text).map_err(|e| locator.parse_error(&e))?;
    let name = parsed.name.clone().unwrap_or_else(|| stem(file));
    let mut loader = Loader {
        locator,
        files,
        texts: vec![text.to_owned()],
        assembly: Assembly::default(),
        material_index: BTreeMap::new(),
        warnings: Vec::new(),
    };
    loader.materials(&parsed.materials)?;
    for (i, shape) in parsed.shapes.iter().enumerate() {
        loader.shape(&format!("shapes[{i}]"), shape)?;
    }
    for (i, light) in parsed.lights.iter().enumerate() {
        loader.light(&format!("lights[{i}]"), light)?;
    }
    let Some(camera) = &parsed.camera else {
        return Err(loader.locator.error(
            "camera",
            "there is none; add [camera] with position, target and fov_y",
        ));
    };
    let camera = loader.camera(camera)?;
    loader.finish(name, camera, parsed.render)
}

/// An OBJ as a scene of its own: a camera that frames it and a point light above the camera's shoulder.
///
/// # Errors
/// Anything wrong in the file.
pub fn scene_from_obj(file: &Path, text: &str) -> Checked<Scene> {
    let name = file
        .file_name()
        .map_or_else(String::new, |n| n.to_string_lossy().into_owned());
    let folder = file.parent().unwrap_or(Path::new("")).to_owned();
    let files = Files::Folder(folder);
    let mut loader = Loader {
        locator: Locator::new(file, ""),
        files: &files,
        texts: vec![text.to_owned()],
        assembly: Assembly::default(),
        material_index: BTreeMap::new(),
        warnings: Vec::new(),
    };
    let shape = ShapeFile {
        kind: "mesh".into(),
        file: Some(name),
        ..Default::default()
    };
    loader.shape("mesh", &shape)?;
    let (center, radius) = loader.assembly.bounds();
    let eye = center + DVec3::new(0.0, 0.9, 2.8) * radius;
    let camera = CameraSource {
        position: eye,
        target: center,
        up: DVec3::Y,
        fov_y: 45.0,
        resolution: [512, 512],
    };
    let power = (40.0 * radius * radius) as f32;
    loader.assembly.lights.push(LightSource::Point {
        position: center + DVec3::new(-1.6, 2.4, 1.2) * radius,
        power: Rgb::splat(power),
    });
    loader.finish(stem(file), camera, RenderFile::default())
}

fn stem(file: &Path) -> String {
    file.file_stem()
        .map_or_else(|| "scene".into(), |s| s.to_string_lossy().into_owned())
}

/// The camera before it is moved to the local origin.
struct CameraSource {
    position: DVec3,
    target: DVec3,
    up: DVec3,
    fov_y: f64,
    resolution: [u32; 2],
}

/// Lights before they are moved to the local origin.
enum LightSource {
    Point { position: DVec3, power: Rgb },
    Sphere { center: DVec3, radius: f64, power: Rgb },
    Quad { center: DVec3, u: DVec3, v: DVec3, power: Rgb },
    Spot { position: DVec3, direction: DVec3, half: f64, falloff: f64, power: Rgb },
    Directional { direction: DVec3, irradiance: Rgb },
    /// A range of triangles.
    Mesh { first: usize, count: usize, radiance: Rgb },
}

/// All surfaces in f64, as they come.
#[derive(Default)]
struct Assembly {
    mesh: Mesh,
    materials: Vec<Material>,
    spheres: Vec<(DVec3, f64, u32)>,
    lights: Vec<LightSource>,
}

impl Assembly {
    fn add_mesh(&mut self, mesh: Mesh, material: impl Fn(u32) -> u32) {
        let (p, n, t) = (
            self.mesh.positions.len() as u32,
            self.mesh.normals.len() as u32,
            self.mesh.uvs.len() as u32,
        );
        let shift = |i: [u32; 3], by: u32| i.map(|i| if i == NONE { NONE } else { i + by });
        self.mesh.positions.extend(mesh.positions);
        self.mesh.normals.extend(mesh.normals);
        self.mesh.uvs.extend(mesh.uvs);
        self.mesh
            .triangles
            .extend(mesh.triangles.iter().map(|&i| shift(i, p)));
        self.mesh
            .corner_normals
            .extend(mesh.corner_normals.iter().map(|&i| shift(i, n)));
        self.mesh
            .corner_uvs
            .extend(mesh.corner_uvs.iter().map(|&i| shift(i, t)));
        self.mesh
            .materials
            .extend(mesh.materials.iter().map(|&m| material(m)));
    }

    fn add_material(&mut self, material: Material) -> u32 {
        self.materials.push(material);
        self.materials.len() as u32 - 1
    }

    /// Centre and radius of what is there; a unit sphere about the origin if nothing is.
    fn bounds(&self) -> (DVec3, f64) {
        let mut low = DVec3::INFINITY;
        let mut high = DVec3::NEG_INFINITY;
        for t in &self.mesh.triangles {
            for &i in t {
                low = low.min(self.mesh.positions[i as usize]);
                high = high.max(self.mesh.positions[i as usize]);
            }
        }
        for (c, r, _) in &self.spheres {
            low = low.min(*c - *r);
            high = high.max(*c + *r);
        }
        let radius = (high - low).length() / 2.0;
        if radius.is_finite() && radius > 0.0 {
            ((low + high) / 2.0, radius)
        } else {
            (DVec3::ZERO, 1.0)
        }
    }
}

struct Loader<'a> {
    locator: Locator<'a>,
    files: &'a Files,
    texts: Vec<String>,
    assembly: Assembly,
    material_index: BTreeMap<String, u32>,
    warnings: Vec<String>,
}

impl Loader<'_> {
    fn wrong<T>(&self, key: impl Into<String>, what: impl Into<String>) -> Checked<T> {
        Err(self.locator.error(key, what))
    }

    fn materials(&mut self, materials: &BTreeMap<String, MaterialFile>) -> Checked<()> {
        for (name, file) in materials {
            let material = self.material(&format!("materials.{name}"), file)?;
            let index = self.assembly.add_material(material);
            self.material_index.insert(name.clone(), index);
        }
        Ok(())
    }

    fn material(&self, key: &str, file: &MaterialFile) -> Checked<Material> {
        let at = |k: &str| format!("{key}.{k}");
        let allowed: &[&str] = match file.kind.as_str() {
            "diffuse" => &["reflectance", "texture"],
            "mirror" | "metal" => &["reflectance"],
            "dielectric" => &["ior", "transmittance"],
            "emissive" => &["radiance"],
            other => {
                return self.wrong(
                    at("kind"),
                    format!("unknown kind `{other}`; use diffuse, mirror, metal, dielectric or emissive"),
                );
            }
        };
        self.only(
            key,
            &file.kind,
            allowed,
            &[
                ("reflectance", file.reflectance.is_some()),
                ("texture", file.texture.is_some()),
                ("ior", file.ior.is_some()),
                ("transmittance", file.transmittance.is_some()),
                ("radiance", file.radiance.is_some()),
            ],
        )?;
        let unit = |k: &str, value: Option<[f64; 3]>, default: f64| -> Checked<Rgb> {
            let c = value.unwrap_or([default; 3]);
            if c.iter().all(|x| (0.0..=1.0).contains(x)) {
                Ok(DVec3::from_array(c).as_vec3())
            } else {
                self.wrong(at(k), format!("each channel must lie in [0, 1], got {c:?}"))
            }
        };
        Ok(match file.kind.as_str() {
            "diffuse" => Material::Diffuse {
                reflectance: unit("reflectance", file.reflectance, 0.8)?,
                texture: match &file.texture {
                    Some(name) => Some(Arc::new(self.texture(&at("texture"), name)?)),
                    None => None,
                },
            },
            "mirror" => Material::Mirror {
                reflectance: unit("reflectance", file.reflectance, 1.0)?,
            },
            "metal" => Material::Metal {
                reflectance: unit("reflectance", file.reflectance, 0.9)?,
            },
            "dielectric" => {
                let ior = file.ior.unwrap_or(1.5);
                if !(1.0..=10.0).contains(&ior) {
                    return self.wrong(at("ior"), format!("must lie in [1, 10], got {ior}"));
                }
                Material::Dielectric {
                    ior: ior as f32,
                    transmittance: unit("transmittance", file.transmittance, 1.0)?,
                }
            }
            _ => Material::Emitter {
                radiance: self.power(&at("radiance"), file.radiance, "W/(m² sr)")?,
            },
        })
    }

    fn texture(&self, key: &str, name: &str) -> Checked<Texture> {
        let Some(path) = self.files.path(name) else {
            return self.wrong(key, "a built-in scene has no textures");
        };
        Texture::load(&path).or_else(|why| {
            self.wrong(key, format!("{}: {why}; give a PNG", path.display()))
        })
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
        if c.iter().all(|&x| (0.0..=MAX_LENGTH).contains(&x)) {
            Ok(DVec3::from_array(c).as_vec3())
        } else {
            self.wrong(
                key,
                format!("must be finite and not negative ({unit}), got {c:?}"),
            )
        }
    }

    fn placement(&self, key: &str, shape: &ShapeFile) -> Checked<Placement> {
        let scale = match shape.scale {
            Some(s) => self.positive(&format!("{key}.scale"), s, "a factor")?,
            None => 1.0,
        };
        let rotation = match &shape.rotate {
            Some(RotateFile { axis, angle }) => {
                let axis = self.direction(&format!("{key}.rotate.axis"), *axis)?;
                if !angle.is_finite() {
                    return self.wrong(format!("{key}.rotate.angle"), "must be finite, in degrees");
                }
                shapes::rotation(axis, *angle)
            }
            None => DMat3::IDENTITY,
        };
        let translation = match shape.translate {
            Some(t) => self.vector(&format!("{key}.translate"), t)?,
            None => DVec3::ZERO,
        };
        Ok(Placement { scale, rotation, translation })
    }

    fn shape(&mut self, key: &str, s: &ShapeFile) -> Checked<()> {
        let at = |k: &str| format!("{key}.{k}");
        let allowed: &[&str] = match s.kind.as_str() {
            "mesh" => &["file", "crease_angle"],
            "quad" => &["center", "u", "v"],
            "box" => &["half_size"],
            "sphere" => &["center", "radius"],
            "ring" => &["inner", "outer", "height", "segments"],
            other => {
                return self.wrong(
                    at("kind"),
                    format!("unknown kind `{other}`; use mesh, quad, box, sphere or ring"),
                );
            }
        };
        self.only(
            key,
            &s.kind,
            allowed,
            &[
                ("file", s.file.is_some()),
                ("crease_angle", s.crease_angle.is_some()),
                ("center", s.center.is_some()),
                ("u", s.u.is_some()),
                ("v", s.v.is_some()),
                ("half_size", s.half_size.is_some()),
                ("radius", s.radius.is_some()),
                ("inner", s.inner.is_some()),
                ("outer", s.outer.is_some()),
                ("height", s.height.is_some()),
                ("segments", s.segments.is_some()),
            ],
        )?;
        self.animation(key, s.animate.as_ref())?;
        let place = self.placement(key, s)?;
        let material = match &s.material {
            Some(name) => match self.material_index.get(name) {
                Some(m) => Some(*m),
                None => {
                    let known: Vec<_> = self.material_index.keys().cloned().collect();
                    return self.wrong(
                        at("material"),
                        format!("no material `{name}`; there are {}", known.join(", ")),
                    );
                }
            },
            None if s.kind == "mesh" => None,
            None => return self.wrong(at("material"), "is missing; name a material"),
        };
        let first = self.assembly.mesh.triangles.len();
        let center = match s.center {
            Some(c) => self.vector(&at("center"), c)?,
            None => DVec3::ZERO,
        };
        let mut emitted = None;
        let mesh = match s.kind.as_str() {
            "sphere" => {
                let radius = self.required(key, "radius", s.radius)?;
                let radius = self.positive(&at("radius"), radius, "metres")? * place.scale;
                let center = place.point(center);
                // A sphere's material was found above; only a mesh may go without.
                let material = material.unwrap_or(NONE);
                self.assembly.spheres.push((center, radius, material));
                if let Some(radiance) = self.emission(material) {
                    let flux = radiance.as_dvec3()
                        * (4.0 * std::f64::consts::PI.powi(2) * radius * radius);
                    self.assembly.lights.push(LightSource::Sphere {
                        center,
                        radius,
                        power: flux.as_vec3(),
                    });
                }
                return Ok(());
            }
            "quad" => {
                let u = self.required(key, "u", s.u)?;
                let v = self.required(key, "v", s.v)?;
                let (u, v) = (self.vector(&at("u"), u)?, self.vector(&at("v"), v)?);
                if let Some(radiance) = material.and_then(|m| self.emission(m)) {
                    let (u, v) = (place.vector(u), place.vector(v));
                    let area = 4.0 * u.cross(v).length();
                    emitted = Some(LightSource::Quad {
                        center: place.point(center),
                        u,
                        v,
                        power: (radiance.as_dvec3() * (std::f64::consts::PI * area)).as_vec3(),
                    });
                }
                shapes::quad(center, u, v)
            }
            "box" => {
                let half = self.required(key, "half_size", s.half_size)?;
                for h in half {
                    self.positive(&at("half_size"), h, "metres")?;
                }
                shapes::cuboid(DVec3::from_array(half))
            }
            "ring" => {
                let inner = self.required(key, "inner", s.inner)?;
                let outer = self.required(key, "outer", s.outer)?;
                let height = self.required(key, "height", s.height)?;
                let inner = self.positive(&at("inner"), inner, "metres")?;
                let height = self.positive(&at("height"), height, "metres")?;
                if !(outer > inner && outer <= MAX_LENGTH) {
                    return self.wrong(at("outer"), format!("must exceed `inner` ({inner}), got {outer}"));
                }
                let segments = s.segments.unwrap_or(256);
                if !(3..=1_000_000).contains(&segments) {
                    return self.wrong(at("segments"), format!("must lie in 3 to 1000000, got {segments}"));
                }
                shapes::ring(inner, outer, height, segments as u32)
            }
            _ => return self.mesh(key, s, &place, material),
        };
        // Only a mesh may lack a material, and it has been dealt with.
        let material = material.unwrap_or(NONE);
        self.assembly.add_mesh(mesh.placed(&place), |_| material);
        match emitted {
            Some(light) => self.assembly.lights.push(light),
            None => self.emit_from(first, material),
        }
        Ok(())
    }

    fn mesh(&mut self, key: &str, s: &ShapeFile, place: &Placement, material: Option<u32>) -> Checked<()> {
        let Some(name) = &s.file else {
            return self.wrong(format!("{key}.file"), "is missing; name an OBJ file");
        };
        let crease = s.crease_angle.unwrap_or(CREASE_ANGLE);
        if !(0.0..=180.0).contains(&crease) {
            return self.wrong(format!("{key}.crease_angle"), format!("must lie in [0, 180] degrees, got {crease}"));
        }
        let (path, text) = match self.files.read(name) {
            Ok(found) => found,
            Err(SceneError::Unreadable { file, why }) if !key.eq("mesh") => {
                return self.wrong(format!("{key}.file"), format!("{}: {why}", file.display()));
            }
            Err(e) => return Err(e),
        };
        let obj = obj::read(&path, &text, crease).map_err(|e| match e.line {
            0 => SceneError::Whole { file: path.clone(), what: e.what },
            line => SceneError::At { file: path.clone(), line, key: "OBJ".into(), what: e.what },
        })?;
        self.warnings.extend(obj.warnings);
        self.texts.push(text);
        self.texts.push(obj.material_text);
        let first = self.assembly.mesh.triangles.len();
        let mesh = obj.mesh.placed(place);
        if let Some(material) = material {
            self.assembly.add_mesh(mesh, |_| material);
            self.emit_from(first, material);
            return Ok(());
        }
        let mut own = Vec::new();
        for (name, file) in &obj.materials {
            let made = self.material(&format!("materials.{name} of {}", path.display()), file)?;
            own.push(self.assembly.add_material(made));
        }
        let mut fallback = NONE;
        if mesh.materials.contains(&NONE) {
            self.warnings.push(format!("{}: surfaces without a material are grey", path.display()));
            fallback = self.assembly.add_material(Material::Diffuse {
                reflectance: Rgb::splat(0.8),
                texture: None,
            });
        }
        self.assembly.add_mesh(mesh, |m| own.get(m as usize).copied().unwrap_or(fallback));
        // Each emissive material of the mesh is a light of its triangles; they come in runs.
        let mut start = first;
        while start < self.assembly.mesh.materials.len() {
            let material = self.assembly.mesh.materials[start];
            let run = self.assembly.mesh.materials[start..]
                .iter()
                .take_while(|&&m| m == material)
                .count();
            if let Some(radiance) = self.emission(material) {
                self.assembly.lights.push(LightSource::Mesh { first: start, count: run, radiance });
            }
            start += run;
        }
        Ok(())
    }

    fn emission(&self, material: u32) -> Option<Rgb> {
        match self.assembly.materials.get(material as usize) {
            Some(Material::Emitter { radiance }) => Some(*radiance),
            _ => None,
        }
    }

    /// Makes all triangles from `first` on a light, if their material emits.
    fn emit_from(&mut self, first: usize, material: u32) {
        if let Some(radiance) = self.emission(material) {
            let count = self.assembly.mesh.triangles.len() - first;
            self.assembly.lights.push(LightSource::Mesh { first, count, radiance });
        }
    }

    fn animation(&self, key: &str, a: Option<&crate::scene::scene_file::AnimateFile>) -> Checked<()> {
        let Some(a) = a else { return Ok(()) };
        for (i, p) in a.path.iter().enumerate() {
            self.vector(&format!("{key}.animate.path[{i}]"), *p)?;
        }
        self.positive(&format!("{key}.animate.period"), a.period, "seconds")?;
        Ok(())
    }

    fn light(&mut self, key: &str, l: &LightFile) -> Checked<()> {
        let at = |k: &str| format!("{key}.{k}");
        let allowed: &[&str] = match l.kind.as_str() {
            "point" => &["position", "power"],
            "sphere" => &["position", "radius", "power"],
            "quad" => &["center", "u", "v", "power"],
            "spot" => &["position", "direction", "cone", "falloff", "power"],
            "directional" => &["direction", "irradiance"],
            other => {
                return self.wrong(
                    at("kind"),
                    format!("unknown kind `{other}`; use point, sphere, quad, spot or directional"),
                );
            }
        };
        self.only(
            key,
            &l.kind,
            allowed,
            &[
                ("position", l.position.is_some()),
                ("radius", l.radius.is_some()),
                ("center", l.center.is_some()),
                ("u", l.u.is_some()),
                ("v", l.v.is_some()),
                ("direction", l.direction.is_some()),
                ("cone", l.cone.is_some()),
                ("falloff", l.falloff.is_some()),
                ("power", l.power.is_some()),
                ("irradiance", l.irradiance.is_some()),
            ],
        )?;
        self.animation(key, l.animate.as_ref())?;
        let place = |name: &str, value: Option<[f64; 3]>| -> Checked<DVec3> {
            self.vector(&at(name), self.required(key, name, value)?)
        };
        let aim = |value: Option<[f64; 3]>| -> Checked<DVec3> {
            self.direction(&at("direction"), self.required(key, "direction", value)?)
        };
        let light = match l.kind.as_str() {
            "directional" => LightSource::Directional {
                direction: aim(l.direction)?,
                irradiance: self.power(&at("irradiance"), l.irradiance, "W/m²")?,
            },
            kind => {
                let power = self.power(&at("power"), l.power, "W")?;
                match kind {
                    "point" => LightSource::Point { position: place("position", l.position)?, power },
                    "sphere" => LightSource::Sphere {
                        center: place("position", l.position)?,
                        radius: self.positive(&at("radius"), self.required(key, "radius", l.radius)?, "metres")?,
                        power,
                    },
                    "quad" => LightSource::Quad {
                        center: place("center", l.center)?,
                        u: place("u", l.u)?,
                        v: place("v", l.v)?,
                        power,
                    },
                    _ => {
                        let cone = self.required(key, "cone", l.cone)?;
                        if !(cone > 0.0 && cone <= 360.0) {
                            return self.wrong(at("cone"), format!("must lie in (0, 360] degrees, got {cone}"));
                        }
                        let falloff = l.falloff.unwrap_or(0.0);
                        if !(0.0..=1e4).contains(&falloff) {
                            return self.wrong(at("falloff"), format!("must lie in [0, 10000], got {falloff}"));
                        }
                        LightSource::Spot {
                            position: place("position", l.position)?,
                            direction: aim(l.direction)?,
                            half: cone.to_radians() / 2.0,
                            falloff,
                            power,
                        }
                    }
                }
            }
        };
        if let LightSource::Quad { u, v, .. } = &light
            && u.cross(*v).length_squared() == 0.0
        {
            return self.wrong(at("v"), "the quad has no area; u and v must not be parallel");
        }
        self.light_surface(&light);
        self.assembly.lights.push(light);
        Ok(())
    }

    /// Gives a light with area its surface, so that the camera sees it and light that arrives ends there.
    fn light_surface(&mut self, light: &LightSource) {
        let pi2 = std::f64::consts::PI.powi(2);
        match light {
            LightSource::Sphere { center, radius, power } => {
                let radiance = (power.as_dvec3() / (4.0 * pi2 * radius * radius)).as_vec3();
                let m = self.assembly.add_material(Material::Emitter { radiance });
                self.assembly.spheres.push((*center, *radius, m));
            }
            LightSource::Quad { center, u, v, power } => {
                let area = 4.0 * u.cross(*v).length();
                let radiance = (power.as_dvec3() / (std::f64::consts::PI * area)).as_vec3();
                let m = self.assembly.add_material(Material::Emitter { radiance });
                self.assembly.add_mesh(shapes::quad(*center, *u, *v), |_| m);
            }
            _ => {}
        }
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
            return self.wrong(
                "camera.resolution",
                format!("must lie in 1 to {MAX_RESOLUTION}, got {resolution:?}"),
            );
        }
        Ok(CameraSource {
            position,
            target,
            up,
            fov_y: c.fov_y,
            resolution: resolution.map(|r| r as u32),
        })
    }

    fn finish(mut self, name: String, camera: CameraSource, render: RenderFile) -> Checked<Scene> {
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
            LightSource::Sphere { center, radius, power } => Light::Sphere {
                center: local(*center),
                radius: *radius as f32,
                power: *power,
            },
            LightSource::Quad { center, u, v, power } => Light::Quad {
                center: local(*center),
                u: u.as_vec3(),
                v: v.as_vec3(),
                power: *power,
            },
            LightSource::Spot { position, direction, half, falloff, power } => Light::Spot {
                position: local(*position),
                direction: direction.as_vec3(),
                cos_half: libm::cos(*half) as f32,
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
        let forward = (camera.target - camera.position).normalize();
        let right = forward.cross(camera.up).normalize();
        let texts: Vec<&str> = self.texts.iter().map(String::as_str).collect();
        Ok(Scene {
            name,
            hash: hash_of(&texts),
            origin,
            center: Vec3::ZERO,
            radius: radius as f32,
            camera: Camera {
                position: local(camera.position),
                frame: [right, right.cross(forward), forward].map(|v| v.as_vec3()),
                tan_half_fov_y: crate::math::elementary::tan(camera.fov_y.to_radians() / 2.0) as f32,
                resolution: camera.resolution,
            },
            lights: lights.collect(),
            geometry,
            materials: self.assembly.materials,
            render,
            render_lines: self.locator.lines_of("render"),
            warnings: self.warnings,
        })
    }
}

/// Moves the assembly to the local origin, in f32, without its zero-area triangles.
fn local_geometry(assembly: &Assembly, origin: DVec3, radius: f64) -> Geometry {
    let mesh = &assembly.mesh;
    let mut g = Geometry {
        positions: mesh.positions.iter().map(|&p| (p - origin).as_vec3()).collect(),
        normals: mesh
            .normals
            .iter()
            .map(|n| n.try_normalize().unwrap_or(DVec3::Y).as_vec3())
            .collect(),
        uvs: mesh.uvs.iter().map(|t| t.as_vec2()).collect(),
        spheres: assembly
            .spheres
            .iter()
            .map(|&(c, r, material)| Sphere {
                center: (c - origin).as_vec3(),
                radius: r as f32,
                material,
            })
            .collect(),
        ..Default::default()
    };
    // Products of edges shorter than this vanish against the scene in f32.
    let smallest = radius * radius * 1e-24;
    for (i, t) in mesh.triangles.iter().enumerate() {
        let [a, b, c] = t.map(|i| mesh.positions[i as usize]);
        if (b - a).cross(c - a).length() <= smallest {
            g.zero_area += 1;
            continue;
        }
        g.triangles.push(*t);
        g.corner_normals.push(mesh.corner_normals[i]);
        g.corner_uvs.push(mesh.corner_uvs[i]);
        g.triangle_materials.push(mesh.materials[i]);
    }
    g
}
