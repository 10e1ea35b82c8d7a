//! Final gathering as a setting: whether global light comes from the photons around a view hit, or from one more bounce of
//! many rays, and how.

use crate::estimate::settings::{Spec, SpecError};
use crate::estimate::{Construction, Estimator, Gathered, Lookup, View};
use crate::photons::MapPhoton;
use glam::DVec3;
use std::fmt;

/// What is looked up where a gather ray ends.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum FinalGatherMethod {
    /// The k nearest photons, over the disc that they fill (Jensen 2001).
    Classic,
    /// The nearest precomputed irradiance (Christensen 1999).
    Precomputed,
    /// The mean of precomputed irradiance over the ray's footprint (Gjøl, Larsen and Christensen).
    RayDifferentials,
}

impl FinalGatherMethod {
    /// All of them, with their names in flags and files.
    pub const ALL: [(&'static str, Self); 3] =
        [("classic", Self::Classic), ("precomputed", Self::Precomputed), ("ray-differentials", Self::RayDifferentials)];

    /// Where it comes from.
    pub fn source(self) -> &'static str {
        match self {
            Self::Classic => "Jensen 2001",
            Self::Precomputed => "Christensen 1999",
            Self::RayDifferentials => "Gjøl, Larsen and Christensen, Final Gathering using Ray Differentials",
        }
    }

    /// What it is.
    pub fn summary(self) -> &'static str {
        match self {
            Self::Classic => "gather rays look the k nearest photons up",
            Self::Precomputed => "gather rays take the nearest precomputed irradiance",
            Self::RayDifferentials => "gather rays average precomputed irradiance over their footprints",
        }
    }

    /// Its name in flags and files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Classic => "classic",
            Self::Precomputed => "precomputed",
            Self::RayDifferentials => "ray-differentials",
        }
    }
}

/// How the gather rays of a view hit are spread over its hemisphere, with density `cos θ/π`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum GatherPattern {
    /// One random direction in each of N strata of rings and sectors (Jensen 2003; as published).
    Stratified,
    /// Owen-scrambled Sobol points.
    Sobol,
    /// A spiral of the golden angle, turned at random: footprints tile the hemisphere.
    Spiral,
}

/// All patterns, with their names in flags and files.
pub const PATTERNS: [(&str, GatherPattern); 3] =
    [("spiral", GatherPattern::Spiral), ("sobol", GatherPattern::Sobol), ("stratified", GatherPattern::Stratified)];

/// Which estimates under a footprint count.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FootprintReach {
    /// Those whose normals agree with that of the surface that the ray has met.
    Surface,
    /// All that face the ray, also on other surfaces (as published).
    Facing,
}

/// Both, with their names in flags and files.
pub const REACHES: [(&str, FootprintReach); 2] =
    [("surface", FootprintReach::Surface), ("facing", FootprintReach::Facing)];

const CORRECTED: [(&str, bool); 2] = [("corrected", false), ("as_published", true)];

/// Final gathering by one method with its settings.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FinalGathering {
    /// What is looked up.
    pub method: FinalGatherMethod,
    /// Rays from each view hit, 1 to [`MAX_RAYS`].
    pub rays: u32,
    /// How they are spread.
    pub pattern: GatherPattern,
    /// Footprints of `r_f = √(2π/N)`, over cos θ, in place of `1/√(N cos θ)`.
    pub differentials_as_published: bool,
    /// Irradiance over whole discs and plain means of it, in place of the surface that discs hold and means by area.
    pub estimates_as_published: bool,
    /// Which estimates under a footprint count.
    pub reach: FootprintReach,
    /// Radius of the first search for photons, and of the first layer of the pyramid, metres, positive; None for the disc
    /// that holds k photons on average.
    pub radius: Option<f32>,
    /// Ratio of radii from layer to layer, above 1.
    pub growth: f32,
    /// Distance (metres) below which a ray that has met a surface gathers a second time from there; 0 for never.
    pub near: f32,
}

/// Settings of every method with their values, the default first.
pub const SETTINGS: &str = "rays=200, pattern=spiral|sobol|stratified, differentials=corrected|as_published, \
    estimates=corrected|as_published, reach=surface|facing, radius=auto|METRES, growth=2, near=METRES";

