//! Whether the scene's file has changed on disk.

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant, SystemTime};

/// How often the file is looked at.
pub const INTERVAL: Duration = Duration::from_secs(1);

/// The time at which a file was written, as it was seen last.
#[derive(Debug, Default)]
pub struct Watch {
    path: PathBuf,
    seen: Option<SystemTime>,
    last: Option<Instant>,
}

impl Watch {
    /// Whether `path` has been written anew since it was looked at last, and is there. Looks at it once in
    /// [`INTERVAL`]; a path that is not the one of last time has not changed yet.
    pub fn has_changed(&mut self, path: &Path, now: Instant) -> bool {
        let is_new = self.path != path;
        if !is_new && self.last.is_some_and(|last| now.saturating_duration_since(last) < INTERVAL) {
            return false;
        }
        self.last = Some(now);
        let written = std::fs::metadata(path).and_then(|m| m.modified()).ok();
        if is_new {
            (self.path, self.seen) = (path.to_owned(), written);
            return false;
        }
        // Editors may take a file away before they put the new one in its place.
        let changed = written.is_some() && written != self.seen;
        self.seen = written.or(self.seen);
        changed
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_change_is_seen_once() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("a.toml");
        let write = |seconds: u64| {
            let file = std::fs::File::create(&path).expect("creates");
            file.set_modified(SystemTime::UNIX_EPOCH + Duration::from_secs(seconds)).expect("sets the time");
        };
        write(1000);
        let (mut watch, start) = (Watch::default(), Instant::now());
        let mut look = |seconds: u64| watch.has_changed(&path, start + Duration::from_secs(seconds));
        assert!(!look(0) && !look(1));
        write(2000);
        assert!(!look(1), "it is not time to look again");
        assert!(look(2) && !look(3));
        std::fs::remove_file(&path).expect("removes");
        assert!(!look(4));
        write(2000);
        assert!(!look(5), "the same file is back");
        write(500);
        assert!(look(6) && !look(7));
        assert!(!watch.has_changed(folder.path(), start + Duration::from_secs(8)), "another file");
    }
}
