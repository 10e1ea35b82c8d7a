//! Plots with logarithmic axes, drawn into a canvas with the fonts of the workbench.

use crate::export::text::{Canvas, Face};
use plotters::prelude::*;
use plotters::style::{FontStyle, register_font};
use std::ops::Range;
use std::sync::OnceLock;

/// Values over a rising x, all positive.
#[derive(Clone, Debug, Default)]
pub struct Series {
    /// Name in the legend.
    pub name: String,
    /// Colour.
    pub color: [u8; 3],
    /// Points of the line; what is not positive and finite is left out.
    pub line: Vec<(f64, f64)>,
    /// `(x, low, high)` of the band about the line; empty for none.
    pub band: Vec<(f64, f64, f64)>,
    /// Whether the line is dashed.
    pub dashed: bool,
    /// Whether its points are marked.
    pub marks: bool,
}

/// A level that goes through the whole plot.
#[derive(Clone, Debug)]
pub struct Level {
    /// What it is.
    pub name: String,
    /// Where; must be positive.
    pub y: f64,
}

/// One pair of axes.
#[derive(Clone, Debug, Default)]
pub struct Axes {
    /// Heading.
    pub title: String,
    /// What is along x, with unit.
    pub x: String,
    /// What is along y, with unit.
    pub y: String,
    /// Curves.
    pub series: Vec<Series>,
    /// Levels.
    pub levels: Vec<Level>,
}

/// A picture of one or several pairs of axes side by side, with one legend for the names of the first.
#[derive(Clone, Debug, Default)]
pub struct Plot {
    /// Heading.
    pub title: String,
    /// Line below it.
    pub subtitle: String,
    /// The axes.
    pub axes: Vec<Axes>,
}

/// Colours that differ on white for all eyes (after Okabe and Ito 2008, the yellow darker), by place in a list.
pub const INKS: [[u8; 3]; 8] = [
    [0, 114, 178],
    [213, 94, 0],
    [0, 158, 115],
    [204, 121, 167],
    [150, 120, 0],
    [86, 180, 233],
    [230, 159, 0],
    [90, 90, 90],
];

/// Colour of the series at that place in a list.
pub fn ink(i: usize) -> [u8; 3] {
    INKS[i % INKS.len()]
}

const PAPER: [u8; 3] = [255; 3];
const INK: [u8; 3] = [30; 3];
const FAINT: [u8; 3] = [110; 3];
const AXES: [u32; 2] = [620, 470];
const HEADING: u32 = 58;
const LINE: u32 = 20;
const LEGEND: u32 = 400;
/// Height of the heading of a pair of axes, pixels.
const TITLE: u32 = 30;
const FAMILY: &str = "cusp";

/// Draws a plot.
///
/// # Errors
/// A defect of the drawing library, in one line.
pub fn draw(plot: &Plot) -> Result<Canvas, String> {
    let names = plot.axes.first().map_or(0, |a| a.series.len() + a.levels.len()) as u32;
    let height = HEADING + AXES[1].max((names + 1) * LINE);
    let mut canvas = Canvas::new([AXES[0] * plot.axes.len() as u32 + LEGEND, height], PAPER);
    let width = canvas.size[0] - 24;
    canvas.text(14, 8, width, 24.0, INK, Face::Proportional, &plot.title);
    canvas.text(14, 36, width, 15.0, FAINT, Face::Proportional, &plot.subtitle);
    for (i, axes) in plot.axes.iter().enumerate() {
        let rgb = draw_axes(axes)?;
        let x = AXES[0] * i as u32;
        canvas.paste(x, HEADING, AXES, &rgb, 1);
        canvas.text(x + 84, HEADING + 6, AXES[0] - 90, 17.0, INK, Face::Proportional, &axes.title);
    }
    if let Some(first) = plot.axes.first() {
        legend(&mut canvas, AXES[0] * plot.axes.len() as u32 + 8, first);
    }
    Ok(canvas)
}

