//! From entities to lights, viewpoints and the camera of a scene file.

use super::entities::Entity;
use super::{UNITS_PER_METRE, turned};
use crate::scene::scene_file::{CameraFile, LightFile};
use glam::DVec3;
use std::f64::consts::PI;

/// The game's `light` value where a light names none.
const DEFAULT_LIGHT: f64 = 300.0;

/// Flux of a point light for a `light` value of 1, W.
///
/// The game's compiler gives a surface at `d` units the fraction `7500 light/(255 d²)` of full white. Full white is an
/// irradiance of π W/m² here, under which a white surface has a radiance of 1.
const FLUX: f64 = 4.0 * PI * PI * 7500.0 / (255.0 * UNITS_PER_METRE * UNITS_PER_METRE);

/// Radius of a spot light's cone where it meets its target, if it names none, in units of the game.
const SPOT_RADIUS: f64 = 64.0;

/// Height of the eye above the origin of a place where a player starts, metres.
const EYE: f64 = 26.0 / UNITS_PER_METRE;

/// Height of a light that is put up for want of any above such a place, metres, and how many there are at most.
const LAMP: f64 = 64.0 / UNITS_PER_METRE;
const MOST_LAMPS: usize = 16;

/// A place to look from.
#[derive(Clone, Debug, PartialEq)]
pub struct Viewpoint {
    /// What it is in the map.
    pub name: String,
    /// Eye, metres.
    pub position: DVec3,
    /// Point looked at, metres.
    pub target: DVec3,
}

/// Where players start and where the game looks from between rounds, the latter first.
pub fn viewpoints(entities: &[Entity]) -> Vec<Viewpoint> {
    let classes = [
        "info_player_intermission",
        "info_player_start",
        "info_player_deathmatch",
        "team_CTF_redspawn",
        "team_CTF_bluespawn",
        "team_CTF_redplayer",
        "team_CTF_blueplayer",
    ];
    let mut all = Vec::new();
    for class in classes {
        for e in entities.iter().filter(|e| e.class().eq_ignore_ascii_case(class)) {
            let Some(origin) = e.origin() else { continue };
            let position = origin + DVec3::Y * EYE;
            let aimed = e.get("target").and_then(|t| named(entities, t)).filter(|t| t.distance(position) > 1e-3);
            let target = aimed.unwrap_or_else(|| position + forward(e));
            all.push(Viewpoint { name: format!("{class} {}", all.len() + 1), position, target });
        }
    }
    all
}

/// Direction in which an entity looks: yaw about the vertical, pitch down.
fn forward(e: &Entity) -> DVec3 {
    let [pitch, yaw] = match (e.numbers::<3>("angles"), e.numbers::<1>("angle")) {
        (Some([pitch, yaw, _]), _) => [pitch.clamp(-85.0, 85.0), yaw],
        (None, Some([yaw])) => [0.0, yaw],
        (None, None) => [0.0; 2],
    };
    let (sp, cp) = libm::sincos(pitch.to_radians());
    let (sy, cy) = libm::sincos(yaw.to_radians());
    turned(DVec3::new(cp * cy, cp * sy, -sp))
}

/// Where the entity of a name is.
fn named(entities: &[Entity], name: &str) -> Option<DVec3> {
    entities.iter().find(|e| e.get("targetname") == Some(name))?.origin()
}

/// The camera of a map: the first viewpoint, or from above `center` where there is none.
pub fn camera(viewpoints: &[Viewpoint], center: DVec3, radius: f64) -> CameraFile {
    let (position, target) = match viewpoints.first() {
        Some(v) => (v.position, v.target),
        None => (center + DVec3::new(0.0, 1.5, 1.5) * radius, center),
    };
    CameraFile {
        position: position.to_array(),
        target: target.to_array(),
        up: None,
        fov_y: 65.0,
        resolution: Some([640, 480]),
    }
}

/// The lights of a map, and what is to be said of them. A map without light entities, whose compiler has left them out,
/// gets a point light above places where players start.
pub fn lights(entities: &[Entity], viewpoints: &[Viewpoint], center: DVec3) -> (Vec<LightFile>, Vec<String>) {
    let mut all: Vec<LightFile> =
        entities.iter().filter(|e| e.class() == "light").filter_map(|e| light(e, entities)).collect();
    let mut notes = Vec::new();
    if all.is_empty() {
        let starts: Vec<&Viewpoint> = viewpoints.iter().filter(|v| !v.name.contains("intermission")).collect();
        let step = starts.len().div_ceil(MOST_LAMPS).max(1);
        let mut places: Vec<DVec3> = starts.iter().step_by(step).map(|v| v.position).collect();
        if places.is_empty() {
            places.push(viewpoints.first().map_or(center, |v| v.position));
        }
        let lamps = places.len();
        notes.push(format!("the map has no light entities; {lamps} point lights stand above where players start"));
        all = places.iter().map(|p| point(*p + DVec3::Y * (LAMP - EYE), [FLUX * DEFAULT_LIGHT; 3])).collect();
    }
    (all, notes)
}

fn point(position: DVec3, power: [f64; 3]) -> LightFile {
    LightFile { kind: "point".into(), position: Some(position.to_array()), power: Some(power), ..LightFile::default() }
}

fn light(e: &Entity, entities: &[Entity]) -> Option<LightFile> {
    let position = e.origin()?;
    let value = e.numbers::<1>("light").map_or(DEFAULT_LIGHT, |[v]| v);
    let color = e.numbers::<3>("_color").unwrap_or([1.0; 3]).map(|c| c.clamp(0.0, 1.0));
    let brightest = color.iter().fold(0.0f64, |m, c| m.max(*c));
    // Lights below zero take light away, which nothing does.
    if value <= 0.0 || brightest <= 0.0 {
        return None;
    }
    let power = color.map(|c| c / brightest * value * FLUX);
    let to = e.get("target").and_then(|t| named(entities, t)).map(|t| t - position).filter(|d| d.length() > 1e-3);
    let Some(to) = to else { return Some(point(position, power)) };
    let radius = e.numbers::<1>("radius").map_or(SPOT_RADIUS, |[r]| r.abs().max(1.0)) / UNITS_PER_METRE;
    let half = libm::atan2(radius, to.length());
    // The same intensity as without the cone.
    let share = (1.0 - libm::cos(half)) / 2.0;
    Some(LightFile {
        kind: "spot".into(),
        direction: Some(to.to_array()),
        cone: Some(2.0 * half.to_degrees()),
        ..point(position, power.map(|p| p * share))
    })
}
