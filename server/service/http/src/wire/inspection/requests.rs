//! Requests about inspections.

use std::collections::BTreeMap;

use app::inspections::InspectedPart;
use app::recipes::RecipeRef;
use serde::Deserialize;
use utoipa::{IntoParams, ToSchema};

use crate::problem::{Problem, ProblemKind};
use crate::wire::measurement::measurements::VerdictDto;
use crate::wire::scan::scans::ScanSourceDto;

/// Reference to a recipe: `bracket` (its newest version), `bracket@7`, or its number.
#[derive(Debug, Clone, Deserialize, ToSchema)]
#[serde(untagged)]
#[schema(example = "bracket@7")]
pub enum RecipeRefDto {
    /// Its number.
    Number(u32),
    /// Its id, alone or with a version.
    Id(String),
}

impl TryFrom<RecipeRefDto> for RecipeRef {
    type Error = Problem;

    fn try_from(dto: RecipeRefDto) -> Result<Self, Problem> {
        match dto {
            RecipeRefDto::Number(number) => Ok(Self::Number(number.into())),
            RecipeRefDto::Id(text) => Self::parse(&text).ok_or_else(|| {
                Problem::new(ProblemKind::Impossible, "this is not a reference to a recipe")
                    .at("/recipe")
                    .remedy("give an id, id@version, or the number of a recipe")
            }),
        }
    }
}

/// Request to inspect a part.
#[derive(Debug, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
#[schema(example = json!({ "recipe": "bracket", "serial": "BR-0042", "order": "4711" }))]
pub struct InspectDto {
    /// The recipe; default: the one whose `serial_pattern` matches the serial number.
    pub recipe: Option<RecipeRefDto>,
    /// Serial number of the part.
    #[schema(max_length = 100)]
    pub serial: String,
    /// The order it is made for.
    #[schema(max_length = 100)]
    pub order: Option<String>,
    /// Passed on unchanged to other systems.
    #[serde(default)]
    pub attributes: BTreeMap<String, String>,
    /// Source of the frames; default: the station. Of a capture, the `scan` settings of the recipe are not used, the station is
    /// not needed, and the result is marked as simulated.
    pub source: Option<ScanSourceDto>,
}

impl InspectDto {
    /// The part.
    pub fn part(self) -> InspectedPart {
        InspectedPart { serial: self.serial, order: self.order, attributes: self.attributes }
    }
}

/// Request to re-evaluate the scan of an inspection with another version of a recipe or another calibration.
#[derive(Debug, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
#[schema(example = json!({ "recipe": "bracket@8" }))]
pub struct ReEvaluateDto {
    /// The recipe; default: the newest version of the recipe of the inspection.
    pub recipe: Option<RecipeRefDto>,
    /// The calibration; default: that of the scan. With another one, the points are triangulated again from the centrelines
    /// that the scan keeps; the result refers to a new scan.
    pub calibration_id: Option<String>,
}

/// Request to hold the queue of inspections.
#[derive(Debug, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
#[schema(example = json!({ "reason": "the fixture is being changed" }))]
pub struct HoldDto {
    /// Why.
    #[schema(max_length = 100)]
    pub reason: Option<String>,
}

/// Whether the response waits for the result.
#[derive(Debug, Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub struct WaitQuery {
    /// Seconds to wait for the result, 0 to 30; default 0. The inspection continues after a timeout.
    #[param(minimum = 0, maximum = 30)]
    pub wait_s: Option<u32>,
}

/// Selects inspections.
#[derive(Debug, Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub struct InspectionsQuery {
    /// Only inspections of the part with this serial number.
    pub serial: Option<String>,
    /// Only inspections for this order.
    pub order: Option<String>,
    /// Only inspections with this recipe: `bracket`, or `bracket@7` for one version.
    pub recipe: Option<String>,
    /// Only inspections with this verdict.
    pub verdict: Option<VerdictDto>,
    /// Only inspections at or after this time, ms since 1970 (UTC).
    pub from_ms: Option<i64>,
    /// Only inspections before this time, ms since 1970 (UTC).
    pub to_ms: Option<i64>,
    /// Only inspections after this number, oldest first: for clients that must not miss any.
    pub after_seq: Option<i64>,
    /// Id of the last inspection of the previous page.
    pub before: Option<String>,
    /// Inspections per page, 1 to 200; default 50.
    #[param(minimum = 1, maximum = 200)]
    pub limit: Option<u32>,
}

/// Selects inspections to export.
#[derive(Debug, Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub struct ExportQuery {
    /// Format of the file; default `csv`.
    #[param(inline)]
    pub format: Option<ExportFormatDto>,
    /// Only inspections of the part with this serial number.
    pub serial: Option<String>,
    /// Only inspections for this order.
    pub order: Option<String>,
    /// Only inspections with this recipe: `bracket`, or `bracket@7` for one version.
    pub recipe: Option<String>,
    /// Only inspections with this verdict.
    pub verdict: Option<VerdictDto>,
    /// Only inspections at or after this time, ms since 1970 (UTC).
    pub from_ms: Option<i64>,
    /// Only inspections before this time, ms since 1970 (UTC).
    pub to_ms: Option<i64>,
}

/// Format of an export.
#[derive(Debug, Clone, Copy, Default, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum ExportFormatDto {
    /// A table with one row per characteristic, the same as of a `folder` door.
    #[default]
    Csv,
    /// Q-DAS ASCII transfer format: each part with its characteristics and values. Inspections with the same version of a
    /// recipe, and the same K fields among their attributes, are values of the same part; a damaged inspection is left
    /// out.
    Dfq,
}

/// Selects the form of the report of an inspection.
#[derive(Debug, Default, Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub struct InspectionReportQuery {
    /// Form of the report; default `html`.
    #[param(inline)]
    pub format: Option<InspectionReportFormatDto>,
}

/// Form of the report of an inspection.
#[derive(Debug, Clone, Copy, Default, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum InspectionReportFormatDto {
    /// A page without scripts.
    #[default]
    Html,
    /// An A4 document.
    Pdf,
    /// Q-DAS ASCII transfer format, as of a `folder` door.
    Dfq,
}

/// Selects the form of the report of a study.
#[derive(Debug, Default, Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub struct ReportQuery {
    /// Form of the report; default `html`.
    #[param(inline)]
    pub format: Option<ReportFormatDto>,
}

/// Form of a report.
#[derive(Debug, Clone, Copy, Default, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum ReportFormatDto {
    /// A page without scripts.
    #[default]
    Html,
    /// An A4 document.
    Pdf,
}
