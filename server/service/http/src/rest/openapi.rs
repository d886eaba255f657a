//! The API document, generated from the routes.

use crate::Http;
use app::doors::InspectionMessage;
use axum::Router;
use axum::http::Method;
use utoipa::OpenApi;
use utoipa::openapi::path::{Operation, Parameter, ParameterBuilder, ParameterIn};
use utoipa::openapi::schema::{ObjectBuilder, Type};
use utoipa::openapi::{Content, Ref, RefOr, Required, Response, ResponseBuilder};
use utoipa_axum::router::OpenApiRouter;

use crate::problem::PROBLEM_TYPE;
use crate::problem::Problem;
use crate::rest::around::heavy::is_heavy;
use crate::rest::events_document::events_markdown;
use crate::rest::routes;
use crate::wire::job::jobs::JobStateDto;
use crate::wire::measurement::measurements::VerdictDto;
use crate::wire::scan::scans::{CloudFormatDto, MeshFormatDto, ScanStateDto};

/// Title, tags and the types that only [`complete`] refers to.
#[derive(OpenApi)]
#[openapi(
    info(
        title = "Sheaf",
        description = "The API of the scanner: station, captures, calibrations, scans, measurements, jobs, events.\n\n\
            Every error is a problem (RFC 9457) with cause and remedy. Long operations are jobs: the response is 202 with \
            the address of the job in `Location`. Changes of shared settings take `If-Match`. Commands that move the \
            stage, turn the laser on or change settings need the control lease in the header `Sheaf-Control`; Stop does not."
    ),
    tags(
        (name = "service", description = "Liveness, readiness, metrics, API document"),
        (name = "station", description = "State, Stop, reset, control, live view"),
        (name = "devices", description = "Camera, stage and laser"),
        (name = "simulation", description = "Scene, board and faults of the simulated station"),
        (name = "captures", description = "Image sets with a manifest, uploaded or captured by the station"),
        (name = "recordings", description = "Recorded frames and device data, as MCAP files"),
        (name = "calibrations", description = "Computed by jobs, activated explicitly"),
        (name = "calibration sessions", description = "Interactive calibration, image by image"),
        (name = "scans", description = "Scans with their clouds, meshes and profiles"),
        (name = "measurements", description = "Measured values with uncertainty and verdict"),
        (name = "recipes", description = "Versioned recipes: scan settings, measurements and limits of a part"),
        (name = "inspections", description = "Inspections of parts with a recipe"),
        (name = "statistics", description = "Control charts, and capability of processes and of the station"),
        (name = "studies", description = "Acceptance tests, type-1 studies and gauge R&R of the station, with reports"),
        (name = "doors", description = "Interfaces that deliver events to other systems"),
        (name = "jobs", description = "Long operations: queue, progress, results"),
        (name = "events", description = "The event log and the event stream")
    ),
    components(schemas(Problem, InspectionMessage, CloudFormatDto, MeshFormatDto, JobStateDto, ScanStateDto, VerdictDto))
)]
struct Document;

/// The document in `openapi/`, which is that of the program (`server/cli/tests/it/http/protocol/document.rs`). Tests that
/// built it would compile every handler once more.
#[cfg(test)]
pub fn checked_in_document() -> serde_json::Value {
    let document = include_str!("../../../../../openapi/openapi.json");
    serde_json::from_str(document).expect("a test compares it with that of the program")
}

/// The routes and the API document.
pub fn routes_and_document() -> (Router<Http>, utoipa::openapi::OpenApi) {
    let (router, mut document) = OpenApiRouter::with_openapi(Document::openapi())
        .merge(routes::service::routes())
        .nest("/api/v1", routes::api())
        .split_for_parts();
    complete(&mut document);
    (router, document)
}

/// The event catalogue as it is printed and checked in.
pub fn events_document() -> String {
    let (_, document) = routes_and_document();
    events_markdown(&serde_json::to_value(document).expect("the document is made of texts and numbers"))
}

/// The API document as it is printed and checked in.
pub fn document_json() -> String {
    let (_, document) = routes_and_document();
    let mut json = document.to_pretty_json().expect("the document is made of texts and numbers");
    json.push('\n');
    json
}

