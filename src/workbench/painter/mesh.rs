//! The triangles of one mesh: vertex colour times texel, blended onto the canvas.

use super::canvas::{Canvas, blend, blend_span};
use super::clip::Scissor;
use super::coverage::Coverage;
use super::plane::{Plane, Point};
use super::sampler::{Coordinate, Sampler};
use super::textures::Texture;
use egui::epaint::{Mesh, Vertex};
use std::ops::Range;

/// Draws all triangles of `mesh` in their order. One with an index that has no vertex is left out.
pub fn draw(canvas: &mut Canvas, scissor: &Scissor, pixels_per_point: f32, mesh: &Mesh, texture: &Texture) {
    for indices in mesh.indices.chunks_exact(3) {
        let vertex = |corner: usize| mesh.vertices.get(*indices.get(corner)? as usize);
        if let (Some(a), Some(b), Some(c)) = (vertex(0), vertex(1), vertex(2)) {
            draw_triangle(canvas, scissor, pixels_per_point, [a, b, c], texture);
        }
    }
}

fn draw_triangle(
    canvas: &mut Canvas,
    scissor: &Scissor,
    pixels_per_point: f32,
    vertices: [&Vertex; 3],
    texture: &Texture,
) {
    let scale = f64::from(pixels_per_point);
    let corners = vertices.map(|v| [f64::from(v.pos.x) * scale, f64::from(v.pos.y) * scale]);
    if is_outside(&corners, scissor) || !vertices.iter().all(|v| v.uv.is_finite()) {
        return;
    }
    let Some(coverage) = Coverage::new(corners) else { return };
    let paint = Paint::new(&coverage.corners, vertices, texture);
    coverage.spans(scissor, |y, columns| paint.fill(canvas, y, columns));
}

/// Whether a triangle lies beyond one side of the scissor rectangle, so that it covers no pixel of it.
fn is_outside(corners: &[Point; 3], scissor: &Scissor) -> bool {
    let beyond = |axis: usize, range: &Range<u32>| {
        corners.iter().all(|p| p[axis] < f64::from(range.start))
            || corners.iter().all(|p| p[axis] > f64::from(range.end))
    };
    beyond(0, &scissor.x) || beyond(1, &scissor.y)
}

/// What a triangle is filled with.
enum Paint<'a> {
    /// One premultiplied colour, channels in `[0, 255]`.
    Flat([f32; 4]),
    /// A colour that varies, the texel already multiplied in.
    Gradient([Plane; 4]),
    /// A texture, tinted.
    Textured { tint: [Plane; 4], place: [Plane; 2], sampler: Sampler<'a> },
}

impl<'a> Paint<'a> {
    fn new(corners: &[Point; 3], vertices: [&Vertex; 3], texture: &'a Texture) -> Self {
        let size = texture.size();
        let place: [Plane; 2] = std::array::from_fn(|axis| {
            Plane::new(corners, vertices.map(|v| f64::from(v.uv[axis]) * size[axis] as f64))
        });
        let sampler = Sampler::new(texture, place.map(|p| p.dx), place.map(|p| p.dy));
        let texel =
            place.iter().all(Plane::is_flat).then(|| sampler.at(place.map(|p| Coordinate::new(p.at([0.0; 2])))));

        let colors = vertices.map(|v| v.color.to_array());
        let factor = texel.unwrap_or([255.0; 4]);
        let tint: [Plane; 4] = std::array::from_fn(|channel| {
            Plane::new(corners, colors.map(|c| f64::from(c[channel]) * f64::from(factor[channel]) / 255.0))
        });
        if texel.is_none() {
            Self::Textured { tint, place, sampler }
        } else if tint.iter().all(Plane::is_flat) {
            Self::Flat(tint.map(|p| p.at([0.0; 2]) as f32))
        } else {
            Self::Gradient(tint)
        }
    }

    fn fill(&self, canvas: &mut Canvas, y: u32, columns: Range<u32>) {
        let first = [f64::from(columns.start) + 0.5, f64::from(y) + 0.5];
        let span = canvas.span(y, columns);
        match self {
            Self::Flat(color) => blend_span(span, *color),
            Self::Gradient(planes) => {
                let color = Ramp::new(planes, first);
                for (i, pixel) in span.iter_mut().enumerate() {
                    blend(pixel, color.at(i));
                }
            }
            Self::Textured { tint, place, sampler } => {
                let color = Ramp::new(tint, first);
                let mut at = place.map(|p| Coordinate::new(p.at(first)));
                let step = place.map(|p| Coordinate::new(p.dx));
                for (i, pixel) in span.iter_mut().enumerate() {
                    blend(pixel, multiplied(color.at(i), sampler.at(at)));
                    at = [at[0].plus(step[0]), at[1].plus(step[1])];
                }
            }
        }
    }
}

/// Four channels along a row of pixels.
struct Ramp {
    first: [f32; 4],
    step: [f32; 4],
}

impl Ramp {
    fn new(planes: &[Plane; 4], first: Point) -> Self {
        Self { first: planes.map(|p| p.at(first) as f32), step: planes.map(|p| p.dx as f32) }
    }

    #[inline]
    fn at(&self, pixel: usize) -> [f32; 4] {
        std::array::from_fn(|c| self.first[c] + self.step[c] * pixel as f32)
    }
}

/// The product of two colours with channels in `[0, 255]`.
#[inline]
fn multiplied(a: [f32; 4], b: [f32; 4]) -> [f32; 4] {
    std::array::from_fn(|c| a[c] * b[c] * (1.0 / 255.0))
}
