//! What most photons do, eight of them at once in lanes: they arrive at a triangle, and a mirror reflects them.
//!
//! It is computed as for each alone, to the bit, and without a branch; what is rare is only noticed, and left to the caller.

use crate::math::eights::{Group, LANES, Row, is_within, set, vector};
use crate::math::rgb::Rgb;
use crate::photons::StoredPhoton;
use crate::photons::photon::Encoded;
use crate::scene::Geometry;
use crate::trace::differential::{LONGEST, reflect, renormalized, transfer};
use crate::trace::surface::{Place, Turning, corner_normals};
use crate::trace::{Differential, Hit, Ray};
use glam::Vec3;
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
        for i in 0..VECTORS {
            set(&mut self.vectors[i], lane, vectors[i]);
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
        let Self { of, longest } = self;
        let mut arrived = Arrived { vectors: [[[0.0; LANES]; 3]; 7], usual: [0.0; LANES] };
        for lane in 0..LANES {
            let v = vector(&of.vectors[0], lane);
            let dp = [vector(&of.vectors[1], lane), vector(&of.vectors[2], lane)];
            let dv = [vector(&of.vectors[3], lane), vector(&of.vectors[4], lane)];
            let corners = [vector(&of.vectors[5], lane), vector(&of.vectors[6], lane), vector(&of.vectors[7], lane)];
            let normals = [vector(&of.vectors[8], lane), vector(&of.vectors[9], lane), vector(&of.vectors[10], lane)];
            let is_smooth = of.smooth[lane] > 0.0;
            let weights = [of.weights[0][lane], of.weights[1][lane]];
            let place = Place::new(corners, normals, is_smooth, weights);
            let side = if place.outward.dot(v.as_dvec3()) < 0.0 { 1.0 } else { -1.0 };
            let normal = (place.outward * side).as_vec3();
            let (unit, n) = (renormalized(v), renormalized(normal));
            let distance = f64::from(of.distance[lane]);
            let dp = [
                transfer(unit, n, distance, dp[0].as_dvec3(), dv[0].as_dvec3()),
                transfer(unit, n, distance, dp[1].as_dvec3(), dv[1].as_dvec3()),
            ];
            let mut usual = is_within(dp[0], LONGEST) & is_within(dp[1], LONGEST);
            let dp = [dp[0].as_vec3(), dp[1].as_vec3()];
            // Half of it, as no column whose components are so short is longer.
            usual &= is_within((dp[0] * 2.0).as_dvec3(), f64::from(longest[0]));
            usual &= is_within((dp[1] * 2.0).as_dvec3(), f64::from(longest[0]));
            usual &= is_within((dv[0] * 2.0).as_dvec3(), f64::from(longest[1]));
            usual &= is_within((dv[1] * 2.0).as_dvec3(), f64::from(longest[1]));
            set(&mut arrived.vectors[0], lane, place.position);
            if !MIRROR {
                let Encoded { footprint: [at, ab, ct, cb], direction, normal } = Encoded::new(v, normal, dp);
                set(&mut arrived.vectors[1], lane, Vec3::new(at, ab, ct));
                set(&mut arrived.vectors[2], lane, Vec3::new(cb, direction[0], direction[1]));
                set(&mut arrived.vectors[3], lane, Vec3::new(normal[0], normal[1], 0.0));
            } else {
                set(&mut arrived.vectors[1], lane, normal);
                set(&mut arrived.vectors[2], lane, dp[0]);
                set(&mut arrived.vectors[3], lane, dp[1]);
                let shading = (place.shading * side).as_vec3();
                let bent = renormalized(shading);
                let w = unit - bent * (2.0 * unit.dot(bent));
                let stays = w.dot(normal.as_dvec3()) > 0.0;
                let turning = Turning::new(corners, normals, weights, shading);
                let turned = [turning.over(dp[0]), turning.over(dp[1])];
                usual &= !place.without_shading & (shading.dot(v) < 0.0) & stays;
                usual &=
                    !is_smooth | (turning.is_defined & is_within(turned[0], LONGEST) & is_within(turned[1], LONGEST));
                let turns = |dn: glam::DVec3| {
                    let dn = dn.as_vec3();
                    let of = |x: f32| f64::from(if is_smooth { x } else { 0.0 });
                    glam::DVec3::new(of(dn.x), of(dn.y), of(dn.z))
                };
                let dv = [
                    reflect(unit, bent, turns(turned[0]), dv[0].as_dvec3()),
                    reflect(unit, bent, turns(turned[1]), dv[1].as_dvec3()),
                ];
                usual &= is_within(dv[0], LONGEST) & is_within(dv[1], LONGEST);
                set(&mut arrived.vectors[4], lane, w.normalize().as_vec3());
                set(&mut arrived.vectors[5], lane, dv[0].as_vec3());
                set(&mut arrived.vectors[6], lane, dv[1].as_vec3());
            }
            arrived.usual[lane] = if usual { 1.0 } else { 0.0 };
        }
        arrived
    }
}
