//! Lines of keys in a TOML text, for errors.

use crate::scene::SceneError;
use std::path::{Path, PathBuf};
use toml::de::{DeTable, DeValue};

/// A scene's text with the file that it came from.
pub struct Locator<'a> {
    file: PathBuf,
    text: &'a str,
    table: Option<toml::Spanned<DeTable<'a>>>,
}

impl<'a> Locator<'a> {
    /// Prepares `text` for look-ups; `file` is only named.
    pub fn new(file: &Path, text: &'a str) -> Self {
        Self { file: file.to_owned(), text, table: DeTable::parse(text).ok() }
    }

    /// An error at `key`, written as in `lights[0].power`. A key that is not there is placed at its nearest parent.
    pub fn error(&self, key: impl Into<String>, what: impl Into<String>) -> SceneError {
        let key = key.into();
        SceneError::At { line: self.line_of(&key), file: self.file.clone(), key, what: what.into() }
    }

    /// The parser's error as ours: its first sentence, on its line.
    pub fn parse_error(&self, error: &toml::de::Error) -> SceneError {
        let start = error.span().map_or(0, |s| s.start);
        let line = self.line_at(start);
        let source = self.text.lines().nth(line - 1).unwrap_or("");
        let key = source.split('=').next().unwrap_or("").trim().to_owned();
        SceneError::At {
            file: self.file.clone(),
            line,
            key: if key.is_empty() { "TOML".into() } else { key },
            what: error.message().lines().collect::<Vec<_>>().join("; "),
        }
    }

    /// The file, and the line of each key of the table `name`.
    pub fn lines_of(&self, name: &str) -> (PathBuf, std::collections::BTreeMap<String, usize>) {
        let mut lines = std::collections::BTreeMap::new();
        if let Some(table) = &self.table
            && let Some(DeValue::Table(t)) = table.get_ref().get(name).map(|v| v.get_ref())
        {
            for (key, _) in t.iter() {
                lines.insert(key.get_ref().to_string(), self.line_at(key.span().start));
            }
        }
        (self.file.clone(), lines)
    }

    fn line_at(&self, byte: usize) -> usize {
        let end = byte.min(self.text.len());
        1 + self.text.as_bytes()[..end].iter().filter(|&&b| b == b'\n').count()
    }

    fn line_of(&self, key: &str) -> usize {
        let Some(table) = &self.table else { return 1 };
        let mut span = table.span();
        let mut at = Some(Node::Table(table.get_ref()));
        for part in key.split(['.', '[', ']']).filter(|p| !p.is_empty()) {
            let next = match at {
                Some(Node::Table(t)) => t.get_key_value(part).map(|(k, v)| (k.span(), v)),
                Some(Node::Value(DeValue::Table(t))) => t.get_key_value(part).map(|(k, v)| (k.span(), v)),
                Some(Node::Value(DeValue::Array(a))) => {
                    part.parse().ok().and_then(|i: usize| a.get(i)).map(|v| (v.span(), v))
                }
                _ => None,
            };
            let Some((found, value)) = next else { break };
            span = found;
            at = Some(Node::Value(value.get_ref()));
        }
        self.line_at(span.start)
    }
}

enum Node<'t, 'a> {
    Table(&'t DeTable<'a>),
    Value(&'t DeValue<'a>),
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keys_are_found_on_their_lines() {
        let text = "name = \"a\"\n[camera]\nfov_y = 3\n\n[[lights]]\nkind = \"point\"\n[[lights]]\nkind = \"point\"\npower = [1, 2, 3]\n";
        let l = Locator::new(Path::new("s.toml"), text);
        for (key, line) in [
            ("name", 1),
            ("camera.fov_y", 3),
            ("lights[1].power", 9),
            ("lights[1].power[2]", 9),
            ("lights[0].radius", 5),
        ] {
            assert_eq!(l.line_of(key), line, "{key}");
        }
    }
}
