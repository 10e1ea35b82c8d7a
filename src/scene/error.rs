//! Why a scene could not be read: what, where, what to do.

use std::path::PathBuf;

/// A scene that cannot be used. Its text is one line.
#[derive(Debug, thiserror::Error)]
pub enum SceneError {
    /// A file that cannot be read.
    #[error("{}: cannot be read: {why}", file.display())]
    Unreadable {
        /// The file.
        file: PathBuf,
        /// The system's reason.
        why: String,
    },
    /// A place in a file that is wrong.
    #[error("{}:{line}: {key}: {what}", file.display())]
    At {
        /// The file.
        file: PathBuf,
        /// Line, from 1.
        line: usize,
        /// The key, as in `lights[0].power`.
        key: String,
        /// What is wrong and what would be right.
        what: String,
    },
    /// A file that is wrong as a whole.
    #[error("{}: {what}", file.display())]
    Whole {
        /// The file.
        file: PathBuf,
        /// What is wrong and what would be right.
        what: String,
    },
    /// A name that is neither built in nor a file.
    #[error("`{name}` is neither a built-in scene nor a file; built in: {known}")]
    Unknown {
        /// The name given.
        name: String,
        /// The names that exist.
        known: String,
    },
}
