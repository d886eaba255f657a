//! Validation of a job's input before it is accepted, and the disk space it will need.

use optics::LightModelKind;

use crate::error::{AppError, ErrorKind};
use crate::jobs::JobParts;
use crate::jobs::input::{CalibrateInput, ExportInput, JobInput, RecomputeInput, ScanInput, Source};
use crate::jobs::inspect::scan_of;
use crate::jobs::plan::{Pace, ScanRun, plan};
use crate::jobs::queue::params::SCAN_BYTES;
use crate::jobs::verify;
use crate::resources::calibrations::stored::stored_document;
use crate::resources::measurements::check_measurements;
use crate::resources::recipes::stored_version;
use crate::resources::scan_run::{ScanSource, stage_kind};

/// Allowed number of board poses of the virtual operator: three determine a camera, more than sixty only cost time.
const N_POSES: std::ops::RangeInclusive<usize> = 3..=60;

/// Refuses invalid input; returns the disk space that the job will need, bytes.
pub(super) async fn check(input: &JobInput, parts: &JobParts) -> Result<u64, AppError> {
    let takes_pictures = input.needs_station();
    match input {
        JobInput::Calibration(input) => {
            check_calibration(input, parts).await?;
            Ok(if takes_pictures { calibration_bytes(input, parts) } else { 0 })
        }
        JobInput::Scan(input) => check_scan(input, parts).await,
        JobInput::Verification(input) => {
            let stage = stage_kind(&parts.station.status());
            check_scan(&verify::checked(input, stage)?, parts).await
        }
        JobInput::Recomputation(RecomputeInput { scan_id, .. })
        | JobInput::Export(ExportInput { scan_id, .. }) => {
            exists(parts.catalogue.read().scan(scan_id).await, "/scan_id")?;
            Ok(0)
        }
        JobInput::Inspection(input) => {
            let version = stored_version(&parts.catalogue, &input.recipe_id, input.recipe_version).await?;
            let scan = scan_of(&version.recipe.scan, input);
            check_scan(&scan, parts).await.map_err(|problem| match problem.kind {
                // The place is one of the recipe, not of the request.
                ErrorKind::Impossible if takes_pictures => problem.at("/recipe"),
                _ => problem,
            })
        }
        JobInput::ReEvaluation(input) => {
            exists(parts.catalogue.read().inspection(&input.inspection_id).await, "/inspection_id")?;
            if let Some(id) = &input.calibration_id {
                exists(parts.catalogue.read().calibration(id).await, "/calibration_id")?;
            }
            Ok(0)
        }
    }
}

async fn check_calibration(input: &CalibrateInput, parts: &JobParts) -> Result<(), AppError> {
    if let Some(model) = &input.light_model {
        let known = LightModelKind::ALL.iter().any(|kind| kind.name() == model) || model == "auto";
        check_code(known, "/light_model", model, "auto, planes, pencil or grating")?;
    }
    if let Some(k3) = &input.k3 {
        check_code(matches!(k3.as_str(), "auto" | "on" | "off"), "/k3", k3, "auto, on or off")?;
    }
    if let Some(n_poses) = input.n_poses.filter(|n_poses| !N_POSES.contains(n_poses)) {
        return Err(AppError::new(
            ErrorKind::Impossible,
            format!("a calibration with {n_poses} poses is not possible"),
        )
        .remedy(format!("give a number from {} to {}; 12 is usual", N_POSES.start(), N_POSES.end()))
        .at("/n_poses"));
    }
    if let Some(id) = &input.session_id {
        return exists(parts.catalogue.read().session(id).await, "/session_id").map(drop);
    }
    match &input.source {
        Source::Capture { capture_id } => {
            exists(parts.catalogue.read().capture(capture_id).await, "/source/capture_id").map(drop)
        }
        Source::Station if parts.station.status().simulated == Some("twin") => Ok(()),
        Source::Station => Err(AppError::new(
            ErrorKind::Impossible,
            "only the simulated station has a virtual operator to move the board",
        )
        .remedy("start a calibration session, capture the board in several poses, and solve it")
        .at("/source")),
    }
}

/// A scan from the station is planned before it is accepted; a resumed scan has been planned already.
async fn check_scan(input: &ScanInput, parts: &JobParts) -> Result<u64, AppError> {
    check_measurements(&input.measure)?;
    if !input.measure.is_empty() && input.resume_scan_id.is_some() {
        return Err(AppError::new(ErrorKind::Impossible, "a resumed scan has its own measurements")
            .remedy("omit it, or measure afterwards")
            .at("/measure"));
    }
    let read = parts.catalogue.read();
    match &input.source {
        ScanSource::Capture { capture_id, .. } => {
            exists(read.capture(capture_id).await, "/source/capture_id")?;
            Ok(SCAN_BYTES)
        }
        ScanSource::Station => match &input.resume_scan_id {
            Some(id) => {
                let earlier = exists(read.scan(id).await, "/resume_scan_id")?;
                Ok(ScanRun::of(&earlier).ok().and_then(|run| run.plan).map_or(SCAN_BYTES, |plan| plan.disk_bytes))
            }
            None => {
                let id = input.calibration_id.as_deref();
                if let Some(id) = id {
                    exists(read.calibration(id).await, "/calibration_id")?;
                }
                let document = stored_document(&parts.catalogue, &*parts.artifacts, id).await?;
                let pace = Pace::learned(&parts.catalogue, input.settings.mode()).await;
                Ok(plan(input, &document.calibration(), &parts.station.status(), &pace)?.disk_bytes)
            }
        },
    }
}

/// A record referred to by the input must exist; the request itself is valid, hence 422 and not 404.
fn exists<T>(found: Result<T, store::StoreError>, pointer: &str) -> Result<T, AppError> {
    match found {
        Ok(found) => Ok(found),
        Err(error @ store::StoreError::NotFound { .. }) => {
            Err(AppError::new(ErrorKind::Impossible, error.to_string()).remedy("use an existing id").at(pointer))
        }
        Err(error) => Err(error.into()),
    }
}

fn check_code(known: bool, pointer: &str, found: &str, allowed: &str) -> Result<(), AppError> {
    if known {
        return Ok(());
    }
    let shown: String = found.chars().take(40).collect();
    Err(AppError::new(ErrorKind::Impossible, format!("\"{shown}\" is not allowed here"))
        .remedy(format!("give {allowed}"))
        .at(pointer))
}

/// Images as files and once more in the archive.
fn calibration_bytes(input: &CalibrateInput, parts: &JobParts) -> u64 {
    let (width_px, height_px) = parts.station.status().camera.capabilities.sensor_px;
    let image_bytes = (width_px * height_px) as u64;
    4 * image_bytes * (input.n_poses.unwrap_or(super::calibrate::N_POSES) as u64 + 5)
}
