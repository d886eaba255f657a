//! Scans on the wire.

mod formats;
mod inputs;

use app::measurements::parts::Part;
use app::scan_run::ScanRun;
use serde::{Deserialize, Serialize};
use store::{DamagedRow, ScanState};
use utoipa::{IntoParams, ToSchema};

use crate::wire::measurement::measurements::{CharacteristicDto, VerdictDto};
use crate::wire::parse_stored;
use crate::wire::scan::scan_reports::ScanReportDto;
use crate::wire::scan::scan_runs::{ScanPurposeDto, ScanRunDto};

pub use formats::{CloudFormatDto, CloudQuery, MeshFormatDto, MeshQuery};
pub use inputs::{RecomputeDto, ReferencePartDto, ScanSourceDto, StartExportDto, StartVerificationDto};

/// State of a scan.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum ScanStateDto {
    /// All planned frames were captured.
    Complete,
    /// Stopped or interrupted; it can be resumed.
    Partial,
    /// Frames were lost: no verdict is possible.
    Invalid,
}

impl ScanStateDto {
    /// Its code.
    pub fn code(self) -> &'static str {
        match self {
            Self::Complete => "complete",
            Self::Partial => "partial",
            Self::Invalid => "invalid",
        }
    }
}

impl From<ScanState> for ScanStateDto {
    fn from(state: ScanState) -> Self {
        match state {
            ScanState::Complete => Self::Complete,
            ScanState::Partial => Self::Partial,
            ScanState::Invalid => Self::Invalid,
        }
    }
}

impl From<ScanStateDto> for ScanState {
    fn from(dto: ScanStateDto) -> Self {
        match dto {
            ScanStateDto::Complete => Self::Complete,
            ScanStateDto::Partial => Self::Partial,
            ScanStateDto::Invalid => Self::Invalid,
        }
    }
}

/// Selects scans.
#[derive(Debug, Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub struct ScansQuery {
    /// Only scans in this state.
    pub state: Option<ScanStateDto>,
    /// Only scans computed with this calibration.
    pub calibration_id: Option<String>,
    /// Only scans whose name contains this text; upper and lower case are the same.
    pub name: Option<String>,
    /// Only scans at or after this time, ms since 1970 (UTC).
    pub from_ms: Option<i64>,
    /// Only scans before this time, ms since 1970 (UTC).
    pub to_ms: Option<i64>,
    /// Only parts with this verdict.
    pub verdict: Option<VerdictDto>,
    /// Only parts with any verdict (`true`) or without (`false`).
    pub judged: Option<bool>,
    /// Only parts with a measurement (`true`) or without (`false`).
    pub measured: Option<bool>,
    /// Only scans with this purpose.
    pub purpose: Option<ScanPurposeDto>,
    /// Id of the last scan of the previous page.
    pub before: Option<String>,
    /// Scans per page, 1 to 200; default 50.
    #[param(minimum = 1, maximum = 200)]
    pub limit: Option<u32>,
}

/// Selects blocks.
#[derive(Debug, Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub struct PointsQuery {
    /// First block; default 0.
    pub from_block: Option<u32>,
}

/// A scan.
#[derive(Debug, Serialize, ToSchema)]
pub struct ScanDto {
    /// Its id.
    pub id: String,
    /// Its name.
    pub name: String,
    /// Its state.
    pub state: ScanStateDto,
    /// Verdict on the part: the worst of the current verdicts of its characteristics; absent if none has a tolerance.
    pub verdict: Option<VerdictDto>,
    /// The current measurement of each characteristic, newest first.
    pub characteristics: Vec<CharacteristicDto>,
    /// Purpose; verifications are not production parts.
    pub purpose: ScanPurposeDto,
    /// The calibration of the cloud.
    pub calibration_id: String,
    /// How it was made.
    pub plan: ScanRunDto,
    /// Report: points, rejected points by reason, self-consistency, depth range.
    pub report: ScanReportDto,
    /// The capture with its frames, if they were kept.
    pub capture_id: Option<String>,
    /// The scan it was recomputed from.
    pub recomputed_from: Option<String>,
    /// The job that created it.
    pub job_id: Option<String>,
    /// Version of the software that computed it.
    pub software_version: String,
    /// URL of the cloud; absent if no points could be computed.
    pub cloud: Option<String>,
    /// Time of creation, ms since 1970 (UTC).
    pub created_at_ms: i64,
}

/// URL of a scan.
pub fn scan_href(id: &str) -> String {
    format!("/api/v1/scans/{id}")
}

impl TryFrom<Part> for ScanDto {
    type Error = DamagedRow;

    fn try_from(part: Part) -> Result<Self, DamagedRow> {
        let record = part.scan;
        let run = ScanRun::of(&record).ok().and_then(|run| ScanRunDto::try_from(run).ok());
        let plan = run.ok_or_else(|| DamagedRow { kind: "scan", id: record.id.clone() })?;
        let report = parse_stored("scan", &record.id, record.report)?;
        Ok(Self {
            verdict: part.verdict.map(VerdictDto::from),
            characteristics: part.measured.iter().map(CharacteristicDto::from).collect(),
            purpose: plan.purpose,
            cloud: record.cloud.as_ref().map(|_| format!("{}/cloud", scan_href(&record.id))),
            state: record.state.into(),
            id: record.id,
            name: record.name,
            calibration_id: record.calibration_id,
            plan,
            report,
            capture_id: record.capture_id,
            recomputed_from: record.recomputed_from,
            job_id: record.job_id,
            software_version: record.software_version,
            created_at_ms: record.created_at_ms,
        })
    }
}
