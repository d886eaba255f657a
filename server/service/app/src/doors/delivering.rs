//! The task of a door: reads the log, delivers, and stores how far it is.

use std::collections::VecDeque;
use std::sync::Arc;
use std::time::Duration;

use station::wall_clock::now_ms;
use store::{
    Artifacts, Change, DeliveryFilter, DeliveryRecord, DeliveryState, DoorRecord, EventRecord, StoreError,
};
use tokio::time::Instant;
use tokio_util::sync::CancellationToken;

use crate::doors::OpenDoor;
use crate::doors::delivery::Delivery;
use crate::doors::door::Undelivered;
use crate::doors::filter::is_addressed_to;
use crate::doors::params::{EVENTS_AT_A_TIME, EVENTS_KEPT_FOR_DOORS, STORE_RETRY, YIELDS_AFTER};
use crate::doors::schedule::{jittered, retry_in};
use crate::error::AppError;
use crate::evented_catalogue::EventedCatalogue;
use crate::events::{DeliveryDead, DoorWaiting, EmptyBody, Event, event as event_of};
use crate::resources::inspections::{ReportFormat, inspection_report};

/// Delivers until `closing`. A delivery in progress is then abandoned, and repeated after the next start.
pub async fn run(
    open: Arc<OpenDoor>,
    catalogue: EventedCatalogue,
    artifacts: Arc<dyn Artifacts>,
    closing: CancellationToken,
) {
    let delivering = async {
        let mut task = loop {
            match Delivering::resume(open.clone(), catalogue.clone(), artifacts.clone()).await {
                Ok(task) => break task,
                Err(error) => tracing::error!(door = open.door.name(), %error, "the door cannot be opened"),
            }
            tokio::time::sleep(STORE_RETRY).await;
        };
        task.deliver().await;
    };
    tokio::select! {
        () = closing.cancelled() => {}
        () = delivering => {}
    }
}

struct Delivering {
    open: Arc<OpenDoor>,
    catalogue: EventedCatalogue,
    artifacts: Arc<dyn Artifacts>,
    /// How far the door is; what is stored may lag while the store cannot be written.
    record: DoorRecord,
    /// Events read from the log, after `record.seq`.
    ahead: VecDeque<EventRecord>,
    /// Failed attempts to deliver the first event that the door wants.
    n_failed: u32,
    /// Whether the log says that the door waits.
    waiting_announced: bool,
}

impl Delivering {
    /// From the stored position; a new door starts with the next event.
    async fn resume(
        open: Arc<OpenDoor>,
        catalogue: EventedCatalogue,
        artifacts: Arc<dyn Artifacts>,
    ) -> Result<Self, StoreError> {
        let name = open.door.name().to_owned();
        let record = match catalogue.read().door(&name).await? {
            Some(record) => record,
            None => {
                let seq = catalogue.read().last_event_seq().await?;
                let record = DoorRecord { name, seq, n_delivered: 0, delivered_seq: None, delivered_at_ms: None };
                catalogue.commit(vec![Change::PutDoor(record.clone())]).await?;
                record
            }
        };
        open.attempts.pass(record.seq);
        Ok(Self {
            open,
            catalogue,
            artifacts,
            record,
            ahead: VecDeque::new(),
            n_failed: 0,
            waiting_announced: false,
        })
    }

    async fn deliver(&mut self) {
        let mut newest = self.catalogue.watch_events();
        loop {
            newest.borrow_and_update();
            let until = self.deliver_all().await.unwrap_or_else(|error| {
                tracing::warn!(door = self.record.name, %error, "deliveries are delayed by the store");
                Some(Instant::now() + STORE_RETRY)
            });
            let pause = async {
                match until {
                    Some(at) => tokio::time::sleep_until(at).await,
                    None => std::future::pending().await,
                }
            };
            tokio::select! {
                changed = newest.changed() => if changed.is_err() { return },
                () = self.open.wake.notified() => {}
                () = pause => {}
            }
        }
    }

    /// Delivers all that can be delivered now; returns when to go on if nothing else happens.
    async fn deliver_all(&mut self) -> Result<Option<Instant>, StoreError> {
        loop {
            if let Err(at) = self.open.attempts.may_try() {
                return Ok(at);
            }
            let filter = DeliveryFilter {
                door: self.record.name.clone(),
                state: Some(DeliveryState::Waiting),
                due_at_ms: Some(now_ms()),
            };
            let due = self.catalogue.read().deliveries(&filter, 0, 1).await?.records.pop();
            match due {
                Some(delivery) => self.retry(delivery).await?,
                None if self.find_next().await? => self.deliver_next().await?,
                None => break,
            }
        }
        let next_at_ms = self.catalogue.read().set_aside(&self.record.name).await?.next_at_ms;
        let delay = |at_ms: i64| Duration::from_millis(at_ms.saturating_sub(now_ms()).max(1).unsigned_abs());
        Ok(next_at_ms.map(|at_ms| Instant::now() + delay(at_ms)))
    }

