//! Areas of a set of points in a plane, by which an irradiance estimate is divided (section 3.5.2, figure 3.10).

use crate::realtime::settings::Area;
use glam::{DVec2, DVec3};
use std::f64::consts::PI;

/// Points below which no shape tells an area: the disc of the search takes their place.
pub const LEAST_POINTS: usize = 8;

/// Area of `points` about the place of the estimate, which has the unit normal `normal` and the frame (`x`, `y`) in its
/// plane; None where they are too few, or lie on a line.
///
/// `offsets` are those of the photons in the scene's axes; `in_plane` is filled with them in the frame.
pub fn area(
    kind: Area,
    offsets: &[DVec3],
    [x, y]: [DVec3; 2],
    normal: DVec3,
    in_plane: &mut Vec<DVec2>,
) -> Option<f64> {
    if offsets.len() < LEAST_POINTS || kind == Area::Disc {
        return None;
    }
    if kind == Area::AlignedBox {
        return Some(aligned_box(offsets, normal)).filter(|a| *a > 0.0);
    }
    in_plane.clear();
    in_plane.extend(offsets.iter().map(|o| DVec2::new(o.dot(x), o.dot(y))));
    let area = match kind {
        Area::Hull => corrected_hull(in_plane),
        Area::HullAsPublished => hull(in_plane).0,
        Area::Circle => smallest_circle(in_plane),
        Area::OrientedBox => oriented_box(in_plane),
        _ => ellipse(in_plane),
    };
    (area > 0.0).then_some(area)
}

/// Area of the convex hull, and its corners. Orders the points.
pub fn hull(points: &mut [DVec2]) -> (f64, Vec<DVec2>) {
    points.sort_unstable_by(|a, b| a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)));
    let (mut twice, mut corners) = (0.0, Vec::with_capacity(32));
    // The lower chain from left to right, then the upper one back (Andrew 1979).
    let mut chain: Vec<DVec2> = Vec::with_capacity(32);
    for upper in [false, true] {
        chain.clear();
        let mut add = |p: DVec2| {
            while let [.., a, b] = chain[..]
                && (b - a).perp_dot(p - a) <= 0.0
            {
                chain.pop();
            }
            chain.push(p);
        };
        if upper {
            points.iter().rev().for_each(|p| add(*p))
        } else {
            points.iter().for_each(|p| add(*p))
        }
        twice += chain.windows(2).map(|w| w[0].perp_dot(w[1])).sum::<f64>();
        // The end of each chain is the start of the other.
        corners.extend(chain.split_last().map_or(&[][..], |(_, rest)| rest));
    }
    (twice / 2.0, corners)
}

/// Area of the hull of the points and of the origin, where the estimate is made, enlarged so that the number of points over
/// it is that of the region from which they come.
///
/// A hull of n even points lacks a part of their region. Given the hull, the points inside of it that are not its corners
/// are still spread evenly over it, in a number that knows nothing of the corners (Baldin and Reiß 2016): their number over
/// its area is free of bias for Poisson points in any convex region that holds the origin. So is n over `A n/(n - corners)`.
/// Without the origin a place in the dark beside a lit strip would be as bright as the strip. Zero if all are corners.
fn corrected_hull(points: &mut Vec<DVec2>) -> f64 {
    let n = points.len();
    points.push(DVec2::ZERO);
    let (area, corners) = hull(points);
    let corners = corners.iter().filter(|c| **c != DVec2::ZERO).count();
    if corners < n { area * n as f64 / (n - corners) as f64 } else { 0.0 }
}

/// Area of the smallest circle that holds the points (Welzl 1991, by moves to the front without recursion).
pub fn smallest_circle(points: &[DVec2]) -> f64 {
    let mut circle = (points.first().copied().unwrap_or_default(), 0.0f64);
    let holds = |(c, r2): (DVec2, f64), p: DVec2| c.distance_squared(p) <= r2 * (1.0 + 1e-12) + f64::MIN_POSITIVE;
    for i in 1..points.len() {
        if holds(circle, points[i]) {
            continue;
        }
        circle = (points[i], 0.0);
        for j in 0..i {
            if holds(circle, points[j]) {
                continue;
            }
            circle = through_two(points[i], points[j]);
            for k in 0..j {
                if !holds(circle, points[k]) {
                    circle = through_three(points[i], points[j], points[k]).unwrap_or(circle);
                }
            }
        }
    }
    PI * circle.1
}

fn through_two(a: DVec2, b: DVec2) -> (DVec2, f64) {
    (a.midpoint(b), a.distance_squared(b) / 4.0)
}

fn through_three(a: DVec2, b: DVec2, c: DVec2) -> Option<(DVec2, f64)> {
    let (u, v) = (b - a, c - a);
    let det = 2.0 * u.perp_dot(v);
    let center = DVec2::new(
        v.y * u.length_squared() - u.y * v.length_squared(),
        u.x * v.length_squared() - v.x * u.length_squared(),
    ) / det;
    center.is_finite().then(|| (a + center, center.length_squared()))
}

