//! Many photons followed together: all to one surface before any goes on to the next, so that rays which go about the same way
//! are traced together and what most photons do is done in lanes.

use crate::math::rgb::Rgb;
use crate::photons::arrivals::Arrivals;
use crate::photons::path::{Flight, MAX_ANGLE, PathCounts, PathState, Unrecorded, roulette};
use crate::photons::{Photon, PhotonKind, StoredPhoton, StoredPhotons};
use crate::scene::Material;
use crate::trace::surface::beside;
use crate::trace::{Hit, Ray};

/// Photons that are followed together, and what that takes; kept between wavefronts.
#[derive(Clone, Default)]
pub struct Wavefront {
    /// Those on their way, in any order; neighbours best go about the same way.
    pub photons: Vec<PathState>,
    rays: Vec<Ray>,
    hits: Vec<Option<Hit>>,
    /// Which of them go on after this surface.
    goes_on: Vec<bool>,
    mirrored: Arrivals,
    arriving: Arrivals,
    /// What they left, by bounce: each with its photon's place among the photons of the wavefront.
    stored: Vec<(u32, PhotonKind, StoredPhoton)>,
    order: Order,
}

/// What becomes of a photon at a surface, as far as both tell without further thought.
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

/// A step of all photons, to the next surface.
struct Step<'a> {
    flight: &'a Flight<'a>,
    /// Surfaces met before.
    bounce: u32,
    /// Index of the first photon.
    first: u64,
    /// Photons that share the light.
    count: u64,
}

impl Wavefront {
    /// [`Flight::trace`] of each photon, to the bit; what is stored is in the order of their indices, which are `first` and those
    /// that follow it.
    ///
    /// Calls `cut_off` with the power of each that the bounce limit ended, W, in that order.
    pub fn trace(
        &mut self,
        flight: &Flight,
        first: u64,
        count: u64,
        out: &mut StoredPhotons,
        counts: &mut PathCounts,
        mut cut_off: impl FnMut(Rgb),
    ) {
        self.stored.clear();
        for bounce in 0..flight.settings.max_depth {
            if self.photons.is_empty() {
                break;
            }
            self.step(&Step { flight, bounce, first, count }, counts);
        }
        self.photons.sort_unstable_by_key(|photon| photon.index);
        for photon in self.photons.drain(..) {
            counts.depth += 1;
            cut_off(photon.power);
        }
        for &at in self.order.by(self.stored.iter().map(|(place, ..)| *place)) {
            let (_, kind, photon) = self.stored[at as usize];
            out.of_mut(kind).push(photon);
        }
    }

    /// Takes all photons to their next surfaces; those that end there are gone after it.
    fn step(&mut self, step: &Step, counts: &mut PathCounts) {
        let Flight { scene, intersector, .. } = step.flight;
        self.rays.clear();
        self.rays.extend(self.photons.iter().map(|photon| photon.ray));
        intersector.closest_of(&self.rays, &mut self.hits);
        if intersector.is_large() {
            scene.geometry.prefetch(self.hits.iter().flatten().map(|hit| hit.primitive as usize));
        }
        self.goes_on.clear();
        self.goes_on.resize(self.photons.len(), false);
        for number in 0..self.photons.len() {
            let Some(hit) = self.hits[number] else { continue };
            let photon = &self.photons[number];
            match event(step.flight, photon, &hit) {
                Event::End => {}
                Event::Mirror => {
                    if self.mirrored.push(number, &scene.geometry, &photon.ray, &photon.differential, &hit) {
                        self.reflect(step, counts);
                    }
                }
                Event::Store => {
                    if self.arriving.push(number, &scene.geometry, &photon.ray, &photon.differential, &hit) {
                        self.store(step, counts);
                    }
                }
                Event::Other => self.meet(step, number, &hit, counts),
            }
        }
        self.reflect(step, counts);
        self.store(step, counts);
        let mut goes_on = self.goes_on.iter();
        self.photons.retain(|_| goes_on.next().is_some_and(|on| *on));
    }

    /// What becomes of one photon.
    fn meet(&mut self, step: &Step, number: usize, hit: &Hit, counts: &mut PathCounts) {
        let Self { photons, stored, .. } = self;
        let photon = &mut photons[number];
        let place = (photon.index - step.first) as u32;
        let mut store = |kind, photon: Photon| stored.push((place, kind, photon.into()));
        let Step { flight, bounce, count, .. } = step;
        self.goes_on[number] = flight.meet(photon, hit, *bounce, *count, &mut store, counts, &mut Unrecorded);
    }

