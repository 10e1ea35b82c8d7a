//! Settings of a render: the scene's `[render]` table with the command line's flags on top, checked.

use crate::estimate::final_gathering::{DEFAULT_RAYS, FinalGathering, MAX_RAYS};
use crate::estimate::settings::SpecError;
use crate::estimate::{Estimator, registry};
use crate::math::sequence::Sampling;
use crate::photons::spread::DiffuseSpread;
use crate::render::memory::check_images;
use crate::scene::Scene;
use crate::scene::error::one_line;
use crate::scene::scene_file::RenderFile;
use serde::{Deserialize, Serialize};

/// How photons are looked up.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Gather {
    /// The k nearest of each map, as published.
    Knn,
    /// Every photon whose footprint meets the query.
    Overlap,
}

impl Gather {
    /// Its name in flags and files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Knn => "knn",
            Self::Overlap => "overlap",
        }
    }
}

/// Which light an image shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum LightPart {
    /// Everything.
    All,
    /// Light straight from the lights, and the lights themselves.
    Direct,
    /// Light that came by specular surfaces alone.
    Caustic,
    /// Light that was scattered before.
    Global,
}

/// Where direct light comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum DirectLight {
    /// Shadow rays.
    ShadowRays,
    /// Stored direct photons.
    Photons,
}

/// Whether parts that the scene does not need are left out.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Default)]
#[serde(rename_all = "snake_case")]
pub enum PlanMode {
    /// They are.
    #[default]
    Needed,
    /// Every part is forced on.
    Full,
}

/// Whether caustic photons are emitted towards specular surfaces alone.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Default)]
#[serde(rename_all = "snake_case")]
pub enum Projection {
    /// Where the plan finds that it pays.
    #[default]
    Auto,
    /// Never: photons leave the lights everywhere.
    Off,
}

/// Everything that decides an image, but the scene and the estimators.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RenderSettings {
    /// Photons emitted per pass, at least 1.
    pub photons: u64,
    /// Estimator of `render`, with its settings.
    pub estimator: String,
    /// How photons are looked up.
    pub gather: Gather,
    /// Photons that `knn` and `density` look up in each map, at least 1.
    pub k: usize,
    /// Factor on the axes of all photon footprints, positive.
    pub footprint_scale: f32,
    /// Surfaces that a path may meet, at least 1.
    pub max_depth: u32,
    /// Specular view hits at which both branches are followed.
    pub split_depth: u32,
    /// Final gatherings of estimators that name none themselves, as in `none,classic:rays=800`; most commands take one.
    #[serde(default = "no_final_gathering")]
    pub final_gather: String,
    /// Which light is shown.
    pub light: LightPart,
    /// Where direct light comes from.
    pub direct: DirectLight,
    /// Shadow rays to each light with area for each view hit, at least 1.
    pub shadow_rays: u32,
    /// Numbers that photons are made of.
    pub sampling: Sampling,
    /// Rule for diffuse bounces.
    pub diffuse_spread: DiffuseSpread,
    /// Whether caustic photons are emitted by a projection map.
    #[serde(default)]
    pub projection_map: Projection,
    /// Pixels across and down.
    pub size: [u32; 2],
    /// Seed of everything random.
    pub seed: u64,
    /// Whether unneeded parts are left out.
    pub plan: PlanMode,
}

fn no_final_gathering() -> String {
    "none".into()
}

/// A setting that can't be; one line.
#[derive(Debug, thiserror::Error)]
#[error("{}", one_line(&format!("{place}: {what}")))]
pub struct SettingError {
    /// The flag, or file, line and key.
    pub place: String,
    /// What is wrong and what would be right.
    pub what: String,
}

/// Largest number of photons in a pass; an index must fit a map.
pub const MAX_PHOTONS: i64 = 1 << 31;
/// Largest number of pixels across or down.
pub const MAX_SIZE: u32 = crate::scene::load::MAX_RESOLUTION as u32;
/// Largest number of pixels.
pub const MAX_PIXELS: u64 = crate::scene::load::MAX_PIXELS;

