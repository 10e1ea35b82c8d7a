//! Flags that several commands share.

use crate::cli::failure::Failure;
use crate::measure::study::sweep::whole_number;
use crate::render::film::Rect;
use crate::render::settings::{PlanMode, RenderSettings};
use crate::scene::Scene;
use crate::scene::scene_file::RenderFile;
use clap::{Args, ValueEnum};
use std::path::PathBuf;

/// Flags of the same name and meaning in every command that renders.
#[derive(Clone, Debug, Default, Args)]
pub struct CommonFlags {
    /// Estimator with its settings, as in multi_sampled:n=8,grid=cells
    #[arg(long, value_name = "E")]
    pub estimator: Option<String>,
    /// How photons are looked up: overlap (by footprint) or knn (k nearest)
    #[arg(long, value_name = "G")]
    pub gather: Option<String>,
    /// Photons that knn and density look up in each map
    #[arg(long, value_name = "K", value_parser = count, allow_negative_numbers = true)]
    pub k: Option<i64>,
    /// Photons emitted per pass (1e5 is fine)
    #[arg(long, value_name = "N", value_parser = count, allow_negative_numbers = true)]
    pub photons: Option<i64>,
    /// Factor on the axes of all photon footprints
    #[arg(long, value_name = "S", allow_negative_numbers = true)]
    pub footprint_scale: Option<f64>,
    /// Light to show: all, direct, caustic or global
    #[arg(long, value_name = "L")]
    pub light: Option<String>,
    /// Final gathering: none, classic, precomputed or ray-differentials, with settings as in classic:rays=800; where
    /// estimators are compared a list, each with each
    #[arg(long, value_name = "M")]
    pub final_gather: Option<String>,
    /// Rays of final gathering from each view hit; 200 if left out
    #[arg(long, value_name = "N", value_parser = count, allow_negative_numbers = true)]
    pub final_gather_rays: Option<i64>,
    /// Where direct light comes from: shadow_rays or photons
    #[arg(long, value_name = "D")]
    pub direct: Option<String>,
    /// Shadow rays to each light with area, for each view hit
    #[arg(long, value_name = "N", value_parser = count, allow_negative_numbers = true)]
    pub shadow_rays: Option<i64>,
    /// Numbers that photons are made of: sobol or random
    #[arg(long, value_name = "KIND")]
    pub sampling: Option<String>,
    /// Rule for footprints at diffuse bounces: polar or as_published
    #[arg(long, value_name = "RULE")]
    pub diffuse_spread: Option<String>,
    /// Whether caustic photons are emitted towards specular surfaces alone: where that pays (auto), or never (off)
    #[arg(long, value_name = "WHEN")]
    pub projection_map: Option<String>,
    /// Surfaces that a path may meet
    #[arg(long, value_name = "N", value_parser = count, allow_negative_numbers = true)]
    pub max_depth: Option<i64>,
    /// Specular view hits at which both branches are followed
    #[arg(long, value_name = "N", value_parser = count, allow_negative_numbers = true)]
    pub split_depth: Option<i64>,
    /// Parts that the scene does not need: left out (needed) or forced on (full)
    #[arg(long, value_name = "PLAN", value_enum, default_value = "needed")]
    pub plan: PlanFlag,
    /// Size of the image in pixels, instead of the scene's
    #[arg(long, value_name = "WxH", value_parser = size)]
    pub size: Option<[u32; 2]>,
    /// Seed of everything random; 1 if left out
    #[arg(long, value_name = "N")]
    pub seed: Option<u64>,
    /// Threads; all cores if left out
    #[arg(long, value_name = "T")]
    pub threads: Option<usize>,
    /// Folder for files
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Print JSON instead of a table
    #[arg(long)]
    pub json: bool,
    /// Print nothing but errors
    #[arg(long)]
    pub quiet: bool,
}

/// `--plan`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum PlanFlag {
    /// Leave out what is not needed.
    #[default]
    Needed,
    /// Force every part on.
    Full,
}

impl From<PlanFlag> for PlanMode {
    fn from(flag: PlanFlag) -> Self {
        match flag {
            PlanFlag::Needed => Self::Needed,
            PlanFlag::Full => Self::Full,
        }
    }
}

impl CommonFlags {
    /// Writes those that were given over `render`.
    pub fn onto(&self, render: &mut RenderFile) {
        fn over<T: Clone>(value: &mut Option<T>, flag: &Option<T>) {
            if flag.is_some() {
                value.clone_from(flag);
            }
        }
        over(&mut render.photons, &self.photons);
        over(&mut render.estimator, &self.estimator);
        over(&mut render.gather, &self.gather);
        over(&mut render.k, &self.k);
        over(&mut render.footprint_scale, &self.footprint_scale);
        over(&mut render.max_depth, &self.max_depth);
        over(&mut render.split_depth, &self.split_depth);
        over(&mut render.final_gather, &self.final_gather);
        over(&mut render.final_gather_rays, &self.final_gather_rays);
        over(&mut render.light, &self.light);
        over(&mut render.direct, &self.direct);
        over(&mut render.shadow_rays, &self.shadow_rays);
        over(&mut render.sampling, &self.sampling);
        over(&mut render.diffuse_spread, &self.diffuse_spread);
        over(&mut render.projection_map, &self.projection_map);
    }

