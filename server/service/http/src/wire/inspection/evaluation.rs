//! A plan tried on a scan, on the wire.

use app::use_cases::Evaluation;
use serde::{Deserialize, Serialize};
use store::DamagedRow;
use utoipa::ToSchema;

use crate::wire::inspection::results::{
    CharacteristicResultDto, PlanFeatureDto, PlanFrameDto, PlanResultDto, PoseDto,
};
use crate::wire::measurement::measurements::VerdictDto;
use crate::wire::parse_stored;
use crate::wire::recipe::plan_document::PlanDto;

/// Request to evaluate a plan on a scan.
#[derive(Debug, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct EvaluatePlanDto {
    /// The plan: features, alignment, characteristics with nominal values and limits.
    pub plan: PlanDto,
}

/// Request for the deviations of a scan from a CAD model.
#[derive(Debug, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct DeviationsRequestDto {
    /// The plan.
    pub plan: PlanDto,
    /// Id of one of its characteristics, a surface profile.
    pub characteristic: String,
    /// At most about this many points, evenly thinned; 300,000 if absent.
    #[schema(minimum = 1, maximum = 5_000_000)]
    pub limit: Option<u32>,
}

/// What an inspection with the plan would say about the scanned part. It is not stored.
#[derive(Debug, Serialize, ToSchema)]
pub struct EvaluationDto {
    /// The verdict on the part: the worst of its characteristics; `invalid` if none has a verdict.
    pub verdict: VerdictDto,
    /// The characteristics, in the order of the plan.
    pub results: Vec<CharacteristicResultDto>,
    /// The frame of all geometry.
    pub frame: PlanFrameDto,
    /// The datum frame, if there is one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub datum_from_part: Option<PoseDto>,
    /// Why there is no datum frame.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub alignment_failure: Option<String>,
    /// The features, in the order of the plan.
    pub features: Vec<PlanFeatureDto>,
    /// The scan.
    pub scan_id: String,
    /// The calibration of its cloud.
    pub calibration_id: String,
}

impl TryFrom<Evaluation> for EvaluationDto {
    type Error = DamagedRow;

    fn try_from(Evaluation { scan, verdict, result }: Evaluation) -> Result<Self, DamagedRow> {
        let result: PlanResultDto = parse_stored("evaluation", &scan.id, result)?;
        Ok(Self {
            verdict: verdict.into(),
            results: result.characteristics,
            frame: result.frame,
            datum_from_part: result.datum_from_part,
            alignment_failure: result.alignment_failure,
            features: result.features,
            scan_id: scan.id,
            calibration_id: scan.calibration_id,
        })
    }
}
