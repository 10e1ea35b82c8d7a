//! Pictures of the engine side by side, with their errors where there is a reference.

use super::parameters;
use crate::cli::failure::Failure;
use crate::cli::paper::PaperFlags;
use crate::cli::paper::output::Origin;
use crate::cli::table::{Table, percent};
use crate::export::sheet::{self, Column, PALETTE, Sheet, signed_error};
use crate::export::text::Canvas;
use crate::export::tone::{Look, ToneMap, auto_exposure};
use crate::measure::metrics::{block_average, compare};
use crate::measure::realtime::statistics::median;
use crate::measure::{Mask, Reference};
use crate::realtime::{Engine, FrameReport, RealtimeSettings};
use crate::render::film::{Image, Rect};
use crate::scene::{Camera, Scene};
use serde::Serialize;
use std::fmt::Write;
use std::sync::Arc;

/// Frames that are timed after the map is full.
const TIMED: u32 = 9;

/// One picture to make.
pub(super) struct Panel<'a> {
    /// Its title.
    pub(super) title: &'a str,
    /// Parameters, as in `KEY=VALUE`.
    pub(super) set: Vec<String>,
}

/// A picture that was made.
#[derive(Serialize)]
pub(super) struct Shown {
    /// Its title.
    pub(super) title: String,
    /// Its parameters.
    pub(super) set: Vec<String>,
    /// Frames per second, one over the median frame; none for what is not of the engine.
    pub(super) frames_per_second: Option<f64>,
    /// The last frame.
    pub(super) last: Option<FrameReport>,
    /// Relative RMSE of means over 8×8 pixels against the reference, if there is one.
    pub(super) relative_rmse: Option<f64>,
    /// Mean over the reference's.
    pub(super) mean_ratio: Option<f64>,
    #[serde(skip)]
    pub(super) image: Image,
}

/// What pictures are held against.
pub(super) struct Against {
    pub(super) image: Image,
    pub(super) mask: Mask,
    pub(super) name: String,
}

/// The built-in reference of a scene, brought to a size that it is a multiple of; none otherwise.
pub(super) fn reference(scene: &str, size: [u32; 2]) -> Option<Against> {
    let r = Reference::built_in(scene).ok().flatten()?;
    let n = r.image.size[0] / size[0].max(1);
    if n == 0 || size.map(|s| s * n) != r.image.size {
        return None;
    }
    let (image, mask) = if n > 1 { block_average(&r.image, &r.mask, n) } else { (r.image, r.mask) };
    Some(Against { image, mask, name: r.source })
}

impl Against {
    /// Relative RMSE of block means, and the ratio of the means.
    pub(super) fn error(&self, image: &Image) -> Option<(f64, f64)> {
        let n = 8.min(image.size[0]).min(image.size[1]);
        let (a, mask) = block_average(image, &self.mask, n);
        let (b, _) = block_average(&self.image, &self.mask, n);
        compare(&a, &b, &mask).ok().map(|e| (e.relative_rmse, e.mean_ratio))
    }
}

/// A picture of the engine with its map full.
pub(super) fn still(scene: &Arc<Scene>, settings: RealtimeSettings, camera: &Camera, size: [u32; 2]) -> Image {
    let mut engine = Engine::new(scene, settings);
    (0..engine.settings().accumulation_frames).for_each(|_| engine.step(0.0, camera));
    engine.draw(camera, size, 1.0)
}

/// A picture of the engine with its map full, and the median seconds of some frames more.
pub(super) fn picture(
    scene: &Arc<Scene>,
    settings: RealtimeSettings,
    camera: &Camera,
    size: [u32; 2],
    exposure: f32,
) -> (Image, FrameReport, f64) {
    let mut engine = Engine::new(scene, settings);
    (0..engine.settings().accumulation_frames).for_each(|_| engine.step(0.0, camera));
    let mut image = engine.draw(camera, size, exposure);
    let mut seconds = Vec::new();
    for _ in 0..TIMED {
        engine.step(0.0, camera);
        image = engine.draw(camera, size, exposure);
        seconds.push(engine.report().seconds.total());
    }
    (image, *engine.report(), median(&seconds))
}

