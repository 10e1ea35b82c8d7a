//! Sessions: a comparison as a file, with everything that reopens the window as it was.

use crate::estimate::{Estimator, registry};
pub use crate::measure::difference::Difference;
use crate::measure::flip::MAX_STOPS;
use crate::render::StopRule;
use crate::render::film::Rect;
use crate::render::settings::PlanMode;
use crate::scene::scene_file::{CameraFile, LightFile, MaterialFile, RealtimeFile, RenderFile, SceneFile};
use crate::scene::{SceneError, Source};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Version of the format, the value of the key `session`.
pub const VERSION: u32 = 1;

/// Largest factor of enlargement.
pub const MAX_ENLARGE: u32 = 32;

/// A session file (TOML). Every part but `session` and `scene` may be left out.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Session {
    /// Version of the format.
    pub session: u32,
    /// Built-in name, or path of a scene file relative to the session's folder.
    pub scene: String,
    /// Pixels across and down; the scene's if left out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub size: Option<[u32; 2]>,
    /// Seed of everything random.
    #[serde(default = "one")]
    pub seed: u64,
    /// Passes after which the window rests.
    #[serde(default = "many_passes")]
    pub passes: u32,
    /// Estimated relative error of every panel, a fraction, at which the window rests before that; above 0.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub until_error: Option<f64>,
    /// Seconds of rendering after which the window rests before that; above 0.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub seconds: Option<f64>,
    /// Whether parts that the scene does not need are left out (needed) or forced on (full).
    #[serde(default)]
    pub plan: PlanMode,
    /// Image to compare with, relative to the session's folder, in place of a built-in scene's own.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub reference: Option<String>,
    /// Pixels of the reference that count (PNG, white).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mask: Option<String>,
    /// The part that is enlarged and exported: x, y, width, height.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub crop: Option<[u32; 4]>,
    /// Factor of enlargement, 1 to [`MAX_ENLARGE`].
    #[serde(default = "three")]
    pub enlarge: u32,
    /// Pinned pixels, the inspected one last.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub pins: Vec<[u32; 2]>,
    /// Overlays that are on, by their ids.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub overlays: Vec<String>,
    /// How the panels are set against each other.
    #[serde(default)]
    pub comparison: Comparison,
    /// From radiance to the screen.
    #[serde(default)]
    pub tone: Tone,
    /// The part of the images that is seen.
    #[serde(default)]
    pub view: View,
    /// Settings on top of the scene's.
    #[serde(default)]
    pub render: RenderFile,
    /// Which renderer the window shows.
    #[serde(default, skip_serializing_if = "Rendering::is_progressive")]
    pub rendering: Rendering,
    /// Parameters of real-time rendering on top of the scene's.
    #[serde(default, skip_serializing_if = "RealtimeFile::is_empty")]
    pub realtime: RealtimeFile,
    /// The camera in place of the scene's.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub camera: Option<CameraFile>,
    /// Materials in place of the scene's of the same names.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub materials: BTreeMap<String, MaterialFile>,
    /// All lights in place of the scene's.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub lights: Option<Vec<LightFile>>,
    /// The panels.
    #[serde(default = "all_estimators")]
    pub panels: Vec<Panel>,
    /// How the parts of the window are docked, as the window writes it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub layout: Option<String>,
}

/// One image panel.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Panel {
    /// Estimator with its settings, as `multi_sampled:n=8,grid=cells`; empty for a panel that shows a file.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub estimator: String,
    /// EXR or PNG that it shows in place of an estimator.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub image: Option<String>,
    /// Heatmap by its id; the radiance if left out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub heatmap: Option<String>,
}

impl Panel {
    /// An estimator's radiance.
    pub fn of(estimator: impl Into<String>) -> Self {
        Self { estimator: estimator.into(), image: None, heatmap: None }
    }
}

/// How panels are set against each other.
#[derive(Clone, Debug, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Comparison {
    /// The mode.
    #[serde(default)]
    pub mode: Mode,
    /// What panels are compared with: the number of a panel from 0; the reference if left out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub with: Option<usize>,
    /// Which difference.
    #[serde(default)]
    pub difference: Difference,
    /// Where the split lies, from 0 at the left of the image to 1.
    #[serde(default = "half")]
    pub divider: f32,
}

/// Mode of comparison.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Mode {
    /// Each panel shows its own image.
    #[default]
    Grid,
    /// Left of the divider its own, right of it the other's.
    Split,
    /// Each shows its difference to the other.
    Difference,
}

