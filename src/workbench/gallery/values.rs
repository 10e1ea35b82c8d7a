//! One number for each pixel: heatmaps and differences, shown in false colour.

use crate::export::false_color::{ColorMap, FalseColor, ValueRange};
use crate::measure::difference::{Difference, difference, quantile_range};
use crate::render::Pass;
use crate::render::film::{Image, Rect};
use crate::render::heatmap::{Heatmap, HeatmapPass};
use std::sync::Arc;

/// What a panel's numbers were made from: if it is another, they are made again.
#[derive(Clone, Debug, PartialEq)]
pub enum Origin {
    /// A heatmap of an estimator in a pass, which is named by its address.
    Heatmap(Heatmap, String, usize),
    /// A difference: its kind, the versions of both images, and the stops of FLIP.
    Difference(Difference, u64, u64, u32),
}

/// Numbers of an image.
#[derive(Clone)]
pub struct Values {
    /// What they were made from.
    pub origin: Origin,
    /// Pixels across and down.
    pub size: [u32; 2],
    /// Row by row.
    pub values: Arc<Vec<f32>>,
    /// Range that suits them.
    pub range: ValueRange,
    /// Their unit, empty without.
    pub unit: &'static str,
    /// What they are, for people.
    pub title: &'static str,
    signed: bool,
}

impl Values {
    /// A heatmap of a pass.
    ///
    /// # Errors
    /// What the pass lacks, in one line.
    pub fn heatmap(pass: &Pass, estimator: &str, kind: Heatmap, origin: Origin) -> Result<Self, String> {
        let e = crate::estimate::registry::estimator(estimator).map_err(|e| e.to_string())?;
        let made = HeatmapPass::new(pass, e.as_ref(), kind).map_err(|e| e.to_string())?;
        let values = made.run(&|| false).ok_or("the heatmap was cancelled")?;
        Ok(Self::of(origin, pass.settings.size, values, kind.is_signed(), kind.unit(), kind.title()))
    }

    /// A difference of `image` from `reference`, which may be of another size and is then brought to the image's.
    ///
    /// # Errors
    /// If it cannot be taken, in one line.
    pub fn difference(
        image: &Image,
        reference: &Image,
        kind: Difference,
        stops: f32,
        origin: Origin,
    ) -> Result<Self, String> {
        let values = if image.size == reference.size {
            difference(kind, image, reference, stops)?
        } else {
            difference(kind, image, &reference.resampled(image.size), stops)?
        };
        let title = match kind {
            Difference::Signed => "x - r",
            Difference::Absolute => "|x - r|",
            Difference::Relative => "(x - r)/(|r| + ε)",
            Difference::Flip => "FLIP",
        };
        Ok(Self::of(origin, image.size, values, kind.is_signed(), kind.unit(), title))
    }

    fn of(
        origin: Origin,
        size: [u32; 2],
        values: Vec<f32>,
        signed: bool,
        unit: &'static str,
        title: &'static str,
    ) -> Self {
        let high = quantile_range(&values, &vec![true; values.len()]);
        let range = if signed { ValueRange::around_zero(high) } else { ValueRange::up_to(high) };
        Self { origin, size, values: Arc::new(values), range, unit, title, signed }
    }

    /// The scale of colours over a range: `map` for values of one sign, the diverging one for others.
    pub fn scale(&self, map: ColorMap, range: ValueRange) -> FalseColor {
        FalseColor::new(if self.signed { ColorMap::Diverging } else { map }, range)
    }

    /// The rows of `rect`, which lies inside.
    pub fn rows(&self, rect: Rect) -> impl Iterator<Item = &[f32]> {
        let (width, start) = (self.size[0] as usize, rect.x as usize);
        (rect.y as usize..(rect.y + rect.height) as usize)
            .map(move |y| &self.values[y * width + start..y * width + start + rect.width as usize])
    }

    /// The value of a pixel.
    pub fn at(&self, [x, y]: [u32; 2]) -> Option<f32> {
        if x >= self.size[0] || y >= self.size[1] {
            return None;
        }
        self.values.get(y as usize * self.size[0] as usize + x as usize).copied()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;

    const ORIGIN: Origin = Origin::Difference(Difference::Signed, 0, 0, 0);

    #[test]
    fn a_difference_to_a_smaller_reference_takes_its_blocks() {
        let image = Image { size: [4, 2], pixels: (0..8).map(|i| Vec3::splat(i as f32)).collect() };
        let reference = Image { size: [2, 1], pixels: vec![Vec3::splat(1.0), Vec3::splat(3.0)] };
        let v = Values::difference(&image, &reference, Difference::Signed, 0.0, ORIGIN).expect("sizes fit");
        assert_eq!(*v.values, [-1.0, 0.0, -1.0, 0.0, 3.0, 4.0, 3.0, 4.0]);
        assert_eq!((v.at([2, 1]), v.at([4, 0])), (Some(3.0), None));
        assert_eq!((v.range.low, v.range.high), (-v.range.high, v.range.high));
    }
}
