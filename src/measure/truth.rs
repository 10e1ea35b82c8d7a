//! What estimators are compared with where no reference is at hand: many view rays on the same photons.

use crate::estimate::regular::Regular;
use crate::photons::map::MapParts;
use crate::render::film::{Image, Rect};
use crate::render::pass::Pass;
use crate::render::photon_pass::PhotonMaps;
use crate::render::plan::Slot;
use crate::render::settings::Gather;
use crate::render::view_pass::{TileWatch, ViewPass};

/// View rays along a pixel's side in the truth.
pub const TRUTH_RAYS: u32 = 16;

/// `regular` with 16×16 view rays and full overlap on the photons of a pass, over `region`; None if cancelled.
///
/// It differs from an estimator in nothing but how the pixel is integrated, and in that no photon is left out.
pub fn truth(pass: &Pass, region: Rect, watch: &dyn TileWatch) -> Option<Image> {
    let parts = MapParts { kd_tree: false, overlap: true };
    let own;
    let maps = if pass.plan.overlap {
        &pass.maps
    } else {
        own = PhotonMaps::with_parts(&pass.scene, &pass.plan, &pass.photons.stored, pass.scale(), parts);
        &own
    };
    let regular = Regular::with_rays(TRUTH_RAYS);
    let slot = Slot { estimator: &regular, gather: Gather::Overlap };
    let result = ViewPass { maps, ..pass.view() }.run(region, &[slot], watch);
    result.complete.then(|| result.image(0, region))
}
