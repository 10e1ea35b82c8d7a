//! What is swept: values for photons, k, n, footprint scale and gather, and all their combinations.

use crate::estimate::Estimator;
use crate::estimate::final_gathering::KEYS;
use crate::estimate::registry::{estimator, with_setting};
use crate::measure::study::Setting;
use crate::render::settings::RenderSettings;
use crate::scene::Scene;
use crate::scene::scene_file::RenderFile;
use std::collections::HashSet;

/// Most settings that a study may have.
pub const MAX_SETTINGS: usize = 10_000;
/// Largest number of combinations of values, of which many may be the same setting.
const MAX_COMBINATIONS: usize = 1_000_000;

/// Values of each swept setting; one that is empty is not swept.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Sweep {
    photons: Vec<i64>,
    k: Vec<i64>,
    /// Settings of estimators and of their final gathering.
    own: Vec<(String, Vec<String>)>,
    footprint_scale: Vec<f64>,
    gather: Vec<String>,
}

/// A value, or none where a setting is not swept.
fn each<T: Clone>(values: &[T]) -> Vec<Option<T>> {
    if values.is_empty() { vec![None] } else { values.iter().cloned().map(Some).collect() }
}

impl Sweep {
    /// Reads `photons=1e4,1e5`, `n=2,4,8` and the like; each setting once.
    ///
    /// # Errors
    /// A text of another form, an unknown setting, or one that comes twice. Values are checked by [`Sweep::settings`].
    pub fn parse(texts: &[String]) -> Result<Self, String> {
        let mut sweep = Self::default();
        for text in texts {
            let (key, values) = text
                .split_once('=')
                .ok_or_else(|| format!("--sweep {text}: write SETTING=VALUE,VALUE, as in photons=1e4,1e5"))?;
            let values: Vec<&str> = values.split(',').map(str::trim).filter(|v| !v.is_empty()).collect();
            if values.is_empty() {
                return Err(format!("--sweep {text}: give at least one value"));
            }
            let whole = |into: &mut Vec<i64>| fill(into, text, &values, whole_number);
            match key.trim().replace('-', "_").as_str() {
                "photons" => whole(&mut sweep.photons),
                "k" => whole(&mut sweep.k),
                "n" => sweep.fill_own(text, "n", &values),
                own if KEYS.contains(&own) => sweep.fill_own(text, own, &values),
                "footprint_scale" => fill(&mut sweep.footprint_scale, text, &values, |v| v.parse().ok()),
                "gather" => fill(&mut sweep.gather, text, &values, |v| Some(v.to_owned())),
                other => Err(format!(
                    "--sweep {other}: sweep photons, k, n, footprint_scale, gather, or of final gathering {}",
                    KEYS.join(", ")
                )),
            }?;
        }
        Ok(sweep)
    }

    /// All combinations with the estimators, each once, in the order of the estimators. `flags` are the command line's,
    /// under which the swept values lie.
    ///
    /// # Errors
    /// A value out of range, or more than [`MAX_SETTINGS`] combinations.
    pub fn settings(
        &self,
        scene: &Scene,
        flags: &RenderFile,
        estimators: &[Box<dyn Estimator>],
    ) -> Result<Vec<Setting>, String> {
        let lists = [self.photons.len(), self.k.len(), self.footprint_scale.len(), self.gather.len()];
        let own = self.own.iter().map(|(_, values)| values.len());
        let combinations = lists.into_iter().chain(own).fold(estimators.len(), |all, n| all.saturating_mul(n.max(1)));
        if combinations > MAX_COMBINATIONS {
            return Err(format!("--sweep: {combinations} combinations, {MAX_COMBINATIONS} at most; sweep less"));
        }
        let mut all: Vec<Setting> = Vec::new();
        let mut seen = HashSet::new();
        for e in estimators {
            for name in self.varied(&e.name())? {
                let e = &*estimator(&name).map_err(|e| format!("--sweep: {e}"))?;
                for gather in each(&self.gather) {
                    for k in each(&self.k) {
                        for footprint_scale in each(&self.footprint_scale) {
                            for photons in each(&self.photons) {
                                let mut file = flags.clone();
                                file.photons = photons.or(file.photons);
                                file.k = k.or(file.k);
                                file.footprint_scale = footprint_scale.or(file.footprint_scale);
                                file.gather = gather.clone().or(file.gather);
                                let settings = RenderSettings::new(scene, &file, None, 1).map_err(|e| e.to_string())?;
                                let setting = Setting::of(&settings, e);
                                if seen.insert(format!("{} {}", setting.estimator, setting.rest())) {
                                    all.push(setting);
                                }
                                if all.len() > MAX_SETTINGS {
                                    return Err(format!("--sweep: more than {MAX_SETTINGS} settings; sweep less"));
                                }
                            }
                        }
                    }
                }
            }
        }
        Ok(all)
    }
}