/// From radiance to the screen: the same for all panels.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Tone {
    /// Exposure in stops: radiance is multiplied by 2 to this. Set from the images while `auto` is on.
    #[serde(default)]
    pub exposure: f32,
    /// Added after exposure.
    #[serde(default)]
    pub offset: f32,
    /// The curve.
    #[serde(default)]
    pub curve: Curve,
    /// Whether exposure and range follow the images.
    #[serde(default = "yes")]
    pub auto: bool,
    /// Show the luminance by this colour map instead of the colours.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub false_color: Option<String>,
    /// Ends of the colour bar of false colour, W/(m² sr).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub range: Option<[f32; 2]>,
}

/// Tone curve.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Curve {
    /// sRGB, cut at white.
    #[default]
    Srgb,
    /// A pure power of 1/2.2, cut at white.
    Gamma,
    /// Values as they are, cut at white.
    Linear,
    /// x/(1 + x) by luminance, then sRGB: nothing is cut (Reinhard et al. 2002).
    Reinhard,
}

/// Which renderer the window shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Rendering {
    /// Passes that are averaged, under each panel's estimator.
    #[default]
    Progressive,
    /// The frame loop of real-time photon mapping.
    Realtime,
}

impl Rendering {
    /// Whether it is the default.
    pub fn is_progressive(&self) -> bool {
        *self == Self::Progressive
    }
}

/// The part of the images that is seen.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct View {
    /// Points on the screen for each pixel; 0 fits the image to its panel.
    #[serde(default)]
    pub zoom: f32,
    /// Place of the image in the middle of each panel, from 0 to 1 each way.
    #[serde(default = "middle")]
    pub center: [f32; 2],
}

impl Default for View {
    fn default() -> Self {
        Self { zoom: 0.0, center: middle() }
    }
}

impl Default for Tone {
    fn default() -> Self {
        Self { exposure: 0.0, offset: 0.0, curve: Curve::Srgb, auto: true, false_color: None, range: None }
    }
}

fn one() -> u64 {
    1
}

fn many_passes() -> u32 {
    1024
}

fn three() -> u32 {
    3
}

fn half() -> f32 {
    0.5
}

fn yes() -> bool {
    true
}

fn middle() -> [f32; 2] {
    [0.5; 2]
}

fn all_estimators() -> Vec<Panel> {
    registry::ESTIMATORS.iter().filter_map(|e| e.default_estimator()).map(|e| Panel::of(e.name())).collect()
}

impl Session {
    /// A scene at its defaults, under four estimators that tell the story.
    pub fn of(scene: impl Into<String>) -> Self {
        let four = ["regular", "multi_sampled", "coplanar", "integrated"];
        Self {
            session: VERSION,
            scene: scene.into(),
            size: None,
            seed: one(),
            passes: many_passes(),
            until_error: None,
            seconds: None,
            plan: PlanMode::Needed,
            reference: None,
            mask: None,
            crop: None,
            enlarge: three(),
            pins: Vec::new(),
            overlays: Vec::new(),
            comparison: Comparison { divider: half(), ..Default::default() },
            tone: Tone::default(),
            view: View::default(),
            render: RenderFile::default(),
            rendering: Rendering::Progressive,
            realtime: RealtimeFile::default(),
            camera: None,
            materials: BTreeMap::new(),
            lights: None,
            panels: four.iter().filter_map(|e| registry::estimator(e).ok()).map(|e| Panel::of(e.name())).collect(),
            layout: None,
        }
    }

    /// Whether a file is a session: a TOML file with the key `session` at its top.
    pub fn is_one(path: &Path) -> bool {
        let is_toml = path.extension().is_some_and(|e| e.eq_ignore_ascii_case("toml"));
        is_toml && std::fs::read_to_string(path).is_ok_and(|text| has_session_key(&text))
    }

    /// Reads a session file. Paths in it become relative to where the program runs.
    ///
    /// # Errors
    /// One line with file, line and key.
    pub fn open(path: &Path) -> Result<Self, SceneError> {
        let text = std::fs::read_to_string(path)
            .map_err(|e| SceneError::Unreadable { file: path.to_owned(), why: e.to_string() })?;
        let mut session = Self::parse(path, &text)?;
        let folder = path.parent().unwrap_or(Path::new(""));
        let placed = |name: &str| folder.join(name).to_string_lossy().into_owned();
        if crate::scene::built_in::find(&session.scene).is_none() {
            session.scene = placed(&session.scene);
            if !Path::new(&session.scene).is_file() {
                let what = format!("no such file: {}; give a scene file or a built-in name", session.scene);
                return Err(crate::scene::locate::Locator::new(path, &text).error("scene", what));
            }
        }
        for file in [&mut session.reference, &mut session.mask].into_iter().flatten() {
            *file = placed(file);
        }
        for image in session.panels.iter_mut().filter_map(|p| p.image.as_mut()) {
            *image = placed(image);
        }
        Ok(session)
    }