/// Most rays from a view hit.
pub const MAX_RAYS: u32 = 1 << 16;
/// Rays from a view hit where nothing else is asked for.
pub const DEFAULT_RAYS: u32 = 200;

/// Keys of its settings, as the command line's `--sweep` knows them too.
pub const KEYS: [&str; 8] = ["rays", "pattern", "differentials", "estimates", "reach", "radius", "growth", "near"];

impl FinalGathering {
    /// That method with its default settings.
    pub fn new(method: FinalGatherMethod) -> Self {
        Self {
            method,
            rays: DEFAULT_RAYS,
            pattern: GatherPattern::Spiral,
            differentials_as_published: false,
            estimates_as_published: false,
            reach: FootprintReach::Surface,
            radius: None,
            growth: 2.0,
            near: 0.0,
        }
    }

    /// Reads `classic`, or `ray-differentials:rays=800,pattern=sobol`; `none` gives None.
    ///
    /// # Errors
    /// An unknown method or setting, or a value out of range.
    pub fn parse(text: &str) -> Result<Option<Self>, SpecError> {
        Self::parse_with(text, DEFAULT_RAYS)
    }

    /// The same with so many rays where the text names none.
    ///
    /// # Errors
    /// As [`FinalGathering::parse`].
    pub fn parse_with(text: &str, rays: u32) -> Result<Option<Self>, SpecError> {
        let spec = Spec::parse(text)?;
        if spec.id == "none" {
            spec.only(&[])?;
            return Ok(None);
        }
        let id = spec.id.replace('_', "-");
        let Some((_, method)) = FinalGatherMethod::ALL.into_iter().find(|(name, _)| *name == id) else {
            let names: Vec<_> = FinalGatherMethod::ALL.iter().map(|(name, _)| *name).collect();
            let what = format!("no final gathering `{}`; there are none, {}", spec.id, names.join(", "));
            return Err(spec.error(what));
        };
        spec.only(&KEYS)?;
        let default = Self::new(method);
        let number = |key: &str, low: f32, high: f32, what: &str| match spec.get(key) {
            None => Ok(None),
            Some(text) => match text.parse::<f32>() {
                Ok(x) if x > low && x <= high => Ok(Some(x)),
                _ => Err(spec.error(format!("`{key}` must be {what}, got `{text}`"))),
            },
        };
        Ok(Some(Self {
            method,
            rays: spec.integer("rays", rays, 1..=MAX_RAYS)?,
            pattern: spec.choice("pattern", default.pattern, &PATTERNS)?,
            differentials_as_published: spec.choice("differentials", false, &CORRECTED)?,
            estimates_as_published: spec.choice("estimates", false, &CORRECTED)?,
            reach: spec.choice("reach", default.reach, &REACHES)?,
            radius: match spec.get("radius") {
                Some("auto") => None,
                _ => number("radius", 0.0, 1e30, "auto or a length in metres above 0")?,
            },
            growth: number("growth", 1.05, 16.0, "above 1.05 and at most 16")?.unwrap_or(default.growth),
            near: match spec.get("near") {
                Some("0") => 0.0,
                _ => number("near", 0.0, 1e30, "a length in metres")?.unwrap_or(0.0),
            },
        }))
    }
}

impl fmt::Display for FinalGathering {
    /// As [`FinalGathering::parse`] reads it: the rays, and what is not the default.
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "{}:rays={}", self.method.name(), self.rays)?;
        let default = Self::new(self.method);
        if self.pattern != default.pattern {
            let name = PATTERNS.iter().find(|(_, p)| *p == self.pattern).map_or("", |(name, _)| name);
            write!(f, ",pattern={name}")?;
        }
        for (key, published) in
            [("differentials", self.differentials_as_published), ("estimates", self.estimates_as_published)]
        {
            if published {
                write!(f, ",{key}=as_published")?;
            }
        }
        if self.reach != default.reach {
            f.write_str(",reach=facing")?;
        }
        if let Some(radius) = self.radius {
            write!(f, ",radius={radius}")?;
        }
        if self.growth != default.growth {
            write!(f, ",growth={}", self.growth)?;
        }
        if self.near > 0.0 {
            write!(f, ",near={}", self.near)?;
        }
        Ok(())
    }
}

impl serde::Serialize for FinalGathering {
    /// As its text.
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}

