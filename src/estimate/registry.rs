//! The list of estimators that the command line and the workbench offer.

use crate::estimate::coplanar::Coplanar;
use crate::estimate::density::Density;
use crate::estimate::final_gathering::{FinalGathering, KEYS, WithFinalGathering};
use crate::estimate::integrated::Integrated;
use crate::estimate::multi_sampled::MultiSampled;
use crate::estimate::regular::Regular;
use crate::estimate::settings::{Spec, SpecError};
use crate::estimate::{Estimator, Lookup};

/// An estimator on offer.
pub struct Entry {
    /// Name.
    pub id: &'static str,
    /// Where it comes from.
    pub source: &'static str,
    /// What it is.
    pub summary: &'static str,
    /// Its settings with their values, the default first.
    pub settings: &'static str,
    parse: fn(&Spec) -> Result<Box<dyn Estimator>, SpecError>,
}

/// All estimators.
pub const ESTIMATORS: &[Entry] = &[
    Entry {
        id: "density",
        source: "Jensen 2001; Pedersen 2011, eq. 9-11",
        summary: "k nearest photons over the disc that they fill",
        settings: "kernel=silverman|none|cone|gaussian|epanechnikov",
        parse: Density::parse,
    },
    Entry {
        id: "regular",
        source: "Schjøth 2007; Pedersen 2011, eq. 46",
        summary: "photon differentials at the hit point",
        settings: "",
        parse: Regular::parse,
    },
    Entry {
        id: "regular_3x3",
        source: "Pedersen 2011, section 5",
        summary: "the same with n×n view rays for each pixel",
        settings: "n=3",
        parse: Regular::parse_3x3,
    },
    Entry {
        id: "coplanar",
        source: "Pedersen 2011, eq. 50-67",
        summary: "coverage and centroid of the clipped footprints",
        settings: "shape=parallelogram|ellipse:20, weight=centroid|mean",
        parse: Coplanar::parse,
    },
    Entry {
        id: "multi_sampled",
        source: "Pedersen 2011, eq. 68-71",
        summary: "n×n points of the view footprint, evaluated in filter space",
        settings: "n=8, grid=closed|cells",
        parse: MultiSampled::parse,
    },
    Entry {
        id: "integrated",
        source: "Cusp",
        summary: "the exact mean over the view footprint",
        settings: "",
        parse: Integrated::parse,
    },
];

impl Entry {
    /// The estimator with its default settings.
    pub fn default_estimator(&self) -> Option<Box<dyn Estimator>> {
        estimator(self.id).ok()
    }
}

/// The estimator that `text` names, as in `multi_sampled:n=8,grid=cells`, or with final gathering as in
/// `integrated+ray-differentials:rays=800`.
///
/// # Errors
/// An unknown name or setting, or a value out of range.
pub fn estimator(text: &str) -> Result<Box<dyn Estimator>, SpecError> {
    if let Some((own, final_gathering)) = text.split_once('+') {
        let inner = estimator(own)?;
        return Ok(match FinalGathering::parse(final_gathering)? {
            Some(f) => Box::new(WithFinalGathering::new(inner, f)),
            None => inner,
        });
    }
    let spec = Spec::parse(text)?;
    match ESTIMATORS.iter().find(|e| e.id == spec.id) {
        Some(entry) => (entry.parse)(&spec),
        None => Err(spec.error(format!("there is none of that name; there are {}", names()))),
    }
}

/// The estimator `text` with the setting `key` at `value`, as in `n` at `4`; None if it takes no such setting.
///
/// # Errors
/// As [`estimator`].
pub fn with_setting(text: &str, key: &str, value: &str) -> Result<Option<Box<dyn Estimator>>, SpecError> {
    if let Some((own, gathering)) = text.split_once('+') {
        if !KEYS.contains(&key) {
            return Ok(match with_setting(own, key, value)? {
                Some(inner) => Some(estimator(&format!("{}+{gathering}", inner.name()))?),
                None => None,
            });
        }
        let spec = Spec::parse(gathering)?;
        return estimator(&format!("{own}+{}", spec.with(key, value))).map(Some);
    }
    let spec = Spec::parse(text)?;
    let takes = |e: &Entry| e.settings.split(", ").any(|s| s.split('=').next() == Some(key));
    if !ESTIMATORS.iter().any(|e| e.id == spec.id && takes(e)) {
        return estimator(text).map(|_| None);
    }
    estimator(&spec.with(key, value)).map(Some)
}

