//! The catalogue with notifications: every commit wakes the followers of events and the sweep of unreferenced
//! artifacts.

use std::sync::Arc;

use store::{Catalogue, Change, EventRecord, StoreError};
use tokio::sync::{Notify, watch};

/// The catalogue, and a notification when events were added.
#[derive(Clone)]
pub struct EventedCatalogue {
    catalogue: Arc<dyn Catalogue>,
    newest_event: watch::Sender<i64>,
    artifacts_left: Arc<Notify>,
}

impl EventedCatalogue {
    /// Wraps a catalogue.
    pub async fn open(catalogue: Arc<dyn Catalogue>) -> Result<Self, StoreError> {
        let seq = catalogue.last_event_seq().await?;
        Ok(Self { catalogue, newest_event: watch::Sender::new(seq), artifacts_left: Arc::default() })
    }

    /// Read access.
    pub fn read(&self) -> &dyn Catalogue {
        &*self.catalogue
    }

    /// Commits all changes or none, and wakes the followers of events.
    pub async fn commit(&self, changes: Vec<Change>) -> Result<Vec<EventRecord>, StoreError> {
        let leaves_artifacts = changes.iter().any(Change::leaves_artifacts);
        let events = self.catalogue.commit(changes).await?;
        if leaves_artifacts {
            self.artifacts_left.notify_one();
        }
        if let Some(last) = events.last() {
            self.newest_event.send_if_modified(|seq| {
                let grown = last.seq > *seq;
                *seq = last.seq.max(*seq);
                grown
            });
        }
        Ok(events)
    }

    /// Returns once records were changed or deleted so that their artifacts may no longer be referenced, since the last
    /// time it returned. One task waits.
    pub async fn artifacts_left(&self) {
        self.artifacts_left.notified().await;
    }

    /// Sequence of the newest event; followers read the events from the catalogue, so that none is missed or duplicated.
    pub fn watch_events(&self) -> watch::Receiver<i64> {
        self.newest_event.subscribe()
    }
}