/// Names with the lines that they belong to.
fn legend(canvas: &mut Canvas, x: u32, axes: &Axes) {
    let mut y = HEADING + 26;
    let mut entry = |color: [u8; 3], dashed: bool, name: &str| {
        for dash in 0..if dashed { 3 } else { 1 } {
            canvas.fill(x + dash * 10, y + 8, if dashed { 6 } else { 26 }, 3, color);
        }
        canvas.text(x + 34, y, LEGEND - 50, 15.0, INK, Face::Proportional, name);
        y += LINE;
    };
    axes.series.iter().for_each(|s| entry(s.color, s.dashed, &s.name));
    axes.levels.iter().for_each(|l| entry(FAINT, true, &l.name));
}

/// One pair of axes as bytes of [`AXES`] pixels.
fn draw_axes(axes: &Axes) -> Result<Vec<u8>, String> {
    static FONT: OnceLock<bool> = OnceLock::new();
    let registered =
        *FONT.get_or_init(|| register_font(FAMILY, FontStyle::Normal, epaint_default_fonts::UBUNTU_LIGHT).is_ok());
    if !registered {
        return Err("the built-in font cannot be read".into());
    }
    let mut rgb = vec![255; 3 * (AXES[0] * AXES[1]) as usize];
    let [xs, ys] = ranges(axes);
    {
        let area = BitMapBackend::with_buffer(&mut rgb, (AXES[0], AXES[1])).into_drawing_area();
        paint(&area, axes, xs, ys).map_err(|e| format!("plot: {e}"))?;
    }
    Ok(rgb)
}

type Area<'a> = DrawingArea<BitMapBackend<'a>, plotters::coord::Shift>;
type Wrong<'a> = DrawingAreaErrorKind<<BitMapBackend<'a> as DrawingBackend>::ErrorType>;

fn paint<'a>(area: &Area<'a>, axes: &Axes, xs: Range<f64>, ys: Range<f64>) -> Result<(), Wrong<'a>> {
    let rgb = |c: [u8; 3]| RGBColor(c[0], c[1], c[2]);
    let mut chart = ChartBuilder::on(area)
        .margin_top(TITLE)
        .margin_left(8)
        .margin_right(16)
        .x_label_area_size(46)
        .y_label_area_size(74)
        .build_cartesian_2d(xs.clone().log_scale(), ys.log_scale())?;
    chart
        .configure_mesh()
        .x_desc(&axes.x)
        .y_desc(&axes.y)
        .label_style((FAMILY, 15))
        .axis_desc_style((FAMILY, 16))
        .bold_line_style(rgb([205; 3]))
        .light_line_style(TRANSPARENT)
        .x_label_formatter(&|v| number(*v))
        .y_label_formatter(&|v| number(*v))
        .draw()?;
    for level in axes.levels.iter().filter(|l| l.y > 0.0) {
        chart.draw_series(DashedLineSeries::new(
            [(xs.start, level.y), (xs.end, level.y)],
            5,
            5,
            rgb(FAINT).stroke_width(1),
        ))?;
    }
    for series in &axes.series {
        let color = rgb(series.color);
        let band: Vec<_> =
            series.band.iter().filter(|(x, low, high)| usable(*x) && usable(*low) && usable(*high)).collect();
        if band.len() > 1 {
            let outline: Vec<(f64, f64)> =
                band.iter().map(|b| (b.0, b.1)).chain(band.iter().rev().map(|b| (b.0, b.2))).collect();
            chart.draw_series([Polygon::new(outline, color.mix(0.16))])?;
        }
        let line: Vec<(f64, f64)> = series.line.iter().copied().filter(|(x, y)| usable(*x) && usable(*y)).collect();
        if series.dashed {
            chart.draw_series(DashedLineSeries::new(line.iter().copied(), 6, 4, color.stroke_width(2)))?;
        } else {
            chart.draw_series(LineSeries::new(line.iter().copied(), color.stroke_width(2)))?;
        }
        if series.marks {
            chart.draw_series(line.iter().map(|p| Circle::new(*p, 3, color.filled())))?;
        }
    }
    area.present()
}

