//! `regular`: photon differentials at the hit point (Schjøth 2007; Pedersen 2011, eq. 46), with one or n×n view rays.

use super::{Construction, Estimator, Gathered, Lookup, SamplingPoint, View, weighted_sum};
use crate::estimate::kernel::silverman;
use crate::estimate::settings::{Spec, SpecError};
use crate::photons::MapPhoton;
use glam::DVec3;

/// The filtered radiance estimate at a point.
pub struct Regular {
    /// View rays across and down a pixel; 1 is `regular`, more is `regular_3x3`.
    rays: u32,
}

impl Regular {
    /// One view ray for each pixel.
    pub fn new() -> Self {
        Self { rays: 1 }
    }

    /// `n`×`n` view rays, at the centres of the pixel's cells.
    pub fn with_rays(n: u32) -> Self {
        Self { rays: n.max(1) }
    }

    /// `regular`, which has no settings.
    ///
    /// # Errors
    /// Any setting.
    pub fn parse(spec: &Spec) -> Result<Box<dyn Estimator>, SpecError> {
        spec.only(&[])?;
        Ok(Box::new(Self::new()))
    }

    /// `regular_3x3`, with `n`.
    ///
    /// # Errors
    /// An unknown setting or one out of range.
    pub fn parse_3x3(spec: &Spec) -> Result<Box<dyn Estimator>, SpecError> {
        spec.only(&["n"])?;
        Ok(Box::new(Self::with_rays(spec.integer("n", 3, 2..=64)?)))
    }
}

impl Default for Regular {
    fn default() -> Self {
        Self::new()
    }
}

#[inline]
fn kernel_over_area(photon: &MapPhoton, view: &View) -> f64 {
    let x = photon.to_filter(view.query.center - photon.position);
    let u = x.length_squared();
    if u >= 1.0 {
        return 0.0;
    }
    silverman(f64::from(u)) * f64::from(photon.inverse_area)
}

impl Estimator for Regular {
    fn id(&self) -> &'static str {
        if self.rays == 1 { "regular" } else { "regular_3x3" }
    }

    fn settings(&self) -> String {
        if self.rays == 1 { String::new() } else { format!("n={}", self.rays) }
    }

    fn lookup(&self) -> Lookup {
        Lookup::Point
    }

    fn rays_per_axis(&self) -> u32 {
        self.rays
    }

    fn is_consistent(&self) -> bool {
        true
    }

    fn weight(&self, photon: &MapPhoton, view: &View, _radius: f32) -> f64 {
        kernel_over_area(photon, view)
    }

    fn irradiance(&self, gathered: &Gathered, view: &View) -> DVec3 {
        weighted_sum(gathered, |p| kernel_over_area(p, view))
    }

    fn construction(&self, photon: &MapPhoton, view: &View) -> Construction {
        let position = view.query.center;
        let inside = photon.to_filter(position - photon.position).length_squared() < 1.0;
        Construction { points: vec![SamplingPoint { position, inside }], ..Default::default() }
    }
}
