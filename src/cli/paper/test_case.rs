//! The common test case of the thesis: the metal ring and its caustic (Pedersen 2011, section 5.1).

use crate::cli::failure::Failure;
use crate::cli::paper::{PaperFlags, printed};
use crate::cli::progress::{ProgressWatch, bar, interrupted};
use crate::estimate::Estimator;
use crate::estimate::integrated::Integrated;
use crate::estimate::registry;
use crate::estimate::regular::Regular;
use crate::measure::truth::{TRUTH_RAYS, truth};
use crate::render::film::{Image, Rect};
use crate::render::plan::Slot;
use crate::render::settings::{Gather, RenderSettings};
use crate::render::tiles::tiles;
use crate::render::view::ViewTracer;
use crate::render::view_pass::{PartSeconds, ViewPass};
use crate::render::{LightPart, Pass};
use crate::scene::open;
use crate::scene::scene_file::RenderFile;
use rayon::prelude::*;
use serde::Serialize;
use std::sync::Arc;
use std::time::Instant;

/// Photons emitted by default: with seed 1 so many store [`printed::STORED_CAUSTIC`] caustic ones.
pub const PHOTONS: i64 = 446_300;
/// The part of the image around the inner band of the ring, for 512×512 pixels (figure 17).
const INNER_BAND: Rect = Rect { x: 296, y: 186, width: 120, height: 88 };
/// Pixels across and down for which that part is meant.
const NATIVE: f64 = 512.0;

/// Where a method comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Origin {
    /// The thesis.
    Thesis,
    /// A defect of the thesis's listings, emulated.
    Listing,
    /// This program.
    Cusp,
}

impl Origin {
    /// For tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::Thesis => "thesis",
            Self::Listing => "listing",
            Self::Cusp => "cusp",
        }
    }
}

/// An estimator with its gather, as it takes part in an item.
pub struct Method {
    /// For pictures.
    pub title: &'static str,
    /// The estimator.
    pub estimator: Box<dyn Estimator>,
    /// How it looks photons up.
    pub gather: Gather,
    /// How many `knn` looks up; the case's own number if None.
    pub k: Option<usize>,
    /// Where it comes from.
    pub origin: Origin,
}

impl Method {
    /// The estimator that `name` means to the command line.
    ///
    /// # Errors
    /// A name that is none, which would be a defect.
    pub fn new(title: &'static str, name: &str, gather: Gather, origin: Origin) -> Result<Self, Failure> {
        Ok(Self { title, estimator: registry::estimator(name)?, gather, k: None, origin })
    }
}

/// Images of some methods, and what they cost.
pub struct Shown {
    /// One for each method.
    pub images: Vec<Image>,
    /// Wall seconds of each as if it were alone.
    pub seconds: Vec<PartSeconds>,
    /// Photons that each looked at.
    pub gathered: Vec<u64>,
}

/// How many photons overlap at the view hits of a region.
#[derive(Clone, Copy, Debug, Default, Serialize)]
pub struct Crowding {
    /// View hits that at least one photon overlaps.
    pub lit_hits: u64,
    /// Photons that overlap there, the mean.
    pub mean: f64,
    /// Photons that overlap, the most.
    pub most: u64,
    /// Share of the lit hits where more than k photons overlap.
    pub share_above_k: f64,
}

/// The scene, its photons and the settings.
pub struct TestCase {
    /// The pass that everything is made from.
    pub pass: Pass,
    /// Seconds of photons and maps.
    pub photon_seconds: f64,
    item: &'static str,
    hidden: bool,
}

