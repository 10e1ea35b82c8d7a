//! What a render needs of memory, told before it is allocated.
//!
//! Sizes are those of the values; where lists grow by doubling, or a step holds a copy, both count. What cannot be
//! foreseen is left out: photons that one view hit gathers, four bytes each for every thread.

use crate::photons::irradiance::{global_photons, layer};
use crate::photons::map::{MapParts, built_bytes, map_bytes};
use crate::photons::{StoredPhoton, kd_tree};
use crate::render::error_estimate;
use crate::render::evidence::Pilot;
use crate::render::plan::Plan;
use crate::render::settings::{RenderSettings, SettingError};
use crate::scene::Scene;
use crate::scene::memory::{Shortage, bytes, check, text};
use crate::trace::Intersector;
use glam::{DVec3, Vec3};
use serde::Serialize;

/// Bytes that the parts of a render need at their highest.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct MemoryNeed {
    /// Films, their error estimates, the tiles of a pass and finished images, of all estimators.
    pub images: u64,
    /// Photons that a pass is expected to store.
    pub photons_stored: u64,
    /// These photons, and those of the pass before where it is kept until the next is done.
    pub photons: u64,
    /// Their maps and what building them takes, and the maps of the pass before where it is kept.
    pub maps: u64,
}

impl MemoryNeed {
    /// All of it.
    pub fn total(&self) -> u64 {
        self.images.saturating_add(self.photons).saturating_add(self.maps)
    }

    /// That of a render of `estimators` images, of which each pass stores so many photons in maps with those `parts`, and
    /// again in the structures of final gathering if it `gathers`. `passes` are held at once.
    pub fn new(
        settings: &RenderSettings,
        estimators: usize,
        photons_stored: u64,
        parts: MapParts,
        gathers: bool,
        passes: usize,
    ) -> Self {
        // While they are traced they are in the parts of the threads and in the whole, but there are no maps yet, which
        // take more than that.
        let gathering = if gathers { gather_bytes() } else { 0 };
        Self {
            images: image_bytes(settings.size, estimators),
            photons_stored,
            photons: bytes(photons_stored, passes * size_of::<StoredPhoton>()),
            maps: bytes(photons_stored, built_bytes(parts) + passes * map_bytes(parts) + gathering),
        }
    }

    /// In words.
    pub fn text(&self) -> String {
        let [whole, photons, maps, images] = [self.total(), self.photons, self.maps, self.images].map(text);
        format!("some {whole} of memory: photons {photons}, maps {maps}, images {images}")
    }

    /// Holds it against what the machine can give now.
    ///
    /// # Errors
    /// If it is more: what was asked for, what it needs, what there is, and what to lower.
    pub fn check(&self, settings: &RenderSettings) -> Result<(), Shortage> {
        let [w, h] = settings.size;
        let (photons, stored) = (settings.photons, self.photons_stored);
        let index = u64::from(u32::MAX);
        let needed = if stored < index { self.total() } else { u64::MAX };
        let asked = format!("{photons} photons a pass, of which {stored} are stored, and images of {w}x{h} pixels");
        let advice = if self.images > self.photons.saturating_add(self.maps) {
            IMAGE_ADVICE
        } else {
            "lower photons (--photons, render.photons) or max_depth"
        };
        check(asked, needed, advice)
    }
}

/// Bytes of a stored photon in what final gathering looks up, at its highest: the photon with its tree, what building that
/// takes, and an estimate in the first layer and half of one in all others, of this pass and of the one before.
fn gather_bytes() -> usize {
    let photons = global_photons::bytes(1) + kd_tree::BYTES_PER_BUILT_ENTRY;
    photons + 2 * (layer::BYTES_PER_ESTIMATE + layer::BYTES_PER_ESTIMATE / 2)
}

const IMAGE_ADVICE: &str = "lower the size (--size, size, camera.resolution) or take fewer estimators";

/// Bytes that images of `size` pixels under so many estimators need.
fn image_bytes(size: [u32; 2], estimators: usize) -> u64 {
    let pixels = u64::from(size[0]) * u64::from(size[1]);
    let film = size_of::<DVec3>() + error_estimate::BYTES_PER_PIXEL;
    // A tile's pixels and the finished image.
    let image = 2 * size_of::<Vec3>();
    bytes(pixels.saturating_mul(estimators.max(1) as u64), film + image)
}

