//! The colour of a texture at a place.

use super::textures::Texture;
use egui::{TextureFilter, TextureWrapMode};

/// Bits after the point of a texel coordinate.
const FRACTION_BITS: u32 = 32;

/// Moves ties between two texels to the later one, whatever way the last bits of a coordinate were rounded: a pixel
/// centre on the border of two texels gets the same one in both triangles of a rectangle. In texels.
const TIE: i64 = 1 << (FRACTION_BITS - 12);

/// Half a step of the weights of linear filtering, which have eight bits as on a GPU. In texels.
const HALF_WEIGHT: i64 = 1 << (FRACTION_BITS - 9);

/// Texels per pixel above which the minification filter applies. The margin keeps 1 to 1 on one side.
const MINIFIED: f64 = 1.0 + 1e-5;

/// A texel coordinate: texel `n` covers `n` to `n + 1`; 32 bits before the point, 32 after it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Coordinate(i64);

impl Coordinate {
    /// A number of texels, cut after 2⁻³² and at the ends of the range; 0 for NaN.
    pub fn new(texels: f64) -> Self {
        Self((texels * (1_i64 << FRACTION_BITS) as f64) as i64)
    }

    /// This plus `step`. Wraps around far outside of any texture.
    #[inline]
    pub fn plus(self, step: Self) -> Self {
        Self(self.0.wrapping_add(step.0))
    }

    /// Column or row.
    #[inline]
    fn whole(self) -> i64 {
        self.0 >> FRACTION_BITS
    }

    /// How far into the texel, in `[0, 1)`, a multiple of 1/256.
    #[inline]
    fn weight(self) -> f32 {
        f32::from((self.0 >> (FRACTION_BITS - 8)) as u8) * (1.0 / 256.0)
    }

    #[inline]
    fn moved(self, by: i64) -> Self {
        Self(self.0.wrapping_add(by))
    }
}

/// A texture with the filter that suits how large it is shown.
#[derive(Clone, Copy, Debug)]
pub struct Sampler<'a> {
    texture: &'a Texture,
    filter: TextureFilter,
}

impl<'a> Sampler<'a> {
    /// * `across`, `down`: how far the place in the texture moves per pixel to the right and downwards, in texels.
    pub fn new(texture: &'a Texture, across: [f64; 2], down: [f64; 2]) -> Self {
        let squared = |[u, v]: [f64; 2]| u * u + v * v;
        let is_minified = squared(across).max(squared(down)) > MINIFIED * MINIFIED;
        let options = &texture.options;
        Self { texture, filter: if is_minified { options.minification } else { options.magnification } }
    }

    /// The premultiplied colour, channels in `[0, 255]`.
    #[inline]
    pub fn at(&self, [u, v]: [Coordinate; 2]) -> [f32; 4] {
        match self.filter {
            TextureFilter::Nearest => {
                let [column, row] = [self.wrapped(0, u.moved(TIE).whole()), self.wrapped(1, v.moved(TIE).whole())];
                self.texture.texel(column, row).map(f32::from)
            }
            TextureFilter::Linear => self.linear(u, v),
        }
    }

    /// Between the four texels whose centres surround the place.
    #[inline]
    fn linear(&self, u: Coordinate, v: Coordinate) -> [f32; 4] {
        const TO_CENTRE: i64 = HALF_WEIGHT - (1 << (FRACTION_BITS - 1));
        let [u, v] = [u.moved(TO_CENTRE), v.moved(TO_CENTRE)];
        let [column, row] = [self.wrapped(0, u.whole()), self.wrapped(1, v.whole())];
        let [right, below] = [u.weight(), v.weight()];
        if right == 0.0 && below == 0.0 {
            return self.texture.texel(column, row).map(f32::from);
        }
        let [next_column, next_row] = [self.wrapped(0, u.whole() + 1), self.wrapped(1, v.whole() + 1)];
        let [left, above] = [1.0 - right, 1.0 - below];
        let corners = [
            (self.texture.texel(column, row), left * above),
            (self.texture.texel(next_column, row), right * above),
            (self.texture.texel(column, next_row), left * below),
            (self.texture.texel(next_column, next_row), right * below),
        ];
        // Weights are multiples of 2⁻¹⁶ and texels are below 2⁸: f32 holds products and sums exactly.
        corners.iter().fold([0.0; 4], |sum, (texel, weight)| {
            std::array::from_fn(|channel| sum[channel] + f32::from(texel[channel]) * weight)
        })
    }

    /// The column (axis 0) or row (axis 1) that stands for `at`.
    #[inline]
    fn wrapped(&self, axis: usize, at: i64) -> usize {
        wrapped(at, self.texture.size()[axis], self.texture.options.wrap_mode)
    }
}

