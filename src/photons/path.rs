//! A photon's path from its light to its end, and what is stored on the way.

use crate::math::frame::cosine_hemisphere;
use crate::math::rgb::{Rgb, mean};
use crate::math::sequence::Sequence;
use crate::photons::arrivals::Arrivals;
use crate::photons::emission::Emission;
use crate::photons::spread::{self, DiffuseSpread};
use crate::photons::{Photon, PhotonKind, StoredPhoton, StoredPhotons};
use crate::scene::{Material, Scene};
use crate::trace::scatter::{SpecularRay, reflected, refracted, specular_weights};
use crate::trace::surface::SELF_INTERSECTION;
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
    index: u64,
    ray: Ray,
    differential: Differential,
    power: Rgb,
    kind: PhotonKind,
    /// The dielectric that it knows itself to be in.
    medium: Option<u32>,
}

impl PathState {
    /// One that leaves its light with that power, W. `index` names it in the sequence.
    pub fn new(index: u64, emission: &Emission, power: Rgb) -> Self {
        let ray = Ray { origin: emission.origin, direction: emission.direction };
        Self { index, ray, differential: emission.differential, power, kind: PhotonKind::Direct, medium: None }
    }
}

/// Photons that are followed together, and what that takes.
#[derive(Clone, Default)]
pub struct Wavefront {
    /// Those on their way, in the order of their indices.
    pub photons: Vec<PathState>,
    rays: Vec<Ray>,
    hits: Vec<Option<Hit>>,
    /// What they left, by bounce: with the index among them of the photon that did.
    stored: Vec<(u32, PhotonKind, StoredPhoton)>,
    order: Order,
    goes_on: Vec<bool>,
    mirrored: Arrivals,
    arriving: Arrivals,
}

/// What becomes of a photon at a surface, as far as the two tell.
enum Event {
    /// It ends, and leaves nothing.
    End,
    /// A mirror of triangles reflects it.
    Mirror,
    /// It is stored on a triangle, and ends.
    Store,
    /// Any of these, or another.
    Other,
}

/// Sorts small numbers, those that are alike in the order in which they come.
#[derive(Clone, Debug, Default)]
pub struct Order {
    places: Vec<u32>,
    keys: Vec<u32>,
    sorted: Vec<u32>,
}