/// An estimator whose global light comes from final gathering; caustics, and direct photons, stay its own.
pub struct WithFinalGathering {
    inner: Box<dyn Estimator>,
    final_gathering: FinalGathering,
}

impl WithFinalGathering {
    /// `inner` with that final gathering.
    pub fn new(inner: Box<dyn Estimator>, final_gathering: FinalGathering) -> Self {
        Self { inner, final_gathering }
    }
}

impl Estimator for WithFinalGathering {
    fn id(&self) -> &'static str {
        self.inner.id()
    }

    fn settings(&self) -> String {
        self.inner.settings()
    }

    fn lookup(&self) -> Lookup {
        self.inner.lookup()
    }

    fn rays_per_axis(&self) -> u32 {
        self.inner.rays_per_axis()
    }

    fn is_consistent(&self) -> bool {
        let f = &self.final_gathering;
        let exact = match f.method {
            // A fixed k keeps its bias however small the disc.
            FinalGatherMethod::Classic => false,
            _ => !f.estimates_as_published,
        };
        self.inner.is_consistent() && exact
    }

    fn is_exact_mean(&self) -> bool {
        self.inner.is_exact_mean()
    }

    fn final_gathering(&self) -> Option<&FinalGathering> {
        Some(&self.final_gathering)
    }

    fn weight(&self, photon: &MapPhoton, view: &View, radius: f32) -> f64 {
        self.inner.weight(photon, view, radius)
    }

    fn irradiance(&self, gathered: &Gathered, view: &View) -> DVec3 {
        self.inner.irradiance(gathered, view)
    }

    fn irradiances<'a>(&self, hits: &mut dyn Iterator<Item = (Gathered<'a>, View)>, put: &mut dyn FnMut(DVec3)) {
        self.inner.irradiances(hits, put);
    }

    fn construction(&self, photon: &MapPhoton, view: &View) -> Construction {
        self.inner.construction(photon, view)
    }

    fn name(&self) -> String {
        format!("{}+{}", self.inner.name(), self.final_gathering)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn settings_come_back_as_they_were_given() {
        for text in [
            "classic:rays=200",
            "precomputed:rays=1,radius=0.05",
            "ray-differentials:rays=800,pattern=stratified,differentials=as_published,estimates=as_published,reach=facing",
            "ray-differentials:rays=65536,pattern=sobol,growth=1.5,near=0.25",
        ] {
            let parsed = FinalGathering::parse(text).expect("valid").expect("some");
            assert_eq!(parsed.to_string(), text);
        }
        assert_eq!(FinalGathering::parse("none"), Ok(None));
        let short = FinalGathering::parse("ray_differentials").expect("valid");
        assert_eq!(short, Some(FinalGathering::new(FinalGatherMethod::RayDifferentials)));
    }

    /// What the list of settings says is what is read, and each setting has its key.
    #[test]
    fn the_list_of_settings_is_read_as_it_stands() {
        let known: Vec<&str> = SETTINGS.split(", ").filter_map(|s| s.split('=').next()).map(str::trim).collect();
        assert_eq!(known, KEYS);
        for setting in SETTINGS.split(", ") {
            let (key, values) = setting.trim().split_once('=').expect("a setting");
            for value in values.split('|') {
                let value = if value == "METRES" { "0.25" } else { value };
                let text = format!("precomputed:{key}={value}");
                assert!(FinalGathering::parse(&text).is_ok(), "{text}");
            }
            let default = values.split('|').next().filter(|v| *v != "METRES").unwrap_or("0");
            let parsed = FinalGathering::parse(&format!("precomputed:{key}={default}")).expect("valid");
            assert_eq!(parsed, Some(FinalGathering::new(FinalGatherMethod::Precomputed)), "{key}");
        }
    }

    #[test]
    fn wrong_settings_are_named() {
        for (text, part) in [
            ("some", "there are none, classic, precomputed, ray-differentials"),
            ("none:rays=3", "takes none"),
            ("classic:rays=0", "1 to 65536"),
            ("classic:n=3", "it takes rays, pattern"),
            ("classic:radius=-1", "metres above 0"),
            ("classic:radius=nan", "metres above 0"),
            ("classic:growth=1", "above 1.05"),
            ("classic:near=inf", "a length"),
        ] {
            let e = FinalGathering::parse(text).expect_err("wrong").to_string();
            assert!(e.contains(part), "{e}");
        }
    }
}
