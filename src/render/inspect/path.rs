//! The surfaces that a pixel's view rays meet, as a tree.

use crate::math::rgb::Rgb;
use crate::render::view::{ViewMeeting, ViewRecorder};
use crate::scene::{Material, Scene};
use glam::Vec3;
use serde::Serialize;

/// What a surface does with light.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum SurfaceKind {
    /// Scatters it in all directions.
    Diffuse,
    /// Reflects it.
    Mirror,
    /// Reflects it, more at grazing angles.
    Metal,
    /// Reflects and refracts it.
    Dielectric,
    /// Sends out its own.
    Emitter,
}

impl SurfaceKind {
    /// That of a material.
    pub fn of(material: &Material) -> Self {
        match material {
            Material::Diffuse { .. } => Self::Diffuse,
            Material::Mirror { .. } => Self::Mirror,
            Material::Metal { .. } => Self::Metal,
            Material::Dielectric { .. } => Self::Dielectric,
            Material::Emitter { .. } => Self::Emitter,
        }
    }

    /// Its name in lower case.
    pub fn name(self) -> &'static str {
        match self {
            Self::Diffuse => "diffuse",
            Self::Mirror => "mirror",
            Self::Metal => "metal",
            Self::Dielectric => "dielectric",
            Self::Emitter => "emitter",
        }
    }
}

/// A surface that a view ray meets. A ray that meets nothing leaves no vertex.
#[derive(Clone, Copy, Debug)]
pub struct PathVertex {
    /// View rays across and down the pixel, in the grid that the ray belongs to.
    pub rays_per_axis: u32,
    /// Cell of the ray in its grid, row by row.
    pub cell: u32,
    /// Vertex that the ray comes from; None for the camera.
    pub parent: Option<usize>,
    /// Surfaces met before.
    pub depth: u32,
    /// Position, metres.
    pub position: Vec3,
    /// Unit normal of the flat surface, towards the ray.
    pub normal: Vec3,
    /// Unit direction of the ray.
    pub direction: Vec3,
    /// Length of the ray, metres.
    pub distance: f32,
    /// Whether the ray meets the front side.
    pub front: bool,
    /// Index of the material.
    pub material: u32,
    /// What the material does.
    pub surface: SurfaceKind,
    /// What a radiance of 1 that leaves here towards the ray adds at the camera.
    pub throughput: Rgb,
    /// Radiance at the camera of direct or emitted light here, W/(m² sr), before the mean over rays is taken.
    pub light: Rgb,
    /// Footprint `(dα, dβ)` of the view differential in the surface's plane, metres; zero if the plan carries none.
    pub footprint: [Vec3; 2],
    /// Index of the hit that photons were gathered for here.
    pub hit: Option<usize>,
}

/// Writes down the rays of one pixel.
pub(super) struct PathRecorder<'a> {
    scene: &'a Scene,
    path: &'a mut Vec<PathVertex>,
    rays_per_axis: u32,
    /// Index of the first hit of this grid of rays.
    first_hit: usize,
    cell: u32,
    /// Vertices from the camera to the last one.
    line: Vec<usize>,
}

impl<'a> PathRecorder<'a> {
    /// For the rays of one grid, whose hits are numbered from `first_hit` on.
    pub fn new(scene: &'a Scene, path: &'a mut Vec<PathVertex>, rays_per_axis: u32, first_hit: usize) -> Self {
        Self { scene, path, rays_per_axis, first_hit, cell: 0, line: Vec::new() }
    }
}

impl ViewRecorder for PathRecorder<'_> {
    fn ray(&mut self, cell: u32) {
        self.cell = cell;
        self.line.clear();
    }

    fn meets(&mut self, m: &ViewMeeting) {
        // All behind a surface comes before its other branch, so the parent is the last one a step nearer.
        self.line.truncate(m.depth as usize);
        let parent = self.line.last().copied();
        self.line.push(self.path.len());
        self.path.push(PathVertex {
            rays_per_axis: self.rays_per_axis,
            cell: self.cell,
            parent,
            depth: m.depth,
            position: m.surface.position,
            normal: m.surface.normal,
            direction: m.direction,
            distance: m.distance,
            front: m.surface.front,
            material: m.surface.material,
            surface: SurfaceKind::of(&self.scene.materials[m.surface.material as usize]),
            throughput: m.throughput,
            light: m.light,
            footprint: m.footprint,
            hit: m.hit.map(|h| self.first_hit + h),
        });
    }
}
