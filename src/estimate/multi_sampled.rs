//! `multi_sampled`: the kernel averaged over points of the view footprint (Pedersen 2011, eq. 68 to 71).

use super::{Construction, Estimator, Gathered, Lookup, SamplingPoint, View, weighted_sum};
use crate::estimate::settings::{Spec, SpecError};
use crate::photons::MapPhoton;
use glam::{DVec3, Vec3};
use pulp::{Arch, Simd, WithSimd};

/// Where the sampling points lie in `[-1, 1]`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Grid {
    /// `-1 + (i - 1) 2/(N - 1)`, ends included, as published (eq. 69, 70).
    Closed,
    /// `-1 + (2i - 1)/N`: centres of N cells, a quadrature of the footprint.
    Cells,
}

/// Points handled together.
const LANES: usize = 8;
/// Rows of points that are added up in f32.
const ROWS: usize = 8;

/// N×N sampling points, evaluated in filter space.
pub struct MultiSampled {
    n: u32,
    grid: Grid,
    offsets: Vec<f32>,
    /// The same in groups of [`LANES`], the last one filled up with points of no weight.
    lanes: Vec<([f32; LANES], [f32; LANES])>,
}

impl MultiSampled {
    /// `n` points along each axis; the closed grid needs two.
    pub fn new(n: u32, grid: Grid) -> Self {
        let n = n.max(if grid == Grid::Closed { 2 } else { 1 });
        let offsets: Vec<f32> = (0..n)
            .map(|i| match grid {
                Grid::Closed => -1.0 + i as f32 * (2.0 / (n - 1) as f32),
                Grid::Cells => -1.0 + (2 * i + 1) as f32 / n as f32,
            })
            .collect();
        let lanes = offsets
            .chunks(LANES)
            .map(|chunk| {
                let (mut offset, mut weight) = ([0.0; LANES], [0.0; LANES]);
                offset[..chunk.len()].copy_from_slice(chunk);
                weight[..chunk.len()].fill(1.0);
                (offset, weight)
            })
            .collect();
        Self { n, grid, offsets, lanes }
    }

    /// `multi_sampled`, with `n` and `grid`.
    ///
    /// # Errors
    /// An unknown setting or one out of range.
    pub fn parse(spec: &Spec) -> Result<Box<dyn Estimator>, SpecError> {
        spec.only(&["n", "grid"])?;
        let grid = spec.choice("grid", Grid::Closed, &[("closed", Grid::Closed), ("cells", Grid::Cells)])?;
        let least = if grid == Grid::Closed { 2 } else { 1 };
        Ok(Box::new(Self::new(spec.integer("n", 8, least..=256)?, grid)))
    }

    /// Mean of `(1 - u)²` over the points `c + s a + t b` of filter space.
    #[inline(always)]
    pub fn mean(&self, c: Vec3, a: Vec3, b: Vec3) -> f64 {
        let (aa, bb, cc) = (a.length_squared(), b.length_squared(), c.length_squared());
        let reach = 1.0 + aa.sqrt() + bb.sqrt();
        if cc >= reach * reach {
            return 0.0;
        }
        // On flat ground nothing lies off the photon's plane, and a third of the work is for nothing.
        let flat = c.z == 0.0 && a.z == 0.0 && b.z == 0.0;
        let sum = match (self.lanes.as_slice(), flat) {
            ([one], true) => self.sum::<true>(std::slice::from_ref(one), c, a, b),
            ([one], false) => self.sum::<false>(std::slice::from_ref(one), c, a, b),
            (all, _) => self.sum::<false>(all, c, a, b),
        };
        sum / f64::from(self.n * self.n)
    }

    /// Sum of `(1 - u)²` over the points; `FLAT` if they lie in the photon's plane.
    #[inline(always)]
    fn sum<const FLAT: bool>(&self, lanes: &[([f32; LANES], [f32; LANES])], c: Vec3, a: Vec3, b: Vec3) -> f64 {
        // Sums in f32 are kept short: what thousands of terms lose to rounding is as much as they differ by.
        let mut sum = 0.0f64;
        for rows in self.offsets.chunks(ROWS) {
            let mut sums = [0.0f32; LANES];
            for &t in rows {
                let row = c + b * t;
                for (offset, weight) in lanes {
                    for l in 0..LANES {
                        let (x, y) = (row.x + a.x * offset[l], row.y + a.y * offset[l]);
                        let mut u = x * x + y * y;
                        if !FLAT {
                            let z = row.z + a.z * offset[l];
                            u += z * z;
                        }
                        let k = 1.0 - u;
                        let k = if k > 0.0 { k } else { 0.0 };
                        sums[l] += weight[l] * (k * k);
                    }
                }
            }
            let pairs = [sums[0] + sums[4], sums[1] + sums[5], sums[2] + sums[6], sums[3] + sums[7]];
            sum += f64::from((pairs[0] + pairs[2]) + (pairs[1] + pairs[3]));
        }
        sum
    }

