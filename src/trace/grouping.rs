//! Many rays through a small hierarchy: those that go about the same way are traced together.

use super::intersector::{FAR, Hit, Intersector, Ray};
use super::packet::{PACKET, Packet, PacketTest, Visits, traverse_packet};
use super::traversal::octant_of;
use super::triangle::{ShearedRays, axes_of};
use crate::math::eights::Row;
use pulp::Simd;

/// Fewer rays than these are not traced together, nor are those that share nodes with fewer on average.
const FEW: usize = 3;

/// Nodes that packets visit before that is judged.
const ENOUGH: u32 = 200;

/// Rays of a packet that wait for others, and which they are of all.
#[derive(Clone, Copy)]
struct Waiting {
    packet: Packet,
    numbers: [u32; PACKET],
}

impl Intersector {
    /// The nearest surfaces along all rays. Neighbours in the list that go about the same way are traced together.
    pub(super) fn closest_in_packets(&self, rays: &[Ray], hits: &mut [Option<Hit>]) {
        // Three for each octant: one for each axis that may be the longest.
        let mut waiting: [Waiting; 24] =
            std::array::from_fn(|i| Waiting { packet: Packet::new(i as u32 / 3), numbers: [0; PACKET] });
        let mut visits = Visits::default();
        for (number, ray) in rays.iter().enumerate() {
            // Rays that go anywhere take longer together.
            if visits.nodes > ENOUGH && visits.by_rays < visits.nodes * FEW as u32 {
                hits[number] = self.closest(ray);
                continue;
            }
            let scaled = Ray { origin: ray.origin * self.scale, ..*ray };
            if !self.is_sound(&scaled) {
                continue;
            }
            if scaled.origin.abs().max_element() > FAR {
                hits[number] = self.closest(ray);
                continue;
            }
            let [.., along] = axes_of(scaled.direction);
            let Waiting { packet, numbers } = &mut waiting[octant_of(scaled.direction) as usize * 3 + along];
            numbers[packet.push(&scaled)] = number as u32;
            if packet.ray_count() == PACKET {
                let own = self.closest_of_packet(packet, numbers, hits);
                visits = Visits { nodes: visits.nodes + own.nodes, by_rays: visits.by_rays + own.by_rays };
                packet.clear();
            }
        }
        for Waiting { packet, numbers } in &waiting {
            if packet.ray_count() >= FEW {
                self.closest_of_packet(packet, numbers, hits);
                continue;
            }
            for &number in &numbers[..packet.ray_count()] {
                hits[number as usize] = self.closest(&rays[number as usize]);
            }
        }
    }

    fn closest_of_packet(&self, packet: &Packet, numbers: &[u32; PACKET], hits: &mut [Option<Hit>]) -> Visits {
        let mut closest = ClosestOfPacket {
            on: self,
            packet,
            sheared: ShearedRays::default(),
            t: [f32::INFINITY; PACKET],
            leaves: [usize::MAX; PACKET],
            weights: [[0.0; 2]; PACKET],
        };
        let visits = traverse_packet(&self.bvh.nodes, packet, &mut closest);
        for (lane, &number) in numbers[..packet.ray_count()].iter().enumerate() {
            hits[number as usize] = self.hit(closest.leaves[lane], closest.t[lane], closest.weights[lane]);
        }
        visits
    }
}

/// The nearest of the surfaces that each ray of a packet meets.
struct ClosestOfPacket<'a> {
    on: &'a Intersector,
    packet: &'a Packet,
    sheared: ShearedRays,
    t: Row,
    /// Entries: what they stand for is looked up in the end.
    leaves: [usize; PACKET],
    weights: [[f32; 2]; PACKET],
}

impl PacketTest for ClosestOfPacket<'_> {
    #[inline(always)]
    fn start(&mut self, packet: &Packet) {
        self.sheared = ShearedRays::new(&packet.origin, &packet.direction);
    }

    #[inline(always)]
    fn test<S: Simd>(&mut self, simd: S, leaf: usize, rays: u32, limits: &mut Row) {
        if self.on.is_triangle(leaf) {
            let hits = self.sheared.intersect(simd, &self.on.leaves[leaf], &self.t, rays);
            let mut met = hits.met;
            while met != 0 {
                let lane = met.trailing_zeros() as usize;
                met &= met - 1;
                self.meet(leaf, lane, hits.t[lane], [hits.weights[0][lane], hits.weights[1][lane]], limits);
            }
        } else {
            for lane in (0..PACKET).filter(|lane| rays >> lane & 1 == 1) {
                if let Some(t) = self.on.sphere(&self.packet.ray(lane), leaf, self.t[lane]) {
                    self.meet(leaf, lane, t, [0.0; 2], limits);
                }
            }
        }
    }
}

impl ClosestOfPacket<'_> {
    /// A ray meets an entry no farther away than the nearest before.
    #[inline(always)]
    fn meet(&mut self, leaf: usize, lane: usize, t: f32, weights: [f32; 2], limits: &mut Row) {
        if t < self.t[lane] || self.on.is_before(leaf, self.leaves[lane]) {
            self.t[lane] = t;
            self.leaves[lane] = leaf;
            self.weights[lane] = weights;
            limits[lane] = t;
        }
    }
}
