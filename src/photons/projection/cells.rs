//! Marked cells of the numbers that a light's photons are made of.

use crate::math::eights::{LANES, Row};
use pulp::{Arch, Simd, WithSimd};

/// The marked cell that a number chooses, and what is left of the number.
#[inline(always)]
fn chosen(marked: &[u32], x: f32) -> (u32, f64) {
    let at = f64::from(x) * marked.len() as f64;
    let chosen = (at as usize).min(marked.len() - 1);
    (marked[chosen], at - chosen as f64)
}

struct Within<'a> {
    of: &'a Cells,
    cells: &'a [u32; LANES],
    rests: &'a [f64; LANES],
    x: &'a [Row; 4],
}

impl WithSimd for Within<'_> {
    type Output = [Row; 4];

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> [Row; 4] {
        let Self { of, cells, rests, x } = self;
        let mut numbers = [[0.0; LANES]; 4];
        for lane in 0..LANES {
            let within = [rests[lane], f64::from(x[1][lane]), f64::from(x[2][lane]), f64::from(x[3][lane])];
            let own = of.within(cells[lane], within);
            for i in 0..4 {
                numbers[i][lane] = own[i];
            }
        }
        numbers
    }
}

/// The cells of one light from which photons may meet a specular surface.
#[derive(Clone, Debug)]
pub struct Cells {
    /// Cells along each of the four numbers, powers of two.
    counts: [u32; 4],
    /// The marked ones, the last number fastest; None if all are.
    marked: Option<Vec<u32>>,
}

impl Cells {
    /// One cell, marked.
    pub(super) fn whole() -> Self {
        Self { counts: [1; 4], marked: None }
    }

    /// Those whose bit is set.
    pub(super) fn marked(counts: [u32; 4], bits: &[u64]) -> Self {
        let all: u32 = counts.iter().product();
        let is_set = |cell: &u32| bits[(cell >> 6) as usize] >> (cell & 63) & 1 == 1;
        let marked: Vec<u32> = (0..all).filter(is_set).collect();
        Self { counts, marked: (marked.len() < all as usize).then_some(marked) }
    }

    /// Share of the light's photons that the marked cells stand for, in `[0, 1]`.
    pub fn share(&self) -> f64 {
        let all: u32 = self.counts.iter().product();
        self.marked.as_ref().map_or(1.0, |m| m.len() as f64 / f64::from(all))
    }

    /// Takes four numbers in `[0, 1)` to the marked cells: evenly spread numbers stay so within them.
    ///
    /// The first number chooses the cell and, by what is left of it, the place along that side. Numbers stay where they
    /// are if no cell is marked.
    #[inline]
    pub fn numbers(&self, x: [f32; 4]) -> [f32; 4] {
        let Some(marked) = self.marked.as_ref().filter(|m| !m.is_empty()) else { return x };
        let (cell, rest) = chosen(marked, x[0]);
        self.within(cell, [rest, f64::from(x[1]), f64::from(x[2]), f64::from(x[3])])
    }

    /// The same of a group of photons, in lanes: the number of lane `i` in dimension `d` is `x[d][i]`.
    pub fn numbers_of_group(&self, x: &[Row; 4]) -> [Row; 4] {
        let Some(marked) = self.marked.as_ref().filter(|m| !m.is_empty()) else { return *x };
        let (mut cells, mut rests) = ([0; LANES], [0.0; LANES]);
        for lane in 0..LANES {
            (cells[lane], rests[lane]) = chosen(marked, x[0][lane]);
        }
        Arch::new().dispatch(Within { of: self, cells: &cells, rests: &rests, x })
    }

    /// The numbers of a place in a cell.
    #[inline(always)]
    fn within(&self, cell: u32, within: [f64; 4]) -> [f32; 4] {
        let bits = [
            self.counts[0].trailing_zeros(),
            self.counts[1].trailing_zeros(),
            self.counts[2].trailing_zeros(),
            self.counts[3].trailing_zeros(),
        ];
        let (mut rest, mut numbers) = (cell, [0.0; 4]);
        for i in [3, 2, 1, 0] {
            let place = rest & (self.counts[i] - 1);
            rest >>= bits[i];
            // Over a power of two: exact, and a multiplication.
            let y = ((f64::from(place) + within[i]) * (1.0 / f64::from(self.counts[i]))) as f32;
            // Rounding may reach 1, which no number in [0, 1) does.
            numbers[i] = y.min(1.0 - f32::EPSILON / 2.0);
        }
        numbers
    }

    /// Whether the cell of these numbers is marked.
    #[cfg(test)]
    pub(super) fn holds(&self, x: [f32; 4]) -> bool {
        let cell = x.iter().zip(self.counts).fold(0, |cell, (x, n)| cell * n + ((x * n as f32) as u32).min(n - 1));
        self.marked.as_ref().is_none_or(|m| m.binary_search(&cell).is_ok())
    }
}
