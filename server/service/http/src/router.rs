//! All routes with their middleware.

use axum::Router;
use axum::extract::DefaultBodyLimit;
use axum::http::{Extensions, HeaderMap, StatusCode, Version, header};
use axum::middleware::{from_fn, from_fn_with_state};
use tower_http::catch_panic::CatchPanicLayer;
use tower_http::compression::{CompressionLayer, CompressionLevel};
use utoipa_swagger_ui::SwaggerUi;

use crate::rest::around::{guard, headers, heavy, metering};
use crate::rest::{openapi, problems};
use crate::{Http, page, ws};

/// The router of the service.
pub fn router(http: Http) -> Router {
    let guard = guard::Guard::new(&http.config);
    let (api, _) = openapi::routes_and_document();
    api.merge(page::routes())
        .merge(SwaggerUi::new("/docs").config(utoipa_swagger_ui::Config::from("/openapi.json")))
        .route("/api/v1/stream", axum::routing::get(ws::stream))
        .fallback(problems::no_such_path)
        .method_not_allowed_fallback(problems::no_such_method)
        .with_state(http)
        .layer(from_fn_with_state(heavy::Places::default(), heavy::limit))
        // Each reader has its own body limit: `extract` and the upload of captures.
        .layer(DefaultBodyLimit::disable())
        .layer(from_fn_with_state(guard, guard::guard))
        .layer(CompressionLayer::new().quality(CompressionLevel::Fastest).compress_when(is_worth_compressing))
        .layer(from_fn(headers::secure))
        .layer(from_fn(metering::meter))
        .layer(CatchPanicLayer::custom(problems::panicked))
}

/// Compresses text only: clouds, images and archives do not shrink and would take CPU time from a scan.
fn is_worth_compressing(status: StatusCode, _: Version, headers: &HeaderMap, _: &Extensions) -> bool {
    const TEXTS: [&str; 5] =
        ["application/json", "application/problem+json", "text/html", "text/css", "text/javascript"];
    let kind = headers.get(header::CONTENT_TYPE).and_then(|kind| kind.to_str().ok()).unwrap_or_default();
    status != StatusCode::PARTIAL_CONTENT && TEXTS.iter().any(|text| kind.starts_with(text))
}
