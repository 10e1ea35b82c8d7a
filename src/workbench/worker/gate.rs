//! The gate that the render thread passes before each tile: pause, step, and stop.

use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};

/// How far the worker may go.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Way {
    /// Without end.
    Open,
    /// So many tiles, then wait.
    Tiles(u64),
    /// To the end of the pass, then wait.
    Pass,
}

/// Shared by the window, which sets it, and the worker's threads, which pass it.
#[derive(Debug)]
pub struct Gate {
    way: Mutex<Way>,
    changed: Condvar,
    /// Generation that is wanted; work for another stops.
    generation: AtomicU64,
    closed: AtomicBool,
}

impl Default for Gate {
    fn default() -> Self {
        Self {
            way: Mutex::new(Way::Open),
            changed: Condvar::new(),
            generation: AtomicU64::new(0),
            closed: AtomicBool::new(false),
        }
    }
}

impl Gate {
    /// Stops work for any other generation. A paused worker does one pass of the new one, so that it is seen.
    pub fn go_to(&self, generation: u64) {
        self.generation.store(generation, Ordering::SeqCst);
        let mut way = self.way();
        if *way != Way::Open {
            *way = Way::Pass;
        }
        self.changed.notify_all();
    }

    /// Waits before the next tile.
    pub fn pause(&self) {
        self.set(Way::Tiles(0));
    }

    /// Goes on.
    pub fn resume(&self) {
        self.set(Way::Open);
    }

    /// Does one more tile, then waits.
    pub fn step_tile(&self) {
        self.set(Way::Tiles(1));
    }

    /// Goes on to the end of a pass, then waits.
    pub fn step_pass(&self) {
        self.set(Way::Pass);
    }

    /// Ends all work.
    pub fn close(&self) {
        self.closed.store(true, Ordering::SeqCst);
        self.changed.notify_all();
        // Whoever was between its check and its wait holds the lock until it waits.
        drop(self.way());
        self.changed.notify_all();
    }

    /// Whether the worker waits, or will at the end of a tile or pass.
    pub fn is_paused(&self) -> bool {
        *self.way() != Way::Open
    }

    /// Whether work for `generation` has to stop. Does not wait.
    pub fn is_stale(&self, generation: u64) -> bool {
        self.closed.load(Ordering::Relaxed) || self.generation.load(Ordering::Relaxed) != generation
    }

    /// Waits while paused; false if work for `generation` has to stop. Takes one of the tiles that are allowed.
    pub fn pass_tile(&self, generation: u64) -> bool {
        let mut way = self.way();
        loop {
            if self.is_stale(generation) {
                return false;
            }
            match &mut *way {
                Way::Open | Way::Pass => return true,
                Way::Tiles(0) => way = self.changed.wait(way).unwrap_or_else(PoisonError::into_inner),
                Way::Tiles(n) => {
                    *n -= 1;
                    return true;
                }
            }
        }
    }

    /// Tells that a pass has ended: a step of one pass ends here.
    pub fn pass_ended(&self) {
        let mut way = self.way();
        if *way == Way::Pass {
            *way = Way::Tiles(0);
        }
    }

    fn set(&self, to: Way) {
        *self.way() = to;
        self.changed.notify_all();
    }

    fn way(&self) -> MutexGuard<'_, Way> {
        // The value is whole at any time, so a holder that panicked has left nothing half done.
        self.way.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::atomic::AtomicUsize;
    use std::time::Duration;

    #[test]
    fn steps_are_counted() {
        let gate = Gate::default();
        gate.go_to(1);
        gate.pause();
        let passed = AtomicUsize::new(0);
        std::thread::scope(|s| {
            s.spawn(|| {
                while gate.pass_tile(1) {
                    passed.fetch_add(1, Ordering::SeqCst);
                }
            });
            for expected in 1..=3 {
                gate.step_tile();
                while passed.load(Ordering::SeqCst) < expected {
                    std::thread::yield_now();
                }
                std::thread::sleep(Duration::from_millis(2));
                assert_eq!(passed.load(Ordering::SeqCst), expected);
            }
            gate.close();
        });
    }

    #[test]
    fn a_new_generation_wakes_and_stops_the_old() {
        let gate = Gate::default();
        gate.go_to(1);
        gate.pause();
        std::thread::scope(|s| {
            let old = s.spawn(|| gate.pass_tile(1));
            gate.go_to(2);
            assert!(!old.join().expect("no panic"));
        });
        // One pass of the new one, then it waits again.
        assert!(gate.pass_tile(2) && gate.is_paused());
        gate.pass_ended();
        gate.close();
        assert!(!gate.pass_tile(2));
    }
}
