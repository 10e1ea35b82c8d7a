//! What the paper on final gathering prints: data to compare with, never a result of this program.

use serde::Serialize;

/// Where the seconds stand.
pub const TABLES: &str = "Gjøl, Larsen and Christensen, section 5";

/// One of the paper's three tables.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct PrintedTable {
    /// Photons emitted.
    pub photons: i64,
    /// Radius of the first search, and of the first layer, metres.
    pub radius: f32,
    /// Seconds to emit the photons.
    pub emission: f64,
    /// Seconds to make the pyramid.
    pub pyramid: f64,
    /// Its lines.
    pub rows: [PrintedRow; 3],
}

/// A line of a table: total seconds without the emission of photons.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct PrintedRow {
    /// Gather rays.
    pub rays: u32,
    /// Seconds of "normal photon mapping".
    pub classic: f64,
    /// Seconds with ray differentials.
    pub ray_differentials: f64,
    /// The column "difference", per cent. It does not follow from the seconds in the second and third table.
    pub difference: f64,
}

const fn row(rays: u32, classic: f64, ray_differentials: f64, difference: f64) -> PrintedRow {
    PrintedRow { rays, classic, ray_differentials, difference }
}

/// The three tables in their order.
pub const PRINTED: [PrintedTable; 3] = [
    PrintedTable {
        photons: 1_000_000,
        radius: 0.05,
        emission: 10.1,
        pyramid: 15.6,
        rows: [row(200, 124.7, 113.9, 8.7), row(800, 476.3, 361.5, 24.1), row(1800, 970.8, 759.4, 21.8)],
    },
    PrintedTable {
        photons: 500_000,
        radius: 0.05,
        emission: 5.0,
        pyramid: 10.2,
        rows: [row(200, 133.8, 107.0, 27.7), row(800, 488.6, 347.1, 31.1), row(1800, 1056.6, 730.6, 31.6)],
    },
    PrintedTable {
        photons: 500_000,
        radius: 0.1,
        emission: 5.0,
        pyramid: 5.7,
        rows: [row(200, 117.9, 103.3, 17.2), row(800, 420.4, 353.2, 17.3), row(1800, 904.6, 775.4, 14.9)],
    },
];

impl PrintedRow {
    /// Seconds with ray differentials over those of classic.
    pub fn ratio(&self) -> f64 {
        self.ray_differentials / self.classic
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The column "difference" follows from the seconds in the first table alone.
    #[test]
    fn differences_are_misprinted_from_the_second_table_on() {
        let computed = PRINTED.map(|t| t.rows.map(|r| 100.0 * (1.0 - r.ratio())));
        let expected = [[8.7, 24.1, 21.8], [20.0, 29.0, 30.9], [12.4, 16.0, 14.3]];
        for (t, (own, by_hand)) in computed.iter().zip(expected).enumerate() {
            for (r, (a, b)) in own.iter().zip(by_hand).enumerate() {
                assert!((a - b).abs() < 0.06, "{t} {r}: {a} {b}");
                assert_eq!((a - PRINTED[t].rows[r].difference).abs() < 0.06, t == 0, "{t} {r}");
            }
        }
    }

    /// Ray differentials are faster in every cell: what the paper claims.
    #[test]
    fn ray_differentials_are_faster_in_print() {
        assert!(PRINTED.iter().flat_map(|t| t.rows).all(|r| r.ratio() < 1.0));
        assert!(PRINTED.iter().all(|t| t.rows.map(|r| r.rays) == [200, 800, 1800]));
    }
}
