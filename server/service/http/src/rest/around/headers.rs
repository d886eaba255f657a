//! Security headers of every response: no content sniffing, no framing, nothing loaded from other origins.

use axum::extract::Request;
use axum::http::{HeaderValue, header};
use axum::middleware::Next;
use axum::response::Response;

/// For responses other than pages.
const CSP_DATA: &str = "default-src 'none'; frame-ancestors 'none'";

/// For the API documentation page: scripts are files, some styles are inline.
const CSP_DOCS: &str = "default-src 'none'; script-src 'self'; style-src 'self' 'unsafe-inline'; img-src 'self' data:; \
                        connect-src 'self'; frame-ancestors 'none'; base-uri 'none'; form-action 'none'";

/// For reports: self-contained pages without scripts. The file carries the same policy itself, except for
/// `frame-ancestors`, which is only valid in a header.
pub const CSP_REPORT: &str =
    "default-src 'none'; style-src 'unsafe-inline'; img-src data:; frame-ancestors 'none'";

/// Adds the headers unless the handler has set them.
pub async fn secure(request: Request, next: Next) -> Response {
    let policy = if request.uri().path().starts_with("/docs") { CSP_DOCS } else { CSP_DATA };
    let mut response = next.run(request).await;
    let headers = response.headers_mut();
    headers.insert(header::X_CONTENT_TYPE_OPTIONS, HeaderValue::from_static("nosniff"));
    headers.insert(header::REFERRER_POLICY, HeaderValue::from_static("no-referrer"));
    headers.insert("cross-origin-resource-policy", HeaderValue::from_static("same-origin"));
    headers.entry(header::CONTENT_SECURITY_POLICY).or_insert(HeaderValue::from_static(policy));
    headers.entry(header::CACHE_CONTROL).or_insert(HeaderValue::from_static("no-cache"));
    response
}
