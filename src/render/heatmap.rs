//! Images of how an estimator made its image in one pass.

use crate::estimate::Estimator;
use crate::estimate::final_gathering::WithFinalGathering;
use crate::estimate::integrated::Integrated;
use crate::math::rgb::{Rgb, mean};
use crate::photons::MapPhoton;
use crate::photons::map::MapParts;
use crate::render::film::Rect;
use crate::render::inspect::{InspectError, check};
use crate::render::pass::Pass;
use crate::render::photon_pass::PhotonMaps;
use crate::render::plan::{Plan, Slot};
use crate::render::settings::Gather;
use crate::render::tiles::tiles;
use crate::render::turns::in_turn;
use crate::render::view::{Unrecorded, ViewCounts, ViewHit, ViewTracer};
use crate::render::view_pass::{Scratch, ViewPass};
use crate::render::watch::Silent;
use glam::DVec3;

/// A quantity of a pixel.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Heatmap {
    /// Photons of non-zero weight, over all hits.
    Photons,
    /// Longest semi-axis among those photons' footprints.
    LargestFootprint,
    /// Distance from a hit to the farthest photon that was gathered there, whatever its weight; for `density` the
    /// radius of its disc. The largest of all hits.
    GatherRadius,
    /// Largest ratio of semi-axes among photons of non-zero weight; 0 without any.
    Condition,
    /// Standard error of the pixel's mean channel, estimated from the photons of the pass: `√Σ (w Φ weight)²`.
    ///
    /// It takes photons as independent and their number as Poisson distributed. Well-spread numbers, as Sobol's, and
    /// the k nearest do better than that; several photons of one path do worse. Noise of shadow rays is not in it.
    StandardError,
    /// Light of photons under the estimator minus that under `integrated` with overlap, on the same photons; the mean
    /// channel, signed. What final gathering brings is left out on both sides.
    ToExact,
    /// Time that one thread spent on the pixel's tile for this estimator.
    TileMilliseconds,
}

impl Heatmap {
    /// All of them.
    pub const ALL: [Self; 7] = [
        Self::Photons,
        Self::LargestFootprint,
        Self::GatherRadius,
        Self::Condition,
        Self::StandardError,
        Self::ToExact,
        Self::TileMilliseconds,
    ];

    /// Name in files and settings.
    pub fn id(self) -> &'static str {
        match self {
            Self::Photons => "photons",
            Self::LargestFootprint => "largest_footprint",
            Self::GatherRadius => "gather_radius",
            Self::Condition => "condition",
            Self::StandardError => "standard_error",
            Self::ToExact => "to_exact",
            Self::TileMilliseconds => "tile_milliseconds",
        }
    }

    /// Title for people.
    pub fn title(self) -> &'static str {
        match self {
            Self::Photons => "Photons that count",
            Self::LargestFootprint => "Largest footprint",
            Self::GatherRadius => "Gather radius",
            Self::Condition => "Condition",
            Self::StandardError => "Standard error",
            Self::ToExact => "Difference to integrated",
            Self::TileMilliseconds => "Time of the tile",
        }
    }

    /// Unit; empty for numbers without.
    pub fn unit(self) -> &'static str {
        match self {
            Self::Photons | Self::Condition => "",
            Self::LargestFootprint | Self::GatherRadius => "m",
            Self::StandardError | Self::ToExact => "W/(m² sr)",
            Self::TileMilliseconds => "ms",
        }
    }

    /// Whether values may be negative.
    pub fn is_signed(self) -> bool {
        self == Self::ToExact
    }

    /// What it leaves out under an estimator with final gathering, for people; None if nothing.
    pub fn with_final_gathering(self) -> Option<&'static str> {
        match self {
            Self::Photons | Self::LargestFootprint | Self::GatherRadius | Self::Condition => Some(
                "of photons around view hits, which here bring caustics alone; not of those that gather rays look up",
            ),
            Self::StandardError => {
                Some("of caustics alone; noise of gather rays, and of what they look up, is not in it")
            }
            Self::ToExact => Some("of caustics alone: what final gathering brings is left out on both sides"),
            Self::TileMilliseconds => None,
        }
    }

    /// The one of that [`Heatmap::id`].
    pub fn parse(id: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|h| h.id() == id)
    }
}

/// A heatmap that is ready to be made, tile by tile, on any thread.
pub struct HeatmapPass<'a> {
    pass: &'a Pass,
    slot: Slot<'a>,
    kind: Heatmap,
    exact: Option<Exact>,
}