    /// Sends on the photons that wait for mirrors to reflect them.
    fn reflect(&mut self, step: &Step, counts: &mut PathCounts) {
        if self.mirrored.is_empty() {
            return;
        }
        let Flight { scene, sequence, .. } = step.flight;
        let arrived = self.mirrored.arrive::<true>([scene.radius, MAX_ANGLE]);
        for lane in 0..self.mirrored.len() {
            let number = self.mirrored.number(lane);
            let Some(hit) = self.hits[number] else { continue };
            let material = &scene.materials[scene.geometry.material(hit.primitive as usize)];
            let Material::Mirror { reflectance } = material else { continue };
            if !arrived.is_usual(lane) {
                self.meet(step, number, &hit, counts);
                continue;
            }
            let photon = &mut self.photons[number];
            let x = || sequence.four(photon.index, 1 + step.bounce)[0];
            let Some(kept) = roulette(photon.power, *reflectance, x) else { continue };
            self.goes_on[number] = true;
            photon.power = kept;
            let origin = beside(scene, arrived.position(lane), arrived.normal(lane), true);
            photon.ray = Ray { origin, direction: arrived.direction(lane) };
            photon.differential = arrived.differential(lane);
            if photon.kind == PhotonKind::Direct {
                photon.kind = PhotonKind::Caustic;
            }
        }
        self.mirrored.clear();
    }

    /// Stores the photons that wait for it.
    fn store(&mut self, step: &Step, counts: &mut PathCounts) {
        if self.arriving.is_empty() {
            return;
        }
        let arrived = self.arriving.arrive::<false>([step.flight.scene.radius, MAX_ANGLE]);
        for lane in 0..self.arriving.len() {
            let number = self.arriving.number(lane);
            let photon = &self.photons[number];
            if arrived.is_usual(lane) {
                let place = (photon.index - step.first) as u32;
                self.stored.push((place, photon.kind, arrived.stored(lane, photon.power)));
            } else if let Some(hit) = self.hits[number] {
                self.meet(step, number, &hit, counts);
            }
        }
        self.arriving.clear();
    }
}

#[inline(always)]
fn event(flight: &Flight, photon: &PathState, hit: &Hit) -> Event {
    let Flight { scene, settings, .. } = flight;
    let index = hit.primitive as usize;
    let material = &scene.materials[scene.geometry.material(index)];
    let is_plain = settings.differentials && photon.medium.is_none() && index < scene.geometry.triangles.len();
    match material {
        Material::Diffuse { .. } if settings.global => Event::Other,
        Material::Diffuse { .. } if !flight.keeps(photon.kind) => Event::End,
        Material::Diffuse { .. } if is_plain => Event::Store,
        Material::Mirror { .. } if is_plain => Event::Mirror,
        _ => Event::Other,
    }
}

/// Sorts by small numbers, those that are alike in the order in which they come.
#[derive(Clone, Debug, Default)]
pub struct Order {
    keys: Vec<u32>,
    /// For each key how many are before it, and then how many are up to it.
    places: Vec<u32>,
    sorted: Vec<u32>,
}

impl Order {
    /// The places of `keys` in the list, by key.
    pub fn by(&mut self, keys: impl Iterator<Item = u32>) -> &[u32] {
        let Self { keys: all, places, sorted } = self;
        all.clear();
        all.extend(keys);
        places.clear();
        places.resize(all.iter().max().map_or(0, |largest| *largest as usize + 2), 0);
        for key in all.iter() {
            places[*key as usize + 1] += 1;
        }
        for i in 1..places.len() {
            places[i] += places[i - 1];
        }
        sorted.clear();
        sorted.resize(all.len(), 0);
        for (index, key) in all.iter().enumerate() {
            let place = &mut places[*key as usize];
            sorted[*place as usize] = index as u32;
            *place += 1;
        }
        sorted
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::hash::mix;

    #[test]
    fn order_is_that_of_a_stable_sort() {
        let mut order = Order::default();
        for (count, largest) in [(0, 1), (1, 1), (1000, 7), (1000, 5000), (3, 4096)] {
            let keys: Vec<u32> = (0..count).map(|i| (mix(i, count) % largest) as u32).collect();
            let mut sorted: Vec<u32> = (0..count as u32).collect();
            sorted.sort_by_key(|i| keys[*i as usize]);
            assert_eq!(order.by(keys.iter().copied()), sorted);
        }
    }
}
