//! Looks: neutral grey around images, one colour for each estimator, numbers in a fixed-width face.

use crate::estimate::registry::{ESTIMATORS, parts};
use crate::export::sheet::PALETTE;
use egui::{Color32, RichText, Visuals};

/// Grey around images: no hue, and of middling brightness on the screen, so that the eye judges them rightly.
pub const SURROUND: Color32 = Color32::from_gray(72);
/// Where an image has no pixels yet.
pub const EMPTY: Color32 = Color32::from_gray(56);
/// Laid over tiles that belong to older settings.
pub const STALE: Color32 = Color32::from_black_alpha(120);

/// Sets the looks of the whole window.
pub fn apply(context: &egui::Context) {
    context.set_theme(egui::Theme::Dark);
    let mut visuals = Visuals::dark();
    visuals.panel_fill = Color32::from_gray(38);
    visuals.window_fill = Color32::from_gray(44);
    visuals.extreme_bg_color = Color32::from_gray(26);
    visuals.faint_bg_color = Color32::from_gray(46);
    visuals.override_text_color = Some(Color32::from_gray(215));
    context.set_visuals_of(egui::Theme::Dark, visuals);
    context.all_styles_mut(|style| {
        style.spacing.item_spacing = egui::vec2(6.0, 4.0);
        style.spacing.slider_width = 110.0;
        style.interaction.tooltip_delay = 0.4;
        // Pictures of the window are compared bit by bit.
        style.animation_time = 0.0;
    });
}

/// Colour of the panel at `index` among the estimators `names`: that of its kind in the registry; a second panel of the
/// same kind takes a colour that no kind in use has.
pub fn panel_color(names: &[&str], index: usize) -> Color32 {
    let kind = |name: &str| ESTIMATORS.iter().position(|e| e.id == parts(name).0);
    let first_of_kind = |i: usize| names[..i].iter().all(|n| kind(n) != kind(names[i]));
    let Some(own) = names.get(index).and_then(|n| kind(n)) else { return color(PALETTE.len() - 1) };
    if first_of_kind(index) {
        return color(own);
    }
    let used: Vec<usize> = names.iter().filter_map(|n| kind(n)).collect();
    let free: Vec<usize> = (0..PALETTE.len()).filter(|c| !used.contains(c)).collect();
    let earlier = (0..index).filter(|&i| !first_of_kind(i)).count();
    match free.len() {
        0 => color(own),
        n => color(free[earlier % n]),
    }
}

fn color(index: usize) -> Color32 {
    let [r, g, b] = PALETTE[index % PALETTE.len()];
    Color32::from_rgb(r, g, b)
}

/// A number or code, in the fixed-width face.
pub fn mono(text: impl Into<String>) -> RichText {
    RichText::new(text).monospace()
}

/// A number of three significant digits, with a power of ten when it is very large or small.
pub fn number(x: f64) -> String {
    let size = x.abs();
    if x == 0.0 {
        "0".into()
    } else if !x.is_finite() {
        "-".into()
    } else if !(1e-3..1e5).contains(&size) {
        format!("{x:.2e}")
    } else {
        let digits = (2 - size.log10().floor() as i32).max(0) as usize;
        format!("{x:.digits$}")
    }
}

/// A count with k, M or G.
pub fn count(n: u64) -> String {
    match n {
        0..10_000 => n.to_string(),
        10_000..1_000_000 => format!("{:.1} k", n as f64 / 1e3),
        1_000_000..1_000_000_000 => format!("{:.2} M", n as f64 / 1e6),
        _ => format!("{:.2} G", n as f64 / 1e9),
    }
}

/// Seconds with a fitting unit.
pub fn seconds(s: f64) -> String {
    if s < 1.0 {
        format!("{:.1} ms", s * 1e3)
    } else if s < 120.0 {
        format!("{s:.2} s")
    } else {
        format!("{:.0} min {:02.0} s", (s / 60.0).floor(), s % 60.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_keep_three_digits() {
        let all: Vec<String> = [0.0, 1.0, 0.123_45, 12.345, 1234.5, 1.5e-7, -2.5e9, f64::NAN].map(number).into();
        assert_eq!(all, ["0", "1.00", "0.123", "12.3", "1234", "1.50e-7", "-2.50e9", "-"]);
        assert_eq!(
            (count(9999).as_str(), count(18_000).as_str(), count(2_400_000).as_str()),
            ("9999", "18.0 k", "2.40 M")
        );
    }

    #[test]
    fn panels_of_one_kind_are_told_apart() {
        let names = ["regular", "multi_sampled:n=8", "multi_sampled:n=2", "multi_sampled:n=4"];
        let colors: Vec<_> = (0..4).map(|i| panel_color(&names, i)).collect();
        for i in 0..4 {
            assert!(!colors[..i].contains(&colors[i]), "{i}");
        }
        assert_eq!(panel_color(&["integrated", "regular"], 1), colors[0]);
    }
}
