//! False colour: values as colours, and the bar that says which is which.

use crate::export::text::{Canvas, Face};

/// A scale of colours.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum ColorMap {
    /// Black, red, yellow; evenly spaced to the eye.
    #[default]
    Inferno,
    /// Violet, green, yellow; evenly spaced to the eye.
    Viridis,
    /// Black, magenta, pale yellow; evenly spaced to the eye.
    Magma,
    /// Blue, grey, yellow; the same for most who are colour-blind.
    Cividis,
    /// A rainbow of even lightness: tells many values apart.
    Turbo,
    /// Blue, near white, red: for values about a middle.
    Diverging,
}

impl ColorMap {
    /// All of them.
    pub const ALL: [Self; 6] = [Self::Inferno, Self::Viridis, Self::Magma, Self::Cividis, Self::Turbo, Self::Diverging];

    /// Its name in flags and files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Inferno => "inferno",
            Self::Viridis => "viridis",
            Self::Magma => "magma",
            Self::Cividis => "cividis",
            Self::Turbo => "turbo",
            Self::Diverging => "diverging",
        }
    }

    /// 256 sRGB colours from low to high. The middle of [`ColorMap::Diverging`] is entry 128; its entries 0 and 1 are equal.
    pub fn table(self) -> [[u8; 3]; 256] {
        std::array::from_fn(|i| {
            let t = i as f64 / 255.0;
            let color = match self {
                Self::Inferno => colorous::INFERNO.eval_continuous(t),
                Self::Viridis => colorous::VIRIDIS.eval_continuous(t),
                Self::Magma => colorous::MAGMA.eval_continuous(t),
                Self::Cividis => colorous::CIVIDIS.eval_continuous(t),
                Self::Turbo => colorous::TURBO.eval_continuous(t),
                // From red to blue there; an odd number of entries has a middle.
                Self::Diverging => colorous::RED_BLUE.eval_continuous(0.5 - (i as f64 - 128.0) / 254.0),
            };
            [color.r, color.g, color.b]
        })
    }

    /// Entry for `t` in [0, 1]; what lies outside is clamped, and no number is 0.
    fn entry(self, t: f64) -> usize {
        let t = if t > 0.0 { t.min(1.0) } else { 0.0 };
        match self {
            Self::Diverging => 1 + (254.0 * t + 0.5) as usize,
            _ => (255.0 * t + 0.5) as usize,
        }
    }
}

/// The values that the two ends of a scale stand for.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct ValueRange {
    /// Value at the left end; smaller ones have its colour.
    pub low: f32,
    /// Value at the right end; larger ones have its colour.
    pub high: f32,
}

impl ValueRange {
    /// From 0 up.
    pub fn up_to(high: f32) -> Self {
        Self { low: 0.0, high }
    }

    /// As far below 0 as above.
    pub fn around_zero(high: f32) -> Self {
        Self { low: -high, high }
    }
}

/// A scale of colours over a range of values.
#[derive(Clone, Debug)]
pub struct FalseColor {
    map: ColorMap,
    range: ValueRange,
    table: [[u8; 3]; 256],
}

impl FalseColor {
    /// A scale over a range. If `high` is not above `low`, all values have the colour of the low end, or of the middle
    /// of [`ColorMap::Diverging`].
    pub fn new(map: ColorMap, range: ValueRange) -> Self {
        Self { map, range, table: map.table() }
    }

    /// The range.
    pub fn range(&self) -> ValueRange {
        self.range
    }

    /// sRGB colour of a value; what lies outside the range has the colour of the nearer end, no number that of the low.
    pub fn color(&self, value: f32) -> [u8; 3] {
        let (low, high) = (f64::from(self.range.low), f64::from(self.range.high));
        let t = match (high > low, self.map) {
            (true, _) => (f64::from(value) - low) / (high - low),
            (false, ColorMap::Diverging) => 0.5,
            (false, _) => 0.0,
        };
        self.table[self.map.entry(t)]
    }

    /// Three bytes for each value.
    pub fn colors(&self, values: &[f32]) -> Vec<u8> {
        values.iter().flat_map(|v| self.color(*v)).collect()
    }
}

/// Height of the labels below a bar.
pub const LABEL: u32 = 15;