/// Each estimator that has no final gathering yet, with each of `all` in turn (None for without); the others as they are.
///
/// # Errors
/// None, if the estimators came from here.
pub fn with_final_gathering(
    estimators: &[Box<dyn Estimator>],
    all: &[Option<FinalGathering>],
) -> Result<Vec<Box<dyn Estimator>>, SpecError> {
    let each = estimators.iter().flat_map(|e| {
        let name = e.name();
        match e.final_gathering() {
            Some(_) => vec![name],
            None => all.iter().map(|f| f.map_or(name.clone(), |f| format!("{name}+{f}"))).collect(),
        }
    });
    each.map(|name| estimator(&name)).collect()
}

/// A list of final gatherings, as in `none,classic,ray-differentials:rays=200,pattern=sobol`; None stands for `none`. Those
/// that do not say so take `rays`.
///
/// # Errors
/// As [`FinalGathering::parse`], or an empty list.
pub fn final_gatherings(text: &str, rays: u32) -> Result<Vec<Option<FinalGathering>>, SpecError> {
    let specs = split_list(text);
    if specs.is_empty() {
        let what = "name at least one of none, classic, precomputed, ray-differentials".to_owned();
        return Err(SpecError { text: text.to_owned(), what });
    }
    specs.iter().map(|s| FinalGathering::parse_with(s, rays)).collect()
}

/// A list as in `regular,multi_sampled:n=8,grid=cells,integrated`: a part without a name that is known belongs to the
/// estimator before it.
///
/// # Errors
/// As [`estimator`], or an empty list.
pub fn estimators(text: &str) -> Result<Vec<Box<dyn Estimator>>, SpecError> {
    let specs = split_list(text);
    if specs.is_empty() {
        return Err(SpecError { text: text.to_owned(), what: format!("name at least one; there are {}", names()) });
    }
    specs.iter().map(|s| estimator(s.trim())).collect()
}

/// Parts of a list separated by commas; a part that is a setting (`key=value`) belongs to the one before it.
fn split_list(text: &str) -> Vec<String> {
    let mut specs: Vec<String> = Vec::new();
    for part in text.split(',').map(str::trim).filter(|p| !p.is_empty()) {
        let before = |sign| part.find(sign).unwrap_or(usize::MAX);
        let is_setting = part.contains('=') && before('=') < before(':') && before('=') < before('+');
        match specs.last_mut() {
            Some(last) if is_setting => {
                // Settings of final gathering come after its own colon.
                let has_settings = last.rsplit('+').next().is_some_and(|tail| tail.contains(':'));
                last.push(if has_settings { ',' } else { ':' });
                last.push_str(part);
            }
            _ => specs.push(part.to_owned()),
        }
    }
    specs
}

/// The parts of an estimator's name: id, own settings, and final gathering with its settings; empty where there are none.
pub fn parts(name: &str) -> (&str, &str, &str) {
    let (own, gathering) = name.split_once('+').unwrap_or((name, ""));
    let (id, settings) = own.split_once(':').unwrap_or((own, ""));
    (id, settings, gathering)
}

/// An estimator's name without settings, as `multi_sampled`, or `multi_sampled+classic` with final gathering.
pub fn short_name(name: &str) -> String {
    let (id, _, gathering) = parts(name);
    match gathering.split(':').next() {
        Some(method) if !method.is_empty() => format!("{id}+{method}"),
        _ => id.to_owned(),
    }
}

/// Names of all estimators, separated by commas.
pub fn names() -> String {
    ESTIMATORS.iter().map(|e| e.id).collect::<Vec<_>>().join(", ")
}

/// Whether an estimator needs photon footprints.
pub fn needs_photon_footprint(e: &dyn Estimator) -> bool {
    e.lookup() != Lookup::Disc
}

