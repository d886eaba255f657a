//! Results: the documents of an inspection, and how they are written.

mod file_name;
#[cfg(test)]
pub mod tests;
mod writing;

pub use file_name::FileName;
pub use writing::{Document, write_all};

use app::doors::{Delivery, InspectionMessage};
use app::inspections::{csv_table, dfq_document, local};

use crate::settings::Format;

/// The documents of an inspection; `None` if its report is one of them and is missing.
pub fn documents(
    formats: &[Format],
    delivery: &Delivery,
    inspection: &InspectionMessage,
) -> Option<Vec<Document>> {
    let document = |format: &Format| {
        let (extension, bytes) = match format {
            Format::Json => ("json", pretty(delivery)),
            Format::Csv => ("csv", csv_table(inspection).into_bytes()),
            Format::Dfq => ("dfq", dfq_document(inspection, local(inspection.inspected_at_ms))),
            Format::Pdf => ("pdf", delivery.report_pdf.clone()?),
        };
        Some(Document { extension, bytes })
    };
    formats.iter().map(document).collect()
}

fn pretty(delivery: &Delivery) -> Vec<u8> {
    format!("{:#}\n", delivery.message()).into_bytes()
}
