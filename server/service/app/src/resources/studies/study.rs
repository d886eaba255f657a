//! A study as stored.

use metrology::acceptance::{Position, Procedure};
use serde::{Deserialize, Serialize};
use serde_json::json;
use store::{StoreError, StudyRecord};

use crate::resources::studies::StudyPlan;

/// A study.
#[derive(Debug, Clone, PartialEq)]
pub struct Study {
    /// Its id.
    pub id: String,
    /// Grows with every change.
    pub version: i64,
    /// The content.
    pub body: StudyBody,
    /// When it was created.
    pub created_at_ms: i64,
    /// When it was last changed.
    pub changed_at_ms: i64,
}

/// The content of a study.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct StudyBody {
    /// Display name.
    pub name: String,
    /// Who created it.
    pub author: String,
    /// What is examined.
    pub plan: StudyPlan,
    /// The positions of an acceptance test, in the order in which they were added.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub positions: Vec<StudyPosition>,
}

/// A position of an artefact: a scan and its figures.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct StudyPosition {
    /// The scan.
    pub scan_id: String,
    /// Its name.
    pub scan_name: String,
    /// The calibration of its cloud.
    pub calibration_id: String,
    /// Whether the devices were simulated.
    pub simulated: bool,
    /// Who added it.
    pub added_by: String,
    /// When.
    pub added_at_ms: i64,
    /// The figures.
    pub position: Position,
}

impl Study {
    /// From its record.
    ///
    /// # Errors
    /// [`StoreError::DamagedRecord`] if it was stored by an incompatible version.
    pub fn of(record: StudyRecord) -> Result<Self, StoreError> {
        let StudyRecord { id, version, body, created_at_ms, changed_at_ms } = record;
        match serde_json::from_value(body) {
            Ok(body) => Ok(Self { id, version, body, created_at_ms, changed_at_ms }),
            Err(_) => Err(StoreError::DamagedRecord { kind: "study", id }),
        }
    }

    /// Its record.
    pub(crate) fn to_record(&self) -> StudyRecord {
        StudyRecord {
            id: self.id.clone(),
            version: self.version,
            body: json!(self.body),
            created_at_ms: self.created_at_ms,
            changed_at_ms: self.changed_at_ms,
        }
    }

    /// The positions for the evaluation.
    pub fn positions(&self) -> Vec<Position> {
        self.body.positions.iter().map(|position| position.position.clone()).collect()
    }

    /// The first position of a procedure.
    pub(crate) fn first_of(&self, procedure: Procedure) -> Option<&StudyPosition> {
        self.body.positions.iter().find(|position| position.position.procedure == procedure)
    }
}