/// The texel in `[0, count)` that stands for texel `at`.
#[inline]
fn wrapped(at: i64, count: usize, mode: TextureWrapMode) -> usize {
    let count = count as i64;
    let inside = match mode {
        TextureWrapMode::ClampToEdge => at.clamp(0, count - 1),
        TextureWrapMode::Repeat => at.rem_euclid(count),
        TextureWrapMode::MirroredRepeat => {
            let twice = at.rem_euclid(2 * count);
            twice.min(2 * count - 1 - twice)
        }
    };
    inside as usize
}

#[cfg(test)]
mod tests {
    use super::*;
    use egui::{Color32, ColorImage, TextureOptions};

    /// Red 0, 100 over 40, 200.
    fn texture(options: TextureOptions) -> Texture {
        let pixels = [0, 100, 40, 200].map(|r| Color32::from_rgb(r, 0, 0)).to_vec();
        Texture::new(&ColorImage::new([2, 2], pixels), options).expect("four texels")
    }

    fn red(options: TextureOptions, u: f64, v: f64) -> f32 {
        Sampler::new(&texture(options), [0.1, 0.0], [0.0, 0.1]).at([Coordinate::new(u), Coordinate::new(v)])[0]
    }

    #[test]
    fn linear_weighs_the_four_texels_around() {
        let linear = TextureOptions::LINEAR;
        assert_eq!(red(linear, 0.5, 0.5), 0.0);
        assert_eq!(red(linear, 1.5, 1.5), 200.0);
        assert_eq!(red(linear, 1.0, 1.0), (0.0 + 100.0 + 40.0 + 200.0) / 4.0);
        // A quarter to the right: above 25, below 80; three quarters down: 25/4 + 80·3/4.
        assert_eq!(red(linear, 0.75, 1.25), 66.25);
    }

    #[test]
    fn linear_keeps_texel_centres_exact_although_the_coordinate_is_rounded() {
        assert_eq!(red(TextureOptions::LINEAR, 1.5 - 1e-4, 0.5 + 1e-4), 100.0);
    }

    #[test]
    fn nearest_takes_the_later_texel_on_a_border() {
        for u in [1.0, 1.0 - 1e-5, 1.0 + 1e-5] {
            assert_eq!(red(TextureOptions::NEAREST, u, 0.5), 100.0);
        }
        assert_eq!(red(TextureOptions::NEAREST, 0.99, 0.5), 0.0);
    }

    #[test]
    fn edges_are_clamped_repeated_or_mirrored() {
        let reds = |options| [-1.5, -0.5, 0.5, 1.5, 2.5, 3.5].map(|u| red(options, u, 0.5));
        assert_eq!(reds(TextureOptions::NEAREST), [0.0, 0.0, 0.0, 100.0, 100.0, 100.0]);
        assert_eq!(reds(TextureOptions::NEAREST_REPEAT), [0.0, 100.0, 0.0, 100.0, 0.0, 100.0]);
        assert_eq!(reds(TextureOptions::NEAREST_MIRRORED_REPEAT), [100.0, 0.0, 0.0, 100.0, 100.0, 0.0]);
        // On the border, clamping sees one texel twice and repeating sees both.
        assert_eq!(red(TextureOptions::LINEAR, 0.0, 0.5), 0.0);
        assert_eq!(red(TextureOptions::LINEAR_REPEAT, 0.0, 0.5), 50.0);
        assert_eq!(red(TextureOptions::LINEAR_MIRRORED_REPEAT, 0.0, 0.5), 0.0);
    }

    #[test]
    fn the_filter_follows_the_scale() {
        let options = TextureOptions { minification: TextureFilter::Linear, ..TextureOptions::NEAREST };
        let texture = texture(options);
        let filter = |across, down| Sampler::new(&texture, across, down).filter;
        assert_eq!(filter([0.5, 0.0], [0.0, 0.5]), TextureFilter::Nearest);
        assert_eq!(filter([1.0, 0.0], [0.0, 1.0]), TextureFilter::Nearest);
        assert_eq!(filter([0.5, 0.0], [0.0, 1.1]), TextureFilter::Linear);
        assert_eq!(filter([0.8, 0.8], [0.0, 0.0]), TextureFilter::Linear);
    }

    #[test]
    fn coordinates_far_out_or_not_finite_have_a_colour() {
        for options in [TextureOptions::LINEAR, TextureOptions::NEAREST_REPEAT, TextureOptions::LINEAR_MIRRORED_REPEAT]
        {
            for u in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 1e300, -1e300] {
                assert!((0.0..=255.0).contains(&red(options, u, u)), "{options:?} at {u}");
            }
        }
    }
}
