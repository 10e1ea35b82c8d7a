//! Cells of a pixel from which the view rays of a pass are drawn.

/// Cells along a pixel's side from which the view ray of a pass (from 0) is drawn: 1, then 2 up to pass 15, 4 up to
/// pass 255, and so on. Powers of two, because so many Sobol points in a row visit each cell once.
pub(super) fn cells_of_pass(pass: u32) -> u32 {
    let mut cells = 1;
    let mut next = 1;
    while u64::from(pass) >= next {
        cells *= 2;
        next *= 16;
    }
    cells
}

/// Parts along a flat pixel's side of which a pass takes one: the whole pixel up to pass 255, 2 up to pass 4095, and so
/// on, so that in the end the curvature of its outline does not count.
pub(super) fn parts_of_pass(pass: u32) -> u32 {
    cells_of_pass(pass / 256)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::sequence::{Sampling, Sequence};

    #[test]
    fn cells_grow_as_the_fourth_root() {
        let cells: Vec<u32> = [0, 1, 15, 16, 255, 256, u32::MAX].map(cells_of_pass).into();
        assert_eq!(cells, [1, 2, 2, 4, 4, 8, 256]);
    }

    /// Sixteen passes from a multiple of sixteen on see each of the 4×4 cells once.
    #[test]
    fn passes_visit_all_cells() {
        let sequence = Sequence::new(Sampling::Sobol, 99);
        let mut seen = [0; 16];
        for pass in 32..48 {
            let x = sequence.four(pass, 0);
            seen[(x[0] * 4.0) as usize * 4 + (x[1] * 4.0) as usize] += 1;
        }
        assert_eq!(seen, [1; 16]);
    }
}
