//! Work that is too long for a frame and is no rendering: opening files, errors, heatmaps, inspection, export.
//!
//! One thread, one piece of work at a time. Of each kind only the newest that waits is done.

use super::worker::Wake;
use crossbeam_channel::{Receiver, Sender, bounded};
use std::collections::VecDeque;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use std::thread::JoinHandle;

type Work<F> = Box<dyn FnOnce() -> F + Send>;

/// The window's end of the thread. `K` tells kinds of work apart, `F` is what it finds.
pub struct Analysis<K, F: Send + 'static> {
    waiting: VecDeque<(K, Work<F>)>,
    running: Option<K>,
    orders: Sender<Work<F>>,
    findings: Receiver<Result<F, String>>,
    _thread: JoinHandle<()>,
}

impl<K: PartialEq + Clone, F: Send + 'static> Analysis<K, F> {
    /// Starts a thread of the name `cusp-analysis`.
    ///
    /// # Errors
    /// If the system has no room for a thread.
    pub fn start(wake: Wake) -> std::io::Result<Self> {
        let (orders, inbox) = bounded::<Work<F>>(1);
        let (outbox, findings) = bounded(1);
        let thread = std::thread::Builder::new().name("cusp-analysis".into()).spawn(move || {
            // It ends when the window drops its end of either channel.
            while let Ok(work) = inbox.recv() {
                let found =
                    catch_unwind(AssertUnwindSafe(work)).map_err(|_| "a defect in the analysis thread".to_owned());
                if outbox.send(found).is_err() {
                    return;
                }
                wake();
            }
        })?;
        Ok(Self { waiting: VecDeque::new(), running: None, orders, findings, _thread: thread })
    }

    /// Does `work` after what is running, in place of any of the same kind that still waits.
    pub fn ask(&mut self, kind: K, work: impl FnOnce() -> F + Send + 'static) {
        match self.waiting.iter_mut().find(|(k, _)| *k == kind) {
            Some(place) => place.1 = Box::new(work),
            None => self.waiting.push_back((kind, Box::new(work))),
        }
        self.push();
    }

    fn push(&mut self) {
        if self.running.is_none()
            && let Some((kind, work)) = self.waiting.pop_front()
            && self.orders.try_send(work).is_ok()
        {
            self.running = Some(kind);
        }
    }

    /// What was found since it was asked last.
    pub fn poll(&mut self) -> Option<Result<F, String>> {
        let found = self.findings.try_recv().ok()?;
        self.running = None;
        self.push();
        Some(found)
    }

    /// Whether work of that kind runs or waits.
    pub fn is_busy_with(&self, kind: &K) -> bool {
        self.running.as_ref() == Some(kind) || self.waiting.iter().any(|(k, _)| k == kind)
    }

    /// Whether anything runs or waits.
    pub fn is_busy(&self) -> bool {
        self.running.is_some()
    }
}

/// Does nothing: for threads that nobody waits for.
pub fn no_wake() -> Wake {
    Arc::new(|| {})
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_newest_of_a_kind_is_done() {
        let mut a = Analysis::<u8, u32>::start(no_wake()).expect("a thread");
        let (go, wait) = bounded::<()>(0);
        a.ask(0, move || {
            let _ = wait.recv();
            0
        });
        for n in 1..10 {
            a.ask(1, move || n);
        }
        a.ask(2, || panic!("of a test"));
        assert!(a.is_busy_with(&1));
        drop(go);
        let mut found = Vec::new();
        while a.is_busy() {
            match a.poll() {
                Some(f) => found.push(f.ok()),
                None => std::thread::yield_now(),
            }
        }
        assert_eq!(found, [Some(0), Some(9), None]);
    }
}
