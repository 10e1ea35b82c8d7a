//! Image files as linear images: EXR and PNG.

use crate::math::rgb::Rgb;
use crate::measure::{Mask, exr_header};
use crate::render::film::Image;
use crate::scene::memory;
use crate::scene::texture::srgb_to_linear;
use image::{ColorType, DynamicImage, ImageFormat, ImageReader};
use std::io::Cursor;
use std::path::{Path, PathBuf};

/// A file that cannot be read as an image; one line.
#[derive(Debug, thiserror::Error)]
#[error("{}: {why}", path.display())]
pub struct ReadError {
    /// The file.
    pub path: PathBuf,
    /// The reason.
    pub why: String,
}

/// Reads an EXR file as linear radiance, or a PNG file through the sRGB curve as values in [0, 1].
///
/// The content decides which of the two it is, not the name. Transparency is left out; so are colour profiles and gamma
/// values in a PNG.
///
/// # Errors
/// A file that is missing, is of another kind or is damaged, or a pixel that is not finite.
pub fn read(path: &Path) -> Result<Image, ReadError> {
    bytes_of(path).and_then(|bytes| decode(&bytes)).map_err(|why| ReadError { path: path.to_owned(), why })
}

/// Pixels of an image that are not finite: in some channel NaN or an infinity.
#[derive(Clone, Debug, PartialEq)]
pub struct NotFinite {
    /// Whether each pixel is one, row by row.
    pub pixels: Vec<bool>,
    /// How many there are; at least one.
    pub count: u64,
    /// Column and row of the first.
    pub first: [u32; 2],
    /// Its value.
    pub value: Rgb,
}

impl NotFinite {
    /// Those of an image; None if it has none.
    pub fn of(image: &Image) -> Option<Self> {
        let pixels: Vec<bool> = image.pixels.iter().map(|p| !p.is_finite()).collect();
        let at = pixels.iter().position(|p| *p)?;
        let count = pixels.iter().filter(|p| **p).count() as u64;
        let (at32, width) = (at as u64, u64::from(image.size[0]));
        Some(Self { pixels, count, first: [(at32 % width) as u32, (at32 / width) as u32], value: image.pixels[at] })
    }
}

impl std::fmt::Display for NotFinite {
    /// How many, where, and what; no more than a part of a line.
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        let (n, [x, y], v) = (self.count, self.first, self.value);
        let pixels = if n == 1 { "1 pixel is".into() } else { format!("{n} pixels are") };
        write!(f, "{pixels} not finite, the first at {x},{y} (R {}, G {}, B {})", v.x, v.y, v.z)
    }
}

/// An image that others are compared with, as [`read_reference`] reads it.
#[derive(Clone, Debug)]
pub struct Marked {
    /// The image; black where a pixel is not finite.
    pub image: Image,
    /// Facts that Cusp wrote into the header of an EXR file; a PNG has none.
    pub facts: Vec<(String, String)>,
    /// Pixels that are not finite in the file.
    pub not_finite: Option<NotFinite>,
}

/// As [`read`] for an image that others are compared with: pixels that are not finite are
/// made black and told of instead, so that they can be left out of all counts.
///
/// # Errors
/// As for [`read`], but for these pixels.
pub fn read_reference(path: &Path) -> Result<Marked, ReadError> {
    let both = bytes_of(path).and_then(|bytes| Ok((decode_any(&bytes)?, exr_header::facts(&bytes))));
    let (mut image, facts) = both.map_err(|why| ReadError { path: path.to_owned(), why })?;
    let odd = NotFinite::of(&image);
    if let Some(odd) = &odd {
        image.pixels.iter_mut().zip(&odd.pixels).filter(|(_, o)| **o).for_each(|(p, _)| *p = Rgb::ZERO);
    }
    Ok(Marked { image, facts, not_finite: odd })
}

/// Reads a mask: pixels of 50 % grey and brighter count.
///
/// # Errors
/// A file that is missing, is neither EXR nor PNG, or is damaged.
pub fn read_mask(path: &Path) -> Result<Mask, ReadError> {
    bytes_of(path).and_then(|bytes| decode_mask(&bytes)).map_err(|why| ReadError { path: path.to_owned(), why })
}

/// As [`read`], from the bytes of a file.
///
/// # Errors
/// As for [`read`], without the file's name.
pub fn decode(bytes: &[u8]) -> Result<Image, String> {
    let image = decode_any(bytes)?;
    match NotFinite::of(&image) {
        Some(odd) => Err(format!("{odd}; mend the image first")),
        None => Ok(image),
    }
}

/// As [`decode`], whatever its pixels are.
fn decode_any(bytes: &[u8]) -> Result<Image, String> {
    let (decoded, format) = load(bytes)?;
    Ok(match format {
        ImageFormat::Png => from_srgb(&decoded),
        _ => {
            let rgb = decoded.to_rgb32f();
            Image { size: [rgb.width(), rgb.height()], pixels: rgb.pixels().map(|p| p.0.into()).collect() }
        }
    })
}

/// As [`read_mask`], from the bytes of a file.
///
/// # Errors
/// As for [`read_mask`], without the file's name.
pub fn decode_mask(bytes: &[u8]) -> Result<Mask, String> {
    let grey = load(bytes)?.0.to_luma8();
    Ok(Mask { size: [grey.width(), grey.height()], counts: grey.pixels().map(|p| p.0[0] >= 128).collect() })
}