impl TestCase {
    /// Traces the photons of `item` under the thesis's settings with `flags` on top.
    ///
    /// # Errors
    /// A flag out of range, or an interruption.
    pub fn new(item: &'static str, flags: &PaperFlags, light: LightPart) -> Result<Self, Failure> {
        let scene = open("ring")?;
        let mut render = RenderFile {
            photons: Some(PHOTONS),
            k: Some(printed::K),
            footprint_scale: Some(printed::PRINTED_SCALE * printed::DIFF_SMOOTHING),
            gather: Some("knn".into()),
            // The number of photons is that of all directions, of which a ninetieth becomes caustic.
            projection_map: Some("off".into()),
            ..Default::default()
        };
        let common = flags.common();
        common.onto(&mut render);
        let mut settings = RenderSettings::new(&scene, &render, common.size, common.seed.unwrap_or(1))?;
        settings.light = light;
        let (regular, integrated) = (Regular::new(), Integrated);
        // These two need every structure that any method of the thesis needs.
        let slots = [
            Slot { estimator: &regular, gather: Gather::Knn },
            Slot { estimator: &integrated, gather: Gather::Overlap },
        ];
        let start = Instant::now();
        let pass = Pass::for_slots(Arc::new(scene), settings, &slots, 0, &interrupted)?.ok_or_else(|| stopped(item))?;
        let photon_seconds = start.elapsed().as_secs_f64();
        Ok(Self { pass, photon_seconds, item, hidden: common.quiet || common.json })
    }

    /// The whole image.
    pub fn whole(&self) -> Rect {
        Rect::whole(self.pass.settings.size)
    }

    /// The part around the inner band of the ring that figure 17 enlarges.
    pub fn inner_band(&self) -> Rect {
        inner_band(self.pass.settings.size)
    }

    /// Renders a region by all methods, on the same photons.
    ///
    /// # Errors
    /// An interruption.
    pub fn render(&self, region: Rect, methods: &[Method], what: &str) -> Result<Shown, Failure> {
        let own = self.pass.settings.k;
        let mut ks: Vec<usize> = methods.iter().map(|m| m.k.unwrap_or(own)).collect();
        ks.sort_unstable();
        ks.dedup();
        let progress = bar((tiles(region).len() * ks.len()) as u64, what, self.hidden);
        let mut found: Vec<Option<(Image, PartSeconds, u64)>> = methods.iter().map(|_| None).collect();
        for k in ks {
            let chosen: Vec<usize> = (0..methods.len()).filter(|&i| methods[i].k.unwrap_or(own) == k).collect();
            let slots: Vec<Slot> = chosen
                .iter()
                .map(|&i| Slot { estimator: methods[i].estimator.as_ref(), gather: methods[i].gather })
                .collect();
            let settings = RenderSettings { k, ..self.pass.settings.clone() };
            let view = self.pass.view();
            let view = ViewPass { tracer: ViewTracer { settings: &settings, ..view.tracer }, ..view };
            let result = view.run(region, &slots, &ProgressWatch { bar: &progress, deadline: None });
            if !result.complete {
                progress.finish_and_clear();
                return Err(stopped(self.item));
            }
            for (slot, &i) in chosen.iter().enumerate() {
                found[i] = Some((result.image(slot, region), result.seconds[slot], result.gathered[slot]));
            }
        }
        progress.finish_and_clear();
        let mut shown = Shown { images: Vec::new(), seconds: Vec::new(), gathered: Vec::new() };
        for (image, seconds, gathered) in found.into_iter().flatten() {
            shown.images.push(image);
            shown.seconds.push(seconds);
            shown.gathered.push(gathered);
        }
        Ok(shown)
    }

    /// Wall seconds of one method's whole view pass, with nothing else beside it.
    ///
    /// # Errors
    /// An interruption.
    pub fn time(&self, method: &Method, watch: &ProgressWatch) -> Result<f64, Failure> {
        let slot = Slot { estimator: method.estimator.as_ref(), gather: method.gather };
        let result = self.pass.view().run(self.whole(), &[slot], watch);
        if result.complete { Ok(result.wall) } else { Err(stopped(self.item)) }
    }

    /// `regular` with 16×16 view rays, all photons that overlap.
    ///
    /// # Errors
    /// An interruption.
    pub fn truth(&self, region: Rect) -> Result<Image, Failure> {
        let progress = bar(tiles(region).len() as u64, "truth", self.hidden);
        let image = truth(&self.pass, region, &ProgressWatch { bar: &progress, deadline: None });
        progress.finish_and_clear();
        image.ok_or_else(|| stopped(self.item))
    }

