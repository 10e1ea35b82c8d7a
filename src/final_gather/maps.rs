//! What gather rays look up: the photons of a pass, and the irradiance precomputed from them.

use crate::estimate::{FinalGatherMethod, FinalGathering};
use crate::photons::irradiance::global_photons::Search;
use crate::photons::irradiance::surface_area::SurfaceAreas;
use crate::photons::irradiance::{GlobalPhotons, IrradiancePyramid, PyramidSettings};
use crate::photons::{PhotonKind, StoredPhotons};
use crate::scene::Scene;
use std::time::Instant;

/// Structures for the final gatherings of one pass, each made once.
#[derive(Default)]
pub struct GatherMaps {
    /// All photons; kept only where something looks photons up.
    photons: Option<GlobalPhotons>,
    /// Caustic photons, for second gathers.
    caustic: Option<GlobalPhotons>,
    pyramids: Vec<(PyramidSettings, IrradiancePyramid)>,
    /// Radius of the first search where none is asked for, metres.
    automatic_radius: f32,
    /// Factor on all radii: the square root of the pass's area factor.
    shrink: f32,
    k: usize,
    farthest: f32,
    smallest: f32,
    /// Seconds to build the tree over all photons.
    photon_seconds: f64,
    /// Seconds to find the surfaces that pyramids are made on.
    area_seconds: f64,
}

impl GatherMaps {
    /// Builds what `wanted` asks for; nothing if it is empty.
    ///
    /// * `k`: photons of a density estimate.
    /// * `area_factor`: area of discs relative to the first pass, in `(0, 1]`.
    pub fn new(scene: &Scene, stored: &StoredPhotons, wanted: &[FinalGathering], k: usize, area_factor: f64) -> Self {
        if wanted.is_empty() {
            return Self::default();
        }
        let start = Instant::now();
        let photons = GlobalPhotons::new(stored, &PhotonKind::ALL);
        let photon_seconds = start.elapsed().as_secs_f64();
        let count = photons.photons().len().max(1);
        // A disc that holds k photons where they are spread evenly.
        let start = Instant::now();
        let areas = SurfaceAreas::new(scene);
        let area_seconds = start.elapsed().as_secs_f64();
        let per_photon = areas.total() / count as f64;
        let radius = (k as f64 * per_photon / std::f64::consts::PI).sqrt() as f32;
        let mut maps = Self {
            automatic_radius: radius.clamp(scene.resolution(), scene.radius),
            shrink: area_factor.sqrt() as f32,
            k,
            farthest: 2.0 * scene.radius,
            smallest: scene.resolution(),
            photon_seconds,
            area_seconds,
            ..Default::default()
        };
        for f in wanted {
            let Some(settings) = maps.pyramid_settings(f) else { continue };
            let first = |s: &PyramidSettings| PyramidSettings { layers: 1, growth: 2.0, ..*s };
            match maps.pyramids.iter_mut().find(|(s, _)| first(s) == first(&settings) && s.growth == settings.growth) {
                Some((s, _)) => s.layers = s.layers.max(settings.layers),
                None => {
                    let pyramid = IrradiancePyramid::new(&areas, &photons, &settings);
                    maps.pyramids.push((settings, pyramid));
                }
            }
        }
        // The photon map goes before the other layers are made.
        let classic = wanted.iter().any(|f| f.method == FinalGatherMethod::Classic);
        maps.photons = classic.then_some(photons);
        for (settings, pyramid) in &mut maps.pyramids {
            pyramid.grow(scene, settings);
        }
        if wanted.iter().any(|f| f.near > 0.0) {
            maps.caustic = Some(GlobalPhotons::new(stored, &[PhotonKind::Caustic]));
        }
        maps
    }

    fn pyramid_settings(&self, f: &FinalGathering) -> Option<PyramidSettings> {
        let layers = match f.method {
            FinalGatherMethod::Classic => return None,
            FinalGatherMethod::Precomputed => 1,
            FinalGatherMethod::RayDifferentials => usize::MAX,
        };
        let as_published = f.estimates_as_published;
        Some(PyramidSettings { radius: self.radius(f), growth: f.growth, as_published, layers })
    }

    /// Radius of the first search for photons, or of the first layer, metres.
    pub fn radius(&self, f: &FinalGathering) -> f32 {
        (f.radius.unwrap_or(self.automatic_radius) * self.shrink).max(self.smallest)
    }

    /// The pyramid of a final gathering; None for one that looks photons up, and for one that was not asked for.
    pub fn pyramid(&self, f: &FinalGathering) -> Option<&IrradiancePyramid> {
        let wanted = self.pyramid_settings(f)?;
        let fits = |s: &PyramidSettings| {
            let same = s.radius == wanted.radius && s.growth == wanted.growth && s.as_published == wanted.as_published;
            same && s.layers >= wanted.layers
        };
        self.pyramids.iter().find(|(s, _)| fits(s)).map(|(_, p)| p)
    }

    /// All pyramids.
    pub fn pyramids(&self) -> impl Iterator<Item = &IrradiancePyramid> {
        self.pyramids.iter().map(|(_, p)| p)
    }

    /// All photons, where something looks them up.
    pub fn photons(&self) -> Option<&GlobalPhotons> {
        self.photons.as_ref()
    }

    /// Caustic photons, for second gathers.
    pub fn caustic(&self) -> Option<&GlobalPhotons> {
        self.caustic.as_ref()
    }

    /// How photons of a density estimate are looked for.
    pub fn search(&self, f: &FinalGathering) -> Search {
        Search { k: self.k.max(1), radius: self.radius(f), farthest: self.farthest, smallest: self.smallest }
    }

    /// Whether nothing was asked for.
    pub fn is_empty(&self) -> bool {
        self.photons.is_none() && self.pyramids.is_empty()
    }

    /// Seconds to build what a final gathering looks up, as if it were alone: the photons' tree, and its layers.
    pub fn seconds(&self, f: &FinalGathering) -> f64 {
        let layers = self.pyramid(f).map_or(0.0, |p| match f.method {
            FinalGatherMethod::RayDifferentials => self.area_seconds + p.seconds().first + p.seconds().others,
            _ => self.area_seconds + p.seconds().first,
        });
        self.photon_seconds + layers
    }

    /// Seconds to build the tree over all photons.
    pub fn photon_seconds(&self) -> f64 {
        self.photon_seconds
    }
}
