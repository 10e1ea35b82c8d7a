//! Images that grow pass by pass.

use crate::math::rgb::Rgb;
use crate::render::error_estimate::{ErrorEstimate, GroupSums};
use glam::DVec3;

/// Sum of the passes of an image, in f64 so that many passes stay accurate, and what its error is estimated from. Row 0
/// is the top.
#[derive(Clone, Debug)]
pub struct Film {
    size: [u32; 2],
    sum: Vec<DVec3>,
    /// None if the film goes on from another's sums.
    groups: Option<GroupSums>,
    passes: u32,
}

impl Film {
    /// A black film of `size` pixels.
    pub fn new(size: [u32; 2]) -> Self {
        let pixels = size[0] as usize * size[1] as usize;
        Self { size, sum: vec![DVec3::ZERO; pixels], groups: Some(GroupSums::new(size)), passes: 0 }
    }

    /// A film that goes on from the sums of `passes` passes, one for each pixel, row by row; None if their number is
    /// another. It has no error estimate, whose own sums are not among them.
    pub fn going_on(size: [u32; 2], sum: Vec<DVec3>, passes: u32) -> Option<Self> {
        let fits = sum.len() as u64 == u64::from(size[0]) * u64::from(size[1]);
        fits.then_some(Self { size, sum, groups: None, passes })
    }

    /// The sum of the finished passes for each pixel, row by row, W/(m² sr).
    pub fn sums(&self) -> &[DVec3] {
        &self.sum
    }

    /// Pixels across and down.
    pub fn size(&self) -> [u32; 2] {
        self.size
    }

    /// Passes that have been finished.
    pub fn passes(&self) -> u32 {
        self.passes
    }

    /// Adds the pixels of one tile, row by row, whose first pixel is `origin`.
    pub fn add_tile(&mut self, origin: [u32; 2], width: u32, pixels: &[Rgb]) {
        for (row, line) in pixels.chunks(width as usize).enumerate() {
            let start = (origin[1] as usize + row) * self.size[0] as usize + origin[0] as usize;
            for (sum, p) in self.sum[start..start + line.len()].iter_mut().zip(line) {
                *sum += p.as_dvec3();
            }
        }
    }

    /// Counts a pass as finished whose footprints have `area` relative to the first, in `(0, 1]`.
    pub fn finish_pass(&mut self, area: f64) {
        self.passes += 1;
        if let Some(groups) = &mut self.groups {
            groups.finish_pass(area, &self.sum);
        }
    }

    /// The mean of the finished passes and one more, for the pixels of `rect` whose values in that pass are `pixels`.
    ///
    /// The same bits as [`Film::image`] has when that pass has been added.
    pub fn mean_with(&self, rect: Rect, pixels: &[Rgb]) -> Vec<Rgb> {
        let n = f64::from(self.passes + 1);
        let mut means = Vec::with_capacity(pixels.len());
        for (row, line) in pixels.chunks(rect.width as usize).enumerate() {
            let start = (rect.y as usize + row) * self.size[0] as usize + rect.x as usize;
            let sums = &self.sum[start..start + line.len()];
            means.extend(sums.iter().zip(line).map(|(sum, p)| ((*sum + p.as_dvec3()) / n).as_vec3()));
        }
        means
    }

    /// Variance of [`Film::image`] by the noise of its photons and shadow rays, for each channel, (W/(m² sr))². None
    /// below 12 passes.
    ///
    /// It comes from the scatter of groups of passes, so a pixel's own is a rough number below some hundred passes.
    pub fn variance(&self) -> Option<Image> {
        self.groups.as_ref()?.variance()
    }

    /// Estimated error of [`Film::image`] over the pixels of `rect` that count, row by row of the whole image; all
    /// without `counts`. None below 12 passes, and if no pixel counts.
    ///
    /// [`ErrorEstimate`] says what it does not see.
    pub fn error_estimate(&self, rect: Rect, counts: Option<&[bool]>) -> Option<ErrorEstimate> {
        let counted = |i: usize| counts.is_none_or(|c| c.get(i).copied().unwrap_or(false));
        self.groups.as_ref()?.error(&self.sum, rect.within(self.size), counted)
    }

    /// The mean of the finished passes, radiance in W/(m² sr).
    pub fn image(&self) -> Image {
        let n = f64::from(self.passes.max(1));
        Image { size: self.size, pixels: self.sum.iter().map(|s| (*s / n).as_vec3()).collect() }
    }
}

