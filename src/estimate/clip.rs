//! Sutherland-Hodgman clipping of the view footprint, without allocation (Sutherland and Hodgman 1974).

use glam::DVec2;

/// Corners that a photon's polygon may have.
pub const MAX_CORNERS: usize = 64;
/// Vertices of a clipped parallelogram: each half-plane adds one at most.
pub const MAX_VERTICES: usize = MAX_CORNERS + 4;

/// Vertices of a parallelogram that is clipped by another.
pub const SQUARE_VERTICES: usize = 8;

/// A vertex of the view parallelogram, known both ways.
#[derive(Clone, Copy, Debug, Default)]
pub struct Vertex {
    /// Parameters `(s, t)` in the view footprint; the parallelogram is `[-1, 1]²`.
    pub parameter: DVec2,
    /// The same point in the photon's footprint.
    pub footprint: DVec2,
}

/// A half-plane `normal · x ≤ distance` of the photon's footprint.
#[derive(Clone, Copy, Debug)]
pub struct HalfPlane {
    /// Outward normal.
    pub normal: DVec2,
    /// Distance from the origin.
    pub distance: f64,
}

/// A convex polygon of up to `N` vertices that is being clipped: four, and one for each half-plane.
pub struct ClippedPolygon<const N: usize = MAX_VERTICES> {
    vertices: [Vertex; N],
    len: usize,
}

impl<const N: usize> ClippedPolygon<N> {
    /// The whole view parallelogram with centre `c` and half-edges `a`, `b` in the photon's footprint.
    pub fn whole(c: DVec2, a: DVec2, b: DVec2) -> Self {
        let mut polygon = Self { vertices: [Vertex::default(); N], len: N.min(4) };
        for (v, (s, t)) in polygon.vertices.iter_mut().zip([(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)]) {
            *v = Vertex { parameter: DVec2::new(s, t), footprint: c + a * s + b * t };
        }
        polygon
    }

    /// What is left, in order.
    pub fn vertices(&self) -> &[Vertex] {
        &self.vertices[..self.len]
    }

    /// Cuts off all beyond the half-plane.
    pub fn clip(&mut self, plane: &HalfPlane) {
        let outside = |v: &Vertex| plane.normal.dot(v.footprint) - plane.distance;
        if self.vertices().iter().all(|v| outside(v) <= 0.0) {
            return;
        }
        let mut kept = [Vertex::default(); N];
        let mut count = 0;
        let mut push = |v: Vertex| {
            // A convex polygon gains one vertex for each half-plane, so the array holds them all.
            if count < N {
                kept[count] = v;
                count += 1;
            }
        };
        for i in 0..self.len {
            let next = if i + 1 < self.len { i + 1 } else { 0 };
            let (p, q) = (self.vertices[i], self.vertices[next]);
            let (dp, dq) = (outside(&p), outside(&q));
            if dp <= 0.0 {
                push(p);
            }
            if (dp < 0.0 && dq > 0.0) || (dp > 0.0 && dq < 0.0) {
                let w = dp / (dp - dq);
                push(Vertex {
                    parameter: p.parameter.lerp(q.parameter, w),
                    footprint: p.footprint.lerp(q.footprint, w),
                });
            }
        }
        self.vertices = kept;
        self.len = count;
    }

    /// Share of the view footprint that is left (Pedersen 2011, eq. 63 with its closing edge, eq. 64), and the area
    /// centroid of it in the view footprint's parameters.
    ///
    /// Measured in parameters, where a view footprint of no width is as good as any.
    pub fn coverage_and_centroid(&self) -> (f64, DVec2) {
        let v = self.vertices();
        let Some(first) = v.first() else {
            return (0.0, DVec2::ZERO);
        };
        let mut doubled = 0.0;
        let mut moment = DVec2::ZERO;
        for i in 1..v.len().saturating_sub(1) {
            let (p, q) = (v[i].parameter - first.parameter, v[i + 1].parameter - first.parameter);
            let cross = p.perp_dot(q);
            doubled += cross;
            moment += (p + q) * (cross / 3.0);
        }
        if doubled <= 0.0 {
            return (0.0, first.parameter);
        }
        ((doubled / 8.0).min(1.0), first.parameter + moment / doubled)
    }
}