/// Status codes of problems that any operation can return.
const ALWAYS: &[u16] = &[400, 403, 404, 408, 500, 503];

/// Those of operations with a request body.
const WITH_BODY: &[u16] = &[409, 413, 415, 422];

/// Those of operations that change something.
const CHANGING: &[u16] = &[409, 412, 422, 428, 429, 507];

/// Those of reading operations that need more of the station or the store.
const READING: &[(&str, &[u16])] = &[
    ("get_snapshot", &[409, 422, 429]),
    ("get_cloud", &[409, 422, 507]),
    ("get_mesh", &[409, 422, 507]),
    ("get_export", &[409, 422, 507]),
    // A certificate without its settings.
    ("get_calibration_report", &[422]),
    ("get_points", &[409]),
    ("get_profile", &[409, 422]),
    ("list_profiles", &[409]),
    ("get_calibration", &[409]),
    ("diff_calibrations", &[409, 422]),
];

/// Adds the problems that groups of operations share, and the `Idempotency-Key` header where it applies.
fn complete(document: &mut utoipa::openapi::OpenApi) {
    let components = document.components.get_or_insert_default();
    components.responses.insert("Problem".to_owned(), RefOr::T(problem_response()));
    for (path, item) in &mut document.paths.paths {
        if path == crate::edge::STOP_PATH {
            // Stop always returns 200.
            continue;
        }
        let reading = [&mut item.get].into_iter().flatten().map(|operation| (operation, false));
        let changing = [&mut item.post, &mut item.put, &mut item.delete, &mut item.patch];
        for (operation, changes) in
            reading.chain(changing.into_iter().flatten().map(|operation| (operation, true)))
        {
            add_problems(operation, ALWAYS);
            let own = READING.iter().find(|(id, _)| operation.operation_id.as_deref() == Some(id));
            add_problems(operation, own.map_or(&[], |(_, statuses)| statuses));
            if changes {
                add_problems(operation, CHANGING);
            }
            if operation.request_body.is_some() {
                add_problems(operation, WITH_BODY);
            }
        }
        if let Some(operation) = &mut item.get
            && is_heavy(&Method::GET, path)
        {
            add_problems(operation, &[429]);
        }
        if let Some(operation) = &mut item.post
            && creates(operation)
        {
            operation.parameters.get_or_insert_default().push(RefOr::T(idempotency_key()));
        }
    }
}

/// Operations that return 200 and still honour `Idempotency-Key`. Jog does not: it is repeated on purpose.
const ONCE: &[&str] = &["capture_pose", "capture_stage_view", "home_stage", "move_stage", "roll_back_activation"];

/// Whether an operation creates or moves something: such requests may carry an `Idempotency-Key`.
fn creates(operation: &Operation) -> bool {
    let id = operation.operation_id.as_deref().unwrap_or_default();
    let makes = operation.responses.responses.keys().any(|status| matches!(status.as_str(), "201" | "202"));
    makes && id != "take_control" || ONCE.contains(&id)
}

fn add_problems(operation: &mut Operation, statuses: &[u16]) {
    for status in statuses {
        let answer = RefOr::Ref(Ref::from_response_name("Problem"));
        operation.responses.responses.entry(status.to_string()).or_insert(answer);
    }
}

fn problem_response() -> Response {
    ResponseBuilder::new()
        .description("Problem details: what went wrong, its cause and remedy")
        .content(PROBLEM_TYPE, Content::new(Some(RefOr::Ref(Ref::from_schema_name("Problem")))))
        .build()
}

fn idempotency_key() -> Parameter {
    let text = ObjectBuilder::new().schema_type(Type::String).min_length(Some(1)).max_length(Some(200));
    ParameterBuilder::new()
        .name("Idempotency-Key")
        .parameter_in(ParameterIn::Header)
        .required(Required::False)
        .description(Some(
            "Repeating a request with the same key, body and query within seven days does not repeat the action; it returns the same response",
        ))
        .schema(Some(text.pattern(Some("^[!-~]+$")).build()))
        .build()
}
