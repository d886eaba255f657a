//! The certificate of a calibration as a Digital Calibration Certificate (DCC) of the PTB.
//!
//! XML by the schema `https://ptb.de/dcc` 3.3.0, with quantities in D-SI (`https://ptb.de/si`). The results are those of
//! the calibration document; who issues the certificate, for whom, and what identifies the station is stated by
//! [`Issuer`], since no program can know it. Every certificate says that it is not one of an accredited laboratory.

mod administrative;
mod element;
mod issuer;
mod quantity;
mod results;
#[cfg(test)]
mod tests;

pub use issuer::{CertificateError, Contact, Issuer, Place};

use calibration::CalibrationDocument;
use time::Date;

use element::{Element, parent};

/// Version of the schema that certificates follow.
pub const SCHEMA_VERSION: &str = "3.3.0";

/// What a certificate states besides the results of the calibration.
#[derive(Debug, Clone, PartialEq)]
pub struct Certificate {
    /// Who issues it, for whom, and for which station.
    pub issuer: Issuer,
    /// First day of the calibration, UTC.
    pub begun: Date,
    /// Last day of the calibration, UTC.
    pub ended: Date,
    /// Day of issue, UTC.
    pub issued: Date,
    /// The devices that captured the images, as far as known.
    pub parts: Vec<StationPart>,
    /// `twin` or `replay` if they were simulated.
    pub simulated: Option<String>,
}

/// A device of the station, as it identified itself.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct StationPart {
    /// `camera`, `stage` or `laser`.
    pub part: String,
    /// Vendor; empty if unknown.
    pub vendor: String,
    /// Model; empty if unknown.
    pub model: String,
    /// Serial number; empty if unknown.
    pub serial: String,
    /// Firmware version; empty if unknown.
    pub firmware: String,
}

/// The certificate as XML, UTF-8. Its identifier is made of the calibration's id and the day of issue.
///
/// # Errors
/// [`CertificateError`] names the entries of the issuer that are missing or wrong.
pub fn calibration_certificate(
    document: &CalibrationDocument,
    certificate: &Certificate,
) -> Result<String, CertificateError> {
    certificate.issuer.check()?;
    Ok(root(document, certificate).to_xml())
}

fn root(document: &CalibrationDocument, certificate: &Certificate) -> Element {
    let location = format!("https://ptb.de/dcc https://ptb.de/dcc/v{SCHEMA_VERSION}/dcc.xsd");
    parent(
        "dcc:digitalCalibrationCertificate",
        [administrative::data(document, certificate), results::results(document)],
    )
    .with("xmlns:dcc", "https://ptb.de/dcc")
    .with("xmlns:si", "https://ptb.de/si")
    .with("xmlns:xsi", "http://www.w3.org/2001/XMLSchema-instance")
    .with("xsi:schemaLocation", location)
    .with("schemaVersion", SCHEMA_VERSION)
}
