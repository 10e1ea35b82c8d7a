//! Unit vectors in four bytes.

use glam::Vec3;

/// A unit vector on the octahedron, unfolded to a square of 65,535 points a side (Cigolle et al. 2014).
///
/// Off by 6.5e-5 radians at most, which is half a step along both sides where the octahedron is nearest to the sphere's
/// centre; the six directions along the axes are exact.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Octahedral([i16; 2]);

/// Largest coordinate.
const SCALE: f32 = i16::MAX as f32;

impl Octahedral {
    /// The nearest to the unit vector `v`, as rounding has it.
    #[inline]
    pub fn new(v: Vec3) -> Self {
        Self::of_steps(Self::steps(v))
    }

    /// The same for what [`Self::steps`] gives.
    #[inline]
    pub fn of_steps([x, y]: [f32; 2]) -> Self {
        // A cast saturates, and takes what is no number to 0.
        Self([x as i16, y as i16])
    }

    /// Steps along the sides to the nearest point, whole numbers. Without a branch, for many at once in lanes.
    #[inline(always)]
    pub fn steps(v: Vec3) -> [f32; 2] {
        let sum = v.x.abs() + v.y.abs() + v.z.abs();
        let (x, y) = (v.x / sum, v.y / sum);
        let (sign_x, sign_y) = (if x < 0.0 { -1.0 } else { 1.0 }, if y < 0.0 { -1.0 } else { 1.0 });
        // The lower half is folded outwards over the edges of the upper one.
        let folded = ((1.0 - y.abs()) * sign_x, (1.0 - x.abs()) * sign_y);
        let is_lower = v.z < 0.0;
        let (x, y) = (if is_lower { folded.0 } else { x }, if is_lower { folded.1 } else { y });
        // A zero has no sign, as an integer has none; what is no number is zero.
        let (x, y) = ((x * SCALE).round_ties_even() + 0.0, (y * SCALE).round_ties_even() + 0.0);
        [if x.is_nan() { 0.0 } else { x }, if y.is_nan() { 0.0 } else { y }]
    }

    /// The unit vector.
    #[inline(always)]
    pub fn direction(self) -> Vec3 {
        Self::direction_of_steps(self.to_steps())
    }

    /// Steps along the sides.
    #[inline(always)]
    pub fn to_steps(self) -> [f32; 2] {
        let [x, y] = self.0;
        [f32::from(x), f32::from(y)]
    }

    /// The unit vector so many steps along the sides.
    #[inline(always)]
    pub fn direction_of_steps([x, y]: [f32; 2]) -> Vec3 {
        let (x, y) = (x / SCALE, y / SCALE);
        let z = 1.0 - x.abs() - y.abs();
        let fold = (-z).max(0.0);
        let (x, y) = (if x < 0.0 { x + fold } else { x - fold }, if y < 0.0 { y + fold } else { y - fold });
        Vec3::new(x, y, z).normalize()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn directions_come_back(x in -1.0f32..1.0, y in -1.0f32..1.0, z in -1.0f32..1.0) {
            let v = Vec3::new(x, y, z);
            prop_assume!(v.length() > 1e-3);
            let v = v.normalize();
            let back = Octahedral::new(v).direction();
            prop_assert!(back.is_normalized());
            prop_assert!(back.as_dvec3().angle_between(v.as_dvec3()) < 6.5e-5, "{v} {back}");
            // What came back once stays.
            let again = Octahedral::new(back).direction();
            prop_assert!((again - back).length() < 1e-6, "{back} {again}");
        }
    }

    #[test]
    fn axes_are_exact_and_nonsense_is_defined() {
        for axis in [Vec3::X, Vec3::Y, Vec3::Z, Vec3::NEG_X, Vec3::NEG_Y, Vec3::NEG_Z] {
            assert_eq!(Octahedral::new(axis).direction(), axis);
        }
        for v in [Vec3::ZERO, Vec3::NAN, Vec3::INFINITY] {
            assert!(Octahedral::new(v).direction().is_normalized());
        }
    }
}
