//! The frame loop: update, emit, balance, cull, estimate, draw (section 4.3).

use crate::math::rgb::Rgb;
use crate::realtime::estimate::{Estimator, Place, Scratch};
use crate::realtime::flashlight;
use crate::realtime::mesh::Mesh;
use crate::realtime::photon::Photon;
use crate::realtime::photon_map::{CellOf, PhotonMap};
use crate::realtime::picture;
use crate::realtime::settings::RealtimeSettings;
use crate::realtime::tracer::{TraceCounts, Tracer};
use crate::realtime::view::{Sample, View};
use crate::realtime::world::{self, World};
use crate::render::film::Image;
use crate::scene::geometry::NONE;
use crate::scene::{Camera, Light, Scene};
use glam::Vec3;
use rayon::prelude::*;
use serde::Serialize;
use std::sync::Arc;
use std::time::Instant;

/// Wall seconds of the phases of a frame.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct PhaseSeconds {
    /// Moving the scene.
    pub update: f64,
    /// Tracing this frame's photons.
    pub emit: f64,
    /// Building the trees over the photons of all frames.
    pub balance: f64,
    /// Casting view rays: which triangles are visible.
    pub cull: f64,
    /// Estimating irradiance at their vertices.
    pub estimate: f64,
    /// Blending irradiance and texture into pixels.
    pub draw: f64,
}

impl PhaseSeconds {
    /// Names of the phases in their order.
    pub const NAMES: [&str; 6] = ["update", "emit", "balance", "cull", "estimate", "draw"];

    /// The phases in their order.
    pub fn all(&self) -> [f64; 6] {
        [self.update, self.emit, self.balance, self.cull, self.estimate, self.draw]
    }

    /// Seconds of the whole frame.
    pub fn total(&self) -> f64 {
        self.all().iter().sum()
    }
}

/// What a frame did.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct FrameReport {
    /// Number of the frame, from 0.
    pub frame: u64,
    /// Time of the scene, seconds.
    pub time: f64,
    /// Where the wall time went.
    pub seconds: PhaseSeconds,
    /// Photons emitted in this frame.
    pub photons_emitted: u64,
    /// Photons stored in this frame.
    pub photons_stored: u64,
    /// Rays of photons traced in this frame.
    pub photon_rays: u64,
    /// Of these, rays that met nothing.
    pub photon_rays_lost: u64,
    /// Photons in the map.
    pub photons_in_map: u64,
    /// Frames whose photons are in it.
    pub frames_in_map: u64,
    /// Radius of a search, metres.
    pub search_radius: f32,
    /// View rays cast.
    pub view_rays: u64,
    /// Triangles of the mesh that a pixel shows.
    pub triangles_visible: u64,
    /// Irradiance estimates.
    pub estimates: u64,
    /// Mean change of the irradiance of the vertices that this frame and the one before estimated, over its mean.
    pub fluctuation: f64,
}

/// The engine: it owns a scene at a moment and what was made of it, and makes the next frame.
pub struct Engine {
    scene: Arc<Scene>,
    settings: RealtimeSettings,
    world: World,
    mesh: Arc<Mesh>,
    map: PhotonMap,
    tracer: Tracer,
    view: View,
    lights: Vec<Light>,
    /// Number of the next frame.
    next: u64,
    spare: Vec<Photon>,
    /// Irradiance of the front and back of each vertex, or of each corner of each triangle, and the map it came from.
    irradiance: Vec<(Rgb, u64)>,
    /// Counts the maps that were balanced.
    map_version: u64,
    report: FrameReport,
    wanted: Vec<u32>,
    /// Whether each face of each triangle has been met in this picture; kept from frame to frame.
    seen: Vec<bool>,
}

impl Engine {
    /// An engine before its first frame.
    pub fn new(scene: &Arc<Scene>, settings: RealtimeSettings) -> Self {
        let mesh = Arc::new(mesh(scene, &settings));
        Self::with_mesh(scene, settings, mesh)
    }

    /// Whether a scene differs from the engine's in nothing but its camera.
    pub fn shows(&self, scene: &Scene) -> bool {
        Arc::ptr_eq(&scene.geometry, &self.scene.geometry)
            && scene.motions == self.scene.motions
            && scene.lights == self.scene.lights
            && same_materials(scene, &self.scene)
    }

