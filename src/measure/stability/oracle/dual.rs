//! Dual numbers in f64: a value and its derivative, carried through the formulas that trace a ray.

use glam::DVec3;
use std::ops::{Add, Div, Mul, Neg, Sub};

/// A number with its derivative.
#[derive(Clone, Copy, Debug)]
pub struct Dual {
    /// The number.
    pub v: f64,
    /// Its derivative.
    pub d: f64,
}

/// A vector with its derivative.
#[derive(Clone, Copy, Debug)]
pub struct Dual3 {
    /// The vector.
    pub v: DVec3,
    /// Its derivative.
    pub d: DVec3,
}

impl Dual {
    /// Its square root.
    pub fn sqrt(self) -> Self {
        let root = self.v.sqrt();
        Self { v: root, d: self.d / (2.0 * root) }
    }
}

impl From<f64> for Dual {
    fn from(v: f64) -> Self {
        Self { v, d: 0.0 }
    }
}

impl From<DVec3> for Dual3 {
    fn from(v: DVec3) -> Self {
        Self { v, d: DVec3::ZERO }
    }
}

impl Add for Dual {
    type Output = Self;
    fn add(self, o: Self) -> Self {
        Self { v: self.v + o.v, d: self.d + o.d }
    }
}

impl Sub for Dual {
    type Output = Self;
    fn sub(self, o: Self) -> Self {
        Self { v: self.v - o.v, d: self.d - o.d }
    }
}

impl Mul for Dual {
    type Output = Self;
    fn mul(self, o: Self) -> Self {
        Self { v: self.v * o.v, d: self.d * o.v + self.v * o.d }
    }
}

impl Div for Dual {
    type Output = Self;
    fn div(self, o: Self) -> Self {
        Self { v: self.v / o.v, d: (self.d - self.v / o.v * o.d) / o.v }
    }
}

impl Neg for Dual {
    type Output = Self;
    fn neg(self) -> Self {
        Self { v: -self.v, d: -self.d }
    }
}

impl Add for Dual3 {
    type Output = Self;
    fn add(self, o: Self) -> Self {
        Self { v: self.v + o.v, d: self.d + o.d }
    }
}

impl Sub for Dual3 {
    type Output = Self;
    fn sub(self, o: Self) -> Self {
        Self { v: self.v - o.v, d: self.d - o.d }
    }
}

impl Mul<Dual> for Dual3 {
    type Output = Self;
    fn mul(self, s: Dual) -> Self {
        Self { v: self.v * s.v, d: self.d * s.v + self.v * s.d }
    }
}

impl Dual3 {
    /// Its product with another.
    pub fn dot(self, o: Self) -> Dual {
        Dual { v: self.v.dot(o.v), d: self.d.dot(o.v) + self.v.dot(o.d) }
    }

    /// The unit vector along it.
    pub fn normalize(self) -> Self {
        self * (Dual::from(1.0) / self.dot(self).sqrt())
    }

    /// Where a ray from here along `v` meets the plane through `point` across `n`.
    pub fn to_plane(self, v: Self, point: DVec3, n: DVec3) -> Self {
        let n = Self::from(n);
        self + v * ((Self::from(point) - self).dot(n) / v.dot(n))
    }

    /// Where a ray from here along the unit vector `v` meets a sphere, on its way in or (`out`) on its way out.
    pub fn to_sphere(self, v: Self, center: DVec3, radius: f64, out: bool) -> Self {
        let o = self - Self::from(center);
        let b = o.dot(v);
        // |o - (o·v)v|² instead of |o|² - (o·v)².
        let off = o - v * b;
        let half = (Dual::from(radius * radius) - off.dot(off)).sqrt();
        self + v * (-b + if out { half } else { -half })
    }

    /// This direction reflected at the unit normal `n`.
    pub fn reflected(self, n: Self) -> Self {
        self - n * (Dual::from(2.0) * self.dot(n))
    }

    /// This direction refracted at the unit normal `n` that faces it, with the ratio of indices `eta`.
    pub fn refracted(self, n: Self, eta: f64) -> Self {
        let eta = Dual::from(eta);
        // The sine squared from the part along the surface, which keeps its digits.
        let along = self - n * self.dot(n);
        let root = (Dual::from(1.0) - eta * eta * along.dot(along)).sqrt();
        along * eta - n * root
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn derivatives_are_those_of_differences() {
        let n = DVec3::new(0.2, 0.9, -0.1).normalize();
        let at = |x: f64| {
            let o = Dual3 { v: DVec3::new(0.1 + 0.3 * x, 3.0, 0.2), d: DVec3::X * 0.3 };
            let v = Dual3 { v: DVec3::new(0.1, -1.0, 0.1 * x), d: DVec3::Z * 0.1 }.normalize();
            let p = o.to_sphere(v, DVec3::new(0.2, 0.1, 0.0), 1.0, false);
            let m = (p - Dual3::from(DVec3::new(0.2, 0.1, 0.0))).normalize();
            let w = v.refracted(m, 0.7).reflected(Dual3::from(n));
            p.to_plane(w, DVec3::Y, n)
        };
        let h = 1e-5;
        let finite = (at(h).v - at(-h).v) / (2.0 * h);
        assert!((finite - at(0.0).d).length() < 1e-8 * finite.length(), "{finite} {}", at(0.0).d);
    }
}