/// Makes panels of a scene.
pub(super) fn make(
    scene: &Arc<Scene>,
    flags: &PaperFlags,
    camera: &Camera,
    size: [u32; 2],
    panels: &[Panel],
    against: Option<&Against>,
) -> Result<Vec<Shown>, Failure> {
    panels
        .iter()
        .map(|p| {
            let texts: Vec<&str> = p.set.iter().map(String::as_str).collect();
            let settings = parameters(scene, flags, &texts)?;
            let (image, last, seconds) = picture(scene, settings, camera, size, 1.0);
            let error = against.and_then(|a| a.error(&image));
            Ok(Shown {
                title: p.title.to_owned(),
                set: p.set.clone(),
                frames_per_second: Some(1.0 / seconds),
                last: Some(last),
                relative_rmse: error.map(|e| e.0),
                mean_ratio: error.map(|e| e.1),
                image,
            })
        })
        .collect()
}

/// Draws pictures side by side, all with one exposure: the reference's, or the first picture's.
pub(super) fn draw(title: &str, shown: &[Shown], against: Option<&Against>, origin: &Origin) -> Canvas {
    let exposure = against.map(|a| &a.image).or_else(|| shown.first().map(|s| &s.image)).map_or(1.0, auto_exposure);
    let look = || Look::Tone(ToneMap::srgb(exposure));
    let mut columns: Vec<Column> = shown
        .iter()
        .enumerate()
        .map(|(i, s)| {
            let mut lines = Vec::new();
            if let (Some(f), Some(last)) = (s.frames_per_second, &s.last) {
                lines.push(format!("{f:.1} frames/s, {} photons", last.photons_in_map));
            }
            if s.relative_rmse.is_some() {
                lines.push(format!("error {} (8×8 means)", percent(s.relative_rmse)));
            }
            Column {
                title: s.title.clone(),
                lines,
                color: PALETTE[i % PALETTE.len()],
                image: s.image.clone(),
                look: look(),
                // What the reference does not show has no error against it.
                error: against.filter(|_| s.relative_rmse.is_some()).map(|a| signed_error(&s.image, &a.image)),
            }
        })
        .collect();
    if let Some(a) = against {
        columns.push(Column {
            title: "reference".into(),
            lines: vec![a.name.clone()],
            color: PALETTE[7],
            image: a.image.clone(),
            look: look(),
            error: None,
        });
    }
    let size = shown.first().map_or([1, 1], |s| s.image.size);
    let sheet = Sheet {
        title: title.into(),
        subtitle: origin.subtitle(),
        columns,
        crop: Rect::whole(size),
        enlarge: (300 / size[0].max(1)).max(1),
    };
    sheet::draw_against(&sheet, "the reference")
}

/// A table of pictures.
pub(super) fn text(shown: &[Shown]) -> String {
    let mut table = Table::new(["picture", "frames/s", "photons", "triangles seen", "estimates", "error", "mean"]);
    for s in shown {
        let of = |f: fn(&FrameReport) -> u64| s.last.as_ref().map_or("-".into(), |l| f(l).to_string());
        table.row([
            s.title.clone(),
            s.frames_per_second.map_or("-".into(), |f| format!("{f:.1}")),
            of(|l| l.photons_in_map),
            of(|l| l.triangles_visible),
            of(|l| l.estimates),
            percent(s.relative_rmse),
            s.mean_ratio.map_or("-".into(), |m| format!("{m:.3}")),
        ]);
    }
    table.text()
}

/// The same as CSV.
pub(super) fn csv(shown: &[Shown]) -> String {
    let mut out = String::from("picture,set,frames_per_second,photons,relative_rmse,mean_ratio\n");
    for s in shown {
        let number = |x: Option<f64>| x.map_or(String::new(), |x| format!("{x:.6}"));
        // Writing to a string cannot fail.
        let _ = writeln!(
            out,
            "\"{}\",\"{}\",{},{},{},{}",
            s.title,
            s.set.join(" "),
            number(s.frames_per_second),
            s.last.as_ref().map_or(String::new(), |l| l.photons_in_map.to_string()),
            number(s.relative_rmse),
            number(s.mean_ratio)
        );
    }
    out
}