    /// Goes on with another scene or other settings; keeps the mesh while it serves, and photons while what made them is
    /// the same.
    pub fn change(&mut self, scene: &Arc<Scene>, settings: RealtimeSettings) {
        let same_surfaces = Arc::ptr_eq(&scene.geometry, &self.scene.geometry) && scene.motions == self.scene.motions;
        let mesh_of = |s: &RealtimeSettings| (s.mesh_refinement, s.max_edge.to_bits());
        let keeps_mesh = same_surfaces && mesh_of(&settings) == mesh_of(&self.settings);
        let keeps_photons =
            same_surfaces && same_materials(scene, &self.scene) && photons_of(&settings) == photons_of(&self.settings);
        if !(keeps_mesh && keeps_photons) {
            let mesh = keeps_mesh.then(|| Arc::clone(&self.mesh));
            let next = self.next;
            let time = self.report.time;
            *self = match mesh {
                Some(mesh) => Self::with_mesh(scene, settings, mesh),
                None => Self::new(scene, settings),
            };
            // Frames are numbered on, so that whoever follows them sees no number twice.
            self.next = next;
            self.report.time = time;
            return;
        }
        let looks_alike = settings.cull_back_faces == self.settings.cull_back_faces;
        self.scene = Arc::clone(scene);
        self.settings = settings;
        self.world.set_lights(scene);
        if !looks_alike {
            self.view.forget();
        }
        self.balance();
        self.map_version += 1;
        self.clear_irradiance();
    }

    /// Goes on with the scene's lights at other places, or others of the same number and flux: photons of the frames
    /// before stay until their frames leave the map.
    pub fn move_lights(&mut self, lights: &[Light]) {
        let mut scene = (*self.scene).clone();
        scene.lights = lights.to_vec();
        self.scene = Arc::new(scene);
        self.world.set_lights(&self.scene);
    }

    fn with_mesh(scene: &Arc<Scene>, settings: RealtimeSettings, mesh: Arc<Mesh>) -> Self {
        let world = World::new(scene, settings.moving, settings.acceleration);
        let lights = lights(scene, &world, &settings, &scene.camera);
        let mut engine = Self {
            tracer: Tracer::new(&settings, &lights),
            map: PhotonMap::new(settings.accumulation_frames),
            scene: Arc::clone(scene),
            world,
            mesh,
            view: View::default(),
            lights,
            next: 0,
            spare: Vec::new(),
            irradiance: Vec::new(),
            map_version: 0,
            report: FrameReport::default(),
            wanted: Vec::new(),
            seen: Vec::new(),
            settings,
        };
        engine.clear_irradiance();
        engine
    }

    fn clear_irradiance(&mut self) {
        let count =
            if self.settings.estimate_cache { 2 * self.mesh.vertices.len() } else { 6 * self.mesh.triangles.len() };
        self.irradiance.clear();
        self.irradiance.resize(count, (Rgb::ZERO, 0));
    }

    /// Moves the scene to the time `seconds`, emits the photons of a frame and balances the map over the last ones.
    ///
    /// `camera` holds the flashlight, if there is one.
    pub fn step(&mut self, seconds: f64, camera: &Camera) {
        let started = Instant::now();
        self.world.update(&self.scene, seconds);
        self.lights = lights(&self.scene, &self.world, &self.settings, camera);
        if !self.tracer.serves(&self.lights) {
            self.tracer = Tracer::new(&self.settings, &self.lights);
        }
        let updated = Instant::now();
        let mut store = std::mem::take(&mut self.spare);
        let counts = self.tracer.trace(&self.scene, &self.world, &self.lights, &self.settings, self.next, &mut store);
        self.spare = self.map.store(self.next, store);
        let emitted = Instant::now();
        self.balance();
        self.map_version += 1;
        let balanced = Instant::now();
        self.report = FrameReport {
            frame: self.next,
            time: seconds,
            seconds: PhaseSeconds {
                update: (updated - started).as_secs_f64(),
                emit: (emitted - updated).as_secs_f64(),
                balance: (balanced - emitted).as_secs_f64(),
                ..PhaseSeconds::default()
            },
            ..self.counted(counts)
        };
        self.next += 1;
    }

    fn balance(&mut self) {
        let cells = self.scene.cells.as_deref();
        // Outside of the map is a cell too.
        let of = |p: Vec3| cells.and_then(|c| c.cluster(p)).unwrap_or(u32::MAX);
        self.map.balance(&self.settings, cells.map(|_| &of as CellOf));
    }

