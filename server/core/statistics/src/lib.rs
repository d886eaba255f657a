//! What a sample of numbers says as a whole.
//!
//! The one median of all crates: figures of the same data agree wherever they are computed. What is fitted, weighted or
//! rejected by it belongs to whoever does so.

use std::cmp::Ordering;

/// A number with a total order.
pub trait Number: Copy {
    /// As `f64::total_cmp`: not-a-number comes last.
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

/// The median, the upper one of two; `None` of nothing. Puts `values` into another order.
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