fn bytes_of(path: &Path) -> Result<Vec<u8>, String> {
    let system = |e: std::io::Error| match e.kind() {
        std::io::ErrorKind::NotFound => "no such file".into(),
        _ => e.to_string(),
    };
    // A device or a pipe may never end.
    let about = std::fs::metadata(path).map_err(system)?;
    if !about.is_file() {
        return Err("is no plain file".into());
    }
    memory::check(format!("its {} bytes", about.len()), about.len(), "give a smaller file")
        .map_err(|e| e.to_string())?;
    std::fs::read(path).map_err(system)
}

fn load(bytes: &[u8]) -> Result<(DynamicImage, ImageFormat), String> {
    let format = match image::guess_format(bytes) {
        Ok(format @ (ImageFormat::Png | ImageFormat::OpenExr)) => format,
        _ => return Err("is neither an EXR nor a PNG file".into()),
    };
    let one_line = |e: image::ImageError| e.to_string().split_whitespace().collect::<Vec<_>>().join(" ");
    let reader = || ImageReader::with_format(Cursor::new(bytes), format);
    let (width, height) = reader().into_dimensions().map_err(one_line)?;
    // Four channels of 32 bits as it is decoded, then three of them twice.
    let needed = memory::bytes(u64::from(width) * u64::from(height), 4 * size_of::<f32>() + 2 * size_of::<Rgb>());
    memory::check(format!("{width}x{height} pixels"), needed, "give a smaller image").map_err(|e| e.to_string())?;
    let mut reader = reader();
    // The library's own limit is lower than the largest image that can be rendered.
    reader.no_limits();
    Ok((reader.decode().map_err(one_line)?, format))
}

/// Eight bits keep their exact table; more bits are decoded one by one.
fn from_srgb(image: &DynamicImage) -> Image {
    let size = [image.width(), image.height()];
    let pixels = match image.color() {
        ColorType::L8 | ColorType::La8 | ColorType::Rgb8 | ColorType::Rgba8 => {
            let table: Vec<f32> = (0..256).map(|i| srgb_to_linear(i as f32 / 255.0)).collect();
            image.to_rgb8().pixels().map(|p| Rgb::from_array(p.0.map(|c| table[usize::from(c)]))).collect()
        }
        _ => {
            let linear = |c: u16| srgb_to_linear(f32::from(c) / 65535.0);
            image.to_rgb16().pixels().map(|p| Rgb::from_array(p.0.map(linear))).collect()
        }
    };
    Image { size, pixels }
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::{ImageBuffer, Luma, Rgb as Pixel};

    fn encoded(image: &DynamicImage, format: ImageFormat) -> Vec<u8> {
        let mut bytes = Cursor::new(Vec::new());
        image.write_to(&mut bytes, format).expect("encodes");
        bytes.into_inner()
    }

    #[test]
    fn a_png_is_decoded_from_srgb() {
        let eight = DynamicImage::ImageRgb8(ImageBuffer::from_pixel(2, 1, Pixel([0, 128, 255])));
        let image = decode(&encoded(&eight, ImageFormat::Png)).expect("a PNG");
        assert_eq!(image.size, [2, 1]);
        let p = image.at(1, 0);
        // IEC 61966-2-1: 128/255 is 0.2158605 of white.
        assert!(p.x == 0.0 && (p.y - 0.215_860_5).abs() < 1e-6 && p.z == 1.0, "{p}");
        let sixteen = DynamicImage::ImageLuma16(ImageBuffer::from_pixel(1, 1, Luma([128 * 257])));
        assert_eq!(decode(&encoded(&sixteen, ImageFormat::Png)).expect("a PNG").at(0, 0).x, p.y);
    }

    #[test]
    fn an_exr_keeps_its_values_and_must_be_finite() {
        let exr = |v: f32| {
            let mut buffer = ImageBuffer::from_pixel(3, 2, Pixel([-1.5, 1e-20, 4e5f32]));
            buffer.put_pixel(1, 1, Pixel([0.0, v, 0.0]));
            encoded(&DynamicImage::ImageRgb32F(buffer), ImageFormat::OpenExr)
        };
        let image = decode(&exr(2.0)).expect("an EXR");
        assert_eq!((image.at(0, 0).to_array(), image.at(1, 1).y), ([-1.5, 1e-20, 4e5], 2.0));
        for odd in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
            let why = decode(&exr(odd)).expect_err("not finite");
            assert!(why.starts_with("1 pixel is not finite, the first at 1,1 (R 0, G "), "{why}");
        }
    }

    #[test]
    fn what_is_no_image_is_refused_in_one_line() {
        let png = encoded(&DynamicImage::new_rgb8(40, 40), ImageFormat::Png);
        for bytes in [&b""[..], b"P6 1 1 255 abc", &png[..png.len() / 2], &[0x76, 0x2f, 0x31, 0x01, 2, 0, 0, 0]] {
            let why = decode(bytes).expect_err("no image");
            assert!(!why.is_empty() && !why.contains('\n'), "{why}");
        }
        let error = read(Path::new("nowhere/a.exr")).expect_err("missing");
        assert_eq!(error.to_string(), "nowhere/a.exr: no such file");
    }

    #[test]
    fn bright_pixels_of_a_mask_count() {
        let grey = DynamicImage::ImageLuma8(ImageBuffer::from_fn(2, 1, |x, _| Luma([if x == 0 { 127 } else { 128 }])));
        assert_eq!(decode_mask(&encoded(&grey, ImageFormat::Png)).expect("a PNG").counts, [false, true]);
    }
}
