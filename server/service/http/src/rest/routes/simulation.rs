//! The hands at the simulated station: what lies on the stage, which faults it has. Only there.

use crate::Http;
use app::events::{Event, NoBody, SimulatedFault, event};
use std::sync::Arc;

use axum::Json;
use axum::body::Body;
use axum::extract::State;
use axum::http::{HeaderMap, StatusCode};
use twin::{Scene, SceneKind, TwinControl, TwinFault, read_stl};
use utoipa_axum::router::OpenApiRouter;
use utoipa_axum::routes;

use crate::limits::{STL_BODY_LIMIT_BYTES, STL_BODY_TIMEOUT};
use crate::problem::{Problem, ProblemKind};
use crate::rest::conversions::blocking;
use crate::rest::extract::{ApiJson, ApiPath, media_type, whole_body};
use crate::wire::simulation::{FaultListDto, FaultSwitchDto, PlaceSceneDto, SceneDto, SceneNameDto};
use app::App;
use app::config::AppConfig;

/// The routes.
pub fn routes() -> OpenApiRouter<Http> {
    OpenApiRouter::new()
        .routes(routes!(get_scene, place_scene))
        .routes(routes!(place_solid))
        .routes(routes!(list_faults, switch_fault_on))
        .routes(routes!(switch_fault_off))
}

fn hands(app: &App) -> Result<TwinControl, Problem> {
    app.station.simulation().ok_or_else(|| {
        Problem::new(ProblemKind::NotFound, "the station is not simulated")
            .remedy("start the service with station.camera.kind = \"twin\"")
    })
}

/// The hands while no job has the station: what it scans must not change under it.
fn idle_hands(app: &App) -> Result<TwinControl, Problem> {
    let hands = hands(app)?;
    let status = app.station.status();
    if status.job_id.is_none() {
        return Ok(hands);
    }
    Err(Problem::new(ProblemKind::StationBusy, format!("the station is busy: {}", status.activity))
        .remedy("wait for the job, or cancel it")
        .retry_after_s(1))
}

/// What lies on the simulated stage.
#[utoipa::path(get, path = "/simulation/scene", tag = "simulation", responses((status = 200, body = SceneDto)))]
async fn get_scene(State(app): State<App>) -> Result<Json<SceneDto>, Problem> {
    let scene = match &*hands(&app)?.scene() {
        Scene::Plate(_) => "plate",
        Scene::Gauge(_) => "gauge",
        Scene::Sphere(_) => "sphere",
        Scene::Freeform(_) => "freeform",
        Scene::Board(_) => "board",
        Scene::Mesh(_) => "part",
    };
    Ok(Json(SceneDto { scene: scene.to_owned() }))
}

/// Puts something on the simulated stage, as a person would with hands; the real part of a real station stays real.
#[utoipa::path(
    put, path = "/simulation/scene", tag = "simulation", request_body = PlaceSceneDto,
    responses((status = 200, body = SceneDto))
)]
async fn place_scene(State(app): State<App>, body: ApiJson<PlaceSceneDto>) -> Result<Json<SceneDto>, Problem> {
    idle_hands(&app)?.place_part(&scene_kind(body.value.scene, &app.config));
    get_scene(State(app)).await
}

/// Puts a part from an STL file (binary or text, mm) on the simulated stage's plate.
#[utoipa::path(
    put, path = "/simulation/scene/part", tag = "simulation",
    request_body(content = Vec<u8>, content_type = "model/stl"),
    responses((status = 200, body = SceneDto))
)]
async fn place_solid(State(app): State<App>, headers: HeaderMap, body: Body) -> Result<Json<SceneDto>, Problem> {
    let hands = idle_hands(&app)?;
    if media_type(&headers).as_deref() != Some("model/stl") {
        return Err(Problem::new(ProblemKind::UnsupportedMediaType, "the body is not said to be an STL file")
            .remedy("send Content-Type: model/stl"));
    }
    let bytes = whole_body(body, STL_BODY_LIMIT_BYTES, STL_BODY_TIMEOUT).await?;
    let solid = blocking(move || read_stl(&bytes)).await?.map_err(|error| {
        Problem::new(ProblemKind::Impossible, error.to_string()).remedy("export the part again as STL, in mm")
    })?;
    hands.place_solid(Arc::new(solid));
    get_scene(State(app)).await
}

fn scene_kind(name: SceneNameDto, config: &AppConfig) -> SceneKind {
    let (height_mm, radius_mm) = config.known_sizes_mm();
    match name {
        SceneNameDto::Plate => SceneKind::Plate,
        SceneNameDto::Gauge => SceneKind::Gauge { height_mm },
        SceneNameDto::Sphere => SceneKind::Sphere { radius_mm },
        SceneNameDto::Freeform => SceneKind::Freeform,
    }
}

/// The faults that are switched on.
#[utoipa::path(
    get, path = "/simulation/faults", tag = "simulation",
    responses((status = 200, body = FaultListDto))
)]
async fn list_faults(State(app): State<App>) -> Result<Json<FaultListDto>, Problem> {
    let items = hands(&app)?.faults().iter().map(FaultSwitchDto::from).collect();
    Ok(Json(FaultListDto { items }))
}

/// Switches a fault on.
#[utoipa::path(
    put, path = "/simulation/faults", tag = "simulation", request_body = FaultSwitchDto,
    responses((status = 200, body = FaultListDto))
)]
async fn switch_fault_on(
    State(app): State<App>,
    body: ApiJson<FaultSwitchDto>,
) -> Result<Json<FaultListDto>, Problem> {
    let hands = hands(&app)?;
    let FaultSwitchDto { name, value } = body.value;
    let fault = TwinFault::named(&name, value).map_err(|error| {
        let text = error.to_string();
        let (what, remedy) = text.split_once("; ").unwrap_or((&text, "see the known names"));
        Problem::new(ProblemKind::Impossible, what).at("/name").remedy(remedy)
    })?;
    hands.set_fault(fault);
    let change = event(fault.name(), Event::SimulationFaultOn(SimulatedFault { value: fault.value() }));
    app.ledger.commit(vec![change]).await?;
    list_faults(State(app)).await
}

/// Switches a fault off; what it did to a device may need a reset of the station.
#[utoipa::path(
    delete, path = "/simulation/faults/{name}", tag = "simulation", params(("name" = String, Path)),
    responses((status = 204, description = "It is off"))
)]
async fn switch_fault_off(State(app): State<App>, ApiPath(name): ApiPath<String>) -> Result<StatusCode, Problem> {
    if !hands(&app)?.clear_fault(&name) {
        return Err(Problem::new(ProblemKind::NotFound, format!("no fault \"{name}\" is switched on"))
            .remedy("GET /api/v1/simulation/faults lists those that are"));
    }
    app.ledger.commit(vec![event(&name, Event::SimulationFaultOff(NoBody {}))]).await?;
    Ok(StatusCode::NO_CONTENT)
}
