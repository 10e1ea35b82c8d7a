//! The irradiance estimate at one place (section 5.3.3), and final gathering (section 3.2.2).

use crate::math::frame::{cosine_hemisphere, tangents};
use crate::math::hash::mix;
use crate::math::rgb::{Rgb, in_f32};
use crate::math::sequence::{Sampling, Sequence};
use crate::photons::kd_tree::Nearest;
use crate::realtime::area;
use crate::realtime::photon::Photon;
use crate::realtime::photon_map::PhotonMap;
use crate::realtime::search::Query;
use crate::realtime::settings::{Area, RealtimeSettings};
use crate::realtime::world::World;
use crate::scene::Scene;
use crate::trace::Ray;
use crate::trace::surface::SELF_INTERSECTION;
use glam::{DVec2, DVec3, Vec3};
use std::f64::consts::PI;

/// Lists that an estimate fills, kept from one to the next.
#[derive(Default)]
pub struct Scratch {
    found: Nearest,
    offsets: Vec<DVec3>,
    in_plane: Vec<DVec2>,
}

impl Scratch {
    /// The photons of the last direct gathering, by index in the map, each with the bits of its squared distance.
    pub fn found(&self) -> &Nearest {
        &self.found
    }
}

/// An irradiance estimate and what it was made of.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Estimate {
    /// Irradiance, W/m².
    pub irradiance: Rgb,
    /// Photons in it.
    pub count: u32,
    /// Radius of the disc: that of the farthest photon if all that were wanted are there, else that of the search, metres.
    pub radius: f32,
    /// Area by which the powers were divided, m².
    pub area: f64,
}

/// A place whose irradiance is asked for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Place {
    /// Where, metres.
    pub position: Vec3,
    /// Unit normal on the side that is asked for.
    pub normal: Vec3,
    /// Along the surface away from its edge, metres; zero far from one.
    pub inward: Vec3,
}

/// Part of the way inwards by which gather rays start off the edge of a surface.
const INWARD: f32 = 0.02;

/// Estimates irradiance from the photon map of a frame.
pub struct Estimator<'a> {
    scene: &'a Scene,
    world: &'a World,
    map: &'a PhotonMap,
    settings: &'a RealtimeSettings,
    /// Radius of a search, metres.
    radius: f32,
    /// One over the number of frames in the map.
    scale: f64,
}

impl<'a> Estimator<'a> {
    /// An estimator over a balanced map.
    pub fn new(scene: &'a Scene, world: &'a World, map: &'a PhotonMap, settings: &'a RealtimeSettings) -> Self {
        Self {
            radius: search_radius(scene, map, settings),
            scale: 1.0 / map.frame_count().max(1) as f64,
            scene,
            world,
            map,
            settings,
        }
    }

    /// One over the number of frames in the map, by which powers are multiplied.
    pub fn scale(&self) -> f64 {
        self.scale
    }

    /// Radius of its searches, metres.
    pub fn radius(&self) -> f32 {
        self.radius
    }

    /// Irradiance at a place with the unit normal `normal` on the side that is asked for.
    ///
    /// The powers of the photons found over an area: never infinite, and zero without photons.
    pub fn direct_gathering(&self, position: Vec3, normal: Vec3, scratch: &mut Scratch) -> Estimate {
        let query = Query::new(self.settings, position, normal, self.radius);
        self.map.nearest(&query, &mut scratch.found);
        estimate(&query, self.map.photons(), self.settings.area, self.scene.resolution(), self.scale, scratch)
    }

    /// Irradiance by as many rays as the settings ask for: π times the mean of the radiance that they see, which is the
    /// reflectance over π times the irradiance where they arrive. Light straight from lights is not in it.
    ///
    /// The paper multiplies by the BRDF; the reflectance it must be, as the rays are cosine-weighted.
    ///
    /// The rays start a little `inward`: from the edge of two walls half of them would leave through the other one, which
    /// is what the paper's corners suffer from (section 6.2.1).
    pub fn final_gathering(&self, at: &Place, seed: u64, scratch: &mut Scratch) -> Rgb {
        let numbers = Sequence::new(Sampling::Sobol, mix(self.settings.seed, seed));
        let normal = at.normal;
        let origin = at.position + at.inward * INWARD + normal * (self.scene.radius * SELF_INTERSECTION);
        let mut sum = DVec3::ZERO;
        for i in 0..self.settings.final_gathering_rays {
            let x = numbers.four(u64::from(i), 0);
            let ray = Ray { origin, direction: cosine_hemisphere(normal, x[0], x[1]) };
            let Some(found) = self.world.closest(self.scene, &ray) else { continue };
            let surface = self.world.surface(self.scene, &ray, &found);
            let reflectance = self.scene.materials[surface.material as usize].diffuse_reflectance(surface.uv);
            if reflectance != Rgb::ZERO {
                let there = self.direct_gathering(surface.position, surface.normal, scratch);
                sum += (reflectance * there.irradiance).as_dvec3();
            }
        }
        in_f32(sum / f64::from(self.settings.final_gathering_rays)).0
    }

    /// Irradiance as the settings ask for it.
    pub fn irradiance(&self, at: &Place, seed: u64, scratch: &mut Scratch) -> Rgb {
        if self.settings.final_gathering {
            self.final_gathering(at, seed, scratch)
        } else {
            self.direct_gathering(at.position, at.normal, scratch).irradiance
        }
    }
}

/// The radius of a search, metres: the setting, or `√(k r_n²/(α n))` (eq. 3.7) for `n` photons in a ball of radius `r_n`.
pub fn search_radius(scene: &Scene, map: &PhotonMap, s: &RealtimeSettings) -> f32 {
    let photons = map.photons().len();
    if !s.radius_heuristic || photons == 0 {
        return s.max_search_radius;
    }
    let of_all = f64::from(map.radius());
    let radius = of_all * (f64::from(s.max_search_count) / (f64::from(s.radius_alpha) * photons as f64)).sqrt();
    (radius as f32).max(scene.resolution())
}

/// The estimate of the photons in `scratch.found`; `least` is the radius that no disc is smaller than, metres.
fn estimate(query: &Query, photons: &[Photon], kind: Area, least: f32, scale: f64, scratch: &mut Scratch) -> Estimate {
    let found = &scratch.found;
    let full = found.len() == query.count;
    let farthest = found.farthest().map_or(0.0, |f| f32::from_bits(f.0).sqrt());
    let radius = if full { farthest } else { query.radius }.max(least);
    let sum: DVec3 = found.iter().map(|(_, i)| photons[i as usize].power.as_dvec3()).sum();
    let disc = PI * f64::from(radius).powi(2);
    let shape = if kind == Area::Disc {
        None
    } else {
        scratch.offsets.clear();
        let here = query.position.as_dvec3();
        scratch.offsets.extend(found.iter().map(|(_, i)| photons[i as usize].position.as_dvec3() - here));
        let (x, y) = tangents(query.normal);
        let frame = [x.as_dvec3(), y.as_dvec3()];
        area::area(kind, &scratch.offsets, frame, query.normal.as_dvec3(), &mut scratch.in_plane)
    };
    let least = PI * f64::from(least).powi(2);
    let area = shape.unwrap_or(disc).max(least);
    Estimate { irradiance: in_f32(sum * (scale / area)).0, count: found.len() as u32, radius, area }
}
