//! The parameters of real-time photon mapping (Kristensen and Ottosen 2003, chapter 6), and ours.

use crate::realtime::distribution::Distribution;
use crate::render::settings::SettingError;
use crate::scene::Scene;
use crate::scene::scene_file::RealtimeFile;
use serde::Serialize;

/// How a photon that meets a diffuse surface goes on.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Scattering {
    /// It is split into `diffuse_reflections` photons that share its power times the reflectance, as published.
    Splitting,
    /// It survives with the probability of the largest reflectance, as one photon (Jensen 2001).
    Roulette,
}

/// Where photons of an estimate are looked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Search {
    /// A ball, or with `sphere_slice` a slice of it.
    Sphere,
    /// A cylinder about the normal.
    Cylinder,
    /// An ellipsoid that is flat along the normal.
    Ellipsoid,
}

/// By which area the powers of an estimate are divided (Kristensen and Ottosen 2003, figure 3.10).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Area {
    /// The disc whose radius is that of the search.
    Disc,
    /// The convex hull of the photons, enlarged by the part that it lacks, which its corners tell.
    Hull,
    /// The convex hull itself.
    HullAsPublished,
    /// The smallest circle about the photons.
    Circle,
    /// Their box along the axes of the scene.
    AlignedBox,
    /// Their box along their principal axes.
    OrientedBox,
    /// The ellipse along their principal axes that holds them.
    Ellipse,
}

/// How photons are split into maps of their own.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Partition {
    /// One map.
    None,
    /// By the axis that is nearest to the surface's normal, and its sign (Larsen and Christensen 2003).
    Normal,
    /// By the cell of the scene's visibility (section 5.3.4).
    Cell,
}

/// How the hierarchy follows what moves.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Moving {
    /// Each moving part has a hierarchy of its own, and rays are moved instead.
    Instances,
    /// One hierarchy over all surfaces is built anew.
    Rebuild,
}

/// How irradiance and texture make a colour.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Blending {
    /// Their product (eq. 3.9).
    Multiply,
    /// The texture plus twice the irradiance less one (eq. 3.8).
    Offset,
}

/// All parameters, checked.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct RealtimeSettings {
    /// Whether rays go through a hierarchy. Parameter 1.
    pub acceleration: bool,
    /// Triangles by which the mesh is refined. Parameter 2.
    pub mesh_refinement: u32,
    /// Longest edge at which refinement ends, metres; 0 for none.
    pub max_edge: f32,
    /// Whether a vertex is estimated once a frame. Parameter 3.
    pub estimate_cache: bool,
    /// Photons of an estimate at most. Parameter 4.
    pub max_search_count: u32,
    /// Radius of an estimate at most, metres. Parameter 5.
    pub max_search_radius: f32,
    /// Whether the radius follows from the map (eq. 3.7). Parameter 6.
    pub radius_heuristic: bool,
    /// α of eq. 3.7, in (0, 1].
    pub radius_alpha: f32,
    /// Whether photons off the plane are left out. Parameter 7.
    pub sphere_slice: bool,
    /// Whether vertices gather finally. Parameter 8.
    pub final_gathering: bool,
    /// Rays of a final gathering.
    pub final_gathering_rays: u32,
    /// Photons emitted in a frame, of all lights. Parameter 9.
    pub photons_from_light: u32,
    /// Frames whose photons make the map. Parameter 10.
    pub accumulation_frames: u32,
    /// Whether photons are stored at their first surface. Parameter 11.
    pub store_direct_light: bool,
    /// Diffuse reflections at most. Parameter 12.
    pub recursion_depth: u32,
    /// Photons that a reflected one is split into. Parameter 13.
    pub diffuse_reflections: u32,
    /// Photons stored for each that arrives. Parameter 14.
    pub snowball_size: u32,
    /// Directions from a light. Parameter 15.
    pub light_distribution: Distribution,
    /// Directions of reflections. Parameter 16.
    pub diffuse_distribution: Distribution,
    /// How photons are reflected.
    pub scattering: Scattering,
    /// Whether frames use the same random numbers (section 5.2.2).
    pub coherent: bool,
    /// Region of the search.
    pub search: Search,
    /// Whether photons that arrive at the back of a vertex are left out.
    pub incoming_direction: bool,
    /// Half-height of slice, cylinder and ellipsoid over the radius, in (0, 1].
    pub slice_height: f32,
    /// Area of an estimate.
    pub area: Area,
    /// Split of the map.
    pub partition: Partition,
    /// Photons in a leaf at most.
    pub stop_recursion_size: u32,
    /// How the hierarchy follows.
    pub moving: Moving,
    /// How colours are made.
    pub blending: Blending,
    /// Whether triangles seen from behind are left out of the picture.
    pub cull_back_faces: bool,
    /// Whether a spot light at the camera takes the place of the lights (figure 6.9).
    pub flashlight: bool,
    /// Seed of everything random.
    pub seed: u64,
}

