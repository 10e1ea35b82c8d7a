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
/// A link is followed to the file that it names. What is no plain file, like a pipe or a device, is written to directly:
/// to put a file in its place would take it away from the system.
///
/// # Errors
/// Anything that the system refuses; then a plain file at `path` is as it was, or absent if it was.
pub fn write(path: &Path, bytes: &[u8]) -> Result<(), WriteError> {
    let wrong = |why: String| WriteError { path: path.to_owned(), why };
    match std::fs::metadata(path) {
        Ok(about) if about.is_dir() => return Err(wrong("a folder is in its place; give the name of a file".into())),
        Ok(about) if !about.is_file() => return write_through(path, bytes).map_err(|e| wrong(reason(&e))),
        _ => {}
    }
    let target = std::fs::canonicalize(path).unwrap_or_else(|_| path.to_owned());
    replace(&target, bytes).map_err(|e| wrong(reason(&e)))
}

/// Puts a file in the place of another, or of none.
fn replace(path: &Path, bytes: &[u8]) -> std::io::Result<()> {
    let folder = match path.parent() {
        Some(p) if !p.as_os_str().is_empty() => p,
        _ => Path::new("."),
    };
    std::fs::create_dir_all(folder).map_err(|e| match e.kind() {
        // A file is where a folder should be.
        std::io::ErrorKind::AlreadyExists => std::io::ErrorKind::NotADirectory.into(),
        _ => e,
    })?;
    let mut file = tempfile::Builder::new().prefix(".cusp-").permissions_like_any_file().tempfile_in(folder)?;
    file.write_all(bytes)?;
    // A system may find out only now that there is no room.
    file.as_file().sync_all()?;
    file.persist(path).map_err(|e| e.error)?;
    Ok(())
}

/// Writes to something that is there already.
fn write_through(path: &Path, bytes: &[u8]) -> std::io::Result<()> {
    let mut file = std::fs::OpenOptions::new().write(true).open(path)?;
    file.write_all(bytes)?;
    file.flush()
}

/// The system's reason without the name of a temporary file.
fn reason(e: &std::io::Error) -> String {
    match e.raw_os_error() {
        Some(_) => e.to_string(),
        None => e.kind().to_string(),
    }
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

    /// Whatever prevents a file leaves no part of it, and what was there before.
    #[test]
    fn refusals_name_path_and_reason() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let at = |name: &str| folder.path().join(name);
        std::fs::create_dir(at("folder")).expect("a folder");
        std::fs::write(at("file"), b"old").expect("a file");
        let cases = [
            (at("folder"), "a folder is in its place"),
            (at("file/below"), "directory"),
            (at("file/below/more"), "directory"),
            (at(&"n".repeat(300)), "too long"),
            (at(&format!("{}/a", "n".repeat(300))), "too long"),
        ];
        for (path, why) in cases {
            let error = write(&path, b"new").expect_err(why).to_string();
            assert!(error.contains(&path.display().to_string()) && error.contains(why), "{error}");
            assert!(!error.contains('\n') && !error.contains(".cusp-"), "{error}");
        }
        assert_eq!(std::fs::read(at("file")).expect("reads"), b"old");
        assert_eq!(std::fs::read_dir(folder.path()).expect("reads").count(), 2);
    }

    #[cfg(unix)]
    #[test]
    fn links_and_devices_stay_what_they_are() {
        use std::os::unix::fs::FileTypeExt;
        let folder = tempfile::tempdir().expect("a temporary folder");
        let (file, link) = (folder.path().join("file"), folder.path().join("link"));
        std::fs::write(&file, b"old").expect("a file");
        std::os::unix::fs::symlink(&file, &link).expect("a link");
        write(&link, b"new").expect("writes");
        assert_eq!(std::fs::read(&file).expect("reads"), b"new");
        assert!(std::fs::symlink_metadata(&link).expect("is there").is_symlink());
        write(Path::new("/dev/null"), b"new").expect("takes all");
        assert!(std::fs::metadata("/dev/null").expect("is there").file_type().is_char_device());
        if Path::new("/dev/full").exists() {
            let error = write(Path::new("/dev/full"), b"new").expect_err("full").to_string();
            assert!(error.starts_with("/dev/full: cannot be written: No space left"), "{error}");
            assert!(std::fs::metadata("/dev/full").expect("is there").file_type().is_char_device());
        }
    }
}
