//! Orders in files: one in a JSON file, one per row of a CSV file.

use std::collections::{BTreeMap, HashSet};

use app::inspections::InspectedPart;
use app::recipes::RecipeRef;
use serde::Deserialize;
use serde_json::Value;

/// An inspection to be started.
#[derive(Debug, Clone, PartialEq)]
pub struct Order {
    /// Row of a table, as a spreadsheet counts it.
    pub row: Option<u64>,
    /// The recipe; without it, it is selected by serial number.
    pub recipe: Option<RecipeRef>,
    /// The part.
    pub part: InspectedPart,
    /// The same order again has the same text.
    pub identity: String,
}

/// Why a file or a row is refused, for the person who wrote it.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{reason}")]
pub struct Refusal {
    /// Where: a row of a table.
    pub row: Option<u64>,
    /// Why.
    pub reason: String,
    /// What to do about it.
    pub remedy: String,
}

impl Refusal {
    /// Of the whole file.
    pub fn new(reason: impl Into<String>, remedy: impl Into<String>) -> Self {
        Self { row: None, reason: reason.into(), remedy: remedy.into() }
    }

    fn at(self, row: u64) -> Self {
        Self { row: Some(row), ..self }
    }
}

/// How orders are written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum OrderFormat {
    /// `*.json`
    Json,
    /// `*.csv`
    Csv,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct JsonOrder {
    serial: String,
    #[serde(default)]
    recipe: Option<Value>,
    #[serde(default)]
    order: Option<String>,
    #[serde(default)]
    attributes: BTreeMap<String, String>,
}

/// The orders in a file.
///
/// # Errors
/// If any of them is malformed; then none is started.
pub fn orders(format: OrderFormat, bytes: &[u8]) -> Result<Vec<Order>, Refusal> {
    let text = str::from_utf8(bytes)
        .map_err(|error| Refusal::new(format!("the file is not UTF-8 ({error})"), "save it as UTF-8"))?;
    // Spreadsheets put a byte order mark in front.
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    match format {
        OrderFormat::Json => Ok(vec![from_json(text)?]),
        OrderFormat::Csv => from_csv(text),
    }
}

fn from_json(text: &str) -> Result<Order, Refusal> {
    let remedy = "give an object such as {\"serial\": \"S1\", \"recipe\": \"bracket\", \"order\": \"A-7\", \
        \"attributes\": {\"line\": \"2\"}}; only serial is required";
    let json: JsonOrder = serde_json::from_str(text)
        .map_err(|error| Refusal::new(format!("the file is not an order: {error}"), remedy))?;
    let recipe = match json.recipe {
        None | Some(Value::Null) => None,
        Some(Value::String(text)) => Some(text),
        Some(Value::Number(number)) => Some(number.to_string()),
        Some(other) => return Err(Refusal::new(format!("the recipe is {other}"), remedy)),
    };
    let part = InspectedPart { serial: json.serial, order: json.order, attributes: json.attributes };
    order(None, recipe, part)
}

/// One order per row; columns that are neither serial, recipe nor order are attributes.
fn from_csv(text: &str) -> Result<Vec<Order>, Refusal> {
    let header = text.lines().next().unwrap_or_default();
    // Spreadsheets in many countries separate by semicolons, since the comma is their decimal point.
    let delimiter = if header.contains(';') && !header.contains(',') { b';' } else { b',' };
    let mut reader =
        csv::ReaderBuilder::new().delimiter(delimiter).trim(csv::Trim::All).from_reader(text.as_bytes());
    let malformed = |error: csv::Error, row: Option<u64>| {
        let remedy = "give every row all columns";
        Refusal { row, ..Refusal::new(format!("the table is malformed: {}", plain(&error)), remedy) }
    };
    let mut lines = Lines { text, byte: 0, line: 1 };
    let columns: Vec<String> =
        reader.headers().map_err(|error| malformed(error, Some(1)))?.iter().map(str::to_owned).collect();
    check_columns(&columns)?;
    let mut orders = Vec::new();
    for record in reader.records() {
        let record = record.map_err(|error| {
            let row = error.position().map(|position| lines.line_of(position));
            malformed(error, row)
        })?;
        let row = record.position().map_or(0, |position| lines.line_of(position));
        if record.iter().all(str::is_empty) {
            continue;
        }
        let mut cells: BTreeMap<_, _> = columns
            .iter()
            .zip(&record)
            .filter(|(_, cell)| !cell.is_empty())
            .map(|(column, cell)| (column.clone(), cell.to_owned()))
            .collect();
        let serial = cells
            .remove("serial")
            .ok_or_else(|| Refusal::new("the row has no serial number", "fill in the column serial").at(row))?;
        let (recipe, order_number) = (cells.remove("recipe"), cells.remove("order"));
        let part = InspectedPart { serial, order: order_number, attributes: cells };
        orders.push(order(Some(row), recipe, part)?);
    }
    match orders.is_empty() {
        true => Err(Refusal::new("the table has no rows", "give a row for every part")),
        false => Ok(orders),
    }
}

/// Without positions, which are given as a row.
fn plain(error: &csv::Error) -> String {
    match error.kind() {
        csv::ErrorKind::UnequalLengths { expected_len, len, .. } => {
            format!("{len} columns instead of {expected_len}")
        }
        _ => error.to_string(),
    }
}

/// Line numbers of records; the reader's own depend on the kind of line ends.
struct Lines<'a> {
    text: &'a str,
    byte: usize,
    line: u64,
}

