//! Many rays through a small hierarchy: those that go about the same way are traced together.

use super::intersector::{Hit, Intersector, Ray, Start};
use super::packet::{BoxRays, PACKET, PacketTest, traverse_packet};
use super::traversal::octant_of;
use super::triangle::{ShearedRays, axes_of};
use glam::Vec3;

/// Fewer rays than these are not traced together.
const FEW: usize = 3;

/// Rays of a packet that wait for others.
#[derive(Clone, Copy)]
struct Waiting {
    rays: [Ray; PACKET],
    starts: [Start; PACKET],
    boxes: BoxRays,
    /// Which rays of all they are.
    numbers: [u32; PACKET],
    count: usize,
}

impl Waiting {
    /// None yet, of that octant.
    fn new(octant: u32) -> Self {
        let ray = Ray { origin: Vec3::ZERO, direction: Vec3::ZERO };
        let (rays, starts) = ([ray; PACKET], [Start::default(); PACKET]);
        Self { rays, starts, boxes: BoxRays::new(octant), numbers: [0; PACKET], count: 0 }
    }
}

impl Intersector {
    /// The nearest surfaces along all rays. Neighbours in the list that go about the same way are traced together.
    pub(super) fn closest_in_packets(&self, rays: &[Ray], hits: &mut [Option<Hit>]) {
        // Three for each octant: one for each axis that may be the longest.
        let mut waiting: [Waiting; 24] = std::array::from_fn(|i| Waiting::new(i as u32 / 3));
        for (number, ray) in rays.iter().enumerate() {
            let Some((ray, start)) = self.ready(ray) else { continue };
            let [.., along] = axes_of(ray.direction);
            let own = &mut waiting[octant_of(&start.traversal) as usize * 3 + along];
            let lane = own.count;
            own.rays[lane] = ray;
            own.starts[lane] = start;
            own.boxes.set(lane, &start.traversal);
            own.numbers[lane] = number as u32;
            own.count += 1;
            if own.count == PACKET {
                self.closest_of_packet(own, hits);
                own.count = 0;
            }
        }
        for own in waiting.iter().filter(|own| own.count > 0) {
            if own.count >= FEW {
                self.closest_of_packet(own, hits);
                continue;
            }
            for lane in 0..own.count {
                hits[own.numbers[lane] as usize] = self.closest_from(own.rays[lane], own.starts[lane]);
            }
        }
    }

    fn closest_of_packet(&self, waiting: &Waiting, hits: &mut [Option<Hit>]) {
        let Waiting { rays, starts, boxes, numbers, count } = waiting;
        let mut closest = ClosestOfPacket {
            on: self,
            rays,
            starts,
            sheared: ShearedRays::new(rays),
            t: [f32::INFINITY; PACKET],
            leaves: [usize::MAX; PACKET],
            weights: [[0.0; 2]; PACKET],
        };
        // Lanes without a ray hold what was there before, or nothing; they take no part.
        traverse_packet(&self.bvh.nodes, boxes, (1 << count) - 1, &mut closest);
        for lane in 0..*count {
            hits[numbers[lane] as usize] = self.hit(closest.leaves[lane], closest.t[lane], closest.weights[lane]);
        }
    }
}

/// The nearest of the surfaces that each ray of a packet meets.
struct ClosestOfPacket<'a> {
    on: &'a Intersector,
    rays: &'a [Ray; PACKET],
    starts: &'a [Start; PACKET],
    sheared: ShearedRays,
    t: [f32; PACKET],
    leaves: [usize; PACKET],
    weights: [[f32; 2]; PACKET],
}

impl PacketTest for ClosestOfPacket<'_> {
    #[inline(always)]
    fn test(&mut self, leaf: usize, rays: u32, limits: &mut [f32; PACKET]) {
        if self.on.is_triangle(leaf) {
            let hits = self.sheared.intersect(&self.on.leaves[leaf], &self.t, rays);
            let mut met = hits.met;
            while met != 0 {
                let lane = met.trailing_zeros() as usize;
                met &= met - 1;
                self.meet(leaf, lane, hits.t[lane], [hits.weights[0][lane], hits.weights[1][lane]], limits);
            }
        } else {
            for lane in (0..PACKET).filter(|lane| rays >> lane & 1 == 1) {
                if let Some(t) = self.on.sphere(&self.rays[lane], leaf, self.t[lane]) {
                    self.meet(leaf, lane, t, [0.0; 2], limits);
                }
            }
        }
    }
}

impl ClosestOfPacket<'_> {
    /// A ray meets an entry no farther away than the nearest before.
    #[inline(always)]
    fn meet(&mut self, leaf: usize, lane: usize, t: f32, weights: [f32; 2], limits: &mut [f32; PACKET]) {
        if t < self.t[lane] || self.on.is_before(leaf, self.leaves[lane]) {
            self.t[lane] = t;
            self.leaves[lane] = leaf;
            self.weights[lane] = weights;
            limits[lane] = self.starts[lane].before(t);
        }
    }
}
