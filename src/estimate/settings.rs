//! Estimators as text: `multi_sampled:n=8,grid=cells`.

use crate::scene::error::one_line;

/// An estimator's name with its settings, not yet checked.
#[derive(Clone, Debug)]
pub struct Spec<'a> {
    /// The text as given.
    pub text: &'a str,
    /// Name.
    pub id: &'a str,
    pairs: Vec<(&'a str, &'a str)>,
}

/// What is wrong with an estimator's text; one line.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{}", one_line(&format!("`{text}`: {what}")))]
pub struct SpecError {
    /// The text as given.
    pub text: String,
    /// What is wrong and what would be right.
    pub what: String,
}

impl<'a> Spec<'a> {
    /// Splits the text.
    ///
    /// # Errors
    /// A setting that is no `key=value`, or that comes twice.
    pub fn parse(text: &'a str) -> Result<Self, SpecError> {
        let (id, rest) = text.split_once(':').unwrap_or((text, ""));
        let mut spec = Self { text, id: id.trim(), pairs: Vec::new() };
        for part in rest.split(',').filter(|p| !p.trim().is_empty()) {
            let Some((key, value)) = part.split_once('=') else {
                return Err(spec.error(format!("`{part}` is no setting; write key=value")));
            };
            let key = key.trim();
            if spec.pairs.iter().any(|(k, _)| *k == key) {
                return Err(spec.error(format!("`{key}` is given twice")));
            }
            spec.pairs.push((key, value.trim()));
        }
        Ok(spec)
    }

    /// All settings as they were given.
    pub fn pairs(&self) -> impl Iterator<Item = (&'a str, &'a str)> {
        self.pairs.iter().copied()
    }

    /// The text with the setting `key` at `value`, in place of its own.
    pub fn with(&self, key: &str, value: &str) -> String {
        let others = self.pairs().filter(|(k, _)| *k != key).map(|(k, v)| format!("{k}={v}"));
        let settings: Vec<String> = others.chain([format!("{key}={value}")]).collect();
        format!("{}:{}", self.id, settings.join(","))
    }

    /// An error about this text.
    pub fn error(&self, what: impl Into<String>) -> SpecError {
        SpecError { text: self.text.to_owned(), what: what.into() }
    }

    /// Checks that no other settings are there than `known`.
    ///
    /// # Errors
    /// The first unknown one.
    pub fn only(&self, known: &[&str]) -> Result<(), SpecError> {
        for (key, _) in &self.pairs {
            if !known.contains(key) {
                let takes = if known.is_empty() {
                    "it takes none".to_owned()
                } else {
                    format!("it takes {}", known.join(", "))
                };
                return Err(self.error(format!("no setting `{key}`; {takes}")));
            }
        }
        Ok(())
    }

    /// The setting's text.
    pub fn get(&self, key: &str) -> Option<&'a str> {
        self.pairs.iter().find(|(k, _)| *k == key).map(|(_, v)| *v)
    }

    /// A whole number in a range.
    ///
    /// # Errors
    /// If it is none, or out of range.
    pub fn integer(&self, key: &str, default: u32, range: std::ops::RangeInclusive<u32>) -> Result<u32, SpecError> {
        let Some(text) = self.get(key) else { return Ok(default) };
        match text.parse() {
            Ok(n) if range.contains(&n) => Ok(n),
            _ => Err(self.error(format!(
                "`{key}` must be a whole number in {} to {}, got `{text}`",
                range.start(),
                range.end()
            ))),
        }
    }

    /// One of several named values.
    ///
    /// # Errors
    /// If it is none of them.
    pub fn choice<T: Copy>(&self, key: &str, default: T, all: &[(&str, T)]) -> Result<T, SpecError> {
        let Some(text) = self.get(key) else { return Ok(default) };
        all.iter().find(|(n, _)| *n == text).map(|(_, v)| *v).ok_or_else(|| {
            let names: Vec<_> = all.iter().map(|(n, _)| *n).collect();
            self.error(format!("`{key}` must be one of {}, got `{text}`", names.join(", ")))
        })
    }
}
