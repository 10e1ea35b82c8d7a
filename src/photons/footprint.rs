//! A photon's footprint made ready: its filter transform, area and reach.

use crate::math::eights::{Group, LANES, Row, choose, is_within, set, vector};
use glam::{DVec2, DVec3, Vec2, Vec3};
use pulp::{Arch, Simd, WithSimd};

/// The transform from world to filter space, where the photon is the unit disc (Pedersen 2011, eq. 45 corrected), along
/// the principal axes of its ellipse.
///
/// The thesis inverts the matrix of `dα`, `dβ` and the normal. Where those two are nearly parallel, as near a caustic's
/// focus, its rows are long and nearly opposite, and what f32 leaves of them says little about a point. Along the
/// principal axes a transformed point is the exact image of one that lies within a few units in the last place of its
/// distance, whatever the condition; the footprint's own coordinates are a turn away.
#[derive(Clone, Copy, Debug)]
pub struct FilterTransform {
    /// Rows, 1/metre: filter coordinates are their dot products with `x - x_pd`. Along the longest and the shortest
    /// semi-axis of the ellipse, and off its plane.
    pub rows: [Vec3; 3],
    /// Cosine and sine of the turn about the normal from filter coordinates to those in `dα` and `dβ`.
    pub turn: Vec2,
    /// 1/A with `A = π ‖dα × dβ‖`, 1/m² (eq. 40 corrected).
    pub inverse_area: f32,
    /// Largest singular value of the footprint, metres: the radius of the ball that holds its ellipsoid.
    pub reach: f32,
    /// Half-size of the box around its ellipsoid, metres.
    pub half_extent: Vec3,
    /// Whether an axis was raised to the floor, or the area to the smallest that f32 has an inverse of.
    pub floored: bool,
    /// Whether an axis was lowered to the ceiling.
    pub capped: bool,
}

impl FilterTransform {
    /// Prepares a footprint `(dα, dβ)` on a surface of unit `normal`, its axes times `scale`.
    ///
    /// Off-plane distance is measured in the longest semi-axis, the footprint's own size. Semi-axes below `floor`
    /// (metres, the resolution of f32 at this place) are raised to it, and those above `ceiling` lowered: a footprint
    /// that shrank to a line or a point keeps all its power on the smallest ellipse that can be told from it. A column
    /// that is not finite counts as none.
    pub fn new(footprint: [Vec3; 2], normal: Vec3, scale: f32, floor: f32, ceiling: f32) -> Self {
        let (n, [a, b]) = (unit(normal), columns(footprint, normal, scale));
        let principal = Principal::of(a, b, n);
        let principal = if principal.has_axis { principal } else { principal.or_any_axis(a, b, n) };
        Self::along(&principal, n, floor, ceiling)
    }

    /// The same of a group's footprints and normals, in lanes.
    pub fn of_group(footprints: &Group<3>, scale: f32, floor: f32, ceiling: f32) -> FilterTransforms {
        let mut all = Arch::new().dispatch(Transforming { footprints, scale, floor, ceiling });
        if all.usual != [1.0; LANES] {
            for lane in 0..LANES {
                if all.usual[lane] == 0.0 {
                    let footprint = [vector(&footprints[0], lane), vector(&footprints[1], lane)];
                    let normal = vector(&footprints[2], lane);
                    all.alone[lane] = Some(Self::new(footprint, normal, scale, floor, ceiling));
                }
            }
        }
        all
    }

    #[inline(always)]
    fn along(principal: &Principal, n: DVec3, floor: f32, ceiling: f32) -> Self {
        let (floor, ceiling) = (f64::from(floor), f64::from(ceiling));
        let (long, short) = (principal.long.max(floor).min(ceiling), principal.short.max(floor).min(ceiling));
        let (axis, across) = (principal.axis, principal.across);
        let ends = [axis * long, across * short, n * long];
        let squares = ends[0] * ends[0] + ends[1] * ends[1] + ends[2] * ends[2];
        let half_extent = DVec3::new(squares.x.sqrt(), squares.y.sqrt(), squares.z.sqrt()).as_vec3();
        let inverse_area = 1.0 / (std::f64::consts::PI * long * short);
        let largest = f64::from(f32::MAX);
        Self {
            rows: [(axis * (1.0 / long)).as_vec3(), (across * (1.0 / short)).as_vec3(), (n * (1.0 / long)).as_vec3()],
            turn: principal.turn.as_vec2(),
            inverse_area: inverse_area.min(largest) as f32,
            reach: long as f32,
            half_extent,
            floored: (principal.short < floor) | (inverse_area > largest),
            capped: principal.long > ceiling,
        }
    }
}

