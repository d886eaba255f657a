use std::collections::HashSet;
use std::io::{Read as _, Seek as _, SeekFrom};

use sha2::{Digest, Sha256};
use store::{ArtifactId, ArtifactReader, Change, FinishedFile, StoreError};
use tokio::io::AsyncReadExt;

use super::stores;
use crate::common::{artifact, capture, job, session};

fn hash_of(bytes: &[u8]) -> ArtifactId {
    let hex: String = Sha256::digest(bytes).iter().map(|byte| format!("{byte:02x}")).collect();
    ArtifactId::parse(&hex).unwrap()
}

async fn all(mut reader: ArtifactReader) -> std::io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    reader.bytes.read_to_end(&mut bytes).await?;
    assert_eq!(bytes.len() as u64, reader.size_bytes);
    Ok(bytes)
}

/// Some bytes, none of which repeats where a chunk ends.
fn bytes_of(n_bytes: usize) -> Vec<u8> {
    (0..n_bytes).map(|i| (i * 31 + i / 251) as u8).collect()
}

#[tokio::test]
async fn an_artifact_is_stored_under_its_hash_and_read_back() {
    for fresh in stores().await {
        let artifacts = &fresh.store.artifacts;
        for n_bytes in [0, 1, 5_000, 3 * 1024 * 1024 + 17] {
            let bytes = bytes_of(n_bytes);
            let id = artifacts.put(&bytes).await.unwrap();
            assert_eq!(id, hash_of(&bytes));
            assert_eq!(artifacts.read(&id).await.unwrap(), bytes);
            assert_eq!(all(artifacts.open(&id).await.unwrap()).await.unwrap(), bytes);
            assert_eq!(artifacts.put(&bytes).await.unwrap(), id, "the same content again is the same artifact");
        }
    }
}

#[tokio::test]
async fn a_writer_takes_pieces_of_any_size_and_leaves_nothing_when_dropped() {
    for fresh in stores().await {
        let artifacts = &fresh.store.artifacts;
        let bytes = bytes_of(5_000_000);
        let mut writer = artifacts.create().await.unwrap();
        for piece in [&bytes[..1], &bytes[1..2_600_000], &[], &bytes[2_600_000..]] {
            writer.write(piece).await.unwrap();
        }
        let id = writer.finish().await.unwrap();
        assert_eq!(artifacts.read(&id).await.unwrap(), bytes);

        let mut dropped = artifacts.create().await.unwrap();
        dropped.write(&bytes_of(2_000_000)).await.unwrap();
        drop(dropped);
        assert_eq!(std::fs::read_dir(artifacts.workbench().scratch()).unwrap().count(), 0);
        let missing = artifacts.read(&hash_of(&bytes_of(2_000_000))).await.unwrap_err();
        assert!(matches!(missing, StoreError::NotFound { kind: "artifact", .. }));
    }
}

#[tokio::test]
async fn an_artifact_can_be_read_at_any_offset_concurrently() {
    for fresh in stores().await {
        let artifacts = &fresh.store.artifacts;
        let bytes = bytes_of(300_000);
        let id = artifacts.put(&bytes).await.unwrap();
        let mut first = artifacts.bytes(&id).await.unwrap();
        assert_eq!(first.size_bytes(), 300_000);
        let mut part = [0; 1_000];
        first.seek(SeekFrom::Start(200_000)).unwrap();
        // Another place in the same bytes, on another thread.
        let mut second = first.clone();
        std::thread::spawn(move || second.seek(SeekFrom::End(-1)).unwrap()).join().unwrap();
        first.read_exact(&mut part).unwrap();
        assert_eq!(part, bytes[200_000..201_000]);
        first.seek(SeekFrom::Current(-2_000)).unwrap();
        first.read_exact(&mut part).unwrap();
        assert_eq!(part, bytes[199_000..200_000]);
        let mut all = Vec::new();
        first.from_start().read_to_end(&mut all).unwrap();
        assert_eq!(all, bytes);
        first.seek(SeekFrom::Start(300_001)).unwrap();
        assert_eq!(first.read(&mut part).unwrap(), 0, "behind the last byte");
        assert!(first.seek(SeekFrom::End(-300_001)).is_err(), "before the first byte");
        let missing = artifacts.bytes(&hash_of(b"nothing")).await.unwrap_err();
        assert!(matches!(missing, StoreError::NotFound { .. }), "{missing:?}");
    }
}

