//! The inspection in the Q-DAS ASCII transfer format (DFQ): one part, one line of values.
//!
//! `Kxxxx text` describes the part, `Kxxxx/n text` characteristic n, `/0` all of them. The line of values has neither
//! key nor number: the fields of a characteristic are separated by 0x14, characteristics by 0x0F. Fields after it belong
//! to these values. Attributes whose names are K fields are written as such fields: those of the part (K0…, K1…) and of a
//! characteristic (K2…), such as the part number of the catalogue in K1001. Several inspections in one file:
//! `selection.rs`.

use std::collections::BTreeMap;

use serde_json::Value;
use time::OffsetDateTime;

use super::decimal::decimal;
use super::windows_1252::encoded;
use crate::resources::inspections::{CharacteristicMessage, InspectionMessage};

/// Between the fields of a value.
const FIELD: char = '\u{14}';

/// Between characteristics.
const CHARACTERISTIC: char = '\u{0f}';

/// K0002: the value counts.
pub const VALID: u8 = 0;

/// K0002: there is no value; a placeholder that nothing is calculated with.
const NOT_MEASURED: u8 = 255;

/// Decimals of every value.
const LEAST_DECIMALS: usize = 3;

/// Fields that only the inspection itself may fill.
const MEASURED: [&str; 11] =
    ["K0001", "K0002", "K0004", "K0014", "K0100", "K2101", "K2110", "K2111", "K2112", "K2113", "K2142"];

/// A field: its key and its text.
pub type Field = (String, String);

/// The document; `at` is the local time of the verdict.
pub fn document(inspection: &InspectionMessage, at: Option<OffsetDateTime>) -> Vec<u8> {
    let mut lines = vec![line("K0100", "", &inspection.results.len().to_string())];
    lines.extend(part_fields(inspection).iter().map(|(key, text)| line(key, "", text)));
    for (number, result) in (1..).zip(&inspection.results) {
        let fields = characteristic_fields(number, result);
        lines.extend(fields.iter().map(|(key, text)| line(key, &format!("/{number}"), text)));
    }
    let at = at.map(date).unwrap_or_default();
    let value = |result| {
        let (value, attribute) = value(result);
        format!("{value}{FIELD}{attribute}{FIELD}{at}")
    };
    let values: Vec<_> = inspection.results.iter().map(value).collect();
    lines.push(values.join(&CHARACTERISTIC.to_string()));
    lines.extend(value_fields(inspection).iter().map(|(key, text)| line(key, "/0", text)));
    lines.push(String::new());
    encoded(&lines.join("\r\n"))
}

/// A line with a field of the part or characteristic `number`, such as `/2`.
pub fn line(key: &str, number: &str, text: &str) -> String {
    format!("{key}{number} {}", clean(text))
}

/// What describes the part.
pub fn part_fields(inspection: &InspectionMessage) -> Vec<Field> {
    let recipe = &inspection.recipe;
    let mut fields = BTreeMap::from([
        ("K1001", recipe.id.clone()),
        ("K1002", recipe.id.clone()),
        ("K1004", recipe.version.to_string()),
    ]);
    if inspection.simulated {
        fields.insert("K1900", "simulated: not measured on a real part".to_owned());
    }
    fields.extend(given(&inspection.attributes, "K1", Clone::clone));
    owned(fields)
}

/// What describes a characteristic, the `number`-th of its part.
pub fn characteristic_fields(number: usize, result: &CharacteristicMessage) -> Vec<Field> {
    let mut fields = BTreeMap::from([
        ("K2001", number.to_string()),
        ("K2002", result.id.clone()),
        ("K2142", result.unit.clone()),
    ]);
    let (lower, upper) = result.limits();
    // A deviation needs a nominal value to deviate from.
    let deviation = |limit: Option<f64>| result.nominal.and(limit);
    let numbers = [
        ("K2101", result.nominal),
        ("K2110", lower),
        ("K2111", upper),
        ("K2112", deviation(result.lower)),
        ("K2113", deviation(result.upper)),
    ];
    let texts = numbers.into_iter().filter_map(|(key, value)| Some((key, decimal(value?, LEAST_DECIMALS)?)));
    fields.extend(texts);
    fields.extend(given(&result.attributes, "K2", text));
    owned(fields)
}

/// The value and its attribute (K0002). What is invalid has no value: nobody may calculate with it.
pub fn value(result: &CharacteristicMessage) -> (String, u8) {
    let is_invalid = result.verdict.as_deref() == Some("invalid");
    let value = result.value.filter(|_| !is_invalid).and_then(|value| decimal(value, LEAST_DECIMALS));
    let attribute = if value.is_some() { VALID } else { NOT_MEASURED };
    (value.unwrap_or_default(), attribute)
}

/// What belongs to all values of an inspection.
pub fn value_fields(inspection: &InspectionMessage) -> Vec<Field> {
    let mut fields = BTreeMap::from([("K0014", inspection.serial.clone())]);
    fields.extend(inspection.order.clone().map(|order| ("K0053", order)));
    fields.extend(given(&inspection.attributes, "K0", Clone::clone));
    owned(fields)
}

fn owned(fields: BTreeMap<&str, String>) -> Vec<Field> {
    fields.into_iter().map(|(key, text)| (key.to_owned(), text)).collect()
}

