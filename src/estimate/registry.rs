//! The list of estimators that the command line and the workbench offer.

use crate::estimate::coplanar::Coplanar;
use crate::estimate::density::Density;
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

/// The estimator that `text` names, as in `multi_sampled:n=8,grid=cells`.
///
/// # Errors
/// An unknown name or setting, or a value out of range.
pub fn estimator(text: &str) -> Result<Box<dyn Estimator>, SpecError> {
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
    let spec = Spec::parse(text)?;
    let takes = |e: &Entry| e.settings.split(", ").any(|s| s.split('=').next() == Some(key));
    if !ESTIMATORS.iter().any(|e| e.id == spec.id && takes(e)) {
        return estimator(text).map(|_| None);
    }
    let others = spec.pairs().filter(|(k, _)| *k != key).map(|(k, v)| format!("{k}={v}"));
    let settings: Vec<String> = others.chain([format!("{key}={value}")]).collect();
    estimator(&format!("{}:{}", spec.id, settings.join(","))).map(Some)
}

/// A list as in `regular,multi_sampled:n=8,grid=cells,integrated`: a part without a name that is known belongs to the
/// estimator before it.
///
/// # Errors
/// As [`estimator`], or an empty list.
pub fn estimators(text: &str) -> Result<Vec<Box<dyn Estimator>>, SpecError> {
    let mut specs: Vec<String> = Vec::new();
    for part in text.split(',').filter(|p| !p.trim().is_empty()) {
        let is_setting = part.contains('=') && !part.contains(':') || part.trim_start().starts_with("shape=");
        match specs.last_mut() {
            Some(last) if is_setting => {
                last.push(if last.contains(':') { ',' } else { ':' });
                last.push_str(part);
            }
            _ => specs.push(part.to_owned()),
        }
    }
    if specs.is_empty() {
        return Err(SpecError { text: text.to_owned(), what: format!("name at least one; there are {}", names()) });
    }
    specs.iter().map(|s| estimator(s.trim())).collect()
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
        assert!(with("multi_sampled", "n", "1").is_err() && with("sharp", "n", "2").is_err());
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
