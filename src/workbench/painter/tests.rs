//! The painter as a whole: textures, triangles and scissors in, pixels out.

use super::*;
use egui::epaint::{ImageDelta, Mesh, PaintCallback, Primitive, Vertex};
use egui::{Color32, ColorImage, Pos2, Rect, TextureFilter, TextureId, TextureOptions, pos2};
use proptest::prelude::*;
use std::sync::Arc;

const ID: TextureId = TextureId::Managed(0);
const BLACK: [u8; 4] = [0, 0, 0, 255];

/// A painter with one texture.
fn painter(size: [usize; 2], texels: &[Color32], options: TextureOptions) -> Painter {
    let mut painter = Painter::new();
    set(&mut painter, ImageDelta::full(ColorImage::new(size, texels.to_vec()), options));
    painter
}

fn set(painter: &mut Painter, change: ImageDelta) {
    let mut delta = TexturesDelta::default();
    delta.push(ID, change);
    painter.set_textures(&mut delta);
}

fn white() -> Painter {
    painter([1, 1], &[Color32::WHITE], TextureOptions::LINEAR)
}

fn rect(min: [f32; 2], max: [f32; 2]) -> Rect {
    Rect { min: min.into(), max: max.into() }
}

/// A rectangle of two triangles with the whole texture on it.
fn quad(place: Rect, color: Color32) -> Mesh {
    let mut mesh = Mesh::with_texture(ID);
    mesh.add_rect_with_uv(place, rect([0.0; 2], [1.0; 2]), color);
    mesh
}

fn clipped(mesh: Mesh, clip_rect: Rect) -> ClippedPrimitive {
    ClippedPrimitive { clip_rect, primitive: Primitive::Mesh(mesh) }
}

fn everywhere(mesh: Mesh) -> ClippedPrimitive {
    clipped(mesh, Rect::EVERYTHING)
}

/// The red channel, row by row.
fn reds(image: &RgbaImage) -> Vec<Vec<u8>> {
    image.rows().map(|row| row.map(|pixel| pixel.0[0]).collect()).collect()
}

#[test]
fn nothing_to_paint_leaves_the_ground() {
    let image = Painter::new().paint([3, 2], 1.0, Color32::from_rgb(1, 2, 3), &[]);
    assert_eq!(image.dimensions(), (3, 2));
    assert!(image.pixels().all(|pixel| pixel.0 == [1, 2, 3, 255]));
}

#[test]
fn a_translucent_rectangle_is_even_across_its_diagonal() {
    // Over 100: 64 + 100·(1 − 128/255) = 113.8.
    let veil = Color32::from_rgba_premultiplied(64, 0, 0, 128);
    for scale in [1.0, 1.5, 2.0] {
        let place = rect([0.0; 2], [20.0, 14.0]);
        let ground = Color32::from_rgb(100, 0, 0);
        let image = white().paint([30, 21], scale, ground, &[everywhere(quad(place, veil))]);
        let inside = |x: u32, y: u32| (x as f32) < 20.0 * scale && (y as f32) < 14.0 * scale;
        for (x, y, pixel) in image.enumerate_pixels() {
            assert_eq!(pixel.0, [if inside(x, y) { 114 } else { 100 }, 0, 0, 255], "{x}, {y} at {scale}");
        }
    }
}

#[test]
fn vertex_colour_multiplies_the_texel() {
    let painter = painter([1, 1], &[Color32::from_rgba_premultiplied(200, 100, 50, 255)], TextureOptions::LINEAR);
    let tint = Color32::from_rgba_premultiplied(51, 102, 0, 153);
    let image = painter.paint([1, 1], 1.0, Color32::BLACK, &[everywhere(quad(rect([0.0; 2], [1.0; 2]), tint))]);
    // 200·51/255 = 40, 100·102/255 = 40, over black.
    assert_eq!(image.get_pixel(0, 0).0, [40, 40, 0, 255]);
}

#[test]
fn nearest_magnifies_to_even_blocks() {
    let texels = [10, 20, 30, 40].map(Color32::from_gray);
    let painter = painter([2, 2], &texels, TextureOptions::NEAREST);
    let image =
        painter.paint([6, 6], 1.5, Color32::BLACK, &[everywhere(quad(rect([0.0; 2], [4.0; 2]), Color32::WHITE))]);
    let (above, below) = (vec![10, 10, 10, 20, 20, 20], vec![30, 30, 30, 40, 40, 40]);
    assert_eq!(reds(&image), [above.clone(), above.clone(), above, below.clone(), below.clone(), below]);
}

