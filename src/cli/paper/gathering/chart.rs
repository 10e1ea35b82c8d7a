//! The tables as bars: time with ray differentials over that of classic, in print and measured.

use crate::cli::paper::bars::{Bar, Chart, Segment};
use crate::cli::paper::gathering::methods::Way;
use crate::cli::paper::gathering::output::Head;
use crate::cli::paper::gathering::rows::{Row, Section};
use crate::cli::table::percent;
use crate::export::sheet::PALETTE;

/// Bars of all tables.
pub fn chart(sections: &[Section], head: &Head, note: String) -> Chart {
    let colors = [PALETTE[7], PALETTE[0], PALETTE[1]];
    let legend = ["printed", "measured, as published", "measured, corrected"].map(str::to_owned);
    let mut bars = Vec::new();
    let bar = |label: String, value: f64, color: [u8; 3], number: String| Bar {
        label,
        segments: vec![Segment { value, color }],
        number,
    };
    let error = |r: &Row| percent(r.error.map(|e| e.relative_rmse));
    for s in sections {
        for classic in s.rows.iter().filter(|r| r.way == Way::Classic) {
            let heading = format!(
                "{} photons, radius {} m, {} rays: classic {:.2} s, error {}",
                s.photons_emitted,
                s.printed.radius,
                classic.rays,
                classic.total.median,
                error(classic)
            );
            bars.push(Bar { label: heading, segments: vec![], number: String::new() });
            for r in s.rows.iter().filter(|r| r.rays == classic.rays && r.way != Way::Classic) {
                if r.way == Way::AsPublished {
                    let number = format!("{:.2}", r.printed_ratio);
                    bars.push(bar("    printed".into(), r.printed_ratio, colors[0], number));
                }
                let color = if r.way == Way::AsPublished { colors[1] } else { colors[2] };
                let number = format!("{:.2}, error {}", r.ratio_to_classic.median, error(r));
                bars.push(bar(format!("    {}", r.way.title()), r.ratio_to_classic.median, color, number));
            }
        }
    }
    Chart {
        title: "Rendering time with ray differentials over that of classic final gathering".into(),
        subtitle: head.subtitle(),
        legend: legend.into_iter().zip(colors).collect(),
        bars,
        note,
    }
}
