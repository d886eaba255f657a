//! Calibrations on the wire.

use serde::{Deserialize, Serialize};
use store::{ActivationRecord, CalibrationRecord, DamagedRow};
use utoipa::{IntoParams, ToSchema};

use crate::wire::calibration::calibration_documents::CalibrationDocumentDto;
use crate::wire::calibration::calibration_summaries::CalibrationSummaryDto;
use crate::wire::parse_stored;
use app::jobs::{CalibrateInput, Source};

/// Source of the images.
#[derive(Debug, Clone, Serialize, Deserialize, ToSchema)]
#[serde(tag = "kind", rename_all = "snake_case", deny_unknown_fields)]
pub enum CalibrationSourceDto {
    /// The station itself.
    Station {},
    /// A capture.
    Capture {
        /// Id of the capture.
        capture_id: String,
    },
}

/// Model of the light sheets.
#[derive(Debug, Clone, Copy, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum LightModelDto {
    /// The one recommended by cross-validation.
    Auto,
    /// One free plane per order.
    Planes,
    /// A pencil of planes through one line, at the angles of the grating equation.
    Pencil,
    /// The exact curved sheets of the vector grating equation.
    Grating,
}

/// Whether the sixth-power radial distortion k3 is estimated.
#[derive(Debug, Clone, Copy, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum K3Dto {
    /// Only if it is significantly different from zero.
    Auto,
    /// Always.
    On,
    /// Never.
    Off,
}

impl LightModelDto {
    /// Its code.
    pub fn code(self) -> &'static str {
        match self {
            Self::Auto => "auto",
            Self::Planes => "planes",
            Self::Pencil => "pencil",
            Self::Grating => "grating",
        }
    }
}

impl K3Dto {
    /// Its code.
    pub fn code(self) -> &'static str {
        match self {
            Self::Auto => "auto",
            Self::On => "on",
            Self::Off => "off",
        }
    }
}

/// Request to calibrate camera, light sheets and stage.
#[derive(Debug, Clone, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
#[schema(example = json!({ "source": { "kind": "station" } }))]
pub struct StartCalibrationDto {
    /// Source of the images; on the simulated station a virtual operator moves the board.
    pub source: CalibrationSourceDto,
    /// Model of the light sheets; default `auto`.
    pub light_model: Option<LightModelDto>,
    /// Whether k3 is estimated; default `auto`.
    pub k3: Option<K3Dto>,
    /// Ignore images without a readable board or line, even if most are unreadable.
    #[serde(default)]
    pub leave_out_unreadable: bool,
    /// Number of board poses to capture at the station; default 12.
    #[schema(minimum = 3, maximum = 100)]
    pub n_poses: Option<usize>,
}

/// A calibration in a list.
#[derive(Debug, Serialize, ToSchema)]
pub struct CalibrationItemDto {
    /// Id: a hash of the content.
    pub id: String,
    /// Whether it is the active calibration.
    pub active: bool,
    /// Summary: residuals, light model, poses, working depth.
    pub summary: CalibrationSummaryDto,
    /// The capture it was computed from.
    pub capture_id: Option<String>,
    /// The job that computed it.
    pub job_id: Option<String>,
    /// URL of its report, if it has one.
    pub report: Option<String>,
    /// Time of creation, ms since 1970 (UTC).
    pub created_at_ms: i64,
}

/// A calibration with its document.
#[derive(Debug, Serialize, ToSchema)]
pub struct CalibrationDto {
    /// The fields of list entries.
    #[serde(flatten)]
    pub item: CalibrationItemDto,
    /// The document.
    pub calibration: CalibrationDocumentDto,
}

/// The active calibration.
#[derive(Debug, Serialize, ToSchema)]
pub struct ActiveCalibrationDto {
    /// Id of the active calibration; absent if none is active.
    pub calibration_id: Option<String>,
    /// The calibration that was active before.
    pub previous_id: Option<String>,
    /// Who activated it.
    pub actor: Option<String>,
    /// Time of the activation, ms since 1970 (UTC).
    pub at_ms: Option<i64>,
}

/// Request to activate a calibration.
#[derive(Debug, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct ActivateCalibrationDto {
    /// Id of the calibration.
    pub calibration_id: String,
    /// Activate even if its latest verification is not `ok`; otherwise refused with 409. Logged.
    #[serde(default)]
    pub despite_verification: bool,
}

/// An entry of the activation log.
#[derive(Debug, Serialize, ToSchema)]
pub struct ActivationDto {
    /// Position in the log.
    pub seq: i64,
    /// The calibration active since then; absent: none.
    pub calibration_id: Option<String>,
    /// The calibration active before.
    pub previous_id: Option<String>,
    /// `activate` or `roll_back`.
    pub action: String,
    /// Who activated or rolled back.
    pub actor: String,
    /// Time of the activation, ms since 1970 (UTC).
    pub at_ms: i64,
}

/// URL of a calibration.
pub fn calibration_href(id: &str) -> String {
    format!("/api/v1/calibrations/{id}")
}

impl CalibrationItemDto {
    /// The list entry of a record; `active`: whether it is the active one.
    ///
    /// # Errors
    /// If the stored summary was written by an incompatible version.
    pub fn new(record: CalibrationRecord, active: Option<&str>) -> Result<Self, DamagedRow> {
        let summary = parse_stored("calibration", &record.id, record.summary)?;
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

impl From<Option<ActivationRecord>> for ActiveCalibrationDto {
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
        Self { seq, calibration_id, previous_id, action: act, actor, at_ms }
    }
}

impl From<CalibrationSourceDto> for Source {
    fn from(dto: CalibrationSourceDto) -> Self {
        match dto {
            CalibrationSourceDto::Station {} => Self::Station,
            CalibrationSourceDto::Capture { capture_id } => Self::Capture { capture_id },
        }
    }
}

/// Selects the form of the report of a calibration.
#[derive(Debug, Default, Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub struct CalibrationReportQuery {
    /// Form of the report; default `html`.
    #[param(inline)]
    pub format: Option<CalibrationReportFormatDto>,
}

/// Form of the report of a calibration.
#[derive(Debug, Clone, Copy, Default, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum CalibrationReportFormatDto {
    /// A page without scripts.
    #[default]
    Html,
    /// A Digital Calibration Certificate of the PTB (schema 3.3.0), issued today.
    Dcc,
}

impl From<StartCalibrationDto> for CalibrateInput {
    fn from(dto: StartCalibrationDto) -> Self {
        Self {
            source: dto.source.into(),
            light_model: dto.light_model.map(|model| model.code().to_owned()),
            k3: dto.k3.map(|k3| k3.code().to_owned()),
            leave_out_unreadable: dto.leave_out_unreadable,
            n_poses: dto.n_poses,
            session_id: None,
            station: None,
        }
    }
}
