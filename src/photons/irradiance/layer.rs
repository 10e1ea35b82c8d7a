//! One layer of the irradiance pyramid: estimates over discs of one radius, spread evenly over the surfaces.

use crate::math::rgb::{Rgb, in_f32};
use crate::photons::footprint::FilterTransform;
use crate::photons::irradiance::surface_area::SurfaceAreas;
use crate::photons::irradiance::{GlobalPhotons, agree};
use crate::photons::kd_tree::{BYTES_PER_ENTRY, KdTree};
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
    /// Over the surface that the disc holds, without the photon at its own centre, weighted by area.
    ///
    /// An estimate lies where a photon is. That photon is there for certain, and would count as one more than arrive on
    /// average; and where light is rare so are the places, so that their plain mean is that of the bright ones.
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
        let estimates = kept
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
        Self::new(radius, estimates, how)
    }

    /// A layer of larger `radius` from a finer one: the means of those estimates of `finer` whose discs lie wholly in the
    /// new ones, at places that are no nearer to another of a related surface than `spacing`.
    pub fn of_layer(finer: &Self, radius: f32, spacing: f32, how: Estimates) -> Self {
        let all = &finer.estimates;
        let kept = apart(&finer.tree, all.len(), spacing, |i| (all[i].position, all[i].normal));
        let estimates = kept
            .par_iter()
            .map(|&i| {
                let at = all[i as usize];
                let mut mean = WeightedMean::default();
                finer.tree.within(at.position, radius - finer.radius, |j, squared| {
                    let other = &all[j as usize];
                    let inside = squared.sqrt() < radius - finer.radius;
                    if inside && agree(other.normal, at.normal) {
                        mean.add(other);
                    }
                });
                IrradianceEstimate { irradiance: mean.value().unwrap_or(at.irradiance), area: 1.0, ..at }
            })
            .collect();
        Self::new(radius, estimates, how)
    }

    fn new(radius: f32, estimates: Vec<IrradianceEstimate>, how: Estimates) -> Self {
        let tree = KdTree::new(estimates.iter().map(|e| e.position));
        let estimates = tree.order().iter().map(|&i| estimates[i as usize]).collect();
        let mut layer = Self { radius, estimates, tree: tree.renumbered() };
        if let Estimates::Corrected(areas) = how {
            let shares: Vec<f32> = layer.estimates.par_iter().map(|e| layer.share(e, areas)).collect();
            layer.estimates.iter_mut().zip(shares).for_each(|(e, share)| e.area = share);
        }
        layer
    }

    /// The surface that an estimate stands for, m²: that within the radius over the number of estimates there.
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
        self.tree.within(ellipse.center, ellipse.transform.reach, |i, _| {
            let e = &self.estimates[i as usize];
            if ellipse.holds(e.position) {
                visit(i, e);
            }
        });
    }
}

const ENOUGH: u32 = 8;

/// Memory of an estimate in a layer, bytes.
pub const BYTES_PER_ESTIMATE: usize = size_of::<IrradianceEstimate>() + BYTES_PER_ENTRY;

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

    /// Whether a place projected along the normal lies inside.
    #[inline]
    pub fn holds(&self, position: Vec3) -> bool {
        let to = position - self.center;
        let (x, y) = (self.transform.rows[0].dot(to), self.transform.rows[1].dot(to));
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
