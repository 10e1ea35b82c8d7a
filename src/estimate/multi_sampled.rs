//! `multi_sampled`: the kernel averaged over points of the view footprint (Pedersen 2011, eq. 68 to 71).

use super::{Construction, Estimator, Gathered, Lookup, SamplingPoint, View};
use crate::estimate::batch::{self, BATCH, Parallelograms, in_filter_space, weight_by_mean};
use crate::estimate::settings::{Spec, SpecError};
use crate::math::eights::{Group, LANES, vector};
use crate::math::lanes::dispatch_in_eights;
use crate::photons::MapPhoton;
use glam::{DVec3, Vec3};
use pulp::{Simd, WithSimd};

/// Where the sampling points lie in `[-1, 1]`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Grid {
    /// `-1 + (i - 1) 2/(N - 1)`, ends included, as published (eq. 69, 70).
    Closed,
    /// `-1 + (2i - 1)/N`: centres of N cells, a quadrature of the footprint.
    Cells,
}

/// Columns of points, each with a sum of its own.
const COLUMNS: usize = 8;
/// Rows of points that are added up in f32.
const ROWS: usize = 8;

/// N×N sampling points, evaluated in filter space.
pub struct MultiSampled {
    n: u32,
    grid: Grid,
    offsets: Vec<f32>,
    /// The same in groups of [`COLUMNS`], the last one filled up with points of no weight.
    columns: Vec<([f32; COLUMNS], [f32; COLUMNS])>,
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
        let columns = offsets
            .chunks(COLUMNS)
            .map(|chunk| {
                let (mut offset, mut weight) = ([0.0; COLUMNS], [0.0; COLUMNS]);
                offset[..chunk.len()].copy_from_slice(chunk);
                weight[..chunk.len()].fill(1.0);
                (offset, weight)
            })
            .collect();
        Self { n, grid, offsets, columns }
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
    pub fn mean(&self, c: Vec3, a: Vec3, b: Vec3) -> f64 {
        let (mut one, mut means) = (Parallelograms::default(), [0.0; BATCH]);
        one.push([c, a, b]);
        self.means(&one, &mut means);
        means[0]
    }

    fn means(&self, parallelograms: &Parallelograms, means: &mut [f64; BATCH]) {
        dispatch_in_eights(Means { of: self, parallelograms, means });
    }

    /// Sums of `(1 - u)²` over the points of eight parallelograms; `FLAT` if they lie in the planes of their photons.
    #[inline(always)]
    fn sums<const FLAT: bool>(&self, [c, a, b]: &Group<3>) -> [f64; LANES] {
        // Sums in f32 are kept short: what thousands of terms lose to rounding is as much as they differ by.
        let mut all = [0.0f64; LANES];
        // `s a` of one group of columns: up to eight points a side are one, and these are the same in all rows.
        let (mut along, mut held) = ([[[0.0f32; LANES]; 3]; COLUMNS], usize::MAX);
        for rows in self.offsets.chunks(ROWS) {
            let mut sums = [[0.0f32; LANES]; COLUMNS];
            for &t in rows {
                let mut row = *c;
                for axis in 0..3 {
                    for l in 0..LANES {
                        row[axis][l] = c[axis][l] + b[axis][l] * t;
                    }
                }
                for (group, (offsets, weights)) in self.columns.iter().enumerate() {
                    if held != group {
                        for (along, &s) in along.iter_mut().zip(offsets) {
                            for axis in 0..3 {
                                for l in 0..LANES {
                                    along[axis][l] = a[axis][l] * s;
                                }
                            }
                        }
                        held = group;
                    }
                    for ((sum, along), &weight) in sums.iter_mut().zip(&along).zip(weights) {
                        for l in 0..LANES {
                            let (x, y) = (row[0][l] + along[0][l], row[1][l] + along[1][l]);
                            let mut u = x * x + y * y;
                            if !FLAT {
                                let z = row[2][l] + along[2][l];
                                u += z * z;
                            }
                            let k = 1.0 - u;
                            let k = if k > 0.0 { k } else { 0.0 };
                            sum[l] += weight * (k * k);
                        }
                    }
                }
            }
            for (l, all) in all.iter_mut().enumerate() {
                let even = (sums[0][l] + sums[4][l]) + (sums[2][l] + sums[6][l]);
                let odd = (sums[1][l] + sums[5][l]) + (sums[3][l] + sums[7][l]);
                *all += f64::from(even + odd);
            }
        }
        all
    }
}

/// The means of a batch as one function, compiled for each set of instructions; all round alike.
struct Means<'a> {
    of: &'a MultiSampled,
    parallelograms: &'a Parallelograms,
    means: &'a mut [f64; BATCH],
}

impl WithSimd for Means<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<I: Simd>(self, _: I) {
        let points = f64::from(self.of.n * self.of.n);
        for (means, group) in self.means.as_chunks_mut::<LANES>().0.iter_mut().zip(self.parallelograms.groups()) {
            let [c, a, b] = group;
            // On flat ground nothing lies off the photons' planes, and a third of the work is for nothing.
            let flat = c[2] == [0.0; LANES] && a[2] == [0.0; LANES] && b[2] == [0.0; LANES];
            let sums = if flat { self.of.sums::<true>(group) } else { self.of.sums::<false>(group) };
            for (lane, mean) in means.iter_mut().enumerate() {
                let [c, a, b] = [vector(c, lane), vector(a, lane), vector(b, lane)];
                let (cc, aa, bb) = (c.length_squared(), a.length_squared(), b.length_squared());
                let reach = 1.0 + aa.sqrt() + bb.sqrt();
                *mean = if cc >= reach * reach { 0.0 } else { sums[lane] / points };
            }
        }
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
        let [c, a, b] = in_filter_space(photon, view);
        weight_by_mean(self.mean(c, a, b), photon)
    }

    fn irradiance(&self, gathered: &Gathered, view: &View) -> DVec3 {
        batch::irradiance(gathered, view, |of, means| self.means(of, means))
    }

    fn irradiances<'a>(&self, hits: &mut dyn Iterator<Item = (Gathered<'a>, View)>, put: &mut dyn FnMut(DVec3)) {
        batch::irradiances(hits, put, |of, means| self.means(of, means));
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