impl Order {
    /// The indices of `keys` by key.
    pub fn by(&mut self, keys: impl Iterator<Item = u32>) -> &[u32] {
        let Self { places, keys: own, sorted } = self;
        own.clear();
        own.extend(keys);
        places.clear();
        for key in own.iter() {
            let key = *key as usize + 1;
            if key >= places.len() {
                places.resize(key + 1, 0);
            }
            places[key] += 1;
        }
        for i in 1..places.len() {
            places[i] += places[i - 1];
        }
        sorted.clear();
        sorted.resize(own.len(), 0);
        for (index, key) in own.iter().enumerate() {
            let place = &mut places[*key as usize];
            sorted[*place as usize] = index as u32;
            *place += 1;
        }
        sorted
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

    /// [`Self::trace`] of each photon of a wavefront, all to one surface before any goes on to the next: their rays are on their
    /// way together. What is stored is in the same order.
    ///
    /// Calls `cut_off` with the power of each that the bounce limit ended, W.
    pub fn trace_wavefront(
        &self,
        wavefront: &mut Wavefront,
        first: u64,
        count: u64,
        out: &mut StoredPhotons,
        counts: &mut PathCounts,
        mut cut_off: impl FnMut(Rgb),
    ) {
        let Wavefront { photons, rays, hits, stored, order, goes_on, mirrored, arriving } = wavefront;
        stored.clear();
        for bounce in 0..self.settings.max_depth {
            if photons.is_empty() {
                break;
            }
            rays.clear();
            rays.extend(photons.iter().map(|photon| photon.ray));
            self.intersector.closest_of(rays, hits);
            if self.intersector.is_large() {
                self.scene.geometry.prefetch(hits.iter().flatten().map(|hit| hit.primitive as usize));
            }
            goes_on.clear();
            goes_on.resize(photons.len(), false);
            for (number, hit) in hits.iter().enumerate() {
                let Some(hit) = hit else { continue };
                let photon = &photons[number];
                match self.event(photon, hit) {
                    Event::End => {}
                    Event::Mirror => {
                        if mirrored.push(number, &self.scene.geometry, &photon.ray, &photon.differential, hit) {
                            self.mirror(mirrored, photons, hits, goes_on, bounce, count, counts);
                        }
                    }
                    Event::Store => {
                        if arriving.push(number, &self.scene.geometry, &photon.ray, &photon.differential, hit) {
                            self.store(arriving, photons, hits, first, bounce, count, counts, stored);
                        }
                    }
                    Event::Other => {
                        let local = (photon.index - first) as u32;
                        let mut store = |kind, photon: Photon| stored.push((local, kind, photon.into()));
                        let photon = &mut photons[number];
                        goes_on[number] = self.meet(photon, hit, bounce, count, &mut store, counts, &mut Unrecorded);
                    }
                }
            }
            self.mirror(mirrored, photons, hits, goes_on, bounce, count, counts);
            self.store(arriving, photons, hits, first, bounce, count, counts, stored);
            let mut goes_on = goes_on.iter();
            photons.retain(|_| goes_on.next().is_some_and(|on| *on));
        }
        photons.sort_unstable_by_key(|photon| photon.index);
        for photon in photons.drain(..) {
            counts.depth += 1;
            cut_off(photon.power);
        }
        for &at in order.by(stored.iter().map(|(place, ..)| *place)) {
            let (_, kind, photon) = stored[at as usize];
            out.of_mut(kind).push(photon);
        }
    }

    fn event(&self, photon: &PathState, hit: &Hit) -> Event {
        let geometry = &self.scene.geometry;
        let index = hit.primitive as usize;
        let material = &self.scene.materials[geometry.material(index)];
        let is_plain = self.settings.differentials && photon.medium.is_none() && index < geometry.triangles.len();
        match material {
            Material::Diffuse { .. } if self.settings.global => Event::Other,
            Material::Diffuse { .. } if !self.keeps(photon.kind) => Event::End,
            Material::Diffuse { .. } if is_plain => Event::Store,
            Material::Mirror { .. } if is_plain => Event::Mirror,
            _ => Event::Other,
        }
    }

    #[expect(clippy::too_many_arguments, reason = "outputs that the caller keeps between photons")]
    fn mirror(
        &self,
        arrivals: &mut Arrivals,
        photons: &mut [PathState],
        hits: &[Option<Hit>],
        goes_on: &mut [bool],
        bounce: u32,
        count: u64,
        counts: &mut PathCounts,
    ) {
        if arrivals.numbers().is_empty() {
            return;
        }
        let arrived = arrivals.arrive::<true>([self.scene.radius, MAX_ANGLE]);
        let offset = self.scene.radius * SELF_INTERSECTION;
        for (lane, &number) in arrivals.numbers().iter().enumerate() {
            let number = number as usize;
            let Some(hit) = &hits[number] else { continue };
            let photon = &mut photons[number];
            let material = &self.scene.materials[self.scene.geometry.material(hit.primitive as usize)];
            goes_on[number] = match material {
                Material::Mirror { reflectance } if arrived.is_usual(lane) => {
                    let q = share(photon.power, *reflectance);
                    let x = if q < 1.0 { self.sequence.four(photon.index, 1 + bounce)[0] } else { 0.0 };
                    let origin = arrived.position(lane) + arrived.normal(lane) * offset;
                    photon.ray = Ray { origin, direction: arrived.direction(lane) };
                    photon.differential = arrived.differential(lane);
                    photon.power = photon.power * *reflectance / q;
                    if photon.kind == PhotonKind::Direct {
                        photon.kind = PhotonKind::Caustic;
                    }
                    x < q
                }
                _ => self.meet(photon, hit, bounce, count, &mut |_, _| {}, counts, &mut Unrecorded),
            };
        }
        arrivals.clear();
    }

    #[expect(clippy::too_many_arguments, reason = "outputs that the caller keeps between photons")]
    fn store(
        &self,
        arrivals: &mut Arrivals,
        photons: &mut [PathState],
        hits: &[Option<Hit>],
        first: u64,
        bounce: u32,
        count: u64,
        counts: &mut PathCounts,
        stored: &mut Vec<(u32, PhotonKind, StoredPhoton)>,
    ) {
        if arrivals.numbers().is_empty() {
            return;
        }
        let arrived = arrivals.arrive::<false>([self.scene.radius, MAX_ANGLE]);
        for (lane, &number) in arrivals.numbers().iter().enumerate() {
            let number = number as usize;
            let Some(hit) = &hits[number] else { continue };
            let photon = &mut photons[number];
            let local = (photon.index - first) as u32;
            if arrived.is_usual(lane) {
                stored.push((local, photon.kind, arrived.stored(lane, photon.power)));
            } else {
                let mut store = |kind, photon: Photon| stored.push((local, kind, photon.into()));
                self.meet(photon, hit, bounce, count, &mut store, counts, &mut Unrecorded);
            }
        }
        arrivals.clear();
    }

    /// What becomes of a photon at the surface that it `hit`; whether it goes on.
    #[expect(clippy::too_many_arguments, reason = "outputs that the caller keeps between photons")]
    #[inline(always)]
    fn meet(
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
            match roulette(power, inside, numbers()[1]) {
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
                let Some(kept) = roulette(power, reflectance, x[0]) else {
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

    fn keeps(&self, kind: PhotonKind) -> bool {
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

/// The power that survives `weight` for the number `x` in `[0, 1)`, its mean unchanged; None if it does not survive.
fn roulette(power: Rgb, weight: Rgb, x: f32) -> Option<Rgb> {
    let q = share(power, weight);
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
            if let Some(kept) = roulette(p, w, 0.0) {
                prop_assert!((mean(kept) / mean(p) - 1.0).abs() < 1e-5);
                // What survives, times how often, is what the weight lets through.
                prop_assert!((kept * share(p, w) - p * w).abs().max_element() < 1e-5 * mean(p));
            }
        }
    }

    #[test]
    fn black_absorbs_and_white_keeps() {
        assert!(roulette(Rgb::ONE, Rgb::ZERO, 0.0).is_none());
        assert_eq!(roulette(Rgb::ONE, Rgb::ONE, 0.999_999), Some(Rgb::ONE));
        assert!(roulette(Rgb::ZERO, Rgb::ONE, 0.0).is_none());
    }
}