/// The unit vector along a normal that f32 has rounded.
#[inline(always)]
fn unit(normal: Vec3) -> DVec3 {
    let n = normal.as_dvec3();
    n * (1.0 / n.length())
}

/// A footprint's columns times `scale` in the plane of a normal; nothing for one that is not finite.
#[inline(always)]
fn columns([a, b]: [Vec3; 2], normal: Vec3, scale: f32) -> [DVec3; 2] {
    let (n, scale) = (unit(normal), f64::from(scale));
    let (a, b) = (a.as_dvec3() * scale, b.as_dvec3() * scale);
    [
        choose(is_within(a, f64::MAX), a - n * n.dot(a), DVec3::ZERO),
        choose(is_within(b, f64::MAX), b - n * n.dot(b), DVec3::ZERO),
    ]
}

/// The transforms of a group's footprints.
pub struct FilterTransforms {
    /// Rows, half-extent; the turn and the reach.
    vectors: Group<5>,
    inverse_area: Row,
    floored: Row,
    capped: Row,
    /// Whether it has an axis; those that have none are made alone.
    usual: Row,
    alone: [Option<FilterTransform>; LANES],
}

impl FilterTransforms {
    /// That of one lane.
    #[inline(always)]
    pub fn at(&self, lane: usize) -> FilterTransform {
        if let Some(alone) = self.alone[lane] {
            return alone;
        }
        let last = vector(&self.vectors[4], lane);
        FilterTransform {
            rows: [vector(&self.vectors[0], lane), vector(&self.vectors[1], lane), vector(&self.vectors[2], lane)],
            half_extent: vector(&self.vectors[3], lane),
            turn: last.truncate(),
            reach: last.z,
            inverse_area: self.inverse_area[lane],
            floored: self.floored[lane] > 0.0,
            capped: self.capped[lane] > 0.0,
        }
    }
}

struct Transforming<'a> {
    footprints: &'a Group<3>,
    scale: f32,
    floor: f32,
    ceiling: f32,
}

impl WithSimd for Transforming<'_> {
    type Output = FilterTransforms;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> FilterTransforms {
        let Self { footprints, scale, floor, ceiling } = self;
        let row = [0.0; LANES];
        let (vectors, alone) = ([[row; 3]; 5], [None; LANES]);
        let mut all = FilterTransforms { vectors, inverse_area: row, floored: row, capped: row, usual: row, alone };
        for lane in 0..LANES {
            let (a, b) = (vector(&footprints[0], lane), vector(&footprints[1], lane));
            let normal = vector(&footprints[2], lane);
            let (n, [a, b]) = (unit(normal), columns([a, b], normal, scale));
            let principal = Principal::of(a, b, n);
            let t = FilterTransform::along(&principal, n, floor, ceiling);
            let [first, second, off] = t.rows;
            set(&mut all.vectors[0], lane, first);
            set(&mut all.vectors[1], lane, second);
            set(&mut all.vectors[2], lane, off);
            set(&mut all.vectors[3], lane, t.half_extent);
            set(&mut all.vectors[4], lane, t.turn.extend(t.reach));
            all.inverse_area[lane] = t.inverse_area;
            all.floored[lane] = if t.floored { 1.0 } else { 0.0 };
            all.capped[lane] = if t.capped { 1.0 } else { 0.0 };
            all.usual[lane] = if principal.has_axis { 1.0 } else { 0.0 };
        }
        all
    }
}

/// Singular value decomposition of two vectors in a plane.
struct Principal {
    long: f64,
    short: f64,
    /// Unit vector along the longest semi-axis.
    axis: DVec3,
    /// Unit vector along the shortest, on the side where the turn below needs no mirror.
    across: DVec3,
    /// Cosine and sine of the turn from coordinates along both, over their lengths, to those in the two vectors.
    turn: DVec2,
    /// Whether `axis`, `across` and `turn` are numbers: a circle has no longest axis, and a point has none at all.
    has_axis: bool,
}

