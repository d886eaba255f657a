//! The certificate of a stored calibration.

use report::certificate::{Certificate, Issuer, StationPart, calibration_certificate};
use store::{Artifacts, CalibrationRecord};
use time::{Date, OffsetDateTime};

use crate::error::{AppError, ErrorKind};
use crate::evented_catalogue::EventedCatalogue;
use crate::resources::calibrations::stored::stored_document;
use crate::resources::calibrations::used_station::{STATION, UsedDevice, UsedStation};

/// The certificate of the calibration `id` as a DCC of the PTB (XML), issued by `issuer` at `now_ms`.
///
/// The calibration began on the day on which its images were stored, if they are still there.
///
/// # Errors
/// The calibration does not exist or is damaged, or the issuer lacks something that a certificate states.
pub async fn stored_certificate(
    catalogue: &EventedCatalogue,
    artifacts: &dyn Artifacts,
    issuer: &Issuer,
    id: &str,
    now_ms: i64,
) -> Result<String, AppError> {
    let document = stored_document(catalogue, artifacts, Some(id)).await?;
    let record = catalogue.read().calibration(id).await?;
    let captured_ms = match &record.capture_id {
        Some(capture) => catalogue.read().capture(capture).await.ok().map(|capture| capture.created_at_ms),
        None => None,
    };
    let station = used_station(&record);
    let certificate = Certificate {
        issuer: issuer.clone(),
        begun: day(captured_ms.unwrap_or(record.created_at_ms).min(record.created_at_ms))?,
        ended: day(record.created_at_ms)?,
        issued: day(now_ms)?,
        simulated: station.as_ref().and_then(|station| station.simulated.clone()),
        parts: station.into_iter().flat_map(|station| station.devices).map(part).collect(),
    };
    Ok(calibration_certificate(&document, &certificate)?)
}

/// `None` for calibrations from captures, and of earlier versions.
fn used_station(record: &CalibrationRecord) -> Option<UsedStation> {
    serde_json::from_value(record.summary[STATION].clone()).ok()
}

fn part(UsedDevice { part, vendor, model, serial, firmware }: UsedDevice) -> StationPart {
    StationPart { part, vendor, model, serial, firmware }
}

/// The day in UTC.
fn day(at_ms: i64) -> Result<Date, AppError> {
    let at = OffsetDateTime::from_unix_timestamp_nanos(i128::from(at_ms) * 1_000_000);
    at.map(OffsetDateTime::date)
        .map_err(|cause| AppError::new(ErrorKind::Damaged, "a stored time is invalid").because(cause.to_string()))
}
