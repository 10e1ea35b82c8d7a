//! One layer of the irradiance pyramid: estimates over discs of one radius, spread evenly over the surfaces.

use crate::math::rgb::{Rgb, in_f32};
use crate::photons::footprint::FilterTransform;
use crate::photons::irradiance::surface_area::SurfaceAreas;
use crate::photons::irradiance::{GlobalPhotons, agree};
use crate::photons::kd_tree::{BYTES_PER_ENTRY_OF_SMALL_LEAVES, KdTree};
use glam::{DVec3, Vec3};
use rayon::prelude::*;
use std::f64::consts::PI;

/// Irradiance over a disc of a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct IrradianceEstimate {
    /// Centre of the disc, metres.
    pub position: Vec3,
    /// Unit normal of the surface there, on the side that is lit.
    pub normal: Vec3,
    /// W/m².
    pub irradiance: Rgb,
    /// Its weight in a mean: the area of the surface that it stands for, m²; 1 for all as published.
    pub area: f32,
}

/// Where estimates are made and what they count for.
#[derive(Clone, Copy)]
pub enum Estimates<'a> {
    /// Over the surface that the disc holds, but for the photons and the surface nearer to its centre than estimates lie
    /// to each other, and weighted by area.
    ///
    /// An estimate lies where a photon is, and where those before it are not. What lies near is there for certain, or is
    /// not, and says nothing about how many arrive. Where light is rare so are the places, so that their plain mean would be
    /// that of the bright ones.
    Corrected(&'a SurfaceAreas<'a>),
    /// Over the whole disc, with all photons, all of weight 1.
    AsPublished,
}

/// Estimates of one radius with their kd-tree, in the tree's order.
#[derive(Clone, Debug, Default)]
pub struct Layer {
    radius: f32,
    estimates: Vec<IrradianceEstimate>,
    tree: KdTree,
}

impl Layer {
    /// The most detailed layer: estimates within `radius` (metres, positive) at photons of which none of a related surface
    /// is nearer to another than `spacing` (metres).
    pub fn of_photons(photons: &GlobalPhotons, radius: f32, spacing: f32, how: Estimates) -> Self {
        let all = photons.photons();
        let kept = apart(photons.tree(), all.len(), spacing, |i| (all[i].position, all[i].normal));
        let estimates: Vec<IrradianceEstimate> = kept
            .par_iter()
            .map(|&i| {
                let at = &all[i as usize];
                let (power, area) = match how {
                    Estimates::AsPublished => {
                        (photons.power_between(at.position, at.normal, [0.0, radius]), PI * f64::from(radius).powi(2))
                    }
                    Estimates::Corrected(areas) => {
                        let area = |radius| areas.within(at.position, at.normal, radius);
                        let power = photons.power_between(at.position, at.normal, [spacing, radius]);
                        (power, area(radius) - area(spacing))
                    }
                };
                // A surface that is smaller than f32 can tell there holds no photons that count.
                let irradiance = if area > 0.0 { in_f32(power.max(DVec3::ZERO) / area).0 } else { Rgb::ZERO };
                IrradianceEstimate { position: at.position, normal: at.normal, irradiance, area: 1.0 }
            })
            .collect();
        let mut layer = Self::new(radius, &estimates);
        if let Estimates::Corrected(areas) = how {
            let shares: Vec<f32> = layer.estimates.par_iter().map(|e| layer.share(e, areas)).collect();
            layer.estimates.iter_mut().zip(shares).for_each(|(e, share)| e.area = share);
        }
        layer
    }

    /// A layer of larger `radius` from a finer one, at places that are no nearer to another of a related surface than
    /// `spacing`.
    ///
    /// As published each estimate is the mean of those of `finer` whose discs lie wholly in its own. Where the light changes
    /// towards an edge that moves it inwards, and from layer to layer light is lost or won. Corrected it is the mean of
    /// those that lie nearest to it: all layers have the same flux over the same area.
    pub fn of_layer(finer: &Self, radius: f32, spacing: f32, as_published: bool) -> Self {
        let all = &finer.estimates;
        let kept = apart(&finer.tree, all.len(), spacing, |i| (all[i].position, all[i].normal));
        let estimates: Vec<IrradianceEstimate> = if as_published {
            kept.par_iter().map(|&i| finer.mean_inside(&all[i as usize], radius)).collect()
        } else {
            finer.cell_means(&kept)
        };
        Self::new(radius, &estimates)
    }

    /// The estimate of that radius at the place of one of these, of those of which the whole disc lies inside.
    fn mean_inside(&self, at: &IrradianceEstimate, radius: f32) -> IrradianceEstimate {
        let mut mean = WeightedMean::default();
        let reach = radius - self.radius;
        self.tree.within(at.position, reach, |j, offset| {
            let other = &self.estimates[j as usize];
            if offset.length() < reach && agree(other.normal, at.normal) {
                mean.add(other);
            }
        });
        IrradianceEstimate { irradiance: mean.value().unwrap_or(at.irradiance), area: 1.0, ..*at }
    }

    /// For each of the `kept` estimates the mean and area of all that lie nearest to it on a related surface.
    fn cell_means(&self, kept: &[u32]) -> Vec<IrradianceEstimate> {
        let all = &self.estimates;
        let of_kept = |i: u32| &all[kept[i as usize] as usize];
        let tree = KdTree::with_small_leaves((0..kept.len() as u32).map(|i| of_kept(i).position));
        let nearest = |e: &IrradianceEstimate| {
            tree.nearest_one(e.position, f32::INFINITY, |i| agree(of_kept(i).normal, e.normal)).map(|(i, _)| i)
        };
        let cells: Vec<Option<u32>> = all.par_iter().map(nearest).collect();
        let mut means = vec![WeightedMean::default(); kept.len()];
        for (e, cell) in all.iter().zip(cells) {
            // One that was not kept was marked by one on a related surface.
            if let Some(cell) = cell {
                means[cell as usize].add(e);
            }
        }
        let cell = |(i, mean): (u32, &WeightedMean)| {
            let at = of_kept(i);
            let irradiance = mean.value().unwrap_or(at.irradiance);
            IrradianceEstimate { irradiance, area: (mean.weight as f32).max(f32::MIN_POSITIVE), ..*at }
        };
        (0..).zip(&means).map(cell).collect()
    }

