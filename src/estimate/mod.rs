//! Radiance estimators: one file each, one trait, one registry.

mod batch;
pub mod clip;
pub mod construction;
pub mod coplanar;
mod coverage;
pub mod density;
pub mod final_gathering;
pub mod integrated;
pub mod kernel;
pub mod multi_sampled;
pub mod parallelogram;
pub mod polygon;
pub mod registry;
pub mod regular;
pub mod settings;

#[cfg(test)]
mod energy_tests;
#[cfg(test)]
mod property_tests;

pub use construction::{Construction, SamplingPoint};
pub use final_gathering::{FinalGatherMethod, FinalGathering};

use crate::photons::MapPhoton;
use crate::photons::map::Query;
use glam::{DVec3, Vec3};

/// A view hit as the estimators see it.
#[derive(Clone, Copy, Debug)]
pub struct View {
    /// Where photons are looked up: hit point, normal and footprint of the view differential.
    pub query: Query,
    /// Unit direction of the view ray.
    pub direction: Vec3,
}

/// The photons that an estimator looks at.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Lookup {
    /// Those whose ellipsoid holds the hit point.
    Point,
    /// Those whose ellipsoid meets the view parallelogram.
    Parallelogram,
    /// The k nearest, and the disc that they fill.
    Disc,
}

/// Photons gathered from one map for one view hit.
#[derive(Clone, Copy, Debug)]
pub struct Gathered<'a> {
    /// All photons of the map.
    pub photons: &'a [MapPhoton],
    /// Those that were found.
    pub indices: &'a [u32],
    /// For [`Lookup::Disc`]: radius of the disc, metres. Otherwise 0.
    pub radius: f32,
}

/// Turns the photons around one view hit into irradiance.
pub trait Estimator: Send + Sync {
    /// Name in the command line, files and titles.
    fn id(&self) -> &'static str;

    /// Settings that differ from none, as `n=8,grid=closed`; empty if it has none.
    fn settings(&self) -> String;

    /// Which photons it looks at.
    fn lookup(&self) -> Lookup;

    /// View rays across and down a pixel.
    fn rays_per_axis(&self) -> u32 {
        1
    }

    /// Whether its progressive render converges under `overlap`.
    fn is_consistent(&self) -> bool;

    /// Whether it is the kernel's exact mean over the view footprint, so that the footprint of a whole pixel may take
    /// the place of smaller ones that tile it.
    fn is_exact_mean(&self) -> bool {
        false
    }

    /// How global light is gathered by one more bounce of many rays; None where it comes from the photons around the hit.
    fn final_gathering(&self) -> Option<&FinalGathering> {
        None
    }

    /// Weight of one photon, 1/m²: its kernel's mean over the view footprint, over its area. Finite, not negative.
    fn weight(&self, photon: &MapPhoton, view: &View, radius: f32) -> f64;

    /// Irradiance of each channel, W/m²: the sum of powers times weights, which f64 can always hold.
    fn irradiance(&self, gathered: &Gathered, view: &View) -> DVec3;

    /// [`Estimator::irradiance`] of many hits, to the bit; `put` gets those of all in their order. For an estimator that
    /// takes photons together whichever hit they belong to.
    fn irradiances<'a>(&self, hits: &mut dyn Iterator<Item = (Gathered<'a>, View)>, put: &mut dyn FnMut(DVec3)) {
        for (gathered, view) in hits {
            put(self.irradiance(&gathered, &view));
        }
    }

    /// What it does with one photon, as plain geometry; nothing by default.
    fn construction(&self, _photon: &MapPhoton, _view: &View) -> Construction {
        Construction::default()
    }

    /// Id and settings, as the command line takes them.
    fn name(&self) -> String {
        let settings = self.settings();
        if settings.is_empty() { self.id().to_owned() } else { format!("{}:{settings}", self.id()) }
    }
}

/// Sum of the gathered photons' powers times `weight`.
#[inline(always)]
fn weighted_sum(gathered: &Gathered, weight: impl Fn(&MapPhoton) -> f64) -> DVec3 {
    let mut sum = DVec3::ZERO;
    for &i in gathered.indices {
        let photon = &gathered.photons[i as usize];
        let w = weight(photon);
        if w != 0.0 {
            sum += photon.power.as_dvec3() * w;
        }
    }
    sum
}
