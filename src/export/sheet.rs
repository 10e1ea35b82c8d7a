//! The sheet: estimators side by side, each with its image, its crop and its error, labelled.

use crate::export::text::{Canvas, Face};
use crate::export::tone::Look;
use crate::math::rgb::{Rgb, luminance};
use crate::render::film::{Image, Rect};
use glam::DVec3;

/// One estimator's column.
pub struct Column {
    /// Title.
    pub title: String,
    /// Lines of numbers below it.
    pub lines: Vec<String>,
    /// Colour of the estimator.
    pub color: [u8; 3],
    /// The whole image.
    pub image: Image,
    /// How it becomes bytes.
    pub look: Look,
    /// Signed error of the crop, relative to the truth's mean; None without a truth.
    pub error: Option<Image>,
}

/// What a sheet shows.
pub struct Sheet {
    /// Heading.
    pub title: String,
    /// Line below it.
    pub subtitle: String,
    /// The estimators.
    pub columns: Vec<Column>,
    /// The part that is enlarged, of each image what lies inside it. If it is all of them, they stand there but once.
    pub crop: Rect,
    /// Factor of enlargement.
    pub enlarge: u32,
}

/// Neutral, so that the eye can judge what lies on it.
const BACKGROUND: [u8; 3] = [64; 3];
const INK: [u8; 3] = [235; 3];
const FAINT: [u8; 3] = [175; 3];
const FRAME: [u8; 3] = [255, 210, 60];
const GAP: u32 = 12;
const LINE: u32 = 19;

/// Colour-blind safe colours of the estimators (Okabe and Ito 2008), by place in a list.
pub const PALETTE: [[u8; 3]; 8] = [
    [230, 159, 0],
    [86, 180, 233],
    [0, 158, 115],
    [240, 228, 66],
    [204, 121, 167],
    [213, 94, 0],
    [0, 114, 178],
    [200, 200, 200],
];

/// What errors are against unless [`draw_against`] says otherwise.
const TRUTH: &str = "regular with 16×16 view rays on the same photons";

/// Draws a sheet whose errors are against `regular` with 16×16 view rays.
pub fn draw(sheet: &Sheet) -> Canvas {
    draw_against(sheet, TRUTH)
}

/// Draws a sheet; `truth` says what its errors are against.
pub fn draw_against(sheet: &Sheet, truth: &str) -> Canvas {
    let inner = sheet.crop.width * sheet.enlarge;
    let crop_height = sheet.crop.height * sheet.enlarge;
    let [w, h] = sheet.columns.first().map_or([1, 1], |c| c.image.size);
    let shown = [inner.max(1), (u64::from(inner) * u64::from(h) / u64::from(w)).max(1) as u32];
    let has_error = sheet.columns.iter().any(|c| c.error.is_some());
    let lines = sheet.columns.iter().map(|c| c.lines.len()).max().unwrap_or(0) as u32;
    let heading = 62;
    let label = 30 + lines * LINE;
    let crops = if has_error { 2 } else { 1 };
    let overview = sheet.columns.iter().any(|c| Rect::whole(c.image.size) != sheet.crop);
    let above = if overview { shown[1] + GAP } else { 0 };
    let height = heading + label + above + crops * (crop_height + GAP) + GAP + LINE;
    let width = GAP + sheet.columns.len() as u32 * (inner + GAP);
    let mut canvas = Canvas::new([width, height], BACKGROUND);
    canvas.text(GAP, 8, width - 2 * GAP, 28.0, INK, Face::Proportional, &sheet.title);
    canvas.text(GAP, 40, width - 2 * GAP, 16.0, FAINT, Face::Proportional, &sheet.subtitle);
    for (i, column) in sheet.columns.iter().enumerate() {
        let x = GAP + i as u32 * (inner + GAP);
        let mut y = heading;
        canvas.fill(x, y, inner, 4, column.color);
        canvas.text(x, y + 7, inner, 19.0, INK, Face::Proportional, &column.title);
        for (l, line) in column.lines.iter().enumerate() {
            canvas.text(x, y + 29 + l as u32 * LINE, inner, 15.0, FAINT, Face::Monospace, line);
        }
        y += label + 2;
        let part = sheet.crop.within(column.image.size);
        if overview {
            let shown = inside(column.image.size, shown);
            canvas.paste(x, y, shown, &column.look.bytes(&fitted(&column.image, shown)), 1);
            if part.width > 0 && part.height > 0 {
                frame(&mut canvas, x, y, part, column.image.size, shown);
            }
            y += above;
        }
        let crop = column.image.crop(part);
        canvas.paste(x, y, crop.size, &column.look.bytes(&crop), sheet.enlarge);
        y += crop_height + GAP;
        if let Some(error) = &column.error {
            canvas.paste(x, y, error.size, &signed_colors(error), sheet.enlarge);
        }
    }
    let error =
        format!("error against {truth}, orange too bright, blue too dark, full at ± the mean of what it is against");
    let note = match (overview, has_error) {
        (true, true) => format!("above: the framed part, enlarged without smoothing; below: its {error}"),
        (true, false) => "below each image: the framed part, enlarged without smoothing".into(),
        (false, true) => format!("above: enlarged without smoothing; below: {error}"),
        (false, false) if sheet.enlarge > 1 => "enlarged without smoothing".into(),
        (false, false) => String::new(),
    };
    canvas.text(GAP, height - LINE - 4, width - 2 * GAP, 15.0, FAINT, Face::Proportional, &note);
    canvas
}

