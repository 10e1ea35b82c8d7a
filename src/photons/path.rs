//! A photon's path from its light to its end, and what is stored on the way.

use crate::math::frame::cosine_hemisphere;
use crate::math::rgb::{Rgb, mean};
use crate::math::sequence::Sequence;
use crate::photons::emission::Emission;
use crate::photons::spread::{self, DiffuseSpread};
use crate::photons::{Photon, PhotonKind, StoredPhotons};
use crate::scene::{Material, Scene};
use crate::trace::scatter::{SpecularRay, reflected, refracted, specular_weights};
use crate::trace::{Differential, Hit, Intersector, Ray, Surface};
use glam::Vec3;
use serde::Serialize;
use std::ops::AddAssign;

/// Largest change of direction over a footprint, beyond which a linear differential means nothing.
pub const MAX_ANGLE: f32 = 10.0;

/// Which photons are kept, and how paths are followed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PathSettings {
    /// Surfaces that a path may meet.
    pub max_depth: u32,
    /// Keep direct photons.
    pub direct: bool,
    /// Keep caustic photons.
    pub caustic: bool,
    /// Keep global photons: paths go on after a diffuse bounce.
    pub global: bool,
    /// Caustic photons are emitted by themselves, through the marked cells of a projection map.
    pub projected: bool,
    /// Carry differentials; without them footprints are zero.
    pub differentials: bool,
    /// Rule for diffuse bounces.
    pub spread: DiffuseSpread,
}

/// Counts of what was bounded or cut off.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct PathCounts {
    /// Differentials shortened to the scene's size or to [`MAX_ANGLE`].
    pub differentials: u64,
    /// Solid angles bounded at grazing emission or reflection.
    pub grazing: u64,
    /// Specular rays that a shading normal sent beyond the horizon.
    pub horizon: u64,
    /// Specular rays from places where the normals of a triangle's corners cancel, so that its flat normal shades.
    pub normals: u64,
    /// Paths ended by the bounce limit.
    pub depth: u64,
}

impl AddAssign for PathCounts {
    fn add_assign(&mut self, o: Self) {
        self.differentials += o.differentials;
        self.grazing += o.grazing;
        self.horizon += o.horizon;
        self.normals += o.normals;
        self.depth += o.depth;
    }
}

/// A photon on its way.
pub struct Flight<'a> {
    /// The scene.
    pub scene: &'a Scene,
    /// Its intersector.
    pub intersector: &'a Intersector,
    /// How to follow paths.
    pub settings: PathSettings,
    /// Numbers of the pass: set 0 is emission's, set `1 + b` bounce `b`'s.
    pub sequence: Sequence,
}

/// A photon before it meets its next surface.
#[derive(Clone, Copy, Debug)]
pub struct PathState {
    pub(super) index: u64,
    pub(super) ray: Ray,
    pub(super) differential: Differential,
    pub(super) power: Rgb,
    pub(super) kind: PhotonKind,
    /// The dielectric that it knows itself to be in.
    pub(super) medium: Option<u32>,
}

impl PathState {
    /// One that leaves its light with that power, W. `index` names it in the sequence.
    pub fn new(index: u64, emission: &Emission, power: Rgb) -> Self {
        let ray = Ray { origin: emission.origin, direction: emission.direction };
        Self { index, ray, differential: emission.differential, power, kind: PhotonKind::Direct, medium: None }
    }
}

/// A surface that a photon meets.
pub struct PhotonMeeting<'a> {
    /// The surface.
    pub surface: &'a Surface,
    /// Unit direction in which it arrives.
    pub direction: Vec3,
    /// Way from the last surface, or from the light, metres.
    pub distance: f32,
    /// Footprint `(dα, dβ)` at scale 1 in the surface's plane, metres; zero if photons carry none.
    pub footprint: [Vec3; 2],
    /// Power on arrival, W.
    pub power: Rgb,
    /// The kind as which it was stored here.
    pub stored: Option<PhotonKind>,
}

/// Hears what a photon meets.
pub trait PhotonRecorder {
    /// It meets a surface.
    fn meets(&mut self, _meeting: &PhotonMeeting) {}
}

/// Records nothing, at no cost.
pub struct Unrecorded;

impl PhotonRecorder for Unrecorded {}

/// A sphere around all specular surfaces.
#[derive(Clone, Copy, Debug)]
pub struct SpecularBounds {
    /// Centre, metres.
    pub center: Vec3,
    /// Radius, metres.
    pub radius: f32,
}

