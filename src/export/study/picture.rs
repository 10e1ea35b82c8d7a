//! A study as a picture: error against run time, and what the error is made of.

use crate::export::plot::{Axes, Level, Plot, Series, ink};
use crate::export::study::StudyReport;
use crate::measure::study::Curve;

/// What `study.png` shows.
pub fn plot(report: &StudyReport) -> Plot {
    let noise: Vec<Level> = report
        .reference
        .noise
        .filter(|n| *n > 0.0)
        .map(|y| Level { name: format!("noise of the reference, {:.2} %", 100.0 * y), y })
        .into_iter()
        .collect();
    let curves = || report.curves.iter().enumerate();
    let errors = Axes {
        title: "relative RMSE".into(),
        x: "seconds of rendering".into(),
        y: "relative RMSE".into(),
        series: curves().map(|(i, c)| error_series(i, c)).collect(),
        levels: noise.clone(),
    };
    let mut axes = vec![errors];
    if report.seeds.len() > 1 {
        axes.push(Axes {
            title: "what it is made of: bias (solid), noise (dashed)".into(),
            x: "seconds of rendering".into(),
            y: "relative to the reference's mean".into(),
            series: curves().flat_map(|(i, c)| parts_series(i, c)).collect(),
            levels: noise,
        });
    }
    let [w, h] = report.size;
    let seeds = report.seeds.len();
    Plot {
        title: format!("{}: error against run time", report.scene),
        subtitle: format!(
            "{w}x{h} pixels, median and range of {seeds} seed{}, against {}",
            if seeds == 1 { "" } else { "s" },
            report.reference.source
        ),
        axes,
    }
}

fn error_series(i: usize, curve: &Curve) -> Series {
    let told = || curve.summary.iter().filter_map(|s| Some((s.seconds.median, s.relative_rmse?)));
    Series {
        name: curve.label.clone(),
        color: ink(i),
        line: curve.line(),
        band: told().map(|(t, e)| (t, e.low, e.high)).collect(),
        // Colours come again after eight curves.
        dashed: i >= crate::export::plot::INKS.len(),
        marks: true,
    }
}

fn parts_series(i: usize, curve: &Curve) -> [Series; 2] {
    let parts = || curve.summary.iter().filter_map(|s| Some((s.seconds.median, s.bias_and_variance?)));
    let bias = parts().filter_map(|(t, p)| Some((t, p.relative_bias?))).collect();
    let noise = parts().map(|(t, p)| (t, p.relative_noise)).collect();
    let of = |line, dashed| Series { color: ink(i), line, dashed, marks: !dashed, ..Default::default() };
    [of(bias, false), of(noise, true)]
}
