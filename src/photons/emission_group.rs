//! Photons that leave a light eight at a time, in lanes: each as [`emit`] sends it off alone, to the bit.

use crate::math::eights::{Group, LANES, Row, set, vector};
use crate::math::elementary::sin_cos;
use crate::math::frame::on_sphere;
use crate::photons::emission::{Emission, cone_differential, emit};
use crate::photons::projection::Cells;
use crate::scene::{Light, Scene};
use crate::trace::Differential;
use glam::Vec3;
use pulp::{Arch, Simd, WithSimd};
use std::f32::consts::{PI, TAU};

/// Starts a group of photons, as [`emit`] starts each: the number of lane `i` in dimension `d` is `x[d][i]`.
pub fn emit_group(scene: &Scene, light: &Light, count: f64, x: &[Row; 4]) -> [Emission; LANES] {
    let &Light::Point { position, .. } = light else {
        return std::array::from_fn(|i| emit(scene, light, count, [x[0][i], x[1][i], x[2][i], x[3][i]]));
    };
    let (mut sines, mut cosines) = ([0.0; LANES], [0.0; LANES]);
    for lane in 0..LANES {
        (sines[lane], cosines[lane]) = sin_cos(TAU * x[1][lane]);
    }
    let solid_angle = 4.0 * PI / count as f32;
    let starts = Arch::new().dispatch(FromPoint { u: &x[0], sines: &sines, cosines: &cosines, solid_angle });
    std::array::from_fn(|lane| Emission {
        origin: position,
        direction: vector(&starts[0], lane),
        differential: Differential { dp: [Vec3::ZERO; 2], dv: [vector(&starts[1], lane), vector(&starts[2], lane)] },
        bounded: false,
    })
}

/// Directions, and the two columns of dV.
struct FromPoint<'a> {
    u: &'a Row,
    sines: &'a Row,
    cosines: &'a Row,
    solid_angle: f32,
}

impl WithSimd for FromPoint<'_> {
    type Output = Group<3>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> Group<3> {
        let Self { u, sines, cosines, solid_angle } = self;
        let mut starts = [[[0.0; LANES]; 3]; 3];
        for lane in 0..LANES {
            let direction = on_sphere(u[lane], sines[lane], cosines[lane]).normalize();
            let [a, b] = cone_differential(direction, solid_angle).dv;
            set(&mut starts[0], lane, direction);
            set(&mut starts[1], lane, a);
            set(&mut starts[2], lane, b);
        }
        starts
    }
}

/// Twelve bits by which photons of a light that start and go about alike are near each other: from the numbers that they are
/// made of, before `cells` take them to marked cells.
pub fn start_cell(light: &Light, cells: Option<&Cells>, x: &[f32; 4]) -> u32 {
    let of = |i: usize, parts: f32| (x[i] * parts) as u32;
    match light {
        // The first number chooses the cell, and cells are in order.
        _ if cells.is_some() => of(0, 4096.0),
        Light::Quad { .. } | Light::Mesh { .. } => of(2, 8.0) << 9 | of(3, 8.0) << 6 | of(0, 8.0) << 3 | of(1, 8.0),
        _ => of(0, 64.0) << 6 | of(1, 64.0),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::rgb::Rgb;
    use crate::math::sequence::{Sampling, Sequence};
    use crate::scene::built_in;
    use crate::scene::source::open_built_in;

    #[test]
    fn a_group_starts_as_each_alone() {
        let scene = open_built_in(built_in::find("plane").expect("built in")).expect("opens");
        let quad = Light::Quad { center: Vec3::Y, u: Vec3::X, v: Vec3::Z, power: Rgb::ONE };
        let sequence = Sequence::new(Sampling::Random, 5);
        for light in [Light::Point { position: Vec3::new(0.1, 2.0, -0.3), power: Rgb::ONE }, quad] {
            for group in 0..2000 {
                let mut x: [[f32; 4]; LANES] = std::array::from_fn(|lane| sequence.four(group, lane as u32));
                // The poles, and both sides of the seam of the frames.
                x[0][0] = [0.0, 0.5, 1.0 - f32::EPSILON / 2.0, x[0][0]][group as usize % 4];
                x[1][0] = [0.500_004_95, 0.500_005_1][group as usize % 2];
                let rows = std::array::from_fn(|d| std::array::from_fn(|lane| x[lane][d]));
                for (together, x) in emit_group(&scene, &light, 1234.5, &rows).iter().zip(x) {
                    let alone = emit(&scene, &light, 1234.5, x);
                    assert_eq!(format!("{together:?}"), format!("{alone:?}"));
                }
            }
        }
    }
}
