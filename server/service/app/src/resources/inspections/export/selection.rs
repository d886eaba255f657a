//! Several inspections in one Q-DAS file: all parts with their characteristics first, then the values.
//!
//! Inspections with the same description are values of the same part: usually those of a version of a recipe. Parts and
//! characteristics are numbered over the whole file: `K1001/2` is the second part, `K2001/3` the third characteristic,
//! whichever part it is of. A line of values without keys would need a value for every characteristic of the file, so each
//! value has its key here: `K0001/3` begins a value of characteristic 3, and the `K0…/3` after it belong to it. What is
//! invalid or was not measured is left out: without the places of a line it needs no placeholder, which not every reader
//! accepts.

use std::collections::HashMap;

use time::OffsetDateTime;

use super::dfq::{Field, VALID, characteristic_fields, date, line, part_fields, value, value_fields};
use super::windows_1252::{BYTE_ORDER_MARK, narrow};
use crate::resources::inspections::InspectionMessage;

/// The parts of a selection.
#[derive(Debug, Clone, Default)]
pub struct Selection {
    parts: Vec<Part>,
    /// Index into `parts` by description.
    known: HashMap<Description, usize>,
    n_characteristics: usize,
    last_seq: i64,
    /// Whether a text has characters that Windows-1252 lacks: the whole file is then UTF-8.
    is_wide: bool,
}

/// What a file says of a part before its values.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
struct Description {
    fields: Vec<Field>,
    characteristics: Vec<Vec<Field>>,
}

#[derive(Debug, Clone)]
struct Part {
    description: Description,
    /// Number of its first characteristic, from 1.
    first: usize,
}

impl Description {
    fn of(inspection: &InspectionMessage) -> Self {
        let characteristics =
            (1..).zip(&inspection.results).map(|(number, result)| characteristic_fields(number, result));
        Self { fields: part_fields(inspection), characteristics: characteristics.collect() }
    }
}

impl Selection {
    /// Adds the description of an inspection, which has a higher number than those before.
    pub fn add(&mut self, inspection: &InspectionMessage) {
        self.last_seq = inspection.seq;
        let description = Description::of(inspection);
        let mut texts = value_fields(inspection);
        if !self.known.contains_key(&description) {
            texts.extend(description.fields.iter().cloned());
            texts.extend(description.characteristics.iter().flatten().cloned());
            self.known.insert(description.clone(), self.parts.len());
            let (first, n) = (self.n_characteristics + 1, description.characteristics.len());
            self.parts.push(Part { description, first });
            self.n_characteristics += n;
        }
        self.is_wide |= texts.iter().any(|(_, text)| narrow(text).is_none());
    }

    /// Number of the last inspection; those after it came while the file was being written.
    pub fn last_seq(&self) -> i64 {
        self.last_seq
    }

    /// The beginning of the file: all parts with their characteristics.
    pub fn header(&self) -> Vec<u8> {
        let mut lines = vec![line("K0100", "", &self.n_characteristics.to_string())];
        for (number, part) in (1..).zip(&self.parts) {
            let of = |number: usize| move |(key, text): &Field| line(key, &format!("/{number}"), text);
            lines.extend(part.description.fields.iter().map(of(number)));
            for (number, fields) in (part.first..).zip(&part.description.characteristics) {
                lines.extend(fields.iter().map(of(number)));
            }
        }
        let mark: &[u8] = if self.is_wide { BYTE_ORDER_MARK.as_bytes() } else { &[] };
        [mark, &self.encoded(&lines)].concat()
    }

    /// The values of an inspection; `at` is the local time of its verdict. Empty if it was not there when the selection
    /// was read.
    pub fn values(&self, inspection: &InspectionMessage, at: Option<OffsetDateTime>) -> Vec<u8> {
        let known = self.known.get(&Description::of(inspection)).filter(|_| inspection.seq <= self.last_seq);
        let Some(part) = known.map(|idx| &self.parts[*idx]) else { return Vec::new() };
        let (at, fields) = (at.map(date).unwrap_or_default(), value_fields(inspection));
        let mut lines = Vec::new();
        for (number, result) in (part.first..).zip(&inspection.results) {
            let (value, attribute) = value(result);
            if attribute != VALID {
                continue;
            }
            let number = format!("/{number}");
            lines.push(line("K0001", &number, &value));
            lines.push(line("K0002", &number, &attribute.to_string()));
            lines.push(line("K0004", &number, &at));
            lines.extend(fields.iter().map(|(key, text)| line(key, &number, text)));
        }
        self.encoded(&lines)
    }