/// What `integrated` with overlap needs and the pass may lack.
struct Exact {
    /// With the same final gathering as the estimator, so that it looks into the same maps.
    estimator: Box<dyn Estimator>,
    plan: Plan,
    /// The pass's plan without final gathering: what that brings is no matter of photons around a hit.
    own_plan: Plan,
    /// None if those of the pass will do.
    maps: Option<PhotonMaps>,
}

impl<'a> HeatmapPass<'a> {
    /// Prepares it. For [`Heatmap::ToExact`] this builds footprint hierarchies if the pass has none.
    ///
    /// # Errors
    /// A pass that lacks what the estimator needs; for [`Heatmap::ToExact`] one whose photons carry no footprints.
    pub fn new(pass: &'a Pass, estimator: &'a dyn Estimator, kind: Heatmap) -> Result<Self, InspectError> {
        let slot = Slot::new(estimator, pass.settings.gather);
        check(pass, &slot)?;
        let exact = if kind == Heatmap::ToExact { Some(Exact::new(pass, estimator)?) } else { None };
        Ok(Self { pass, slot, kind, exact })
    }

    /// Pixels of a part of the image, row by row; finite.
    ///
    /// The same bits whatever part a pixel is asked for in, but for [`Heatmap::TileMilliseconds`].
    pub fn tile(&self, rect: Rect) -> Vec<f32> {
        self.tile_with(rect, &mut Scratch::default())
    }

    /// The whole image, row by row; None if cancelled.
    pub fn run(&self, cancelled: &(dyn Fn() -> bool + Sync)) -> Option<Vec<f32>> {
        let size = self.pass.settings.size;
        let all = tiles(Rect::whole(size));
        let done = in_turn(all.len(), Scratch::default, |scratch, number| {
            (!cancelled()).then(|| self.tile_with(all[number], scratch))
        });
        let mut image = vec![0.0; size[0] as usize * size[1] as usize];
        for (rect, pixels) in all.iter().zip(done) {
            for (row, line) in pixels?.chunks(rect.width as usize).enumerate() {
                let start = (rect.y as usize + row) * size[0] as usize + rect.x as usize;
                image[start..start + line.len()].copy_from_slice(line);
            }
        }
        Some(image)
    }

    fn tile_with(&self, rect: Rect, scratch: &mut Scratch) -> Vec<f32> {
        let pixels = rect.width as usize * rect.height as usize;
        match (self.kind, &self.exact) {
            (Heatmap::TileMilliseconds, _) => {
                let tile = self.pass.view().tile(rect, 0, &[self.slot], scratch, &Silent);
                let seconds = tile.and_then(|t| Some(t.images.first()?.seconds.total())).unwrap_or(0.0);
                vec![(seconds * 1e3) as f32; pixels]
            }
            (_, Some(exact)) => {
                let view = self.pass.view();
                let view = ViewPass { tracer: ViewTracer { plan: &exact.own_plan, ..view.tracer }, ..view };
                let own = light_of_photons(&view, &self.slot, rect, scratch);
                let integrated = Slot { estimator: exact.estimator.as_ref(), gather: Gather::Overlap };
                let truth = light_of_photons(&exact.view(self.pass), &integrated, rect, scratch);
                own.iter().zip(truth).map(|(o, t)| mean(*o) - mean(t)).collect()
            }
            (Heatmap::GatherRadius, _) => self.gather_radius(rect, scratch),
            (kind, _) => self.over_photons(kind, rect, scratch),
        }
    }

    fn gather_radius(&self, rect: Rect, scratch: &mut Scratch) -> Vec<f32> {
        let view = self.pass.view();
        let mut values = self.traced(&view, rect, scratch);
        view.each_gathered(&self.slot, scratch, |_, hit, _, gathered| {
            let away = |i: &u32| (gathered.photons[*i as usize].position - hit.view.query.center).length();
            let radius = match gathered.radius > 0.0 {
                true => gathered.radius,
                false => gathered.indices.iter().map(away).fold(0.0, f32::max),
            };
            let value = &mut values[hit.pixel as usize];
            *value = value.max(radius);
        });
        values
    }

