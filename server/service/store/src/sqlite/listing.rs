//! Lists of intact records that also report damaged rows.

use std::pin::Pin;

use futures_util::{Stream, TryStreamExt};
use sqlx::sqlite::SqliteRow;

use crate::catalogue::{DamagedRow, Listed};
use crate::error::StoreError;
use crate::sqlite::error::reading;

/// Rows as they come from the database.
pub type Rows<'a> = Pin<Box<dyn Stream<Item = Result<SqliteRow, sqlx::Error>> + Send + 'a>>;

/// Reads rows until `limit` records satisfy `wanted` or there are no more rows.
///
/// The key of a damaged row cannot be trusted: the next page starts below the last intact record, so that no record is
/// listed twice or skipped.
pub async fn listed<T>(
    mut rows: Rows<'_>,
    limit: u32,
    what: &'static str,
    from_row: impl Fn(&SqliteRow) -> Result<T, StoreError>,
    wanted: impl Fn(&T) -> bool,
    key: impl Fn(&T) -> String,
) -> Result<Listed<T>, StoreError> {
    let mut list = Listed { records: Vec::new(), damaged: Vec::new(), next: None };
    while let Some(row) = rows.try_next().await.map_err(|cause| reading(cause, what))? {
        match from_row(&row) {
            Ok(record) if wanted(&record) => list.records.push(record),
            Ok(_) => {}
            Err(StoreError::DamagedRecord { kind, id }) => list.damaged.push(DamagedRow { kind, id }),
            Err(error) => return Err(error),
        }
        if list.records.len() as u64 >= u64::from(limit) {
            list.next = list.records.last().map(&key);
            break;
        }
    }
    Ok(list)
}

/// For lists without a filter beyond their query.
pub fn every<T>(_: &T) -> bool {
    true
}
