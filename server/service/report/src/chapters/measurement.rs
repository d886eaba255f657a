//! The chapter on a measurement: value with uncertainty, table by orders.

use maud::{Markup, html};
use metrology::{Measurement, PartVerdict};

use crate::drawing::page::{sentence as as_sentence, table, verdict};
use crate::tables::order_name;

/// Sentence and table of one measurement.
pub fn content(measurement: &Measurement) -> Markup {
    let unit = measurement.unit.symbol();
    let mut sentence = format!(
        "{} {:.4} {unit}, {} {:.4} {unit} (k = 2)",
        measurement.tool,
        measurement.value,
        if measurement.missing.is_empty() { "U =" } else { "U incomplete, at least" },
        measurement.expanded_uncertainty
    );
    if let (Some(nominal), Some(error)) = (measurement.nominal, measurement.error) {
        sentence.push_str(&format!("; nominal {nominal:.4} {unit}, error {error:+.4} {unit}"));
    }
    if let Some(outcome) = measurement.verdict {
        sentence.push_str(&format!("; {} (ISO 14253-1)", PartVerdict::from(outcome).label()));
    }
    let rows: Vec<Vec<String>> = measurement
        .per_order
        .iter()
        .map(|row| (order_name(row.order), row.errors, row.value_mm))
        .chain([("all".to_owned(), measurement.errors, Some(measurement.value))])
        .map(|(name, errors, value)| {
            vec![
                name,
                errors.n_points.to_string(),
                format!("{:+.1}", errors.mean_mm * 1e3),
                format!("{:.1}", errors.rmse_mm * 1e3),
                format!("{:.0}", errors.max_mm * 1e3),
                value.map_or_else(|| "–".to_owned(), |value| format!("{value:.4}")),
            ]
        })
        .collect();
    let n_orders = measurement.per_order.len();
    let head = ["order", "points", "mean error, µm", "RMSE, µm", "largest, µm", "value, mm"];
    html! {
        (verdict(&as_sentence(&sentence)))
        (table(&head, &rows, |idx| idx == n_orders))
        @for note in &measurement.notes { p { (as_sentence(note)) "." } }
    }
}