    /// Reads a session from its text; `path` names it in errors. Paths in it stay as they are.
    ///
    /// # Errors
    /// One line with file, line and key.
    pub fn parse(path: &Path, text: &str) -> Result<Self, SceneError> {
        let locator = crate::scene::locate::Locator::new(path, text);
        let session: Self = toml::from_str(text).map_err(|e| locator.parse_error(&e))?;
        if session.session != VERSION {
            return Err(
                locator.error("session", format!("is version {}; this program reads {VERSION}", session.session))
            );
        }
        if !(1..=MAX_ENLARGE).contains(&session.enlarge) {
            return Err(locator.error("enlarge", format!("must lie in 1 to {MAX_ENLARGE}")));
        }
        for (key, limit) in [("until_error", session.until_error), ("seconds", session.seconds)] {
            if limit.is_some_and(|l| !(l > 0.0 && l.is_finite())) {
                return Err(locator.error(key, "must be positive and finite"));
            }
        }
        let (tone, view) = (&session.tone, &session.view);
        let range = tone.range.unwrap_or_default();
        for (key, values, most) in [
            ("tone.exposure", &[tone.exposure][..], MAX_STOPS),
            ("tone.offset", &[tone.offset], f32::MAX),
            ("tone.range", &range, f32::MAX),
            ("comparison.divider", &[session.comparison.divider], f32::MAX),
            ("view.zoom", &[view.zoom], f32::MAX),
            ("view.center", &view.center, f32::MAX),
        ] {
            // Not `abs() > most`: what is no number must not pass.
            if !values.iter().all(|v| v.abs() <= most) {
                return Err(locator.error(key, format!("must be finite, and between -{most:e} and {most:e}")));
            }
        }
        if session.crop.is_some_and(|[_, _, width, height]| width == 0 || height == 0) {
            return Err(locator.error("crop", "is x, y, width, height; width and height must be at least 1"));
        }
        for (i, panel) in session.panels.iter().enumerate() {
            if panel.image.is_none() {
                registry::estimator(&panel.estimator)
                    .map_err(|e| locator.error(format!("panels[{i}].estimator"), e.to_string()))?;
            }
        }
        Ok(session)
    }

    /// The session as the text of a file in `folder`; paths become relative to it where they can.
    ///
    /// # Errors
    /// A value that TOML cannot hold, which would be a defect.
    pub fn to_toml(&self, folder: &Path) -> Result<String, String> {
        let mut written = self.clone();
        if crate::scene::built_in::find(&written.scene).is_none() {
            written.scene = relative(&written.scene, folder);
        }
        for file in [&mut written.reference, &mut written.mask].into_iter().flatten() {
            *file = relative(file, folder);
        }
        for image in written.panels.iter_mut().filter_map(|p| p.image.as_mut()) {
            *image = relative(image, folder);
        }
        toml::to_string(&written).map_err(|e| e.to_string())
    }

    /// The scene file with the session's camera, materials and lights.
    pub fn edited(&self, file: &SceneFile) -> SceneFile {
        let mut edited = file.clone();
        if self.camera.is_some() {
            edited.camera.clone_from(&self.camera);
        }
        for (name, material) in &self.materials {
            edited.materials.insert(name.clone(), material.clone());
        }
        if let Some(lights) = &self.lights {
            edited.lights.clone_from(lights);
        }
        edited
    }

    /// Opens the scene, as it is written and with the session's edits.
    ///
    /// # Errors
    /// Anything wrong in the scene or in an edit.
    pub fn open_scene(&self) -> Result<(Source, crate::scene::Scene), SceneError> {
        let source = Source::open(&self.scene)?;
        let scene = source.edited(&self.edited(&source.file), &source.scene)?;
        Ok((source, scene))
    }

    /// An error of [`Session::open_scene`] at the line of the session's `file` where the session's own camera,
    /// materials or lights are wrong; any other as it is.
    pub fn place(&self, error: SceneError, file: &Path) -> SceneError {
        let SceneError::At { key, what, .. } = &error else { return error };
        let starts =
            |table: &str| key.strip_prefix(table).is_some_and(|rest| rest.is_empty() || rest.starts_with(['.', '[']));
        let own = (self.lights.is_some() && starts("lights"))
            || (self.camera.is_some() && starts("camera"))
            || self.materials.keys().any(|name| starts(&format!("materials.{name}")));
        match std::fs::read_to_string(file) {
            Ok(text) if own => crate::scene::locate::Locator::new(file, &text).error(key.clone(), what.clone()),
            _ => error,
        }
    }

    /// The distinct estimators of the panels, in their order.
    pub fn estimators(&self) -> Vec<Box<dyn Estimator>> {
        let mut all: Vec<Box<dyn Estimator>> = Vec::new();
        for panel in self.panels.iter().filter(|p| p.image.is_none()) {
            if let Ok(e) = registry::estimator(&panel.estimator)
                && all.iter().all(|other| other.name() != e.name())
            {
                all.push(e);
            }
        }
        all
    }

