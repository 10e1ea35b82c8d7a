//! Which builder a hierarchy is made by.

use obvhs::BvhBuildParams;

/// Rays of a render that nobody has counted.
pub const SOME_RAYS: u64 = 20_000_000;

/// How the hierarchy over so many surfaces is built if so many rays are to come.
///
/// The slowest builder takes the time of some six rays for each surface, the one between that of one, and the fastest less;
/// their hierarchies differ by a twentieth or less in the time of a ray (`cargo bench --bench rays`).
pub fn build_parameters(primitives: usize, rays: u64) -> BvhBuildParams {
    match rays / primitives.max(1) as u64 {
        100.. => BvhBuildParams::very_slow_build(),
        10..100 => BvhBuildParams::medium_build(),
        _ => BvhBuildParams::very_fast_build(),
    }
}
