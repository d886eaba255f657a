//! Scans on the wire.

mod formats;
mod inputs;

use app::measurements::parts::Part;
use app::scan_run::ScanRun;
use serde::{Deserialize, Serialize};
use store::{DamagedRow, ScanState};
use utoipa::{IntoParams, ToSchema};

use crate::wire::figures;
use crate::wire::measurement::measurements::{CharacteristicDto, VerdictDto};
use crate::wire::scan::scan_reports::ScanReportDto;
use crate::wire::scan::scan_runs::{ScanPurposeDto, ScanRunDto};

pub use formats::{CloudFormatDto, CloudQuery, MeshFormatDto, MeshQuery};
pub use inputs::{
    ArtefactDto, BackgroundDto, ExportWhatDto, RecomputeDto, ScanModeDto, ScanSourceDto, StartExportDto,
    StartScanDto, StartVerificationDto,
};

/// What a scan is worth.
#[derive(Debug, Clone, Copy, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum ScanStateDto {
    /// Every planned frame is in it.
    Complete,
    /// It was stopped or interrupted.
    Partial,
    /// Frames were lost.
    Invalid,
}

impl ScanStateDto {
    /// The word for it.
    pub fn word(self) -> &'static str {
        match self {
            Self::Complete => "complete",
            Self::Partial => "partial",
            Self::Invalid => "invalid",
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

/// Which scans.
#[derive(Debug, Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub struct ScansQuery {
    /// Only those worth that much.
    pub state: Option<ScanStateDto>,
    /// Only those computed with this calibration.
    pub calibration_id: Option<String>,
    /// Only parts with this verdict.
    pub verdict: Option<VerdictDto>,
    /// Only those made for this.
    pub purpose: Option<ScanPurposeDto>,
    /// Id of the last scan of the page before.
    pub before: Option<String>,
    /// Scans of a page, 1 to 200; 50 if not said.
    #[param(minimum = 1, maximum = 200)]
    pub limit: Option<u32>,
}

/// Which blocks.
#[derive(Debug, Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub struct PointsQuery {
    /// The first block wanted; 0 if not said.
    pub from_block: Option<u32>,
}

/// A scan.
#[derive(Debug, Serialize, ToSchema)]
pub struct ScanDto {
    /// Its id.
    pub id: String,
    /// What a person calls it.
    pub name: String,
    /// `complete`, `partial` (can be resumed), `invalid` (frames were lost: never the base of a verdict).
    #[schema(example = "complete")]
    pub state: &'static str,
    /// The verdict on the part: of every characteristic the newest, of these the worst; missing if none was asked for.
    pub verdict: Option<VerdictDto>,
    /// The measurement that stands for each characteristic, newest first.
    pub characteristics: Vec<CharacteristicDto>,
    /// What it was made for; a verification is no part of the production.
    pub purpose: ScanPurposeDto,
    /// The calibration of the cloud.
    pub calibration_id: String,
    /// How it was made.
    pub plan: ScanRunDto,
    /// Figures: points, dropped by reason, self-consistency, envelope.
    pub report: ScanReportDto,
    /// Its frames, if they were kept.
    pub capture_id: Option<String>,
    /// The scan it was computed from again.
    pub recomputed_from: Option<String>,
    /// The job that made it.
    pub job_id: Option<String>,
    /// Version of the software that computed it.
    pub software_version: String,
    /// Address of the cloud; missing if no point could be computed.
    pub cloud: Option<String>,
    /// When it was made, wall clock, ms since 1970.
    pub created_at_ms: i64,
}

/// Address of a scan.
pub fn scan_href(id: &str) -> String {
    format!("/api/v1/scans/{id}")
}

impl TryFrom<Part> for ScanDto {
    type Error = DamagedRow;

    fn try_from(part: Part) -> Result<Self, DamagedRow> {
        let record = part.scan;
        let run = ScanRun::of(&record).ok().and_then(|run| ScanRunDto::try_from(run).ok());
        let plan = run.ok_or_else(|| DamagedRow { kind: "scan", id: record.id.clone() })?;
        let report = figures("scan", &record.id, record.report)?;
        Ok(Self {
            verdict: part.verdict.map(VerdictDto::from),
            characteristics: part.measured.iter().map(CharacteristicDto::from).collect(),
            purpose: plan.purpose,
            cloud: record.cloud.as_ref().map(|_| format!("{}/cloud", scan_href(&record.id))),
            state: match record.state {
                ScanState::Complete => "complete",
                ScanState::Partial => "partial",
                ScanState::Invalid => "invalid",
            },
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
