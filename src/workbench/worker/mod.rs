//! The render thread, and the window's end of it.
//!
//! The worker owns the renderer. Jobs go to it and events come back over bounded channels; a generation number, raised
//! at every change, tells both ends at once which tiles are stale.

pub mod gate;
pub mod messages;
mod thread;

use crossbeam_channel::{Receiver, Sender, TrySendError, bounded};
use gate::Gate;
use messages::{Command, Event, Job};
use std::sync::Arc;
use std::thread::JoinHandle;

/// Events that wait for the window at most; then the worker waits too.
const EVENTS: usize = 256;
/// Jobs that wait for the worker at most. The window holds back newer ones and sends the newest.
const COMMANDS: usize = 4;

/// Called by the worker whenever there is something new to draw, from its own thread.
pub type Wake = Arc<dyn Fn() + Send + Sync>;

/// The window's end of the render thread.
pub struct Worker {
    gate: Arc<Gate>,
    commands: Sender<Command>,
    events: Receiver<Event>,
    thread: Option<JoinHandle<()>>,
    /// A job that the channel had no room for.
    waiting: Option<Box<Job>>,
    wake: Wake,
}

impl Worker {
    /// Starts a thread of the name `cusp-render`.
    ///
    /// # Errors
    /// If the system has no room for a thread.
    pub fn start(wake: Wake) -> std::io::Result<Self> {
        let (commands, inbox) = bounded(COMMANDS);
        let (outbox, events) = bounded(EVENTS);
        let gate = Arc::new(Gate::default());
        let (their_gate, their_wake) = (Arc::clone(&gate), Arc::clone(&wake));
        let thread = std::thread::Builder::new()
            .name("cusp-render".into())
            .spawn(move || thread::run(&inbox, &outbox, &their_gate, &their_wake))?;
        Ok(Self { gate, commands, events, thread: Some(thread), waiting: None, wake })
    }

    /// Renders `job` from now on. What runs for an older one stops at its next check; never blocks.
    pub fn render(&mut self, job: Job) {
        self.gate.go_to(job.generation);
        self.waiting = Some(Box::new(job));
        self.push();
    }

    /// Sends a job that is waiting, if there is room.
    fn push(&mut self) {
        if let Some(job) = self.waiting.take()
            && let Err(TrySendError::Full(Command::Render(job))) = self.commands.try_send(Command::Render(job))
        {
            self.waiting = Some(job);
        }
    }

    /// The events of `generation` that have come; older ones are dropped. Stops when `enough` says so, never blocks.
    pub fn events(&mut self, generation: u64, mut take: impl FnMut(Event), mut enough: impl FnMut() -> bool) {
        self.push();
        while !enough() {
            let Ok(event) = self.events.try_recv() else { return };
            if event.generation().is_none_or(|g| g == generation) {
                take(event);
            }
        }
        // There may be more.
        (self.wake)();
    }

    /// Pauses, lets go on, and steps.
    pub fn gate(&self) -> &Gate {
        &self.gate
    }
}

impl Drop for Worker {
    fn drop(&mut self) {
        self.gate.close();
        // The worker may be waiting for room for an event.
        while self.events.try_recv().is_ok() {}
        let _ = self.commands.try_send(Command::Quit);
        // With no room for that, the thread ends when it finds the channel closed behind the last job.
        self.commands = bounded(0).0;
        if let Some(thread) = self.thread.take() {
            // It looks at the gate before each tile and each send, so this takes no longer than a tile. A thread that
            // has panicked has said so already.
            let _ = thread.join();
        }
    }
}
