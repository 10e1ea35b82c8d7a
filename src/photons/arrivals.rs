//! What most photons do, eight of them at once in lanes: they arrive at a triangle, and a mirror reflects them.
//!
//! It is computed as for each alone, to the bit, and without a branch; what is rare is only noticed, and left to the caller.

use crate::math::eights::{Group, LANES, Row, choose, is_within, set, vector};
use crate::math::rgb::Rgb;
use crate::photons::StoredPhoton;
use crate::photons::photon::Encoded;
use crate::scene::Geometry;
use crate::trace::differential::{LONGEST, reflect, renormalized, transfer};
use crate::trace::surface::{Place, Turning, corner_normals};
use crate::trace::{Differential, Hit, Ray};
use glam::{DVec3, Vec3};
use pulp::{Arch, Simd, WithSimd};

/// Photons that arrive: direction, differential (dP, dV), the triangle's corners and their normals.
const VECTORS: usize = 11;

/// Photons that arrive at triangles, a group at most.
#[derive(Clone)]
pub struct Arrivals {
    vectors: Group<VECTORS>,
    distance: Row,
    weights: [Row; 2],
    /// 1 where the triangle is smooth.
    smooth: Row,
    /// Which of the caller's photons they are.
    numbers: [u32; LANES],
    count: usize,
}

impl Default for Arrivals {
    fn default() -> Self {
        let row = [0.0; LANES];
        let (distance, weights, smooth) = (row, [row; 2], row);
        Self { vectors: [[row; 3]; VECTORS], distance, weights, smooth, numbers: [0; LANES], count: 0 }
    }
}

impl Arrivals {
    /// Adds a photon that arrives at a triangle; whether that fills the group.
    #[inline(always)]
    pub fn push(&mut self, number: usize, geometry: &Geometry, ray: &Ray, d: &Differential, hit: &Hit) -> bool {
        let lane = self.count % LANES;
        let triangle = hit.primitive as usize;
        let normals = corner_normals(geometry, triangle);
        let [a, b, c] = geometry.corners(triangle);
        let [na, nb, nc] = normals.unwrap_or_default();
        let vectors = [ray.direction, d.dp[0], d.dp[1], d.dv[0], d.dv[1], a, b, c, na, nb, nc];
        for (of, v) in self.vectors.iter_mut().zip(vectors) {
            set(of, lane, v);
        }
        self.distance[lane] = hit.t;
        self.weights[0][lane] = hit.weights[0];
        self.weights[1][lane] = hit.weights[1];
        self.smooth[lane] = if normals.is_some() { 1.0 } else { 0.0 };
        self.numbers[lane] = number as u32;
        self.count = lane + 1;
        self.count == LANES
    }

    /// How many there are.
    pub fn len(&self) -> usize {
        self.count
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.count == 0
    }

    /// Which of the caller's photons is in a lane.
    pub fn number(&self, lane: usize) -> usize {
        self.numbers[lane] as usize
    }

    /// Forgets them.
    pub fn clear(&mut self) {
        self.count = 0;
    }

    /// What becomes of them where they arrive; with `MIRROR` also where that sends them. `longest` is how long columns of dP
    /// (metres) and of dV may be.
    pub fn arrive<const MIRROR: bool>(&self, longest: [f32; 2]) -> Arrived {
        Arch::new().dispatch(Arrive::<MIRROR> { of: self, longest })
    }
}

/// Photons that have arrived; what is said of a lane holds where it is [`Self::is_usual`].
pub struct Arrived {
    /// Of those that a mirror reflects: position, normal, dP, direction, dV. Of others: position, and the numbers of
    /// [`Encoded`].
    vectors: Group<7>,
    usual: Row,
}

impl Arrived {
    /// Whether nothing has to be bounded, and both normals show the sides that the photon comes from and goes to.
    #[inline(always)]
    pub fn is_usual(&self, lane: usize) -> bool {
        self.usual[lane] > 0.0
    }

    /// Position on the surface, metres.
    #[inline(always)]
    pub fn position(&self, lane: usize) -> Vec3 {
        vector(&self.vectors[0], lane)
    }

    /// Unit normal of the flat surface, on the side that the photon arrives at.
    #[inline(always)]
    pub fn normal(&self, lane: usize) -> Vec3 {
        vector(&self.vectors[1], lane)
    }

    /// Unit direction in which a mirror sends it.
    #[inline(always)]
    pub fn direction(&self, lane: usize) -> Vec3 {
        vector(&self.vectors[4], lane)
    }

    /// The differential after a mirror.
    #[inline(always)]
    pub fn differential(&self, lane: usize) -> Differential {
        let [.., a, b, _, c, d] = &self.vectors;
        Differential { dp: [vector(a, lane), vector(b, lane)], dv: [vector(c, lane), vector(d, lane)] }
    }

    /// What is stored of one that no mirror reflects, with the power `power`, W.
    #[inline(always)]
    pub fn stored(&self, lane: usize, power: Rgb) -> StoredPhoton {
        let [_, a, b, c, ..] = &self.vectors;
        let (a, b, c) = (vector(a, lane), vector(b, lane), vector(c, lane));
        let encoded = Encoded { footprint: [a.x, a.y, a.z, b.x], direction: [b.y, b.z], normal: [c.x, c.y] };
        encoded.at(self.position(lane), power)
    }
}

struct Arrive<'a, const MIRROR: bool> {
    of: &'a Arrivals,
    longest: [f32; 2],
}