impl Principal {
    #[inline(always)]
    fn of(a: DVec3, b: DVec3, n: DVec3) -> Self {
        let (aa, bb, ab) = (a.length_squared(), b.length_squared(), a.dot(b));
        let half_difference = (aa - bb) / 2.0;
        let root = (half_difference * half_difference + ab * ab).sqrt();
        let long = ((aa + bb) / 2.0 + root).sqrt();
        // The product of the singular values is the determinant, which does not cancel.
        let det = a.cross(b).dot(n);
        let ratio = det.abs() / long;
        let short = if long > 0.0 { ratio } else { 0.0 };
        // (cos θ, sin θ) of the right singular vector, from the half angle that does not cancel.
        let is_first = half_difference >= 0.0;
        let (c, s) = (half_difference + root, root - half_difference);
        let right = DVec2::new(if is_first { c } else { ab }, if is_first { ab } else { s });
        let per_length = 1.0 / right.length();
        let turn = right * per_length;
        let along = a * turn.x + b * turn.y;
        let per_axis = 1.0 / along.length();
        let axis = along * per_axis;
        let across = n.cross(axis) * 1f64.copysign(det);
        let has_axis =
            (per_length > 0.0) & (per_length < f64::INFINITY) & (per_axis > 0.0) & (per_axis < f64::INFINITY);
        Self { long, short, axis, across, turn, has_axis }
    }

