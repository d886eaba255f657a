//! Tests of internals: size of the log, a database on a full disk.

use std::sync::Arc;

use sqlx::AssertSqlSafe;

use crate::catalogue::{Catalogue, Change};
use crate::error::StoreError;
use crate::files::reserve::Reserve;
use crate::health::Health;
use crate::params::WAL_LIMIT_BYTES;
use crate::records::EventRecord;
use crate::sqlite::SqliteCatalogue;

const BODY_BYTES: usize = 60_000;

fn big_event() -> Change {
    let body = serde_json::Value::from("x".repeat(BODY_BYTES));
    Change::AppendEvent(EventRecord { seq: 0, kind: "big".into(), subject: "x".into(), body, at_ms: 0 })
}

async fn catalogue(folder: &std::path::Path) -> SqliteCatalogue {
    std::fs::create_dir_all(folder.join(crate::params::BACKUPS_FOLDER)).unwrap();
    SqliteCatalogue::open(folder, Arc::new(Health::default()), Arc::default(), Reserve::new(folder)).await.unwrap()
}

#[tokio::test(flavor = "multi_thread")]
async fn the_log_stays_small_while_others_read() {
    let folder = tempfile::tempdir().unwrap();
    let catalogue = catalogue(folder.path()).await;
    let reader = tokio::spawn({
        let catalogue = catalogue.clone();
        async move {
            loop {
                catalogue.events_after(0, 20).await.unwrap();
            }
        }
    });
    let mut largest_bytes = 0;
    for _ in 0..300 {
        catalogue.commit(vec![big_event()]).await.unwrap();
        largest_bytes = largest_bytes.max(std::fs::metadata(&catalogue.wal).unwrap().len());
    }
    reader.abort();
    // The last commit before a fold may go over the limit by its own size, with pages and indexes at most twice.
    assert!(largest_bytes < WAL_LIMIT_BYTES + 2 * BODY_BYTES as u64, "{largest_bytes}");
    assert!(largest_bytes > WAL_LIMIT_BYTES / 2, "the log was never used");
}

#[tokio::test]
async fn a_full_database_is_reported_and_works_again_with_free_space() {
    let folder = tempfile::tempdir().unwrap();
    let catalogue = catalogue(folder.path()).await;
    let limit = async |n_pages: u32| {
        let pragma = format!("PRAGMA max_page_count = {n_pages}");
        sqlx::raw_sql(AssertSqlSafe(pragma)).execute(&mut *catalogue.writer.lock().await).await.unwrap();
    };
    limit(100).await;
    let mut n_stored = 0;
    let error = loop {
        match catalogue.commit(vec![big_event()]).await {
            Ok(_) => n_stored += 1,
            Err(error) => break error,
        }
    };
    assert!(matches!(error, StoreError::Full), "{error}");
    assert!(!catalogue.health.is_read_only());
    assert_eq!(catalogue.last_event_seq().await.unwrap(), n_stored);
    catalogue.commit(vec![Change::PruneEventsThrough { seq: 1 }]).await.expect("deleting works when it is full");
    limit(1_000).await;
    let stored = catalogue.commit(vec![big_event()]).await.unwrap();
    assert_eq!(stored[0].seq, n_stored + 1);
}

#[tokio::test]
async fn records_of_a_database_without_seals_are_sealed_and_read() {
    use sqlx::{ConnectOptions, Connection};

    let folder = tempfile::tempdir().unwrap();
    let first = folder.path().join("first");
    std::fs::create_dir(&first).unwrap();
    std::fs::write(first.join("0001_station.sql"), include_str!("../../migrations/0001_station.sql")).unwrap();
    let file = folder.path().join("catalogue.sqlite3");
    let mut connection = super::connect_options(&file).connect().await.unwrap();
    sqlx::migrate::Migrator::new(first.as_path())
        .await
        .unwrap()
        .run_direct(None, &mut connection, false)
        .await
        .unwrap();
    let rows = r#"INSERT INTO sessions VALUES ('s1', 3, '{"step":2}', 5, 6);
                  INSERT INTO events VALUES (1, 'job.queued', 'j1', '{}', 7);
                  UPDATE sequences SET value = 1 WHERE name = 'event';"#;
    sqlx::raw_sql(rows).execute(&mut connection).await.unwrap();
    connection.close().await.unwrap();

    for _ in ["migrated", "opened again"] {
        let catalogue = catalogue(folder.path()).await;
        assert_eq!(catalogue.session("s1").await.unwrap().body, serde_json::json!({"step": 2}));
        assert_eq!(catalogue.events_after(0, 9).await.unwrap().records[0].subject, "j1");
        assert_eq!(catalogue.last_event_seq().await.unwrap(), 1);
        catalogue.close().await;
    }
}
