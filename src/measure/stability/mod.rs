//! Stability cases: kernels and renders driven to where numbers break, each against an oracle of its own.
//!
//! One file for each group. An oracle is a closed form, f64, or brute force; it shares nothing with what it judges.

pub mod case;
mod oracle;

mod clipping;
mod footprints;
mod passes;
mod powers;
mod setup;

pub use case::{Case, Judged, Outcome, Verdict};

/// All cases of this module, group by group.
pub fn cases() -> Vec<Case> {
    [footprints::CASES, clipping::CASES, powers::CASES, passes::CASES].concat()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn print() {
        let only = std::env::var("ONLY").unwrap_or_default();
        for case in cases().into_iter().filter(|c| c.name.contains(&only) || c.group.contains(&only)) {
            let j = case.judge();
            println!(
                "{:24} {:9.2e} {:9.2e} {} b {} nf {} t {} {:.1}s {:?} {}",
                case.name,
                j.outcome.worst,
                case.limit,
                j.verdict().name(),
                j.outcome.bounded,
                j.outcome.not_finite,
                j.outcome.tried,
                j.seconds,
                j.outcome.failure,
                j.outcome.at
            );
        }
    }
}
