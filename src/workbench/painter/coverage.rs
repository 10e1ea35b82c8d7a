//! Which pixels a triangle covers, in exact integer arithmetic.
//!
//! A pixel is covered if its centre lies inside, or on a top or left side (the rule of OpenGL, Direct3D and Vulkan
//! rasterizers), so triangles that share a side cover each pixel along it exactly once.

use super::clip::{GUARD, Scissor, guarded};
use super::plane::Point;
use std::ops::Range;

/// Steps per pixel that corners are rounded to.
const STEPS: i64 = 256;

/// A point in steps.
type Fixed = [i64; 2];

/// A triangle with its corners rounded, cut to a range that i64 can count in.
#[derive(Debug)]
pub struct Coverage {
    /// Its corners, clockwise on the screen, at least three.
    polygon: Vec<Fixed>,
    /// The corners that colours belong to: rounded, or as they were if the triangle was cut.
    pub corners: [Point; 3],
}

impl Coverage {
    /// The pixels of a triangle given in pixels; none if a corner is not finite or the area is zero.
    pub fn new(corners: [Point; 3]) -> Option<Self> {
        if !corners.iter().flatten().all(|c| c.is_finite()) {
            return None;
        }
        if corners.iter().flatten().all(|c| c.abs() <= GUARD) {
            let fixed = corners.map(rounded);
            let polygon = clockwise(fixed, area(fixed).signum())?;
            Some(Self { polygon: polygon.to_vec(), corners: fixed.map(|p| p.map(|c| c as f64 / STEPS as f64)) })
        } else {
            Self::cut(corners)
        }
    }

    fn cut(corners: [Point; 3]) -> Option<Self> {
        let [p, q, r] = corners;
        let area = (q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0]);
        if area == 0.0 {
            return None;
        }
        let mut polygon: Vec<Fixed> = guarded(&corners).into_iter().map(rounded).collect();
        if area < 0.0 {
            polygon.reverse();
        }
        (polygon.len() >= 3).then_some(Self { polygon, corners })
    }

    /// Calls `visit` with the row and the columns of each span of covered pixels inside of `scissor`.
    pub fn spans(&self, scissor: &Scissor, mut visit: impl FnMut(u32, Range<u32>)) {
        let Some((first, rest)) = self.polygon.split_first() else { return };
        for pair in rest.windows(2) {
            // Rounding can turn a thin part of a cut triangle over: it has no area then.
            if let &[second, third] = pair
                && area([*first, second, third]) > 0
            {
                triangle_spans([*first, second, third], scissor, &mut visit);
            }
        }
    }
}

/// To the nearest step; `point` must be inside of the guard.
fn rounded(point: Point) -> Fixed {
    point.map(|c| (c * STEPS as f64).round() as i64)
}

/// Twice the area; positive if the corners go clockwise on a screen whose rows go down.
fn area([p, q, r]: [Fixed; 3]) -> i64 {
    (q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0])
}

fn clockwise([p, q, r]: [Fixed; 3], turn: i64) -> Option<[Fixed; 3]> {
    match turn {
        1 => Some([p, q, r]),
        -1 => Some([p, r, q]),
        _ => None,
    }
}

/// One side of a clockwise triangle: pixel (x, y) is inside if `across · x + down · y + at_origin ≥ 0`.
struct Side {
    across: i64,
    down: i64,
    at_origin: i64,
}

impl Side {
    fn new(from: Fixed, to: Fixed) -> Self {
        let [dx, dy] = [to[0] - from[0], to[1] - from[1]];
        // Going clockwise, left sides go up and top sides go right. A centre on any other side is outside.
        let is_top_left = dy < 0 || (dy == 0 && dx > 0);
        let centre = STEPS / 2;
        let at_origin = dx * (centre - from[1]) - dy * (centre - from[0]) - i64::from(!is_top_left);
        Self { across: -dy * STEPS, down: dx * STEPS, at_origin }
    }

    /// Cuts `columns` to the pixels of row `y` that are inside.
    fn cut(&self, y: i64, columns: &mut Range<i64>) {
        let at_start = self.down * y + self.at_origin;
        if self.across > 0 {
            columns.start = columns.start.max(-at_start.div_euclid(self.across));
        } else if self.across < 0 {
            columns.end = columns.end.min(at_start.div_euclid(-self.across) + 1);
        } else if at_start < 0 {
            columns.end = columns.start;
        }
    }
}