/// Extents along the two axes of the scene that are nearest to the plane, as a product.
fn aligned_box(offsets: &[DVec3], normal: DVec3) -> f64 {
    let (low, high) = offsets.iter().fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(l, h), p| (l.min(*p), h.max(*p)));
    let (size, n) = (high - low, normal.abs());
    if n.x >= n.y && n.x >= n.z {
        size.y * size.z
    } else if n.y >= n.z {
        size.x * size.z
    } else {
        size.x * size.y
    }
}

/// Principal axes of the points, unit vectors, with their centre and the variances along them.
fn principal_axes(points: &[DVec2]) -> (DVec2, [DVec2; 2], [f64; 2]) {
    let n = points.len() as f64;
    let center = points.iter().sum::<DVec2>() / n;
    let (xx, xy, yy) = points
        .iter()
        .map(|p| *p - center)
        .fold((0.0, 0.0, 0.0), |(a, b, c), d| (a + d.x * d.x / n, b + d.x * d.y / n, c + d.y * d.y / n));
    let (mean, half) = ((xx + yy) / 2.0, (xx - yy) / 2.0);
    let root = (half * half + xy * xy).sqrt();
    let axis = if root <= 1e-12 * mean {
        DVec2::X
    } else if half >= 0.0 {
        DVec2::new(half + root, xy).normalize_or(DVec2::X)
    } else {
        DVec2::new(xy, root - half).normalize_or(DVec2::Y)
    };
    (center, [axis, axis.perp()], [mean + root, (mean - root).max(0.0)])
}

fn oriented_box(points: &[DVec2]) -> f64 {
    let (_, axes, _) = principal_axes(points);
    axes.iter()
        .map(|a| {
            let (low, high) = points
                .iter()
                .map(|p| p.dot(*a))
                .fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| (l.min(x), h.max(x)));
            high - low
        })
        .product()
}

