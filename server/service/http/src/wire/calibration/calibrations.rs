//! Calibrations on the wire.

use serde::{Deserialize, Serialize};
use store::{ActivationRecord, CalibrationRecord, DamagedRow};
use utoipa::ToSchema;

use crate::wire::calibration::calibration_documents::CalibrationDocumentDto;
use crate::wire::calibration::calibration_summaries::CalibrationSummaryDto;
use crate::wire::figures;
use app::jobs::{CalibrateInput, Source};

/// Where pictures come from.
#[derive(Debug, Clone, Serialize, Deserialize, ToSchema)]
#[serde(tag = "kind", rename_all = "snake_case", deny_unknown_fields)]
pub enum SourceDto {
    /// The station itself.
    Station {},
    /// A capture.
    Capture {
        /// Which.
        capture_id: String,
    },
}

/// Model of the light sheets.
#[derive(Debug, Clone, Copy, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum LightModelDto {
    /// The one that cross-validation recommends.
    Auto,
    /// One free plane per order.
    Planes,
    /// Planes through one line at the angles of the grating equation.
    Pencil,
    /// The exact curved sheets of the vector grating equation.
    Grating,
}

/// Whether the sixth-power distortion is estimated.
#[derive(Debug, Clone, Copy, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum K3Dto {
    /// Only if the pictures distinguish it from zero.
    Auto,
    /// Always.
    On,
    /// Never.
    Off,
}

/// Calibrate camera, light and stage.
#[derive(Debug, Clone, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
#[schema(example = json!({ "source": { "kind": "station" } }))]
pub struct StartCalibrationDto {
    /// Where pictures come from; on the simulated station a virtual operator moves the board.
    pub source: SourceDto,
    /// Model of the light sheets; `auto` if not said.
    pub light_model: Option<LightModelDto>,
    /// `auto` if not said.
    pub k3: Option<K3Dto>,
    /// Go on without pictures that show no board or no line even if they are the most.
    #[serde(default)]
    pub leave_out_unreadable: bool,
    /// Board poses to take at the station; 12 if not said.
    #[schema(minimum = 3, maximum = 100)]
    pub n_poses: Option<usize>,
}

/// A calibration in a list.
#[derive(Debug, Serialize, ToSchema)]
pub struct CalibrationItemDto {
    /// Its id: a hash of its content.
    pub id: String,
    /// Whether scans use it now.
    pub active: bool,
    /// Figures: residuals by model, chosen model, poses, working volume.
    pub summary: CalibrationSummaryDto,
    /// The pictures it was made from.
    pub capture_id: Option<String>,
    /// The job that made it.
    pub job_id: Option<String>,
    /// Address of its report, if there is one.
    pub report: Option<String>,
    /// When it was made, wall clock, ms since 1970.
    pub created_at_ms: i64,
}

/// A calibration with its document.
#[derive(Debug, Serialize, ToSchema)]
pub struct CalibrationDto {
    /// As in lists.
    #[serde(flatten)]
    pub item: CalibrationItemDto,
    /// Its document.
    pub calibration: CalibrationDocumentDto,
}

/// Which calibration is active.
#[derive(Debug, Serialize, ToSchema)]
pub struct ActiveDto {
    /// Its id; missing: none is.
    pub calibration_id: Option<String>,
    /// What was active before.
    pub previous_id: Option<String>,
    /// Who activated it.
    pub actor: Option<String>,
    /// When, wall clock, ms since 1970.
    pub at_ms: Option<i64>,
}

/// Which calibration shall be active.
#[derive(Debug, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct ActivateDto {
    /// Its id.
    pub calibration_id: String,
    /// Activate although its newest verification is not `ok`; without this it is refused with 409. The log says so.
    #[serde(default)]
    pub despite_verification: bool,
}

/// An entry of the log of activations.
#[derive(Debug, Serialize, ToSchema)]
pub struct ActivationDto {
    /// Position in the log.
    pub seq: i64,
    /// Active from here on; missing: none.
    pub calibration_id: Option<String>,
    /// Active before.
    pub previous_id: Option<String>,
    /// `activate` or `roll_back`.
    pub act: String,
    /// Who did it.
    pub actor: String,
    /// When, wall clock, ms since 1970.
    pub at_ms: i64,
}

/// Address of a calibration.
pub fn calibration_href(id: &str) -> String {
    format!("/api/v1/calibrations/{id}")
}

impl CalibrationItemDto {
    /// The record, and whether it is the active one.
    ///
    /// # Errors
    /// If its figures are none of this version's.
    pub fn new(record: CalibrationRecord, active: Option<&str>) -> Result<Self, DamagedRow> {
        let summary = figures("calibration", &record.id, record.summary)?;
        Ok(Self {
            active: active == Some(record.id.as_str()),
            report: record.report.as_ref().map(|_| format!("{}/report", calibration_href(&record.id))),
            id: record.id,
            summary,
            capture_id: record.capture_id,
            job_id: record.job_id,
            created_at_ms: record.created_at_ms,
        })
    }
}

impl From<Option<ActivationRecord>> for ActiveDto {
    fn from(record: Option<ActivationRecord>) -> Self {
        match record {
            Some(record) => Self {
                calibration_id: record.calibration_id,
                previous_id: record.previous_id,
                actor: Some(record.actor),
                at_ms: Some(record.at_ms),
            },
            None => Self { calibration_id: None, previous_id: None, actor: None, at_ms: None },
        }
    }
}

impl From<ActivationRecord> for ActivationDto {
    fn from(record: ActivationRecord) -> Self {
        let ActivationRecord { seq, calibration_id, previous_id, act, actor, at_ms } = record;
        Self { seq, calibration_id, previous_id, act, actor, at_ms }
    }
}

impl From<SourceDto> for Source {
    fn from(dto: SourceDto) -> Self {
        match dto {
            SourceDto::Station {} => Self::Station,
            SourceDto::Capture { capture_id } => Self::Capture { capture_id },
        }
    }
}

impl From<StartCalibrationDto> for CalibrateInput {
    fn from(dto: StartCalibrationDto) -> Self {
        let light_model = dto.light_model.map(|model| match model {
            LightModelDto::Auto => "auto",
            LightModelDto::Planes => "planes",
            LightModelDto::Pencil => "pencil",
            LightModelDto::Grating => "grating",
        });
        let k3 = dto.k3.map(|k3| match k3 {
            K3Dto::Auto => "auto",
            K3Dto::On => "on",
            K3Dto::Off => "off",
        });
        Self {
            source: dto.source.into(),
            light_model: light_model.map(str::to_owned),
            k3: k3.map(str::to_owned),
            leave_out_unreadable: dto.leave_out_unreadable,
            n_poses: dto.n_poses,
            session_id: None,
        }
    }
}
