//! Numbers and vectors in as many lanes as the processor's instructions have. What is written with them rounds in each lane
//! as it does alone: no product is fused with a sum.
//!
//! All of it has to end up in the one function that is compiled for these instructions, so everything is inlined, and no
//! closures and no `map` of arrays go between: they are functions of their own, compiled for any processor.

use glam::Vec3;
use pulp::{Arch, Simd, WithSimd};
#[cfg(target_arch = "x86_64")]
use std::any::Any;
use std::ops::{Add, Div, Mul, Neg, Sub};

/// Runs `kernel` in the widest instructions that the processor has, whose registers hold eight numbers of 32 bits at most:
/// what is written for eight lanes.
#[inline(always)]
pub fn dispatch_in_eights<K: WithSimd>(kernel: K) -> K::Output {
    #[cfg(target_arch = "x86_64")]
    if let Some(v3) = pulp::x86::V3::try_new() {
        return Simd::vectorize(v3, kernel);
    }
    Arch::Scalar.dispatch(kernel)
}

/// What is written for eight lanes of 32 bits, and for more of 64 where the compiler makes lanes of loops.
pub trait EightLanes {
    /// What comes of it.
    type Output;

    /// Does it; `simd` has eight lanes at most.
    fn run<S: Simd>(self, simd: S) -> Self::Output;
}

/// Runs `kernel` in the widest instructions that the processor has.
#[inline(always)]
pub fn dispatch_eight_lanes<K: EightLanes>(kernel: K) -> K::Output {
    #[cfg(target_arch = "x86_64")]
    if let Some(v4) = pulp::x86::V4::try_new() {
        return Simd::vectorize(v4, Within { kernel, simd: *v4 });
    }
    #[cfg(target_arch = "x86_64")]
    if let Some(v3) = pulp::x86::V3::try_new() {
        return Simd::vectorize(v3, Within { kernel, simd: v3 });
    }
    Arch::Scalar.dispatch(Within { kernel, simd: pulp::Scalar })
}

/// A kernel for eight lanes in instructions that may have more.
struct Within<K, S> {
    kernel: K,
    simd: S,
}

impl<K: EightLanes, L: Simd> WithSimd for Within<K, L> {
    type Output = K::Output;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> K::Output {
        self.kernel.run(self.simd)
    }
}

/// A mask as bits, the first lane the lowest.
#[inline(always)]
pub fn bits<S: Simd>(simd: S, mask: S::m32s) -> u32 {
    let words = simd.select_u32s(mask, simd.splat_u32s(u32::MAX), simd.splat_u32s(0));
    #[cfg(target_arch = "x86_64")]
    if let (Some(v3), Ok(words)) =
        ((&simd as &dyn Any).downcast_ref::<pulp::x86::V3>(), pulp::bytemuck::try_cast(words))
    {
        // One instruction; which way to go is known when this is compiled.
        return v3.avx._mm256_movemask_ps(words) as u32;
    }
    let words = pulp::bytemuck::cast_slice::<S::u32s, u32>(std::slice::from_ref(&words));
    words.iter().rev().fold(0, |bits, word| bits << 1 | word & 1)
}

/// Where the numbers of a row are not zero, as bits.
#[inline(always)]
pub fn bits_of_row<S: Simd>(simd: S, row: &[f32; 8]) -> u32 {
    let mut all = 0;
    for group in 0..8 / S::F32_LANES {
        let is_set = Lanes::splat(simd, 0.0).less(Lanes::of(simd, row, group).abs());
        all |= bits(simd, is_set) << (group * S::F32_LANES);
    }
    all
}

