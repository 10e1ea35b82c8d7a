//! `cusp diff`: every metric of an image against a reference, and the difference image.

use crate::cli::failure::Failure;
use crate::cli::flags::{check_crop, rect};
use crate::cli::table::Table;
use crate::cli::{print, to_json};
use crate::export::false_color::{ColorMap, FalseColor, LABEL, ValueRange, color_bar, label};
use crate::export::provenance::command_line;
use crate::export::text::Canvas;
use crate::export::whole_file::WriteError;
use crate::export::{exr_file, png_file};
use crate::math::rgb::Rgb;
use crate::measure::difference::{channels, difference, quantile_range};
use crate::measure::flip::{Flip, FlipView, MAX_STOPS, PIXELS_PER_DEGREE, exposure_factor, flip};
use crate::measure::image_file::NotFinite;
use crate::measure::metrics::compare;
use crate::measure::{Difference, ErrorMetrics, Mask, image_file};
use crate::render::film::{Image, Rect};
use clap::builder::PossibleValue;
use clap::{Args, ValueEnum};
use serde::Serialize;
use std::path::{Path, PathBuf};

/// Flags of `diff`.
#[derive(Debug, Args)]
pub struct DiffArgs {
    /// The image: EXR (linear radiance), or PNG (decoded from sRGB to linear, white is 1)
    image: PathBuf,
    /// What it is compared with: EXR or PNG of the same size
    reference: PathBuf,
    /// Pixels that count: those of 50 % grey and brighter (PNG)
    #[arg(long, value_name = "M.png")]
    mask: Option<PathBuf>,
    /// Part that counts and is written: x,y,width,height
    #[arg(long, value_name = "X,Y,W,H", value_parser = rect)]
    crop: Option<Rect>,
    /// For FLIP: stops by which both images are made brighter before they are clamped to [0, 1]
    #[arg(long, value_name = "STOPS", default_value_t = 0.0, allow_negative_numbers = true)]
    exposure: f32,
    /// The difference image: .png (false colour, with a bar) or .exr (values of each channel)
    #[arg(short = 'o', long = "output", value_name = "FILE")]
    output: Option<PathBuf>,
    /// What the difference image shows
    #[arg(long, value_enum, default_value = "signed", requires = "output")]
    show: Difference,
    /// Value at the end of the PNG's colours; 1 for flip and the 99 % quantile for the others, if left out
    #[arg(long, value_name = "V", requires = "output", allow_negative_numbers = true)]
    range: Option<f32>,
    /// Print JSON instead of a table
    #[arg(long)]
    json: bool,
    /// Print nothing but errors
    #[arg(long)]
    quiet: bool,
}

impl ValueEnum for Difference {
    fn value_variants<'a>() -> &'a [Self] {
        &Self::ALL
    }

    fn to_possible_value(&self) -> Option<PossibleValue> {
        let help = match self {
            Self::Signed => "Image less reference",
            Self::Absolute => "Its absolute value",
            Self::Relative => "Image less reference, over the reference's absolute value and 1 % of its mean",
            Self::Flip => "FLIP, in 0 to 1",
        };
        Some(PossibleValue::new(self.name()).help(help))
    }
}

/// What `--json` prints.
#[derive(Debug, Serialize)]
struct DiffReport<'a> {
    version: &'static str,
    command: String,
    image: &'a Path,
    reference: &'a Path,
    size: [u32; 2],
    crop: Option<Rect>,
    mask: Option<&'a Path>,
    /// Pixels left out because they are not finite, in the image and in the reference.
    not_finite: [u64; 2],
    metrics: ErrorMetrics,
    flip: FlipReport,
    difference: Option<DifferenceFile<'a>>,
}

/// FLIP over the pixels that count.
#[derive(Debug, Serialize)]
struct FlipReport {
    mean: f64,
    exposure: f32,
    pixels_per_degree: f64,
    /// Part of the reference's pixels with a channel that is brighter than white.
    clipped: f64,
}

/// The difference image that was written.
#[derive(Debug, Serialize)]
struct DifferenceFile<'a> {
    file: &'a Path,
    kind: Difference,
    unit: &'static str,
    /// None for an EXR, which holds values.
    colors: Option<Colors>,
}

