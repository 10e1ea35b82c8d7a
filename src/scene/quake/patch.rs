//! Bézier patches: grids of biquadratic pieces of 3×3 control points.

use super::MapError;
use super::lumps::VertexRecord;
use glam::{DVec2, DVec3};

/// Steps across a piece. The same for all, so that neighbours meet in the same points.
const STEPS: usize = 4;

/// Control points across or down a patch at most.
const MOST: i32 = 129;

/// A patch as a grid of points, row by row.
pub(super) struct Grid {
    pub(super) width: usize,
    pub(super) points: Vec<VertexRecord>,
}

/// Evaluates a patch of `size` control points.
///
/// # Errors
/// A grid that is no grid of pieces, or has not as many points.
pub(super) fn tessellate(control: &[VertexRecord], size: [i32; 2], face: usize) -> Result<Grid, MapError> {
    let [w, h] = size;
    if w < 3 || h < 3 || w % 2 == 0 || h % 2 == 0 || w > MOST || h > MOST {
        return Err(MapError(format!(
            "faces[{face}]: a patch of {w}x{h} control points; give odd numbers from 3 to {MOST}"
        )));
    }
    let [w, h] = [w as usize, h as usize];
    if w * h != control.len() {
        return Err(MapError(format!(
            "faces[{face}]: a patch of {w}x{h} control points has {} vertexes",
            control.len()
        )));
    }
    let (across, down) = ((w - 1) / 2 * STEPS + 1, (h - 1) / 2 * STEPS + 1);
    let mut points = Vec::with_capacity(across * down);
    for j in 0..down {
        for i in 0..across {
            let (px, s) = piece(i, w);
            let (py, t) = piece(j, h);
            let weights = [weights(s), weights(t)];
            let mut v = VertexRecord { position: DVec3::ZERO, uv: DVec2::ZERO, normal: DVec3::ZERO };
            for (row, wt) in weights[1].iter().enumerate() {
                for (column, ws) in weights[0].iter().enumerate() {
                    let c = &control[(py + row) * w + px + column];
                    let share = wt * ws;
                    v.position += c.position * share;
                    v.uv += c.uv * share;
                    v.normal += c.normal * share;
                }
            }
            points.push(v);
        }
    }
    Ok(Grid { width: across, points })
}

/// First control point of the piece in which a step lies, and its parameter there.
fn piece(step: usize, control: usize) -> (usize, f64) {
    let piece = (step / STEPS).min((control - 3) / 2);
    (2 * piece, (step - piece * STEPS) as f64 / STEPS as f64)
}

/// Quadratic Bernstein polynomials.
fn weights(t: f64) -> [f64; 3] {
    [(1.0 - t) * (1.0 - t), 2.0 * t * (1.0 - t), t * t]
}

impl Grid {
    /// Its triangles, in the orientation of its rows.
    pub(super) fn triangles(&self) -> impl Iterator<Item = [usize; 3]> + '_ {
        let (w, h) = (self.width, self.points.len() / self.width);
        (0..h - 1).flat_map(move |j| {
            (0..w - 1).flat_map(move |i| {
                let a = j * w + i;
                [[a, a + 1, a + w], [a + 1, a + w + 1, a + w]]
            })
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn control(f: impl Fn(f64, f64) -> DVec3) -> Vec<VertexRecord> {
        (0..15)
            .map(|i| {
                let (s, t) = (f64::from(i % 5), f64::from(i / 5));
                VertexRecord { position: f(s, t), uv: DVec2::new(s, t), normal: DVec3::Z }
            })
            .collect()
    }

    /// A quarter of a parabola through its ends; a flat patch stays flat and even.
    #[test]
    fn patches_are_biquadratic() {
        let grid = tessellate(&control(|s, t| DVec3::new(s, t, 0.0)), [5, 3], 0).expect("a patch");
        assert_eq!((grid.width, grid.points.len(), grid.triangles().count()), (9, 45, 64));
        for p in &grid.points {
            assert!((p.position.truncate() - p.uv).length() < 1e-12);
        }
        let bent = tessellate(&control(|s, t| DVec3::new(s, t, if t == 1.0 { 8.0 } else { 0.0 })), [5, 3], 0)
            .expect("a patch");
        for p in &bent.points {
            let t = p.position.y / 2.0;
            assert!((p.position.z - 16.0 * t * (1.0 - t)).abs() < 1e-12);
        }
    }

    #[test]
    fn odd_grids_are_refused() {
        for size in [[4, 3], [3, 1], [-3, 3], [5, 5], [131, 3]] {
            let error = tessellate(&control(|_, _| DVec3::ZERO), size, 7).map(|_| ()).expect_err("refused");
            assert!(error.0.starts_with("faces[7]: a patch of"), "{error}");
        }
    }
}
