//! Requests that start a verification, recomputation or export, on the wire; a scan: `settings`.

use app::jobs::{ExportInput, ScanSource, VerifyInput};
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::formats::{CloudFormatDto, MeshFormatDto};
use crate::wire::scan::settings::StartScanDto;

/// Source of the frames of a scan.
#[derive(Debug, Clone, Serialize, Deserialize, ToSchema)]
#[serde(tag = "kind", rename_all = "snake_case", deny_unknown_fields)]
pub enum ScanSourceDto {
    /// The station itself.
    Station {},
    /// A scan of a capture.
    Capture {
        /// Id of the capture.
        capture_id: String,
        /// Name of the scan in the capture; default: the only one.
        scan: Option<String>,
    },
}

/// Request to recompute a scan.
#[derive(Debug, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct RecomputeDto {
    /// The calibration; default: the active one.
    pub calibration_id: Option<String>,
}

/// A reference part.
#[derive(Debug, Clone, Copy, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum ReferencePartDto {
    /// A gauge block; its nominal is its height.
    Gauge,
    /// A sphere; its nominal is its radius.
    Sphere,
}

/// Request to scan a reference part and compare it with its nominal value.
#[derive(Debug, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
#[schema(example = json!({ "reference_part": "sphere", "nominal_mm": 18.9, "scan": { "source": { "kind": "station" } } }))]
pub struct StartVerificationDto {
    /// Kind of the reference part.
    pub reference_part: ReferencePartDto,
    /// Nominal height or radius.
    #[schema(exclusive_minimum = 0.0)]
    pub nominal_mm: f64,
    /// Symmetric tolerance of the deviation.
    #[schema(exclusive_minimum = 0.0)]
    pub tolerance_mm: Option<f64>,
    /// The scan.
    pub scan: StartScanDto,
}

/// Request to write a scan in another format.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(tag = "what", rename_all = "snake_case", deny_unknown_fields)]
#[schema(example = json!({ "what": "mesh", "format": "stl" }))]
pub enum StartExportDto {
    /// The points.
    Cloud {
        /// Format of the file.
        format: CloudFormatDto,
    },
    /// The surface.
    Mesh {
        /// Format of the file.
        format: MeshFormatDto,
    },
}

impl From<ScanSourceDto> for ScanSource {
    fn from(dto: ScanSourceDto) -> Self {
        match dto {
            ScanSourceDto::Station {} => Self::Station,
            ScanSourceDto::Capture { capture_id, scan } => Self::Capture { capture_id, scan },
        }
    }
}

impl From<StartVerificationDto> for VerifyInput {
    fn from(dto: StartVerificationDto) -> Self {
        let reference_part = match dto.reference_part {
            ReferencePartDto::Gauge => "gauge",
            ReferencePartDto::Sphere => "sphere",
        };
        Self {
            reference_part: reference_part.to_owned(),
            nominal_mm: dto.nominal_mm,
            tolerance_mm: dto.tolerance_mm,
            scan: dto.scan.into(),
        }
    }
}

impl StartExportDto {
    /// The job's input.
    pub fn input(self, scan_id: String) -> ExportInput {
        let (what, format) = match self {
            Self::Cloud { format } => ("cloud", format.code()),
            Self::Mesh { format } => ("mesh", format.code()),
        };
        ExportInput { scan_id, what: what.to_owned(), format: format.to_owned() }
    }
}
