//! Inspections, and their queue, on the wire.

use std::collections::BTreeMap;

use app::events::ViolatedRule;
use app::inspections::{InspectionBody, VerdictChange};
use app::use_cases::InspectionQueue;
use metrology::PartVerdict;
use serde::Serialize;
use store::{DamagedRow, InspectionRecord};
use utoipa::ToSchema;

use crate::wire::inspection::results::{
    CharacteristicResultDto, PlanFeatureDto, PlanFrameDto, PlanResultDto, PoseDto,
};
use crate::wire::measurement::measurements::VerdictDto;
use crate::wire::parse_stored;
use crate::wire::recipe::recipes::version_href;
use crate::wire::scan::scans::scan_href;

/// The version of a recipe used for an inspection.
#[derive(Debug, Serialize, ToSchema)]
pub struct InspectedByDto {
    /// Id of the recipe.
    pub id: String,
    /// Its version.
    pub version: i64,
    /// Digest of the version.
    pub digest: String,
    /// The recipe's number in that version.
    pub number: Option<u32>,
    /// URL of the version.
    pub href: String,
}

/// A verdict that differs from that of an earlier inspection.
#[derive(Debug, Serialize, ToSchema)]
pub struct VerdictChangeDto {
    /// Id of the characteristic.
    pub id: String,
    /// Earlier verdict; absent if there was none.
    pub before: Option<VerdictDto>,
    /// New verdict; absent if there is none.
    pub after: Option<VerdictDto>,
}

/// An inspection of a part; it never changes.
#[derive(Debug, Serialize, ToSchema)]
pub struct InspectionDto {
    /// Its id.
    pub id: String,
    /// Position among all inspections, from 1 without gaps.
    pub seq: i64,
    /// Serial number of the part.
    pub serial: String,
    /// The order it was made for.
    pub order: Option<String>,
    /// The recipe used.
    pub recipe: InspectedByDto,
    /// The verdict on the part: the worst of its characteristics; `invalid` if none has a verdict. Accept only `ok`.
    pub verdict: VerdictDto,
    /// The characteristics, in the order of the plan.
    pub results: Vec<CharacteristicResultDto>,
    /// The frame of all geometry.
    pub frame: PlanFrameDto,
    /// The datum frame, if there is one; only in a single inspection.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub datum_from_part: Option<PoseDto>,
    /// Why there is no datum frame.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub alignment_failure: Option<String>,
    /// The features; only in a single inspection.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub features: Option<Vec<PlanFeatureDto>>,
    /// The scan; absent if it was deleted.
    pub scan_id: Option<String>,
    /// URL of the scan.
    pub scan_href: Option<String>,
    /// URL of its cloud.
    pub cloud_href: Option<String>,
    /// The calibration of the cloud.
    pub calibration_id: String,
    /// Whether the devices were simulated, or a recording: no verdict on a real part.
    pub simulated: bool,
    /// The inspection that this one re-evaluates.
    pub re_evaluated_from: Option<String>,
    /// The verdicts that differ from that inspection.
    pub changed: Vec<VerdictChangeDto>,
    /// Run rules that it was the first to violate; each is also an event.
    pub violated_rules: Vec<ViolatedRule>,
    /// Attributes of the part.
    pub attributes: BTreeMap<String, String>,
    /// The job that made it.
    pub job_id: Option<String>,
    /// Time of the verdict, ms since 1970 (UTC).
    pub created_at_ms: i64,
}

impl InspectionDto {
    /// Without features, for lists.
    ///
    /// # Errors
    /// The record was stored by another version and cannot be read.
    pub fn in_list(record: InspectionRecord) -> Result<Self, DamagedRow> {
        let whole = Self::try_from(record)?;
        Ok(Self { features: None, datum_from_part: None, ..whole })
    }
}

impl TryFrom<InspectionRecord> for InspectionDto {
    type Error = DamagedRow;

    fn try_from(record: InspectionRecord) -> Result<Self, DamagedRow> {
        let InspectionRecord { id, recipe_id, recipe_version, scan_id, .. } = record;
        let damaged = || DamagedRow { kind: "inspection", id: id.clone() };
        let body: InspectionBody = parse_stored("inspection", &id, record.body)?;
        let result: PlanResultDto = parse_stored("inspection", &id, body.result)?;
        let verdict = PartVerdict::from_name(&record.verdict).ok_or_else(damaged)?;
        let scan_href = scan_id.as_deref().map(scan_href);
        Ok(Self {
            seq: record.seq,
            serial: record.serial,
            order: record.order_number,
            recipe: InspectedByDto {
                href: version_href(&recipe_id, recipe_version),
                id: recipe_id,
                version: recipe_version,
                digest: body.recipe_digest,
                number: body.recipe_number,
            },
            verdict: verdict.into(),
            results: result.characteristics,
            frame: result.frame,
            datum_from_part: result.datum_from_part,
            alignment_failure: result.alignment_failure,
            features: Some(result.features),
            scan_id,
            cloud_href: scan_href.as_ref().map(|href| format!("{href}/cloud")),
            scan_href,
            calibration_id: body.calibration_id,
            simulated: body.simulated,
            re_evaluated_from: record.re_evaluated_from,
            changed: body.changed.into_iter().map(VerdictChangeDto::from).collect(),
            violated_rules: body.violated_rules,
            attributes: body.attributes,
            job_id: record.job_id,
            created_at_ms: record.created_at_ms,
            id,
        })
    }
}

impl From<VerdictChange> for VerdictChangeDto {
    fn from(change: VerdictChange) -> Self {
        let verdict =
            |word: Option<String>| word.and_then(|word| PartVerdict::from_name(&word)).map(VerdictDto::from);
        Self { id: change.id, before: verdict(change.before), after: verdict(change.after) }
    }
}

/// The inspection queue.
#[derive(Debug, Serialize, ToSchema)]
pub struct InspectionQueueDto {
    /// Whether the queue is held: no further inspection starts.
    pub held: bool,
    /// Who held it.
    pub held_by: Option<String>,
    /// Why.
    pub reason: Option<String>,
    /// Since when, ms since 1970 (UTC).
    pub since_ms: Option<i64>,
    /// Number of waiting inspections.
    pub n_waiting: usize,
    /// The job of the running inspection.
    pub running_job_id: Option<String>,
}

impl From<InspectionQueue> for InspectionQueueDto {
    fn from(queue: InspectionQueue) -> Self {
        let InspectionQueue { hold, n_waiting, running_job_id } = queue;
        let since_ms = hold.as_ref().map(|hold| hold.since_ms);
        let (held_by, reason) = hold.map(|hold| (hold.actor, hold.reason)).unzip();
        Self { held: held_by.is_some(), held_by, reason: reason.flatten(), since_ms, n_waiting, running_job_id }
    }
}
