//! `Idempotency-Key`: a request is carried out once per key; repeats get the stored response for seven days, across
//! restarts.
//!
//! The response is stored in the same transaction as what the request created, so that neither exists without the
//! other.

use axum::http::{HeaderMap, HeaderName};
use serde_json::Value;
use station::wall_clock::now_ms;
use store::{Change, IdempotencyRecord};

use crate::problem::{Problem, ProblemKind};
use crate::rest::answers::{Reply, header_text};
use app::App;
use app::hash_hex;
use app::idempotency::InFlight;

const HEADER: HeaderName = HeaderName::from_static("idempotency-key");

/// Maximum length of a key.
const KEY_LIMIT: usize = 200;

/// A request carried out for the first time.
#[derive(Debug)]
pub struct Once {
    flight: Option<InFlight>,
    body_sha256: String,
}

/// Whether a request is new.
#[derive(Debug)]
pub enum Begun {
    /// It was answered before.
    Answered(Reply),
    /// It is new.
    Fresh(Once),
}

/// Registers the key of a request, if it has one: 409 while a request with the same key is running.
pub fn enter(app: &App, headers: &HeaderMap, route: &str) -> Result<Option<InFlight>, Problem> {
    let Some(key) = header_text(headers, &HEADER)? else { return Ok(None) };
    if key.is_empty() || key.len() > KEY_LIMIT || !key.bytes().all(|byte| byte.is_ascii_graphic()) {
        return Err(Problem::new(ProblemKind::BadRequest, "the Idempotency-Key cannot be used")
            .at("Idempotency-Key")
            .remedy(format!("send 1 to {KEY_LIMIT} visible ASCII characters, such as a UUID")));
    }
    let flight = app.keys.enter(format!("{route} {key}")).ok_or_else(|| {
        Problem::new(ProblemKind::Conflict, "a request with this Idempotency-Key is still running")
            .remedy("wait for its response, then repeat")
            .retry_after_s(1)
    })?;
    Ok(Some(flight))
}

/// Looks up the key of a request, now that the body is known.
pub async fn look_up(app: &App, flight: Option<InFlight>, body_sha256: &str) -> Result<Begun, Problem> {
    let fresh = |flight| Begun::Fresh(Once { flight, body_sha256: body_sha256.to_owned() });
    let Some(entered) = &flight else { return Ok(fresh(flight)) };
    let Some(kept) = app.catalogue.read().idempotency(entered.key()).await? else { return Ok(fresh(flight)) };
    if kept.body_sha256 != body_sha256 {
        return Err(Problem::new(
            ProblemKind::KeyReused,
            "the Idempotency-Key was already used for another request",
        )
        .remedy("use a new key for a new request"));
    }
    if kept.answer.is_null() {
        return Err(Problem::new(
            ProblemKind::Conflict,
            "a request with this Idempotency-Key was started, but its outcome is unknown",
        )
        .remedy("check what was done, then use a new key for the rest"));
    }
    Reply::from_json(&kept.answer).map(Begun::Answered).ok_or_else(|| {
        Problem::new(ProblemKind::Internal, "the response stored for this key cannot be read")
            .remedy("use a new key")
    })
}

/// [`enter`] and [`look_up`] for a body that is already known.
pub async fn begin(app: &App, headers: &HeaderMap, route: &str, body_sha256: &str) -> Result<Begun, Problem> {
    look_up(app, enter(app, headers, route)?, body_sha256).await
}

/// What distinguishes two requests with the same key: body and query.
pub fn fingerprint(body_sha256: String, query: Option<&str>) -> String {
    match query {
        None | Some("") => body_sha256,
        Some(query) => hash_hex(format!("{body_sha256}?{query}").as_bytes()),
    }
}

/// Carries out an action that cannot be stored in one transaction with its response, such as a motion, at most once per
/// key: the key is stored first, so that after a crash the same key never repeats it. A refusal frees the key; a failure
/// after the start becomes the stored response.
pub async fn at_most_once(
    app: &App,
    headers: &HeaderMap,
    route: &str,
    body_sha256: &str,
    act: impl Future<Output = Result<Reply, Problem>>,
) -> Result<Reply, Problem> {
    let once = match begin(app, headers, route, body_sha256).await? {
        Begun::Answered(reply) => return Ok(reply),
        Begun::Fresh(once) => once,
    };
    let Some(key) = once.flight.as_ref().map(|flight| flight.key().to_owned()) else { return act.await };
    app.catalogue.commit(once.insert(Value::Null)).await?;
    let done = act.await;
    let answer = match &done {
        Ok(reply) => Some(reply.to_json()),
        Err(problem) if problem.status >= 500 => Some(Reply::broken(problem).to_json()),
        Err(_) => None,
    };
    app.catalogue.commit(vec![Change::AnswerIdempotency { key, answer }]).await?;
    done
}

impl Once {
    /// The write that stores the response, to be committed with what the request created; nothing without a key.
    pub fn changes(&self, answer: &Reply) -> Vec<Change> {
        self.insert(answer.to_json())
    }

    fn insert(&self, answer: Value) -> Vec<Change> {
        let Some(flight) = &self.flight else { return Vec::new() };
        vec![Change::InsertIdempotency(IdempotencyRecord {
            key: flight.key().to_owned(),
            body_sha256: self.body_sha256.clone(),
            answer,
            created_at_ms: now_ms(),
        })]
    }
}