/// The largest size of the same proportions as `size` that fits into `room`; at least one pixel.
fn inside(size: [u32; 2], room: [u32; 2]) -> [u32; 2] {
    let [w, h] = size.map(|n| u64::from(n.max(1)));
    let [across, down] = room.map(u64::from);
    let fitted = if across * h <= down * w { [across, across * h / w] } else { [down * w / h, down] };
    fitted.map(|n| n.max(1) as u32)
}

/// The image at the size at which it is shown: averaged down, or enlarged without smoothing.
fn fitted(image: &Image, shown: [u32; 2]) -> Image {
    if image.size[0] >= shown[0] && image.size[1] >= shown[1] {
        return image.resampled(shown);
    }
    let mut out = Image::black(shown);
    for y in 0..shown[1] {
        for x in 0..shown[0] {
            let from = |i: u32, n: u32, m: u32| (u64::from(i) * u64::from(n) / u64::from(m)) as u32;
            out.pixels[(y * shown[0] + x) as usize] =
                image.at(from(x, image.size[0], shown[0]), from(y, image.size[1], shown[1]));
        }
    }
    out
}

/// The crop's outline on the shown image.
fn frame(canvas: &mut Canvas, x: u32, y: u32, crop: Rect, size: [u32; 2], shown: [u32; 2]) {
    let scale = |v: u32, axis: usize| (u64::from(v) * u64::from(shown[axis]) / u64::from(size[axis])) as u32;
    let (left, top) = (x + scale(crop.x, 0), y + scale(crop.y, 1));
    let (w, h) = (scale(crop.width, 0).max(2), scale(crop.height, 1).max(2));
    canvas.fill(left, top, w, 1, FRAME);
    canvas.fill(left, top + h - 1, w, 1, FRAME);
    canvas.fill(left, top, 1, h, FRAME);
    canvas.fill(left + w - 1, top, 1, h, FRAME);
}

/// `image - truth` over the truth's mean, for [`Column::error`]; 0 for a black truth. Both have the same size.
pub fn signed_error(image: &Image, truth: &Image) -> Image {
    // In 64 bits: sums and differences of the largest numbers are none in 32.
    let sum: f64 = truth.pixels.iter().map(|p| p.as_dvec3().element_sum()).sum();
    let mean = sum / (3 * truth.pixels.len().max(1)) as f64;
    let scale = if mean > 0.0 { 1.0 / mean } else { 0.0 };
    let largest = DVec3::splat(f64::from(f32::MAX));
    let error = |x: Rgb, t: Rgb| ((x.as_dvec3() - t.as_dvec3()) * scale).clamp(-largest, largest).as_vec3();
    Image { size: image.size, pixels: image.pixels.iter().zip(&truth.pixels).map(|(x, t)| error(*x, *t)).collect() }
}

/// Signed values in [-1, 1] as blue, grey, orange.
fn signed_colors(error: &Image) -> Vec<u8> {
    error
        .pixels
        .iter()
        .flat_map(|p| {
            // Each channel first: a sum of the largest numbers of both signs is none.
            let e = luminance(p.clamp(Rgb::splat(-1e6), Rgb::splat(1e6))).clamp(-1.0, 1.0);
            let to: [f32; 3] = if e > 0.0 { [255.0, 150.0, 30.0] } else { [60.0, 150.0, 255.0] };
            let t = e.abs();
            [0, 1, 2].map(|i| (40.0 * (1.0 - t) + to[i] * t + 0.5) as u8)
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::export::tone::ToneMap;
    use glam::Vec3;

    fn sheet(error: bool) -> Canvas {
        let column = |title: &str| Column {
            title: title.into(),
            lines: vec!["1.0 s".into()],
            color: PALETTE[0],
            image: Image { size: [32, 32], pixels: vec![Vec3::splat(0.5); 1024] },
            look: Look::Tone(ToneMap::srgb(1.0)),
            error: error.then(|| Image::black([16, 12])),
        };
        draw(&Sheet {
            title: "t".into(),
            subtitle: "s".into(),
            columns: vec![column("a"), column("b")],
            crop: Rect { x: 4, y: 4, width: 16, height: 12 },
            enlarge: 3,
        })
    }

    #[test]
    fn columns_stand_side_by_side() {
        let canvas = sheet(true);
        assert_eq!(canvas.size[0], 12 + 2 * (48 + 12));
        assert!(canvas.size[1] > sheet(false).size[1]);
        assert_eq!(canvas.rgb.len(), 3 * (canvas.size[0] * canvas.size[1]) as usize);
    }

    #[test]
    fn signs_have_their_colours() {
        let error = Image { size: [3, 1], pixels: vec![Vec3::splat(-2.0), Vec3::ZERO, Vec3::splat(2.0)] };
        assert_eq!(signed_colors(&error), [60, 150, 255, 40, 40, 40, 255, 150, 30]);
    }

    #[test]
    fn images_of_any_size_keep_their_proportions() {
        assert_eq!(inside([32, 32], [48, 48]), [48, 48]);
        assert_eq!(inside([64, 16], [48, 48]), [48, 12]);
        assert_eq!(inside([16, 64], [48, 48]), [12, 48]);
        assert_eq!(inside([1, 1000], [10, 10]), [1, 10]);
    }
}