    fn encoded(&self, lines: &[String]) -> Vec<u8> {
        let text: String = lines.iter().map(|line| format!("{line}\r\n")).collect();
        let narrowed = if self.is_wide { None } else { narrow(&text) };
        narrowed.unwrap_or_else(|| text.into_bytes())
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use time::{Date, Month};

    use super::*;
    use crate::resources::inspections::sample::inspection;

    fn at() -> Option<OffsetDateTime> {
        let date = Date::from_calendar_date(2025, Month::November, 22).unwrap();
        Some(date.with_hms(14, 3, 7).unwrap().assume_utc())
    }

    /// Two inspections of a part, and one of another version whose only characteristic is invalid.
    fn three() -> [InspectionMessage; 3] {
        let first = inspection();
        let mut second = InspectionMessage { seq: 813, serial: "S2".to_owned(), order: None, ..first.clone() };
        second.results[0].value = Some(8.95);
        let mut other = InspectionMessage { seq: 814, serial: "S3".to_owned(), ..first.clone() };
        other.recipe.version = 8;
        other.results.truncate(1);
        other.results[0].verdict = Some("invalid".to_owned());
        [first, second, other]
    }

    fn file(inspections: &[InspectionMessage]) -> Vec<u8> {
        let mut selection = Selection::default();
        inspections.iter().for_each(|inspection| selection.add(inspection));
        let values = inspections.iter().flat_map(|inspection| selection.values(inspection, at()));
        selection.header().into_iter().chain(values).collect()
    }

    /// Written by hand after the description of the format and files of several parts in the tests of the aqdef-tools
    /// of Diribet; no Q-DAS program has read it.
    #[test]
    fn a_file_of_two_parts_is_as_written_here() {
        let expected = "K0100 3\r\n\
            K1001/1 bracket\r\nK1002/1 bracket\r\nK1004/1 7\r\n\
            K2001/1 1\r\nK2002/1 Step\r\nK2101/1 8.900\r\nK2110/1 8.850\r\nK2111/1 9.000\r\nK2112/1 -0.050\r\n\
            K2113/1 0.100\r\nK2142/1 mm\r\n\
            K2001/2 2\r\nK2002/2 Flatness\r\nK2111/2 0.050\r\nK2142/2 mm\r\n\
            K1001/2 bracket\r\nK1002/2 bracket\r\nK1004/2 8\r\n\
            K2001/3 1\r\nK2002/3 Step\r\nK2101/3 8.900\r\nK2110/3 8.850\r\nK2111/3 9.000\r\nK2112/3 -0.050\r\n\
            K2113/3 0.100\r\nK2142/3 mm\r\n\
            K0001/1 8.912\r\nK0002/1 0\r\nK0004/1 22.11.2025/14:03:07\r\nK0014/1 S1\r\nK0053/1 A-7\r\n\
            K0001/2 0.021\r\nK0002/2 0\r\nK0004/2 22.11.2025/14:03:07\r\nK0014/2 S1\r\nK0053/2 A-7\r\n\
            K0001/1 8.950\r\nK0002/1 0\r\nK0004/1 22.11.2025/14:03:07\r\nK0014/1 S2\r\n\
            K0001/2 0.021\r\nK0002/2 0\r\nK0004/2 22.11.2025/14:03:07\r\nK0014/2 S2\r\n";
        assert_eq!(String::from_utf8(file(&three())).unwrap(), expected);
    }

    #[test]
    fn a_part_with_another_part_number_or_limit_is_another_part() {
        let [first, second, _] = three();
        let mut numbered = first.clone();
        numbered.attributes.insert("K1001".to_owned(), "4711".to_owned());
        let mut limited = first.clone();
        limited.results[1].upper = Some(0.06);
        for (other, n) in [(second, 2), (numbered, 4), (limited, 4)] {
            let text = String::from_utf8(file(&[first.clone(), other])).unwrap();
            assert!(text.starts_with(&format!("K0100 {n}\r\n")), "{text}");
        }
        assert_eq!(file(&[]), b"K0100 0\r\n");
    }

    #[test]
    fn one_text_beyond_windows_1252_makes_the_whole_file_utf_8() {
        let [mut first, mut second, _] = three();
        first.order = Some("Prüfung".to_owned());
        assert!(file(&[first.clone(), second.clone()]).windows(8).any(|part| part == b"Pr\xfcfung\r"));
        second.serial = "零件".to_owned();
        let text = String::from_utf8(file(&[first, second])).unwrap();
        assert!(text.starts_with("\u{feff}K0100 2\r\n") && text.contains("K0053/1 Prüfung"), "{text}");
    }

    #[test]
    fn what_came_while_the_file_was_written_is_not_in_it() {
        let [first, second, _] = three();
        let mut selection = Selection::default();
        selection.add(&first);
        assert!(selection.values(&second, at()).is_empty());
    }
}