/// The ellipse of the points' variances, enlarged until it holds them all.
fn ellipse(points: &[DVec2]) -> f64 {
    let (center, axes, variances) = principal_axes(points);
    if variances[1] <= 0.0 {
        return 0.0;
    }
    let farthest = points
        .iter()
        .map(|p| *p - center)
        .map(|d| d.dot(axes[0]).powi(2) / variances[0] + d.dot(axes[1]).powi(2) / variances[1])
        .fold(0.0, f64::max);
    PI * farthest * (variances[0] * variances[1]).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::frame::concentric_disc;
    use crate::math::sequence::{Sampling, Sequence};

    fn numbers(count: u64, set: u32) -> impl Iterator<Item = [f64; 2]> {
        let s = Sequence::new(Sampling::Random, 21);
        (0..count).map(move |i| s.four(i, set)).map(|x| [f64::from(x[0]), f64::from(x[1])])
    }

    fn turned(points: impl Iterator<Item = DVec2>, by: f64) -> Vec<DVec2> {
        points.map(|p| DVec2::from_angle(by).rotate(p)).collect()
    }

    /// A rectangle with its corners among the points, turned.
    #[test]
    fn shapes_that_are_known() {
        let corners = [[0.0, 0.0], [4.0, 0.0], [4.0, 2.0], [0.0, 2.0]].map(DVec2::from_array);
        let inside = || numbers(60, 1).map(|[x, y]| DVec2::new(4.0 * x, 2.0 * y));
        // Around the centre every point has its mirror image, so that the principal axes are those of the rectangle.
        let even = inside()
            .flat_map(|p| [p, DVec2::new(4.0 - p.x, p.y), DVec2::new(p.x, 2.0 - p.y), DVec2::new(4.0, 2.0) - p]);
        let mut points = turned(corners.into_iter().chain(even), 0.7);
        let (area, count) = hull(&mut points);
        assert!((area - 8.0).abs() < 1e-9 && count.len() == 4, "{area} {count:?}");
        assert!((oriented_box(&points) - 8.0).abs() < 1e-6);
        assert!((smallest_circle(&points) - PI * 5.0).abs() < 1e-6);
        assert!(ellipse(&points) > 8.0);
        let flat: Vec<DVec3> = corners.iter().map(|c| DVec3::new(c.x, 0.3, c.y)).collect();
        assert!((aligned_box(&flat, DVec3::Y) - 8.0).abs() < 1e-12);
    }

    /// Points on an ellipse have it as theirs.
    #[test]
    fn the_ellipse_of_an_ellipse_is_itself() {
        let points = turned((0..64).map(|i| DVec2::from_angle(f64::from(i) * PI / 32.0) * DVec2::new(3.0, 1.0)), 1.1);
        assert!((ellipse(&points) - 3.0 * PI).abs() < 1e-6);
    }

    #[test]
    fn hulls_are_those_of_brute_force() {
        for set in 0..30 {
            let mut points: Vec<DVec2> = numbers(20, set).map(DVec2::from_array).collect();
            let inside = |p: DVec2, all: &[DVec2]| {
                // A corner has a line through it with all others on one side.
                !all.iter().any(|q| *q != p && all.iter().all(|r| (*q - p).perp_dot(*r - p) >= 0.0))
            };
            let corners = points.iter().filter(|p| !inside(**p, &points)).count();
            assert_eq!(hull(&mut points).1.len(), corners);
        }
        assert!(hull(&mut []).1.is_empty());
        assert_eq!(hull(&mut [DVec2::X; 9]).0, 0.0);
    }

    #[test]
    fn circles_are_those_of_brute_force() {
        for set in 40..60 {
            let points: Vec<DVec2> = numbers(9, set).map(DVec2::from_array).collect();
            let holds_all = |(c, r2): (DVec2, f64)| points.iter().all(|p| c.distance_squared(*p) <= r2 * (1.0 + 1e-9));
            let mut best = f64::INFINITY;
            for (i, a) in points.iter().enumerate() {
                for (j, b) in points.iter().enumerate().skip(i + 1) {
                    let pair = through_two(*a, *b);
                    let triples = points[j + 1..].iter().filter_map(|c| through_three(*a, *b, *c));
                    for circle in triples.chain([pair]).filter(|c| holds_all(*c)) {
                        best = best.min(circle.1);
                    }
                }
            }
            assert!((smallest_circle(&points) - PI * best).abs() < 1e-9);
        }
    }

    /// Poisson points in a disc, a half disc and a strip: their number over the enlarged hull is the true density in the
    /// mean, few or many; over the hull itself it is a third too large.
    #[test]
    fn the_enlarged_hull_tells_the_density() {
        type Region = fn([f64; 2]) -> DVec2;
        fn disc([u, v]: [f64; 2]) -> DVec2 {
            let (x, y) = concentric_disc(u as f32, v as f32);
            DVec2::new(f64::from(x), f64::from(y))
        }
        let half: Region = |x| DVec2::new(disc(x).x, disc(x).y.abs());
        let strip: Region = |[u, v]| DVec2::new(u - 0.3, 0.05 * v);
        let regions = [(disc as Region, PI), (half, PI / 2.0), (strip, 0.05)];
        for (place, (region, area)) in (0u32..).zip(regions) {
            for expected in [25.0, 50.0] {
                let sets = 3000;
                let (mut plain, mut enlarged, mut counted) = (0.0, 0.0, 0);
                for set in 0..sets {
                    // The number of uniform numbers whose product stays above exp(-expected).
                    let mut left = expected;
                    let waits = numbers(200, 10_000 * (place + 1) + 2 * set).map(|x| -libm::log(1.0 - x[0]));
                    let n = waits
                        .take_while(|w| {
                            left -= w;
                            left > 0.0
                        })
                        .count() as u64;
                    let mut points: Vec<DVec2> = numbers(n, 10_000 * (place + 1) + 2 * set + 1).map(region).collect();
                    let whole = corrected_hull(&mut points.clone());
                    if n >= LEAST_POINTS as u64 && whole > 0.0 {
                        plain += n as f64 / hull(&mut points).0;
                        enlarged += n as f64 / whole;
                        counted += 1;
                    }
                }
                let of = |sum: f64| sum / f64::from(counted) / (expected / area);
                assert!(of(plain) > 1.2, "{}", of(plain));
                assert!((of(enlarged) - 1.0).abs() < 0.015, "{expected}: {}", of(enlarged));
            }
        }
    }

    /// Points of a strip far from the origin: the way there counts.
    #[test]
    fn a_place_beside_a_lit_strip_is_not_in_it() {
        let mut strip: Vec<DVec2> = numbers(50, 7).map(|[x, y]| DVec2::new(1.0 + 0.05 * x, y - 0.5)).collect();
        let (alone, _) = hull(&mut strip.clone());
        assert!(alone < 0.05 && corrected_hull(&mut strip) > 10.0 * alone);
    }

    #[test]
    fn points_on_a_line_have_no_area() {
        let line: Vec<DVec3> = (0..20).map(|i| DVec3::new(f64::from(i), 0.0, 0.0)).collect();
        for kind in [Area::Hull, Area::HullAsPublished, Area::AlignedBox, Area::OrientedBox, Area::Ellipse] {
            assert_eq!(area(kind, &line, [DVec3::X, DVec3::Z], DVec3::Y, &mut Vec::new()), None);
        }
        assert_eq!(area(Area::Hull, &line[..3], [DVec3::X, DVec3::Z], DVec3::Y, &mut Vec::new()), None);
    }
}