/// What values a parameter takes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Values {
    /// On or off.
    Switch,
    /// Whole numbers from a least to a largest.
    Integer(i64, i64),
    /// Positive numbers up to a largest.
    Number(f64),
    /// One of some words.
    Words(&'static [&'static str]),
}

/// A parameter as lists, sliders and errors know it.
#[derive(Clone, Copy, Debug)]
pub struct Parameter {
    /// Key of `[realtime]`.
    pub name: &'static str,
    /// Number in chapter 6 of Kristensen and Ottosen 2003; none for what the paper has not, or has elsewhere.
    pub number: Option<u32>,
    /// What it takes.
    pub values: Values,
    /// What it does.
    pub what: &'static str,
}

const fn parameter(name: &'static str, number: u32, values: Values, what: &'static str) -> Parameter {
    Parameter { name, number: if number == 0 { None } else { Some(number) }, values, what }
}

/// Every parameter, those of chapter 6 first.
pub const PARAMETERS: &[Parameter] = &[
    parameter("acceleration", 1, Values::Switch, "rays go through a hierarchy; off: they try every surface"),
    parameter(
        "mesh_refinement",
        2,
        Values::Integer(0, 4_000_000),
        "triangles added by splitting the longest edge of all",
    ),
    parameter(
        "estimate_cache",
        3,
        Values::Switch,
        "a vertex is estimated once a frame; off: once for each visible triangle",
    ),
    parameter("max_search_count", 4, Values::Integer(1, 100_000), "photons of an estimate at most"),
    parameter(
        "max_search_radius",
        5,
        Values::Number(1e12),
        "how far an estimate looks, m; a 20th of the scene's radius if left out",
    ),
    parameter("radius_heuristic", 6, Values::Switch, "the radius follows from the map instead (eq. 3.7)"),
    parameter("sphere_slice", 7, Values::Switch, "photons off the vertex's plane are left out"),
    parameter(
        "final_gathering",
        8,
        Values::Switch,
        "vertices gather finally: light of one bounce more, none straight from lights",
    ),
    parameter(
        "photons_from_light",
        9,
        Values::Integer(1, 10_000_000),
        "photons emitted in a frame by all lights together",
    ),
    parameter("accumulation_frames", 10, Values::Integer(1, 10_000), "frames whose photons make the map"),
    parameter(
        "store_direct_light",
        11,
        Values::Switch,
        "photons are stored where they arrive from the light; off: reflected ones alone",
    ),
    parameter("recursion_depth", 12, Values::Integer(0, 32), "diffuse reflections of a photon at most"),
    parameter("diffuse_reflections", 13, Values::Integer(1, 10_000), "photons that a reflected one is split into"),
    parameter("snowball_size", 14, Values::Integer(1, 1000), "photons stored for each that arrives, on a small disc"),
    parameter("light_distribution", 15, Values::Words(Distribution::NAMES), "directions in which lights emit"),
    parameter(
        "diffuse_distribution",
        16,
        Values::Words(Distribution::NAMES),
        "directions into which photons are reflected",
    ),
    parameter("max_edge", 0, Values::Number(1e12), "longest edge at which refinement ends, m; none if left out"),
    parameter(
        "radius_alpha",
        0,
        Values::Number(1.0),
        "share of the mean radiance at which the heuristic's radius is reached",
    ),
    parameter("final_gathering_rays", 0, Values::Integer(1, 65_536), "rays of a final gathering"),
    parameter(
        "scattering",
        0,
        Values::Words(&["splitting", "roulette"]),
        "photons are split (as published) or killed by Russian roulette",
    ),
    parameter("coherent", 0, Values::Switch, "frames use the same random numbers, made once"),
    parameter(
        "search",
        0,
        Values::Words(&["sphere", "cylinder", "ellipsoid"]),
        "region in which photons are looked for",
    ),
    parameter("incoming_direction", 0, Values::Switch, "photons that arrive at the back of a vertex are left out"),
    parameter("slice_height", 0, Values::Number(1.0), "half-height of slice, cylinder and ellipsoid over the radius"),
    parameter(
        "area",
        0,
        Values::Words(&["disc", "hull", "hull_as_published", "circle", "aligned_box", "oriented_box", "ellipse"]),
        "area by which the powers of an estimate are divided",
    ),
    parameter("partition", 0, Values::Words(&["none", "normal", "cell"]), "how photons are split into maps"),
    parameter("stop_recursion_size", 0, Values::Integer(1, 10_000), "photons in a leaf of the kd-tree at most"),
    parameter("moving", 0, Values::Words(&["instances", "rebuild"]), "how the hierarchy follows what moves"),
    parameter(
        "blending",
        0,
        Values::Words(&["multiply", "offset"]),
        "irradiance times texture, or texture plus twice the irradiance less one",
    ),
    parameter("cull_back_faces", 0, Values::Switch, "triangles seen from behind are left out of the picture"),
    parameter("flashlight", 0, Values::Switch, "a spot light at the camera takes the place of the lights"),
];