impl<const MIRROR: bool> WithSimd for Arrive<'_, MIRROR> {
    type Output = Arrived;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> Arrived {
        let mut arrived = Arrived { vectors: [[[0.0; LANES]; 3]; 7], usual: [0.0; LANES] };
        for lane in 0..LANES {
            let arriving = Arriving::of(self.of, lane);
            let arrival = arriving.arrive(self.longest);
            let Arrival { normal, dp, mut is_usual, .. } = arrival;
            set(&mut arrived.vectors[0], lane, arrival.place.position);
            if MIRROR {
                let mirrored = arriving.mirror(&arrival);
                is_usual &= mirrored.is_usual;
                set(&mut arrived.vectors[1], lane, normal);
                set(&mut arrived.vectors[2], lane, dp[0]);
                set(&mut arrived.vectors[3], lane, dp[1]);
                set(&mut arrived.vectors[4], lane, mirrored.direction);
                set(&mut arrived.vectors[5], lane, mirrored.dv[0]);
                set(&mut arrived.vectors[6], lane, mirrored.dv[1]);
            } else {
                let encoded = Encoded::new(arriving.direction, normal, dp);
                let Encoded { footprint: [at, ab, ct, cb], direction, normal } = encoded;
                set(&mut arrived.vectors[1], lane, Vec3::new(at, ab, ct));
                set(&mut arrived.vectors[2], lane, Vec3::new(cb, direction[0], direction[1]));
                set(&mut arrived.vectors[3], lane, Vec3::new(normal[0], normal[1], 0.0));
            }
            arrived.usual[lane] = if is_usual { 1.0 } else { 0.0 };
        }
        arrived
    }
}

/// One photon that arrives.
struct Arriving {
    direction: Vec3,
    dp: [Vec3; 2],
    dv: [Vec3; 2],
    corners: [Vec3; 3],
    normals: [Vec3; 3],
    is_smooth: bool,
    weights: [f32; 2],
    distance: f32,
}

/// Where it has arrived.
struct Arrival {
    place: Place,
    /// 1 on the front side, -1 on the back.
    side: f64,
    normal: Vec3,
    dp: [Vec3; 2],
    is_usual: bool,
}

/// Where a mirror sends it.
struct Mirrored {
    direction: Vec3,
    dv: [Vec3; 2],
    is_usual: bool,
}

impl Arriving {
    #[inline(always)]
    fn of(of: &Arrivals, lane: usize) -> Self {
        let Arrivals { vectors: v, distance, weights, smooth, .. } = of;
        Self {
            direction: vector(&v[0], lane),
            dp: [vector(&v[1], lane), vector(&v[2], lane)],
            dv: [vector(&v[3], lane), vector(&v[4], lane)],
            corners: [vector(&v[5], lane), vector(&v[6], lane), vector(&v[7], lane)],
            normals: [vector(&v[8], lane), vector(&v[9], lane), vector(&v[10], lane)],
            is_smooth: smooth[lane] > 0.0,
            weights: [weights[0][lane], weights[1][lane]],
            distance: distance[lane],
        }
    }

    /// As [`Surface::new`](crate::trace::Surface::new) and [`Differential::transfer`] have it.
    #[inline(always)]
    fn arrive(&self, longest: [f32; 2]) -> Arrival {
        let place = Place::new(self.corners, self.normals, self.is_smooth, self.weights);
        let side = if place.outward.dot(self.direction.as_dvec3()) < 0.0 { 1.0 } else { -1.0 };
        let normal = (place.outward * side).as_vec3();
        let (v, n, s) = (renormalized(self.direction), renormalized(normal), f64::from(self.distance));
        let a = transfer(v, n, s, self.dp[0].as_dvec3(), self.dv[0].as_dvec3());
        let b = transfer(v, n, s, self.dp[1].as_dvec3(), self.dv[1].as_dvec3());
        let dp = [a.as_vec3(), b.as_vec3()];
        let is_usual = is_within(a, LONGEST)
            & is_within(b, LONGEST)
            & is_short(dp[0], longest[0])
            & is_short(dp[1], longest[0])
            & is_short(self.dv[0], longest[1])
            & is_short(self.dv[1], longest[1]);
        Arrival { place, side, normal, dp, is_usual }
    }

    /// As [`reflected`](crate::trace::scatter::reflected) has it.
    #[inline(always)]
    fn mirror(&self, arrival: &Arrival) -> Mirrored {
        let Arrival { place, normal, dp, .. } = arrival;
        let shading = (place.shading * arrival.side).as_vec3();
        let (v, n) = (renormalized(self.direction), renormalized(shading));
        let w = v - n * (2.0 * v.dot(n));
        let turning = Turning::new(self.corners, self.normals, self.weights, shading);
        let (na, nb) = (turning.over(dp[0]), turning.over(dp[1]));
        let is_defined = turning.is_defined & is_within(na, LONGEST) & is_within(nb, LONGEST);
        let a = reflect(v, n, self.turn(na), self.dv[0].as_dvec3());
        let b = reflect(v, n, self.turn(nb), self.dv[1].as_dvec3());
        let is_usual = !place.without_shading
            & (shading.dot(self.direction) < 0.0)
            & (w.dot(normal.as_dvec3()) > 0.0)
            & (!self.is_smooth | is_defined)
            & is_within(a, LONGEST)
            & is_within(b, LONGEST);
        Mirrored { direction: w.normalize().as_vec3(), dv: [a.as_vec3(), b.as_vec3()], is_usual }
    }

    /// The change of the normal that `turned` is of a smooth triangle, as it is stored; none of a flat one.
    #[inline(always)]
    fn turn(&self, turned: DVec3) -> DVec3 {
        choose(self.is_smooth, turned.as_vec3().as_dvec3(), DVec3::ZERO)
    }
}

/// Whether a column is so short that [`Differential::bound`] leaves it without a look at its length.
#[inline(always)]
fn is_short(c: Vec3, longest: f32) -> bool {
    is_within((c * 2.0).as_dvec3(), f64::from(longest))
}