    fn counted(&self, c: TraceCounts) -> FrameReport {
        FrameReport {
            photons_emitted: c.emitted,
            photons_stored: c.stored,
            photon_rays: c.rays,
            photon_rays_lost: c.lost,
            photons_in_map: self.map.photons().len() as u64,
            frames_in_map: self.map.frame_count() as u64,
            ..FrameReport::default()
        }
    }

    /// Draws what a camera sees, linear radiance in W/(m² sr); `exposure` is that of the screen, which blending by offset
    /// needs. Without a step in between, vertices that were estimated are not estimated again.
    pub fn draw(&mut self, camera: &Camera, size: [u32; 2], exposure: f32) -> Image {
        let started = Instant::now();
        let s = &self.settings;
        let view_rays = self.view.update(&self.scene, &self.world, &self.mesh, camera, size, s.cull_back_faces);
        let triangles = self.collect_wanted();
        let culled = Instant::now();
        let (estimates, fluctuation) = self.estimate();
        let estimated = Instant::now();
        let image = self.blend(size, exposure);
        let r = &mut self.report;
        r.seconds.cull = (culled - started).as_secs_f64();
        r.seconds.estimate = (estimated - culled).as_secs_f64();
        r.seconds.draw = estimated.elapsed().as_secs_f64();
        r.view_rays = view_rays;
        r.triangles_visible = triangles;
        r.estimates = estimates;
        r.fluctuation = fluctuation;
        image
    }

    /// Slots of the irradiance that visible triangles need and that is not of this map; returns how many triangles are
    /// visible. A slot that is wanted is marked at once, so that it is wanted once.
    fn collect_wanted(&mut self) -> u64 {
        self.wanted.clear();
        let mut seen = std::mem::take(&mut self.seen);
        seen.clear();
        seen.resize(2 * self.mesh.triangles.len(), false);
        let mut count = 0;
        for s in self.view.samples().iter().filter(|s| s.triangle != NONE) {
            let face = 2 * s.triangle as usize + usize::from(s.back);
            if std::mem::replace(&mut seen[face], true) {
                continue;
            }
            count += 1;
            for slot in self.slots(s) {
                self.wanted.push(slot);
            }
        }
        self.seen = seen;
        self.wanted.retain(|&slot| self.irradiance[slot as usize].1 != self.map_version);
        self.wanted.sort_unstable();
        self.wanted.dedup();
        count
    }

    /// Slots of the irradiance at the corners of what a pixel shows.
    #[inline]
    fn slots(&self, s: &Sample) -> [u32; 3] {
        let back = u32::from(s.back);
        if self.settings.estimate_cache {
            self.mesh.triangles[s.triangle as usize].map(|v| 2 * v + back)
        } else {
            [0, 1, 2].map(|c| 6 * s.triangle + 2 * c + back)
        }
    }

    /// Estimates what is wanted; returns how many estimates that took, and the fluctuation.
    fn estimate(&mut self) -> (u64, f64) {
        let estimator = Estimator::new(&self.scene, &self.world, &self.map, &self.settings);
        self.report.search_radius = estimator.radius();
        let made: Vec<Rgb> = self
            .wanted
            .par_iter()
            .with_min_len(16)
            .map_init(Scratch::default, |scratch, &slot| {
                let vertex = if self.settings.estimate_cache {
                    slot / 2
                } else {
                    self.mesh.triangles[slot as usize / 6][slot as usize % 6 / 2]
                };
                let at = place(&self.mesh, &self.world, vertex, slot % 2 == 1);
                estimator.irradiance(&at, u64::from(slot), scratch)
            })
            .collect();
        let (mut change, mut sum) = (0.0f64, 0.0f64);
        for (&slot, &new) in self.wanted.iter().zip(&made) {
            let (old, version) = self.irradiance[slot as usize];
            if version + 1 == self.map_version && version > 0 {
                let d = (new - old).abs().as_dvec3();
                change += d.x + d.y + d.z;
                sum += f64::from(new.x) + f64::from(new.y) + f64::from(new.z);
            }
            self.irradiance[slot as usize] = (new, self.map_version);
        }
        (made.len() as u64, if sum > 0.0 { change / sum } else { 0.0 })
    }

