//! The scene: its materials and lights.

use super::Panes;
use super::widgets::{channels, fact, real, rows, vector};
use crate::scene::scene_file::{LightFile, MaterialFile};
use egui::Ui;

const FAR: f64 = 1e6;

pub(super) fn show(panes: &mut Panes, ui: &mut Ui) {
    let scene = panes.document.scene().clone();
    rows(ui, "scene", |ui| {
        fact(ui, "Name", scene.name.as_str());
        fact(ui, "Triangles", scene.geometry.triangles.len().to_string());
        fact(ui, "Spheres", scene.geometry.spheres.len().to_string());
        fact(ui, "Radius", format!("{:.4} m", scene.radius));
        fact(ui, "Hash", format!("{:016x}", scene.hash));
    });
    let file = panes.document.scene_file();
    ui.separator();
    ui.strong("Lights");
    let mut lights = file.lights.clone();
    for (i, light) in lights.iter_mut().enumerate() {
        ui.label(format!("{} {}", i + 1, light.kind));
        rows(ui, &format!("light {i}"), |ui| edit_light(ui, light, f64::from(scene.radius)));
    }
    if lights != file.lights {
        panes.document.session.lights = Some(lights);
    }
    ui.separator();
    ui.strong("Materials");
    for (name, material) in &file.materials {
        let mut edited = material.clone();
        ui.label(format!("{name}: {}", material.kind));
        rows(ui, &format!("material {name}"), |ui| edit_material(ui, &mut edited));
        if edited != *material {
            panes.document.session.materials.insert(name.clone(), edited);
        }
    }
}

fn edit_light(ui: &mut Ui, light: &mut LightFile, radius: f64) {
    let speed = radius * 0.005;
    for (label, value) in [("Position", &mut light.position), ("Centre", &mut light.center)] {
        if let Some(at) = value {
            vector(ui, label, "metres", at, speed, -FAR..=FAR);
        }
    }
    if let Some(direction) = &mut light.direction {
        vector(ui, "Direction", "along which the light travels; any length", direction, 0.01, -1.0..=1.0);
    }
    if let Some(r) = &mut light.radius {
        real(ui, "Radius", "of the sphere", r, radius * 1e-4..=radius, " m");
    }
    if let Some(cone) = &mut light.cone {
        real(ui, "Cone", "full angle", cone, 1.0..=360.0, "°");
    }
    if let Some(falloff) = &mut light.falloff {
        real(ui, "Falloff", "exponent of the cosine; 0 is uniform", falloff, 0.0..=100.0, "");
    }
    if let Some(power) = &mut light.power {
        channels(
            ui,
            "Power",
            "radiant flux Φ per channel, W; photons are shared by power (Pedersen 2011, eq. 2)",
            power,
            0.0..=1e9,
        );
    }
    if let Some(irradiance) = &mut light.irradiance {
        channels(ui, "Irradiance", "on a plane that faces the light, W/m²", irradiance, 0.0..=1e9);
    }
}

fn edit_material(ui: &mut Ui, material: &mut MaterialFile) {
    let kind = material.kind.clone();
    if matches!(kind.as_str(), "diffuse" | "mirror" | "metal") {
        let default = match kind.as_str() {
            "diffuse" => 0.8,
            "mirror" => 1.0,
            _ => 0.9,
        };
        let mut value = material.reflectance.unwrap_or([default; 3]);
        if channels(ui, "Reflectance", "ρ per channel, 0 to 1", &mut value, 0.0..=1.0) {
            material.reflectance = Some(value);
        }
    }
    if kind == "dielectric" {
        let mut ior = material.ior.unwrap_or(1.5);
        if real(ui, "Refractive index", "against the outside", &mut ior, 1.0..=3.0, "") {
            material.ior = Some(ior);
        }
        let mut value = material.transmittance.unwrap_or([1.0; 3]);
        if channels(ui, "Transmittance", "per metre and channel", &mut value, 0.0..=1.0) {
            material.transmittance = Some(value);
        }
    }
    if let Some(radiance) = &mut material.radiance {
        channels(ui, "Radiance", "W/(m² sr)", radiance, 0.0..=1e9);
    }
}
