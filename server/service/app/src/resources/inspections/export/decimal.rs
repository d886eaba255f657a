//! Numbers as text.

/// Largest difference in a number caused by its decimal form: 1 nm, a thousandth of the smallest uncertainty expected.
const MOST_DECIMALS: usize = 6;

/// With `.` and at least `least` decimals, rounded to a nanometre; `None` if not finite.
///
/// Rounding keeps binary fractions such as 8.850000000000001 out of the files.
pub fn decimal(value: f64, least: usize) -> Option<String> {
    if !value.is_finite() {
        return None;
    }
    let mut text = format!("{value:.MOST_DECIMALS$}");
    let unneeded = text.bytes().rev().take(MOST_DECIMALS - least).take_while(|digit| *digit == b'0').count();
    text.truncate(text.len() - unneeded);
    if text.ends_with('.') {
        text.pop();
    }
    // -0.0000001 rounds to a zero without a sign.
    match text.strip_prefix('-') {
        Some(zero) if zero.bytes().all(|digit| matches!(digit, b'0' | b'.')) => Some(zero.to_owned()),
        _ => Some(text),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_rounded_to_a_nanometre_and_have_no_superfluous_zeros() {
        let cases = [
            (8.9 - 0.05, 3, Some("8.850")),
            (8.9 + 0.1, 3, Some("9.000")),
            (8.9 + 0.1, 0, Some("9")),
            (8.912_345_678, 3, Some("8.912346")),
            (100.0, 0, Some("100")),
            (0.0, 0, Some("0")),
            (-0.000_000_1, 3, Some("0.000")),
            (-0.05, 0, Some("-0.05")),
            (1e20, 0, Some("100000000000000000000")),
            (f64::NAN, 0, None),
            (f64::INFINITY, 3, None),
        ];
        for (value, least, expected) in cases {
            assert_eq!(decimal(value, least).as_deref(), expected, "{value}");
        }
    }
}
