//! The plan of a study: what is rendered, how far, and which part of it a shard does.

use crate::math::hash::{FNV_START, fnv1a};
use crate::measure::study::Setting;
use crate::render::settings::RenderSettings;
use crate::scene::Scene;
use serde::{Deserialize, Serialize};

/// Version of the files that a study keeps.
pub const FORMAT: u32 = 1;

/// What a study renders. Two studies of the same plan have the same images.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct StudyPlan {
    /// Version of the files, [`FORMAT`].
    pub study: u32,
    /// Version of Cusp.
    pub version: String,
    /// The scene as the command line named it.
    pub scene: String,
    /// Name of the scene.
    pub scene_name: String,
    /// Hash of the scene's files, 16 hexadecimal digits.
    pub scene_hash: String,
    /// What is the same for all settings.
    pub base: RenderSettings,
    /// What is compared.
    pub settings: Vec<Setting>,
    /// Seeds with which each setting is rendered.
    pub seeds: Vec<u64>,
    /// Passes after which a curve ends.
    pub passes: Option<u32>,
    /// Seconds of rendering after which a curve ends, at the next checkpoint.
    pub seconds: Option<f64>,
}

/// One setting with one seed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Task {
    /// Index of the setting.
    pub setting: usize,
    /// The seed.
    pub seed: u64,
}

impl Task {
    /// Name of its files.
    pub fn name(&self) -> String {
        format!("{:04}-{}", self.setting, self.seed)
    }
}

impl StudyPlan {
    /// A plan; `scene` is as the command line names it.
    pub fn new(
        named: &str,
        scene: &Scene,
        base: RenderSettings,
        settings: Vec<Setting>,
        seeds: Vec<u64>,
        passes: Option<u32>,
        seconds: Option<f64>,
    ) -> Self {
        Self {
            study: FORMAT,
            version: env!("CARGO_PKG_VERSION").into(),
            scene: named.into(),
            scene_name: scene.name.clone(),
            scene_hash: format!("{:016x}", scene.hash),
            base,
            settings,
            seeds,
            passes,
            seconds,
        }
    }

    /// All tasks. Settings follow each other under one seed before the next seed, so that a machine whose speed drifts
    /// is fair to all.
    pub fn tasks(&self) -> Vec<Task> {
        self.seeds
            .iter()
            .flat_map(|&seed| (0..self.settings.len()).map(move |setting| Task { setting, seed }))
            .collect()
    }

    /// The tasks of a shard.
    pub fn tasks_of(&self, shard: Shard) -> Vec<Task> {
        self.tasks().into_iter().skip(shard.number as usize - 1).step_by(shard.count as usize).collect()
    }

    /// Whether `other` renders the same images: all but the path by which the scene was named.
    pub fn is_same_study(&self, other: &Self) -> bool {
        *self == Self { scene: self.scene.clone(), ..other.clone() }
    }

    /// A number that is the same for the same study.
    ///
    /// # Errors
    /// A defect: a plan that JSON cannot hold.
    pub fn hash(&self) -> Result<u64, String> {
        let plan = Self { scene: String::new(), ..self.clone() };
        serde_json::to_vec(&plan).map(|bytes| fnv1a(FNV_START, &bytes)).map_err(|e| format!("JSON: {e}"))
    }
}

/// Whether an image is kept after so many passes: 1, 2, 4, 8 and so on.
pub fn is_checkpoint(passes: u32) -> bool {
    passes.is_power_of_two()
}

/// Part `number` of `count`, from 1.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Shard {
    /// From 1 to `count`.
    pub number: u32,
    /// At least 1.
    pub count: u32,
}

impl Shard {
    /// All of it.
    pub const WHOLE: Self = Self { number: 1, count: 1 };

    /// Reads `i/n`.
    ///
    /// # Errors
    /// A text that is no such part.
    pub fn parse(text: &str) -> Result<Self, String> {
        let numbers = text.split_once('/').and_then(|(i, n)| Some((i.trim().parse().ok()?, n.trim().parse().ok()?)));
        match numbers {
            Some((number, count)) if (1..=count).contains(&number) => Ok(Self { number, count }),
            _ => Err("write i/n with i from 1 to n, as in 2/8".into()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::open;
    use crate::scene::scene_file::RenderFile;

    fn plan() -> StudyPlan {
        let scene = open("ring").expect("built in");
        let base = RenderSettings::new(&scene, &RenderFile::default(), None, 1).expect("valid");
        let names = ["density:kernel=none", "regular", "integrated"];
        let settings = names.map(|n| Setting {
            estimator: n.into(),
            gather: crate::render::Gather::Overlap,
            photons: 10,
            k: None,
            footprint_scale: None,
        });
        StudyPlan::new("ring", &scene, base, settings.into(), vec![1, 2, 3, 4], Some(8), None)
    }

    #[test]
    fn shards_share_all_tasks() {
        let plan = plan();
        for count in [1, 2, 5, 20] {
            let mut all: Vec<Task> = (1..=count).flat_map(|number| plan.tasks_of(Shard { number, count })).collect();
            all.sort_by_key(|t| (t.seed, t.setting));
            assert_eq!(all, plan.tasks(), "{count}");
        }
        assert_eq!(plan.tasks_of(Shard { number: 13, count: 20 }), []);
    }

    #[test]
    fn a_plan_comes_back_and_its_path_does_not_matter() {
        let one = plan();
        let text = serde_json::to_string(&one).expect("JSON");
        let back: StudyPlan = serde_json::from_str(&text).expect("reads");
        assert_eq!(back, one);
        let moved = StudyPlan { scene: "elsewhere/ring.toml".into(), ..back };
        assert!(one.is_same_study(&moved) && one.hash() == moved.hash());
        let other = StudyPlan { passes: Some(9), ..moved };
        assert!(!one.is_same_study(&other) && one.hash() != other.hash());
    }

    #[test]
    fn parts_are_read() {
        assert_eq!(Shard::parse("2/8"), Ok(Shard { number: 2, count: 8 }));
        for wrong in ["", "3", "0/2", "3/2", "1/0", "-1/2", "a/b", "1/2/3"] {
            assert!(Shard::parse(wrong).is_err(), "{wrong}");
        }
    }
}
