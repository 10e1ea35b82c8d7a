//! Stability cases: kernels and renders driven to where numbers break, each against an oracle of its own.
//!
//! One file for each group. An oracle is a closed form, f64, or brute force; it shares nothing with what it judges.

pub mod case;
mod oracle;
mod scenes;

mod chains;
mod clipping;
mod counts;
mod differentials;
mod footprints;
mod passes;
mod powers;
mod setup;
mod units;
mod watertight;

pub use case::{Case, Judged, Outcome, Verdict};

/// All cases of this module, group by group.
pub fn cases() -> Vec<Case> {
    [
        footprints::CASES,
        clipping::CASES,
        differentials::CASES,
        chains::CASES,
        watertight::CASES,
        units::CASES,
        counts::CASES,
        powers::CASES,
        passes::CASES,
    ]
    .concat()
}