#[derive(Clone, Copy, Debug, Serialize)]
struct Colors {
    map: ColorMap,
    range: ValueRange,
}

/// Compares.
///
/// # Errors
/// A wrong call, a file that cannot be read, images of different sizes, or a file that cannot be written.
pub fn run(args: &DiffArgs) -> Result<(), Failure> {
    check(args)?;
    let pair = Pair::read(args)?;
    let metrics = compare(&pair.image, &pair.reference, &pair.mask).map_err(Failure::Call)?;
    let flip = flip(&pair.image, &pair.reference, FlipView::exposed(args.exposure)).map_err(Failure::Call)?;
    let mean = flip.mean(&pair.mask).ok_or_else(|| Failure::Call("the mask leaves no pixel".into()))?;
    let difference = match &args.output {
        Some(path) => Some(pair.write(args, path, flip)?),
        None => None,
    };
    let report = DiffReport {
        version: env!("CARGO_PKG_VERSION"),
        command: command_line(),
        image: &args.image,
        reference: &args.reference,
        size: pair.image.size,
        crop: args.crop,
        mask: args.mask.as_deref(),
        not_finite: pair.not_finite,
        metrics,
        flip: FlipReport {
            mean,
            exposure: args.exposure,
            pixels_per_degree: PIXELS_PER_DEGREE,
            clipped: clipped(&pair.reference, &pair.mask, args.exposure),
        },
        difference,
    };
    if args.json {
        print(&to_json(&report)?)
    } else if args.quiet {
        Ok(())
    } else {
        for warning in &pair.warnings {
            eprintln!("warning: {warning}");
        }
        print(&text(&report))
    }
}

/// Checks what needs no file.
fn check(args: &DiffArgs) -> Result<(), Failure> {
    if !(-MAX_STOPS..=MAX_STOPS).contains(&args.exposure) {
        return Err(Failure::Call(format!("--exposure: must lie in -{MAX_STOPS} to {MAX_STOPS} stops")));
    }
    if args.range.is_some_and(|r| !(r > 0.0 && r.is_finite())) {
        return Err(Failure::Call("--range: must be positive".into()));
    }
    match &args.output {
        Some(path) if !has_ending(path, "png") && !has_ending(path, "exr") => {
            Err(Failure::Call(format!("-o {}: end the name in .exr or .png", path.display())))
        }
        _ => Ok(()),
    }
}

fn has_ending(path: &Path, ending: &str) -> bool {
    path.extension().is_some_and(|e| e.eq_ignore_ascii_case(ending))
}

/// Two images of the same size and the pixels of them that count.
struct Pair {
    image: Image,
    reference: Image,
    mask: Mask,
    /// Pixels of each that are not finite. They are black in both, and do not count.
    not_finite: [u64; 2],
    warnings: Vec<String>,
}

impl Pair {
    fn read(args: &DiffArgs) -> Result<Self, Failure> {
        let read = |path| image_file::read_reference(path).map_err(|e| Failure::Call(e.to_string()));
        let (read_image, read_reference) = (read(&args.image)?, read(&args.reference)?);
        let (odd, odd_reference) = (read_image.not_finite, read_reference.not_finite);
        let (mut image, mut reference) = (read_image.image, read_reference.image);
        same_size(&args.image, image.size, &args.reference, reference.size)?;
        let mut mask = match &args.mask {
            Some(path) => image_file::read_mask(path).map_err(|e| Failure::Call(e.to_string()))?,
            None => Mask::all(image.size),
        };
        if let Some(path) = &args.mask {
            same_size(path, mask.size, &args.image, image.size)?;
        }
        if let Some(crop) = args.crop {
            check_crop(crop, image.size)?;
            mask = mask.within(crop);
        }
        let mut warnings = Vec::new();
        let mut leave_out = |path: &Path, odd: Option<NotFinite>| {
            let Some(odd) = odd else { return 0 };
            mask.leave_out(&odd.pixels);
            let pixels = image.pixels.iter_mut().zip(&mut reference.pixels).zip(&odd.pixels);
            pixels.filter(|(_, out)| **out).for_each(|((a, b), _)| (*a, *b) = (Rgb::ZERO, Rgb::ZERO));
            warnings.push(format!("{}: {odd}; left out", path.display()));
            odd.count
        };
        let not_finite = [leave_out(&args.image, odd), leave_out(&args.reference, odd_reference)];
        Ok(Self { image, reference, mask, not_finite, warnings })
    }

