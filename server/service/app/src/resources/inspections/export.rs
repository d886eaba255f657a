//! Inspections selected by a filter as one table, read in pages so that any number of them needs little memory.

use store::{Catalogue, InspectionFilter};

use crate::error::AppError;
use crate::resources::inspections::{InspectionMessage, csv};

/// Inspections read at once.
const PAGE: u32 = 200;

/// A part of the table.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ExportPage {
    /// Complete lines; the first part begins with the header.
    pub text: String,
    /// Where the next part begins; `None` after the last one.
    pub next_seq: Option<i64>,
}

/// The inspections after number `after_seq` (0: from the first), oldest first, as lines of CSV.
///
/// # Errors
/// The store cannot be read. A damaged inspection is a line with its id and no values.
pub async fn export_csv(
    read: &dyn Catalogue,
    filter: &InspectionFilter,
    after_seq: i64,
) -> Result<ExportPage, AppError> {
    let listed = read.inspections_after(filter, after_seq, PAGE).await?;
    let mut text = if after_seq == 0 { csv::header() } else { String::new() };
    for damaged in &listed.damaged {
        text += &csv::damaged_row(&damaged.id);
    }
    for record in listed.records {
        let id = record.id.clone();
        text += &match InspectionMessage::try_from(record) {
            Ok(inspection) => csv::rows(&inspection),
            Err(_) => csv::damaged_row(&id),
        };
    }
    Ok(ExportPage { text, next_seq: listed.next.and_then(|seq| seq.parse().ok()) })
}
