//! Statistics of a characteristic over inspections: control chart, type-1 study, gauge R&R.

use crate::Http;
use axum::Json;
use axum::extract::State;
use capability::type_1::Factors;
use store::InspectionFilter;
use utoipa_axum::router::OpenApiRouter;
use utoipa_axum::routes;

use crate::problem::{Problem, ProblemKind};
use crate::rest::extract::{ApiPath, ApiQuery};
use crate::wire::statistics::{ControlChartDto, GaugeRrDto, SeriesQuery, Type1StudyDto};
use app::App;
use app::statistics::{CHART_VALUES, Series, SeriesRequest, series};

/// Most values of a series.
const MOST_VALUES: u32 = 5000;

/// The routes.
pub fn routes() -> OpenApiRouter<Http> {
    OpenApiRouter::new()
        .routes(routes!(get_control_chart))
        .routes(routes!(get_type_1_study))
        .routes(routes!(get_gauge_rr))
}

/// Returns the control chart of a characteristic (individual values and moving range), violations of Nelson's rules, and
/// the capability of the process.
#[utoipa::path(
    get, path = "/recipes/{id}/characteristics/{characteristic}/control-chart", tag = "statistics",
    params(("id" = String, Path), ("characteristic" = String, Path), SeriesQuery),
    responses((status = 200, body = ControlChartDto))
)]
async fn get_control_chart(
    State(app): State<App>,
    ApiPath(of): ApiPath<(String, String)>,
    ApiQuery(query): ApiQuery<SeriesQuery>,
) -> Result<Json<ControlChartDto>, Problem> {
    let series = selected(&app, of, &query).await?;
    let chart = series.control_chart()?;
    Ok(Json(ControlChartDto::new(series, chart)))
}

/// Returns a type-1 study of the station from repeated inspections of one part (`serial`) with a known value (`reference`).
#[utoipa::path(
    get, path = "/recipes/{id}/characteristics/{characteristic}/type-1-study", tag = "statistics",
    params(("id" = String, Path), ("characteristic" = String, Path), SeriesQuery),
    responses((status = 200, body = Type1StudyDto))
)]
async fn get_type_1_study(
    State(app): State<App>,
    ApiPath(of): ApiPath<(String, String)>,
    ApiQuery(query): ApiQuery<SeriesQuery>,
) -> Result<Json<Type1StudyDto>, Problem> {
    let Some(reference) = query.reference else {
        return Err(Problem::new(ProblemKind::BadRequest, "a type-1 study needs the value of the part")
            .at("query/reference")
            .remedy("give reference, from the certificate of the part"));
    };
    let series = selected(&app, of, &query).await?;
    let factors = query.n_sigmas.map_or(Factors::SIX_SIGMA, Factors::from);
    let study = series.type_1_study(reference, factors)?;
    Ok(Json(Type1StudyDto::new(series, &study)))
}

/// Returns a gauge R&R study (analysis of variance) from repeated inspections of several parts: trials are inspections
/// with the same serial number, operators the attribute `operator` of the inspections.
#[utoipa::path(
    get, path = "/recipes/{id}/characteristics/{characteristic}/gauge-rr", tag = "statistics",
    params(("id" = String, Path), ("characteristic" = String, Path), SeriesQuery),
    responses((status = 200, body = GaugeRrDto))
)]
async fn get_gauge_rr(
    State(app): State<App>,
    ApiPath(of): ApiPath<(String, String)>,
    ApiQuery(query): ApiQuery<SeriesQuery>,
) -> Result<Json<GaugeRrDto>, Problem> {
    let series = selected(&app, of, &query).await?;
    let study = series.gauge_rr()?;
    Ok(Json(GaugeRrDto::new(series, &study)))
}

async fn selected(
    app: &App,
    (recipe_id, characteristic): (String, String),
    query: &SeriesQuery,
) -> Result<Series, Problem> {
    let limit = query.limit.unwrap_or(CHART_VALUES);
    if !(1..=MOST_VALUES).contains(&limit) {
        return Err(Problem::new(ProblemKind::BadRequest, format!("a series of {limit} values is not possible"))
            .at("query/limit")
            .remedy(format!("request 1 to {MOST_VALUES}")));
    }
    let filter = InspectionFilter {
        serial: query.serial.clone(),
        order_number: query.order.clone(),
        recipe_id: Some(recipe_id),
        recipe_version: query.version,
        verdict: None,
        from_ms: query.from_ms,
        to_ms: query.to_ms,
    };
    Ok(series(app.catalogue.read(), &SeriesRequest { filter, characteristic, limit }).await?)
}