#[tokio::test]
async fn a_scratch_file_is_adopted_and_a_file_from_elsewhere_is_not() {
    for fresh in stores().await {
        let artifacts = &fresh.store.artifacts;
        let bytes = bytes_of(2_345_678);
        let file = artifacts.workbench().scratch().join("archive");
        std::fs::write(&file, &bytes).unwrap();
        let id = artifacts.adopt(FinishedFile::at(&file)).await.unwrap();
        assert_eq!(artifacts.read(&id).await.unwrap(), bytes);
        assert!(!file.exists());

        let elsewhere = tempfile::tempdir().unwrap();
        let foreign = elsewhere.path().join("passwords");
        std::fs::write(&foreign, "secret").unwrap();
        std::os::unix::fs::symlink(&foreign, artifacts.workbench().scratch().join("link")).unwrap();
        let climbing = artifacts.workbench().scratch().join("../catalogue.sqlite3");
        for path in [foreign.clone(), artifacts.workbench().scratch().join("link"), climbing] {
            assert!(matches!(
                artifacts.adopt(FinishedFile::at(&path)).await.unwrap_err(),
                StoreError::File { what: "adopt", .. }
            ));
        }
        assert!(foreign.exists());
    }
}

#[tokio::test]
async fn many_tasks_may_store_the_same_bytes() {
    for fresh in stores().await {
        let bytes = bytes_of(300_000);
        let puts: Vec<_> = (0..16)
            .map(|_| {
                let (artifacts, bytes) = (fresh.store.artifacts.clone(), bytes.clone());
                tokio::spawn(async move { artifacts.put(&bytes).await })
            })
            .collect();
        for put in puts {
            assert_eq!(put.await.unwrap().unwrap(), hash_of(&bytes));
        }
        assert_eq!(fresh.store.artifacts.read(&hash_of(&bytes)).await.unwrap(), bytes);
    }
}

#[tokio::test]
async fn a_sweep_deletes_artifacts_that_are_no_longer_referenced() {
    for fresh in stores().await {
        let (catalogue, artifacts) = (&fresh.store.catalogue, &fresh.store.artifacts);
        let archive = artifacts.put(&bytes_of(1_000)).await.unwrap();
        let picture = artifacts.put(&bytes_of(2_000)).await.unwrap();
        let on_its_way = artifacts.put(&bytes_of(4_000)).await.unwrap();
        let mut capture = capture();
        capture.archive = archive.clone();
        let mut session = session();
        session.body = serde_json::json!({"pictures": [{"artifact": picture.as_str()}]});
        let mut job = job();
        job.checkpoint = Some(serde_json::json!({"rows": artifact('9').as_str()}));
        let changes = vec![
            Change::InsertCapture(capture.clone()),
            Change::InsertSession(session.clone()),
            Change::InsertJob(job),
        ];
        catalogue.commit(changes).await.unwrap();
        let named = catalogue.artifacts_named().await.unwrap();
        assert_eq!(named, HashSet::from([archive.clone(), picture.clone(), artifact('9')]));

        assert_eq!(fresh.store.sweep_unreferenced(|_| HashSet::new()).await.unwrap(), 0);
        let changes = vec![Change::DeleteCapture(capture.id), Change::DeleteSession(session.id)];
        catalogue.commit(changes).await.unwrap();
        assert_eq!(fresh.store.sweep_unreferenced(|_| HashSet::new()).await.unwrap(), 3_000);
        for gone in [archive, picture] {
            assert!(matches!(artifacts.read(&gone).await.unwrap_err(), StoreError::NotFound { .. }));
        }
        assert_eq!(artifacts.read(&on_its_way).await.unwrap(), bytes_of(4_000), "its record may still come");
    }
}

#[tokio::test]
async fn an_artifact_stored_twice_is_kept_until_both_records_were_deleted() {
    for fresh in stores().await {
        let (catalogue, artifacts) = (&fresh.store.catalogue, &fresh.store.artifacts);
        let sweep = async || fresh.store.sweep_unreferenced(|_| HashSet::new()).await.unwrap();
        let [mut one, mut other] = [capture(), capture()];
        for record in [&mut one, &mut other] {
            record.archive = artifacts.put(&bytes_of(1_000)).await.unwrap();
        }
        catalogue.commit(vec![Change::InsertCapture(one.clone())]).await.unwrap();
        catalogue.commit(vec![Change::DeleteCapture(one.id)]).await.unwrap();
        assert_eq!(sweep().await, 0, "the other record is still to come");
        catalogue.commit(vec![Change::InsertCapture(other.clone())]).await.unwrap();
        assert_eq!(sweep().await, 0);
        catalogue.commit(vec![Change::DeleteCapture(other.id)]).await.unwrap();
        assert_eq!(sweep().await, 1_000);
    }
}