    /// The scene's settings with these flags on top.
    ///
    /// # Errors
    /// A value out of range.
    pub fn settings(&self, scene: &Scene) -> Result<RenderSettings, Failure> {
        let mut flags = RenderFile::default();
        self.onto(&mut flags);
        let mut settings = RenderSettings::new(scene, &flags, self.size, self.seed.unwrap_or(1))?;
        settings.plan = self.plan.into();
        Ok(settings)
    }

    /// Runs `work` on as many threads as asked for.
    ///
    /// # Errors
    /// A number of threads that can't be, or what `work` returns.
    pub fn on_threads<T: Send>(&self, work: impl FnOnce() -> Result<T, Failure> + Send) -> Result<T, Failure> {
        match self.thread_pool()? {
            None => work(),
            Some((n, pool)) => pool.build().map_err(|e| Failure::Work(format!("--threads {n}: {e}")))?.install(work),
        }
    }

    /// Sets the number of threads of all work of this process that chooses none itself.
    ///
    /// # Errors
    /// A number of threads that can't be.
    pub fn set_threads(&self) -> Result<(), Failure> {
        match self.thread_pool()? {
            None => Ok(()),
            Some((n, pool)) => pool.build_global().map_err(|e| Failure::Work(format!("--threads {n}: {e}"))),
        }
    }

    /// The number of threads that was asked for, with a pool of so many to be built.
    fn thread_pool(&self) -> Result<Option<(usize, rayon::ThreadPoolBuilder)>, Failure> {
        match self.threads {
            None => Ok(None),
            Some(n @ 1..=1024) => Ok(Some((n, rayon::ThreadPoolBuilder::new().num_threads(n)))),
            Some(n) => Err(Failure::Call(format!("--threads: must lie in 1 to 1024, got {n}"))),
        }
    }
}

/// A whole number, as in `200000` or `2e5`.
///
/// # Errors
/// A text that is none.
pub fn count(text: &str) -> Result<i64, String> {
    whole_number(text).ok_or_else(|| "not a whole number".into())
}

/// `WxH`.
///
/// # Errors
/// A text that is no pair of whole numbers.
pub fn size(text: &str) -> Result<[u32; 2], String> {
    let wrong = || "write WIDTHxHEIGHT, as in 512x512".to_owned();
    let (w, h) = text.split_once(['x', 'X']).ok_or_else(wrong)?;
    let side = |s: &str| s.parse::<u32>().map_err(|_| wrong());
    Ok([side(w)?, side(h)?])
}

/// `x,y`.
///
/// # Errors
/// A text that is no pair of whole numbers from 0 on.
pub fn pixel(text: &str) -> Result<[u32; 2], String> {
    let numbers: Result<Vec<u32>, _> = text.split(',').map(|s| s.trim().parse()).collect();
    match numbers.as_deref() {
        Ok(&[x, y]) => Ok([x, y]),
        _ => Err("write column,row from 0, as in 256,200".into()),
    }
}

/// `x,y,w,h`.
///
/// # Errors
/// A text that is no rectangle with an area.
pub fn rect(text: &str) -> Result<Rect, String> {
    let numbers: Result<Vec<u32>, _> = text.split(',').map(|s| s.trim().parse()).collect();
    match numbers.as_deref() {
        Ok(&[x, y, width, height]) if width > 0 && height > 0 => Ok(Rect { x, y, width, height }),
        _ => Err("write x,y,width,height in pixels, as in 236,228,128,96".into()),
    }
}

/// Checks that `--crop` lies inside an image of `size` pixels.
///
/// # Errors
/// If it does not.
pub fn check_crop(crop: Rect, size: [u32; 2]) -> Result<(), Failure> {
    let fits = |at: u32, length: u32, size: u32| u64::from(at) + u64::from(length) <= u64::from(size);
    let [w, h] = size;
    if fits(crop.x, crop.width, w) && fits(crop.y, crop.height, h) {
        Ok(())
    } else {
        Err(Failure::Call(format!("--crop: leaves the image of {w}x{h} pixels")))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_read_as_people_write_them() {
        assert_eq!(count("200000"), Ok(200_000));
        assert_eq!(count("2e5"), Ok(200_000));
        assert_eq!(count("-3"), Ok(-3));
        assert_eq!(count("1e18"), Ok(1_000_000_000_000_000_000));
        assert!(count("1e19").is_err());
        assert!(count("nan").is_err() && count("1.5").is_err() && count("").is_err());
        assert_eq!(size("640x480"), Ok([640, 480]));
        assert_eq!(pixel("3, 4"), Ok([3, 4]));
        assert!(pixel("3").is_err() && pixel("-1,2").is_err() && pixel("1,2,3").is_err());
        assert!(size("640").is_err() && size("-1x5").is_err());
        assert!(rect("1,2,3,4").is_ok() && rect("1,2,0,4").is_err() && rect("1,2,3").is_err());
    }
}
