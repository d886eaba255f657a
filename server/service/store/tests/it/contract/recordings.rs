use serde_json::json;
use store::{Change, RecordingState, StoreError};

use super::stores;
use crate::common::{artifact, first, recording};

#[tokio::test]
async fn a_recording_is_stored_finished_and_deleted_with_its_file() {
    for fresh in stores().await {
        let catalogue = &fresh.store.catalogue;
        let begun = recording();
        catalogue.commit(vec![Change::InsertRecording(begun.clone())]).await.unwrap();
        assert_eq!(catalogue.recording(&begun.id).await.unwrap(), begun);
        assert!(!catalogue.artifacts_named().await.unwrap().contains(&artifact('e')));
        let twice = catalogue.commit(vec![Change::InsertRecording(begun.clone())]).await.unwrap_err();
        assert!(matches!(twice, StoreError::Exists { kind: "recording", .. }));

        let mut ended = begun;
        (ended.state, ended.file, ended.size_bytes) = (RecordingState::Complete, Some(artifact('e')), 5 << 30);
        ended.summary = json!({ "n_frames": 7 });
        catalogue.commit(vec![Change::UpdateRecording(ended.clone())]).await.unwrap();
        assert_eq!(catalogue.recordings(&first(9)).await.unwrap().records, [ended.clone()]);
        assert!(catalogue.artifacts_named().await.unwrap().contains(&artifact('e')), "its file is kept");

        catalogue.commit(vec![Change::DeleteRecording(ended.id.clone())]).await.unwrap();
        assert!(!catalogue.artifacts_named().await.unwrap().contains(&artifact('e')), "its file is free");
        let gone = catalogue.commit(vec![Change::UpdateRecording(ended.clone())]).await.unwrap_err();
        assert!(matches!(gone, StoreError::NotFound { kind: "recording", .. }));
        let gone = catalogue.commit(vec![Change::DeleteRecording(ended.id)]).await.unwrap_err();
        assert!(matches!(gone, StoreError::NotFound { kind: "recording", .. }));
    }
}
