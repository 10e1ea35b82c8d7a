//! Files that appear whole or not at all.

use std::io::Write;
use std::path::{Path, PathBuf};

/// A file that could not be written; one line.
#[derive(Debug, thiserror::Error)]
#[error("{}: cannot be written: {why}", path.display())]
pub struct WriteError {
    /// The file.
    pub path: PathBuf,
    /// The reason.
    pub why: String,
}

/// Writes `bytes` to `path` by way of a temporary file beside it, making folders that are missing.
///
/// # Errors
/// Anything that the system refuses; then `path` is as it was.
pub fn write(path: &Path, bytes: &[u8]) -> Result<(), WriteError> {
    let wrong = |e: &dyn std::fmt::Display| WriteError { path: path.to_owned(), why: e.to_string() };
    let folder = match path.parent() {
        Some(p) if !p.as_os_str().is_empty() => p,
        _ => Path::new("."),
    };
    std::fs::create_dir_all(folder).map_err(|e| wrong(&e))?;
    let mut file = tempfile::Builder::new()
        .prefix(".cusp-")
        .permissions_like_any_file()
        .tempfile_in(folder)
        .map_err(|e| wrong(&e))?;
    file.write_all(bytes).map_err(|e| wrong(&e))?;
    file.persist(path).map_err(|e| wrong(&e.error))?;
    Ok(())
}

/// Temporary files are private by default; a result is for everyone whom the user lets read.
trait ReadableByAll {
    fn permissions_like_any_file(&mut self) -> &mut Self;
}

impl ReadableByAll for tempfile::Builder<'_, '_> {
    #[cfg(unix)]
    fn permissions_like_any_file(&mut self) -> &mut Self {
        use std::os::unix::fs::PermissionsExt;
        self.permissions(std::fs::Permissions::from_mode(0o666))
    }

    #[cfg(not(unix))]
    fn permissions_like_any_file(&mut self) -> &mut Self {
        self
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_appears_whole_and_a_refusal_leaves_nothing() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let path = folder.path().join("a/b.txt");
        write(&path, b"one").expect("writes");
        write(&path, b"two").expect("overwrites");
        assert_eq!(std::fs::read(&path).expect("reads"), b"two");
        let under_a_file = path.join("c.txt");
        assert!(write(&under_a_file, b"x").is_err());
        let left = std::fs::read_dir(folder.path().join("a")).expect("reads").count();
        assert_eq!(left, 1);
    }
}
