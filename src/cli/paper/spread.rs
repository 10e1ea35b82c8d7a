//! Repeated measurements in three numbers.

use serde::Serialize;

/// Median and range of some measurements.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Spread {
    /// The median; of an even number the mean of the middle two.
    pub median: f64,
    /// The least.
    pub least: f64,
    /// The largest.
    pub most: f64,
}

impl Spread {
    /// Of some numbers; zeros of none.
    pub fn of(values: &[f64]) -> Self {
        let mut sorted = values.to_vec();
        sorted.sort_unstable_by(f64::total_cmp);
        match sorted.as_slice() {
            [] => Self::default(),
            [least, .., most] => {
                let n = sorted.len();
                Self { median: (sorted[(n - 1) / 2] + sorted[n / 2]) / 2.0, least: *least, most: *most }
            }
            [one] => Self { median: *one, least: *one, most: *one },
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_middle_is_found() {
        let spread = |v: &[f64]| {
            let s = Spread::of(v);
            [s.least, s.median, s.most]
        };
        assert_eq!(spread(&[]), [0.0; 3]);
        assert_eq!(spread(&[2.0]), [2.0; 3]);
        assert_eq!(spread(&[3.0, 1.0]), [1.0, 2.0, 3.0]);
        assert_eq!(spread(&[5.0, 1.0, 2.0]), [1.0, 2.0, 5.0]);
    }
}
