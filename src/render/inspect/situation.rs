//! How a photon's footprint and a view footprint lie to each other (Pedersen 2011, figure 10).

use crate::photons::MapPhoton;
use crate::photons::ellipsoid::meets_unit_ball;
use crate::photons::map::Query;
use serde::Serialize;

/// One of the thesis's three situations, or none of them.
///
/// The photon is its ellipsoid, the unit ball of its filter space; the view footprint is the parallelogram at the hit
/// point. Each pair is in exactly one situation. Without a view footprint there are only `Covered` and `Apart`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Situation {
    /// Figure 10 (a): the view footprint lies wholly inside the photon. The kernel at the hit point stands for it.
    Covered,
    /// Figure 10 (b): the hit point lies outside the photon, a part of the view footprint inside. The kernel at the hit
    /// point misses the photon.
    Missed,
    /// Figure 10 (c): the hit point lies inside the photon, a part of the view footprint outside. The kernel at the hit
    /// point counts the photon for all of the view footprint.
    Partial,
    /// They do not meet: the photon was gathered as one of the k nearest alone.
    Apart,
}

impl Situation {
    /// All, in the order of the figure.
    pub const ALL: [Self; 4] = [Self::Covered, Self::Missed, Self::Partial, Self::Apart];

    /// That of a photon and a view footprint.
    pub fn of(photon: &MapPhoton, query: &Query) -> Self {
        let c = photon.to_filter(query.center - photon.position);
        if c.length_squared() >= 1.0 {
            return if meets_unit_ball(photon, query) { Self::Missed } else { Self::Apart };
        }
        let [a, b] = query.axes.map(|v| photon.to_filter(v));
        // The ball is convex: a parallelogram is inside if its corners are.
        let is_inside = [a + b, a - b, b - a, -a - b].iter().all(|corner| (c + *corner).length_squared() < 1.0);
        if is_inside { Self::Covered } else { Self::Partial }
    }

    /// The figure's letter, or a dash.
    pub fn letter(self) -> &'static str {
        match self {
            Self::Covered => "a",
            Self::Missed => "b",
            Self::Partial => "c",
            Self::Apart => "-",
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::rgb::Rgb;
    use crate::photons::footprint::FilterTransform;
    use glam::Vec3;

    /// A photon at the origin with half-axes of 2 m along x and 1 m along z.
    fn photon() -> MapPhoton {
        let t = FilterTransform::new([Vec3::X * 2.0, Vec3::Z], Vec3::Y, 1.0, 1e-6, 10.0);
        MapPhoton {
            position: Vec3::ZERO,
            inverse_area: t.inverse_area,
            rows: [t.rows[0], t.rows[1]],
            turn: t.turn,
            inverse_reach: 1.0 / t.reach,
            power: Rgb::ONE,
            normal: Vec3::Y,
            direction: Vec3::NEG_Y,
        }
    }

    fn situation(x: f32, z: f32, half: f32) -> Situation {
        let query = Query { center: Vec3::new(x, 0.0, z), normal: Vec3::Y, axes: [Vec3::X * half, Vec3::Z * half] };
        Situation::of(&photon(), &query)
    }

    #[test]
    fn figure_10_has_its_three_situations() {
        assert_eq!(situation(0.3, 0.2, 0.1), Situation::Covered);
        assert_eq!(situation(0.0, 1.2, 0.5), Situation::Missed);
        assert_eq!(situation(0.3, 0.2, 3.0), Situation::Partial);
        assert_eq!(situation(0.0, 1.2, 0.1), Situation::Apart);
        // A corner that just leaves the ellipse.
        assert_eq!(situation(0.0, 0.0, 0.89), Situation::Covered);
        assert_eq!(situation(0.0, 0.0, 0.9), Situation::Partial);
    }

    #[test]
    fn a_point_is_inside_or_apart() {
        assert_eq!(situation(1.9, 0.0, 0.0), Situation::Covered);
        assert_eq!(situation(2.1, 0.0, 0.0), Situation::Apart);
    }
}
