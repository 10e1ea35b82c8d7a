//! Why a scene could not be read: what, where, what to do.

use std::path::PathBuf;

/// A scene that cannot be used. Its text is one line.
#[derive(Debug, thiserror::Error)]
pub enum SceneError {
    /// A file that cannot be read.
    #[error("{}", one_line(&format!("{}: cannot be read: {why}", file.display())))]
    Unreadable {
        /// The file.
        file: PathBuf,
        /// The system's reason.
        why: String,
    },
    /// A place in a file that is wrong.
    #[error("{}", one_line(&format!("{}:{line}: {key}: {what}", file.display())))]
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
    #[error("{}", one_line(&format!("{}: {what}", file.display())))]
    Whole {
        /// The file.
        file: PathBuf,
        /// What is wrong and what would be right.
        what: String,
    },
    /// A name that is neither built in nor a file.
    #[error("{}", one_line(&format!("`{name}` is neither a built-in scene nor a file; built in: {known}")))]
    Unknown {
        /// The name given.
        name: String,
        /// The names that exist.
        known: String,
    },
}

/// Text of a file in a line: what would break it or act on a terminal is written as in a string.
pub fn one_line(text: &str) -> String {
    let mut line = String::with_capacity(text.len());
    for c in text.chars() {
        if c.is_control() || matches!(c, '\u{2028}' | '\u{2029}') {
            line.extend(c.escape_default())
        } else {
            line.push(c)
        }
    }
    line
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_error_is_one_line_whatever_it_quotes() {
        let error =
            SceneError::At { file: "a\nb.toml".into(), line: 3, key: "k".into(), what: "got `x\r\u{1b}é`".into() };
        assert_eq!(error.to_string(), "a\\nb.toml:3: k: got `x\\r\\u{1b}é`");
    }
}