/// Makes sure that the images of so many estimators can be had, before any film is.
///
/// # Errors
/// If they cannot; one line.
pub fn check_images(settings: &RenderSettings, estimators: usize) -> Result<(), SettingError> {
    let [w, h] = settings.size;
    let asked = match estimators {
        0 | 1 => format!("{w}x{h} pixels"),
        n => format!("{n} images of {w}x{h} pixels"),
    };
    check(asked, image_bytes(settings.size, estimators), IMAGE_ADVICE)
        .map_err(|short| SettingError { place: "size".into(), what: short.to_string() })
}

/// What a pass is expected to need where `passes` are held at once.
///
/// Without a pilot it takes the most that a pass can store, and sends one where that would not fit.
pub fn foreseen(
    scene: &Scene,
    intersector: &Intersector,
    settings: &RenderSettings,
    plan: &Plan,
    pilot: Option<&Pilot>,
    estimators: usize,
    passes: usize,
) -> MemoryNeed {
    let need = |stored| MemoryNeed::new(settings, estimators, stored, plan.map_parts(), plan.gathers(), passes);
    let most = need(most_stored(settings, plan));
    let likely = |pilot: &Pilot| need(likely_stored(settings, plan, pilot).min(most.photons_stored));
    match pilot {
        Some(pilot) => likely(pilot),
        None if most.check(settings).is_ok() => most,
        None => likely(&Pilot::send(scene, intersector, settings)),
    }
}

/// Most photons that a pass can store, whatever the scene: one for each surface that a path may meet.
fn most_stored(settings: &RenderSettings, plan: &Plan) -> u64 {
    let each = if plan.bounces() { u64::from(settings.max_depth) } else { u64::from(plan.needs_photons()) };
    // Those for the caustic map are others than those for the rest.
    let caustic = u64::from(plan.projection.is_some() && (plan.bounces() || plan.direct_map));
    settings.photons.saturating_mul(each + caustic)
}

/// Photons that a pass is expected to store, by what the pilot's did.
fn likely_stored(settings: &RenderSettings, plan: &Plan, pilot: &Pilot) -> u64 {
    let [caustic, global] = pilot.stored_per_photon();
    // Of the photons that leave through marked cells so many more become caustic.
    let caustic = plan.projection.as_ref().map_or(caustic, |map| (caustic / map.share()).min(1.0));
    let each = f64::from(u8::from(plan.direct_map || plan.gathers()))
        + if plan.caustic_map || plan.gathers() { caustic } else { 0.0 }
        + if plan.bounces() { global } else { 0.0 };
    // Rounded up, and never more than there are numbers for: a cast saturates.
    (settings.photons as f64 * each).ceil() as u64
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::estimate::registry::estimators;
    use crate::render::{Renderer, Silent};
    use crate::scene::open;
    use crate::scene::scene_file::RenderFile;

    fn renderer(photons: i64, names: &str) -> Renderer {
        let scene = open("cornell").expect("built in");
        let flags = RenderFile { photons: Some(photons), ..Default::default() };
        let settings = RenderSettings::new(&scene, &flags, Some([8, 8]), 1).expect("valid");
        Renderer::new(scene.into(), settings, estimators(names).expect("registered"))
    }

    /// The pilot's forecast against the photons that were stored.
    #[test]
    fn the_number_of_stored_photons_is_foreseen() {
        let mut r = renderer(50_000, "integrated");
        let foreseen = r.memory().photons_stored as f64;
        r.step(&Silent);
        let stored = r.stored();
        let stored = (stored.direct + stored.caustic + stored.global) as f64;
        // Some 100 000 photons, whose paths are independent: 1 % is more than three standard deviations.
        assert!((foreseen / stored - 1.0).abs() < 0.01, "{foreseen} {stored}");
    }

    #[test]
    fn what_cannot_be_had_is_refused_before_it_is_allocated() {
        let mut r = renderer(1 << 31, "integrated");
        let why = r.memory().check(r.settings()).expect_err("terabytes").to_string();
        assert!(why.starts_with("2147483648 photons a pass, of which ") && why.contains("--photons"), "{why}");
        let mut settings = r.settings().clone();
        settings.size = [8192, 8192];
        let why = check_images(&settings, 100_000).expect_err("terabytes").to_string();
        assert!(why.starts_with("size: 100000 images of 8192x8192 pixels would need ") && !why.contains('\n'), "{why}");
        // Numbers beyond 64 bits saturate.
        settings.photons = u64::MAX;
        let need = MemoryNeed::new(&settings, usize::MAX, u64::MAX, MapParts { kd_tree: true, overlap: true }, true, 2);
        assert_eq!(need.total(), u64::MAX);
    }
}