    /// The same with another axis, for any will do: the first of the two vectors if that has a direction.
    #[cold]
    fn or_any_axis(self, a: DVec3, b: DVec3, n: DVec3) -> Self {
        let axis = a.try_normalize().unwrap_or_else(|| n.any_orthonormal_vector());
        let across = n.cross(axis) * 1f64.copysign(a.cross(b).dot(n));
        Self { axis, across, turn: DVec2::X, ..self }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::frame::{tangents, uniform_sphere};
    use crate::math::sequence::{Sampling, Sequence};
    use proptest::prelude::*;

    fn filter(t: &FilterTransform, v: Vec3) -> Vec3 {
        Vec3::new(t.rows[0].dot(v), t.rows[1].dot(v), t.rows[2].dot(v))
    }

    /// Coordinates in `dα` and `dβ`.
    fn own(t: &FilterTransform, v: Vec3) -> Vec3 {
        t.turn.rotate(filter(t, v).truncate()).extend(filter(t, v).z)
    }

    #[test]
    fn axes_map_to_unit_vectors() {
        let (a, b) = (Vec3::new(0.2, 0.0, 0.1), Vec3::new(-0.05, 0.0, 0.3));
        let t = FilterTransform::new([a, b], Vec3::Y, 2.0, 1e-6, 10.0);
        assert!((own(&t, a * 2.0) - Vec3::X).length() < 1e-5);
        assert!((own(&t, b * 2.0) - Vec3::Y).length() < 1e-5);
        let mirrored = FilterTransform::new([b, a], Vec3::Y, 2.0, 1e-6, 10.0);
        assert!((own(&mirrored, b * 2.0) - Vec3::X).length() < 1e-5);
        assert!((own(&mirrored, a * 2.0) - Vec3::Y).length() < 1e-5);
        assert!((filter(&t, Vec3::Y * t.reach).length() - 1.0).abs() < 1e-5);
        let area = std::f32::consts::PI * 4.0 * a.cross(b).length();
        assert!((t.inverse_area * area - 1.0).abs() < 1e-5);
        assert!(!t.floored && !t.capped);
    }

    /// In lanes each is what it is alone: ellipses of all shapes, circles, lines, points and what is not finite.
    #[test]
    fn a_group_is_each_alone() {
        let sequence = Sequence::new(Sampling::Random, 11);
        for group in 0..3000u64 {
            let mut vectors = [[[0.0; LANES]; 3]; 3];
            let mut given = Vec::new();
            for lane in 0..LANES {
                let (x, y) = (sequence.four(group, lane as u32), sequence.four(group, 8 + lane as u32));
                let normal = uniform_sphere(x[0], x[1]).normalize();
                let (t, b) = tangents(normal);
                let long = 10f32.powf(8.0 * y[0] - 6.0);
                let short = long * 10f32.powf(-12.0 * y[1]);
                let (a, b) = match (group + lane as u64) % 16 {
                    0 => (Vec3::ZERO, Vec3::ZERO),
                    1 => (t * long, Vec3::ZERO),
                    2 => (t * long, t * short),
                    3 => (t * long, b * long),
                    4 => (Vec3::NAN, b * long),
                    5 => (Vec3::X * f32::INFINITY, Vec3::NAN),
                    _ => (t * long, b * short + t * (x[3] * long)),
                };
                for (of, v) in vectors.iter_mut().zip([a, b, normal]) {
                    set(of, lane, v);
                }
                given.push(([a, b], normal));
            }
            let together = FilterTransform::of_group(&vectors, 1.7, 1e-6, 10.0);
            for (lane, (footprint, normal)) in given.into_iter().enumerate() {
                let alone = FilterTransform::new(footprint, normal, 1.7, 1e-6, 10.0);
                assert_eq!(format!("{:?}", together.at(lane)), format!("{alone:?}"));
            }
        }
    }

    proptest! {
        /// Aspect ratios to 1e8 and vanishing axes: finite, with the reach and the area of the limited ellipse.
        #[test]
        fn degenerate_footprints_have_a_limit(
            long in -12.0f32..6.0, short in -14.0f32..1.0, turn in 0.0f32..6.3, skew in -3.0f32..3.0,
        ) {
            let long = 10f32.powf(long);
            let short = long * 10f32.powf(short.min(0.0));
            let (s, c) = turn.sin_cos();
            let a = Vec3::new(c, 0.0, s) * long;
            let b = Vec3::new(-s, 0.0, c) * short + a * skew;
            let t = FilterTransform::new([a, b], Vec3::Y, 1.0, 1e-7, 10.0);
            prop_assert!(t.rows.iter().all(|r| r.is_finite()) && t.inverse_area.is_finite());
            prop_assert!(t.reach >= 1e-7 && t.reach <= 10.001);
            prop_assert!(t.half_extent.max_element() <= t.reach * 1.001);
            // No point on the ellipse's longest axis lies outside the unit disc.
            let axis = a * (1.0 + skew * skew).sqrt().recip();
            let seen = filter(&t, axis.normalize() * t.reach);
            prop_assert!(seen.is_finite());
        }
    }

    /// What the thesis inverts, in f32, moves a point by its own distance where the axes are nearly parallel.
    #[test]
    fn an_inverse_matrix_loses_what_principal_axes_keep() {
        let (along, across) = (DVec3::new(0.764, 0.0, 0.645).normalize(), DVec3::new(-0.645, 0.0, 0.764).normalize());
        let axes = [along, along * 0.7 + across * 1e-6].map(|c| c.as_vec3());
        let [a, b] = axes.map(|c| c.as_dvec3());
        let x = (along * 0.37 + across * 4e-7).as_vec3();
        let t = FilterTransform::new(axes, Vec3::Y, 1.0, 1e-12, 10.0);
        let det = a.cross(b).dot(DVec3::Y);
        let inverse = [b.cross(DVec3::Y) / det, DVec3::Y.cross(a) / det].map(|r| r.as_vec3());
        let moved = |back: DVec3| (back - x.as_dvec3()).length();
        let by_inverse = a * f64::from(inverse[0].dot(x)) + b * f64::from(inverse[1].dot(x));
        let [long, short, _] = t.rows.map(|r| r.as_dvec3() / r.as_dvec3().length_squared());
        let by_axes = long * f64::from(t.rows[0].dot(x)) + short * f64::from(t.rows[1].dot(x));
        assert!(moved(by_axes) < 1e-7, "{}", moved(by_axes));
        assert!(moved(by_inverse) > 1e-4, "{}", moved(by_inverse));
    }

    #[test]
    fn singular_values_match_a_closed_form() {
        // [[1, 1], [0, 1]] has singular values (√5 ± 1)/2.
        let p = Principal::of(DVec3::X, DVec3::new(1.0, 0.0, 1.0), DVec3::Y);
        assert!((p.long - (5f64.sqrt() + 1.0) / 2.0).abs() < 1e-12);
        assert!((p.short - (5f64.sqrt() - 1.0) / 2.0).abs() < 1e-12);
        let projected = DVec3::X.dot(p.axis).powi(2) + DVec3::new(1.0, 0.0, 1.0).dot(p.axis).powi(2);
        assert!((projected.sqrt() - p.long).abs() < 1e-12);
    }

    #[test]
    fn zero_footprint_keeps_its_power_on_the_floor() {
        let t = FilterTransform::new([Vec3::ZERO; 2], Vec3::Z, 1.0, 1e-4, 1.0);
        assert!(t.floored && (t.reach - 1e-4).abs() < 1e-9);
        assert!((t.inverse_area * std::f32::consts::PI * 1e-8 - 1.0).abs() < 1e-4);
    }
}
