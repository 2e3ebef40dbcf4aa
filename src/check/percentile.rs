//! Percentiles.

/// The value that `percent` of `values` do not exceed; not-a-number if one of them is, or if none is
/// given. Puts them in another order.
pub(crate) fn percentile(values: &mut [f64], percent: usize) -> f64 {
    if values.is_empty() || values.iter().any(|x| x.is_nan()) {
        return f64::NAN;
    }
    let place = (values.len() * percent).div_ceil(100) - 1;
    *values.select_nth_unstable_by(place, f64::total_cmp).1
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_percentile_leaves_one_in_a_hundred_above() {
        let mut values: Vec<f64> = (1..=200).rev().map(f64::from).collect();
        assert!((percentile(&mut values, 99) - 198.0).abs() < 1e-15);
        assert!((percentile(&mut values, 50) - 100.0).abs() < 1e-15);
        assert!((percentile(&mut [3.0], 99) - 3.0).abs() < 1e-15);
        assert!(percentile(&mut [1.0, f64::NAN], 99).is_nan());
        assert!(percentile(&mut [], 99).is_nan());
    }
}
