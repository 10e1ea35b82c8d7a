//! Lights of a scene file, and the surfaces of those that have area.

use super::assembly::LightSource;
use super::{Checked, Loader};
use crate::scene::scene_file::LightFile;
use crate::scene::{Material, shapes};
use glam::DVec3;

impl Loader<'_> {
    pub(super) fn light(&mut self, key: &str, l: &LightFile) -> Checked<()> {
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
                        if !(1.0..=360.0).contains(&cone) {
                            return self.wrong(at("cone"), format!("must lie in [1, 360] degrees, got {cone}"));
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
            && u.cross(*v) == DVec3::ZERO
        {
            return self.wrong(at("v"), "the quad has no area; u and v must not be parallel");
        }
        self.light_surface(&light);
        self.assembly.lights.push((key.to_owned(), light));
        Ok(())
    }

    /// Gives a light with area its surface, so that the camera sees it and light that arrives ends there.
    pub(super) fn light_surface(&mut self, light: &LightSource) {
        let pi2 = std::f64::consts::PI.powi(2);
        let name = format!("light {}", self.assembly.lights.len() + 1);
        match light {
            LightSource::Sphere { center, radius, power } => {
                let radiance = (power.as_dvec3() / (4.0 * pi2 * radius * radius)).as_vec3();
                let m = self.assembly.add_material(name, Material::Emitter { radiance });
                self.assembly.spheres.push((*center, *radius, m));
            }
            LightSource::Quad { center, u, v, power } => {
                let area = 4.0 * u.cross(*v).length();
                let radiance = (power.as_dvec3() / (std::f64::consts::PI * area)).as_vec3();
                let m = self.assembly.add_material(name, Material::Emitter { radiance });
                self.assembly.add_mesh(shapes::quad(*center, *u, *v), |_| m);
            }
            _ => {}
        }
    }
}
