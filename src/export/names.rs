//! Names of exported files.

use crate::estimate::Estimator;
use std::collections::BTreeSet;

/// What may follow a name before the extension.
const SUFFIXES: [&str; 4] = ["", "_crop", "_values", "_values_crop"];

/// Names of files that are no panel's.
const RESERVED: [&str; 6] = ["sheet", "truth", "reference", "timings", "report", "session"];

/// Names for the files of estimators: ids, with settings where two would be the same.
pub fn of_estimators(estimators: &[Box<dyn Estimator>]) -> Vec<String> {
    distinct(&estimators.iter().map(|e| (e.id().to_owned(), e.name())).collect::<Vec<_>>())
}

/// A name for each pair: its first part, or the second where two first parts are the same; numbered where that is not
/// enough. No file of one is a file of another, on systems that ignore case too.
pub fn distinct(names: &[(String, String)]) -> Vec<String> {
    let mut taken: BTreeSet<String> = RESERVED.map(str::to_owned).into();
    names
        .iter()
        .map(|(short, long)| {
            let alone = names.iter().filter(|(other, _)| other == short).count() == 1;
            let base = file_stem(if alone { short } else { long });
            let mut name = base.clone();
            let mut n = 2;
            let files = |name: &str| SUFFIXES.map(|s| format!("{name}{s}").to_ascii_lowercase());
            while files(&name).iter().any(|f| taken.contains(f)) {
                name = format!("{base}-{n}");
                n += 1;
            }
            taken.extend(files(&name));
            name
        })
        .collect()
}

/// Letters, digits and a few signs; anything else becomes a hyphen.
pub fn file_stem(name: &str) -> String {
    name.chars().map(|c| if c.is_ascii_alphanumeric() || "._-".contains(c) { c } else { '-' }).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::estimate::registry;

    #[test]
    fn estimators_are_told_apart() {
        let list =
            registry::estimators("regular,multi_sampled:n=2,multi_sampled:n=4,multi_sampled:n=4").expect("parses");
        assert_eq!(
            of_estimators(&list),
            [
                "regular",
                "multi_sampled-n-2-grid-closed",
                "multi_sampled-n-4-grid-closed",
                "multi_sampled-n-4-grid-closed-2"
            ]
        );
    }

    #[test]
    fn no_file_takes_the_place_of_another() {
        let names = ["a", "a_crop", "A", "sheet", "../up"].map(|n| (n.to_owned(), n.to_owned()));
        assert_eq!(distinct(&names), ["a", "a_crop-2", "A-2", "sheet-2", "..-up"]);
    }
}
