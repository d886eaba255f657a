//! Recipes, CAD models, inspections, statistics over them, and studies of the station.

pub mod evaluation;
pub mod inspections;
pub mod models;
pub mod recipes;
pub mod statistics;
pub mod studies;

use app::inspections::ReportFormat;
use axum::http::{HeaderValue, header};
use axum::response::Response;

use crate::rest::answers::bytes;
use crate::rest::around::headers::CSP_REPORT;
use crate::wire::inspection::requests::{ReportFormatDto, ReportQuery};

/// The requested format of a report, HTML by default.
fn report_format(query: &ReportQuery) -> ReportFormat {
    match query.format.unwrap_or_default() {
        ReportFormatDto::Html => ReportFormat::Html,
        ReportFormatDto::Pdf => ReportFormat::Pdf,
    }
}

/// A report as a response that may load nothing from elsewhere.
fn report_response(format: ReportFormat, report: Vec<u8>) -> Response {
    let media_type = match format {
        ReportFormat::Html => "text/html; charset=utf-8",
        ReportFormat::Pdf => "application/pdf",
    };
    let mut response = bytes(media_type, None, report);
    response.headers_mut().insert(header::CONTENT_SECURITY_POLICY, HeaderValue::from_static(CSP_REPORT));
    response
}