    /// When the window rests.
    pub fn stop_rule(&self) -> StopRule {
        StopRule { passes: Some(self.passes), seconds: self.seconds, error: self.until_error }
    }

    /// The crop as a rectangle.
    pub fn crop_rect(&self) -> Option<Rect> {
        self.crop.map(|[x, y, width, height]| Rect { x, y, width, height })
    }
}

/// Whether the text's top level has the key.
fn has_session_key(text: &str) -> bool {
    text.lines()
        .map(str::trim_start)
        .take_while(|line| !line.starts_with('['))
        .any(|line| line.strip_prefix("session").is_some_and(|rest| rest.trim_start().starts_with('=')))
}

/// `path` seen from `folder`, if both are the same disk's; otherwise as it is.
fn relative(path: &str, folder: &Path) -> String {
    let (Ok(path_full), Ok(folder_full)) = (std::path::absolute(path), std::path::absolute(folder)) else {
        return path.to_owned();
    };
    let (p, f): (Vec<_>, Vec<_>) = (path_full.components().collect(), folder_full.components().collect());
    let same = p.iter().zip(&f).take_while(|(a, b)| a == b).count();
    if same == 0 {
        return path.to_owned();
    }
    let up = std::iter::repeat_n(Path::new("..").to_owned(), f.len() - same);
    let down = p[same..].iter().map(|c| PathBuf::from(c.as_os_str()));
    up.chain(down).collect::<PathBuf>().to_string_lossy().replace('\\', "/")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sessions_come_back_as_they_were_written() {
        let mut session = Session::of("ring");
        session.size = Some([64, 48]);
        (session.until_error, session.seconds) = (Some(0.01), Some(90.0));
        session.crop = Some([1, 2, 3, 4]);
        session.pins = vec![[5, 6], [7, 8]];
        session.overlays = vec!["photons".into()];
        session.comparison.mode = Mode::Split;
        session.tone.false_color = Some("viridis".into());
        session.render.photons = Some(1000);
        session.panels[0].heatmap = Some("photons".into());
        let (source, scene) = session.open_scene().expect("opens");
        session.camera.clone_from(&source.file.camera);
        session.lights = Some(source.file.lights.clone());
        session.materials.clone_from(&source.file.materials);
        session.layout = Some("a \"text\"\nof lines".into());
        let text = session.to_toml(Path::new("")).expect("a text");
        assert!(has_session_key(&text));
        assert_eq!(Session::parse(Path::new("s.toml"), &text).expect(&text), session);
        // Edits that change nothing give the same scene.
        assert_eq!(session.open_scene().expect("opens").1.hash, scene.hash);
    }

    #[test]
    fn little_is_enough() {
        let session = Session::parse(Path::new("s.toml"), "session = 1\nscene = \"ring\"").expect("parses");
        assert_eq!(session.panels.len(), registry::ESTIMATORS.len());
        assert!(session.tone.auto && session.comparison.mode == Mode::Grid);
    }

    #[test]
    fn what_is_wrong_is_placed() {
        for (text, part) in [
            ("session = 2\nscene = \"ring\"", "s.toml:1: session"),
            ("session = 1\nscene = \"ring\"\nsize = 4", "s.toml:3"),
            ("session = 1\nscene = \"ring\"\ncolour = 4", "colour"),
            ("session = 1\nscene = \"ring\"\nuntil_error = 0", "s.toml:3: until_error"),
            ("session = 1\nscene = \"ring\"\nseconds = nan", "s.toml:3: seconds"),
            ("session = 1\nscene = \"ring\"\n[tone]\nexposure = 1e9", "s.toml:4: tone.exposure"),
            ("session = 1\nscene = \"ring\"\n[tone]\nrange = [0, inf]", "s.toml:4: tone.range"),
            ("session = 1\nscene = \"ring\"\n[view]\ncenter = [nan, 0]", "s.toml:4: view.center"),
            ("session = 1\nscene = \"ring\"\n[[panels]]\nestimator = \"sharp\"", "sharp"),
        ] {
            let error = Session::parse(Path::new("s.toml"), text).expect_err(text).to_string();
            assert!(error.contains(part) && !error.contains('\n'), "{error}");
        }
    }

    #[test]
    fn a_scene_is_no_session() {
        assert!(!has_session_key("name = \"a\"\n[session]\n") && !has_session_key("sessions = 1"));
        assert!(has_session_key("# c\n session = 1"));
    }

    #[test]
    fn paths_become_relative() {
        assert_eq!(relative("a/b/scene.toml", Path::new("a/c")), "../b/scene.toml");
        assert_eq!(relative("a/scene.toml", Path::new("a")), "scene.toml");
    }
}
