//! Statistics of samples.
//!
//! The definition of the median for all crates, so that results for the same data agree everywhere. Fitting,
//! weighting and outlier rejection belong to the callers.

use std::cmp::Ordering;

/// σ of a normal distribution whose median absolute deviation is 1: 1 / Φ⁻¹(3/4).
pub const SIGMA_PER_MAD: f64 = 1.4826;

/// A number with a total order.
pub trait Number: Copy {
    /// Total order as `f64::total_cmp`: NaN comes last.
    fn order(&self, other: &Self) -> Ordering;
}

impl Number for f32 {
    fn order(&self, other: &Self) -> Ordering {
        self.total_cmp(other)
    }
}

impl Number for f64 {
    fn order(&self, other: &Self) -> Ordering {
        self.total_cmp(other)
    }
}

impl Number for usize {
    fn order(&self, other: &Self) -> Ordering {
        self.cmp(other)
    }
}

/// The median, for an even number of values the upper of the two middle ones; `None` if empty. Reorders `values`.
pub fn median<T: Number>(values: &mut [T]) -> Option<T> {
    let middle = values.len() / 2;
    (!values.is_empty()).then(|| *values.select_nth_unstable_by(middle, T::order).1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_median_of_an_even_number_of_values_is_the_upper_middle_one_and_of_none_is_none() {
        assert_eq!(median(&mut [3.0, 1.0, 2.0]), Some(2.0));
        assert_eq!(median(&mut [4.0_f32, 1.0, 3.0, 2.0]), Some(3.0));
        assert_eq!(median::<f64>(&mut []), None);
    }
}
