//! Studies on the wire.

use app::studies::{Found, MissingInspections, Outcome, Selected, Study, StudyPlan};
use serde::Serialize;
use store::{DamagedRow, StudyRecord};
use utoipa::ToSchema;

use crate::wire::measurement::measurements::VerdictDto;
use crate::wire::statistics::{GaugeRrDto, ReadingDto, Type1StudyDto};
use crate::wire::study::acceptance::{AcceptanceFiguresDto, MissingPositionsDto, PositionDto};
use crate::wire::study::requests::StudyPlanDto;

/// URL of a study.
pub fn study_href(id: &str) -> String {
    format!("/api/v1/studies/{id}")
}

/// Kind of a study.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum StudyKindDto {
    /// An acceptance test.
    Acceptance,
    /// A type-1 study.
    #[serde(rename = "type_1")]
    Type1,
    /// A gauge R&R study.
    GaugeRr,
}

/// A study in a list.
#[derive(Debug, Serialize, ToSchema)]
pub struct StudyItemDto {
    /// Its id.
    pub id: String,
    /// Its name.
    pub name: String,
    /// Its kind.
    pub kind: StudyKindDto,
    /// Who created it.
    pub author: String,
    /// When, ms since 1970 (UTC).
    pub created_at_ms: i64,
    /// When it was last changed, ms since 1970 (UTC).
    pub changed_at_ms: i64,
}

impl StudyItemDto {
    /// From a record.
    pub fn in_list(record: StudyRecord) -> Result<Self, DamagedRow> {
        let id = record.id.clone();
        let study = Study::of(record).map_err(|_| DamagedRow { kind: "study", id })?;
        let kind = match study.body.plan {
            StudyPlan::Acceptance(_) => StudyKindDto::Acceptance,
            StudyPlan::Type1(_) => StudyKindDto::Type1,
            StudyPlan::GaugeRr(_) => StudyKindDto::GaugeRr,
        };
        Ok(Self {
            id: study.id,
            name: study.body.name,
            kind,
            author: study.body.author,
            created_at_ms: study.created_at_ms,
            changed_at_ms: study.changed_at_ms,
        })
    }
}

/// Inspections that are still missing of a part.
#[derive(Debug, Serialize, ToSchema)]
pub struct MissingInspectionsDto {
    /// Serial number of the part.
    pub serial: String,
    /// The attribute `operator` of the inspections; absent: anyone.
    pub operator: Option<String>,
    /// Inspections present.
    pub n_present: usize,
    /// Inspections needed.
    pub n_needed: usize,
}

/// A study with its outcome so far.
#[derive(Debug, Serialize, ToSchema)]
pub struct StudyDto {
    /// Its id.
    pub id: String,
    /// Its name.
    pub name: String,
    /// Who created it.
    pub author: String,
    /// When, ms since 1970 (UTC). Inspections from then on belong to a study of inspections.
    pub created_at_ms: i64,
    /// When it was last changed, ms since 1970 (UTC).
    pub changed_at_ms: i64,
    /// What it examines.
    pub plan: StudyPlanDto,
    /// The verdict on the station; absent while something is missing. Without real devices it is no verdict on a real
    /// station.
    pub verdict: Option<VerdictDto>,
    /// Positions that are still missing.
    pub missing_positions: Vec<MissingPositionsDto>,
    /// Inspections that are still missing.
    pub missing_inspections: Vec<MissingInspectionsDto>,
    /// The positions of an acceptance test, in the order in which they were added.
    pub positions: Vec<PositionDto>,
    /// The inspections that belong to the study, oldest first.
    pub readings: Vec<ReadingDto>,
    /// Figures of an acceptance test.
    pub acceptance: Option<AcceptanceFiguresDto>,
    /// Figures of a type-1 study that is complete.
    pub type_1: Option<Type1StudyDto>,
    /// Figures of a gauge R&R study that is complete.
    pub gauge_rr: Option<GaugeRrDto>,
    /// Why a complete study has no figures.
    pub reason: Option<String>,
}

impl StudyDto {
    /// A study with its outcome.
    pub fn new(study: Study, outcome: Outcome) -> Self {
        let missing_positions =
            outcome.missing_positions().iter().copied().map(MissingPositionsDto::from).collect();
        let missing = |missing: &MissingInspections| MissingInspectionsDto {
            serial: missing.serial.clone(),
            operator: missing.operator.clone(),
            n_present: missing.n_present,
            n_needed: missing.n_needed,
        };
        let missing_inspections = outcome.missing_inspections().iter().map(missing).collect();
        let dto = Self {
            id: study.id,
            name: study.body.name,
            author: study.body.author,
            created_at_ms: study.created_at_ms,
            changed_at_ms: study.changed_at_ms,
            plan: study.body.plan.into(),
            verdict: outcome.verdict.map(VerdictDto::from),
            missing_positions,
            missing_inspections,
            positions: study.body.positions.into_iter().map(PositionDto::from).collect(),
            readings: Vec::new(),
            acceptance: None,
            type_1: None,
            gauge_rr: None,
            reason: None,
        };
        match outcome.found {
            Found::Acceptance(result) => Self { acceptance: Some(result.into()), ..dto },
            Found::Type1 { selected, study, .. } => {
                let reason = study.as_ref().and_then(|study| study.as_ref().err()).cloned();
                let series = selected.as_ref().map(|selected| selected.series.clone());
                let type_1 = series.zip(study.and_then(Result::ok));
                let type_1 = type_1.map(|(series, study)| Type1StudyDto::new(series, &study));
                Self { readings: readings(selected), type_1, reason, ..dto }
            }
            Found::GaugeRr { selected, study, .. } => {
                let reason = study.as_ref().and_then(|study| study.as_ref().err()).cloned();
                let series = selected.as_ref().map(|selected| selected.series.clone());
                let gauge_rr = series.zip(study.and_then(Result::ok));
                let gauge_rr = gauge_rr.map(|(series, study)| GaugeRrDto::new(series, &study));
                Self { readings: readings(selected), gauge_rr, reason, ..dto }
            }
        }
    }
}

fn readings(selected: Option<Selected>) -> Vec<ReadingDto> {
    selected.into_iter().flat_map(|selected| selected.series.readings).map(ReadingDto::from).collect()
}