/// Number of photons that the map can hold, by figure 4.3; the largest number there is for more.
///
/// `photons · frames · snowball · (direct + Σ reflections^level)`, which Russian roulette has reflections of 1 in.
pub fn photon_count(s: &RealtimeSettings) -> u64 {
    let split = match s.scattering {
        Scattering::Splitting => u64::from(s.diffuse_reflections),
        Scattering::Roulette => 1,
    };
    let (mut level, mut sum) = (1u64, u64::from(s.store_direct_light));
    for _ in 0..s.recursion_depth {
        level = level.saturating_mul(split);
        sum = sum.saturating_add(level);
    }
    [s.photons_from_light, s.accumulation_frames, s.snowball_size]
        .iter()
        .fold(sum, |n, &x| n.saturating_mul(u64::from(x)))
}

/// Largest number of photons that a map may hold.
pub const MAX_PHOTONS: u64 = 1 << 28;

impl RealtimeSettings {
    /// The scene's parameters with `flags` on top.
    ///
    /// # Errors
    /// The first value out of range, by its flag or its line in the scene file; a map of more than [`MAX_PHOTONS`].
    pub fn new(scene: &Scene, flags: &RealtimeFile, seed: u64) -> Result<Self, SettingError> {
        let pick = Picker { scene, flags };
        let s = Self {
            acceleration: pick.switch(|f| f.acceleration, true),
            mesh_refinement: pick.integer("mesh_refinement", |f| f.mesh_refinement, 10_000)? as u32,
            max_edge: pick.number("max_edge", |f| f.max_edge, 0.0)? as f32,
            estimate_cache: pick.switch(|f| f.estimate_cache, true),
            max_search_count: pick.integer("max_search_count", |f| f.max_search_count, 50)? as u32,
            max_search_radius: pick.number(
                "max_search_radius",
                |f| f.max_search_radius,
                f64::from(scene.radius * DEFAULT_RADIUS),
            )? as f32,
            radius_heuristic: pick.switch(|f| f.radius_heuristic, false),
            radius_alpha: pick.number("radius_alpha", |f| f.radius_alpha, 0.1)? as f32,
            sphere_slice: pick.switch(|f| f.sphere_slice, true),
            final_gathering: pick.switch(|f| f.final_gathering, false),
            final_gathering_rays: pick.integer("final_gathering_rays", |f| f.final_gathering_rays, 64)? as u32,
            photons_from_light: pick.integer("photons_from_light", |f| f.photons_from_light, 200)? as u32,
            accumulation_frames: pick.integer("accumulation_frames", |f| f.accumulation_frames, 10)? as u32,
            store_direct_light: pick.switch(|f| f.store_direct_light, true),
            recursion_depth: pick.integer("recursion_depth", |f| f.recursion_depth, 1)? as u32,
            diffuse_reflections: pick.integer("diffuse_reflections", |f| f.diffuse_reflections, 36)? as u32,
            snowball_size: pick.integer("snowball_size", |f| f.snowball_size, 1)? as u32,
            light_distribution: pick.distribution("light_distribution", |f| f.light_distribution.as_deref())?,
            diffuse_distribution: pick.distribution("diffuse_distribution", |f| f.diffuse_distribution.as_deref())?,
            scattering: pick.word(
                "scattering",
                |f| f.scattering.as_deref(),
                &[Scattering::Splitting, Scattering::Roulette],
            )?,
            coherent: pick.switch(|f| f.coherent, true),
            search: pick.word(
                "search",
                |f| f.search.as_deref(),
                &[Search::Sphere, Search::Cylinder, Search::Ellipsoid],
            )?,
            incoming_direction: pick.switch(|f| f.incoming_direction, true),
            slice_height: pick.number("slice_height", |f| f.slice_height, 0.02)? as f32,
            area: pick.word(
                "area",
                |f| f.area.as_deref(),
                &[
                    Area::Disc,
                    Area::Hull,
                    Area::HullAsPublished,
                    Area::Circle,
                    Area::AlignedBox,
                    Area::OrientedBox,
                    Area::Ellipse,
                ],
            )?,
            partition: pick.word(
                "partition",
                |f| f.partition.as_deref(),
                &[Partition::None, Partition::Normal, Partition::Cell],
            )?,
            stop_recursion_size: pick.integer("stop_recursion_size", |f| f.stop_recursion_size, 12)? as u32,
            moving: pick.word("moving", |f| f.moving.as_deref(), &[Moving::Instances, Moving::Rebuild])?,
            blending: pick.word("blending", |f| f.blending.as_deref(), &[Blending::Multiply, Blending::Offset])?,
            cull_back_faces: pick.switch(|f| f.cull_back_faces, false),
            flashlight: pick.switch(|f| f.flashlight, false),
            seed,
        };
        let photons = photon_count(&s);
        if photons > MAX_PHOTONS {
            let advice =
                "lower photons_from_light, diffuse_reflections, recursion_depth, snowball_size or accumulation_frames";
            return Err(SettingError {
                place: "realtime".into(),
                what: format!("the map would hold {photons} photons, {MAX_PHOTONS} at most; {advice}"),
            });
        }
        Ok(s)
    }
}

