//! Events, devices, stage, lines and profiles during a recording, queued as notes.

use std::sync::Arc;
use std::time::Duration;

use live::pace::Pace;
use live::{LiveBus, StreamKind};
use station::{MachineState, OperationalState, StationHandle, StationStatus};

use crate::evented_catalogue::EventedCatalogue;
use crate::recordings::notes::{Note, Notes, event_note, peaks_note, profile_note, settings_note, stage_note};
use crate::recordings::params::PROFILES_HZ;

/// Number of events read at a time.
const EVENTS: u32 = 100;

/// Minimum interval of notes about a moving stage: positions in between are in the frames.
const STAGE_EVERY: Duration = Duration::from_millis(20);

/// Notes every event that comes after this call.
pub fn events(catalogue: EventedCatalogue, notes: Notes) -> impl Future<Output = ()> + Send + 'static {
    let mut newest = catalogue.watch_events();
    let mut seen = *newest.borrow_and_update();
    async move {
        while newest.changed().await.is_ok() {
            match catalogue.read().events_after(seen, EVENTS).await {
                Ok(listed) => {
                    for event in listed.records {
                        seen = seen.max(event.seq);
                        let (at_ns, note) = event_note(&event);
                        notes.add_at(at_ns, note);
                    }
                }
                Err(error) => tracing::warn!(%error, "events could not be read for the recording"),
            }
        }
    }
}

/// Notes devices and stage: first the current state, then changes.
pub async fn devices(station: StationHandle, notes: Notes) {
    let mut status = station.watch_status();
    let mut last: Option<Arc<StationStatus>> = None;
    loop {
        let now = status.borrow_and_update().clone();
        if last.as_ref().is_none_or(|last| are_set_differently(last, &now)) {
            notes.add(Note::Settings(Box::new(settings_note(&now))));
        }
        if last.as_ref().is_none_or(|last| stage_note(last) != stage_note(&now)) {
            notes.add(Note::Stage(stage_note(&now)));
        }
        last = Some(now);
        tokio::time::sleep(STAGE_EVERY).await;
        if status.changed().await.is_err() {
            return;
        }
    }
}

fn are_set_differently(before: &StationStatus, now: &StationStatus) -> bool {
    let of = |status: &StationStatus| {
        (status.camera.connected, status.stage.connected, status.laser.connected, status.laser_power)
    };
    of(before) != of(now)
        || before.camera_settings != now.camera_settings
        || before.interlock_closed != now.interlock_closed
        || before.camera.identity != now.camera.identity
}

/// Notes lines and profiles at a limited rate; during a live view they are computed for this purpose.
pub async fn profiles(live: LiveBus, notes: Notes) {
    let _wish = live.subscribe(StreamKind::Profile, PROFILES_HZ);
    let mut frames = live.watch_frames();
    // The existing one is older.
    frames.borrow_and_update();
    let mut pace = Pace::new(PROFILES_HZ, tokio::time::Instant::now());
    while frames.changed().await.is_ok() {
        tokio::time::sleep_until(pace.opens()).await;
        pace.pass(tokio::time::Instant::now());
        let Some(frame) = frames.borrow_and_update().clone() else { continue };
        let at_ns = notes.clock().at_ns(frame.frame.captured_at);
        let (peaks, profile) = (peaks_note(&frame), profile_note(&frame));
        // It holds a buffer of the station.
        drop(frame);
        notes.add_at(at_ns, Note::Peaks(peaks));
        if let Some(points) = profile {
            notes.add_at(at_ns, Note::Profile(points));
        }
    }
}

/// Waits for the end of the live view.
pub async fn end_of_live_view(station: StationHandle) {
    let mut status = station.watch_status();
    let runs = |status: &Arc<StationStatus>| {
        status.state == MachineState::Operational(OperationalState::ContinuousExecution)
    };
    // A terminated station has no live view either.
    let _ = status.wait_for(|status| !runs(status)).await;
}