    #[inline(always)]
    fn over_area(&self, photon: &MapPhoton, view: &View) -> f64 {
        // The two footprint vectors enter filter space once for each photon, not once for each point.
        let c = photon.to_filter(view.query.center - photon.position);
        let [a, b] = view.query.axes.map(|v| photon.to_filter(v));
        3.0 * self.mean(c, a, b) * f64::from(photon.inverse_area)
    }
}

/// The estimate as one function, compiled for each set of instructions; all round alike.
struct Sum<'a> {
    of: &'a MultiSampled,
    gathered: &'a Gathered<'a>,
    view: &'a View,
}

impl WithSimd for Sum<'_> {
    type Output = DVec3;

    #[inline(always)]
    fn with_simd<I: Simd>(self, _: I) -> DVec3 {
        weighted_sum(self.gathered, |p| self.of.over_area(p, self.view))
    }
}

impl Estimator for MultiSampled {
    fn id(&self) -> &'static str {
        "multi_sampled"
    }

    fn settings(&self) -> String {
        let grid = match self.grid {
            Grid::Closed => "closed",
            Grid::Cells => "cells",
        };
        format!("n={},grid={grid}", self.n)
    }

    fn lookup(&self) -> Lookup {
        Lookup::Parallelogram
    }

    fn is_consistent(&self) -> bool {
        self.grid == Grid::Cells
    }

    fn weight(&self, photon: &MapPhoton, view: &View, _radius: f32) -> f64 {
        self.over_area(photon, view)
    }

    fn irradiance(&self, gathered: &Gathered, view: &View) -> DVec3 {
        Arch::new().dispatch(Sum { of: self, gathered, view })
    }

    fn construction(&self, photon: &MapPhoton, view: &View) -> Construction {
        let [a, b] = view.query.axes;
        let c = photon.to_filter(view.query.center - photon.position);
        let (fa, fb) = (photon.to_filter(a), photon.to_filter(b));
        let point = |s: f32, t: f32| SamplingPoint {
            position: view.query.center + a * s + b * t,
            inside: (c + fb * t + fa * s).length_squared() < 1.0,
        };
        let points = self.offsets.iter().flat_map(|&t| self.offsets.iter().map(move |&s| point(s, t))).collect();
        Construction { points, ..Default::default() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::estimate::parallelogram::mean_over_parallelogram;
    use proptest::prelude::*;

    fn plain(n: u32, grid: Grid, c: Vec3, a: Vec3, b: Vec3) -> f64 {
        let at = |i: u32| match grid {
            Grid::Closed => -1.0 + f64::from(i) * 2.0 / f64::from(n - 1),
            Grid::Cells => -1.0 + f64::from(2 * i + 1) / f64::from(n),
        };
        let mut sum = 0.0;
        for i in 0..n {
            for j in 0..n {
                let x = c.as_dvec3() + a.as_dvec3() * at(i) + b.as_dvec3() * at(j);
                sum += (1.0 - x.length_squared()).max(0.0).powi(2);
            }
        }
        sum / f64::from(n * n)
    }

    proptest! {
        #[test]
        fn lanes_equal_the_plain_sum(
            c in prop::array::uniform3(-1.0f32..1.0), a in prop::array::uniform3(-1.0f32..1.0),
            b in prop::array::uniform3(-1.0f32..1.0), n in 2u32..20,
        ) {
            let (c, a, b) = (Vec3::from(c), Vec3::from(a), Vec3::from(b));
            for grid in [Grid::Closed, Grid::Cells] {
                let mean = MultiSampled::new(n, grid).mean(c, a, b);
                prop_assert!((mean - plain(n, grid, c, a, b)).abs() < 1e-5);
            }
        }
    }

    /// The cell-centred grid tends to the integral as N⁻²; the closed grid, whose ends weigh too much, as N⁻¹.
    #[test]
    fn grids_tend_to_the_integral_at_their_rates() {
        let (c, a, b) = (Vec3::new(0.35, -0.2, 0.0), Vec3::new(0.8, 0.3, 0.0), Vec3::new(-0.2, 0.7, 0.0));
        let exact = mean_over_parallelogram(c, a, b);
        let error = |n, grid| (plain(n, grid, c, a, b) - exact).abs();
        for (grid, order) in [(Grid::Cells, 2.0), (Grid::Closed, 1.0)] {
            let rate = (error(16, grid) / error(128, grid)).log2() / 3.0;
            assert!((rate - order).abs() < 0.35, "{grid:?} {rate}");
        }
    }
}
