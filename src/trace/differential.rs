//! Ray differentials: transfer, reflection and refraction (Igehy 1999; Pedersen 2011, section 3.1).
//!
//! The operations follow the corrected equations of `docs/theory.md`; the arithmetic is f64, the storage f32.

use glam::{DVec3, Vec3};

/// Smallest |VᵀN| and √ε that transfer and refraction divide by, far below what unit vectors in f32 can tell from 0.
///
/// It only keeps infinities away. What it leaves is far longer than [`Differential::bound`] allows, which counts it.
const SMALLEST: f64 = 1e-30;

/// How a ray's origin and direction change with its two parameters.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Differential {
    /// Columns of dP: change of the origin, metres.
    pub dp: [Vec3; 2],
    /// Columns of dV: change of the unit direction.
    pub dv: [Vec3; 2],
}

impl Differential {
    /// That of a ray which carries none.
    pub const NONE: Self = Self { dp: [Vec3::ZERO; 2], dv: [Vec3::ZERO; 2] };

    /// Whether nothing changes with the parameters: a ray that carries no differential.
    pub fn is_none(&self) -> bool {
        *self == Self::default()
    }

    /// Moves the origin along the unit direction `v` by `s` metres to a surface of unit normal `n`
    /// (Pedersen 2011, eq. 26 corrected). `dv` stays. At grazing incidence as long as it is, never infinite.
    pub fn transfer(&self, v: Vec3, n: Vec3, s: f32) -> Self {
        let (v, n) = (renormalized(v), renormalized(n));
        let column = |i: usize| stored(transfer(v, n, f64::from(s), self.dp[i].as_dvec3(), self.dv[i].as_dvec3()));
        Self { dp: [column(0), column(1)], dv: self.dv }
    }

    /// Reflects at unit normal `n` whose own change over the footprint is `dn` (Pedersen 2011, eq. 28 corrected).
    pub fn reflect(&self, v: Vec3, n: Vec3, dn: [Vec3; 2]) -> Self {
        let (v, n) = (renormalized(v), renormalized(n));
        let column = |i: usize| stored(reflect(v, n, dn[i].as_dvec3(), self.dv[i].as_dvec3()));
        Self { dp: self.dp, dv: [column(0), column(1)] }
    }

    /// Refracts at unit normal `n`, which faces the incident side, with `eta` the ratio of the indices n₁/n₂
    /// (Pedersen 2011, eq. 35 corrected). At the critical angle, where `1/√ε` has its pole, as long as it is, never infinite.
    pub fn refract(&self, v: Vec3, n: Vec3, dn: [Vec3; 2], eta: f32) -> Self {
        let (v, n) = (renormalized(v), renormalized(n));
        let column = |i: usize| stored(refract(v, n, dn[i].as_dvec3(), self.dv[i].as_dvec3(), f64::from(eta)));
        Self { dp: self.dp, dv: [column(0), column(1)] }
    }

    /// Shortens columns longer than `length` (metres) in `dp` and longer than `angle` in `dv`. A column that became
    /// infinite gets the largest length in the direction of its infinite components; one that is no number has no
    /// direction and becomes zero. Returns whether anything was changed.
    pub fn bound(&mut self, length: f32, angle: f32) -> bool {
        let mut changed = false;
        for (columns, limit) in [(&mut self.dp, length), (&mut self.dv, angle)] {
            for c in columns {
                let longest = c.abs().max_element();
                if c.is_finite() && longest * 2.0 <= limit {
                    continue;
                }
                let along = if c.is_finite() {
                    c.as_dvec3()
                } else {
                    c.as_dvec3().map(|x| if x.is_infinite() { x.signum() } else { 0.0 })
                };
                let l = along.length();
                if !c.is_finite() || l > f64::from(limit) {
                    *c = if l > 0.0 { (along * (f64::from(limit) / l)).as_vec3() } else { Vec3::ZERO };
                    changed = true;
                }
            }
        }
        changed
    }
}

