//! Requests that change something run to their end, whether or not the client waits for the answer: half of a change is
//! worse than one that nobody heard of.

use axum::extract::{Request, State};
use axum::middleware::Next;
use axum::response::Response;

use crate::app::App;

/// Runs a request that changes something on a task of its own. A panic in it goes on in the connection's task.
pub async fn detached(State(app): State<App>, request: Request, next: Next) -> Response {
    if request.method().is_safe() {
        return next.run(request).await;
    }
    match app.tasks.spawn(next.run(request)).await {
        Ok(response) => response,
        Err(ended) => match ended.try_into_panic() {
            Ok(panic) => std::panic::resume_unwind(panic),
            Err(ended) => crate::http::problems::cut_off(&ended),
        },
    }
}
