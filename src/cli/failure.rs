//! How a command fails, and with which exit code.

use crate::estimate::settings::SpecError;
use crate::export::whole_file::WriteError;
use crate::render::settings::SettingError;
use crate::scene::SceneError;
use crate::scene::memory::Shortage;

/// A failure of a command; its text is one line.
#[derive(Debug, thiserror::Error)]
pub enum Failure {
    /// The call or a file that it names is wrong.
    #[error("{0}")]
    Call(String),
    /// The work could not be done.
    #[error("{0}")]
    Work(String),
    /// Ctrl-C; what was done has been written.
    #[error("interrupted; {0}")]
    Interrupted(String),
}

impl Failure {
    /// Exit code: 2 for a wrong call, 1 for failed work, 130 when interrupted.
    pub fn code(&self) -> u8 {
        match self {
            Self::Call(_) => 2,
            Self::Work(_) => 1,
            Self::Interrupted(_) => 130,
        }
    }
}

impl From<SceneError> for Failure {
    fn from(e: SceneError) -> Self {
        Self::Call(e.to_string())
    }
}

impl From<SettingError> for Failure {
    fn from(e: SettingError) -> Self {
        Self::Call(e.to_string())
    }
}

impl From<SpecError> for Failure {
    fn from(e: SpecError) -> Self {
        Self::Call(e.to_string())
    }
}

impl From<Shortage> for Failure {
    fn from(e: Shortage) -> Self {
        Self::Call(e.to_string())
    }
}

impl From<WriteError> for Failure {
    fn from(e: WriteError) -> Self {
        Self::Work(e.to_string())
    }
}
