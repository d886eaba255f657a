//! Inspections as files: one, or all that a filter selects, read in pages so that any number of them needs little
//! memory.

mod csv;
mod decimal;
mod dfq;
mod local_time;
mod selection;
mod windows_1252;

pub use csv::table as csv_table;
pub use decimal::decimal;
pub use dfq::document as dfq_document;
pub use local_time::{local, offset_now};

use store::{Catalogue, InspectionFilter};

use crate::error::AppError;
use crate::resources::inspections::InspectionMessage;
use selection::Selection;

/// Inspections read at once.
const PAGE: u32 = 200;

/// Format of an exported selection.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ExportFormat {
    /// A table with one row per characteristic.
    Csv,
    /// Q-DAS ASCII transfer format.
    Dfq,
}

/// An export in progress.
#[derive(Debug, Clone)]
pub struct Export {
    filter: InspectionFilter,
    form: Form,
}

#[derive(Debug, Clone)]
enum Form {
    Csv,
    Dfq(Selection),
}

/// A part of an export.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ExportPage {
    /// Complete lines; the first part begins with the header.
    pub bytes: Vec<u8>,
    /// Where the next part begins; `None` after the last one.
    pub next_seq: Option<i64>,
}

impl Export {
    /// Begins an export. A DFQ file describes all parts before their values: the selection is read once for that.
    ///
    /// # Errors
    /// The store cannot be read.
    pub async fn begin(
        read: &dyn Catalogue,
        filter: InspectionFilter,
        format: ExportFormat,
    ) -> Result<Self, AppError> {
        let form = match format {
            ExportFormat::Csv => Form::Csv,
            ExportFormat::Dfq => Form::Dfq(selection(read, &filter).await?),
        };
        Ok(Self { filter, form })
    }

    /// The inspections after number `after_seq` (0: from the first), oldest first.
    ///
    /// # Errors
    /// The store cannot be read. A damaged inspection is a line of the CSV with its id and no values; a DFQ leaves it
    /// out.
    pub async fn page(&self, read: &dyn Catalogue, after_seq: i64) -> Result<ExportPage, AppError> {
        let listed = read.inspections_after(&self.filter, after_seq, PAGE).await?;
        let next_seq = listed.next.and_then(|seq| seq.parse().ok());
        let messages = listed.records.into_iter().map(|record| {
            let id = record.id.clone();
            InspectionMessage::try_from(record).map_err(|_| id)
        });
        match &self.form {
            Form::Csv => {
                let mut text = if after_seq == 0 { csv::header() } else { String::new() };
                text.extend(listed.damaged.iter().map(|damaged| csv::damaged_row(&damaged.id)));
                text.extend(messages.map(|message| match message {
                    Ok(inspection) => csv::rows(&inspection),
                    Err(id) => csv::damaged_row(&id),
                }));
                Ok(ExportPage { bytes: text.into_bytes(), next_seq })
            }
            Form::Dfq(selection) => {
                let mut bytes = if after_seq == 0 { selection.header() } else { Vec::new() };
                for inspection in messages.filter_map(Result::ok) {
                    bytes.extend(selection.values(&inspection, local(inspection.inspected_at_ms)));
                }
                Ok(ExportPage { bytes, next_seq: next_seq.filter(|seq| *seq < selection.last_seq()) })
            }
        }
    }
}

/// The parts among the inspections of a filter.
async fn selection(read: &dyn Catalogue, filter: &InspectionFilter) -> Result<Selection, AppError> {
    let (mut selection, mut next) = (Selection::default(), Some(0));
    while let Some(after_seq) = next {
        let listed = read.inspections_after(filter, after_seq, PAGE).await?;
        next = listed.next.and_then(|seq| seq.parse().ok());
        for inspection in listed.records.into_iter().filter_map(|record| InspectionMessage::try_from(record).ok())
        {
            selection.add(&inspection);
        }
    }
    Ok(selection)
}