#[test]
fn linear_magnifies_to_a_ramp_between_texel_centres() {
    let painter = painter([2, 1], &[Color32::from_gray(0), Color32::from_gray(200)], TextureOptions::LINEAR);
    let image =
        painter.paint([4, 2], 1.0, Color32::BLACK, &[everywhere(quad(rect([0.0; 2], [4.0, 2.0]), Color32::WHITE))]);
    // Pixel centres lie at texels 0.25, 0.75, 1.25 and 1.75, texel centres at 0.5 and 1.5.
    assert_eq!(reds(&image), [[0, 50, 150, 200]; 2]);
}

#[test]
fn shrinking_and_growing_use_their_own_filters() {
    let shown = |magnification, minification, width: u32| {
        let options = TextureOptions { magnification, minification, ..TextureOptions::LINEAR };
        let painter = painter([4, 1], &[0, 40, 80, 200].map(Color32::from_gray), options);
        let place = rect([0.0; 2], [width as f32, 1.0]);
        reds(&painter.paint([width, 1], 1.0, Color32::BLACK, &[everywhere(quad(place, Color32::WHITE))])).concat()
    };
    let (nearest, linear) = (TextureFilter::Nearest, TextureFilter::Linear);
    // Two texels per pixel: the pixel centre lies between them, and the later one is the nearest.
    assert_eq!(shown(nearest, linear, 2), [20, 140]);
    assert_eq!(shown(linear, nearest, 2), [40, 200]);
    assert_eq!(shown(nearest, linear, 8), [0, 0, 40, 40, 80, 80, 200, 200]);
    assert_eq!(shown(linear, nearest, 8), [0, 10, 30, 50, 70, 110, 170, 200]);
    assert_eq!(shown(nearest, linear, 4), [0, 40, 80, 200]);
    assert_eq!(shown(linear, nearest, 4), [0, 40, 80, 200]);
}

#[test]
fn colours_run_evenly_between_vertices() {
    let mut mesh = quad(rect([0.0; 2], [4.0, 2.0]), Color32::BLACK);
    for vertex in mesh.vertices.iter_mut().filter(|v| v.pos.x > 0.0) {
        vertex.color = Color32::from_rgb(240, 0, 0);
    }
    let image = white().paint([4, 2], 1.0, Color32::WHITE, &[everywhere(mesh)]);
    assert_eq!(reds(&image), [[30, 90, 150, 210]; 2]);
}

#[test]
fn the_scissor_cuts_at_rounded_pixels() {
    // At 1.5 pixels per point 1 → 1.5 → 2, 3.5 → 5.25 → 5, 0.6 → 0.9 → 1, 2.4 → 3.6 → 4.
    let primitive = clipped(quad(rect([-9.0; 2], [99.0; 2]), Color32::WHITE), rect([1.0, 0.6], [3.5, 2.4]));
    let image = white().paint([7, 5], 1.5, Color32::BLACK, &[primitive]);
    for (x, y, pixel) in image.enumerate_pixels() {
        let inside = (2..5).contains(&x) && (1..4).contains(&y);
        assert_eq!(pixel.0[0] == 255, inside, "{x}, {y}");
    }
}

#[test]
fn a_part_of_a_texture_changes_what_is_painted() {
    let mut painter = painter([2, 1], &[Color32::from_gray(10); 2], TextureOptions::NEAREST);
    let part = ColorImage::new([1, 1], vec![Color32::from_gray(90)]);
    set(&mut painter, ImageDelta::partial([1, 0], part, TextureOptions::NEAREST));
    let image =
        painter.paint([4, 1], 1.0, Color32::BLACK, &[everywhere(quad(rect([0.0; 2], [4.0, 1.0]), Color32::WHITE))]);
    assert_eq!(reds(&image), [[10, 10, 90, 90]]);
}

#[test]
fn freed_textures_and_callbacks_are_left_out() {
    let mut painter = white();
    let mut delta = TexturesDelta::default();
    delta.free(ID);
    painter.free_textures(&mut delta);
    assert!(delta.is_empty());
    let callback = PaintCallback { rect: rect([0.0; 2], [2.0; 2]), callback: Arc::new(()) };
    let callback = ClippedPrimitive { clip_rect: Rect::EVERYTHING, primitive: Primitive::Callback(callback) };
    let primitives = [everywhere(quad(rect([0.0; 2], [2.0; 2]), Color32::WHITE)), callback];
    let image = painter.paint([2, 2], 1.0, Color32::BLACK, &primitives);
    assert!(image.pixels().all(|pixel| pixel.0 == BLACK));
}

