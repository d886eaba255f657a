//! Statistics of samples.
//!
//! The one median of all crates, so that results for the same data agree everywhere. Fitting, weighting and rejection
//! belong to the callers.

use std::cmp::Ordering;

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

/// The median, the upper one of two; `None` if empty. Reorders `values`.
pub fn median<T: Number>(values: &mut [T]) -> Option<T> {
    let middle = values.len() / 2;
    (!values.is_empty()).then(|| *values.select_nth_unstable_by(middle, T::order).1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_median_is_the_upper_one_of_two_and_none_of_nothing() {
        assert_eq!(median(&mut [3.0, 1.0, 2.0]), Some(2.0));
        assert_eq!(median(&mut [4.0_f32, 1.0, 3.0, 2.0]), Some(3.0));
        assert_eq!(median::<f64>(&mut []), None);
    }
}