    /// `regular` with 16×16 view rays, each with its k nearest: what more view rays alone lead to.
    ///
    /// # Errors
    /// An interruption.
    pub fn truth_of_nearest(&self, region: Rect) -> Result<Image, Failure> {
        let estimator = Box::new(Regular::with_rays(TRUTH_RAYS));
        let method = Method { title: "", estimator, gather: Gather::Knn, k: None, origin: Origin::Thesis };
        let shown = self.render(region, &[method], "truth of the k nearest")?;
        shown.images.into_iter().next().ok_or_else(|| stopped(self.item))
    }

    /// Counts the photons that overlap at the hits of a region.
    ///
    /// # Errors
    /// An interruption.
    pub fn crowding(&self, region: Rect) -> Result<Crowding, Failure> {
        let slot = Slot { estimator: &Integrated, gather: Gather::Overlap };
        let view = self.pass.view();
        let k = self.pass.settings.k;
        let counts: Vec<[u64; 4]> = tiles(region)
            .par_iter()
            .filter(|_| !interrupted())
            .map(|tile| {
                let gathered = view.gathered(*tile, &slot);
                let lit = gathered.each(&self.pass.maps).map(|(_, g)| g.indices.len()).filter(|n| *n > 0);
                lit.fold([0; 4], |[hits, sum, most, above], n| {
                    [hits + 1, sum + n as u64, most.max(n as u64), above + u64::from(n > k)]
                })
            })
            .collect();
        if interrupted() {
            return Err(stopped(self.item));
        }
        let [hits, sum, most, above] =
            counts.iter().fold([0; 4], |a, b| [a[0] + b[0], a[1] + b[1], a[2].max(b[2]), a[3] + b[3]]);
        let of_hits = |n: u64| if hits > 0 { n as f64 / hits as f64 } else { 0.0 };
        Ok(Crowding { lit_hits: hits, mean: of_hits(sum), most, share_above_k: of_hits(above) })
    }

    /// Whether nobody wants to see progress.
    pub fn hidden(&self) -> bool {
        self.hidden
    }

    /// What an item is when Ctrl-C has been pressed.
    pub fn stopped(&self) -> Failure {
        stopped(self.item)
    }
}

fn stopped(item: &str) -> Failure {
    Failure::Interrupted(format!("nothing of {item} was written"))
}

/// The camera's angle is that of the image's height, so the part scales with it.
fn inner_band(size: [u32; 2]) -> Rect {
    let [w, h] = size.map(f64::from);
    let scale = h / NATIVE;
    let x = w / 2.0 + (f64::from(INNER_BAND.x) - NATIVE / 2.0) * scale;
    let at = |v: f64| v.round().max(0.0) as u32;
    let part = Rect {
        x: at(x).min(size[0] - 1),
        y: at(f64::from(INNER_BAND.y) * scale).min(size[1] - 1),
        width: at(f64::from(INNER_BAND.width) * scale).max(1),
        height: at(f64::from(INNER_BAND.height) * scale).max(1),
    };
    part.within(size)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_inner_band_scales_with_the_image() {
        assert_eq!(inner_band([512, 512]), INNER_BAND);
        assert_eq!(inner_band([256, 256]), Rect { x: 148, y: 93, width: 60, height: 44 });
        assert_eq!(inner_band([1024, 512]).x, 512 + 40);
        for size in [[1, 1], [7, 3], [3, 400]] {
            let r = inner_band(size);
            assert!(r.width > 0 && r.height > 0 && r.x + r.width <= size[0] && r.y + r.height <= size[1], "{r:?}");
        }
    }

    /// The default number of photons is chosen so that the published number is stored.
    #[test]
    fn the_published_number_of_photons_is_stored() {
        let case = TestCase::new("test", &PaperFlags::default(), LightPart::Caustic).expect("renders");
        assert_eq!(case.pass.photons.stored.caustic.len() as u64, printed::STORED_CAUSTIC);
        assert_eq!(case.pass.settings.k, 50);
        assert!((case.pass.settings.footprint_scale - 8.86).abs() < 1e-5);
    }
}
