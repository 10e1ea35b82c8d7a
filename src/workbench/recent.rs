//! What was opened last.

use std::path::Path;

/// How many are kept.
const COUNT: usize = 10;

/// Built-in scenes by name, scene and session files by path; the newest first.
#[derive(Debug, Default)]
pub struct Recent {
    names: Vec<String>,
}

impl Recent {
    /// Notes that this was opened.
    pub fn note(&mut self, name: &str) {
        let name = placed(name);
        self.names.retain(|n| *n != name);
        self.names.insert(0, name);
        self.names.truncate(COUNT);
    }

    /// The newest first.
    pub fn names(&self) -> &[String] {
        &self.names
    }

    /// A name on each line.
    pub fn to_text(&self) -> String {
        self.names.join("\n")
    }

    /// Takes up what [`Recent::to_text`] gave, as older than what is here.
    pub fn recall(&mut self, text: &str) {
        for name in text.lines().filter(|l| !l.is_empty()) {
            if self.names.len() < COUNT && !self.names.iter().any(|n| n == name) {
                self.names.push(name.to_owned());
            }
        }
    }
}

/// A path that holds wherever the program is started next.
fn placed(name: &str) -> String {
    if crate::scene::built_in::find(name).is_some() {
        return name.to_owned();
    }
    std::path::absolute(Path::new(name)).map_or(name.to_owned(), |p| p.to_string_lossy().into_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_newest_come_first_and_once() {
        let mut recent = Recent::default();
        for name in ["ring", "/a.toml", "ring"] {
            recent.note(name);
        }
        recent.recall("/b.toml\n\n/a.toml\n");
        assert_eq!(recent.names(), ["ring", "/a.toml", "/b.toml"]);
        let mut again = Recent::default();
        again.recall(&recent.to_text());
        assert_eq!(again.names(), recent.names());
        for i in 0..20 {
            recent.note(&format!("/{i}.toml"));
        }
        assert_eq!((recent.names().len(), recent.names()[0].as_str()), (10, "/19.toml"));
        recent.recall("/old.toml");
        assert_eq!(recent.names().len(), 10);
        recent.note("here.toml");
        assert!(Path::new(&recent.names()[0]).is_absolute());
    }
}
