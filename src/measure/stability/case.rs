//! A stability case, what came of it, and the verdict.

use super::oracle::random::Random;
use rayon::prelude::*;
use std::time::Instant;

/// Rounding of f32: what is stored in it afterwards need not be better.
pub const F32: f64 = f32::EPSILON as f64;

/// Something stiff or extreme, and how exactly it must come out.
#[derive(Clone, Copy)]
pub struct Case {
    /// The group that it belongs to: one word.
    pub group: &'static str,
    /// Its name: words joined by `-`, unique among all cases.
    pub name: &'static str,
    /// The quantity that is judged, and what its error is relative to.
    pub what: &'static str,
    /// How extreme the inputs become.
    pub range: &'static str,
    /// What it is judged by.
    pub oracle: &'static str,
    /// Largest error allowed.
    pub limit: f64,
    /// Makes the outcome. The same bits every time, whatever the number of threads.
    pub run: fn() -> Outcome,
}

/// The worst of many tries.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Outcome {
    /// Things tried.
    pub tried: u64,
    /// Largest error seen; 0 if there was none.
    pub worst: f64,
    /// Where it was seen.
    pub at: String,
    /// Results that were NaN or infinite.
    pub not_finite: u64,
    /// Results that the code under test says it has bounded.
    pub bounded: u64,
    /// What went wrong besides errors of numbers, the first of them.
    pub failure: Option<String>,
}

impl Outcome {
    /// Takes one more error into account, which is not negative; `at` says where it was seen.
    pub fn see(&mut self, error: f64, at: impl FnOnce() -> String) {
        self.tried += 1;
        if !error.is_finite() {
            self.not_finite += 1;
            if self.not_finite == 1 {
                self.at = at();
            }
        } else if error > self.worst {
            self.worst = error;
            if self.not_finite == 0 {
                self.at = at();
            }
        }
    }

    /// Notes a result that must be finite, without an error of its own.
    pub fn finite(&mut self, values: impl IntoIterator<Item = f64>, at: impl FnOnce() -> String) {
        if values.into_iter().all(f64::is_finite) {
            self.tried += 1;
        } else {
            self.see(f64::NAN, at);
        }
    }

    /// Notes that a condition does not hold, which fails the case.
    pub fn expect(&mut self, holds: bool, what: impl FnOnce() -> String) {
        self.tried += 1;
        if !holds && self.failure.is_none() {
            self.failure = Some(what());
        }
    }

    /// This and another, whose place is kept only where it is worse.
    pub fn and(mut self, other: Self) -> Self {
        let worse = match (self.not_finite > 0, other.not_finite > 0) {
            (true, _) => false,
            (false, true) => true,
            (false, false) => other.worst > self.worst,
        };
        if worse {
            self.at = other.at;
        }
        self.worst = self.worst.max(other.worst);
        self.tried += other.tried;
        self.not_finite += other.not_finite;
        self.bounded += other.bounded;
        self.failure = self.failure.or(other.failure);
        self
    }
}

/// The outcome of `each` for the numbers below `count`, each with a stream of random numbers of its own.
pub(super) fn many(name: &str, count: u64, each: impl Fn(u64, &mut Random, &mut Outcome) + Sync) -> Outcome {
    const PART: u64 = 512;
    (0..count.div_ceil(PART))
        .into_par_iter()
        .map(|part| {
            let mut outcome = Outcome::default();
            let numbers = part * PART..(part * PART + PART).min(count);
            numbers.for_each(|i| each(i, &mut Random::new(name, i), &mut outcome));
            outcome
        })
        .reduce(Outcome::default, Outcome::and)
}

/// Whether a case holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Verdict {
    /// It does.
    Holds,
    /// The error is above the limit, or nothing was tried.
    Exceeds,
    /// Something was NaN or infinite.
    NotFinite,
    /// A condition was broken.
    Broken,
}

impl Verdict {
    /// `holds`, `exceeds`, `not finite` or `broken`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Holds => "holds",
            Self::Exceeds => "exceeds",
            Self::NotFinite => "not finite",
            Self::Broken => "broken",
        }
    }
}

/// A case with its outcome.
pub struct Judged {
    /// The case.
    pub case: Case,
    /// What came of it.
    pub outcome: Outcome,
    /// Wall seconds that it took.
    pub seconds: f64,
}

impl Case {
    /// Runs it.
    pub fn judge(&self) -> Judged {
        let start = Instant::now();
        let outcome = (self.run)();
        Judged { case: *self, outcome, seconds: start.elapsed().as_secs_f64() }
    }
}

impl Judged {
    /// Whether the case holds.
    pub fn verdict(&self) -> Verdict {
        if self.outcome.not_finite > 0 {
            Verdict::NotFinite
        } else if self.outcome.failure.is_some() {
            Verdict::Broken
        } else if self.outcome.tried == 0 || self.outcome.worst > self.case.limit {
            Verdict::Exceeds
        } else {
            Verdict::Holds
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn judged(run: fn() -> Outcome) -> Judged {
        Case { group: "test", name: "test", what: "", range: "", oracle: "", limit: 0.1, run }.judge()
    }

    #[test]
    fn verdicts_follow_what_was_seen() {
        let with = |error: f64| {
            let mut o = Outcome::default();
            o.see(0.05, || "first".into());
            o.see(error, || "second".into());
            o
        };
        assert_eq!(with(0.01).at, "first");
        assert_eq!(with(f64::NAN).at, "second");
        assert_eq!(judged(Outcome::default).verdict(), Verdict::Exceeds, "a case that tries nothing shows nothing");
        assert_eq!(judged(|| Outcome { tried: 1, worst: 0.1, ..Default::default() }).verdict(), Verdict::Holds);
        assert_eq!(judged(|| Outcome { tried: 1, worst: 0.11, ..Default::default() }).verdict(), Verdict::Exceeds);
        assert_eq!(judged(|| Outcome { tried: 1, not_finite: 1, ..Default::default() }).verdict(), Verdict::NotFinite);
        let mut broken = with(0.01);
        broken.expect(false, || "no".into());
        assert_eq!(with(0.08).and(broken.clone()).failure.as_deref(), Some("no"));
        assert_eq!(with(0.08).and(broken).at, "second");
    }
}
