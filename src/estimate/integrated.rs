//! `integrated`: the exact mean of the kernel over the view footprint (`docs/theory.md`).

use super::{Estimator, Gathered, Lookup, View, weighted_sum};
use crate::estimate::polygon::mean_over_parallelogram;
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

#[inline]
fn over_area(photon: &MapPhoton, view: &View) -> f64 {
    let c = photon.to_filter(view.query.center - photon.position);
    let [a, b] = view.query.axes.map(|v| photon.to_filter(v));
    3.0 * mean_over_parallelogram(c, a, b) * f64::from(photon.inverse_area)
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
        over_area(photon, view)
    }

    fn irradiance(&self, gathered: &Gathered, view: &View) -> DVec3 {
        weighted_sum(gathered, |p| over_area(p, view))
    }
}