/// An image of linear radiance, row 0 on top.
#[derive(Clone, Debug, PartialEq)]
pub struct Image {
    /// Pixels across and down.
    pub size: [u32; 2],
    /// Pixels, row by row.
    pub pixels: Vec<Rgb>,
}

/// A rectangle of pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
pub struct Rect {
    /// Left edge.
    pub x: u32,
    /// Top edge.
    pub y: u32,
    /// Width.
    pub width: u32,
    /// Height.
    pub height: u32,
}

impl Rect {
    /// All of an image.
    pub fn whole(size: [u32; 2]) -> Self {
        Self { x: 0, y: 0, width: size[0], height: size[1] }
    }

    /// The part of it that lies inside an image of `size` pixels; empty if none does.
    pub fn within(self, size: [u32; 2]) -> Self {
        let (x, y) = (self.x.min(size[0]), self.y.min(size[1]));
        Self { x, y, width: self.width.min(size[0] - x), height: self.height.min(size[1] - y) }
    }
}

impl Image {
    /// A black image.
    pub fn black(size: [u32; 2]) -> Self {
        Self { size, pixels: vec![Rgb::ZERO; size[0] as usize * size[1] as usize] }
    }

    /// The pixel at column `x`, row `y`, which must be inside.
    pub fn at(&self, x: u32, y: u32) -> Rgb {
        self.pixels[y as usize * self.size[0] as usize + x as usize]
    }

    /// Overwrites the pixels of `rect`, which must lie inside, row by row.
    pub fn put(&mut self, rect: Rect, pixels: &[Rgb]) {
        for (row, line) in pixels.chunks(rect.width.max(1) as usize).enumerate() {
            let start = (rect.y as usize + row) * self.size[0] as usize + rect.x as usize;
            self.pixels[start..start + line.len()].copy_from_slice(line);
        }
    }

    /// The part inside `rect`, which must lie inside the image.
    pub fn crop(&self, rect: Rect) -> Self {
        let pixels = (rect.y..rect.y + rect.height)
            .flat_map(|y| {
                let start = y as usize * self.size[0] as usize + rect.x as usize;
                self.pixels[start..start + rect.width as usize].iter().copied()
            })
            .collect();
        Self { size: [rect.width, rect.height], pixels }
    }

    /// Area average on another, smaller grid; each output pixel is the mean over what it covers.
    pub fn resampled(&self, size: [u32; 2]) -> Self {
        let rows = resample(self.size[0], size[0]);
        let columns = resample(self.size[1], size[1]);
        let mut out = Self::black(size);
        for (y, vertical) in columns.iter().enumerate() {
            for (x, horizontal) in rows.iter().enumerate() {
                let mut sum = DVec3::ZERO;
                for &(j, wy) in vertical {
                    for &(i, wx) in horizontal {
                        sum += self.at(i, j).as_dvec3() * (wx * wy);
                    }
                }
                out.pixels[y * size[0] as usize + x] = sum.as_vec3();
            }
        }
        out
    }
}

/// For each output cell the input cells that it covers, with weights that sum to 1.
fn resample(from: u32, to: u32) -> Vec<Vec<(u32, f64)>> {
    let ratio = f64::from(from) / f64::from(to);
    (0..to)
        .map(|o| {
            let (low, high) = (f64::from(o) * ratio, f64::from(o + 1) * ratio);
            (low as u32..from)
                .map(|i| {
                    let covered = high.min(f64::from(i + 1)) - low.max(f64::from(i));
                    (i, covered / ratio)
                })
                .take_while(|(_, w)| *w > 0.0)
                .collect()
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn film_averages_passes() {
        let mut film = Film::new([3, 2]);
        for value in [1.0, 3.0] {
            film.add_tile([1, 0], 2, &[Rgb::splat(value); 4]);
            film.finish_pass(1.0);
        }
        let image = film.image();
        assert_eq!(image.at(0, 0), Rgb::ZERO);
        assert_eq!(image.at(2, 1), Rgb::splat(2.0));
    }

    #[test]
    fn resampling_keeps_the_mean() {
        let image = Image { size: [6, 4], pixels: (0..24).map(|i| Rgb::splat(i as f32)).collect() };
        for size in [[3, 2], [4, 3], [1, 1], [6, 4]] {
            let small = image.resampled(size);
            let mean: f32 = small.pixels.iter().map(|p| p.x).sum::<f32>() / small.pixels.len() as f32;
            assert!((mean - 11.5).abs() < 1e-4, "{size:?}");
        }
        assert_eq!(image.resampled([3, 2]).at(0, 0), Rgb::splat((0.0 + 1.0 + 6.0 + 7.0) / 4.0));
    }
}
