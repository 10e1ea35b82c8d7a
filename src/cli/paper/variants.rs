//! The thesis's listings as they are printed, where they differ from its text: to be measured, not to be used.

use crate::estimate::multi_sampled::MultiSampled;
use crate::estimate::{Estimator, Gathered, Lookup, View};
use crate::photons::{MapPhoton, PhotonMap};
use glam::{DVec3, Vec3};

/// `multi_sampled` whose `w_pd` is not reset for each photon (listing `ViewDiffMethodMS.cpp`, lines 31 and 86 to 106):
/// a photon inherits the weight of the one before it, over N².
///
/// What it gives depends on the order of the photons; here that of the gather.
pub struct CarriedWeight {
    inner: MultiSampled,
    n: u32,
}

impl CarriedWeight {
    /// Around `inner`, which has `n` points along each axis.
    pub fn new(inner: MultiSampled, n: u32) -> Self {
        Self { inner, n }
    }

    fn mean(&self, photon: &MapPhoton, view: &View) -> f64 {
        let c = photon.to_filter(view.query.center - photon.position);
        let [a, b] = view.query.axes.map(|v| photon.to_filter(v));
        self.inner.mean(c, a, b)
    }
}

impl Estimator for CarriedWeight {
    fn id(&self) -> &'static str {
        self.inner.id()
    }

    fn settings(&self) -> String {
        format!("{},w_pd=carried", self.inner.settings())
    }

    fn lookup(&self) -> Lookup {
        self.inner.lookup()
    }

    fn is_consistent(&self) -> bool {
        false
    }

    /// Without what it inherits.
    fn weight(&self, photon: &MapPhoton, view: &View, radius: f32) -> f64 {
        self.inner.weight(photon, view, radius)
    }

    fn irradiance(&self, gathered: &Gathered, view: &View) -> DVec3 {
        let points = f64::from(self.n * self.n);
        let mut sum = DVec3::ZERO;
        let mut w = 0.0;
        for &i in gathered.indices {
            let photon = &gathered.photons[i as usize];
            // The sum over the points starts at the last photon's mean and is then divided.
            w = w / points + self.mean(photon, view);
            sum += photon.power.as_dvec3() * (3.0 * w * f64::from(photon.inverse_area));
        }
        sum
    }
}

/// An estimator whose photons lie within the listing's search radius (`ViewDiffTracer.cpp`, lines 96 to 110):
/// `max(‖dα‖², ‖dβ‖²)` of the view footprint plus the squared longest column of all photon footprints.
///
/// The k nearest of a larger radius that lie within a smaller one are the k nearest of the smaller.
pub struct ListedRadius {
    inner: Box<dyn Estimator>,
    longest: f32,
}

impl ListedRadius {
    /// Around `inner`, for the photons of these maps.
    pub fn new<'a>(inner: Box<dyn Estimator>, maps: impl Iterator<Item = &'a PhotonMap>) -> Self {
        let columns = maps.flat_map(|m| m.photons()).flat_map(|p| p.axes());
        Self { inner, longest: columns.map(Vec3::length_squared).fold(0.0, f32::max) }
    }
}

impl Estimator for ListedRadius {
    fn id(&self) -> &'static str {
        self.inner.id()
    }

    fn settings(&self) -> String {
        let own = self.inner.settings();
        format!("{own}{}radius=listed", if own.is_empty() { "" } else { "," })
    }

    fn lookup(&self) -> Lookup {
        self.inner.lookup()
    }

    fn is_consistent(&self) -> bool {
        false
    }

    fn weight(&self, photon: &MapPhoton, view: &View, radius: f32) -> f64 {
        self.inner.weight(photon, view, radius)
    }

    fn irradiance(&self, gathered: &Gathered, view: &View) -> DVec3 {
        let [a, b] = view.query.axes.map(Vec3::length_squared);
        let within = a.max(b) + self.longest;
        let near = |i: &&u32| gathered.photons[**i as usize].position.distance_squared(view.query.center) <= within;
        let indices: Vec<u32> = gathered.indices.iter().filter(near).copied().collect();
        self.inner.irradiance(&Gathered { indices: &indices, ..*gathered }, view)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::estimate::integrated::Integrated;
    use crate::estimate::multi_sampled::Grid;
    use crate::math::rgb::Rgb;
    use crate::photons::Photon;
    use crate::photons::map::{FootprintLimits, MapParts, Query};

    fn photon(x: f32, size: f32) -> Photon {
        Photon {
            position: Vec3::X * x,
            direction: -Vec3::Y,
            normal: Vec3::Y,
            power: Rgb::ONE,
            footprint: [Vec3::X * size, Vec3::Z * size],
        }
    }

    fn map(photons: &[Photon]) -> PhotonMap {
        let limits = FootprintLimits { scale: 1.0, floor: 1e-6, ceiling: 10.0 };
        PhotonMap::new(photons, limits, MapParts { kd_tree: false, overlap: false })
    }

    fn view(size: f32) -> View {
        let query = Query { center: Vec3::ZERO, normal: Vec3::Y, axes: [Vec3::X * size, Vec3::Z * size] };
        View { query, direction: -Vec3::Y }
    }

    /// By hand: at a point the first photon has the kernel's peak, 3/A; the second, which does not overlap, gets a
    /// quarter of that over its own area.
    #[test]
    fn a_photon_inherits_weight() {
        let map = map(&[photon(0.0, 1.0), photon(5.0, 0.1)]);
        let e = CarriedWeight::new(MultiSampled::new(2, Grid::Closed), 2);
        let (v, all) = (view(0.0), Gathered { photons: map.photons(), indices: &[0, 1], radius: 0.0 });
        let (one, two) = (std::f64::consts::PI, std::f64::consts::PI * 0.01);
        let expected = 3.0 / one + 3.0 * 0.25 / two;
        assert!((e.irradiance(&all, &v).x / expected - 1.0).abs() < 1e-5);
        let reset = MultiSampled::new(2, Grid::Closed).irradiance(&all, &v);
        assert!((reset.x / (3.0 / one) - 1.0).abs() < 1e-5);
    }

    /// Two unit squares whose ellipse and parallelogram meet at a distance between √2 and 2 overlap, yet are missed.
    #[test]
    fn the_listed_radius_misses_photons_that_overlap() {
        let map = map(&[photon(1.8, 1.0)]);
        let all = Gathered { photons: map.photons(), indices: &[0], radius: 0.0 };
        let e = ListedRadius::new(Box::new(Integrated), std::iter::once(&map));
        assert!(Integrated.irradiance(&all, &view(1.0)).x > 0.0);
        assert_eq!(e.irradiance(&all, &view(1.0)).x, 0.0);
    }
}
