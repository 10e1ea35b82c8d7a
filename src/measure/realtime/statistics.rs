//! Medians and quantiles of times.

/// The value that a share `q` in 0 to 1 of the values stays below, between neighbours by proportion; 0 without values.
pub fn quantile(values: &[f64], q: f64) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_unstable_by(f64::total_cmp);
    let Some(last) = sorted.len().checked_sub(1) else { return 0.0 };
    let at = q.clamp(0.0, 1.0) * last as f64;
    let (low, part) = (at.floor() as usize, at.fract());
    sorted[low] + (sorted[(low + 1).min(last)] - sorted[low]) * part
}

/// Half of the values are below, half above; 0 without values.
pub fn median(values: &[f64]) -> f64 {
    quantile(values, 0.5)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_lie_between_the_ends() {
        let x = [3.0, 1.0, 2.0, 10.0];
        assert_eq!([0.0, 0.5, 1.0].map(|q| quantile(&x, q)), [1.0, 2.5, 10.0]);
        assert_eq!((median(&[]), median(&[4.0])), (0.0, 4.0));
    }
}
