//! A photon's path from its light to where it was stored.

use crate::math::rgb::Rgb;
use crate::photons::PhotonKind;
use crate::photons::path::{PhotonMeeting, PhotonRecorder};
use crate::render::inspect::path::SurfaceKind;
use crate::render::pass::Pass;
use crate::scene::Scene;
use glam::Vec3;

/// A surface that a photon met.
#[derive(Clone, Copy, Debug)]
pub struct PhotonVertex {
    /// Position, metres.
    pub position: Vec3,
    /// Unit normal of the flat surface, towards the photon.
    pub normal: Vec3,
    /// Unit direction in which it arrived.
    pub direction: Vec3,
    /// Way from the vertex before, or from the light, metres.
    pub distance: f32,
    /// Index of the material.
    pub material: u32,
    /// What the material does.
    pub surface: SurfaceKind,
    /// Power on arrival, W.
    pub power: Rgb,
    /// Footprint `(dα, dβ)` at scale 1, metres; zero if photons carry none.
    pub footprint: [Vec3; 2],
    /// The kind as which it was stored here.
    pub stored: Option<PhotonKind>,
}

/// Where a photon came from.
#[derive(Clone, Debug)]
pub struct PhotonPath {
    /// Index of its light.
    pub light: usize,
    /// Its number among the light's photons, from 0.
    pub number: u64,
    /// Where it started, metres.
    pub origin: Vec3,
    /// Unit direction in which it started.
    pub direction: Vec3,
    /// Power at the start, W.
    pub power: Rgb,
    /// Surfaces that it met; the last is where it was stored.
    pub vertices: Vec<PhotonVertex>,
}

/// The path of the photon at `index` of the map of that kind in `pass`.
///
/// Photons do not remember their path: a few thousand that were emitted with it are traced again, which is a matter of
/// milliseconds. None if there is no such map or photon.
pub fn photon_path(pass: &Pass, kind: PhotonKind, index: u32) -> Option<PhotonPath> {
    let stored = pass.maps.of(kind)?.stored_index(index)?;
    let mut recorder = Recorder { scene: &pass.scene, vertices: Vec::new() };
    let departure =
        pass.emitter().retrace(u64::from(pass.number), &pass.photons, kind, stored as usize, &mut recorder)?;
    let mut vertices = recorder.vertices;
    let (last, _) = vertices.iter().enumerate().filter(|(_, v)| v.stored == Some(kind)).nth(departure.nth)?;
    vertices.truncate(last + 1);
    Some(PhotonPath {
        light: departure.light,
        number: departure.number,
        origin: departure.emission.origin,
        direction: departure.emission.direction,
        power: departure.power,
        vertices,
    })
}

struct Recorder<'a> {
    scene: &'a Scene,
    vertices: Vec<PhotonVertex>,
}

impl PhotonRecorder for Recorder<'_> {
    fn meets(&mut self, m: &PhotonMeeting) {
        self.vertices.push(PhotonVertex {
            position: m.surface.position,
            normal: m.surface.normal,
            direction: m.direction,
            distance: m.distance,
            material: m.surface.material,
            surface: SurfaceKind::of(&self.scene.materials[m.surface.material as usize]),
            power: m.power,
            footprint: m.footprint,
            stored: m.stored,
        });
    }
}
