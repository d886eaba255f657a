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

/// The documents of an inspection.
pub fn documents(formats: &[Format], delivery: &Delivery, inspection: &InspectionMessage) -> Vec<Document> {
    let document = |format: &Format| match format {
        Format::Json => Document { extension: "json", bytes: pretty(delivery) },
        Format::Csv => Document { extension: "csv", bytes: csv_table(inspection).into_bytes() },
        Format::Dfq => {
            Document { extension: "dfq", bytes: dfq_document(inspection, local(inspection.inspected_at_ms)) }
        }
    };
    formats.iter().map(document).collect()
}

fn pretty(delivery: &Delivery) -> Vec<u8> {
    format!("{:#}\n", delivery.message()).into_bytes()
}