fn triangle_spans(corners: [Fixed; 3], scissor: &Scissor, visit: &mut impl FnMut(u32, Range<u32>)) {
    let [p, q, r] = corners;
    let sides = [Side::new(p, q), Side::new(q, r), Side::new(r, p)];
    let top = p[1].min(q[1]).min(r[1]).div_euclid(STEPS);
    let bottom = p[1].max(q[1]).max(r[1]).div_euclid(STEPS) + 1;
    for y in top.max(i64::from(scissor.y.start))..bottom.min(i64::from(scissor.y.end)) {
        let mut columns = i64::from(scissor.x.start)..i64::from(scissor.x.end);
        for side in &sides {
            side.cut(y, &mut columns);
        }
        if columns.start < columns.end {
            // Inside of the scissor, so inside of u32.
            visit(y as u32, columns.start as u32..columns.end as u32);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const SIDE: u32 = 12;

    /// How often each pixel of a small image is covered by the triangles.
    fn counts(triangles: &[[Point; 3]]) -> Vec<u32> {
        let scissor = Scissor { x: 0..SIDE, y: 0..SIDE };
        let mut counts = vec![0; (SIDE * SIDE) as usize];
        for coverage in triangles.iter().filter_map(|&t| Coverage::new(t)) {
            coverage.spans(&scissor, |y, columns| columns.for_each(|x| counts[(y * SIDE + x) as usize] += 1));
        }
        counts
    }

    fn covered(triangle: [Point; 3]) -> Vec<(u32, u32)> {
        let counts = counts(&[triangle]);
        (0..SIDE * SIDE).filter(|&i| counts[i as usize] > 0).map(|i| (i % SIDE, i / SIDE)).collect()
    }

    #[test]
    fn centres_on_top_and_left_sides_belong_to_a_rectangle() {
        // Every side runs through pixel centres: 2.5 is in, 5.5 is out.
        let [a, b, c, d] = [[2.5, 2.5], [5.5, 2.5], [5.5, 5.5], [2.5, 5.5]];
        let counts = counts(&[[a, b, c], [a, c, d]]);
        for (i, &count) in (0..).zip(&counts) {
            let inside = (2..5).contains(&(i % SIDE)) && (2..5).contains(&(i / SIDE));
            assert_eq!(count, u32::from(inside), "pixel {}, {}", i % SIDE, i / SIDE);
        }
    }

    #[test]
    fn the_order_of_corners_does_not_matter() {
        let [a, b, c] = [[1.2, 0.7], [9.9, 4.1], [3.3, 10.8]];
        let once = covered([a, b, c]);
        assert!(once.len() > 30);
        for other in [[b, c, a], [c, a, b], [a, c, b], [c, b, a], [b, a, c]] {
            assert_eq!(covered(other), once);
        }
    }

    #[test]
    fn a_small_triangle_covers_the_one_centre_inside() {
        assert_eq!(covered([[3.4, 4.4], [3.7, 4.4], [3.5, 4.7]]), [(3, 4)]);
        assert_eq!(covered([[3.6, 4.4], [3.9, 4.4], [3.7, 4.7]]), []);
    }

    #[test]
    fn triangles_without_area_or_with_a_corner_that_is_not_finite_cover_nothing() {
        let [a, b] = [[1.0, 1.0], [9.0, 9.0]];
        for third in [a, b, [5.0, 5.0], [f64::NAN, 3.0], [3.0, f64::INFINITY], [f64::NEG_INFINITY, 0.0]] {
            assert!(Coverage::new([a, b, third]).is_none(), "{third:?}");
        }
        assert!(Coverage::new([[1e30, 1e30], [2e30, 2e30], [3e30, 3e30]]).is_none());
    }

    #[test]
    fn halves_of_the_plane_meet_without_seam() {
        let [a, b] = [[-1e9, -1e9 + 0.3], [1e9, 1e9 + 0.3]];
        let counts = counts(&[[a, b, [-4e9, 3e9]], [b, a, [4e9, -3e9]]]);
        assert_eq!(counts, vec![1; (SIDE * SIDE) as usize]);
    }

    fn coordinate() -> impl Strategy<Value = f64> {
        prop_oneof![4 => -3.0..15.0_f64, 1 => (-6..30_i32).prop_map(|half| f64::from(half) * 0.5), 1 => -1e6..1e6_f64]
    }

    fn point() -> impl Strategy<Value = Point> {
        [coordinate(), coordinate()]
    }

    proptest! {
        /// A triangle cut into three by an inner point covers what it covers whole, each pixel once.
        #[test]
        fn parts_cover_the_whole_once(p in point(), q in point(), r in point(), s in 0.0..1.0_f64, t in 0.0..1.0_f64) {
            prop_assume!([p, q, r].iter().flatten().all(|c| c.abs() < 20.0));
            let [s, t] = if s + t > 1.0 { [1.0 - s, 1.0 - t] } else { [s, t] };
            let inner = [0, 1].map(|i| p[i] + (q[i] - p[i]) * s + (r[i] - p[i]) * t);
            // Rounding may push the point out of a thin triangle; its parts then lie on both sides.
            let steps = [p, q, r].map(rounded);
            let m = rounded(inner);
            let turn = area(steps).signum();
            let parts = [[p, q, inner], [q, r, inner], [r, p, inner]];
            prop_assume!(parts.iter().all(|part| area([rounded(part[0]), rounded(part[1]), m]) * turn >= 0));
            prop_assert_eq!(counts(&parts), counts(&[[p, q, r]]));
        }

        /// Spans agree with the three side functions asked at each centre.
        #[test]
        fn spans_hold_the_centres_inside(p in point(), q in point(), r in point()) {
            let whole = counts(&[[p, q, r]]);
            prop_assume!([p, q, r].iter().flatten().all(|c| c.abs() < 2e5));
            let steps = [p, q, r].map(rounded);
            let turn = area(steps);
            let [a, b, c] = if turn < 0 { [steps[0], steps[2], steps[1]] } else { steps };
            for (i, &count) in (0..).zip(&whole) {
                let centre = [i % i64::from(SIDE), i / i64::from(SIDE)].map(|n| n * STEPS + STEPS / 2);
                let inside = [[a, b], [b, c], [c, a]].iter().all(|&[from, to]| {
                    let side = area([from, to, centre]);
                    let top_left = to[1] < from[1] || (to[1] == from[1] && to[0] > from[0]);
                    side > 0 || (side == 0 && top_left)
                });
                prop_assert_eq!(count, u32::from(turn != 0 && inside));
            }
        }

        /// Four quarters around any point tile the image.
        #[test]
        fn a_fan_around_a_point_covers_each_pixel_once(x in 0.0..12.0_f64, y in 0.0..12.0_f64, far in 20.0..1e12_f64) {
            let corners = [[-far, -far], [far, -far], [far, far], [-far, far]];
            let fan: Vec<_> = (0..4).map(|i| [corners[i], corners[(i + 1) % 4], [x, y]]).collect();
            prop_assert_eq!(counts(&fan), vec![1; (SIDE * SIDE) as usize]);
        }
    }
}