/// Eight bytes as numbers.
#[inline(always)]
#[cfg_attr(not(target_arch = "x86_64"), expect(unused_variables, reason = "compilers for others do without help"))]
pub fn of_bytes<S: Simd>(simd: S, bytes: &[u8; 8]) -> [f32; 8] {
    #[cfg(target_arch = "x86_64")]
    if let Some(v3) = (&simd as &dyn Any).downcast_ref::<pulp::x86::V3>() {
        // The compiler would take each byte by itself.
        let words = v3.avx2._mm256_cvtepu8_epi32(pulp::cast([*bytes, [0; 8]]));
        return pulp::cast(v3.avx._mm256_cvtepi32_ps(words));
    }
    let mut numbers = [0.0; 8];
    for (number, byte) in numbers.iter_mut().zip(bytes) {
        *number = f32::from(*byte);
    }
    numbers
}

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

    /// Magnitudes.
    #[inline(always)]
    pub fn abs(self) -> Self {
        let sign = self.simd.splat_f32s(-0.0);
        Self { value: self.simd.and_f32s(self.simd.not_f32s(sign), self.value), ..self }
    }

    /// Kept between -1 and 1; -1 where it is no number.
    #[inline(always)]
    pub fn within_one(self) -> Self {
        let not_less = self.simd.max_f32s(self.value, self.simd.splat_f32s(-1.0));
        Self { value: self.simd.min_f32s(not_less, self.simd.splat_f32s(1.0)), ..self }
    }

    /// The larger of two numbers; the other one if either is none.
    #[inline(always)]
    pub fn larger(self, other: Self) -> Self {
        Self { value: self.simd.max_f32s(self.value, other.value), ..self }
    }

    /// The smaller of two numbers; the other one if either is none.
    #[inline(always)]
    pub fn smaller(self, other: Self) -> Self {
        Self { value: self.simd.min_f32s(self.value, other.value), ..self }
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
        Self { value: self.simd.xor_f32s(self.simd.splat_f32s(-0.0), self.value), ..self }
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
        let [x, y, z] = arrays;
        Self { x: Lanes::of(simd, x, group), y: Lanes::of(simd, y, group), z: Lanes::of(simd, z, group) }
    }

    /// The same vector in each.
    #[inline(always)]
    pub fn splat(simd: S, v: Vec3) -> Self {
        Self { x: Lanes::splat(simd, v.x), y: Lanes::splat(simd, v.y), z: Lanes::splat(simd, v.z) }
    }

    /// Where the box from these corners to `high` meets the box from `low` to `top`.
    #[inline(always)]
    pub fn boxes_meet(simd: S, (l, h): (Self, Self), (low, high): (Self, Self)) -> S::m32s {
        let x = simd.and_m32s(l.x.at_most(high.x), low.x.at_most(h.x));
        let y = simd.and_m32s(l.y.at_most(high.y), low.y.at_most(h.y));
        let z = simd.and_m32s(l.z.at_most(high.z), low.z.at_most(h.z));
        simd.and_m32s(simd.and_m32s(x, y), z)
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

#[cfg(test)]
mod tests {
    use super::*;

    /// Eight numbers: which are less than 1, and which are less than -0.5 when they are kept within one.
    struct Masks([f32; 8]);

    impl WithSimd for Masks {
        type Output = [u32; 2];

        fn with_simd<S: Simd>(self, simd: S) -> [u32; 2] {
            let mut all = [0; 2];
            for group in 0..8 / S::F32_LANES {
                let x = Lanes::of(simd, &self.0, group);
                let own = [
                    bits(simd, x.less(Lanes::splat(simd, 1.0))),
                    bits(simd, x.within_one().less(Lanes::splat(simd, -0.5))),
                ];
                for (all, own) in all.iter_mut().zip(own) {
                    *all |= own << (group * S::F32_LANES);
                }
            }
            all
        }
    }

    struct Rows([f32; 8], [u8; 8]);

    impl WithSimd for Rows {
        type Output = (u32, [f32; 8]);

        fn with_simd<S: Simd>(self, simd: S) -> Self::Output {
            (bits_of_row(simd, &self.0), of_bytes(simd, &self.1))
        }
    }

    #[test]
    fn rows_and_bytes_are_the_same_in_all_instructions() {
        let (row, bytes) = ([0.0, 1.0, -0.0, 1.0, 0.0, 0.0, 1e-30, 1.0], [0, 1, 7, 127, 128, 200, 254, 255]);
        let expected = (0b1100_1010, [0.0, 1.0, 7.0, 127.0, 128.0, 200.0, 254.0, 255.0]);
        assert_eq!(dispatch_in_eights(Rows(row, bytes)), expected);
        assert_eq!(Arch::Scalar.dispatch(Rows(row, bytes)), expected);
    }

    /// The same bits in the widest instructions and in none, also of what is no number.
    #[test]
    fn masks_are_the_same_in_all_instructions() {
        let x = [0.5, -2.0, f32::NAN, 3.0, -0.0, 1.0, f32::INFINITY, f32::NEG_INFINITY];
        for masks in [dispatch_in_eights(Masks(x)), Arch::Scalar.dispatch(Masks(x))] {
            assert_eq!(masks, [0b1001_0011, 0b1000_0110]);
        }
    }
}