    /// Writes the difference image, of the crop if there is one.
    fn write<'a>(&self, args: &DiffArgs, path: &'a Path, flip: Flip) -> Result<DifferenceFile<'a>, Failure> {
        let part = args.crop.unwrap_or(Rect::whole(self.image.size));
        let kind = args.show;
        let mut facts = vec![
            ("cusp.version", env!("CARGO_PKG_VERSION").to_owned()),
            ("cusp.command", command_line()),
            ("cusp.difference", kind.name().to_owned()),
        ];
        let colors = if has_ending(path, "exr") {
            let values = channels(kind, &self.image, &self.reference, args.exposure).map_err(Failure::Call)?.crop(part);
            exr_file::write_with(path, &values, &facts)?;
            None
        } else {
            let values = match kind {
                Difference::Flip => flip.map,
                _ => difference(kind, &self.image, &self.reference, args.exposure).map_err(Failure::Call)?,
            };
            let colors = colors(kind, args.range, &values, &self.mask);
            facts.push(("cusp.range", in_words(kind, colors, |v| v.to_string())));
            self.write_png(path, part, &values, colors, &facts)?;
            Some(colors)
        };
        Ok(DifferenceFile { file: path, kind, unit: kind.unit(), colors })
    }

    /// The values in false colour, pixels that do not count in grey, and a bar below.
    fn write_png(
        &self,
        path: &Path,
        part: Rect,
        values: &[f32],
        colors: Colors,
        facts: &[(&str, String)],
    ) -> Result<(), WriteError> {
        const BACKGROUND: [u8; 3] = [64; 3];
        const NARROWEST: u32 = 160;
        const BAR: u32 = 12;
        const GAP: u32 = 4;
        let scale = FalseColor::new(colors.map, colors.range);
        let mut rgb = Vec::new();
        for y in part.y..part.y + part.height {
            let start = y as usize * self.image.size[0] as usize + part.x as usize;
            let row = start..start + part.width as usize;
            for (value, counts) in values[row.clone()].iter().zip(&self.mask.counts[row]) {
                rgb.extend(if *counts { scale.color(*value) } else { BACKGROUND });
            }
        }
        let width = part.width.max(NARROWEST);
        let mut canvas = Canvas::new([width, part.height + GAP + BAR + 2 + LABEL], BACKGROUND);
        canvas.paste(0, 0, [part.width, part.height], &rgb, 1);
        color_bar(&mut canvas, [0, part.height + GAP], [width, BAR], &scale, [235; 3]);
        png_file::write_with(path, canvas.size, &canvas.rgb, facts)
    }
}

fn same_size(a: &Path, [aw, ah]: [u32; 2], b: &Path, [bw, bh]: [u32; 2]) -> Result<(), Failure> {
    if [aw, ah] == [bw, bh] {
        return Ok(());
    }
    Err(Failure::Call(format!(
        "{} has {aw}x{ah} pixels, {} has {bw}x{bh}; give images of the same size",
        a.display(),
        b.display()
    )))
}

/// A diverging scale about 0 for what has a sign, else a sequential one from 0.
fn colors(kind: Difference, range: Option<f32>, values: &[f32], mask: &Mask) -> Colors {
    let high = range.unwrap_or_else(|| match kind {
        Difference::Flip => 1.0,
        _ => quantile_range(values, &mask.counts),
    });
    if kind.is_signed() {
        Colors { map: ColorMap::Diverging, range: ValueRange::around_zero(high) }
    } else {
        Colors { map: ColorMap::Inferno, range: ValueRange::up_to(high) }
    }
}

/// Range, unit and scale.
fn in_words(kind: Difference, colors: Colors, number: fn(f32) -> String) -> String {
    let (low, high) = (number(colors.range.low), number(colors.range.high));
    let space = if kind.unit().is_empty() { "" } else { " " };
    format!("{low} to {high}{space}{}, {}", kind.unit(), colors.map.name())
}