    /// Passes events that the door does not want; whether one is left that it wants.
    async fn find_next(&mut self) -> Result<bool, StoreError> {
        loop {
            while let Some(event) = self.ahead.front() {
                if self.wants(event) {
                    return Ok(true);
                }
                self.record.seq = event.seq;
                self.open.attempts.pass(event.seq);
                self.ahead.pop_front();
            }
            let listed = self.catalogue.read().events_after(self.record.seq, EVENTS_AT_A_TIME).await?;
            for row in listed.damaged {
                tracing::error!(door = self.record.name, event = row.id, "a damaged event is not delivered");
            }
            if listed.records.is_empty() {
                return Ok(false);
            }
            self.ahead = listed.records.into();
        }
    }

    /// Whether the door wants it and is meant; never what is about the door itself, which would go round in circles.
    fn wants(&self, event: &EventRecord) -> bool {
        let is_about_itself = event.subject == self.record.name
            && (event.kind.starts_with("door.") || event.kind.starts_with("delivery."));
        !is_about_itself && is_addressed_to(&self.record.name, event) && self.open.door.wants(event)
    }

    /// Tries to deliver the first event ahead.
    async fn deliver_next(&mut self) -> Result<(), StoreError> {
        let Some(event) = self.ahead.front().cloned() else { return Ok(()) };
        let outcome = self.attempt(&event).await?;
        let failure = match outcome {
            Ok(()) => {
                self.delivered(&event, None).await;
                return Ok(());
            }
            Err(failure) => failure,
        };
        self.n_failed += 1;
        let (attempts, seq) = (&self.open.attempts, event.seq);
        match failure {
            Undelivered::Closed(reason) => attempts.close(&reason),
            Undelivered::Unreachable { reason, retry_after } => {
                if self.is_given_up(&event).await? {
                    return self.put_aside(event, DeliveryState::Dead, reason).await;
                }
                attempts.unreachable(&reason, retry_after, seq.unsigned_abs());
                self.announce_waiting(reason).await;
            }
            Undelivered::Refused(reason) => match retry_in(self.open.door.retries(), self.n_failed) {
                Some(delay) if self.n_failed < YIELDS_AFTER => {
                    attempts.refused(&reason, jittered(delay, seq.unsigned_abs()));
                    self.announce_waiting(reason).await;
                }
                _ => return self.put_aside(event, DeliveryState::Waiting, reason).await,
            },
            Undelivered::Impossible(reason) => return self.put_aside(event, DeliveryState::Dead, reason).await,
        }
        Ok(())
    }

    /// Tries again to deliver what was set aside.
    async fn retry(&mut self, delivery: DeliveryRecord) -> Result<(), StoreError> {
        let outcome = self.attempt(&delivery.event).await?;
        let failure = match outcome {
            Ok(()) => {
                let done = Change::DeleteDelivery { door: delivery.door, seq: delivery.event.seq };
                self.delivered(&delivery.event, Some(done)).await;
                return Ok(());
            }
            Err(failure) => failure,
        };
        let (attempts, seed) = (&self.open.attempts, delivery.event.seq.unsigned_abs());
        let n_attempts = delivery.n_attempts + 1;
        let (reason, delay) = match failure {
            Undelivered::Closed(reason) => {
                attempts.close(&reason);
                return Ok(());
            }
            Undelivered::Unreachable { reason, retry_after } => {
                if !self.is_given_up(&delivery.event).await? {
                    attempts.unreachable(&reason, retry_after, seed);
                    self.announce_waiting(reason).await;
                    return Ok(());
                }
                (reason, None)
            }
            Undelivered::Refused(reason) => {
                let n_failed = u32::try_from(n_attempts).unwrap_or(u32::MAX);
                (reason, retry_in(self.open.door.retries(), n_failed))
            }
            Undelivered::Impossible(reason) => (reason, None),
        };
        let again = DeliveryRecord { n_attempts, reason, ..delivery };
        let changes = match delay {
            Some(delay) => vec![Change::PutDelivery(DeliveryRecord { next_at_ms: due(delay, seed), ..again })],
            None => dead(again),
        };
        self.catalogue.commit(changes).await?;
        Ok(())
    }

    /// One attempt; what cannot be read is as good as impossible to deliver.
    async fn attempt(&self, event: &EventRecord) -> Result<Result<(), Undelivered>, StoreError> {
        let outcome = match Delivery::of(self.catalogue.read(), event.clone()).await {
            Ok(delivery) => match self.with_report(delivery).await {
                Ok(delivery) => self.open.door.deliver(&delivery).await,
                Err(error) => Err(Undelivered::Refused(format!("the report cannot be made: {}", error.detail))),
            },
            Err(error @ (StoreError::DamagedRecord { .. } | StoreError::NotFound { .. })) => {
                Err(Undelivered::Impossible(error.to_string()))
            }
            Err(error) => return Err(error),
        };
        self.open.attempts.log(Some(event), &outcome);
        if let Err(why) = &outcome {
            tracing::warn!(door = self.record.name, event = event.seq, reason = %why, "an event was not delivered");
        }
        Ok(outcome)
    }

