//! Messages to the user: each once, in one place, until dismissed.

/// How grave a message is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Gravity {
    /// Something was done.
    Note,
    /// Something is odd.
    Warning,
    /// Something did not work.
    Error,
}

/// A message.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Message {
    /// How grave.
    pub gravity: Gravity,
    /// One line.
    pub text: String,
    /// How often it came.
    pub times: u32,
}

/// The messages that have not been dismissed, the newest last.
#[derive(Debug, Default)]
pub struct Messages {
    all: Vec<Message>,
}

impl Messages {
    /// Adds one. The same text again counts up instead.
    pub fn push(&mut self, gravity: Gravity, text: impl Into<String>) {
        let text = text.into();
        match self.all.iter().position(|m| m.text == text) {
            Some(at) => {
                let mut message = self.all.remove(at);
                message.times += 1;
                self.all.push(message);
            }
            None => self.all.push(Message { gravity, text, times: 1 }),
        }
    }

    /// Adds an error.
    pub fn error(&mut self, text: impl Into<String>) {
        self.push(Gravity::Error, text);
    }

    /// Adds a note.
    pub fn note(&mut self, text: impl Into<String>) {
        self.push(Gravity::Note, text);
    }

    /// Replaces all warnings, which describe what is shown now.
    pub fn set_warnings(&mut self, warnings: &[String]) {
        self.all.retain(|m| m.gravity != Gravity::Warning || warnings.contains(&m.text));
        for w in warnings {
            if !self.all.iter().any(|m| m.text == *w) {
                self.push(Gravity::Warning, w.clone());
            }
        }
    }

    /// All of them.
    pub fn all(&self) -> &[Message] {
        &self.all
    }

    /// The gravest, and of those the newest.
    pub fn gravest(&self) -> Option<&Message> {
        self.all.iter().max_by_key(|m| m.gravity)
    }

    /// Dismisses one.
    pub fn dismiss(&mut self, index: usize) {
        if index < self.all.len() {
            self.all.remove(index);
        }
    }

    /// Dismisses all.
    pub fn clear(&mut self) {
        self.all.clear();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_message_comes_once() {
        let mut m = Messages::default();
        m.note("saved");
        m.error("no such file");
        m.note("saved");
        assert_eq!(m.all().len(), 2);
        assert_eq!(m.all()[1].times, 2);
        assert_eq!(m.gravest().map(|g| g.text.as_str()), Some("no such file"));
        m.set_warnings(&["a".into(), "b".into()]);
        m.set_warnings(&["b".into()]);
        assert_eq!(m.all().iter().filter(|m| m.gravity == Gravity::Warning).count(), 1);
        m.dismiss(99);
        m.clear();
        assert!(m.all().is_empty());
    }
}
