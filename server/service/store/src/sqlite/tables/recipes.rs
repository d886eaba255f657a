//! Recipes and their versions.

use sqlx::sqlite::SqliteRow;
use sqlx::{SqliteConnection, SqlitePool};

use crate::catalogue::{Listed, Page, RecipeFilter};
use crate::error::StoreError;
use crate::records::{RecipeRecord, RecipeVersionRecord};
use crate::sqlite::changes::{Written, inserted, next};
use crate::sqlite::error::reading;
use crate::sqlite::listing::{every, listed};
use crate::sqlite::row::{get, json};
use crate::sqlite::seal;

const KIND: &str = "recipe";

/// The key of a version.
pub fn key_of(id: &str, version: i64) -> String {
    format!("{id}@{version}")
}

fn from_row(row: &SqliteRow) -> Result<RecipeRecord, StoreError> {
    seal::intact(row, &seal::RECIPES)?;
    Ok(RecipeRecord {
        id: get(row, "id")?,
        newest: get(row, "newest")?,
        number: get(row, "number")?,
        archived: get::<i64>(row, "archived")? != 0,
    })
}

fn version_from_row(row: &SqliteRow) -> Result<RecipeVersionRecord, StoreError> {
    seal::intact(row, &seal::RECIPE_VERSIONS)?;
    Ok(RecipeVersionRecord {
        recipe_id: get(row, "recipe_id")?,
        version: get(row, "version")?,
        content: json(row, "content")?,
        digest: get(row, "digest")?,
        author: get(row, "author")?,
        reason: get(row, "reason")?,
        restored_from: get(row, "restored_from")?,
        created_at_ms: get(row, "created_at_ms")?,
    })
}

async fn row_of(readers: &SqlitePool, id: &str) -> Result<SqliteRow, StoreError> {
    let row = sqlx::query("SELECT * FROM recipes WHERE id = $1").bind(id).fetch_optional(readers).await;
    let row = row.map_err(|cause| reading(cause, "read a recipe"))?;
    row.ok_or_else(|| StoreError::NotFound { kind: KIND, id: id.to_owned() })
}

pub async fn one(readers: &SqlitePool, id: &str) -> Result<RecipeRecord, StoreError> {
    from_row(&row_of(readers, id).await?)
}

/// In order of creation: the ids are chosen by users.
pub async fn page(
    readers: &SqlitePool,
    filter: &RecipeFilter,
    page: &Page,
) -> Result<Listed<RecipeRecord>, StoreError> {
    let before: i64 = match &page.before {
        None => i64::MAX,
        Some(id) => {
            let row = row_of(readers, id).await?;
            seal::intact(&row, &seal::RECIPES)?;
            get(&row, "position")?
        }
    };
    let rows = sqlx::query(
        "SELECT * FROM recipes
         WHERE position < $1 AND ($2 IS NULL OR archived = $2) AND ($3 IS NULL OR number = $3)
         ORDER BY position DESC",
    )
    .bind(before)
    .bind(filter.archived.map(i64::from))
    .bind(filter.number)
    .fetch(readers);
    listed(rows, page.limit, "list recipes", from_row, every, |recipe| recipe.id.clone()).await
}

pub async fn version(readers: &SqlitePool, id: &str, version: i64) -> Result<RecipeVersionRecord, StoreError> {
    let key = key_of(id, version);
    let row = sqlx::query("SELECT * FROM recipe_versions WHERE key = $1").bind(&key).fetch_optional(readers).await;
    match row.map_err(|cause| reading(cause, "read a version of a recipe"))? {
        Some(row) => version_from_row(&row),
        None => Err(StoreError::NotFound { kind: KIND, id: key }),
    }
}

pub async fn versions(
    readers: &SqlitePool,
    id: &str,
    page: &Page,
) -> Result<Listed<RecipeVersionRecord>, StoreError> {
    let before = page.before.as_deref().map_or(Some(i64::MAX), |version| version.parse().ok());
    let before = before.ok_or_else(|| StoreError::NotFound {
        kind: KIND,
        id: format!("{id}@{}", page.before.as_deref().unwrap_or("")),
    })?;
    let rows =
        sqlx::query("SELECT * FROM recipe_versions WHERE recipe_id = $1 AND version < $2 ORDER BY version DESC")
            .bind(id)
            .bind(before)
            .fetch(readers);
    let what = "list the versions of a recipe";
    listed(rows, page.limit, what, version_from_row, every, |version| version.version.to_string()).await
}