    /// Folds what the photons of non-zero weight say.
    fn over_photons(&self, kind: Heatmap, rect: Rect, scratch: &mut Scratch) -> Vec<f32> {
        let view = self.pass.view();
        let mut values: Vec<f64> = self.traced(&view, rect, scratch).into_iter().map(f64::from).collect();
        let rays = f64::from(self.slot.estimator.rays_per_axis().pow(2));
        view.each_gathered(&self.slot, scratch, |_, hit, _, gathered| {
            let value = &mut values[hit.pixel as usize];
            for &i in gathered.indices {
                let photon = &gathered.photons[i as usize];
                let weight = self.slot.estimator.weight(photon, &hit.view, gathered.radius);
                if weight != 0.0 {
                    *value = match kind {
                        Heatmap::Photons => *value + 1.0,
                        Heatmap::LargestFootprint => value.max(f64::from(photon.reach())),
                        Heatmap::Condition => value.max(photon.condition()),
                        _ => *value + squared(photon, weight, hit, rays),
                    };
                }
            }
        });
        let last = |v: f64| if kind == Heatmap::StandardError { v.sqrt() } else { v };
        values.into_iter().map(|v| last(v).min(f64::from(f32::MAX)) as f32).collect()
    }

    /// Traces the rays of a tile and returns a zero for each pixel.
    fn traced(&self, view: &ViewPass, rect: Rect, scratch: &mut Scratch) -> Vec<f32> {
        let rays = self.slot.estimator.rays_per_axis();
        let base = view.trace(rect, rays, scratch, &mut ViewCounts::default(), &mut Unrecorded);
        vec![0.0; base.len()]
    }
}

/// A whole heatmap, row by row; None if cancelled. The same bits for any number of threads, but for
/// [`Heatmap::TileMilliseconds`].
///
/// # Errors
/// As [`HeatmapPass::new`].
pub fn heatmap(
    pass: &Pass,
    estimator: &dyn Estimator,
    kind: Heatmap,
    cancelled: &(dyn Fn() -> bool + Sync),
) -> Result<Option<Vec<f32>>, InspectError> {
    Ok(HeatmapPass::new(pass, estimator, kind)?.run(cancelled))
}

impl Exact {
    fn new(pass: &Pass, of: &dyn Estimator) -> Result<Self, InspectError> {
        let estimator: Box<dyn Estimator> = match of.final_gathering() {
            Some(f) => Box::new(WithFinalGathering::new(Box::new(Integrated), *f)),
            None => Box::new(Integrated),
        };
        let mut plan = pass.plan.clone();
        plan.view_differentials |= plan.needs_photons();
        let maps = (!plan.overlap && plan.needs_photons()).then(|| {
            let parts = MapParts { kd_tree: false, overlap: true };
            PhotonMaps::with_parts(&pass.scene, &plan, &pass.photons.stored, pass.scale(), parts)
        });
        plan.overlap |= maps.is_some();
        let slot = Slot { estimator: estimator.as_ref(), gather: Gather::Overlap };
        if let Some(part) = plan.lacks(&slot) {
            return Err(InspectError::Lacks { estimator: estimator.name(), part });
        }
        plan.final_gatherings.clear();
        let own_plan = Plan { final_gatherings: Vec::new(), ..pass.plan.clone() };
        Ok(Self { estimator, plan, own_plan, maps })
    }

    fn view<'a>(&'a self, pass: &'a Pass) -> ViewPass<'a> {
        let view = pass.view();
        let maps = self.maps.as_ref().unwrap_or(view.maps);
        let footprints = self.plan.view_differentials;
        ViewPass { tracer: ViewTracer { plan: &self.plan, footprints, ..view.tracer }, maps, ..view }
    }
}

/// Radiance of each pixel without what needs no photons.
fn light_of_photons(view: &ViewPass, slot: &Slot, rect: Rect, scratch: &mut Scratch) -> Vec<Rgb> {
    let rays = slot.estimator.rays_per_axis();
    let mut base = view.trace(rect, rays, scratch, &mut ViewCounts::default(), &mut Unrecorded);
    base.fill(DVec3::ZERO);
    view.estimate(&base, rays, slot, scratch, &|| false).map(|image| image.pixels).unwrap_or_default()
}

