//! Irradiance at the end of a gather ray: by photons, by the nearest estimate, or over the ray's footprint.

use crate::estimate::FinalGathering;
use crate::estimate::final_gathering::FootprintReach;
use crate::final_gather::gather_ray::GatherHit;
use crate::photons::irradiance::global_photons::Search;
use crate::photons::irradiance::layer::{Ellipse, WeightedMean};
use crate::photons::irradiance::{GlobalPhotons, IrradianceEstimate, IrradiancePyramid, agree};
use crate::photons::kd_tree::Nearest;
use glam::DVec3;

/// What irradiance is looked up in.
#[derive(Clone, Copy)]
pub enum Lookup<'a> {
    /// The k nearest photons.
    Photons(&'a GlobalPhotons, Search),
    /// The nearest estimate of the first layer.
    Nearest(&'a IrradiancePyramid),
    /// The estimates under the footprint.
    Footprint(&'a IrradiancePyramid),
    /// Nothing was built: no light.
    Nothing,
}

/// Where irradiance came from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Used {
    /// Photons.
    Photons,
    /// The estimate nearest to the hit: the footprint is below the first layer, or none was asked for.
    Nearest,
    /// Estimates inside the footprint, of the layer of that index.
    Footprint(usize),
    /// The estimate nearest to the hit in the layer of that index, because the footprint held none.
    NearestOf(usize),
    /// There was none that faces the ray.
    None,
}

impl Lookup<'_> {
    /// Irradiance at a hit, W/m², and where it came from. `visit` hears of every estimate that counts: its layer and index.
    #[inline]
    pub fn irradiance(
        &self,
        f: &FinalGathering,
        hit: &GatherHit,
        floor: f32,
        heap: &mut Nearest,
        visit: &mut impl FnMut(usize, u32),
    ) -> (DVec3, Used) {
        match self {
            Lookup::Photons(photons, search) => {
                (photons.irradiance(hit.position, hit.normal, search, heap), Used::Photons)
            }
            Lookup::Nearest(pyramid) => nearest(pyramid, 0, f.reach, hit, visit)
                .map_or((DVec3::ZERO, Used::None), |irradiance| (irradiance, Used::Nearest)),
            Lookup::Footprint(pyramid) => footprint(pyramid, f, hit, floor, visit),
            Lookup::Nothing => (DVec3::ZERO, Used::None),
        }
    }
}

/// Whether an estimate counts at a hit.
#[inline]
fn counts(reach: FootprintReach, hit: &GatherHit, e: &IrradianceEstimate) -> bool {
    match reach {
        FootprintReach::Surface => agree(e.normal, hit.normal),
        FootprintReach::Facing => hit.direction.dot(e.normal) < 0.0,
    }
}

fn nearest(
    pyramid: &IrradiancePyramid,
    layer: usize,
    reach: FootprintReach,
    hit: &GatherHit,
    visit: &mut impl FnMut(usize, u32),
) -> Option<DVec3> {
    let own = pyramid.layers().get(layer)?;
    let index = own.nearest(hit.position, |e| counts(reach, hit, e))?;
    visit(layer, index);
    Some(own.estimates()[index as usize].irradiance.as_dvec3())
}

fn footprint(
    pyramid: &IrradiancePyramid,
    f: &FinalGathering,
    hit: &GatherHit,
    floor: f32,
    visit: &mut impl FnMut(usize, u32),
) -> (DVec3, Used) {
    let ellipse = Ellipse::new(hit.position, hit.footprint, hit.normal, floor);
    let Some(layer) = pyramid.layer_for(ellipse.longest()) else {
        return nearest(pyramid, 0, f.reach, hit, visit)
            .map_or((DVec3::ZERO, Used::None), |irradiance| (irradiance, Used::Nearest));
    };
    let mut mean = WeightedMean::default();
    if let Some(l) = pyramid.layers().get(layer) {
        l.in_ellipse(&ellipse, |i, e| {
            if counts(f.reach, hit, e) {
                mean.add(e);
                visit(layer, i);
            }
        });
    }
    match mean.value() {
        Some(irradiance) => (irradiance.as_dvec3(), Used::Footprint(layer)),
        // A needle of a footprint may slip between the estimates.
        None => nearest(pyramid, layer, f.reach, hit, visit)
            .map_or((DVec3::ZERO, Used::None), |irradiance| (irradiance, Used::NearestOf(layer))),
    }
}