    /// With the report of its inspection, if the door wants it.
    async fn with_report(&self, delivery: Delivery) -> Result<Delivery, AppError> {
        match &delivery.inspection {
            Some(inspection) if self.open.door.wants_report() => {
                let (read, artifacts) = (self.catalogue.read(), &*self.artifacts);
                let report = inspection_report(read, artifacts, &inspection.id, ReportFormat::Pdf).await?;
                Ok(Delivery { report_pdf: Some(report), ..delivery })
            }
            _ => Ok(delivery),
        }
    }

    /// Whether an event that cannot be delivered is given up: it is too old, or too many wait behind it.
    async fn is_given_up(&self, event: &EventRecord) -> Result<bool, StoreError> {
        let age_ms = now_ms().saturating_sub(event.at_ms);
        let is_old = self.open.door.gives_up_after().is_some_and(|limit| age_ms > limit.as_millis() as i64);
        Ok(is_old || self.catalogue.read().last_event_seq().await? - self.record.seq > EVENTS_KEPT_FOR_DOORS)
    }

    /// Passes the first event ahead, which is set aside in the same transaction.
    async fn put_aside(
        &mut self,
        event: EventRecord,
        state: DeliveryState,
        reason: String,
    ) -> Result<(), StoreError> {
        let seq = event.seq;
        let delay = retry_in(self.open.door.retries(), self.n_failed).unwrap_or_default();
        let record = DeliveryRecord {
            door: self.record.name.clone(),
            event,
            state,
            n_attempts: self.n_failed.into(),
            next_at_ms: due(delay, seq.unsigned_abs()),
            reason,
        };
        let mut changes = match state {
            DeliveryState::Waiting => vec![Change::PutDelivery(record)],
            DeliveryState::Dead => dead(record),
        };
        changes.push(Change::PutDoor(DoorRecord { seq, ..self.record.clone() }));
        self.catalogue.commit(changes).await?;
        self.pass(seq);
        Ok(())
    }

    fn pass(&mut self, seq: i64) {
        self.record.seq = self.record.seq.max(seq);
        self.open.attempts.pass(self.record.seq);
        self.open.attempts.reopen();
        self.ahead.pop_front_if(|event| event.seq <= seq);
        self.n_failed = 0;
    }

    /// The receiver has acknowledged. If that cannot be stored, it is stored with the next delivery: to deliver again
    /// would not help.
    async fn delivered(&mut self, event: &EventRecord, done: Option<Change>) {
        if done.is_none() {
            self.pass(event.seq);
        }
        self.open.attempts.succeeded();
        self.record.n_delivered += 1;
        (self.record.delivered_seq, self.record.delivered_at_ms) = (Some(event.seq), Some(now_ms()));
        let mut changes: Vec<_> = done.into_iter().collect();
        changes.push(Change::PutDoor(self.record.clone()));
        if std::mem::take(&mut self.waiting_announced) {
            changes.push(event_of(&self.record.name, Event::DoorRecovered(EmptyBody {})));
        }
        if let Err(error) = self.catalogue.commit(changes).await {
            tracing::warn!(door = self.record.name, event = event.seq, %error, "a delivery could not be stored");
        }
    }

    /// Puts into the log that the door waits, once it has failed twice in a row.
    async fn announce_waiting(&mut self, reason: String) {
        if self.waiting_announced || self.n_failed < 2 {
            return;
        }
        let waiting =
            DoorWaiting { kind: self.open.door.kind().to_owned(), target: self.open.door.target(), reason };
        let waiting = event_of(&self.record.name, Event::DoorWaiting(waiting));
        match self.catalogue.commit(vec![waiting]).await {
            Ok(_) => self.waiting_announced = true,
            Err(error) => tracing::warn!(door = self.record.name, %error, "the log does not say that it waits"),
        }
    }
}

fn due(delay: Duration, seed: u64) -> i64 {
    let delay_ms = i64::try_from(jittered(delay, seed).as_millis()).unwrap_or(i64::MAX);
    now_ms().saturating_add(delay_ms)
}

/// A delivery that is no longer tried, and the event about it.
fn dead(record: DeliveryRecord) -> Vec<Change> {
    let about = DeliveryDead {
        seq: record.event.seq,
        kind: record.event.kind.clone(),
        n_attempts: record.n_attempts,
        reason: record.reason.clone(),
    };
    let event = event_of(&record.door, Event::DeliveryDead(about));
    vec![Change::PutDelivery(DeliveryRecord { state: DeliveryState::Dead, ..record }), event]
}