#[test]
fn broken_triangles_are_left_out_and_the_others_stay() {
    let mut mesh = quad(rect([0.0; 2], [2.0; 2]), Color32::WHITE);
    mesh.indices.splice(0..0, [0, 1, 9, 2, 2, 3, 0, 0, 0]);
    mesh.indices.extend([0, 1]);
    for bad in [f32::NAN, f32::INFINITY] {
        let corner = mesh.vertices.len() as u32;
        mesh.vertices.push(Vertex { pos: pos2(bad, 0.0), uv: Pos2::ZERO, color: Color32::RED });
        mesh.vertices.push(Vertex { pos: pos2(5.0, 5.0), uv: pos2(0.0, bad), color: Color32::RED });
        mesh.indices.splice(0..0, [0, 1, corner, 0, 1, corner + 1]);
    }
    let image = white().paint([3, 2], 1.0, Color32::BLACK, &[everywhere(mesh)]);
    assert_eq!(reds(&image), [[255, 255, 0]; 2]);
}

#[test]
fn a_rectangle_far_larger_than_the_image_fills_it_and_keeps_its_texture_in_place() {
    let texels = [10, 20, 30, 40].map(Color32::from_gray);
    let painter = painter([2, 2], &texels, TextureOptions::NEAREST);
    for reach in [1e3, 1e6, 1e12, 1e30] {
        let place = rect([2.0 - reach, 1.0 - reach], [2.0 + reach, 1.0 + reach]);
        let image = painter.paint([4, 2], 1.0, Color32::BLACK, &[everywhere(quad(place, Color32::WHITE))]);
        if reach < 1e6 {
            assert_eq!(reds(&image), [[10, 10, 20, 20], [30, 30, 40, 40]]);
        }
        assert!(image.pixels().all(|pixel| pixel.0 != BLACK), "{reach}");
    }
}

#[test]
fn sizes_of_zero_have_no_pixels() {
    let primitive = everywhere(quad(rect([0.0; 2], [2.0; 2]), Color32::WHITE));
    assert_eq!(white().paint([0, 5], 1.0, Color32::BLACK, &[primitive]).pixels().len(), 0);
}

fn number() -> impl Strategy<Value = f32> {
    let special = vec![f32::NAN, f32::INFINITY, f32::NEG_INFINITY, 0.0, -0.0, 1e30, -1e30, f32::MAX, f32::MIN_POSITIVE];
    prop_oneof![4 => -5.0..30.0_f32, 1 => any::<f32>(), 2 => prop::sample::select(special)]
}

fn position() -> impl Strategy<Value = Pos2> {
    [number(), number()].prop_map(Pos2::from)
}

fn vertex() -> impl Strategy<Value = Vertex> {
    let color = any::<[u8; 4]>().prop_map(|[r, g, b, a]| Color32::from_rgba_premultiplied(r, g, b, a));
    (position(), position(), color).prop_map(|(pos, uv, color)| Vertex { pos, uv, color })
}

fn options() -> impl Strategy<Value = TextureOptions> {
    prop::sample::select(vec![
        TextureOptions::LINEAR,
        TextureOptions::NEAREST,
        TextureOptions::LINEAR_REPEAT,
        TextureOptions::LINEAR_MIRRORED_REPEAT,
        TextureOptions::NEAREST_REPEAT,
        TextureOptions::NEAREST_MIRRORED_REPEAT,
    ])
}

proptest! {
    /// Whatever the triangles are, nothing panics, and an opaque ground stays opaque.
    #[test]
    fn no_triangle_panics(
        vertices in prop::collection::vec(vertex(), 3..12),
        clip in [position(), position()],
        scale in prop_oneof![3 => Just(1.5_f32), 1 => number()],
        options in options(),
    ) {
        let indices = (0..vertices.len() as u32 + 1).collect();
        let mesh = Mesh { indices, vertices, texture_id: ID };
        let painter = painter([3, 2], &[10, 20, 30, 40, 50, 60].map(Color32::from_gray), options);
        let primitives = [everywhere(mesh.clone()), clipped(mesh, Rect { min: clip[0], max: clip[1] })];
        let image = painter.paint([24, 16], scale, Color32::BLACK, &primitives);
        prop_assert!(image.pixels().all(|pixel| pixel.0[3] == 255));
    }
}
