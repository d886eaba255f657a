//! Jobs: rows whose state only moves forward.

use serde_json::Value;
use sqlx::sqlite::SqliteRow;
use sqlx::{SqliteConnection, SqlitePool};

use crate::catalogue::{Listed, Page};
use crate::error::StoreError;
use crate::records::{JobOutcome, JobRecord, JobState, ResultRef};
use crate::sqlite::changes::{Written, inserted};
use crate::sqlite::error::reading;
use crate::sqlite::listing::{every, listed};
use crate::sqlite::row::{before_id, get, json, optional_json, word, word_from};
use crate::sqlite::seal;

const KIND: &str = "job";

fn from_row(row: &SqliteRow) -> Result<JobRecord, StoreError> {
    seal::intact(row, &seal::JOBS)?;
    let (result_kind, result_id): (Option<String>, Option<String>) =
        (get(row, "result_kind")?, get(row, "result_id")?);
    Ok(JobRecord {
        id: get(row, "id")?,
        kind: get(row, "kind")?,
        state: word(row, "state")?,
        input: json(row, "input")?,
        source: get(row, "source")?,
        progress: get(row, "progress")?,
        message: get(row, "message")?,
        result: result_kind.zip(result_id).map(|(kind, id)| ResultRef { kind, id }),
        problem: optional_json(row, "problem")?,
        checkpoint: optional_json(row, "checkpoint")?,
        created_at_ms: get(row, "created_at_ms")?,
        started_at_ms: get(row, "started_at_ms")?,
        ended_at_ms: get(row, "ended_at_ms")?,
    })
}

pub async fn one(readers: &SqlitePool, id: &str) -> Result<JobRecord, StoreError> {
    let row = sqlx::query("SELECT * FROM jobs WHERE id = $1").bind(id).fetch_optional(readers).await;
    match row.map_err(|cause| reading(cause, "read a job"))? {
        Some(row) => from_row(&row),
        None => Err(StoreError::NotFound { kind: KIND, id: id.to_owned() }),
    }
}

pub async fn page(
    readers: &SqlitePool,
    state: Option<JobState>,
    page: &Page,
) -> Result<Listed<JobRecord>, StoreError> {
    let query = match state {
        None => sqlx::query("SELECT * FROM jobs WHERE id < $1 ORDER BY id DESC"),
        Some(_) => sqlx::query("SELECT * FROM jobs WHERE id < $1 AND state = $2 ORDER BY id DESC"),
    };
    let query = query.bind(before_id(page));
    let query = match state {
        None => query,
        Some(state) => query.bind(word_from(state)),
    };
    listed(query.fetch(readers), page.limit, "list jobs", from_row, every, |job| job.id.clone()).await
}

pub async fn queue(readers: &SqlitePool) -> Result<Listed<JobRecord>, StoreError> {
    let rows = sqlx::query("SELECT * FROM jobs WHERE state = 'queued' ORDER BY id").fetch(readers);
    listed(rows, u32::MAX, "list queued jobs", from_row, every, |job| job.id.clone()).await
}

pub async fn insert(to: &mut SqliteConnection, job: &JobRecord) -> Written {
    let result = sqlx::query(
        "INSERT INTO jobs (id, kind, state, input, source, progress, message, result_kind, result_id, problem,
             checkpoint, created_at_ms, started_at_ms, ended_at_ms)
         VALUES ($1, $2, $3, $4, $5, $6, $7, $8, $9, $10, $11, $12, $13, $14) ON CONFLICT (id) DO NOTHING",
    )
    .bind(&job.id)
    .bind(&job.kind)
    .bind(word_from(job.state))
    .bind(job.input.to_string())
    .bind(&job.source)
    .bind(job.progress)
    .bind(&job.message)
    .bind(job.result.as_ref().map(|result| &result.kind))
    .bind(job.result.as_ref().map(|result| &result.id))
    .bind(job.problem.as_ref().map(Value::to_string))
    .bind(job.checkpoint.as_ref().map(Value::to_string))
    .bind(job.created_at_ms)
    .bind(job.started_at_ms)
    .bind(job.ended_at_ms)
    .execute(to)
    .await?;
    inserted(result, KIND, &job.id)
}

pub async fn start(to: &mut SqliteConnection, id: &str, at_ms: i64) -> Written {
    let result =
        sqlx::query("UPDATE jobs SET state = 'running', started_at_ms = $2 WHERE id = $1 AND state = 'queued'")
            .bind(id)
            .bind(at_ms)
            .execute(&mut *to)
            .await?;
    moved(to, result.rows_affected(), id, "only a queued job can start").await
}

pub async fn checkpoint(
    to: &mut SqliteConnection,
    id: &str,
    progress: f64,
    message: &str,
    checkpoint: Option<&Value>,
) -> Written {
    let result = sqlx::query(
        "UPDATE jobs SET progress = $2, message = $3, checkpoint = COALESCE($4, checkpoint)
         WHERE id = $1 AND state = 'running'",
    )
    .bind(id)
    .bind(progress)
    .bind(message)
    .bind(checkpoint.map(Value::to_string))
    .execute(&mut *to)
    .await?;
    moved(to, result.rows_affected(), id, "only a running job makes progress").await
}

pub async fn end(to: &mut SqliteConnection, id: &str, outcome: &JobOutcome, message: &str, at_ms: i64) -> Written {
    let (state, made, problem) = match outcome {
        JobOutcome::Succeeded(made) => (JobState::Succeeded, Some(made), None),
        JobOutcome::Failed(problem) => (JobState::Failed, None, Some(problem)),
        JobOutcome::Cancelled => (JobState::Cancelled, None, None),
        JobOutcome::Interrupted => (JobState::Interrupted, None, None),
    };
    let result = sqlx::query(
        "UPDATE jobs SET state = $2, message = $3, ended_at_ms = $4, result_kind = $5, result_id = $6, problem = $7,
             progress = CASE WHEN $2 = 'succeeded' THEN 1.0 ELSE progress END
         WHERE id = $1 AND state IN ('queued', 'running')",
    )
    .bind(id)
    .bind(word_from(state))
    .bind(message)
    .bind(at_ms)
    .bind(made.map(|made| &made.kind))
    .bind(made.map(|made| &made.id))
    .bind(problem.map(Value::to_string))
    .execute(&mut *to)
    .await?;
    moved(to, result.rows_affected(), id, "a job can end only once").await
}

/// Queued and running jobs are kept regardless of age. Ids are ordered by time.
pub async fn prune_ended(to: &mut SqliteConnection, before_ms: i64, keep_newest: u32) -> Written {
    sqlx::query(
        "DELETE FROM jobs WHERE state NOT IN ('queued', 'running')
             AND (ended_at_ms < $1 OR id <= (SELECT id FROM jobs ORDER BY id DESC LIMIT 1 OFFSET $2))",
    )
    .bind(before_ms)
    .bind(keep_newest)
    .execute(to)
    .await?;
    Ok(())
}

/// Returns why the state of a job could not be changed.
async fn moved(to: &mut SqliteConnection, n_rows: u64, id: &str, rule: &str) -> Written {
    if n_rows > 0 {
        return Ok(());
    }
    let id = id.to_owned();
    let state: Option<String> =
        sqlx::query_scalar("SELECT state FROM jobs WHERE id = $1").bind(&id).fetch_optional(to).await?;
    Err(match state {
        None => StoreError::NotFound { kind: KIND, id },
        Some(state) => StoreError::Refused { kind: KIND, id, why: format!("is {state}: {rule}"), remedy: None },
    }
    .into())
}
