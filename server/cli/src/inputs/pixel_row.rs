//! Input rows of `sheaf triangulate`: an order and a raw pixel, in columns found by name.

use pipeline::Failure;

/// Required columns.
const REQUIRED: [&str; 3] = ["order", "u_px", "v_px"];

/// One row: the numbers, and the text they were read from.
#[derive(Debug, Clone, PartialEq)]
pub struct PixelRow {
    /// Diffraction order.
    pub order: i8,
    /// Raw column.
    pub u_px: f64,
    /// Raw row.
    pub v_px: f64,
    /// order, u_px, v_px as written.
    pub text: [String; 3],
}

/// Positions of the required columns.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct RowLayout {
    columns: [usize; 3],
    n_columns: usize,
}

impl RowLayout {
    /// Finds order, u_px and v_px in a header line; other columns are ignored.
    pub fn from_header(header: &str) -> Result<Self, Failure> {
        let names: Vec<&str> = header.trim_start_matches('\u{feff}').split(',').map(clean).collect();
        let mut columns = [0; 3];
        for (slot, required) in columns.iter_mut().zip(REQUIRED) {
            *slot = names.iter().position(|name| *name == required).ok_or_else(|| {
                Failure::bad_input(format!("stdin, line 1: the header has no column {required}"))
                    .at_entry("line 1")
                    .remedy("begin with the line order,u_px,v_px")
            })?;
        }
        Ok(Self { columns, n_columns: names.len() })
    }

    /// Reads one line; `line_number` counts from 1 and is for messages.
    pub fn parse(&self, line: &str, line_number: usize) -> Result<PixelRow, Failure> {
        let fields: Vec<&str> = line.split(',').map(clean).collect();
        let bad = |what: String| {
            Failure::bad_input(format!("stdin, line {line_number}: {what}"))
                .at_entry(format!("line {line_number}"))
                .remedy(
                    "write a whole number for order and finite pixels for u_px and v_px, as named in the header",
                )
        };
        if fields.len() != self.n_columns {
            return Err(bad(format!("{} fields, the header has {}", fields.len(), self.n_columns)));
        }
        let [order, u, v] = self.columns.map(|column| fields[column]);
        let pixel = |text: &str, name: &str| match text.parse::<f64>() {
            Ok(value) if value.is_finite() => Ok(value),
            _ => Err(bad(format!("{name} is \"{text}\""))),
        };
        Ok(PixelRow {
            order: order_from(order).ok_or_else(|| bad(format!("order is \"{order}\"")))?,
            u_px: pixel(u, "u_px")?,
            v_px: pixel(v, "v_px")?,
            text: [order, u, v].map(str::to_owned),
        })
    }
}

/// A whole number, also in the form `-2.0` that spreadsheets write.
fn order_from(text: &str) -> Option<i8> {
    if let Ok(order) = text.parse() {
        return Some(order);
    }
    let value: f64 = text.parse().ok()?;
    (value.fract() == 0.0 && value.abs() <= f64::from(i8::MAX)).then_some(value as i8)
}

fn clean(field: &str) -> &str {
    field.trim().trim_matches('"')
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_are_found_by_name_and_their_text_is_kept() {
        let layout = RowLayout::from_header("frame,v_px,order,u_px\r").unwrap();
        let row = layout.parse("7, 2.50,-2.0,1e1\r", 2).unwrap();
        assert_eq!((row.order, row.u_px, row.v_px), (-2, 10.0, 2.5));
        assert_eq!(row.text, ["-2.0", "1e1", "2.50"]);
    }

    #[test]
    fn a_bad_row_is_named_by_its_line() {
        let layout = RowLayout::from_header("order,u_px,v_px").unwrap();
        for line in ["1,NaN,2", "x,1,2", "1,2", "0.5,1,2", "1,2,inf"] {
            let text = layout.parse(line, 41).unwrap_err().to_string();
            assert!(text.contains("line 41") && text.contains("remedy"), "{text}");
        }
        assert!(RowLayout::from_header("order,u,v").unwrap_err().to_string().contains("u_px"));
    }
}