/// Draws a horizontal bar with its top left corner at `(x, y)`, `width` by `height` pixels, and below it, [`LABEL`]
/// pixels high, the values of its two ends. What lies outside the canvas is left out.
pub fn color_bar(canvas: &mut Canvas, [x, y]: [u32; 2], [width, height]: [u32; 2], scale: &FalseColor, ink: [u8; 3]) {
    let ValueRange { low, high } = scale.range;
    let last = width.saturating_sub(1).max(1) as f32;
    for i in 0..width {
        let t = i as f32 / last;
        canvas.fill(x + i, y, 1, height, scale.color(low * (1.0 - t) + high * t));
    }
    let below = y + height + 2;
    let size = LABEL as f32 - 2.0;
    canvas.text(x, below, width / 2, size, ink, Face::Monospace, &label(low));
    let text = label(high);
    // A letter of the fixed-width face is 0.6 of its height or less.
    let length = (0.6 * size * text.chars().count() as f32).ceil() as u32 + 1;
    canvas.text(x + width.saturating_sub(length), below, length, size, ink, Face::Monospace, &text);
}

/// A value with three significant digits.
pub fn label(value: f32) -> String {
    match value.abs() {
        0.0 => "0".into(),
        s if !(0.001..10_000.0).contains(&s) => format!("{value:.2e}"),
        s => {
            let decimals = [0.01, 0.1, 1.0, 10.0, 100.0].iter().filter(|limit| s < **limit).count();
            format!("{value:.decimals$}")
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scales_have_their_ends_and_their_middle() {
        let inferno = FalseColor::new(ColorMap::Inferno, ValueRange::up_to(2.0));
        assert_eq!(inferno.color(0.0), [0, 0, 4]);
        assert_eq!(inferno.color(2.0), [252, 255, 164]);
        assert_eq!((inferno.color(-5.0), inferno.color(f32::INFINITY)), (inferno.color(0.0), inferno.color(2.0)));
        assert_eq!(inferno.color(f32::NAN), inferno.color(0.0));
        let diverging = FalseColor::new(ColorMap::Diverging, ValueRange::around_zero(0.3));
        let [r, g, b] = diverging.color(0.0);
        assert!(r.min(g).min(b) > 230 && r.abs_diff(b) < 8, "{r} {g} {b}");
        let ([r, _, b], [r2, _, b2]) = (diverging.color(0.3), diverging.color(-0.3));
        assert!(r > b + 50 && b2 > r2 + 50, "red is too bright, blue too dark");
        let table = ColorMap::Diverging.table();
        assert_eq!(
            (table[1], table[128], table[255]),
            (diverging.color(-1.0), diverging.color(0.0), diverging.color(1.0))
        );
    }

    #[test]
    fn entries_grow_with_the_value() {
        for map in ColorMap::ALL {
            let entries: Vec<usize> = (0..=1000).map(|i| map.entry(f64::from(i) / 1000.0)).collect();
            assert!(entries.windows(2).all(|w| w[0] <= w[1]) && entries[1000] == 255, "{}", map.name());
        }
        assert_eq!(ColorMap::Diverging.entry(0.5), 128);
    }

    #[test]
    fn an_empty_range_has_one_colour() {
        for (map, entry) in [(ColorMap::Viridis, 0), (ColorMap::Diverging, 128)] {
            let scale = FalseColor::new(map, ValueRange { low: 1.0, high: 1.0 });
            assert_eq!(scale.colors(&[0.0, 5.0]), map.table()[entry].repeat(2));
        }
    }

    #[test]
    fn a_bar_runs_from_low_to_high_with_labels_below() {
        let scale = FalseColor::new(ColorMap::Viridis, ValueRange { low: -1.0, high: 3.0 });
        let mut canvas = Canvas::new([120, 40], [0; 3]);
        color_bar(&mut canvas, [10, 5], [100, 12], &scale, [255; 3]);
        let at = |x: usize, y: usize| &canvas.rgb[3 * (y * 120 + x)..][..3];
        assert_eq!((at(10, 5), at(109, 16)), (&scale.color(-1.0)[..], &scale.color(3.0)[..]));
        assert_eq!((at(9, 5), at(110, 5), at(10, 17)), (&[0; 3][..], &[0; 3][..], &[0; 3][..]));
        let ink = |from: usize, to: usize| (from..to).any(|x| (18..36).any(|y| at(x, y)[0] > 100));
        assert!(ink(10, 50) && ink(75, 111) && !ink(52, 70));
        // Nothing of this reaches outside, however small the canvas is.
        color_bar(&mut Canvas::new([3, 2], [0; 3]), [1, 1], [40, 9], &scale, [255; 3]);
        color_bar(&mut canvas, [0, 0], [0, 0], &scale, [255; 3]);
    }

    #[test]
    fn labels_have_three_digits() {
        for (value, text) in
            [(0.0, "0"), (-0.1234, "-0.123"), (0.01234, "0.0123"), (12.34, "12.3"), (567.8, "568"), (1e-7, "1.00e-7")]
        {
            assert_eq!(label(value), text);
        }
    }
}