/// Longest component of a column that f32 stores.
pub(crate) const LONGEST: f64 = 1e38;

/// A column as it is stored: one too long for f32 keeps its direction.
pub(super) fn stored(c: DVec3) -> Vec3 {
    let longest = c.abs().max_element();
    if longest > LONGEST { (c * (LONGEST / longest)).as_vec3() } else { c.as_vec3() }
}

/// A unit vector in f64: the length of one in f32 is wrong by 6·10⁻⁸, which near the critical angle is not little.
///
/// Two of Newton's steps for `1/√x` from 1, each of which squares the error, leave none: no root and no division.
#[inline(always)]
pub(crate) fn renormalized(v: Vec3) -> DVec3 {
    let v = v.as_dvec3();
    let x = v.length_squared();
    let y = 1.5 - 0.5 * x;
    v * (y * (1.5 - 0.5 * x * y * y))
}

/// One column of `dQ = (I - V Nᵀ/(VᵀN)) (dP + s dV)`.
#[inline(always)]
pub(crate) fn transfer(v: DVec3, n: DVec3, s: f64, dp: DVec3, dv: DVec3) -> DVec3 {
    let moved = dp + dv * s;
    moved - v * (n.dot(moved) * per_cosine(v, n))
}

/// `1/(VᵀN)`, as large as it is, never infinite.
#[inline(always)]
fn per_cosine(v: DVec3, n: DVec3) -> f64 {
    let vn = v.dot(n);
    1.0 / vn.abs().max(SMALLEST).copysign(vn)
}

/// One column of `dW = (I - 2 N Nᵀ) dV - 2 (VᵀN I + N Vᵀ) dN`.
#[inline(always)]
pub(crate) fn reflect(v: DVec3, n: DVec3, dn: DVec3, dv: DVec3) -> DVec3 {
    dv - n * (2.0 * n.dot(dv)) - dn * (2.0 * v.dot(n)) - n * (2.0 * v.dot(dn))
}

