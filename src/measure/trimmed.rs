//! Means without the worst pixels, which a few fireflies do not decide.

/// Part of the pixels that is left out.
pub const WORST: f64 = 0.001;

/// Mean without the `⌊0.001 n⌋` largest of `n` values: below a thousand all count. 0 for no value.
///
/// The remaining values are summed in their order, so that the same values give the same bits.
pub fn trimmed_mean(values: &[f64]) -> f64 {
    let dropped = (WORST * values.len() as f64) as usize;
    let kept = values.len() - dropped;
    if kept == 0 {
        return 0.0;
    }
    let mut order = values.to_vec();
    let (_, &mut largest, _) = order.select_nth_unstable_by(kept - 1, f64::total_cmp);
    // Of values equal to the largest that is kept, as many count as there is room for.
    let below = || values.iter().filter(|v| v.total_cmp(&largest).is_lt());
    let equal = kept - below().count();
    (below().sum::<f64>() + equal as f64 * largest) / kept as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_worst_of_a_thousand_is_left_out() {
        let mut values = vec![2.0; 1000];
        values[417] = 1e9;
        assert_eq!(trimmed_mean(&values), 2.0);
        assert_eq!(trimmed_mean(&values[1..]), (2.0 * 998.0 + 1e9) / 999.0);
        let mut two = vec![1.0; 2500];
        (two[3], two[70], two[2400]) = (50.0, 60.0, 7.0);
        assert_eq!(trimmed_mean(&two), (2497.0 + 7.0) / 2498.0);
    }

    #[test]
    fn equal_values_are_dropped_by_number() {
        let mut values = vec![0.0; 1998];
        values.extend([5.0, 5.0]);
        assert_eq!(trimmed_mean(&values), 0.0);
        values.push(5.0);
        assert_eq!(trimmed_mean(&values), 5.0 / 1999.0);
        assert_eq!(trimmed_mean(&[]), 0.0);
    }
}
