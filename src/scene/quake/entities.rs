//! Entities: blocks of keys and values, in text.

use super::{MapError, UNITS_PER_METRE, turned};
use glam::DVec3;

/// An entity's keys and values.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Entity {
    pairs: Vec<(String, String)>,
}

impl Entity {
    /// Value of a key, without regard to upper and lower case; the last one if it is there twice.
    pub fn get(&self, key: &str) -> Option<&str> {
        self.pairs.iter().rev().find(|(k, _)| k.eq_ignore_ascii_case(key)).map(|(_, v)| v.as_str())
    }

    /// Its `classname`, or nothing.
    pub fn class(&self) -> &str {
        self.get("classname").unwrap_or("")
    }

    /// Numbers of a key; None unless there are as many and all are finite.
    pub fn numbers<const N: usize>(&self, key: &str) -> Option<[f64; N]> {
        let all: Vec<f64> = self.get(key)?.split_whitespace().filter_map(|t| t.parse().ok()).collect();
        all.try_into().ok().filter(|a: &[f64; N]| a.iter().all(|x| x.is_finite() && x.abs() < 1e9))
    }

    /// Its `origin`, metres, y up.
    pub fn origin(&self) -> Option<DVec3> {
        self.numbers("origin").map(|o| turned(DVec3::from_array(o)) / UNITS_PER_METRE)
    }
}

/// Reads the entities of a map.
///
/// # Errors
/// Braces or quotes that do not match, with the line.
pub(super) fn parse(text: &str) -> Result<Vec<Entity>, MapError> {
    let mut all = Vec::new();
    let mut open: Option<(Entity, Option<String>)> = None;
    let mut rest = text.trim_end_matches('\0');
    let line_at = |rest: &str| text[..text.len() - rest.len()].matches('\n').count() + 1;
    let wrong = |rest: &str, what: &str| Err(MapError(format!("lump entities, line {}: {what}", line_at(rest))));
    loop {
        rest = rest.trim_start();
        let Some(c) = rest.chars().next() else { break };
        match (c, &mut open) {
            ('{', None) => open = Some((Entity::default(), None)),
            ('{', Some(_)) => return wrong(rest, "an entity opens inside of another"),
            ('}', Some((_, None))) => all.extend(open.take().map(|(e, _)| e)),
            ('}', Some((_, Some(_)))) => return wrong(rest, "a key has no value"),
            ('}', None) => return wrong(rest, "an entity closes that was not opened"),
            ('"', Some((entity, key))) => {
                let Some((word, after)) = rest[1..].split_once('"') else { return wrong(rest, "a quote has no end") };
                match key.take() {
                    None => *key = Some(word.to_owned()),
                    Some(k) => entity.pairs.push((k, word.to_owned())),
                }
                rest = after;
                continue;
            }
            ('/', _) if rest.starts_with("//") => {
                rest = rest.split_once('\n').map_or("", |(_, after)| after);
                continue;
            }
            _ => return wrong(rest, &format!("`{}` is neither a brace nor a quoted word", c.escape_default())),
        }
        rest = &rest[c.len_utf8()..];
    }
    match open {
        Some(_) => wrong(rest, "the last entity has no end; is the map cut off?"),
        None => Ok(all),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn blocks_are_read_and_breaks_are_placed() {
        let all =
            parse("{\n\"classname\" \"light\"\n// a note\n\"origin\" \"32 64 -96\"\n\"light\" \"200\" }\n{ }\n\0")
                .expect("fine");
        assert_eq!((all.len(), all[0].class(), all[0].numbers("light")), (2, "light", Some([200.0])));
        assert_eq!(all[0].origin(), Some(DVec3::new(1.0, -3.0, -2.0)));
        assert_eq!((all[0].numbers::<2>("light"), all[1].class()), (None, ""));
        for (text, part) in [
            ("{\n\"a\" \"b\"\n", "line 3: the last entity has no end"),
            ("{\n{", "line 2: an entity opens inside"),
            ("\n}", "line 2: an entity closes"),
            ("{ \"a\" }", "line 1: a key has no value"),
            ("{ \"a", "line 1: a quote has no end"),
            ("{\nx }", "line 2: `x` is neither"),
            ("\"a\"", "line 1: `\\\"` is neither"),
        ] {
            let error = parse(text).expect_err(text).0;
            assert!(error.contains(part), "{error}");
        }
    }
}