pub async fn publish(to: &mut SqliteConnection, version: &RecipeVersionRecord, number: Option<i64>) -> Written {
    refuse_taken(to, &version.recipe_id, number).await?;
    if version.version == 1 {
        let position = next(to, KIND).await?;
        let result = sqlx::query(
            "INSERT INTO recipes (id, position, newest, number, archived) VALUES ($1, $2, 1, $3, 0)
             ON CONFLICT (id) DO NOTHING",
        )
        .bind(&version.recipe_id)
        .bind(position)
        .bind(number)
        .execute(&mut *to)
        .await?;
        inserted(result, KIND, &version.recipe_id)?;
    } else {
        follow(to, version, number).await?;
    }
    let key = key_of(&version.recipe_id, version.version);
    let result = sqlx::query(
        "INSERT INTO recipe_versions
             (key, recipe_id, version, content, digest, author, reason, restored_from, created_at_ms)
         VALUES ($1, $2, $3, $4, $5, $6, $7, $8, $9) ON CONFLICT (key) DO NOTHING",
    )
    .bind(&key)
    .bind(&version.recipe_id)
    .bind(version.version)
    .bind(version.content.to_string())
    .bind(&version.digest)
    .bind(&version.author)
    .bind(&version.reason)
    .bind(version.restored_from)
    .bind(version.created_at_ms)
    .execute(to)
    .await?;
    inserted(result, KIND, &key)
}

/// A new version must follow the newest one.
async fn follow(to: &mut SqliteConnection, version: &RecipeVersionRecord, number: Option<i64>) -> Written {
    let result = sqlx::query(
        "UPDATE recipes SET newest = $2, number = $3 WHERE id = $1 AND newest = $2 - 1 AND archived = 0",
    )
    .bind(&version.recipe_id)
    .bind(version.version)
    .bind(number)
    .execute(&mut *to)
    .await?;
    if result.rows_affected() > 0 {
        return Ok(());
    }
    let id = version.recipe_id.clone();
    let archived = sqlx::query_scalar::<_, i64>("SELECT archived FROM recipes WHERE id = $1");
    Err(match archived.bind(&id).fetch_optional(to).await? {
        Some(0) => StoreError::Changed { kind: KIND, id },
        Some(_) => StoreError::Refused {
            kind: KIND,
            id,
            why: "is archived".to_owned(),
            remedy: Some("restore it first, or make another recipe"),
        },
        None => StoreError::NotFound { kind: KIND, id },
    }
    .into())
}

pub async fn archive(to: &mut SqliteConnection, id: &str, archived: bool) -> Written {
    let row = seal::verify(to, &seal::RECIPES, id).await?;
    let Some(row) = row else { return Err(StoreError::NotFound { kind: KIND, id: id.to_owned() }.into()) };
    if !archived {
        refuse_taken(to, id, get(&row, "number")?).await?;
    }
    sqlx::query("UPDATE recipes SET archived = $2 WHERE id = $1")
        .bind(id)
        .bind(i64::from(archived))
        .execute(to)
        .await?;
    Ok(())
}

/// Refuses a number that another recipe in use has.
async fn refuse_taken(to: &mut SqliteConnection, id: &str, number: Option<i64>) -> Written {
    let Some(number) = number else { return Ok(()) };
    let other =
        sqlx::query_scalar::<_, String>("SELECT id FROM recipes WHERE number = $1 AND archived = 0 AND id <> $2");
    match other.bind(number).bind(id).fetch_optional(to).await? {
        None => Ok(()),
        Some(other) => Err(StoreError::Refused {
            kind: KIND,
            id: id.to_owned(),
            why: format!("cannot have the number {number}: recipe {other} has it"),
            remedy: Some("give another number, or archive the other recipe"),
        }
        .into()),
    }
}
