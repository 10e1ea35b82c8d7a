//! Whether a view footprint meets a photon's ellipsoid.

use crate::math::lanes::{Lanes, Vec3Lanes, bits};
use crate::photons::MapPhoton;
use crate::photons::map::Query;
use glam::{DVec3, Vec3};
use pulp::Simd;

/// What f32 may get wrong of squared lengths, of their sum.
const UNSURE: f32 = 1e-5;

/// Whether the query's parallelogram comes nearer than 1 to the photon in filter space.
pub fn meets_unit_ball(p: &MapPhoton, query: &Query) -> bool {
    let [a, b] = query.axes.map(|v| p.to_filter(v));
    meets(p.to_filter(query.center - p.position), a, b)
}

/// The same without the short cuts.
pub fn exactly_meets(p: &MapPhoton, query: &Query) -> bool {
    let [a, b] = query.axes.map(|v| p.to_filter(v));
    nearest_on_parallelogram(p.to_filter(query.center - p.position), a, b) < 1.0
}

/// Whether the parallelogram about `c` with half-edges `a`, `b` comes nearer than 1 to the origin.
#[inline]
fn meets(c: Vec3, a: Vec3, b: Vec3) -> bool {
    let cc = c.length_squared();
    if cc < 1.0 {
        return true;
    }
    // In f32 what is decided by more than its rounding: by the plane across the way to the centre, by a point that is near
    // the nearest, each axis in turn taking it nearer, and by the plane across the way to that.
    let (aa, bb) = (a.length_squared(), b.length_squared());
    let (ca, cb) = (c.dot(a), c.dot(b));
    let rounding = UNSURE * (1.0 + cc + aa + bb);
    let gap = cc - ca.abs() - cb.abs() - rounding;
    if gap > 0.0 && gap * gap > cc {
        return false;
    }
    let ab = a.dot(b);
    let (mut s, mut t) = (0.0, 0.0);
    for _ in 0..2 {
        s = (-(ca + t * ab) / aa).clamp(-1.0, 1.0);
        t = (-(cb + s * ab) / bb).clamp(-1.0, 1.0);
    }
    let near = c + a * s + b * t;
    let squared = near.length_squared();
    let gap = near.dot(c) - near.dot(a).abs() - near.dot(b).abs() - rounding;
    if gap > 0.0 && gap * gap > squared {
        return false;
    }
    squared < 1.0 - rounding || nearest_on_parallelogram(c, a, b) < 1.0
}

/// What f32 decides of the parallelograms in lanes, as bits.
pub struct Reach {
    /// Those that meet the ball.
    pub meets: u32,
    /// Those that may or may not: the nearest point decides.
    pub unsure: u32,
}

/// By the same short cuts whether parallelograms come nearer than 1 to the origin, where they are `among` these.
#[inline(always)]
pub fn reach_in_lanes<S: Simd>(simd: S, c: Vec3Lanes<S>, a: Vec3Lanes<S>, b: Vec3Lanes<S>, among: u32) -> Reach {
    let (zero, one) = (Lanes::splat(simd, 0.0), Lanes::splat(simd, 1.0));
    let (aa, bb, cc) = (a.dot(a), b.dot(b), c.dot(c));
    let (ca, cb) = (c.dot(a), c.dot(b));
    let rounding = Lanes::splat(simd, UNSURE) * (one + cc + aa + bb);
    let gap = cc - ca.abs() - cb.abs() - rounding;
    let meets = among & bits(simd, cc.less(one));
    let misses = bits(simd, simd.and_m32s(zero.less(gap), cc.less(gap * gap)));
    let open = among & !meets & !misses;
    if open == 0 {
        return Reach { meets, unsure: 0 };
    }
    // A vector without length goes nowhere.
    let (per_aa, per_bb, ab) = (one / aa, one / bb, a.dot(b));
    let s = (-ca * per_aa).within_one();
    let t = (-(cb + s * ab) * per_bb).within_one();
    let s = (-(ca + t * ab) * per_aa).within_one();
    let t = (-(cb + s * ab) * per_bb).within_one();
    let near = c + a * s + b * t;
    let squared = near.dot(near);
    let gap = near.dot(c) - near.dot(a).abs() - near.dot(b).abs() - rounding;
    let misses = bits(simd, simd.and_m32s(zero.less(gap), squared.less(gap * gap)));
    let met = open & bits(simd, squared.less(one - rounding));
    Reach { meets: meets | met, unsure: open & !met & !misses }
}