impl SpecularBounds {
    /// Bounds of a scene's specular surfaces; None without any.
    pub fn of(scene: &Scene) -> Option<Self> {
        let g = &scene.geometry;
        let boxes =
            (0..g.primitive_count()).filter(|&i| scene.materials[g.material(i)].is_specular()).map(|i| g.bounds(i));
        let (low, high) = boxes.reduce(|a, b| (a.0.min(b.0), a.1.max(b.1)))?;
        // Rounding of the test below must not lose a photon that grazes the sphere.
        let radius = (high - low).length() / 2.0 + 1e-4 * scene.radius;
        Some(Self { center: (low + high) / 2.0, radius })
    }

    /// Whether a ray may meet the sphere.
    pub fn may_meet(&self, origin: Vec3, direction: Vec3) -> bool {
        let to = self.center - origin;
        let along = to.dot(direction);
        let off = to - direction * along;
        let reach = self.radius + 1e-6 * to.length();
        off.length_squared() <= reach * reach && (along >= 0.0 || to.length_squared() <= reach * reach)
    }
}

impl Flight<'_> {
    /// Follows one photon of `count` from its `emission` and appends what is stored to `out`.
    ///
    /// Russian roulette keeps the mean power over channels (Pedersen 2011, section 2.1.2); colours shift it between
    /// channels. `index` names the photon in the sequence; `recorder` hears of every surface.
    ///
    /// Returns the power that it still carried when the bounce limit ended its path, W; none if it ended by itself.
    #[expect(clippy::too_many_arguments, reason = "outputs that the caller keeps between photons")]
    pub fn trace(
        &self,
        index: u64,
        emission: &Emission,
        power: Rgb,
        count: u64,
        out: &mut StoredPhotons,
        counts: &mut PathCounts,
        recorder: &mut impl PhotonRecorder,
    ) -> Rgb {
        let mut photon = PathState::new(index, emission, power);
        let mut store = |kind, photon: Photon| out.of_mut(kind).push(photon.into());
        counts.grazing += u64::from(emission.bounded);
        for bounce in 0..self.settings.max_depth {
            let Some(hit) = self.intersector.closest(&photon.ray) else {
                return Rgb::ZERO;
            };
            if !self.meet(&mut photon, &hit, bounce, count, &mut store, counts, recorder) {
                return Rgb::ZERO;
            }
        }
        counts.depth += 1;
        photon.power
    }

    /// What becomes of a photon at the surface that it `hit`; whether it goes on.
    #[expect(clippy::too_many_arguments, reason = "outputs that the caller keeps between photons")]
    #[inline(always)]
    pub(super) fn meet(
        &self,
        photon: &mut PathState,
        hit: &Hit,
        bounce: u32,
        count: u64,
        store: &mut impl FnMut(PhotonKind, Photon),
        counts: &mut PathCounts,
        recorder: &mut impl PhotonRecorder,
    ) -> bool {
        let scene = self.scene;
        let PathState { index, mut ray, differential: mut d, mut power, mut kind, mut medium } = *photon;
        let material = &scene.materials[scene.geometry.material(hit.primitive as usize)];
        if material.is_diffuse() && !self.keeps(kind) && !self.settings.global {
            // It ends here, and leaves nothing: half of those that pass a specular surface by.
            return false;
        }
        let surface = Surface::new(scene, &ray, hit);
        let v = ray.direction;
        if self.settings.differentials {
            d = d.transfer(v, surface.normal, hit.t);
            counts.differentials += u64::from(d.bound(scene.radius, MAX_ANGLE));
        }
        // Made where they are asked for: a photon that is stored and ends asks for none.
        let numbers = || self.sequence.four(index, 1 + bounce);
        medium = medium_before(scene, medium, &surface);
        if let Some(inside) = attenuation(scene, medium, hit.t) {
            match roulette(power, inside, || numbers()[1]) {
                Some(kept) => power = kept,
                None => return false,
            }
        }
        recorder.meets(&PhotonMeeting {
            surface: &surface,
            direction: v,
            distance: hit.t,
            footprint: d.dp,
            power,
            stored: (material.is_diffuse() && self.keeps(kind)).then_some(kind),
        });
        match material {
            Material::Emitter { .. } => return false,
            Material::Diffuse { .. } => {
                if self.keeps(kind) {
                    let (position, normal) = (surface.position, surface.normal);
                    store(kind, Photon { position, direction: v, normal, power, footprint: d.dp });
                }
                if !self.settings.global {
                    return false;
                }
                let x = numbers();
                let reflectance = material.diffuse_reflectance(surface.uv);
                let Some(kept) = roulette(power, reflectance, || x[0]) else {
                    return false;
                };
                power = kept;
                kind = PhotonKind::Global;
                let w = cosine_hemisphere(surface.normal, x[2], x[3]);
                if self.settings.differentials {
                    let cos = w.dot(surface.normal);
                    let (next, bounded) = spread::bounce(self.settings.spread, &d, v, w, cos, count);
                    d = next;
                    counts.grazing += u64::from(bounded);
                }
                ray = Ray { origin: surface.leave(scene, w), direction: w };
            }
            _ => {
                let number = || numbers()[0];
                let Some((next, kept, through)) = self.specular(material, &surface, &ray, power, &d, number) else {
                    return false;
                };
                power = kept;
                ray = Ray { origin: next.origin, direction: next.direction };
                if self.settings.differentials {
                    d = next.differential;
                }
                counts.horizon += u64::from(next.beyond_horizon);
                counts.normals += u64::from(next.without_shading);
                if through {
                    medium = medium_behind(&surface);
                }
                if kind == PhotonKind::Direct {
                    kind = PhotonKind::Caustic;
                }
            }
        }
        *photon = PathState { index, ray, differential: d, power, kind, medium };
        true
    }

    pub(super) fn keeps(&self, kind: PhotonKind) -> bool {
        match kind {
            PhotonKind::Direct => self.settings.direct,
            PhotonKind::Caustic => self.settings.caustic,
            PhotonKind::Global => self.settings.global,
        }
    }

    /// One specular event by roulette on the number that `x` makes, if it takes one: the next ray, the power it keeps, and
    /// whether it went through.
    fn specular(
        &self,
        material: &Material,
        surface: &Surface,
        ray: &Ray,
        power: Rgb,
        d: &Differential,
        x: impl Fn() -> f32,
    ) -> Option<(SpecularRay, Rgb, bool)> {
        let weights = specular_weights(material, surface, ray.direction)?;
        let reflect = share(power, weights.reflected);
        let refract = share(power, weights.refracted);
        // Below 1 is every number: what reflects all light asks for none.
        let x = if reflect < 1.0 { x() } else { 0.0 };
        let through = x >= reflect;
        let (next, weight, q) = if !through {
            (reflected(self.scene, surface, ray.direction, d), weights.reflected, reflect)
        } else if x < reflect + refract {
            (refracted(self.scene, surface, ray.direction, d, weights.eta), weights.refracted, refract)
        } else {
            return None;
        };
        Some((next, power * weight / q, through))
    }
}