/// Square of what a photon adds to the mean channel of its pixel.
fn squared(photon: &MapPhoton, weight: f64, hit: &ViewHit, rays: f64) -> f64 {
    let added: DVec3 = photon.power.as_dvec3() * hit.weight.as_dvec3() * (weight / rays);
    let mean = (added.x + added.y + added.z) / 3.0;
    mean * mean
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::estimate::registry::{estimator, estimators};
    use crate::render::inspect::{PhotonRow, inspect};
    use crate::render::renderer::slots;
    use crate::render::{RenderSettings, Renderer};
    use crate::scene::open;
    use crate::scene::scene_file::RenderFile;
    use std::sync::Arc;

    fn pass(scene: &str, names: &str, gather: &str, passes: u32) -> Arc<Pass> {
        let scene = open(scene).expect("built in");
        let flags = RenderFile { photons: Some(20_000), gather: Some(gather.into()), ..Default::default() };
        let settings = RenderSettings::new(&scene, &flags, Some([48, 40]), 3).expect("valid");
        let mut renderer = Renderer::new(scene.into(), settings, estimators(names).expect("registered"));
        for _ in 0..passes {
            renderer.step(&Silent);
        }
        Arc::clone(renderer.last_pass().expect("a pass"))
    }

    fn made(pass: &Pass, name: &str, kind: Heatmap) -> Vec<f32> {
        let e = estimator(name).expect("registered");
        heatmap(pass, e.as_ref(), kind, &|| false).expect("the pass serves it").expect("not cancelled")
    }

    #[test]
    fn names_come_back() {
        for h in Heatmap::ALL {
            assert_eq!(Heatmap::parse(h.id()), Some(h));
        }
        assert_eq!(Heatmap::parse("heat"), None);
    }

    /// Every heatmap against the rows of the inspector, at pixels all over the image.
    #[test]
    fn heatmaps_agree_with_the_inspector() {
        for gather in ["overlap", "knn"] {
            let all = "density,regular_3x3:n=2,coplanar,integrated";
            let p = pass("glass_sphere", all, gather, 2);
            let list = estimators(all).expect("registered");
            let maps: Vec<Vec<Vec<f32>>> =
                list.iter().map(|e| Heatmap::ALL.map(|h| made(&p, &e.name(), h)).into()).collect();
            let mut lit = 0;
            for i in (0..48 * 40).step_by(97) {
                let inspection = inspect(&p, &list, [i % 48, i / 48]).expect("inside");
                for (e, maps) in maps.iter().enumerate() {
                    let at = |h: Heatmap| {
                        let k = Heatmap::ALL.iter().position(|x| *x == h).expect("listed");
                        maps[k][i as usize]
                    };
                    let rows: Vec<_> = inspection.rows.iter().filter(|r| r.weights[e] > 0.0).collect();
                    assert_eq!(at(Heatmap::Photons), rows.len() as f32);
                    let condition = rows.iter().map(|r| r.condition as f32).fold(0.0, f32::max);
                    assert_eq!(at(Heatmap::Condition), condition);
                    let squares = rows.iter().map(|r| f64::from(mean(r.contributions[e])).powi(2));
                    let error = squares.sum::<f64>().sqrt() as f32;
                    assert!((at(Heatmap::StandardError) - error).abs() <= 1e-5 * error);
                    let longest = rows.iter().map(|r| r.footprint[0].length().max(r.footprint[1].length()));
                    assert!(longest.fold(0.0, f32::max) <= at(Heatmap::LargestFootprint) * 1.000_01);
                    let center = |r: &PhotonRow| inspection.hits[r.hit].seen_by(list[e].as_ref()).query.center;
                    let away = rows.iter().map(|r| (r.position - center(r)).length());
                    assert!(away.fold(0.0, f32::max) <= at(Heatmap::GatherRadius) * 1.000_01);
                    lit += rows.len();
                }
            }
            assert!(lit > 1000, "{lit}");
        }
    }

    /// On its own photons `integrated` has no difference; what `knn` drops is dark, and shows as negative.
    #[test]
    fn difference_to_integrated_shows_what_is_lost() {
        let p = pass("ring", "integrated", "overlap", 1);
        assert!(made(&p, "integrated", Heatmap::ToExact).iter().all(|v| *v == 0.0));
        // A pass without footprint hierarchy or view footprints gets them for this.
        let p = pass("glass_sphere", "regular", "knn", 1);
        assert!(!p.plan.overlap && !p.plan.view_differentials);
        let lost = made(&p, "regular", Heatmap::ToExact);
        assert!(lost.iter().all(|v| v.is_finite()) && lost.iter().any(|v| *v < 0.0));
        // Photons without footprints cannot be integrated.
        let p = pass("ring", "density", "overlap", 1);
        let e = estimator("density").expect("registered");
        assert!(heatmap(&p, e.as_ref(), Heatmap::ToExact, &|| false).is_err());
    }

    /// It is the difference of the two images where both see the same rays.
    #[test]
    fn difference_to_integrated_is_that_of_the_images() {
        let all = "coplanar,integrated";
        let p = pass("cornell", all, "overlap", 1);
        let list = estimators(all).expect("registered");
        let view = p.view().run(Rect::whole([48, 40]), &slots(&list, Gather::Overlap), &Silent);
        let difference = made(&p, "coplanar", Heatmap::ToExact);
        let mut largest = 0.0f32;
        for tile in &view.tiles {
            for (k, (c, i)) in tile.images[0].pixels.iter().zip(&tile.images[1].pixels).enumerate() {
                let (x, y) = (tile.rect.x + k as u32 % tile.rect.width, tile.rect.y + k as u32 / tile.rect.width);
                let d = difference[(y * 48 + x) as usize];
                assert!((mean(*c) - mean(*i) - d).abs() <= 1e-5 * mean(*c).max(mean(*i)));
                largest = largest.max(d);
            }
        }
        assert!(largest > 0.0, "published coplanar is too bright");
    }

    #[test]
    fn threads_and_tiles_change_nothing() {
        let p = pass("glass_sphere", "density,coplanar", "overlap", 1);
        for kind in Heatmap::ALL.into_iter().filter(|k| *k != Heatmap::TileMilliseconds) {
            for name in ["density", "coplanar"] {
                let on = |threads| {
                    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
                    pool.install(|| made(&p, name, kind))
                };
                let one = on(1);
                assert_eq!(one, on(3));
                let e = estimator(name).expect("registered");
                let own = HeatmapPass::new(&p, e.as_ref(), kind).expect("served");
                let part = own.tile(Rect { x: 30, y: 20, width: 5, height: 1 });
                assert_eq!(part, one[20 * 48 + 30..20 * 48 + 35]);
            }
        }
        let times = made(&p, "density", Heatmap::TileMilliseconds);
        assert!(times.iter().all(|t| *t > 0.0) && times.len() == 48 * 40);
    }

    /// What is left of a panel with final gathering: the caustics, by the same photons as without it.
    #[test]
    fn heatmaps_of_final_gathering_are_those_of_caustics() {
        let p = pass("glass_sphere", "regular,regular+classic:rays=4,integrated", "overlap", 1);
        assert!(p.plan.gathers() && p.maps.global.is_some());
        let [photons, all] = ["regular+classic:rays=4", "regular"].map(|n| made(&p, n, Heatmap::Photons));
        assert!(photons.iter().zip(&all).all(|(c, a)| c <= a) && photons.iter().sum::<f32>() < all.iter().sum());
        assert!(photons.iter().any(|n| *n > 0.0));
        let e = estimator("regular+classic:rays=4").expect("registered");
        let difference = made(&p, "regular+classic:rays=4", Heatmap::ToExact);
        // By the inspector's rows: caustic light under regular less that under integrated.
        let list = estimators("regular,integrated").expect("registered");
        let mut lit = 0;
        for i in (0..48 * 40).step_by(31) {
            let found = inspect(&p, &list, [i % 48, i / 48]).expect("inside");
            let caustic = found.rows.iter().filter(|r| r.kind == crate::photons::PhotonKind::Caustic);
            let [own, exact] = caustic.fold([0.0; 2], |[a, b], r| {
                [a + f64::from(mean(r.contributions[0])), b + f64::from(mean(r.contributions[1]))]
            });
            let error = (f64::from(difference[i as usize]) - (own - exact)).abs();
            assert!(error <= 1e-5 * own.max(exact), "{i}: {} {own} {exact}", difference[i as usize]);
            lit += u32::from(own > 0.0);
        }
        assert!(lit > 5, "{lit}");
        // A pass that gathers finally alone has no global map, and needs none for it.
        let p = pass("glass_sphere", &e.name(), "overlap", 1);
        assert!(p.maps.global.is_none());
        let alone = made(&p, &e.name(), Heatmap::ToExact);
        assert!(alone.iter().all(|v| v.is_finite()));
    }

    #[test]
    fn a_cancelled_heatmap_is_none() {
        let p = pass("ring", "regular", "overlap", 1);
        let e = estimator("regular").expect("registered");
        assert_eq!(heatmap(&p, e.as_ref(), Heatmap::Photons, &|| true), Ok(None));
    }
}
