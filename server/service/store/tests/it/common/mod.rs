//! Records for tests.

use serde_json::json;
use store::{
    ArtifactId, CalibrationRecord, CaptureRecord, Change, EventRecord, ExpectedActive, IdempotencyRecord,
    InspectionRecord, JobRecord, JobState, MeasurementRecord, Page, RecipeVersionRecord, RecordingRecord,
    RecordingState, ScanRecord, ScanState, SessionRecord, StudyRecord,
};

pub fn new_id() -> String {
    uuid::Uuid::now_v7().to_string()
}

/// An id that names no bytes.
pub fn artifact(digit: char) -> ArtifactId {
    ArtifactId::parse(&digit.to_string().repeat(64)).unwrap()
}

pub fn first(limit: u32) -> Page {
    Page { before: None, limit }
}

pub fn job() -> JobRecord {
    JobRecord {
        id: new_id(),
        kind: "scan".into(),
        state: JobState::Queued,
        input: json!({"from_mm": -20.0, "to_mm": 20.5}),
        source: "rest".into(),
        progress: 0.0,
        message: "in the queue".into(),
        result: None,
        problem: None,
        checkpoint: None,
        created_at_ms: 1_700_000_000_000,
        started_at_ms: None,
        ended_at_ms: None,
    }
}

pub fn capture() -> CaptureRecord {
    CaptureRecord {
        id: new_id(),
        name: "gauge, morning".into(),
        origin: "upload".into(),
        archive: artifact('a'),
        archive_format: "zip".into(),
        size_bytes: 123_456_789,
        summary: json!({"n_pictures": 42}),
        created_at_ms: 1,
    }
}

pub fn recording() -> RecordingRecord {
    RecordingRecord {
        id: new_id(),
        name: "morning".into(),
        origin: "live".into(),
        state: RecordingState::Recording,
        scan_id: None,
        calibration_id: Some("c1".into()),
        file: None,
        size_bytes: 0,
        summary: json!({ "n_frames": 0 }),
        started_at_ms: 1_700_000_000_000,
    }
}

pub fn calibration(id: &str) -> CalibrationRecord {
    CalibrationRecord {
        id: id.into(),
        document: artifact('b'),
        report: Some(artifact('c')),
        capture_id: None,
        job_id: Some(new_id()),
        summary: json!({"rms_px": 0.071_234_567_890_123_45}),
        created_at_ms: 2,
    }
}

pub fn scan(calibration_id: &str) -> ScanRecord {
    ScanRecord {
        id: new_id(),
        name: "sphere".into(),
        state: ScanState::Complete,
        calibration_id: calibration_id.into(),
        plan: json!({"step_mm": 0.2}),
        peaks: artifact('d'),
        capture_id: None,
        cloud: Some(artifact('e')),
        display: None,
        report: json!({"n_points": 100_000}),
        recomputed_from: None,
        job_id: None,
        software_version: "0.1.0".into(),
        created_at_ms: 3,
    }
}

pub fn measurement(scan_id: &str) -> MeasurementRecord {
    MeasurementRecord {
        id: new_id(),
        scan_id: scan_id.into(),
        request: json!({"tool": "sphere"}),
        result: json!({"diameter_mm": 18.9}),
        created_at_ms: 4,
    }
}

pub fn session() -> SessionRecord {
    SessionRecord { id: new_id(), version: 1, body: json!({"step": 1}), created_at_ms: 5, changed_at_ms: 5 }
}

pub fn study() -> StudyRecord {
    StudyRecord { id: new_id(), version: 1, body: json!({"name": "s"}), created_at_ms: 5, changed_at_ms: 5 }
}

pub fn event(subject: &str) -> EventRecord {
    EventRecord { seq: 0, kind: "job.queued".into(), subject: subject.into(), body: json!({"n": 1}), at_ms: 6 }
}

pub fn idempotency(key: &str, at_ms: i64) -> IdempotencyRecord {
    IdempotencyRecord {
        key: key.into(),
        body_sha256: "0".repeat(64),
        answer: json!({"status": 202}),
        created_at_ms: at_ms,
    }
}

pub fn activate(id: Option<&str>, expected: Option<Option<&str>>) -> Change {
    Change::Activate {
        calibration_id: id.map(str::to_owned),
        expected_previous: expected.map_or(ExpectedActive::Any, |id| ExpectedActive::Is(id.map(str::to_owned))),
        act: "activate".into(),
        actor: "engineer".into(),
        at_ms: 7,
    }
}

pub fn recipe_version(id: &str, version: i64) -> RecipeVersionRecord {
    RecipeVersionRecord {
        recipe_id: id.into(),
        version,
        content: json!({ "name": "bracket", "step_mm": 0.25 * version as f64 }),
        digest: "0".repeat(64),
        author: "chief".into(),
        reason: format!("change {version}"),
        restored_from: None,
        created_at_ms: 9,
    }
}

pub fn publish(id: &str, version: i64, number: Option<i64>) -> Change {
    Change::PublishRecipe { version: recipe_version(id, version), number }
}

pub fn inspection(serial: &str, scan_id: Option<&str>) -> InspectionRecord {
    InspectionRecord {
        id: new_id(),
        seq: 0,
        serial: serial.into(),
        order_number: Some("4711".into()),
        recipe_id: "bracket".into(),
        recipe_version: 2,
        verdict: "ok".into(),
        scan_id: scan_id.map(str::to_owned),
        re_evaluated_from: None,
        job_id: Some(new_id()),
        body: json!({ "results": [{ "id": "h", "value": 9.02 }] }),
        created_at_ms: 10,
    }
}

/// Stores an inspection, announced by an event.
pub fn inspected(inspection: &InspectionRecord) -> Change {
    let event = EventRecord { kind: "inspection.finished".into(), ..event(&inspection.id) };
    Change::InsertInspection { inspection: inspection.clone(), event }
}