impl RenderSettings {
    /// The scene's settings with `flags` on top. `size` and `seed` are the command line's alone.
    ///
    /// # Errors
    /// The first value out of range, by its flag or its line in the scene file.
    pub fn new(scene: &Scene, flags: &RenderFile, size: Option<[u32; 2]>, seed: u64) -> Result<Self, SettingError> {
        let pick = Picker { scene, flags };
        let settings = Self {
            photons: pick.integer("photons", |f| f.photons, 200_000, 1, MAX_PHOTONS)? as u64,
            estimator: pick.estimator()?,
            gather: pick.choice(
                "gather",
                |f| f.gather.as_deref(),
                Gather::Overlap,
                &[("knn", Gather::Knn), ("overlap", Gather::Overlap)],
            )?,
            k: pick.integer("k", |f| f.k, 50, 1, 1_000_000)? as usize,
            footprint_scale: pick.positive("footprint_scale", |f| f.footprint_scale, 3.0, 1e6)? as f32,
            max_depth: pick.integer("max_depth", |f| f.max_depth, 20, 1, 1000)? as u32,
            split_depth: pick.integer("split_depth", |f| f.split_depth, 1, 0, 8)? as u32,
            final_gather: pick.final_gather()?,
            light: pick.choice(
                "light",
                |f| f.light.as_deref(),
                LightPart::All,
                &[
                    ("all", LightPart::All),
                    ("direct", LightPart::Direct),
                    ("caustic", LightPart::Caustic),
                    ("global", LightPart::Global),
                ],
            )?,
            direct: pick.choice(
                "direct",
                |f| f.direct.as_deref(),
                DirectLight::ShadowRays,
                &[("shadow_rays", DirectLight::ShadowRays), ("photons", DirectLight::Photons)],
            )?,
            shadow_rays: pick.integer("shadow_rays", |f| f.shadow_rays, 4, 1, 4096)? as u32,
            sampling: pick.choice(
                "sampling",
                |f| f.sampling.as_deref(),
                Sampling::Sobol,
                &[("sobol", Sampling::Sobol), ("random", Sampling::Random)],
            )?,
            diffuse_spread: pick.choice(
                "diffuse_spread",
                |f| f.diffuse_spread.as_deref(),
                DiffuseSpread::Polar,
                &[("polar", DiffuseSpread::Polar), ("as_published", DiffuseSpread::AsPublished)],
            )?,
            projection_map: pick.choice(
                "projection_map",
                |f| f.projection_map.as_deref(),
                Projection::Auto,
                &[("auto", Projection::Auto), ("off", Projection::Off)],
            )?,
            size: size.unwrap_or(scene.camera.resolution),
            seed,
            plan: PlanMode::Needed,
        };
        let [w, h] = settings.size;
        if w == 0 || h == 0 || w > MAX_SIZE || h > MAX_SIZE || u64::from(w) * u64::from(h) > MAX_PIXELS {
            return Err(SettingError {
                place: if size.is_some() { "--size".into() } else { "camera.resolution".into() },
                what: format!(
                    "{w}x{h} pixels; give 1 to {MAX_SIZE} each way, and {} million in all at most",
                    MAX_PIXELS >> 20
                ),
            });
        }
        check_images(&settings, 1)
            .map_err(|e| SettingError { place: if size.is_some() { "--size".into() } else { e.place }, ..e })?;
        Ok(settings)
    }

    /// Rays of one pass under so many estimators, to the power of ten: three or four for a photon, and for a pixel those of
    /// its view paths and shadows.
    pub fn rays_of_pass(&self, estimators: usize) -> u64 {
        let pixels = u64::from(self.size[0]) * u64::from(self.size[1]);
        let views = pixels.saturating_mul(8 * estimators as u64);
        self.photons.saturating_mul(4).saturating_add(views)
    }

    /// The final gatherings of [`RenderSettings::final_gather`]; None stands for `none`.
    pub fn final_gatherings(&self) -> Vec<Option<FinalGathering>> {
        // Its text was read when the settings were made.
        registry::final_gatherings(&self.final_gather, DEFAULT_RAYS).unwrap_or_else(|_| vec![None])
    }

    /// Each estimator that names no final gathering itself with each of these settings' in turn.
    ///
    /// # Errors
    /// None, if the estimators came from the registry.
    pub fn with_final_gathering(
        &self,
        estimators: &[Box<dyn Estimator>],
    ) -> Result<Vec<Box<dyn Estimator>>, SpecError> {
        registry::with_final_gathering(estimators, &self.final_gatherings())
    }

