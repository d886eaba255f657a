//! CAD models: one file each.

use sqlx::sqlite::SqliteRow;
use sqlx::{SqliteConnection, SqlitePool};

use crate::catalogue::{Listed, Page};
use crate::error::StoreError;
use crate::records::ModelRecord;
use crate::sqlite::changes::{Written, inserted, met};
use crate::sqlite::error::reading;
use crate::sqlite::listing::{every, listed};
use crate::sqlite::row::{artifact, before_id, get, json, size_bytes};
use crate::sqlite::seal;

const KIND: &str = "model";

fn from_row(row: &SqliteRow) -> Result<ModelRecord, StoreError> {
    seal::intact(row, &seal::MODELS)?;
    Ok(ModelRecord {
        id: get(row, "id")?,
        name: get(row, "name")?,
        file: artifact(row, "file")?,
        size_bytes: size_bytes(row, "size_bytes")?,
        summary: json(row, "summary")?,
        created_at_ms: get(row, "created_at_ms")?,
    })
}

pub async fn one(readers: &SqlitePool, id: &str) -> Result<ModelRecord, StoreError> {
    let row = sqlx::query("SELECT * FROM models WHERE id = $1").bind(id).fetch_optional(readers).await;
    match row.map_err(|cause| reading(cause, "read a model"))? {
        Some(row) => from_row(&row),
        None => Err(StoreError::NotFound { kind: KIND, id: id.to_owned() }),
    }
}

pub async fn page(readers: &SqlitePool, page: &Page) -> Result<Listed<ModelRecord>, StoreError> {
    let rows =
        sqlx::query("SELECT * FROM models WHERE id < $1 ORDER BY id DESC").bind(before_id(page)).fetch(readers);
    listed(rows, page.limit, "list models", from_row, every, |model| model.id.clone()).await
}

pub async fn insert(to: &mut SqliteConnection, model: &ModelRecord) -> Written {
    let result = sqlx::query(
        "INSERT INTO models (id, name, file, size_bytes, summary, created_at_ms)
         VALUES ($1, $2, $3, $4, $5, $6) ON CONFLICT (id) DO NOTHING",
    )
    .bind(&model.id)
    .bind(&model.name)
    .bind(model.file.as_str())
    .bind(model.size_bytes.cast_signed())
    .bind(model.summary.to_string())
    .bind(model.created_at_ms)
    .execute(to)
    .await?;
    inserted(result, KIND, &model.id)
}

pub async fn delete(to: &mut SqliteConnection, id: &str) -> Written {
    let result = sqlx::query("DELETE FROM models WHERE id = $1").bind(id).execute(to).await?;
    met(result, KIND, id)
}
