//! Settings.

use sqlx::sqlite::SqliteRow;
use sqlx::{SqliteConnection, SqlitePool};

use crate::error::StoreError;
use crate::records::SettingRecord;
use crate::sqlite::changes::Written;
use crate::sqlite::error::reading;
use crate::sqlite::row::{get, json};
use crate::sqlite::seal;

fn from_row(row: &SqliteRow) -> Result<SettingRecord, StoreError> {
    seal::intact(row, &seal::SETTINGS)?;
    Ok(SettingRecord {
        name: get(row, "name")?,
        value: json(row, "value")?,
        changed_at_ms: get(row, "changed_at_ms")?,
    })
}

pub async fn one(readers: &SqlitePool, name: &str) -> Result<Option<SettingRecord>, StoreError> {
    let row = sqlx::query("SELECT * FROM settings WHERE name = $1").bind(name).fetch_optional(readers).await;
    row.map_err(|cause| reading(cause, "read a setting"))?.as_ref().map(from_row).transpose()
}

pub async fn put(to: &mut SqliteConnection, setting: &SettingRecord) -> Written {
    sqlx::query(
        "INSERT INTO settings (name, value, changed_at_ms) VALUES ($1, $2, $3)
         ON CONFLICT (name) DO UPDATE SET value = $2, changed_at_ms = $3",
    )
    .bind(&setting.name)
    .bind(setting.value.to_string())
    .bind(setting.changed_at_ms)
    .execute(to)
    .await?;
    Ok(())
}