impl Lines<'_> {
    /// The line in which a record begins, after those asked for before. Its position may lie before empty lines.
    fn line_of(&mut self, position: &csv::Position) -> u64 {
        let ahead = self.text.as_bytes().iter().enumerate().skip(self.byte);
        let at = usize::try_from(position.byte()).unwrap_or(usize::MAX);
        for (byte, letter) in ahead {
            if byte >= at && !matches!(letter, b'\r' | b'\n') {
                break;
            }
            self.line += u64::from(*letter == b'\n');
            self.byte = byte + 1;
        }
        self.line
    }
}

fn check_columns(columns: &[String]) -> Result<(), Refusal> {
    let remedy = "begin with a line such as serial,recipe,order; other columns are attributes";
    if !columns.iter().any(|column| column == "serial") {
        return Err(Refusal::new("the table has no column serial", remedy));
    }
    let mut known = HashSet::new();
    match columns.iter().find(|column| column.is_empty() || !known.insert(*column)) {
        None => Ok(()),
        Some(column) => Err(Refusal::new(format!("the column \"{column}\" has no name or occurs twice"), remedy)),
    }
}

fn order(row: Option<u64>, recipe: Option<String>, part: InspectedPart) -> Result<Order, Refusal> {
    let identity = serde_json::json!([recipe, part]).to_string();
    let reference = |text: String| {
        RecipeRef::parse(&text).ok_or_else(|| Refusal {
            row,
            ..Refusal::new(format!("\"{text}\" is not a recipe"), "give an id, id@version or the recipe's number")
        })
    };
    Ok(Order { row, recipe: recipe.map(reference).transpose()?, part, identity })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn part(serial: &str, order: Option<&str>, attributes: &[(&str, &str)]) -> InspectedPart {
        let attributes = attributes.iter().map(|(name, value)| ((*name).to_owned(), (*value).to_owned()));
        InspectedPart {
            serial: serial.to_owned(),
            order: order.map(str::to_owned),
            attributes: attributes.collect(),
        }
    }

    fn refused(format: OrderFormat, text: &[u8]) -> Refusal {
        orders(format, text).unwrap_err()
    }

    #[test]
    fn a_json_file_is_one_order() {
        let text = br#"{"serial":"S1","recipe":"bracket@7","order":"A-7","attributes":{"line":"2"}}"#;
        let [order] = &orders(OrderFormat::Json, text).unwrap()[..] else { panic!() };
        assert_eq!(order.recipe, Some(RecipeRef::Id { id: "bracket".to_owned(), version: Some(7) }));
        assert_eq!(order.part, part("S1", Some("A-7"), &[("line", "2")]));
        let [by_number] = &orders(OrderFormat::Json, br#"{"serial":"S1","recipe":12}"#).unwrap()[..] else {
            panic!()
        };
        assert_eq!(by_number.recipe, Some(RecipeRef::Number(12)));
        let [by_serial] = &orders(OrderFormat::Json, b"\xef\xbb\xbf{\"serial\":\"S1\"}").unwrap()[..] else {
            panic!()
        };
        assert_eq!((&by_serial.recipe, &by_serial.part), (&None, &part("S1", None, &[])));
    }

    #[test]
    fn every_row_of_a_table_is_an_order_and_other_columns_are_attributes() {
        let comma = "serial,recipe,order,line\r\nS1,bracket,A-7,2\r\n\"S,2\",,,\r\n\r\nS3,12,,\"a \"\"b\"\"\"\r\n";
        let semicolon = "\u{feff}serial;recipe;order;line\nS1;bracket;A-7;2\nS,2;;;\n;;;\nS3;12;;\"a \"\"b\"\"\"";
        for text in [comma, semicolon] {
            let orders = orders(OrderFormat::Csv, text.as_bytes()).unwrap();
            let parts: Vec<_> = orders.iter().map(|order| order.part.clone()).collect();
            let expected = [
                part("S1", Some("A-7"), &[("line", "2")]),
                part("S,2", None, &[]),
                part("S3", None, &[("line", "a \"b\"")]),
            ];
            assert_eq!(parts, expected);
            let rows: Vec<_> = orders.iter().map(|order| order.row).collect();
            assert_eq!(rows, [Some(2), Some(3), Some(5)]);
            let recipes: Vec<_> = orders.into_iter().map(|order| order.recipe).collect();
            let bracket = RecipeRef::Id { id: "bracket".to_owned(), version: None };
            assert_eq!(recipes, [Some(bracket), None, Some(RecipeRef::Number(12))]);
        }
    }

    #[test]
    fn what_is_no_order_is_refused_with_reason_and_remedy() {
        let json: [&[u8]; 7] = [
            b"",
            b"[]",
            b"{}",
            b"{\"serial\": 1}",
            b"{\"serial\": \"S1\", \"part\": 1}",
            b"{\"serial\": \"S1\", \"recipe\": [1]}",
            b"{\"serial\": \"\xff\"}",
        ];
        for text in json {
            assert!(!refused(OrderFormat::Json, text).remedy.is_empty());
        }
        let csv = [
            ("", None),
            ("serial\n", None),
            ("part\nS1\n", None),
            ("serial,serial\nS1,S1\n", None),
            ("serial,\nS1,x\n", None),
            ("serial,recipe\nS1,bracket\nS2\n", Some(3)),
            ("serial,recipe\nS1,bracket\n,bracket\n", Some(3)),
            ("serial,recipe\nS1,bracket@x\n", Some(2)),
        ];
        for (text, row) in csv {
            let refusal = refused(OrderFormat::Csv, text.as_bytes());
            assert_eq!(refusal.row, row, "{text:?}: {refusal}");
        }
    }
}
