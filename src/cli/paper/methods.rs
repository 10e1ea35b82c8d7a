//! The methods that figures 16 and 17 and table 1 compare.

use crate::cli::failure::Failure;
use crate::cli::paper::printed::SECONDS;
use crate::cli::paper::test_case::{Method, Origin};
use crate::render::settings::Gather;

/// Titles of the thesis's four methods, in the order of figure 16.
const TITLES: [&str; 4] =
    ["(a) Regular, 1×1 view rays", "(b) Regular, 3×3 view rays", "(c) Coplanar", "(d) Multi-sampled, 8×8"];

/// Both gathers, the published one first.
pub const GATHERS: [Gather; 2] = [Gather::Knn, Gather::Overlap];

/// The thesis's four methods and `integrated` for each gather: indices 0 to 4 are the k nearest, 5 to 9 overlap.
///
/// # Errors
/// None but for a defect.
pub fn compared() -> Result<Vec<Method>, Failure> {
    let mut methods = Vec::new();
    for gather in GATHERS {
        for (title, printed) in TITLES.into_iter().zip(SECONDS) {
            methods.push(Method::new(title, printed.estimator, gather, Origin::Thesis)?);
        }
        methods.push(Method::new("Integrated", "integrated", gather, Origin::Cusp)?);
    }
    Ok(methods)
}