/// Part of the pixels that count in which a channel is above 1 at that exposure.
fn clipped(image: &Image, mask: &Mask, exposure: f32) -> f64 {
    let factor = exposure_factor(exposure);
    let counted = || image.pixels.iter().zip(&mask.counts).filter(|(_, c)| **c);
    let bright = counted().filter(|(p, _)| f64::from(p.max_element()) * factor > 1.0).count();
    bright as f64 / counted().count().max(1) as f64
}

/// The table for people.
fn text(report: &DiffReport) -> String {
    let m = &report.metrics;
    let mut table = Table::new(["metric", "value"]);
    for (name, value) in [
        ("mse", m.mse),
        ("rmse", m.rmse),
        ("relative rmse", m.relative_rmse),
        ("relative mse", m.relative_mse),
        ("mse without worst 0.1 %", m.trimmed_mse),
        ("relative mse without worst 0.1 %", m.trimmed_relative_mse),
        ("smape", m.smape),
        ("bias", m.bias),
        ("max error", m.max_error),
        ("mean ratio", m.mean_ratio),
        ("flip", report.flip.mean),
    ] {
        table.row([name.to_owned(), number(value)]);
    }
    let place = match (report.crop, report.mask) {
        (None, None) => "all of them count".to_owned(),
        (Some(c), None) => format!("those of {},{},{},{} count", c.x, c.y, c.width, c.height),
        (None, Some(_)) => format!("{} of the mask count", m.pixels),
        (Some(c), Some(_)) => format!("{} of the mask in {},{},{},{} count", m.pixels, c.x, c.y, c.width, c.height),
    };
    let f = &report.flip;
    let mut out = format!(
        "{} against {}: {}x{} pixels, {place}\n\n{}\nflip at {} stops, {:.2} pixels per degree; {:.1} % of the reference's pixels are brighter than white there\n",
        report.image.display(),
        report.reference.display(),
        report.size[0],
        report.size[1],
        table.text(),
        f.exposure,
        f.pixels_per_degree,
        100.0 * f.clipped
    );
    if let Some(d) = &report.difference {
        let range = match d.colors {
            Some(colors) => in_words(d.kind, colors, label),
            None => "values of each channel".into(),
        };
        out.push_str(&format!("{} difference: {range}; in {}\n", d.kind.name(), d.file.display()));
    }
    out
}

/// A number as a table shows it: five significant digits or more.
fn number(x: f64) -> String {
    match x.abs() {
        0.0 => "0".into(),
        s if (0.01..1e6).contains(&s) => format!("{x:.6}"),
        _ => format!("{x:.5e}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_scale_fits_the_kind() {
        let values = [0.5, -2.0, 1.0];
        let all = Mask::all([3, 1]);
        let of = |kind, range| colors(kind, range, &values, &all);
        assert_eq!(of(Difference::Flip, None).range, ValueRange::up_to(1.0));
        assert_eq!(of(Difference::Absolute, None).range, ValueRange::up_to(1.0));
        assert_eq!(of(Difference::Signed, Some(3.0)).range, ValueRange::around_zero(3.0));
        assert_eq!(of(Difference::Relative, None).map, ColorMap::Diverging);
        assert_eq!(in_words(Difference::Flip, of(Difference::Flip, None), label), "0 to 1.00, inferno");
        let signed = in_words(Difference::Signed, of(Difference::Signed, None), |v| v.to_string());
        assert_eq!(signed, "-1 to 1 W/(m² sr), diverging");
    }

    #[test]
    fn bright_pixels_that_count_are_counted() {
        let image = Image { size: [4, 1], pixels: [0.5, 1.5, 3.0, 9.0].map(glam::Vec3::splat).to_vec() };
        let mask = Mask { size: [4, 1], counts: vec![true, true, true, false] };
        assert_eq!(clipped(&image, &mask, 0.0), 2.0 / 3.0);
        assert_eq!(clipped(&image, &mask, -1.0), 1.0 / 3.0);
        assert_eq!(clipped(&image, &mask, 2.0), 1.0);
    }

    #[test]
    fn numbers_keep_their_digits() {
        for (x, text) in [(0.0, "0"), (0.0123456789, "0.012346"), (-1.5, "-1.500000"), (1e-9, "1.00000e-9")] {
            assert_eq!(number(x), text);
        }
    }
}
