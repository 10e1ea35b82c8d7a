//! Whether a view footprint meets a photon's ellipsoid.

use crate::photons::MapPhoton;
use crate::photons::map::Query;
use glam::{DVec3, Vec3};

/// What f32 may get wrong of squared lengths, of their sum.
const UNSURE: f32 = 1e-5;

/// Whether the query's parallelogram comes nearer than 1 to the photon in filter space.
pub fn meets_unit_ball(p: &MapPhoton, query: &Query) -> bool {
    meets(p.to_filter(query.center - p.position), || query.axes.map(|v| p.to_filter(v)))
}

/// Whether the parallelogram about `c`, whose half-edges are asked for where they count, comes nearer than 1 to the origin.
#[inline]
fn meets(c: Vec3, axes: impl FnOnce() -> [Vec3; 2]) -> bool {
    let cc = c.length_squared();
    if cc < 1.0 {
        return true;
    }
    let [a, b] = axes();
    let (aa, bb) = (a.length_squared(), b.length_squared());
    let reach = 1.0 + aa.sqrt() + bb.sqrt();
    if cc >= reach * reach {
        return false;
    }
    // In f32 what is decided by more than its rounding: by the plane across the way to the centre, and by a point that is
    // near the nearest.
    let (ca, cb) = (c.dot(a), c.dot(b));
    let rounding = UNSURE * (1.0 + cc + aa + bb);
    if cc - ca.abs() - cb.abs() > cc.sqrt() + rounding {
        return false;
    }
    let near = c + a * (-ca / aa).clamp(-1.0, 1.0) + b * (-cb / bb).clamp(-1.0, 1.0);
    if near.length_squared() < 1.0 - rounding {
        return true;
    }
    nearest_on_parallelogram(c, a, b) < 1.0
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
    use crate::math::sequence::{Sampling, Sequence};

    /// What is decided in f32 is what the nearest point decides in f64, for large and small footprints of both.
    #[test]
    fn short_cuts_decide_as_the_nearest_point_does() {
        let sequence = Sequence::new(Sampling::Random, 10);
        let (mut met, mut missed) = (0, 0);
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
            assert_eq!(meets(c, || [a, b]), exact, "{c} {a} {b}");
            let near = c.length() < 1.0 + a.length() + b.length() && c.length() > 1.0;
            met += u32::from(near && exact);
            missed += u32::from(near && !exact);
        }
        assert!(met > 10_000 && missed > 10_000, "{met} {missed}");
    }
}
