//! Quantities in D-SI: value, unit, and expanded uncertainty with k = 2 and a coverage probability of 95 %.

use super::element::{Element, leaf, parent, words};

/// Significant digits of a value without uncertainty.
const DIGITS: i32 = 6;

/// Significant digits of an expanded uncertainty; the value has the same last digit.
const UNCERTAINTY_DIGITS: i32 = 2;

/// Most decimals written: some values, such as those of a distortion, are far below 1.
const MOST_DECIMALS: i32 = 15;

/// Coverage factor of every expanded uncertainty.
const COVERAGE_FACTOR: f64 = 2.0;

/// Units in D-SI notation.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Unit {
    /// A number, also one of pixels: D-SI has no unit for them.
    One,
    /// Millimetres.
    Millimetre,
    /// Micrometres.
    Micrometre,
    /// Degrees of an angle.
    Degree,
}

impl Unit {
    fn notation(self) -> &'static str {
        match self {
            Self::One => r"\one",
            Self::Millimetre => r"\milli\metre",
            Self::Micrometre => r"\micro\metre",
            Self::Degree => r"\degree",
        }
    }
}

/// A quantity without uncertainty.
pub fn plain(name: &str, unit: Unit, value: f64) -> Element {
    quantity(name, [leaf("si:value", significant(value)), leaf("si:unit", unit.notation())])
}

/// A number of things.
pub fn count(name: &str, n: usize) -> Element {
    quantity(name, [leaf("si:value", n.to_string()), leaf("si:unit", Unit::One.notation())])
}

/// A quantity with the expanded uncertainty of this standard uncertainty; without one if that is zero or unknown, as of
/// parameters that were not fitted.
pub fn uncertain(name: &str, unit: Unit, value: f64, sigma: f64) -> Element {
    let expanded = COVERAGE_FACTOR * sigma;
    if !(expanded.is_finite() && expanded > 0.0) {
        return plain(name, unit, value);
    }
    let decimals = decimals(expanded, UNCERTAINTY_DIGITS);
    let uncertainty = parent(
        "si:expandedMU",
        [
            leaf("si:valueExpandedMU", fixed(expanded, decimals)),
            leaf("si:coverageFactor", "2"),
            leaf("si:coverageProbability", "0.95"),
            leaf("si:distribution", "normal"),
        ],
    );
    quantity(
        name,
        [
            leaf("si:value", fixed(value, decimals)),
            leaf("si:unit", unit.notation()),
            parent("si:measurementUncertaintyUnivariate", [uncertainty]),
        ],
    )
    .with("refType", "basic_measuredValue")
}

fn quantity(name: &str, real: impl IntoIterator<Item = Element>) -> Element {
    parent("dcc:quantity", [words("dcc:name", name), parent("si:real", real)])
}

/// Values of the same kind, each with a label; spaces in labels become `_`, since they separate them.
pub fn list(name: &str, unit: Unit, values: &[(String, f64)]) -> Element {
    let joined = |of: &dyn Fn(&(String, f64)) -> String| values.iter().map(of).collect::<Vec<_>>().join(" ");
    let label = |(label, _): &(String, f64)| label.split_whitespace().collect::<Vec<_>>().join("_");
    let real = parent(
        "si:realListXMLList",
        [
            leaf("si:labelXMLList", joined(&label)),
            leaf("si:valueXMLList", joined(&|(_, value)| significant(*value))),
            leaf("si:unitXMLList", unit.notation()),
        ],
    );
    parent("dcc:quantity", [words("dcc:name", name), real])
}

/// With [`DIGITS`] significant digits.
fn significant(value: f64) -> String {
    fixed(value, decimals(value, DIGITS))
}

/// Decimals with which `value` has this number of significant digits; negative: digits before the point are rounded.
fn decimals(value: f64, digits: i32) -> i32 {
    if value == 0.0 || !value.is_finite() {
        return 0;
    }
    let exponent = |value: f64| value.abs().log10().floor() as i32;
    let decimals = digits - 1 - exponent(value);
    // 0.0996 rounds to 0.10, which needs no third digit.
    let scale = 10f64.powi(decimals);
    (digits - 1 - exponent((value * scale).round() / scale)).clamp(-MOST_DECIMALS, MOST_DECIMALS)
}

/// Rounded to `decimals`; as the schema has it: without infinities, NaN as such.
fn fixed(value: f64, decimals: i32) -> String {
    if !value.is_finite() {
        return "NaN".to_owned();
    }
    let scale = 10f64.powi(decimals.min(0));
    let rounded = if decimals < 0 { (value * scale).round() / scale } else { value };
    let text = format!("{rounded:.*}", decimals.max(0) as usize);
    match text.strip_prefix('-') {
        Some(zero) if zero.bytes().all(|digit| matches!(digit, b'0' | b'.')) => zero.to_owned(),
        _ => text,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_value_ends_with_the_last_digit_of_its_uncertainty() {
        let cases = [
            (1_612.345_678, 0.0623, "1612.35", Some("0.12")),
            (1_612.345_678, 0.0498, "1612.35", Some("0.10")),
            (0.000_123_456, 0.000_000_31, "0.00012346", Some("0.00000062")),
            (1_234_567.0, 620.0, "1234600", Some("1200")),
            (-0.004, 0.5, "0.0", Some("1.0")),
            (0.099_6, 0.0, "0.0996000", None),
            (0.0, 0.0, "0", None),
            (1_612.345_678, f64::NAN, "1612.35", None),
        ];
        for (value, sigma, shown, uncertainty) in cases {
            let xml = uncertain("x", Unit::One, value, sigma).to_xml();
            assert!(xml.contains(&format!("<si:value>{shown}</si:value>")), "{value} {sigma}: {xml}");
            let expanded = uncertainty.map(|text| format!("<si:valueExpandedMU>{text}</si:valueExpandedMU>"));
            assert_eq!(xml.contains("expandedMU"), expanded.is_some(), "{xml}");
            assert!(expanded.is_none_or(|text| xml.contains(&text)), "{value} {sigma}: {xml}");
        }
    }

    #[test]
    fn a_list_has_one_label_per_value() {
        let values = [("board 1.png".to_owned(), 0.05), ("2.png".to_owned(), 0.123_456_78)];
        let xml = list("RMS", Unit::Micrometre, &values).to_xml();
        for text in
            ["<si:labelXMLList>board_1.png 2.png</", "<si:valueXMLList>0.0500000 0.123457</", r">\micro\metre<"]
        {
            assert!(xml.contains(text), "{text}: {xml}");
        }
    }
}
