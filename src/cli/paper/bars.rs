//! Horizontal bars with their numbers.

use crate::export::text::{Canvas, Face};

const GROUND: [u8; 3] = [64; 3];
const INK: [u8; 3] = [235; 3];
const FAINT: [u8; 3] = [175; 3];
const MARGIN: u32 = 14;
const LINE: u32 = 24;
const BAR: u32 = 16;

/// A part of a bar.
pub struct Segment {
    /// Its length in the chart's unit; below 0 counts as 0.
    pub value: f64,
    /// Its colour.
    pub color: [u8; 3],
}

/// A line of a chart.
pub struct Bar {
    /// On the left; a bar without segments is a heading.
    pub label: String,
    /// From left to right.
    pub segments: Vec<Segment>,
    /// On the right of the bar.
    pub number: String,
}

/// What a chart shows.
pub struct Chart {
    /// Heading.
    pub title: String,
    /// Line below it.
    pub subtitle: String,
    /// Names of colours.
    pub legend: Vec<(String, [u8; 3])>,
    /// From top to bottom.
    pub bars: Vec<Bar>,
    /// Line at the bottom.
    pub note: String,
}

/// Draws a chart `width` pixels wide, whose longest bar fills the room between labels and numbers.
pub fn draw(chart: &Chart, width: u32) -> Canvas {
    let (label, number) = (330.min(width / 3), 190.min(width / 4));
    let room = width.saturating_sub(2 * MARGIN + label + number).max(1);
    let total = |b: &Bar| b.segments.iter().map(|s| s.value.max(0.0)).sum::<f64>();
    let longest = chart.bars.iter().map(total).fold(0.0, f64::max);
    let scale = if longest > 0.0 { f64::from(room) / longest } else { 0.0 };
    let legend_rows = u32::from(!chart.legend.is_empty());
    let height = 66 + (legend_rows + chart.bars.len() as u32) * LINE + 2 * MARGIN + 20;
    let mut canvas = Canvas::new([width, height], GROUND);
    let inner = width.saturating_sub(2 * MARGIN);
    canvas.text(MARGIN, 8, inner, 26.0, INK, Face::Proportional, &chart.title);
    canvas.text(MARGIN, 40, inner, 15.0, FAINT, Face::Proportional, &chart.subtitle);
    let mut y = 66;
    let each = inner / (chart.legend.len() as u32).max(1);
    for (i, (name, color)) in (0u32..).zip(&chart.legend) {
        let x = MARGIN + i * each;
        canvas.fill(x, y + 4, 12, 12, *color);
        canvas.text(x + 18, y + 2, each.saturating_sub(20), 15.0, FAINT, Face::Proportional, name);
    }
    y += legend_rows * LINE + MARGIN / 2;
    for bar in &chart.bars {
        let ink = if bar.segments.is_empty() { FAINT } else { INK };
        let across = if bar.segments.is_empty() { inner } else { label - 6 };
        canvas.text(MARGIN, y + 1, across, 16.0, ink, Face::Proportional, &bar.label);
        let start = MARGIN + label;
        // Edges are rounded, not lengths, so that a bar is as long as its parts.
        let mut sum = 0.0;
        let edge = |v: f64| start + (v * scale).round() as u32;
        for s in &bar.segments {
            let from = edge(sum);
            sum += s.value.max(0.0);
            canvas.fill(from, y + 2, edge(sum) - from, BAR, s.color);
        }
        canvas.text(edge(sum) + 8, y + 2, number, 14.0, INK, Face::Monospace, &bar.number);
        y += LINE;
    }
    canvas.text(MARGIN, height - 26, inner, 14.0, FAINT, Face::Proportional, &chart.note);
    canvas
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lengths_are_in_proportion() {
        let bar = |values: &[f64]| Bar {
            label: String::new(),
            segments: values.iter().map(|v| Segment { value: *v, color: [9, 8, 7] }).collect(),
            number: String::new(),
        };
        let chart = Chart {
            title: String::new(),
            subtitle: String::new(),
            legend: vec![],
            bars: vec![bar(&[1.0, 3.0]), bar(&[2.0, -5.0]), bar(&[])],
            note: String::new(),
        };
        let canvas = draw(&chart, 800);
        let row = |i: u32| {
            let y = 66 + MARGIN / 2 + i * LINE + 5;
            (0..800).filter(|x| canvas.rgb[3 * (y * 800 + x) as usize..][..3] == [9, 8, 7]).count()
        };
        assert_eq!([row(0), row(1), row(2)], [2 * row(1), row(1), 0]);
        assert!(row(0) > 200);
    }
}
