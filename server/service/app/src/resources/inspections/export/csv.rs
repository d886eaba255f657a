//! Inspections as a table: CSV by RFC 4180, UTF-8, one row per characteristic.

use crate::resources::inspections::{CharacteristicMessage, InspectionMessage, decimal};

/// The columns. New ones are added at the end.
const COLUMNS: [&str; 24] = [
    "inspection_id",
    "seq",
    "serial",
    "order",
    "recipe",
    "recipe_version",
    "inspected_at",
    "simulated",
    "part_verdict",
    "characteristic",
    "measure",
    "unit",
    "nominal",
    "lower_deviation",
    "upper_deviation",
    "lower_limit",
    "upper_limit",
    "value",
    "expanded_uncertainty",
    "coverage_factor",
    "verdict",
    "reason",
    "scan_id",
    "attributes",
];

/// The table of one inspection with its header.
pub fn table(inspection: &InspectionMessage) -> String {
    header() + &rows(inspection)
}

/// The header line.
pub(super) fn header() -> String {
    COLUMNS.join(",") + "\r\n"
}

/// The lines of an inspection; without characteristics there is one, for its verdict.
pub(super) fn rows(inspection: &InspectionMessage) -> String {
    let rows = match inspection.results.as_slice() {
        [] => vec![row(inspection, None)],
        results => results.iter().map(|result| row(inspection, Some(result))).collect(),
    };
    rows.iter().map(|row| row.join(",") + "\r\n").collect()
}

/// The line of a stored inspection that cannot be read: only its id and the reason.
pub(super) fn damaged_row(id: &str) -> String {
    let cell = |column: &str| match column {
        "inspection_id" => text(Some(id)),
        "reason" => text(Some("the stored inspection is damaged")),
        _ => String::new(),
    };
    COLUMNS.map(cell).join(",") + "\r\n"
}

fn row(inspection: &InspectionMessage, result: Option<&CharacteristicMessage>) -> [String; COLUMNS.len()] {
    let of_result = |field: fn(&CharacteristicMessage) -> Option<&str>| text(result.and_then(field));
    let value = |field: fn(&CharacteristicMessage) -> Option<f64>| number(result.and_then(field));
    let attributes = match inspection.attributes.is_empty() {
        true => String::new(),
        false => serde_json::json!(inspection.attributes).to_string(),
    };
    [
        text(Some(&inspection.id)),
        inspection.seq.to_string(),
        text(Some(&inspection.serial)),
        text(inspection.order.as_deref()),
        text(Some(&inspection.recipe.id)),
        inspection.recipe.version.to_string(),
        text(Some(&inspection.inspected_at)),
        inspection.simulated.to_string(),
        text(Some(&inspection.verdict)),
        of_result(|result| Some(&result.id)),
        of_result(|result| Some(&result.measure)),
        of_result(|result| Some(&result.unit)),
        value(|result| result.nominal),
        value(|result| result.lower),
        value(|result| result.upper),
        value(|result| result.limits().0),
        value(|result| result.limits().1),
        value(|result| result.value),
        value(|result| result.expanded_uncertainty),
        value(|result| Some(result.coverage_factor)),
        of_result(|result| result.verdict.as_deref()),
        of_result(|result| result.reason.as_deref()),
        text(inspection.scan_id.as_deref()),
        text(Some(&attributes)),
    ]
}

fn number(value: Option<f64>) -> String {
    value.and_then(|value| decimal(value, 0)).unwrap_or_default()
}

/// A text, quoted where necessary. Spreadsheets calculate what begins like a formula; an apostrophe makes it a text.
fn text(text: Option<&str>) -> String {
    let text = text.unwrap_or_default();
    let is_formula = text.starts_with(['=', '+', '-', '@', '\t', '\r', '\n']);
    let text = if is_formula { format!("'{text}") } else { text.to_owned() };
    match text.contains(['"', ',', ';', '\r', '\n', '\t']) {
        true => format!("\"{}\"", text.replace('"', "\"\"")),
        false => text,
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;
    use crate::resources::inspections::sample::inspection;

    fn read(table: &str) -> Vec<csv::StringRecord> {
        csv::ReaderBuilder::new()
            .has_headers(false)
            .from_reader(table.as_bytes())
            .records()
            .map(Result::unwrap)
            .collect()
    }

    #[test]
    fn the_table_is_as_written_here() {
        let table = table(&inspection());
        let expected = "inspection_id,seq,serial,order,recipe,recipe_version,inspected_at,simulated,part_verdict,\
            characteristic,measure,unit,nominal,lower_deviation,upper_deviation,lower_limit,upper_limit,value,\
            expanded_uncertainty,coverage_factor,verdict,reason,scan_id,attributes\r\n\
            01J,812,S1,A-7,bracket,7,2025-11-22T13:03:07Z,false,ok,\
            Step,step,mm,8.9,-0.05,0.1,8.85,9,8.912,0.01,2,ok,,scan-1,\"{\"\"line\"\":\"\"2\"\"}\"\r\n\
            01J,812,S1,A-7,bracket,7,2025-11-22T13:03:07Z,false,ok,\
            Flatness,flatness,mm,,,0.05,,0.05,0.021,0.004,2,ok,,scan-1,\"{\"\"line\"\":\"\"2\"\"}\"\r\n";
        assert_eq!(table, expected);
    }

    #[test]
    fn what_is_not_measured_is_empty_and_never_zero() {
        let mut unmeasured = inspection();
        unmeasured.results[0].value = None;
        unmeasured.results[0].verdict = Some("invalid".to_owned());
        let rows = read(&table(&unmeasured));
        assert_eq!((&rows[0][17], &rows[1][17], &rows[1][20]), ("value", "", "invalid"));
        unmeasured.results.clear();
        let rows = read(&table(&unmeasured));
        assert_eq!((rows.len(), &rows[1][8], &rows[1][9]), (2, "ok", ""));
    }

    #[test]
    fn a_damaged_inspection_is_a_row_with_its_id_and_no_value() {
        let rows = read(&(header() + &damaged_row("01J") + &rows(&inspection())));
        assert_eq!((rows.len(), &rows[1][0], &rows[1][21]), (4, "01J", "the stored inspection is damaged"));
        assert!([8, 17, 20].into_iter().all(|column| rows[1][column].is_empty()));
        assert_eq!(&rows[2][0], "01J");
    }

    #[test]
    fn any_text_is_read_back_and_none_is_a_formula() {
        let texts = ["a,b", "say \"no\"", "two\r\nlines", "ü, 零", "5; 6", "'quoted'", " spaced ", "2-1", ""];
        let formulas = ["=1+1", "+49", "-5", "@SUM(A1)", "\tx", "\rx"];
        let mut named = inspection();
        let read_as = |named: &InspectionMessage| read(&table(named))[1][2].to_owned();
        for text in texts {
            named.serial = text.to_owned();
            assert_eq!(read_as(&named), text);
        }
        for formula in formulas {
            named.serial = formula.to_owned();
            assert_eq!(read_as(&named), format!("'{formula}"));
        }
    }
}
