//! Shapes of a scene file: from their keys to placed meshes and spheres.

use super::assembly::LightSource;
use super::{Checked, Loader, MAX_LENGTH};
use crate::math::rgb::Rgb;
use crate::scene::geometry::NONE;
use crate::scene::obj::{self, CREASE_ANGLE};
use crate::scene::quake;
use crate::scene::scene_file::{LightFile, RotateFile, ShapeFile};
use crate::scene::shapes::{self, Placement};
use crate::scene::{Material, SceneError};
use glam::{DMat3, DVec3};

/// Facets around a ring, if none are given.
const SEGMENTS: i64 = 256;
/// Most of them.
const MAX_SEGMENTS: i64 = 1_000_000;

impl Loader<'_> {
    /// Makes sure that the triangles of all shapes whose number the file tells can be had, before any is made. Meshes
    /// are counted when they are read.
    pub(super) fn foresee(&mut self, shapes: &[ShapeFile], lights: &[LightFile]) -> Checked<()> {
        for (i, s) in shapes.iter().enumerate() {
            let key = format!("shapes[{i}]");
            match s.kind.as_str() {
                "quad" => self.reserve(&key, 2, 4, "leave shapes out")?,
                "box" => self.reserve(&key, 12, 24, "leave shapes out")?,
                "ring" => {
                    // Numbers out of range are refused in their turn.
                    let n = s.segments.unwrap_or(SEGMENTS).clamp(0, MAX_SEGMENTS) as u64;
                    self.reserve(&format!("{key}.segments"), 6 * n, 4 * n, "lower segments, or leave shapes out")?;
                }
                _ => {}
            }
        }
        for (i, _) in lights.iter().enumerate().filter(|(_, l)| l.kind == "quad") {
            self.reserve(&format!("lights[{i}]"), 2, 4, "leave lights out")?;
        }
        Ok(())
    }

    pub(super) fn placement(&self, key: &str, shape: &ShapeFile) -> Checked<Placement> {
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

    pub(super) fn shape(&mut self, key: &str, s: &ShapeFile) -> Checked<()> {
        let at = |k: &str| format!("{key}.{k}");
        let allowed: &[&str] = match s.kind.as_str() {
            "mesh" => &["file", "crease_angle"],
            "quad" => &["center", "u", "v"],
            "box" => &["half_size"],
            "sphere" => &["center", "radius"],
            "ring" => &["inner", "outer", "height", "segments"],
            other => {
                return self.wrong(at("kind"), format!("unknown kind `{other}`; use mesh, quad, box, sphere or ring"));
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
        let place = self.placement(key, s)?;
        let material = match &s.material {
            Some(name) => match self.material_index.get(name) {
                Some(m) => Some(*m),
                None => {
                    let known: Vec<_> = self.material_index.keys().cloned().collect();
                    return self.wrong(
                        at("material"),
                        if known.is_empty() {
                            format!("no material `{name}`; add [materials.{name}]")
                        } else {
                            format!("no material `{name}`; there are {}", known.join(", "))
                        },
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
                self.within(key, &[center - radius, center + radius])?;
                self.assembly.spheres.push((center, radius, material));
                if let Some(radiance) = self.emission(material) {
                    let flux = radiance.as_dvec3() * (4.0 * std::f64::consts::PI.powi(2) * radius * radius);
                    let light = LightSource::Sphere { center, radius, power: flux.as_vec3() };
                    self.assembly.lights.push((at("material"), light));
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
                let segments = s.segments.unwrap_or(SEGMENTS);
                if !(3..=MAX_SEGMENTS).contains(&segments) {
                    return self.wrong(at("segments"), format!("must lie in 3 to {MAX_SEGMENTS}, got {segments}"));
                }
                shapes::ring(inner, outer, height, segments as u32)
            }
            _ => return self.mesh(key, s, &place, material),
        };
        // Only a mesh may lack a material, and it has been dealt with.
        let material = material.unwrap_or(NONE);
        let mesh = mesh.placed(&place);
        self.within(key, &mesh.positions)?;
        self.assembly.add_mesh(mesh, |_| material);
        match emitted {
            Some(light) => self.assembly.lights.push((at("material"), light)),
            None => self.emit_from(&at("material"), first, material),
        }
        Ok(())
    }

    pub(super) fn mesh(&mut self, key: &str, s: &ShapeFile, place: &Placement, material: Option<u32>) -> Checked<()> {
        let Some(name) = &s.file else {
            return self.wrong(format!("{key}.file"), "is missing; name an OBJ file or a Quake 3 map");
        };
        if quake::is_map(name) {
            return self.map(key, name, place, material);
        }
        let crease = s.crease_angle.unwrap_or(CREASE_ANGLE);
        if !(0.0..=180.0).contains(&crease) {
            return self.wrong(format!("{key}.crease_angle"), format!("must lie in [0, 180] degrees, got {crease}"));
        }
        let (path, text) = match self.files.read(name) {
            Ok(found) => found,
            Err(SceneError::Unreadable { file, why }) if key != "mesh" => {
                return self.wrong(format!("{key}.file"), format!("{}: {why}", file.display()));
            }
            Err(e) => return Err(e),
        };
        // Material files and textures are named relative to the mesh.
        let folder = std::path::Path::new(name).parent().map(|p| p.to_path_buf()).unwrap_or_default();
        let material_file =
            |mtl: &std::path::Path| self.files.read(&folder.join(mtl).to_string_lossy()).ok().map(|(_, text)| text);
        let (triangles, vertices) = obj::count(&text);
        self.reserve(&format!("{key}.file"), triangles, vertices, "give a smaller mesh, or leave shapes out")?;
        let obj = obj::read(&path, &text, crease, &material_file).map_err(|e| match e.line {
            0 => SceneError::Whole { file: path.clone(), what: e.what },
            line => SceneError::At { file: path.clone(), line, key: "OBJ".into(), what: e.what },
        })?;
        self.warnings.extend(obj.warnings);
        self.texts.push(text);
        self.texts.push(obj.material_text);
        let first = self.assembly.mesh.triangles.len();
        let mesh = obj.mesh.placed(place);
        self.within(key, &mesh.positions)?;
        if let Some(material) = material {
            self.assembly.add_mesh(mesh, |_| material);
            self.emit_from(&format!("{key}.material"), first, material);
            return Ok(());
        }
        let mut own = Vec::new();
        for (material, mut file) in obj.materials {
            file.texture = file.texture.map(|t| folder.join(t).to_string_lossy().into_owned());
            let made = self.material(&format!("material {material}"), &file).map_err(|e| match e {
                SceneError::At { key, what, .. } => {
                    SceneError::Whole { file: path.clone(), what: format!("its {key}: {what}") }
                }
                other => other,
            })?;
            own.push(self.assembly.add_material(material, made));
        }
        let mut fallback = NONE;
        if mesh.materials.contains(&NONE) {
            self.warnings.push(format!("{}: surfaces without a material are grey", path.display()));
            fallback =
                self.assembly.add_material("none", Material::Diffuse { reflectance: Rgb::splat(0.8), texture: None });
        }
        self.assembly.add_mesh(mesh, |m| own.get(m as usize).copied().unwrap_or(fallback));
        // Each emissive material of the mesh is a light of its triangles; they come in runs.
        let mut start = first;
        while start < self.assembly.mesh.materials.len() {
            let material = self.assembly.mesh.materials[start];
            let run = self.assembly.mesh.materials[start..].iter().take_while(|&&m| m == material).count();
            if let Some(radiance) = self.emission(material) {
                let light = LightSource::Mesh { first: start, count: run, radiance };
                self.assembly.lights.push((format!("{key}.file"), light));
            }
            start += run;
        }
        Ok(())
    }

    /// Whether a placed shape lies where coordinates can be worked with.
    pub(super) fn within(&self, key: &str, points: &[DVec3]) -> Checked<()> {
        let reach = points.iter().fold(0.0, |m: f64, p| m.max(p.abs().max_element()));
        if reach <= MAX_LENGTH {
            return Ok(());
        }
        self.wrong(key, format!("reaches {reach:e} m from the origin, {MAX_LENGTH:e} m at most; scale or move it"))
    }

    pub(super) fn emission(&self, material: u32) -> Option<Rgb> {
        match self.assembly.materials.get(material as usize) {
            Some(Material::Emitter { radiance }) => Some(*radiance),
            _ => None,
        }
    }

    /// Makes all triangles from `first` on a light, if their material emits.
    pub(super) fn emit_from(&mut self, key: &str, first: usize, material: u32) {
        if let Some(radiance) = self.emission(material) {
            let count = self.assembly.mesh.triangles.len() - first;
            self.assembly.lights.push((key.to_owned(), LightSource::Mesh { first, count, radiance }));
        }
    }
}
