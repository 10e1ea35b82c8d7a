//! `density`: the k nearest photons over the disc that they fill (Jensen 2001; Pedersen 2011, eq. 9 to 11).

use super::{Estimator, Gathered, Lookup, View, weighted_sum};
use crate::estimate::kernel::Kernel;
use crate::estimate::settings::{Spec, SpecError};
use crate::photons::MapPhoton;
use glam::DVec3;

/// Density estimation with a radial kernel of distance over radius.
pub struct Density {
    kernel: Kernel,
}

impl Density {
    /// With that kernel.
    pub fn new(kernel: Kernel) -> Self {
        Self { kernel }
    }

    /// `density`, with `kernel`.
    ///
    /// # Errors
    /// An unknown setting or kernel.
    pub fn parse(spec: &Spec) -> Result<Box<dyn Estimator>, SpecError> {
        spec.only(&["kernel"])?;
        let kernel = spec.choice("kernel", Kernel::Silverman, &Kernel::ALL)?;
        Ok(Box::new(Self::new(kernel)))
    }
}

impl Estimator for Density {
    fn id(&self) -> &'static str {
        "density"
    }

    fn settings(&self) -> String {
        format!("kernel={}", self.kernel.name())
    }

    fn lookup(&self) -> Lookup {
        Lookup::Disc
    }

    fn is_consistent(&self) -> bool {
        false
    }

    fn weight(&self, photon: &MapPhoton, view: &View, radius: f32) -> f64 {
        if radius <= 0.0 {
            return 0.0;
        }
        let r2 = f64::from(radius) * f64::from(radius);
        let d2 = (view.query.center - photon.position).as_dvec3().length_squared();
        self.kernel.value(d2 / r2) / (std::f64::consts::PI * r2)
    }

    fn irradiance(&self, gathered: &Gathered, view: &View) -> DVec3 {
        weighted_sum(gathered, |p| self.weight(p, view, gathered.radius))
    }
}