    /// The estimator with its final gathering.
    ///
    /// # Errors
    /// More than one final gathering.
    pub fn chosen(&self) -> Result<Box<dyn Estimator>, SpecError> {
        let mut all = self.with_final_gathering(&[registry::estimator(&self.estimator)?])?;
        match (all.pop(), all.is_empty()) {
            (Some(one), true) => Ok(one),
            _ => Err(SpecError {
                text: self.final_gather.clone(),
                what: "here one final gathering is meant; `cusp compare` shows several side by side".into(),
            }),
        }
    }
}

struct Picker<'a> {
    scene: &'a Scene,
    flags: &'a RenderFile,
}

impl Picker<'_> {
    fn get<'s, T>(&'s self, f: impl Fn(&'s RenderFile) -> Option<T>) -> (Option<T>, bool) {
        match f(self.flags) {
            Some(v) => (Some(v), true),
            None => (f(&self.scene.render), false),
        }
    }

    fn wrong(&self, key: &str, from_flag: bool, what: String) -> SettingError {
        let place = if from_flag {
            format!("--{}", key.replace('_', "-"))
        } else {
            let (file, lines) = &self.scene.render_lines;
            format!("{}:{}: render.{key}", file.display(), lines.get(key).copied().unwrap_or(1))
        };
        SettingError { place, what }
    }

    fn integer(
        &self,
        key: &str,
        f: impl Fn(&RenderFile) -> Option<i64>,
        default: i64,
        low: i64,
        high: i64,
    ) -> Result<i64, SettingError> {
        let (value, from_flag) = self.get(f);
        let value = value.unwrap_or(default);
        if (low..=high).contains(&value) {
            Ok(value)
        } else {
            Err(self.wrong(key, from_flag, format!("must lie in {low} to {high}, got {value}")))
        }
    }

    fn positive(
        &self,
        key: &str,
        f: impl Fn(&RenderFile) -> Option<f64>,
        default: f64,
        high: f64,
    ) -> Result<f64, SettingError> {
        let (value, from_flag) = self.get(f);
        let value = value.unwrap_or(default);
        if value > 0.0 && value <= high {
            Ok(value)
        } else {
            Err(self.wrong(key, from_flag, format!("must be positive and at most {high}, got {value}")))
        }
    }

    fn choice<'s, T: Copy>(
        &'s self,
        key: &str,
        f: impl Fn(&'s RenderFile) -> Option<&'s str>,
        default: T,
        all: &[(&str, T)],
    ) -> Result<T, SettingError> {
        let (value, from_flag) = self.get(f);
        let Some(text) = value else { return Ok(default) };
        all.iter().find(|(n, _)| *n == text).map(|(_, v)| *v).ok_or_else(|| {
            let names: Vec<_> = all.iter().map(|(n, _)| *n).collect();
            self.wrong(key, from_flag, format!("must be one of {}, got `{text}`", names.join(", ")))
        })
    }

    fn final_gather(&self) -> Result<String, SettingError> {
        let most = i64::from(MAX_RAYS);
        let rays = self.integer("final_gather_rays", |f| f.final_gather_rays, i64::from(DEFAULT_RAYS), 1, most)?;
        let (value, from_flag) = self.get(|f| f.final_gather.as_deref());
        let Some(text) = value else { return Ok(no_final_gathering()) };
        let all = registry::final_gatherings(text, rays as u32)
            .map_err(|e| self.wrong("final_gather", from_flag, e.to_string()))?;
        let name = |f: Option<FinalGathering>| f.map_or_else(no_final_gathering, |f| f.to_string());
        Ok(all.into_iter().map(name).collect::<Vec<_>>().join(","))
    }

    fn estimator(&self) -> Result<String, SettingError> {
        let (value, from_flag) = self.get(|f| f.estimator.as_deref());
        match registry::estimator(value.unwrap_or("integrated")) {
            Ok(e) => Ok(e.name()),
            Err(e) => Err(self.wrong("estimator", from_flag, e.what)),
        }
    }
}