/// The dielectric in which the way to `surface` lay: `medium`, in which the path knows itself, or the one whose inside
/// it meets although it never entered, because it started there.
pub fn medium_before(scene: &Scene, medium: Option<u32>, surface: &Surface) -> Option<u32> {
    let is_inside = !surface.front && matches!(scene.materials[surface.material as usize], Material::Dielectric { .. });
    medium.or(is_inside.then_some(surface.material))
}

/// The dielectric behind `surface` for a path that goes through it.
pub fn medium_behind(surface: &Surface) -> Option<u32> {
    surface.front.then_some(surface.material)
}

/// Transmittance of a way of `distance` metres in `medium`, if that absorbs.
pub fn attenuation(scene: &Scene, medium: Option<u32>, distance: f32) -> Option<Rgb> {
    match scene.materials.get(medium? as usize) {
        Some(m @ Material::Dielectric { absorption, .. }) if *absorption != Rgb::ZERO => {
            Some(m.transmittance(distance))
        }
        _ => None,
    }
}

/// Share of `power` that `weight` lets through, by the mean of the channels.
fn share(power: Rgb, weight: Rgb) -> f32 {
    let whole = mean(power);
    if whole > 0.0 { (mean(power * weight) / whole).clamp(0.0, 1.0) } else { 0.0 }
}

/// The power that survives `weight` for the number in `[0, 1)` that `x` makes, its mean unchanged; None if it does not survive.
pub(super) fn roulette(power: Rgb, weight: Rgb, x: impl FnOnce() -> f32) -> Option<Rgb> {
    let q = share(power, weight);
    // Below 1 is every number: what keeps all light asks for none.
    let x = if q < 1.0 { x() } else { 0.0 };
    (x < q).then(|| power * weight / q)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn roulette_keeps_the_mean_power(
            p in prop::array::uniform3(0.01f32..10.0), w in prop::array::uniform3(0.0f32..1.0),
        ) {
            let (p, w) = (Rgb::from(p), Rgb::from(w));
            if let Some(kept) = roulette(p, w, || 0.0) {
                prop_assert!((mean(kept) / mean(p) - 1.0).abs() < 1e-5);
                // What survives, times how often, is what the weight lets through.
                prop_assert!((kept * share(p, w) - p * w).abs().max_element() < 1e-5 * mean(p));
            }
        }
    }

    #[test]
    fn black_absorbs_and_white_keeps() {
        assert!(roulette(Rgb::ONE, Rgb::ZERO, || 0.0).is_none());
        assert_eq!(roulette(Rgb::ONE, Rgb::ONE, || 0.999_999), Some(Rgb::ONE));
        assert!(roulette(Rgb::ZERO, Rgb::ONE, || 0.0).is_none());
    }
}
