//! Jobs of unlike length, shared out among threads.

use rayon::prelude::*;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Does `count` jobs on all threads of the pool and returns what they give, in the order of their numbers.
///
/// A thread that is done with one takes the next that nobody has, so that all are busy to the last job. What rayon cuts in
/// halves may leave a dozen of them to one thread while the others wait.
///
/// * `start`: what a thread keeps from job to job.
/// * `job`: by its number, from 0 on. The order in which jobs begin is that of their numbers.
pub fn in_turn<S, R: Send>(
    count: usize,
    start: impl Fn() -> S + Sync,
    job: impl Fn(&mut S, usize) -> R + Sync,
) -> Vec<R> {
    let next = AtomicUsize::new(0);
    let taken = |_| {
        let (mut kept, mut done) = (start(), Vec::new());
        loop {
            let number = next.fetch_add(1, Ordering::Relaxed);
            if number >= count {
                return done;
            }
            done.push((number, job(&mut kept, number)));
        }
    };
    let threads = rayon::current_num_threads().min(count);
    let mut done: Vec<(usize, R)> = (0..threads).into_par_iter().with_max_len(1).flat_map_iter(taken).collect();
    done.sort_unstable_by_key(|(number, _)| *number);
    done.into_iter().map(|(_, result)| result).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Each job is done once, whatever the number of threads, and its result has its place.
    #[test]
    fn results_are_in_the_order_of_the_jobs() {
        for threads in [1, 2, 7] {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
            for count in [0, 1, 2, 100] {
                let begun = AtomicUsize::new(0);
                let job = |kept: &mut usize, number: usize| {
                    begun.fetch_add(1, Ordering::Relaxed);
                    *kept += 1;
                    (number, *kept)
                };
                let results = pool.install(|| in_turn(count, || 0, job));
                assert!(results.iter().map(|r| r.0).eq(0..count));
                assert_eq!(begun.into_inner(), count);
                // Each thread keeps what is its own: alone it sees them all.
                assert!(results.iter().all(|r| (1..=count).contains(&r.1)));
                assert!(threads > 1 || results.iter().all(|r| r.1 == r.0 + 1));
            }
        }
    }
}