/// Radius of a search over the scene's, where none is given.
const DEFAULT_RADIUS: f32 = 0.05;

struct Picker<'a> {
    scene: &'a Scene,
    flags: &'a RealtimeFile,
}

impl Picker<'_> {
    fn get<'s, T>(&'s self, f: impl Fn(&'s RealtimeFile) -> Option<T>) -> Option<T> {
        f(self.flags).or_else(|| f(&self.scene.realtime))
    }

    fn wrong<'s, T>(&'s self, key: &str, f: impl Fn(&'s RealtimeFile) -> Option<T>, what: String) -> SettingError {
        let place = if f(self.flags).is_some() {
            key.to_owned()
        } else {
            let (file, lines) = &self.scene.realtime_lines;
            format!("{}:{}: realtime.{key}", file.display(), lines.get(key).copied().unwrap_or(1))
        };
        SettingError { place, what }
    }

    fn values(key: &str) -> Values {
        // Every key that is picked is in the list: a test looks.
        PARAMETERS.iter().find(|p| p.name == key).map_or(Values::Switch, |p| p.values)
    }

    fn switch(&self, f: impl Fn(&RealtimeFile) -> Option<bool>, default: bool) -> bool {
        self.get(f).unwrap_or(default)
    }

    fn integer(&self, key: &str, f: impl Fn(&RealtimeFile) -> Option<i64>, default: i64) -> Result<i64, SettingError> {
        let value = self.get(&f).unwrap_or(default);
        match Self::values(key) {
            Values::Integer(low, high) if !(low..=high).contains(&value) => {
                Err(self.wrong(key, f, format!("must lie in {low} to {high}, got {value}")))
            }
            _ => Ok(value),
        }
    }

    /// A positive number; the default may be 0.
    fn number(&self, key: &str, f: impl Fn(&RealtimeFile) -> Option<f64>, default: f64) -> Result<f64, SettingError> {
        let Some(value) = self.get(&f) else { return Ok(default) };
        match Self::values(key) {
            Values::Number(high) if !(value > 0.0 && value <= high) => {
                Err(self.wrong(key, f, format!("must be positive and at most {high}, got {value}")))
            }
            _ => Ok(value),
        }
    }

    /// One of the words of the list, in whose order `all` are; the first by default.
    fn word<'s, T: Copy>(
        &'s self,
        key: &str,
        f: impl Fn(&'s RealtimeFile) -> Option<&'s str>,
        all: &[T],
    ) -> Result<T, SettingError> {
        let Some(text) = self.get(&f) else { return Ok(all[0]) };
        let Values::Words(words) = Self::values(key) else { return Ok(all[0]) };
        match words.iter().zip(all).find(|(w, _)| **w == text) {
            Some((_, value)) => Ok(*value),
            None => Err(self.wrong(key, f, format!("must be one of {}, got `{text}`", words.join(", ")))),
        }
    }

    fn distribution<'s>(
        &'s self,
        key: &str,
        f: impl Fn(&'s RealtimeFile) -> Option<&'s str>,
    ) -> Result<Distribution, SettingError> {
        let Some(_) = self.get(&f) else { return Ok(Distribution::Sobol) };
        self.word(key, f, &Distribution::ALL)
    }
}