impl Sweep {
    fn fill_own(&mut self, text: &str, key: &str, values: &[&str]) -> Result<(), String> {
        let mut into = self.own.iter().find(|(k, _)| k == key).map(|(_, v)| v.clone()).unwrap_or_default();
        fill(&mut into, text, values, |v| Some(v.to_owned()))?;
        self.own.push((key.to_owned(), into));
        Ok(())
    }

    /// An estimator's name with each combination of its own swept settings; alone if it takes none of them.
    fn varied(&self, name: &str) -> Result<Vec<String>, String> {
        let mut all = vec![name.to_owned()];
        for (key, values) in &self.own {
            let mut next = Vec::new();
            for name in &all {
                for value in values {
                    let varied = with_setting(name, key, value).map_err(|e| format!("--sweep {key}: {e}"))?;
                    next.push(varied.map_or_else(|| name.clone(), |e| e.name()));
                }
            }
            next.dedup();
            all = next;
        }
        Ok(all)
    }
}

fn fill<T>(into: &mut Vec<T>, text: &str, values: &[&str], parse: impl Fn(&str) -> Option<T>) -> Result<(), String> {
    if !into.is_empty() {
        return Err(format!("--sweep {text}: this setting is swept already; give all its values at once"));
    }
    for v in values {
        into.push(parse(v).ok_or_else(|| format!("--sweep {text}: `{v}` is no value of it"))?);
    }
    Ok(())
}

/// A whole number, as in `200000` or `2e5`.
pub fn whole_number(text: &str) -> Option<i64> {
    text.parse().ok().or_else(|| {
        let x: f64 = text.parse().ok()?;
        (x.fract() == 0.0 && x.abs() < i64::MAX as f64).then_some(x as i64)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::estimate::registry::estimators;
    use crate::scene::open;

    fn names(texts: &[&str], list: &str) -> Result<Vec<String>, String> {
        let texts: Vec<String> = texts.iter().map(|t| (*t).to_owned()).collect();
        let scene = open("ring").expect("built in");
        let all = Sweep::parse(&texts)?.settings(&scene, &RenderFile::default(), &estimators(list).expect("known"))?;
        Ok(all.iter().map(|s| format!("{} {}", s.estimator, s.rest())).collect())
    }

    #[test]
    fn combinations_come_once() {
        let list = "density,regular,multi_sampled:grid=cells";
        let all = names(&["n=2,4", "gather=knn,overlap", "k=10,20", "photons=1e4"], list).expect("valid");
        // density: two k; regular and each of the two n: two k under knn, one overlap.
        assert_eq!(all.len(), 2 + 3 + 2 * 3);
        assert!(all.contains(&"density:kernel=silverman gather=knn,k=20,photons=10000".into()), "{all:?}");
        let last = "multi_sampled:n=4,grid=cells gather=overlap,footprint_scale=3,photons=10000";
        assert_eq!(all.last().map(String::as_str), Some(last));
    }

    #[test]
    fn what_cannot_be_swept_is_named() {
        for (text, part) in [
            ("photons", "SETTING=VALUE"),
            ("photons=", "at least one"),
            ("photons=x", "`x`"),
            ("photons=0", "--photons"),
            ("size=3", "sweep photons, k, n"),
            ("n=1", "--sweep n"),
            ("gather=near", "one of knn, overlap"),
            ("footprint-scale=-1", "must be positive"),
        ] {
            let why = names(&[text], "multi_sampled").expect_err(text);
            assert!(why.contains(part) && !why.contains('\n'), "{why}");
        }
        assert!(names(&["k=1", "k=2"], "density").expect_err("twice").contains("already"));
    }
}