/// Squared distance of the parallelogram `c + s a + t b`, `|s|, |t| ≤ 1`, from the origin.
fn nearest_on_parallelogram(c: Vec3, a: Vec3, b: Vec3) -> f32 {
    let (c, a, b) = (c.as_dvec3(), a.as_dvec3(), b.as_dvec3());
    let (aa, bb, ab) = (a.length_squared(), b.length_squared(), a.dot(b));
    let (ca, cb) = (c.dot(a), c.dot(b));
    let det = aa * bb - ab * ab;
    if det > 0.0 {
        let (s, t) = ((cb * ab - ca * bb) / det, (ca * ab - cb * aa) / det);
        if s.abs() <= 1.0 && t.abs() <= 1.0 {
            return (c + a * s + b * t).length_squared() as f32;
        }
    }
    let along = |from: DVec3, edge: DVec3, squared: f64| {
        let s = if squared > 0.0 { (-from.dot(edge) / squared).clamp(-1.0, 1.0) } else { 0.0 };
        (from + edge * s).length_squared()
    };
    let nearest = along(c - b, a, aa).min(along(c + b, a, aa)).min(along(c - a, b, bb)).min(along(c + a, b, bb));
    nearest as f32
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::lanes::dispatch_in_eights;
    use crate::math::sequence::{Sampling, Sequence};
    use pulp::WithSimd;

    /// One parallelogram in all lanes, and how many there are.
    struct InLanes([Vec3; 3]);

    impl WithSimd for InLanes {
        type Output = (Reach, u32);

        fn with_simd<S: Simd>(self, simd: S) -> Self::Output {
            let [c, a, b] = self.0.map(|v| Vec3Lanes::splat(simd, v));
            let lanes = S::F32_LANES as u32;
            (reach_in_lanes(simd, c, a, b, u32::MAX >> (32 - lanes)), lanes)
        }
    }

    /// What is decided in f32 is what the nearest point decides in f64, for large and small footprints of both.
    #[test]
    fn short_cuts_decide_as_the_nearest_point_does() {
        let sequence = Sequence::new(Sampling::Random, 10);
        let (mut met, mut missed, mut unsure) = (0, 0, 0);
        for i in 0..300_000u64 {
            let vector = |set| Vec3::from_slice(&sequence.four(i, set)[..3]) * 2.0 - 1.0;
            let sizes = sequence.four(i, 3).map(|x| (8.0 * x - 6.0).exp());
            let flat = if i % 2 == 0 { Vec3::new(1.0, 1.0, 0.0) } else { Vec3::ONE };
            let (a, b) =
                (vector(1) * sizes[0] * flat, if i % 5 == 0 { Vec3::ZERO } else { vector(2) * sizes[1] * flat });
            // Near the place where the ball and the parallelogram touch.
            let reach = 1.0 + (a.length() + b.length()) * sizes[2];
            let c = vector(0).normalize() * reach * flat;
            let nearest = nearest_on_parallelogram(c, a, b);
            if (nearest - 1.0).abs() < 1e-6 {
                // The rounding of `c` decides.
                continue;
            }
            let exact = nearest < 1.0;
            assert_eq!(meets(c, a, b), exact, "{c} {a} {b}");
            let reach = dispatch_in_eights(InLanes([c, a, b]));
            let all = u32::MAX >> (32 - reach.1);
            assert!([0, all].contains(&reach.0.meets) && [0, all].contains(&reach.0.unsure));
            assert!(reach.0.unsure != 0 || (reach.0.meets != 0) == exact, "{c} {a} {b}");
            unsure += u32::from(reach.0.unsure != 0);
            let near = c.length() < 1.0 + a.length() + b.length() && c.length() > 1.0;
            met += u32::from(near && exact);
            missed += u32::from(near && !exact);
        }
        assert!(met > 10_000 && missed > 10_000 && unsure < 100_000, "{met} {missed} {unsure}");
    }
}
