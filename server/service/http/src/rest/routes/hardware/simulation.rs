//! Control of the simulated station: what is on the stage and which faults are active. Simulated stations only.

use crate::Http;

use axum::Json;
use axum::body::Body;
use axum::extract::State;
use axum::http::{HeaderMap, StatusCode};
use twin::{Scene, SceneKind};
use utoipa_axum::router::OpenApiRouter;
use utoipa_axum::routes;

use crate::limits::{MODEL_BODY_LIMIT_BYTES, MODEL_BODY_TIMEOUT};
use crate::problem::{Problem, ProblemKind};
use crate::rest::control::By;
use crate::rest::extract::{ApiJson, ApiPath, media_type, whole_body};
use crate::wire::hardware::simulation::{FaultListDto, PlaceSceneDto, SceneDto, SceneNameDto, SimulatedFaultDto};
use app::App;
use app::config::AppConfig;
use app::use_cases;

/// The routes.
pub fn routes() -> OpenApiRouter<Http> {
    OpenApiRouter::new()
        .routes(routes!(get_scene, place_scene))
        .routes(routes!(place_part))
        .routes(routes!(list_faults, enable_fault))
        .routes(routes!(disable_fault))
}

/// Returns what is on the simulated stage.
#[utoipa::path(get, path = "/simulation/scene", tag = "simulation", responses((status = 200, body = SceneDto)))]
async fn get_scene(State(app): State<App>) -> Result<Json<SceneDto>, Problem> {
    let scene = match &*use_cases::simulation(&app)?.scene() {
        Scene::Plate(_) => "plate",
        Scene::Gauge(_) => "gauge",
        Scene::Sphere(_) => "sphere",
        Scene::Freeform(_) => "freeform",
        Scene::Board(_) => "board",
        Scene::Mesh(_) => "part",
    };
    Ok(Json(SceneDto { scene: scene.to_owned() }))
}

/// Places an object on the simulated stage. Refused on a real station.
#[utoipa::path(
    put, path = "/simulation/scene", tag = "simulation", request_body = PlaceSceneDto,
    responses((status = 200, body = SceneDto))
)]
async fn place_scene(
    State(app): State<App>,
    By(by): By,
    body: ApiJson<PlaceSceneDto>,
) -> Result<Json<SceneDto>, Problem> {
    use_cases::place_scene(&app, &by, &scene_kind(body.value.scene, &app.config))?;
    get_scene(State(app)).await
}

/// Places a part from an STL file (binary or ASCII, mm) on the plate of the simulated stage.
#[utoipa::path(
    put, path = "/simulation/scene/part", tag = "simulation",
    request_body(content = Vec<u8>, content_type = "model/stl"),
    responses((status = 200, body = SceneDto))
)]
async fn place_part(
    State(app): State<App>,
    By(by): By,
    headers: HeaderMap,
    body: Body,
) -> Result<Json<SceneDto>, Problem> {
    // Checked before a long body is read.
    use_cases::idle_simulation(&app, &by)?;
    if media_type(&headers).as_deref() != Some("model/stl") {
        return Err(Problem::new(ProblemKind::UnsupportedMediaType, "the body has no STL content type")
            .remedy("send Content-Type: model/stl"));
    }
    let bytes = whole_body(body, MODEL_BODY_LIMIT_BYTES, MODEL_BODY_TIMEOUT).await?;
    use_cases::place_part(&app, &by, bytes).await?;
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

/// Lists the active simulated faults.
#[utoipa::path(
    get, path = "/simulation/faults", tag = "simulation",
    responses((status = 200, body = FaultListDto))
)]
async fn list_faults(State(app): State<App>) -> Result<Json<FaultListDto>, Problem> {
    let items = use_cases::simulation(&app)?.faults().iter().map(SimulatedFaultDto::from).collect();
    Ok(Json(FaultListDto { items }))
}

/// Activates a simulated fault.
#[utoipa::path(
    put, path = "/simulation/faults", tag = "simulation", request_body = SimulatedFaultDto,
    responses((status = 200, body = FaultListDto))
)]
async fn enable_fault(
    State(app): State<App>,
    By(by): By,
    body: ApiJson<SimulatedFaultDto>,
) -> Result<Json<FaultListDto>, Problem> {
    let SimulatedFaultDto { name, value } = body.value;
    use_cases::enable_fault(&app, &by, &name, value).await?;
    list_faults(State(app)).await
}

/// Deactivates a simulated fault; the station may need a reset afterwards.
#[utoipa::path(
    delete, path = "/simulation/faults/{name}", tag = "simulation", params(("name" = String, Path)),
    responses((status = 204, description = "Deactivated"))
)]
async fn disable_fault(
    State(app): State<App>,
    By(by): By,
    ApiPath(name): ApiPath<String>,
) -> Result<StatusCode, Problem> {
    use_cases::disable_fault(&app, &by, &name).await?;
    Ok(StatusCode::NO_CONTENT)
}