/// Half-planes of the square `[-1, 1]²`: the photon's parallelogram (Pedersen 2011, eq. 61).
pub fn square() -> Vec<HalfPlane> {
    [DVec2::X, DVec2::Y, DVec2::NEG_X, DVec2::NEG_Y].map(|normal| HalfPlane { normal, distance: 1.0 }).into()
}

/// Half-planes of the polygon of `n` corners inscribed in the unit circle (Pedersen 2011, eq. 62).
pub fn inscribed(n: usize) -> Vec<HalfPlane> {
    let step = std::f64::consts::TAU / n as f64;
    (0..n)
        .map(|i| {
            let (s, c) = libm::sincos((i as f64 + 0.5) * step);
            HalfPlane { normal: DVec2::new(c, s), distance: libm::cos(step / 2.0) }
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn clipped(c: DVec2, a: DVec2, b: DVec2, planes: &[HalfPlane]) -> ClippedPolygon {
        let mut p = ClippedPolygon::<MAX_VERTICES>::whole(c, a, b);
        planes.iter().for_each(|h| p.clip(h));
        p
    }

    proptest! {
        /// Coverage and centroid against counting the points of a grid.
        #[test]
        fn coverage_and_centroid_match_a_grid(
            c in prop::array::uniform2(-1.5f64..1.5), a in prop::array::uniform2(-1.5f64..1.5),
            b in prop::array::uniform2(-1.5f64..1.5), corners in 3usize..24,
        ) {
            let (c, a, b) = (DVec2::from(c), DVec2::from(a), DVec2::from(b));
            for planes in [square(), inscribed(corners)] {
                let (coverage, centroid) = clipped(c, a, b, &planes).coverage_and_centroid();
                let n = 300;
                let mut inside = 0.0;
                let mut sum = DVec2::ZERO;
                for i in 0..n {
                    for j in 0..n {
                        let p = DVec2::new(f64::from(i) + 0.5, f64::from(j) + 0.5) / f64::from(n) * 2.0 - 1.0;
                        let x = c + a * p.x + b * p.y;
                        if planes.iter().all(|h| h.normal.dot(x) <= h.distance) {
                            inside += 1.0;
                            sum += p;
                        }
                    }
                }
                prop_assert!((coverage - inside / f64::from(n * n)).abs() < 0.02);
                if coverage > 0.05 {
                    prop_assert!((centroid - sum / inside).length() < 0.05);
                }
            }
        }
    }

    #[test]
    fn views_without_width_are_clipped_too() {
        // A segment half in, half out of the square; a point inside; a point outside.
        let (coverage, centroid) = clipped(DVec2::X, DVec2::X, DVec2::ZERO, &square()).coverage_and_centroid();
        assert!((coverage - 0.5).abs() < 1e-12 && (centroid - DVec2::new(-0.5, 0.0)).length() < 1e-12);
        let point = clipped(DVec2::splat(0.3), DVec2::ZERO, DVec2::ZERO, &square());
        assert_eq!(point.coverage_and_centroid(), (1.0, DVec2::ZERO));
        let gone = clipped(DVec2::splat(1.3), DVec2::ZERO, DVec2::ZERO, &square());
        assert_eq!(gone.coverage_and_centroid().0, 0.0);
    }

    /// Eq. 63 without the closing edge, and eq. 65's mean of the vertices, are wrong for a triangle cut from a corner.
    #[test]
    fn printed_area_and_centroid_differ() {
        let tilted = HalfPlane { normal: DVec2::ONE.normalize(), distance: 0.2 };
        let p = clipped(DVec2::ZERO, DVec2::X, DVec2::Y, &[tilted]);
        let v = p.vertices();
        let open: f64 = (0..v.len() - 1).map(|i| v[i].parameter.perp_dot(v[i + 1].parameter)).sum::<f64>().abs() / 2.0;
        let (coverage, centroid) = p.coverage_and_centroid();
        let exact = 4.0 - (2.0 - 0.2 * 2f64.sqrt()).powi(2) / 2.0;
        assert!((coverage * 4.0 - exact).abs() < 1e-12);
        assert!((open - exact).abs() > 0.1);
        let mean = v.iter().map(|v| v.parameter).sum::<DVec2>() / v.len() as f64;
        assert!((mean - centroid).length() > 0.05);
    }
}