/// Reads `KEY=VALUE` into a table of parameters.
///
/// # Errors
/// A key that is none, or a value of another type; one line.
pub fn set(table: &mut RealtimeFile, text: &str) -> Result<(), String> {
    let Some((key, value)) = text.split_once('=') else {
        return Err(format!("`{text}`: give KEY=VALUE, as in max_search_count=100"));
    };
    let (key, value) = (key.trim(), value.trim());
    let Some(parameter) = PARAMETERS.iter().find(|p| p.name == key) else {
        let names: Vec<&str> = PARAMETERS.iter().map(|p| p.name).collect();
        return Err(format!("no parameter `{key}`; there are {}", names.join(", ")));
    };
    let wanted = |what: &str| format!("{key}: wants {what}, got `{value}`");
    let parsed = match parameter.values {
        Values::Switch => value.parse::<bool>().map(toml::Value::Boolean).map_err(|_| wanted("true or false"))?,
        Values::Integer(..) => {
            // Numbers such as 2e4 count as whole ones.
            let number = value.parse::<f64>().map_err(|_| wanted("a whole number"))?;
            if number.fract() != 0.0 || number.abs() > 1e15 {
                return Err(wanted("a whole number"));
            }
            toml::Value::Integer(number as i64)
        }
        Values::Number(_) => value.parse::<f64>().map(toml::Value::Float).map_err(|_| wanted("a number"))?,
        Values::Words(_) => toml::Value::String(value.to_owned()),
    };
    let whole = |e: String| format!("{key}: {e}");
    let mut all = toml::Table::try_from(&*table).map_err(|e| whole(e.to_string()))?;
    all.insert(key.to_owned(), parsed);
    *table = all.try_into().map_err(|e: toml::de::Error| whole(e.message().to_owned()))?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::open;

    fn settings(texts: &[&str]) -> Result<RealtimeSettings, String> {
        let mut table = RealtimeFile::default();
        texts.iter().try_for_each(|t| set(&mut table, t))?;
        let scene = open("plane").expect("built in");
        RealtimeSettings::new(&scene, &table, 1).map_err(|e| e.to_string())
    }

    /// Every parameter takes a value of its range, refuses one out of it, and shows in the settings.
    #[test]
    fn every_parameter_is_there_and_checked() {
        let plain = serde_json::to_value(settings(&[]).expect("defaults")).expect("a table");
        assert_eq!(PARAMETERS.iter().filter(|p| p.number.is_some()).count(), 16);
        for p in PARAMETERS {
            let old = &plain[p.name];
            let (good, bad) = match p.values {
                Values::Switch => (format!("{}", !old.as_bool().expect(p.name)), "maybe".to_owned()),
                Values::Integer(low, high) => {
                    ((low + i64::from(old.as_i64() == Some(low))).to_string(), (high + 1).to_string())
                }
                Values::Number(high) => ((high / 2.0).to_string(), (2.0 * high).to_string()),
                Values::Words(words) => {
                    let other = words.iter().find(|w| Some(**w) != old.as_str()).expect("two words");
                    ((*other).to_owned(), "nonsense".to_owned())
                }
            };
            let changed = settings(&[&format!("{}={good}", p.name)]).expect(p.name);
            assert_ne!(serde_json::to_value(changed).expect("a table")[p.name], *old, "{}", p.name);
            let error = settings(&[&format!("{}={bad}", p.name)]).expect_err(p.name);
            assert!(error.contains(p.name) && !error.contains('\n'), "{error}");
        }
        assert!(settings(&["speed=3"]).expect_err("no such key").contains("no parameter `speed`"));
    }

    /// Figure 4.3, counted by hand.
    #[test]
    fn the_size_of_the_map_is_that_of_figure_4_3() {
        let s = settings(&["photons_from_light=100", "diffuse_reflections=9", "accumulation_frames=10"]).expect("fine");
        assert_eq!(photon_count(&s), (100 + 900) * 10);
        let s = RealtimeSettings { recursion_depth: 2, snowball_size: 3, store_direct_light: false, ..s };
        assert_eq!(photon_count(&s), (900 + 8100) * 3 * 10);
        let s = RealtimeSettings { scattering: Scattering::Roulette, recursion_depth: 4, ..s };
        assert_eq!(photon_count(&s), 100 * 4 * 3 * 10);
        let error = settings(&["recursion_depth=32"]).expect_err("too many");
        assert!(error.contains("268435456 at most"), "{error}");
    }
}