/// Whether an estimator needs the view footprint.
pub fn needs_view_footprint(e: &dyn Estimator) -> bool {
    e.lookup() == Lookup::Parallelogram
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_come_back_as_they_were_given() {
        for text in [
            "density:kernel=cone",
            "regular",
            "regular_3x3:n=4",
            "coplanar:shape=ellipse:20,weight=mean",
            "multi_sampled:n=8,grid=cells",
            "integrated",
            "multi_sampled:n=8,grid=cells+ray-differentials:rays=200,radius=0.1",
        ] {
            assert_eq!(estimator(text).map(|e| e.name()).expect(text), text);
        }
    }

    #[test]
    fn a_setting_is_set_where_it_is_known() {
        let with = |text, key, value| with_setting(text, key, value).map(|e| e.map(|e| e.name()));
        let known = with("multi_sampled:n=8,grid=cells", "n", "4").expect("valid");
        assert_eq!(known.as_deref(), Some("multi_sampled:n=4,grid=cells"));
        assert_eq!(with("regular_3x3", "n", "5").expect("valid").as_deref(), Some("regular_3x3:n=5"));
        assert_eq!(with("integrated", "n", "4"), Ok(None));
        let gathering = "multi_sampled:n=8,grid=cells+classic:rays=200";
        let rays = with(gathering, "rays", "50").expect("valid");
        assert_eq!(rays.as_deref(), Some("multi_sampled:n=8,grid=cells+classic:rays=50"));
        let n = with(gathering, "n", "4").expect("valid");
        assert_eq!(n.as_deref(), Some("multi_sampled:n=4,grid=cells+classic:rays=200"));
        assert_eq!(with("integrated", "rays", "4"), Ok(None));
        assert!(with("multi_sampled", "n", "1").is_err() && with("sharp", "n", "2").is_err());
    }

    #[test]
    fn names_fall_into_parts() {
        let name = "multi_sampled:n=8,grid=cells+classic:rays=200";
        assert_eq!(parts(name), ("multi_sampled", "n=8,grid=cells", "classic:rays=200"));
        assert_eq!(parts("integrated+none"), ("integrated", "", "none"));
        assert_eq!(parts("integrated"), ("integrated", "", ""));
        let short = [name, "integrated+classic:rays=2", "density:kernel=cone", "regular"].map(short_name);
        assert_eq!(short, ["multi_sampled+classic", "integrated+classic", "density", "regular"]);
    }

    #[test]
    fn lists_keep_settings_with_their_estimator() {
        let list = estimators("regular,coplanar:shape=ellipse:8,weight=mean,multi_sampled:n=2,grid=cells,integrated");
        let names: Vec<_> = list.expect("parses").iter().map(|e| e.name()).collect();
        assert_eq!(
            names,
            ["regular", "coplanar:shape=ellipse:8,weight=mean", "multi_sampled:n=2,grid=cells", "integrated"]
        );
    }

    #[test]
    fn final_gathering_goes_with_each_estimator() {
        let list = estimators("integrated,multi_sampled:n=2,grid=cells+classic:rays=8,pattern=sobol").expect("parses");
        let all = final_gatherings("none,ray-differentials:rays=9,growth=3", 200).expect("parses");
        let names: Vec<_> = with_final_gathering(&list, &all).expect("valid").iter().map(|e| e.name()).collect();
        assert_eq!(
            names,
            [
                "integrated",
                "integrated+ray-differentials:rays=9,growth=3",
                "multi_sampled:n=2,grid=cells+classic:rays=8,pattern=sobol"
            ]
        );
        assert!(final_gatherings("", 9).is_err() && final_gatherings("rays=3", 9).is_err());
        // One that names its rays keeps them.
        let rays = final_gatherings("classic:rays=200,precomputed", 800).expect("parses");
        assert_eq!(rays.iter().flatten().map(|f| f.rays).collect::<Vec<_>>(), [200, 800]);
    }

    #[test]
    fn wrong_settings_are_named() {
        for (text, part) in [
            ("sharp", "there are density"),
            ("multi_sampled:n=1", "2 to 256"),
            ("multi_sampled:m=1", "it takes n, grid"),
            ("regular:n=1", "takes none"),
            ("coplanar:shape=ellipse:2", "3 to 64"),
            ("integrated:", ""),
            ("density:kernel=box", "one of none"),
            ("multi_sampled:n=2,n=3", "twice"),
            ("multi_sampled:n", "key=value"),
        ] {
            match estimator(text) {
                Ok(_) => assert_eq!(part, "", "{text}"),
                Err(e) => assert!(!part.is_empty() && e.to_string().contains(part), "{e}"),
            }
        }
        assert!(estimators(" , ").is_err());
    }
}
