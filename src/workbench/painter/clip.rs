//! What is cut away before coverage: pixels outside of the scissor rectangle, and corners too far out to count with.

use super::plane::Point;
use egui::Rect;
use std::ops::Range;

/// Corners farther from the origin than this, in pixels, are cut off before they are rounded to a fraction of a pixel.
pub const GUARD: f64 = 262_144.0;

/// The pixels that a primitive may touch; inside the image.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Scissor {
    /// Columns.
    pub x: Range<u32>,
    /// Rows.
    pub y: Range<u32>,
}

impl Scissor {
    /// The pixels of `rect`, which is in points, its sides rounded to the nearest pixel border as `egui_glow` does.
    ///
    /// A side that is NaN counts as 0. An inverted rectangle has no pixels.
    pub fn new(rect: Rect, pixels_per_point: f32, size: [u32; 2]) -> Self {
        // The cast cuts at the ends of u32; a side left of the image comes out as 0.
        let side = |at: f32, limit: u32| ((at * pixels_per_point).round() as u32).min(limit);
        let range = |min: f32, max: f32, limit: u32| {
            let start = side(min, limit);
            start..side(max, limit).max(start)
        };
        Self { x: range(rect.min.x, rect.max.x, size[0]), y: range(rect.min.y, rect.max.y, size[1]) }
    }
}

/// The part of a triangle within [`GUARD`] of the origin, a convex polygon of up to seven corners, possibly none.
///
/// A side that two triangles share is cut at the same points in both, to the last bit.
pub fn guarded(triangle: &[Point; 3]) -> Vec<Point> {
    [(0, 1.0), (0, -1.0), (1, 1.0), (1, -1.0)]
        .into_iter()
        .fold(triangle.to_vec(), |polygon, (axis, sign)| cut(&polygon, axis, sign))
}

/// The part of a convex polygon with `sign · coordinate ≤ GUARD` on one axis.
fn cut(polygon: &[Point], axis: usize, sign: f64) -> Vec<Point> {
    let is_inside = |p: &Point| sign * p[axis] <= GUARD;
    let mut kept = Vec::with_capacity(polygon.len() + 1);
    let next = polygon.iter().cycle().skip(1);
    for (here, there) in polygon.iter().zip(next) {
        if is_inside(here) {
            kept.push(*here);
        }
        if is_inside(here) != is_inside(there) {
            // Always from the inside out, so that the direction of the side does not matter.
            let (inside, outside) = if is_inside(here) { (here, there) } else { (there, here) };
            kept.push(crossing(inside, outside, axis, sign * GUARD));
        }
    }
    kept
}

/// Where the way from `inside` to `outside` reaches `border` on one axis.
fn crossing(inside: &Point, outside: &Point, axis: usize, border: f64) -> Point {
    let part = (border - inside[axis]) / (outside[axis] - inside[axis]);
    let other = 1 - axis;
    let mut point = [border; 2];
    point[other] = inside[other] + (outside[other] - inside[other]) * part;
    point
}

#[cfg(test)]
mod tests {
    use super::*;
    use egui::pos2;

    fn scissor(min: [f32; 2], max: [f32; 2], pixels_per_point: f32) -> Scissor {
        Scissor::new(Rect { min: pos2(min[0], min[1]), max: pos2(max[0], max[1]) }, pixels_per_point, [90, 60])
    }

    #[test]
    fn sides_are_rounded_in_pixels() {
        // 1.5·3 = 4.5 → 5; 1.5·1.6 = 2.4 → 2; 1.5·7 = 10.5 → 11; 1.5·9.5 = 14.25 → 14.
        assert_eq!(scissor([3.0, 1.6], [7.0, 9.5], 1.5), Scissor { x: 5..11, y: 2..14 });
        assert_eq!(scissor([3.0, 1.6], [7.0, 9.5], 2.0), Scissor { x: 6..14, y: 3..19 });
        assert_eq!(scissor([2.5, 1.4], [7.0, 9.5], 1.0), Scissor { x: 3..7, y: 1..10 });
    }

    #[test]
    fn sides_outside_infinite_or_inverted_stay_in_the_image() {
        let whole = Scissor { x: 0..90, y: 0..60 };
        assert_eq!(Scissor::new(Rect::EVERYTHING, 1.5, [90, 60]), whole);
        assert_eq!(scissor([-5.0, -1e30], [1e30, 1e9], 1.0), whole);
        assert_eq!(scissor([50.0, 40.0], [20.0, 10.0], 1.0), Scissor { x: 50..50, y: 40..40 });
        assert_eq!(scissor([100.0, -9.0], [200.0, -3.0], 1.0), Scissor { x: 90..90, y: 0..0 });
        assert_eq!(scissor([f32::NAN, 2.0], [5.0, f32::NAN], 1.0), Scissor { x: 0..5, y: 2..2 });
    }

    #[test]
    fn near_triangles_stay_and_far_ones_vanish() {
        let near = [[0.0, 0.0], [10.0, 0.0], [0.0, 10.0]];
        assert_eq!(guarded(&near), near);
        assert_eq!(guarded(&near.map(|p| [p[0] + 1e9, p[1]])).len(), 0);
    }

    #[test]
    fn a_triangle_over_everything_becomes_the_guard_square() {
        let polygon = guarded(&[[-1e30, -1e30], [1e31, -1e30], [-1e30, 1e31]]);
        assert!(polygon.iter().all(|p| p.map(f64::abs) == [GUARD; 2]), "{polygon:?}");
        for corner in [[-GUARD, -GUARD], [GUARD, -GUARD], [GUARD, GUARD], [-GUARD, GUARD]] {
            assert!(polygon.contains(&corner), "{polygon:?}");
        }
    }

    #[test]
    fn a_shared_side_is_cut_at_the_same_points() {
        let [a, b] = [[-3e7, 11.3], [7.7e8, 402.9]];
        let on_side = |polygon: Vec<Point>| -> Vec<Point> {
            let mut points: Vec<_> = polygon.into_iter().filter(|p| p[0].abs() == GUARD && p[1] < 500.0).collect();
            points.retain(|p| p[1] > 0.0);
            points.sort_by(|p, q| p[0].total_cmp(&q[0]));
            points
        };
        let below = on_side(guarded(&[a, b, [5.0, 9e8]]));
        let above = on_side(guarded(&[b, a, [5.0, -9e8]]));
        assert_eq!(below.len(), 2);
        assert_eq!(below, above);
    }
}
