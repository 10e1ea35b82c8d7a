//! Eight of a kind as a structure of arrays, for loops that the compiler makes lanes of.
//!
//! A loop over the lanes of a group has no rest: over a number that only the run knows, compilers keep one for single items.

use glam::{DVec3, Vec3};

/// Items of a group: what the processor has lanes for.
pub const LANES: usize = 8;

/// The same number of each item of a group.
pub type Row = [f32; LANES];

/// `V` vectors of each item of a group, by coordinate.
pub type Group<const V: usize> = [[Row; 3]; V];

/// The vector of one lane.
#[inline(always)]
pub fn vector([x, y, z]: &[Row; 3], lane: usize) -> Vec3 {
    Vec3::new(x[lane], y[lane], z[lane])
}

/// Puts a vector in one lane.
#[inline(always)]
pub fn set([x, y, z]: &mut [Row; 3], lane: usize, v: Vec3) {
    (x[lane], y[lane], z[lane]) = (v.x, v.y, v.z);
}

/// One vector or the other, without a branch.
#[inline(always)]
pub fn choose(first: bool, a: DVec3, b: DVec3) -> DVec3 {
    DVec3::new(if first { a.x } else { b.x }, if first { a.y } else { b.y }, if first { a.z } else { b.z })
}

/// Whether no component is larger than `limit`; false of a vector that is no number.
#[inline(always)]
pub fn is_within(v: DVec3, limit: f64) -> bool {
    (v.x.abs() <= limit) & (v.y.abs() <= limit) & (v.z.abs() <= limit)
}