fn usable(x: f64) -> bool {
    x > 0.0 && x.is_finite()
}

/// Ranges that hold all that can be drawn, a little wider; a decade about 1 for nothing.
fn ranges(axes: &Axes) -> [Range<f64>; 2] {
    let mut x = (f64::INFINITY, 0.0f64);
    let mut y = x;
    let grow = |range: &mut (f64, f64), v: f64| {
        if usable(v) {
            *range = (range.0.min(v), range.1.max(v));
        }
    };
    for s in &axes.series {
        for &(px, py) in s.line.iter().filter(|p| usable(p.0) && usable(p.1)) {
            grow(&mut x, px);
            grow(&mut y, py);
        }
        for &(px, low, high) in s.band.iter().filter(|b| usable(b.0)) {
            grow(&mut x, px);
            grow(&mut y, low);
            grow(&mut y, high);
        }
    }
    axes.levels.iter().for_each(|l| grow(&mut y, l.y));
    let around = |(low, high): (f64, f64)| {
        if low > high {
            return 0.3..3.0;
        }
        // At least half a decade, so that a single point stands in the middle.
        let widen = (0.5 * libm::log10(10.0f64.sqrt() / (high / low))).max(0.06);
        low * libm::exp10(-widen)..high * libm::exp10(widen)
    };
    [around(x), around(y)]
}

/// A label of a logarithmic axis.
fn number(x: f64) -> String {
    if (1e-3..1e5).contains(&x.abs()) {
        let text = format!("{x:.4}");
        text.trim_end_matches('0').trim_end_matches('.').to_owned()
    } else {
        format!("{x:.0e}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plot(line: Vec<(f64, f64)>) -> Plot {
        let series = Series { name: "a".into(), color: [200, 0, 0], line, marks: true, ..Default::default() };
        let axes = Axes { series: vec![series], ..Default::default() };
        Plot { axes: vec![axes], ..Default::default() }
    }

    fn reds(canvas: &Canvas) -> Vec<(u32, u32)> {
        let [w, _] = canvas.size;
        let inside = |i: u32| i % w < AXES[0];
        let red = |p: &[u8]| p[0] > 190 && p[1] < 30;
        let all = canvas.rgb.chunks(3).zip(0u32..).filter(|(p, i)| red(p) && inside(*i));
        all.map(|(_, i)| (i % w, i / w)).collect()
    }

    /// Three points of a power law lie on a straight line, evenly spaced.
    #[test]
    fn powers_are_straight() {
        let canvas = draw(&plot(vec![(1.0, 100.0), (10.0, 10.0), (100.0, 1.0)])).expect("draws");
        let points = reds(&canvas);
        let (left, right) = (points.iter().min().expect("ink"), points.iter().max().expect("ink"));
        let middle = [(left.0 + right.0) / 2, (left.1 + right.1) / 2];
        assert!(left.1 < right.1, "it falls");
        assert!(points.iter().any(|p| p.0.abs_diff(middle[0]) <= 2 && p.1.abs_diff(middle[1]) <= 3));
    }

    #[test]
    fn what_cannot_be_drawn_is_left_out() {
        for line in [vec![], vec![(1.0, 1.0)], vec![(0.0, 1.0), (1.0, f64::NAN), (f64::INFINITY, 2.0), (1.0, -1.0)]] {
            let canvas = draw(&plot(line)).expect("draws");
            assert_eq!(canvas.rgb.len(), 3 * (canvas.size[0] * canvas.size[1]) as usize);
        }
        assert!(draw(&Plot::default()).is_ok());
        assert_eq!(ranges(&Axes::default()), [0.3..3.0, 0.3..3.0]);
    }

    #[test]
    fn labels_are_short() {
        assert_eq!([0.05, 1.0, 20.0, 1e-4, 1e6].map(number), ["0.05", "1", "20", "1e-4", "1e6"]);
    }
}
