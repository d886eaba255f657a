//! The API's document, made from the routes themselves.

use crate::Http;
use axum::Router;
use utoipa::OpenApi;
use utoipa::openapi::path::{Operation, Parameter, ParameterBuilder, ParameterIn};
use utoipa::openapi::schema::{ObjectBuilder, Type};
use utoipa::openapi::{Content, Ref, RefOr, Required, Response, ResponseBuilder};
use utoipa_axum::router::OpenApiRouter;

use crate::problem::PROBLEM_TYPE;
use crate::problem::Problem;
use crate::rest::events_document::events_markdown;
use crate::rest::routes;
use crate::wire::job::jobs::JobStateDto;
use crate::wire::measurement::measurements::VerdictDto;
use crate::wire::scan::scans::{CloudFormatDto, MeshFormatDto, ScanStateDto};

/// Title, tags and the types that only the completion below refers to.
#[derive(OpenApi)]
#[openapi(
    info(
        title = "Sheaf",
        description = "The scanner's interface: station, captures, calibrations, scans, measurements, jobs, events.\n\n\
            Every error is a problem (RFC 9457) with cause and remedy. What takes seconds is a job: the answer is 202 \
            with its address in `Location`. What changes settings that people share takes `If-Match`. Commands that \
            move, turn the laser on or change settings need the control lease in the header `Sheaf-Control`; Stop needs nothing."
    ),
    tags(
        (name = "service", description = "Whether the service lives and can work"),
        (name = "station", description = "State, Stop, control, live view"),
        (name = "devices", description = "Camera, stage and laser"),
        (name = "simulation", description = "The hands at the simulated station"),
        (name = "captures", description = "Recorded pictures, uploaded or taken here"),
        (name = "recordings", description = "Everything that was seen, as MCAP files"),
        (name = "calibrations", description = "Made by jobs, active by decision"),
        (name = "calibration sessions", description = "A calibration picture by picture"),
        (name = "scans", description = "Clouds, meshes, profiles"),
        (name = "measurements", description = "Values with uncertainty and verdict"),
        (name = "jobs", description = "What takes seconds"),
        (name = "events", description = "What happened")
    ),
    components(schemas(Problem, CloudFormatDto, MeshFormatDto, JobStateDto, ScanStateDto, VerdictDto))
)]
struct Document;

/// The routes and their document.
pub fn routes_and_document() -> (Router<Http>, utoipa::openapi::OpenApi) {
    let (router, mut document) = OpenApiRouter::with_openapi(Document::openapi())
        .merge(routes::service::routes())
        .nest("/api/v1", routes::api())
        .split_for_parts();
    complete(&mut document);
    (router, document)
}

/// The catalogue of events as it is printed and checked in.
pub fn events_document() -> String {
    let (_, document) = routes_and_document();
    events_markdown(&serde_json::to_value(document).expect("the document is made of texts and numbers"))
}

/// The document as it is printed and checked in.
pub fn document_json() -> String {
    let (_, document) = routes_and_document();
    let mut json = document.to_pretty_json().expect("the document is made of texts and numbers");
    json.push('\n');
    json
}

/// Problems that any operation can answer with.
const ALWAYS: &[u16] = &[400, 403, 404, 408, 500, 503];

/// Problems of those that take a body.
const WITH_BODY: &[u16] = &[409, 413, 415, 422];

/// Problems of those that change something.
const CHANGING: &[u16] = &[409, 412, 422, 428, 429, 507];

/// Problems of those that only read, but ask more of the station or the store than to be there.
const READING: &[(&str, &[u16])] = &[
    ("get_snapshot", &[409, 422, 429]),
    ("get_cloud", &[409, 422, 507]),
    ("get_mesh", &[409, 422, 507]),
    ("get_export", &[409, 422, 507]),
    ("get_points", &[409]),
    ("get_profile", &[409, 422]),
    ("list_profiles", &[409]),
    ("get_calibration", &[409]),
    ("diff_calibrations", &[409, 422]),
];

/// Adds the problems that operations of a kind have in common, and the header of those done at most once.
fn complete(document: &mut utoipa::openapi::OpenApi) {
    let components = document.components.get_or_insert_default();
    components.responses.insert("Problem".to_owned(), RefOr::T(problem_response()));
    for (path, item) in &mut document.paths.paths {
        if path == crate::edge::STOP_PATH {
            // Stop is always answered with 200.
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
        if let Some(operation) = &mut item.post
            && creates(operation)
        {
            operation.parameters.get_or_insert_default().push(RefOr::T(idempotency_key()));
        }
    }
}

/// Operations that answer with 200 and are done at most once for their key all the same. A jog is repeated on purpose.
const ONCE: &[&str] = &["take_pose", "take_stage_view", "home_stage", "move_stage", "roll_back_activation"];

/// Whether an operation makes or moves something: such requests may carry an `Idempotency-Key`.
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
        .description("What went wrong, why, and what to do about it")
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
            "The same key with the same body and query is the same request, for seven days: it is done once and answered alike",
        ))
        .schema(Some(text.pattern(Some("^[!-~]+$")).build()))
        .build()
}