/// Attributes that are K fields of this group.
fn given<'a, V>(
    attributes: &'a BTreeMap<String, V>,
    group: &'static str,
    text: impl Fn(&V) -> String,
) -> impl Iterator<Item = (&'a str, String)> {
    let is_field = move |key: &str| {
        key.len() == 5
            && key.starts_with(group)
            && key[1..].bytes().all(|digit| digit.is_ascii_digit())
            && !MEASURED.contains(&key)
    };
    attributes.iter().filter(move |(key, _)| is_field(key)).map(move |(key, value)| (key.as_str(), text(value)))
}

/// Attributes of characteristics are texts, numbers and truth values.
fn text(value: &Value) -> String {
    value.as_str().map_or_else(|| value.to_string(), str::to_owned)
}

/// One line, without the separators.
fn clean(text: &str) -> String {
    let plain = |letter: char| if letter.is_control() { ' ' } else { letter };
    text.chars().map(plain).collect::<String>().trim().to_owned()
}

/// Day and time as K0004 has it.
pub fn date(at: OffsetDateTime) -> String {
    let (day, month, year) = (at.day(), u8::from(at.month()), at.year());
    format!("{day:02}.{month:02}.{year:04}/{:02}:{:02}:{:02}", at.hour(), at.minute(), at.second())
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use serde_json::json;
    use time::{Date, Month, UtcOffset};

    use super::*;
    use crate::resources::inspections::sample::inspection;

    /// An hour before 22.11.2025/14:03:07, in UTC.
    fn at() -> Option<OffsetDateTime> {
        let date = Date::from_calendar_date(2025, Month::November, 22).unwrap();
        let offset = UtcOffset::from_hms(1, 0, 0).unwrap();
        Some(date.with_hms(13, 3, 7).unwrap().assume_utc().to_offset(offset))
    }

    fn lines(inspection: &InspectionMessage) -> Vec<String> {
        let text = String::from_utf8(document(inspection, at())).unwrap();
        text.split("\r\n").map(str::to_owned).collect()
    }

    /// Written by hand after the description of the format; no Q-DAS program has read it.
    #[test]
    fn the_document_is_as_written_here() {
        let expected = b"K0100 2\r\n\
            K1001 bracket\r\n\
            K1002 bracket\r\n\
            K1004 7\r\n\
            K2001/1 1\r\n\
            K2002/1 Step\r\n\
            K2101/1 8.900\r\n\
            K2110/1 8.850\r\n\
            K2111/1 9.000\r\n\
            K2112/1 -0.050\r\n\
            K2113/1 0.100\r\n\
            K2142/1 mm\r\n\
            K2001/2 2\r\n\
            K2002/2 Flatness\r\n\
            K2111/2 0.050\r\n\
            K2142/2 mm\r\n\
            8.912\x140\x1422.11.2025/14:03:07\x0f0.021\x140\x1422.11.2025/14:03:07\r\n\
            K0014/0 S1\r\n\
            K0053/0 A-7\r\n";
        let found = document(&inspection(), at());
        assert_eq!(String::from_utf8_lossy(&found), String::from_utf8_lossy(expected));
        assert_eq!(found, expected);
    }

    #[test]
    fn what_is_not_measured_or_invalid_is_a_placeholder_without_a_value() {
        let mut unmeasured = inspection();
        unmeasured.results[0].value = None;
        unmeasured.results[1].verdict = Some("invalid".to_owned());
        let placeholder = "\u{14}255\u{14}22.11.2025/14:03:07";
        assert_eq!(lines(&unmeasured)[16], format!("{placeholder}\u{f}{placeholder}"));
    }

    #[test]
    fn a_text_cannot_add_fields_or_values() {
        let mut hostile = inspection();
        hostile.serial = "S1\r\nK1001 other\u{14}\u{f}".to_owned();
        hostile.results[0].id = "Step\nK2101/1 0".to_owned();
        let (plain, hostile) = (lines(&inspection()), lines(&hostile));
        assert_eq!(hostile.len(), plain.len());
        assert_eq!(
            (hostile[5].as_str(), hostile[17].as_str()),
            ("K2002/1 Step K2101/1 0", "K0014/0 S1  K1001 other")
        );
    }

    #[test]
    fn attributes_that_are_k_fields_are_written_as_such_but_never_replace_what_was_measured() {
        let mut given = inspection();
        let attributes = [("K1001", "4711"), ("K0006", "#B12"), ("K0002", "0"), ("K2002", "x"), ("line", "2")];
        given.attributes = attributes.map(|(key, text)| (key.to_owned(), text.to_owned())).into();
        let of_characteristic = [("K2002", json!("Planheit")), ("K2111", json!(9)), ("K2005", json!(3))];
        given.results[1].attributes = of_characteristic.map(|(key, value)| (key.to_owned(), value)).into();
        let lines = lines(&given);
        assert_eq!((lines[1].as_str(), lines[2].as_str()), ("K1001 4711", "K1002 bracket"));
        assert_eq!(lines[13..16], ["K2002/2 Planheit", "K2005/2 3", "K2111/2 0.050"]);
        assert_eq!(lines[18..], ["K0006/0 #B12", "K0014/0 S1", "K0053/0 A-7", ""]);
    }

    #[test]
    fn a_simulated_part_is_marked() {
        let simulated = InspectionMessage { simulated: true, ..inspection() };
        assert!(lines(&simulated)[4].starts_with("K1900 simulated"));
    }
}