    fn blend(&self, size: [u32; 2], exposure: f32) -> Image {
        let blending = self.settings.blending;
        let pixels = self
            .view
            .samples()
            .par_iter()
            .with_min_len(size[0].max(1) as usize)
            .map(|s| {
                if s.triangle == NONE {
                    return s.tint;
                }
                let [a, b, c] = self.slots(s).map(|slot| self.irradiance[slot as usize].0);
                let [wb, wc] = s.weights;
                let irradiance = a * (1.0 - wb - wc) + b * wb + c * wc;
                picture::blend(blending, irradiance.max(Rgb::ZERO), s.tint, exposure)
            })
            .collect();
        Image { size, pixels }
    }

    /// Irradiance at vertices of the mesh, W/m², from the map as it is: `(vertex, back)`.
    pub fn irradiance_at(&self, vertices: &[(u32, bool)]) -> Vec<Rgb> {
        let estimator = Estimator::new(&self.scene, &self.world, &self.map, &self.settings);
        vertices
            .par_iter()
            .with_min_len(16)
            .map_init(Scratch::default, |scratch, &(vertex, back)| {
                let at = place(&self.mesh, &self.world, vertex, back);
                estimator.irradiance(&at, 2 * u64::from(vertex) + u64::from(back), scratch)
            })
            .collect()
    }

    /// An estimator over the map as it is.
    pub fn estimator(&self) -> Estimator<'_> {
        Estimator::new(&self.scene, &self.world, &self.map, &self.settings)
    }

    /// What the last frame did.
    pub fn report(&self) -> &FrameReport {
        &self.report
    }

    /// The photon map.
    pub fn map(&self) -> &PhotonMap {
        &self.map
    }

    /// The refined mesh.
    pub fn mesh(&self) -> &Arc<Mesh> {
        &self.mesh
    }

    /// The scene at its moment.
    pub fn world(&self) -> &World {
        &self.world
    }

    /// The lights of the last step: the scene's, where they are, or the flashlight.
    pub fn lights(&self) -> &[Light] {
        &self.lights
    }

    /// The scene.
    pub fn scene(&self) -> &Arc<Scene> {
        &self.scene
    }

    /// The parameters.
    pub fn settings(&self) -> &RealtimeSettings {
        &self.settings
    }
}

fn same_materials(a: &Scene, b: &Scene) -> bool {
    a.materials.len() == b.materials.len() && a.materials.iter().zip(&b.materials).all(|(a, b)| a.is_same(b))
}

/// The refined mesh that the settings ask for.
pub fn mesh(scene: &Scene, s: &RealtimeSettings) -> Mesh {
    Mesh::new(&scene.geometry, s.mesh_refinement, s.max_edge, |p| world::motion_of(scene, p))
}

/// Where a vertex is, with the normal of its front or back.
fn place(mesh: &Mesh, world: &World, vertex: u32, back: bool) -> Place {
    let v = &mesh.vertices[vertex as usize];
    let offset = if v.motion == NONE { Vec3::ZERO } else { world.offset(v.motion) };
    Place { position: v.position + offset, normal: if back { -v.normal } else { v.normal }, inward: v.inward }
}

fn lights(scene: &Scene, world: &World, s: &RealtimeSettings, camera: &Camera) -> Vec<Light> {
    if s.flashlight { vec![flashlight::light(scene, camera)] } else { world.lights().to_vec() }
}

/// The settings without what the photons of a frame do not depend on.
fn photons_of(s: &RealtimeSettings) -> RealtimeSettings {
    use crate::realtime::settings::{Area, Blending, Partition, Search};
    RealtimeSettings {
        mesh_refinement: 0,
        max_edge: 0.0,
        estimate_cache: true,
        max_search_count: 1,
        // A snowball's size follows from the radius.
        max_search_radius: if s.snowball_size > 1 { s.max_search_radius } else { 1.0 },
        radius_heuristic: false,
        radius_alpha: 1.0,
        sphere_slice: true,
        final_gathering: false,
        final_gathering_rays: 1,
        search: Search::Sphere,
        incoming_direction: true,
        slice_height: 1.0,
        area: Area::Disc,
        partition: Partition::None,
        stop_recursion_size: 1,
        blending: Blending::Multiply,
        cull_back_faces: false,
        ..s.clone()
    }
}
