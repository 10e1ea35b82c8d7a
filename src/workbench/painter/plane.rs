//! A quantity given at three points and affine between them.

/// A point in physical pixels.
pub type Point = [f64; 2];

/// `value(x, y) = at_origin + dx · (x − origin.x) + dy · (y − origin.y)`.
#[derive(Clone, Copy, Debug)]
pub struct Plane {
    origin: Point,
    at_origin: f64,
    /// Change per pixel to the right.
    pub dx: f64,
    /// Change per pixel downwards.
    pub dy: f64,
}

impl Plane {
    /// The plane through `values` at `points`; flat if the values are equal, so that they come back exactly.
    ///
    /// The points must be finite and span an area; the planes of a triangle without area are not finite.
    pub fn new(points: &[Point; 3], values: [f64; 3]) -> Self {
        let [p, q, r] = *points;
        let [value, first, second] = [values[0], values[1] - values[0], values[2] - values[0]];
        if first == 0.0 && second == 0.0 {
            return Self { origin: p, at_origin: value, dx: 0.0, dy: 0.0 };
        }
        let [qx, qy, rx, ry] = [q[0] - p[0], q[1] - p[1], r[0] - p[0], r[1] - p[1]];
        let area = qx * ry - qy * rx;
        let dx = (first * ry - second * qy) / area;
        let dy = (second * qx - first * rx) / area;
        Self { origin: p, at_origin: value, dx, dy }
    }

    /// The value at a point.
    pub fn at(&self, point: Point) -> f64 {
        self.at_origin + self.dx * (point[0] - self.origin[0]) + self.dy * (point[1] - self.origin[1])
    }

    /// Whether all values are the same.
    pub fn is_flat(&self) -> bool {
        self.dx == 0.0 && self.dy == 0.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_goes_through_its_points() {
        let points = [[1.0, 2.0], [5.0, 2.0], [3.0, 8.0]];
        let plane = Plane::new(&points, [10.0, 30.0, 8.0]);
        assert_eq!(points.map(|p| plane.at(p)), [10.0, 30.0, 8.0]);
        assert_eq!((plane.dx, plane.dy), (5.0, -2.0));
        assert!(!plane.is_flat());
    }

    #[test]
    fn equal_values_come_back_exactly() {
        let plane = Plane::new(&[[0.1, 0.7], [1e20, 0.3], [3.0, 1e20]], [0.1; 3]);
        assert!(plane.is_flat());
        assert_eq!(plane.at([1e9, -7.3]), 0.1);
    }
}