/// One column of `dW = (η I - η N (1 + η VᵀN/√ε) Nᵀ) dV - (μ I + η N (1 + η VᵀN/√ε) Vᵀ) dN`.
fn refract(v: DVec3, n: DVec3, dn: DVec3, dv: DVec3, eta: f64) -> DVec3 {
    let vn = v.dot(n);
    let root = (1.0 - eta * eta * (1.0 - vn * vn)).max(0.0).sqrt().max(SMALLEST);
    let mu = eta * vn + root;
    let bracket = eta * (1.0 + eta * vn / root);
    dv * eta - n * (bracket * n.dot(dv)) - dn * mu - n * (bracket * v.dot(dn))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// A ray in f64 as a function of two parameters: origin and direction both move.
    fn ray(p: [f64; 2]) -> (DVec3, DVec3) {
        let origin = DVec3::new(0.1 + 0.2 * p[0], -0.2 + 0.1 * p[1], 3.0 + 0.05 * p[0]);
        let target = DVec3::new(0.6 - 0.3 * p[0] + 0.1 * p[1], 0.35 + 0.4 * p[1], 0.0);
        (origin, (target - origin).normalize())
    }

    #[derive(Clone, Copy)]
    enum Shape {
        Plane,
        Sphere,
    }

    #[derive(Clone, Copy)]
    enum Act {
        Reflect,
        Refract(f64),
    }

    /// Hit distance and unit normal that faces the ray, in f64, by closed forms.
    fn hit(shape: Shape, o: DVec3, v: DVec3) -> (f64, DVec3) {
        match shape {
            Shape::Plane => {
                let n = DVec3::new(0.2, -0.1, 1.0).normalize();
                (-n.dot(o) / n.dot(v), n)
            }
            Shape::Sphere => {
                let b = o.dot(v);
                let s = -b - (b * b - o.length_squared() + 1.0).sqrt();
                (s, o + v * s)
            }
        }
    }

    fn traced(shape: Shape, act: Act, p: [f64; 2]) -> (DVec3, DVec3) {
        let (o, v) = ray(p);
        let (s, n) = hit(shape, o, v);
        let w = match act {
            Act::Reflect => v - n * (2.0 * v.dot(n)),
            Act::Refract(eta) => {
                let root = (1.0 - eta * eta * (1.0 - v.dot(n).powi(2))).sqrt();
                v * eta - n * (eta * v.dot(n) + root)
            }
        };
        (o + v * s, w)
    }

    fn central<T>(h: f64, axis: usize, f: impl Fn([f64; 2]) -> T) -> (T, T) {
        let step = |s: f64| {
            let mut p = [0.0; 2];
            p[axis] = s;
            f(p)
        };
        (step(h), step(-h))
    }

    /// Every operation against central differences of the traced ray; the difference falls as h².
    #[test]
    fn operations_match_finite_differences_to_second_order() {
        let (o, v) = ray([0.0; 2]);
        for shape in [Shape::Plane, Shape::Sphere] {
            for act in [Act::Reflect, Act::Refract(1.0 / 1.5), Act::Refract(1.3)] {
                let (s, n) = hit(shape, o, v);
                for axis in 0..2 {
                    let (a, b) = central(1e-5, axis, ray);
                    let (dp, dv) = ((a.0 - b.0) / 2e-5, (a.1 - b.1) / 2e-5);
                    let dq = transfer(v, n, s, dp, dv);
                    let dn = match shape {
                        Shape::Plane => DVec3::ZERO,
                        Shape::Sphere => dq,
                    };
                    let dw = match act {
                        Act::Reflect => reflect(v, n, dn, dv),
                        Act::Refract(eta) => refract(v, n, dn, dv, eta),
                    };
                    let error = |h: f64| {
                        let (a, b) = central(h, axis, |p| traced(shape, act, p));
                        let q = (a.0 - b.0) / (2.0 * h) - dq;
                        let w = (a.1 - b.1) / (2.0 * h) - dw;
                        q.length() + w.length()
                    };
                    let (coarse, fine) = (error(4e-3), error(2e-3));
                    assert!(error(1e-4) < 1e-6, "{}", error(1e-4));
                    let order = (coarse / fine).log2();
                    assert!((1.8..2.2).contains(&order), "order {order}");
                }
            }
        }
    }

    /// The thesis's printed equations 26, 28 and 35 miss by far more than the corrected ones.
    #[test]
    fn printed_equations_fail_the_same_check() {
        let (o, v) = ray([0.0; 2]);
        let (s, n) = hit(Shape::Sphere, o, v);
        let (a, b) = central(1e-5, 0, ray);
        let (dp, dv) = ((a.0 - b.0) / 2e-5, (a.1 - b.1) / 2e-5);
        let truth = |act| {
            let (a, b) = central(1e-4, 0, |p| traced(Shape::Sphere, act, p));
            ((a.0 - b.0) / 2e-4, (a.1 - b.1) / 2e-4)
        };
        let vn = v.dot(n);
        let printed_26 = dp - v * (n.dot(dp) / vn) - (v * n.dot(dv) + dv) * (s / vn);
        let (dq, reflected) = truth(Act::Reflect);
        assert!((printed_26 - dq).length() > 5e-2);
        let printed_28 = dv - n * (2.0 * n.dot(dv)) - (dq * vn - n * v.dot(dq)) * 2.0;
        assert!((printed_28 - reflected).length() > 5e-2);
        let eta: f64 = 1.0 / 1.5;
        let (dq, refracted) = truth(Act::Refract(eta));
        let root = (1.0 - eta * eta * (1.0 - vn * vn)).sqrt();
        let bracket = eta * (1.0 + eta * vn / root);
        let printed_35 = dv * eta - n * (bracket * n.dot(dv)) - dq * (eta * vn + root) + n * (bracket * v.dot(dq));
        assert!((printed_35 - refracted).length() > 5e-2);
    }

    proptest! {
        #[test]
        fn transferred_columns_lie_in_the_plane(
            n in prop::array::uniform3(-1.0f32..1.0), v in prop::array::uniform3(-1.0f32..1.0),
            dp in prop::array::uniform3(-1.0f32..1.0), s in 0.0f32..10.0,
        ) {
            let (n, v) = (Vec3::from(n), Vec3::from(v));
            prop_assume!(n.length() > 0.1 && v.length() > 0.1);
            let (n, v) = (n.normalize(), v.normalize());
            prop_assume!(n.dot(v).abs() > 0.01);
            let d = Differential { dp: [dp.into(), Vec3::X], dv: [Vec3::Y, Vec3::ZERO] }.transfer(v, n, s);
            for c in d.dp {
                prop_assert!(c.dot(n).abs() <= 1e-5 * (1.0 + c.length()));
            }
        }

        #[test]
        fn nothing_is_infinite(
            v in prop::array::uniform3(-1.0f32..1.0), eta in 0.5f32..2.0, tilt in -1e-6f32..1e-6,
        ) {
            let v = Vec3::from(v);
            prop_assume!(v.length() > 0.1);
            let v = v.normalize();
            let (t, _) = crate::math::frame::tangents(v);
            let n = (t + v * tilt).normalize();
            let d = Differential { dp: [Vec3::X, Vec3::Y], dv: [Vec3::Y, Vec3::Z] };
            let mut all = d.transfer(v, n, 1.0).reflect(v, n, [Vec3::X; 2]).refract(v, n, [Vec3::X; 2], eta);
            all.bound(1.0, 10.0);
            for c in all.dp.into_iter().chain(all.dv) {
                prop_assert!(c.is_finite() && c.length() <= 10.001);
            }
        }
    }

    /// In the plane of the surface and at the critical angle a column is endless: the longest allowed, and it says so.
    #[test]
    fn what_would_be_infinite_is_the_longest_allowed() {
        let d = Differential { dp: [Vec3::Y, Vec3::ZERO], dv: [Vec3::Y, Vec3::ZERO] };
        let mut along = d.transfer(Vec3::X, Vec3::Y, 1.0);
        assert!(along.dp[0].is_finite() && along.bound(2.0, 10.0));
        assert!((along.dp[0].abs() - Vec3::X * 2.0).length() < 1e-6 && along.dp[1] == Vec3::ZERO);
        let (sin, cos) = libm::sincos(libm::asin(1.0 / 1.5));
        let critical = Vec3::new(sin as f32, -cos as f32, 0.0);
        let mut through = d.refract(critical, Vec3::Y, [Vec3::ZERO; 2], 1.5);
        assert!(through.bound(2.0, 10.0));
        assert!((through.dv[0].length() - 10.0).abs() < 1e-5 && through.dv[0].normalize().y.abs() > 0.99);
        let endless = Vec3::new(1.0, f32::NEG_INFINITY, 0.0);
        let mut endless = Differential { dp: [endless, Vec3::ZERO], ..Default::default() };
        assert!(endless.bound(2.0, 10.0));
        assert_eq!(endless.dp[0], Vec3::NEG_Y * 2.0);
    }

    #[test]
    fn bound_reports_what_it_changes() {
        let mut d = Differential { dp: [Vec3::X * 3.0, Vec3::Y], dv: [Vec3::ZERO, Vec3::splat(f32::NAN)] };
        assert!(d.bound(2.0, 1.0));
        assert_eq!(d.dp, [Vec3::X * 2.0, Vec3::Y]);
        assert_eq!(d.dv[1], Vec3::ZERO);
        assert!(!d.bound(2.0, 1.0));
    }
}
