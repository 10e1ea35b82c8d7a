//! When a progressive render is done: after so many passes, so many seconds, or at an error.

use crate::render::error_estimate::{ErrorEstimate, is_milestone};
use serde::Serialize;

/// Passes before an estimated error may end a render.
///
/// An estimate from fewer rests on too few groups of passes: a lucky one would end the render. It is also where the view
/// rays have gone through all cells of their pixels four times.
pub const LEAST_PASSES: u32 = 16;

/// When to stop. Each part is a limit of its own, and the first that is reached counts; without any, nothing stops.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct StopRule {
    /// Passes, at least 1.
    pub passes: Option<u32>,
    /// Seconds, above 0 and finite.
    pub seconds: Option<f64>,
    /// Relative error, a fraction, above 0 and finite: [`ErrorEstimate::relative_bound`] has to come down to it.
    pub error: Option<f64>,
}

/// How far a render is.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Standing {
    /// Finished passes.
    pub passes: u32,
    /// Seconds since the start.
    pub seconds: f64,
    /// Seconds that the next pass may take, judged by those before it.
    pub next_pass: f64,
    /// The error that is estimated now, if it can be.
    pub error: Option<ErrorEstimate>,
}

/// What ended a render.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum StoppedBy {
    /// All passes were done.
    Passes,
    /// The time was up, or the next pass would not have ended in time.
    Seconds,
    /// The estimated error was low enough.
    Error,
    /// The user.
    Interruption,
}

impl StopRule {
    /// Whether to stop before the next pass, and why. The first pass is always made.
    ///
    /// A low error counts before the limits, so that a render that reached both says that it reached its error.
    pub fn verdict(&self, now: &Standing) -> Option<StoppedBy> {
        if now.passes == 0 {
            return None;
        }
        let reached = |error: f64| now.error.is_some_and(|e| e.passes >= LEAST_PASSES && e.relative_bound <= error);
        if self.error.is_some_and(reached) {
            return Some(StoppedBy::Error);
        }
        if self.passes.is_some_and(|p| now.passes >= p) {
            return Some(StoppedBy::Passes);
        }
        let late = |s: f64| now.seconds >= s || now.seconds + now.next_pass > s;
        self.seconds.is_some_and(late).then_some(StoppedBy::Seconds)
    }

    /// Whether [`StopRule::verdict`] looks at the error after so many passes: if not, it need not be estimated.
    pub fn asks_for_error(&self, passes: u32) -> bool {
        self.error.is_some() && passes >= LEAST_PASSES && is_milestone(passes)
    }

    /// Seconds after which a pass that runs is dropped; None while the first pass runs, which is always finished.
    pub fn deadline(&self, passes: u32) -> Option<f64> {
        self.seconds.filter(|_| passes > 0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(passes: u32, seconds: f64, next_pass: f64) -> Standing {
        Standing { passes, seconds, next_pass, error: None }
    }

    fn with_error(passes: u32, relative: f64) -> Standing {
        let error =
            ErrorEstimate { passes, rmse: 1.0, noise_rmse: 1.0, bias_rmse: 0.0, relative, relative_bound: relative };
        Standing { error: Some(error), ..at(passes, 1.0, 1.0) }
    }

    /// A render on a clock of its own: each pass takes what `pass` says. Returns what stopped it, the passes that
    /// count, and the time.
    fn run(rule: StopRule, pass: impl Fn(u32) -> f64) -> (Option<StoppedBy>, u32, f64) {
        let (mut passes, mut clock, mut last) = (0, 0.5, 0.0);
        while passes < 1000 {
            if let Some(why) = rule.verdict(&at(passes, clock, last)) {
                return (Some(why), passes, clock);
            }
            let end = clock + pass(passes);
            if let Some(deadline) = rule.deadline(passes).filter(|d| end > *d) {
                // The pass is dropped, and the verdict has to see it.
                clock = deadline;
                continue;
            }
            (clock, last) = (end, pass(passes));
            passes += 1;
        }
        (None, passes, clock)
    }

    #[test]
    fn passes_are_counted() {
        let rule = StopRule { passes: Some(3), ..Default::default() };
        assert_eq!(run(rule, |_| 1.0), (Some(StoppedBy::Passes), 3, 3.5));
        assert_eq!(run(StopRule::default(), |_| 1.0).0, None);
    }

    #[test]
    fn a_pass_that_would_be_late_is_not_begun() {
        let rule = StopRule { seconds: Some(4.0), ..Default::default() };
        // 0.5, 1.5, 2.5, 3.5; the next would end at 4.5.
        assert_eq!(run(rule, |_| 1.0), (Some(StoppedBy::Seconds), 3, 3.5));
        // One that ends on the second is.
        let rule = StopRule { seconds: Some(4.5), ..Default::default() };
        assert_eq!(run(rule, |_| 1.0), (Some(StoppedBy::Seconds), 4, 4.5));
    }

    #[test]
    fn a_pass_that_is_late_is_dropped_at_the_second() {
        let rule = StopRule { seconds: Some(4.0), ..Default::default() };
        let grows = |pass: u32| if pass < 2 { 1.0 } else { 10.0 };
        assert_eq!(run(rule, grows), (Some(StoppedBy::Seconds), 2, 4.0));
    }

    #[test]
    fn the_first_pass_is_finished_however_long_it_takes() {
        let rule = StopRule { seconds: Some(4.0), ..Default::default() };
        assert_eq!(rule.deadline(0), None);
        assert_eq!(run(rule, |_| 60.0), (Some(StoppedBy::Seconds), 1, 60.5));
    }

    #[test]
    fn whichever_comes_first() {
        let rule = StopRule { passes: Some(100), seconds: Some(10.0), error: Some(0.1) };
        assert_eq!(run(rule, |_| 1.0).0, Some(StoppedBy::Seconds));
        assert_eq!(run(rule, |_| 0.01).0, Some(StoppedBy::Passes));
        assert_eq!(rule.verdict(&with_error(100, 0.1)), Some(StoppedBy::Error));
        assert_eq!(rule.verdict(&with_error(99, 0.101)), None);
    }

    #[test]
    fn a_lucky_small_sample_does_not_stop() {
        let rule = StopRule { error: Some(0.1), ..Default::default() };
        assert_eq!(rule.verdict(&with_error(LEAST_PASSES - 1, 0.0)), None);
        assert_eq!(rule.verdict(&with_error(LEAST_PASSES, 0.0)), Some(StoppedBy::Error));
        assert_eq!(rule.verdict(&with_error(LEAST_PASSES, 0.11)), None);
        assert!(!rule.asks_for_error(LEAST_PASSES - 1) && rule.asks_for_error(LEAST_PASSES));
        assert!(!StopRule::default().asks_for_error(LEAST_PASSES));
    }
}
