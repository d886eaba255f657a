//! The browser station: static files embedded in the program, compressed when they were built.
//!
//! A debug build reads them from `web/dist` instead, so that a changed page needs no rebuild of the program.

use crate::Http;
use axum::Router;
use axum::http::{HeaderMap, HeaderValue, StatusCode, Uri, header};
use axum::response::{IntoResponse as _, Response};
use axum::routing::get;
use headers::{HeaderMapExt as _, IfNoneMatch};
use rust_embed::{EmbeddedFile, RustEmbed};

use crate::problem::{Problem, ProblemKind};
use crate::rest::etag::tag;
use app::hash_hex;

/// Scripts, styles, images and connections of this server only; nothing inline.
const CSP_PAGE: &str = "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' blob: data:; \
                        connect-src 'self'; font-src 'self'; worker-src 'self'; manifest-src 'self'; \
                        frame-ancestors 'none'; base-uri 'none'; form-action 'none'";

/// Files under `assets/` carry the hash of their content in their name.
const FOREVER: &str = "public, max-age=31536000, immutable";

#[derive(RustEmbed)]
#[folder = "../../../web/dist"]
struct Files;

/// The page and what it loads.
pub fn routes() -> Router<Http> {
    Router::new().route("/", get(file)).route("/icon.svg", get(file)).route("/assets/{name}", get(file))
}

async fn file(uri: Uri, headers: HeaderMap) -> Response {
    let path = match uri.path().trim_start_matches('/') {
        "" => "index.html",
        path => path,
    };
    if path == "index.html" && Files::get(path).is_none() {
        return not_built().into_response();
    }
    match best(path, &headers) {
        Some((found, encoding)) => answer(path, found, encoding, &headers),
        None => crate::rest::problems::no_such_path(uri).await.into_response(),
    }
}

fn not_built() -> Problem {
    Problem::new(ProblemKind::Unavailable, "this program was built without the page")
        .remedy("build and start it with `cargo xtask run`; the API works without it, see /docs")
}

/// The file in the smallest encoding that the browser accepts.
fn best(path: &str, headers: &HeaderMap) -> Option<(EmbeddedFile, Option<&'static str>)> {
    let accepted = headers.get(header::ACCEPT_ENCODING).and_then(|text| text.to_str().ok()).unwrap_or_default();
    let takes = |wanted: &str| accepted.split(',').any(|one| one.trim().split(';').next() == Some(wanted));
    let packed = [("br", "br"), ("gzip", "gz")].into_iter().filter(|(name, _)| takes(name));
    packed
        .filter_map(|(name, suffix)| Some((Files::get(&format!("{path}.{suffix}"))?, Some(name))))
        .next()
        .or_else(|| Some((Files::get(path)?, None)))
}

fn answer(path: &str, file: EmbeddedFile, encoding: Option<&'static str>, headers: &HeaderMap) -> Response {
    let tag = tag(&hash_hex(&file.metadata.sha256_hash())[..32]);
    let is_new = |known: IfNoneMatch| tag.as_ref().is_none_or(|tag| known.precondition_passes(tag));
    let known = !headers.typed_get().is_none_or(is_new);
    let status = if known { StatusCode::NOT_MODIFIED } else { StatusCode::OK };
    let body = if known { Vec::new() } else { file.data.into_owned() };
    let mut response = (status, body).into_response();
    let added = response.headers_mut();
    added.insert(header::CONTENT_TYPE, HeaderValue::from_static(kind_of(path)));
    added.insert(header::CONTENT_SECURITY_POLICY, HeaderValue::from_static(CSP_PAGE));
    added.insert(header::VARY, HeaderValue::from_static("accept-encoding"));
    let lifetime = if path.starts_with("assets/") { FOREVER } else { "no-cache" };
    added.insert(header::CACHE_CONTROL, HeaderValue::from_static(lifetime));
    if let Some(encoding) = encoding {
        added.insert(header::CONTENT_ENCODING, HeaderValue::from_static(encoding));
    }
    if let Some(tag) = tag {
        added.typed_insert(tag);
    }
    response
}

fn kind_of(path: &str) -> &'static str {
    match path.rsplit('.').next() {
        Some("html") => "text/html; charset=utf-8",
        Some("js") => "text/javascript; charset=utf-8",
        Some("css") => "text/css; charset=utf-8",
        Some("svg") => "image/svg+xml",
        Some("woff2") => "font/woff2",
        Some("png") => "image/png",
        _ => "application/octet-stream",
    }
}