    fn new(radius: f32, estimates: &[IrradianceEstimate]) -> Self {
        let tree = KdTree::with_small_leaves(estimates.iter().map(|e| e.position));
        let estimates = tree.order().iter().map(|&i| estimates[i as usize]).collect();
        Self { radius, estimates, tree: tree.renumbered() }
    }

    /// The surface that an estimate stands for, m²: what a ball holds of it, over the number of estimates there.
    fn share(&self, e: &IrradianceEstimate, areas: &SurfaceAreas) -> f32 {
        let (mut radius, mut count) = (self.radius, 0u32);
        for _ in 0..6 {
            count = 0;
            self.tree.within(e.position, radius, |i, _| {
                count += u32::from(agree(self.estimates[i as usize].normal, e.normal));
            });
            if count >= ENOUGH {
                break;
            }
            radius *= 2.0;
        }
        // It finds itself at least. One whose surface f32 cannot tell from none still has a weight.
        let area = areas.within(e.position, e.normal, radius) / f64::from(count.max(1));
        (area as f32).max(f32::MIN_POSITIVE)
    }

    /// Radius of the discs, metres.
    pub fn radius(&self) -> f32 {
        self.radius
    }

    /// The estimates.
    pub fn estimates(&self) -> &[IrradianceEstimate] {
        &self.estimates
    }

    /// Memory that it takes, bytes.
    pub fn bytes(&self) -> usize {
        self.estimates.len() * BYTES_PER_ESTIMATE
    }

    /// The estimate nearest to a place that `accept` takes, by its index.
    pub fn nearest(&self, position: Vec3, accept: impl Fn(&IrradianceEstimate) -> bool) -> Option<u32> {
        self.tree.nearest_one(position, f32::INFINITY, |i| accept(&self.estimates[i as usize])).map(|(i, _)| i)
    }

    /// Calls `visit` with the index of each estimate whose centre, projected along the normal of the ellipse, lies inside
    /// it, and which is no farther from its centre than the longest semi-axis.
    #[inline]
    pub fn in_ellipse(&self, ellipse: &Ellipse, mut visit: impl FnMut(u32, &IrradianceEstimate)) {
        self.tree.within(ellipse.center, ellipse.transform.reach, |i, offset| {
            if ellipse.holds(offset) {
                visit(i, &self.estimates[i as usize]);
            }
        });
    }
}

/// Estimates that a ball has to hold for their number to tell how densely they lie.
const ENOUGH: u32 = 8;

/// Memory of an estimate in a layer, bytes.
pub const BYTES_PER_ESTIMATE: usize = size_of::<IrradianceEstimate>() + BYTES_PER_ENTRY_OF_SMALL_LEAVES;

/// An ellipse on a surface: the footprint of a ray.
#[derive(Clone, Copy, Debug)]
pub struct Ellipse {
    /// Centre, metres.
    pub center: Vec3,
    /// From world to its principal axes.
    pub transform: FilterTransform,
}

impl Ellipse {
    /// That of the half-axes `(dα, dβ)` (metres) on a surface of unit `normal`. Axes below `floor` (metres, positive) are
    /// raised to it.
    pub fn new(center: Vec3, axes: [Vec3; 2], normal: Vec3, floor: f32) -> Self {
        Self { center, transform: FilterTransform::new(axes, normal, 1.0, floor, f32::MAX) }
    }

    /// Longest semi-axis, metres.
    pub fn longest(&self) -> f32 {
        self.transform.reach
    }

    /// Whether a place at that offset from the centre lies inside when it is projected along the normal.
    #[inline]
    pub fn holds(&self, offset: Vec3) -> bool {
        let (x, y) = (self.transform.rows[0].dot(offset), self.transform.rows[1].dot(offset));
        x * x + y * y <= 1.0
    }
}

/// A mean of irradiance over estimates, weighted by the area that each stands for.
#[derive(Clone, Copy, Debug, Default)]
pub struct WeightedMean {
    sum: DVec3,
    weight: f64,
}

impl WeightedMean {
    /// Adds an estimate.
    #[inline]
    pub fn add(&mut self, e: &IrradianceEstimate) {
        self.sum += e.irradiance.as_dvec3() * f64::from(e.area);
        self.weight += f64::from(e.area);
    }

    /// The mean, W/m²; None without estimates.
    pub fn value(&self) -> Option<Rgb> {
        (self.weight > 0.0).then(|| in_f32(self.sum / self.weight).0)
    }
}

/// Indices of `count` places, in order, none of which lies within `spacing` of one before it on a related surface.
fn apart(tree: &KdTree, count: usize, spacing: f32, place: impl Fn(usize) -> (Vec3, Vec3)) -> Vec<u32> {
    let mut marked = vec![false; count];
    let mut kept = Vec::new();
    for i in 0..count {
        if marked[i] {
            continue;
        }
        kept.push(i as u32);
        let (position, normal) = place(i);
        tree.within(position, spacing, |j, _| {
            if agree(place(j as usize).1, normal) {
                marked[j as usize] = true;
            }
        });
    }
    kept
}
