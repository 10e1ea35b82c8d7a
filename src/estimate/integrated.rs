//! `integrated`: the exact mean of the kernel over the view footprint (`docs/theory.md`).

use super::{Estimator, Gathered, Lookup, View};
use crate::estimate::batch::{self, in_filter_space, weight_by_mean};
use crate::estimate::parallelogram::{mean_over_parallelogram, means_over_parallelograms};
use crate::estimate::settings::{Spec, SpecError};
use crate::photons::MapPhoton;
use glam::DVec3;

/// The closed form; it has no settings.
pub struct Integrated;

impl Integrated {
    /// `integrated`, which has no settings.
    ///
    /// # Errors
    /// Any setting.
    pub fn parse(spec: &Spec) -> Result<Box<dyn Estimator>, SpecError> {
        spec.only(&[])?;
        Ok(Box::new(Self))
    }
}

impl Estimator for Integrated {
    fn id(&self) -> &'static str {
        "integrated"
    }

    fn settings(&self) -> String {
        String::new()
    }

    fn lookup(&self) -> Lookup {
        Lookup::Parallelogram
    }

    fn is_consistent(&self) -> bool {
        true
    }

    fn is_exact_mean(&self) -> bool {
        true
    }

    fn weight(&self, photon: &MapPhoton, view: &View, _radius: f32) -> f64 {
        let [c, a, b] = in_filter_space(photon, view);
        weight_by_mean(mean_over_parallelogram(c, a, b), photon)
    }

    fn irradiance(&self, gathered: &Gathered, view: &View) -> DVec3 {
        batch::irradiance(gathered, view, means_over_parallelograms)
    }

    fn irradiances<'a>(&self, hits: &mut dyn Iterator<Item = (Gathered<'a>, View)>, put: &mut dyn FnMut(DVec3)) {
        batch::irradiances(hits, put, means_over_parallelograms);
    }
}
