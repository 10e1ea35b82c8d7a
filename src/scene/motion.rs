//! Shapes and lights that move along a closed path, in real-time rendering.

use glam::{DVec3, Vec3};
use std::ops::Range;

/// Parts of a scene that move together, without turning.
#[derive(Clone, Debug, PartialEq)]
pub struct Motion {
    /// Triangles that move.
    pub triangles: Range<u32>,
    /// Spheres that move, as indices of [`crate::scene::Geometry::spheres`].
    pub spheres: Range<u32>,
    /// Indices of the lights that move.
    pub lights: Vec<u32>,
    /// Offsets from where the scene file has them, metres; corners of a closed path.
    pub path: Vec<DVec3>,
    /// Seconds for once around, positive.
    pub period: f64,
}

impl Motion {
    /// Offset at a time, metres: the path is run through at constant speed, and at 0 s is at its first corner.
    ///
    /// Zero for a path of no corners and for a time that is not finite.
    pub fn offset(&self, seconds: f64) -> Vec3 {
        let Some(&first) = self.path.first() else { return Vec3::ZERO };
        let ends = || self.path.iter().zip(self.path.iter().cycle().skip(1)).map(|(&a, &b)| (a, b));
        let length: f64 = ends().map(|(a, b)| a.distance(b)).sum();
        let turns = seconds / self.period;
        if !turns.is_finite() || length <= 0.0 {
            return first.as_vec3();
        }
        let mut left = (turns - turns.floor()) * length;
        for (a, b) in ends() {
            let edge = a.distance(b);
            if left < edge {
                return a.lerp(b, left / edge).as_vec3();
            }
            left -= edge;
        }
        first.as_vec3()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn along(path: &[DVec3]) -> Motion {
        Motion { triangles: 0..0, spheres: 0..0, lights: Vec::new(), path: path.to_vec(), period: 8.0 }
    }

    #[test]
    fn paths_are_closed_and_run_through_at_constant_speed() {
        // A right-angled triangle of sides 3, 4 and 5.
        let m = along(&[DVec3::ZERO, DVec3::X * 3.0, DVec3::new(3.0, 4.0, 0.0)]);
        assert_eq!(m.offset(0.0), Vec3::ZERO);
        assert!((m.offset(1.0) - Vec3::X * 1.5).length() < 1e-6);
        assert!((m.offset(2.0) - Vec3::X * 3.0).length() < 1e-6);
        assert!((m.offset(14.0) - m.offset(6.0)).length() < 1e-6);
        assert!((m.offset(-1.0) - m.offset(7.0)).length() < 1e-6);
        for i in 0..800 {
            let (a, b) = (m.offset(0.01 * f64::from(i)), m.offset(0.01 * f64::from(i + 1)));
            assert!(a.distance(b) < 0.015 * 1.001);
        }
    }

    #[test]
    fn a_path_without_length_stands_still() {
        assert_eq!(along(&[]).offset(3.0), Vec3::ZERO);
        assert_eq!(along(&[DVec3::Y]).offset(3.0), Vec3::Y);
        assert_eq!(along(&[DVec3::Y, DVec3::Y]).offset(f64::NAN), Vec3::Y);
    }
}
