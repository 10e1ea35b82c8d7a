//! Numbers and vectors in as many lanes as the processor's instructions have. What is written with them rounds in each lane
//! as it does alone: no product is fused with a sum.

use glam::Vec3;
use pulp::Simd;
use std::ops::{Add, Div, Mul, Neg, Sub};

/// A 32-bit number in each lane.
#[derive(Clone, Copy, Debug)]
pub struct Lanes<S: Simd> {
    simd: S,
    value: S::f32s,
}

impl<S: Simd> Lanes<S> {
    /// The numbers of `array` from `group` times the number of lanes on, which divides `N`.
    #[inline(always)]
    pub fn of<const N: usize>(simd: S, array: &[f32; N], group: usize) -> Self {
        Self { simd, value: S::as_simd_f32s(array).0[group] }
    }

    /// The same number in each.
    #[inline(always)]
    pub fn splat(simd: S, x: f32) -> Self {
        Self { simd, value: simd.splat_f32s(x) }
    }

    /// Square roots.
    #[inline(always)]
    pub fn sqrt(self) -> Self {
        Self { value: self.simd.sqrt_f32s(self.value), ..self }
    }

    /// Magnitudes.
    #[inline(always)]
    pub fn abs(self) -> Self {
        Self { value: self.simd.abs_f32s(self.value), ..self }
    }

    /// Where it is less; nowhere next to what is no number, as below.
    #[inline(always)]
    pub fn less(self, other: Self) -> S::m32s {
        self.simd.less_than_f32s(self.value, other.value)
    }

    /// Where it is at most as large.
    #[inline(always)]
    pub fn at_most(self, other: Self) -> S::m32s {
        self.simd.less_than_or_equal_f32s(self.value, other.value)
    }

    /// It where the mask holds, and `other` elsewhere.
    #[inline(always)]
    pub fn or(self, mask: S::m32s, other: Self) -> Self {
        Self { value: self.simd.select_f32s(mask, self.value, other.value), ..self }
    }
}

impl<S: Simd> Add for Lanes<S> {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        Self { value: self.simd.add_f32s(self.value, other.value), ..self }
    }
}

impl<S: Simd> Sub for Lanes<S> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        Self { value: self.simd.sub_f32s(self.value, other.value), ..self }
    }
}

impl<S: Simd> Mul for Lanes<S> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        Self { value: self.simd.mul_f32s(self.value, other.value), ..self }
    }
}

impl<S: Simd> Div for Lanes<S> {
    type Output = Self;
    #[inline(always)]
    fn div(self, other: Self) -> Self {
        Self { value: self.simd.div_f32s(self.value, other.value), ..self }
    }
}

impl<S: Simd> Neg for Lanes<S> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self { value: self.simd.neg_f32s(self.value), ..self }
    }
}

/// A vector in each lane.
#[derive(Clone, Copy, Debug)]
pub struct Vec3Lanes<S: Simd> {
    /// Their first coordinates.
    pub x: Lanes<S>,
    /// Their second coordinates.
    pub y: Lanes<S>,
    /// Their third coordinates.
    pub z: Lanes<S>,
}

impl<S: Simd> Vec3Lanes<S> {
    /// Those of a structure of arrays, as [`Lanes::of`].
    #[inline(always)]
    pub fn of<const N: usize>(simd: S, arrays: &[[f32; N]; 3], group: usize) -> Self {
        let [x, y, z] = arrays.each_ref().map(|array| Lanes::of(simd, array, group));
        Self { x, y, z }
    }

    /// The same vector in each.
    #[inline(always)]
    pub fn splat(simd: S, v: Vec3) -> Self {
        let [x, y, z] = v.to_array().map(|x| Lanes::splat(simd, x));
        Self { x, y, z }
    }

    /// Dot products, in glam's order.
    #[inline(always)]
    pub fn dot(self, other: Self) -> Lanes<S> {
        self.x * other.x + self.y * other.y + self.z * other.z
    }
}

impl<S: Simd> Add for Vec3Lanes<S> {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        Self { x: self.x + other.x, y: self.y + other.y, z: self.z + other.z }
    }
}

impl<S: Simd> Sub for Vec3Lanes<S> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        Self { x: self.x - other.x, y: self.y - other.y, z: self.z - other.z }
    }
}

impl<S: Simd> Mul<Lanes<S>> for Vec3Lanes<S> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, factor: Lanes<S>) -> Self {
        Self { x: self.x * factor, y: self.y * factor, z: self.z * factor }
    }
}
