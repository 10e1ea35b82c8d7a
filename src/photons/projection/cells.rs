//! Marked cells of the numbers that a light's photons are made of.

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
        let at = f64::from(x[0]) * marked.len() as f64;
        let chosen = (at as usize).min(marked.len() - 1);
        let mut cell = marked[chosen];
        let mut place = [0; 4];
        for (place, count) in place.iter_mut().zip(self.counts).rev() {
            *place = cell & (count - 1);
            cell >>= count.trailing_zeros();
        }
        let within = [at - chosen as f64, f64::from(x[1]), f64::from(x[2]), f64::from(x[3])];
        std::array::from_fn(|i| {
            // Over a power of two: exact, and a multiplication.
            let y = ((f64::from(place[i]) + within[i]) * (1.0 / f64::from(self.counts[i]))) as f32;
            // Rounding may reach 1, which no number in [0, 1) does.
            y.min(1.0 - f32::EPSILON / 2.0)
        })
    }

    /// Whether the cell of these numbers is marked.
    #[cfg(test)]
    pub(super) fn holds(&self, x: [f32; 4]) -> bool {
        let cell = x.iter().zip(self.counts).fold(0, |cell, (x, n)| cell * n + ((x * n as f32) as u32).min(n - 1));
        self.marked.as_ref().is_none_or(|m| m.binary_search(&cell).is_ok())
    }
}