#[tokio::test]
async fn an_artifact_held_for_a_new_record_is_kept_and_a_changed_record_releases_each_hold_once() {
    for fresh in stores().await {
        let (catalogue, artifacts) = (&fresh.store.catalogue, &fresh.store.artifacts);
        let sweep = async || fresh.store.sweep_unreferenced(|_| HashSet::new()).await.unwrap();
        let id = artifacts.put(&bytes_of(1_000)).await.unwrap();
        let mut session = session();
        session.body = serde_json::json!({"pictures": [{"artifact": id.as_str()}]});
        catalogue.commit(vec![Change::InsertSession(session.clone())]).await.unwrap();
        artifacts.hold(&id).await.unwrap();
        session.version += 1;
        catalogue.commit(vec![Change::UpdateSession(session.clone())]).await.unwrap();
        catalogue.commit(vec![Change::DeleteSession(session.id)]).await.unwrap();
        assert_eq!(sweep().await, 0, "who holds it will name it");
        artifacts.release(&id);
        assert_eq!(sweep().await, 1_000);
        assert!(matches!(artifacts.hold(&id).await.unwrap_err(), StoreError::NotFound { .. }));
    }
}

#[tokio::test]
async fn artifacts_referenced_by_caches_are_kept_like_those_of_records() {
    for fresh in stores().await {
        let (catalogue, artifacts) = (&fresh.store.catalogue, &fresh.store.artifacts);
        let mut capture = capture();
        capture.archive = artifacts.put(&bytes_of(1_000)).await.unwrap();
        let exported = artifacts.put(&bytes_of(2_000)).await.unwrap();
        catalogue.commit(vec![Change::InsertCapture(capture.clone())]).await.unwrap();
        artifacts.release(&exported);
        let sweep = async || {
            let (origin, exported) = (capture.archive.clone(), exported.clone());
            let also = move |named: &HashSet<ArtifactId>| {
                named.contains(&origin).then_some(exported).into_iter().collect()
            };
            fresh.store.sweep_unreferenced(also).await.unwrap()
        };
        assert_eq!(sweep().await, 0);
        catalogue.commit(vec![Change::DeleteCapture(capture.id.clone())]).await.unwrap();
        assert_eq!(sweep().await, 3_000);
    }
}

/// Makers of the same few artifacts, their records deleted again and again, under one sweep after the other.
#[tokio::test(flavor = "multi_thread")]
async fn a_sweep_keeps_artifacts_stored_or_referenced_meanwhile() {
    const N_MAKERS: u8 = 4;
    const N_TURNS: u8 = 25;
    for fresh in stores().await {
        let store = std::sync::Arc::new(fresh.store);
        let makers: Vec<_> = (0..N_MAKERS)
            .map(|maker| {
                let store = store.clone();
                tokio::spawn(async move {
                    for turn in 0..N_TURNS {
                        let mut record = capture();
                        let bytes = vec![turn % 3; 1_000];
                        record.archive = store.artifacts.put(&bytes).await.unwrap();
                        tokio::task::yield_now().await;
                        store.catalogue.commit(vec![Change::InsertCapture(record.clone())]).await.unwrap();
                        let read = store.artifacts.read(&record.archive).await;
                        assert_eq!(read.unwrap(), bytes, "maker {maker}, turn {turn}");
                        store.catalogue.commit(vec![Change::DeleteCapture(record.id)]).await.unwrap();
                    }
                })
            })
            .collect();
        while !makers.iter().all(tokio::task::JoinHandle::is_finished) {
            store.sweep_unreferenced(|_| HashSet::new()).await.unwrap();
        }
        for maker in makers {
            maker.await.unwrap();
        }
        store.sweep_unreferenced(|_| HashSet::new()).await.unwrap();
        for byte in 0..3 {
            assert!(store.artifacts.read(&hash_of(&vec![byte; 1_000])).await.is_err(), "nobody names it");
        }
    }
}
