//! Undo and redo: the sessions that were.

use crate::export::session::Session;

/// Steps that can be taken back.
const DEPTH: usize = 200;

/// Sessions before and after the one that is shown. What part of the images is seen is no step.
#[derive(Default)]
pub struct History {
    past: Vec<Session>,
    future: Vec<Session>,
    /// The state before a drag or another act that is still going on.
    open: Option<Session>,
}

impl History {
    /// Notes that `before` was changed. While `ongoing` (a slider is dragged, say) changes make up one step.
    pub fn note(&mut self, before: &Session, ongoing: bool) {
        self.future.clear();
        if ongoing {
            self.open.get_or_insert_with(|| before.clone());
        } else {
            let start = self.open.take().unwrap_or_else(|| before.clone());
            self.push(start);
        }
    }

    /// Closes an ongoing act.
    pub fn settle(&mut self) {
        if let Some(start) = self.open.take() {
            self.push(start);
        }
    }

    fn push(&mut self, session: Session) {
        if self.past.len() == DEPTH {
            self.past.remove(0);
        }
        self.past.push(session);
    }

    /// The session before; `now` can be had back by [`History::redo`].
    pub fn undo(&mut self, now: &Session) -> Option<Session> {
        self.settle();
        let before = self.past.pop()?;
        self.future.push(now.clone());
        Some(Session { view: now.view, ..before })
    }

    /// The session that was taken back last.
    pub fn redo(&mut self, now: &Session) -> Option<Session> {
        let after = self.future.pop()?;
        self.past.push(now.clone());
        Some(Session { view: now.view, ..after })
    }

    /// Whether there is something to take back.
    pub fn can_undo(&self) -> bool {
        !self.past.is_empty() || self.open.is_some()
    }

    /// Whether there is something to have back.
    pub fn can_redo(&self) -> bool {
        !self.future.is_empty()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn with_seed(seed: u64) -> Session {
        Session { seed, ..Session::of("ring") }
    }

    #[test]
    fn a_drag_is_one_step() {
        let mut history = History::default();
        for seed in 1..10 {
            history.note(&with_seed(seed), true);
        }
        history.settle();
        history.note(&with_seed(10), false);
        assert_eq!(history.undo(&with_seed(11)).map(|s| s.seed), Some(10));
        assert_eq!(history.undo(&with_seed(10)).map(|s| s.seed), Some(1));
        assert!(history.undo(&with_seed(1)).is_none());
        assert_eq!(history.redo(&with_seed(1)).map(|s| s.seed), Some(10));
        assert_eq!(history.redo(&with_seed(10)).map(|s| s.seed), Some(11));
        assert!(!history.can_redo() && history.can_undo());
        history.note(&with_seed(11), false);
        assert!(!history.can_redo());
    }
}
