//! A door whose receiver follows a script, on the real store.

#![allow(clippy::unwrap_used)]

use std::collections::VecDeque;
use std::sync::Arc;
use std::time::Duration;

use async_trait::async_trait;
use parking_lot::Mutex;
use store::{Change, DeliveryState, EventRecord, Store};
use tokio::task::JoinHandle;
use tokio_util::sync::CancellationToken;

use crate::doors::{Delivery, Door, DoorState, DoorView, Doors, Undelivered};
use crate::evented_catalogue::EventedCatalogue;

const PATIENCE: Duration = Duration::from_secs(60);
const SOON: Duration = Duration::from_millis(20);

/// What the receiver does with an event.
type Answer = Box<dyn FnMut(&EventRecord) -> Result<(), Undelivered> + Send>;

struct Scripted {
    answer: Mutex<Answer>,
    received: Mutex<Vec<String>>,
    gives_up_after: Option<Duration>,
}

#[async_trait]
impl Door for Scripted {
    fn name(&self) -> &str {
        "mes"
    }

    fn kind(&self) -> &'static str {
        "scripted"
    }

    fn target(&self) -> String {
        "a script".to_owned()
    }

    fn wants(&self, event: &EventRecord) -> bool {
        event.kind == "scan.created" || event.kind == "inspection.finished" || event.kind.starts_with("door.")
    }

    fn gives_up_after(&self) -> Option<Duration> {
        self.gives_up_after
    }

    fn retries(&self) -> &[Duration] {
        const { &[SOON, Duration::from_millis(40), Duration::from_millis(60), Duration::from_millis(80)] }
    }

    async fn deliver(&self, delivery: &Delivery) -> Result<(), Undelivered> {
        (self.answer.lock())(&delivery.event)?;
        self.received.lock().push(delivery.event.subject.clone());
        Ok(())
    }
}

struct Bench {
    store: Store,
    catalogue: EventedCatalogue,
    door: Arc<Scripted>,
    doors: Doors,
    closing: CancellationToken,
    tasks: Vec<JoinHandle<()>>,
    _folder: tempfile::TempDir,
}

impl Bench {
    async fn new(gives_up_after: Option<Duration>) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let store = Store::open(folder.path()).await.unwrap();
        let catalogue = EventedCatalogue::open(store.catalogue.clone()).await.unwrap();
        let door = Arc::new(Scripted {
            answer: Mutex::new(Box::new(|_| Ok(()))),
            received: Mutex::default(),
            gives_up_after,
        });
        let doors = Doors::new(catalogue.clone(), vec![door.clone()]);
        let (closing, tasks) = (CancellationToken::new(), Vec::new());
        Self { store, catalogue, door, doors, closing, tasks, _folder: folder }
    }

    fn answer(&self, answer: impl FnMut(&EventRecord) -> Result<(), Undelivered> + Send + 'static) {
        *self.door.answer.lock() = Box::new(answer);
    }

    /// Starts the task; returns once its position is stored.
    async fn start(&mut self) {
        self.tasks = self.doors.start_delivering(&self.store.artifacts, &self.closing);
        while self.catalogue.read().door("mes").await.unwrap().is_none() {
            tokio::time::sleep(SOON).await;
        }
    }

    /// Ends the task as a crash would, and starts another one on what is stored.
    async fn restart(&mut self) {
        self.tasks.drain(..).for_each(|task| task.abort());
        self.doors = Doors::new(self.catalogue.clone(), vec![self.door.clone()]);
        self.start().await;
    }

    async fn happen(&self, kind: &str, subjects: &[&str]) {
        let event = |subject: &&str| {
            Change::AppendEvent(EventRecord {
                seq: 0,
                kind: kind.to_owned(),
                subject: (*subject).to_owned(),
                body: serde_json::json!({}),
                at_ms: station::wall_clock::now_ms(),
            })
        };
        self.catalogue.commit(subjects.iter().map(event).collect()).await.unwrap();
    }

    async fn until(&self, what: impl Fn(&DoorView, &[String]) -> bool) -> DoorView {
        let begun = std::time::Instant::now();
        loop {
            let view = self.doors.get("mes").await.unwrap();
            let received = self.door.received.lock().clone();
            if what(&view, &received) {
                return view;
            }
            assert!(begun.elapsed() < PATIENCE, "{view:?} {received:?}");
            tokio::time::sleep(SOON).await;
        }
    }

    async fn received(&self, subjects: &[&str]) -> DoorView {
        self.until(|view, received| {
            let stored = view.record.as_ref().is_some_and(|record| record.n_delivered >= subjects.len() as i64);
            received == subjects && stored
        })
        .await
    }

    async fn kinds_in_log(&self) -> Vec<String> {
        let events = self.catalogue.read().events_after(0, 1000).await.unwrap().records;
        events.into_iter().map(|event| event.kind).collect()
    }
}

impl Drop for Bench {
    fn drop(&mut self) {
        self.closing.cancel();
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn events_are_delivered_in_order_from_the_first_start_on_and_across_restarts() {
    let mut bench = Bench::new(None).await;
    bench.happen("scan.created", &["before"]).await;
    bench.start().await;
    bench.happen("scan.created", &["a"]).await;
    bench.happen("job.queued", &["unwanted"]).await;
    bench.happen("scan.created", &["b", "c"]).await;
    bench.received(&["a", "b", "c"]).await;
    bench.restart().await;
    bench.happen("scan.created", &["d"]).await;
    let view = bench.received(&["a", "b", "c", "d"]).await;
    assert_eq!(view.record.unwrap().delivered_seq, Some(6));
    assert_eq!(bench.doors.passed_by_all(), Some(6));
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn an_unreachable_receiver_holds_everything_in_order_and_loses_nothing() {
    let mut bench = Bench::new(None).await;
    bench.start().await;
    bench.answer(|_| Err(Undelivered::unreachable("no answer")));
    let all: Vec<String> = (0..250).map(|n| n.to_string()).collect();
    let all: Vec<&str> = all.iter().map(String::as_str).collect();
    bench.happen("scan.created", &all).await;
    let waiting = bench.until(|view, _| view.state == DoorState::Waiting && view.attempts.len() > 1).await;
    assert_eq!(waiting.reason.as_deref(), Some("no answer"));
    // With the event that says so.
    bench.until(|view, _| view.n_behind == 251).await;
    assert_eq!(bench.kinds_in_log().await.last().unwrap(), "door.waiting");
    bench.restart().await;
    bench.answer(|_| Ok(()));
    bench.received(&all).await;
    assert_eq!(bench.doors.get("mes").await.unwrap().set_aside, store::SetAside::default());
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_refused_event_lets_others_pass_and_ends_as_a_dead_letter_that_can_be_resent() {
    let mut bench = Bench::new(None).await;
    bench.start().await;
    bench.answer(|event| match event.subject.as_str() {
        "bad" => Err(Undelivered::Refused("answered 500".to_owned())),
        _ => Ok(()),
    });
    bench.happen("scan.created", &["a", "bad", "b"]).await;
    bench.received(&["a", "b"]).await;
    let view = bench.until(|view, _| view.set_aside.n_dead == 1).await;
    assert_eq!((view.state, view.set_aside.n_waiting), (DoorState::Delivering, 0));
    let dead = bench.doors.deliveries("mes", Some(DeliveryState::Dead), 0, 9).await.unwrap().records;
    assert_eq!((dead[0].event.subject.as_str(), dead[0].n_attempts), ("bad", 5));
    assert!(bench.kinds_in_log().await.contains(&"delivery.dead".to_owned()));

    bench.answer(|_| Ok(()));
    let again =
        store::DeliveryRecord { state: DeliveryState::Waiting, n_attempts: 0, next_at_ms: 0, ..dead[0].clone() };
    bench.doors.change("mes", vec![Change::PutDelivery(again)]).await.unwrap();
    bench.received(&["a", "b", "bad"]).await;
    bench.until(|view, _| view.set_aside == store::SetAside::default()).await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn what_is_too_old_is_given_up_after_an_attempt() {
    let mut bench = Bench::new(Some(Duration::ZERO)).await;
    bench.start().await;
    let mut failures = VecDeque::from([(), ()]);
    bench.answer(move |_| match failures.pop_front() {
        Some(()) => {
            std::thread::sleep(Duration::from_millis(2));
            Err(Undelivered::unreachable("no route"))
        }
        None => Ok(()),
    });
    bench.happen("scan.created", &["a", "b", "c"]).await;
    bench.until(|_, received| received == ["c"]).await;
    bench.until(|view, _| view.set_aside.n_dead == 2).await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_receiver_that_wants_no_more_gets_nothing_until_a_user_tests_the_door() {
    let mut bench = Bench::new(None).await;
    bench.start().await;
    bench.answer(|_| Err(Undelivered::Closed("answered 410".to_owned())));
    bench.happen("scan.created", &["a"]).await;
    bench.until(|view, _| view.state == DoorState::Closed).await;
    let n = bench.doors.get("mes").await.unwrap().attempts.len();
    bench.happen("scan.created", &["b"]).await;
    tokio::time::sleep(SOON * 10).await;
    assert_eq!(bench.doors.get("mes").await.unwrap().attempts.len(), n);
    bench.doors.test("mes").await.unwrap_err();
    bench.answer(|_| Ok(()));
    bench.doors.test("mes").await.unwrap();
    bench.until(|_, received| received == ["mes", "a", "b"]).await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn an_inspection_that_cannot_be_read_is_a_dead_letter() {
    let mut bench = Bench::new(None).await;
    bench.start().await;
    bench.happen("inspection.finished", &["missing"]).await;
    bench.happen("scan.created", &["a"]).await;
    bench.received(&["a"]).await;
    let dead = bench.doors.deliveries("mes", None, 0, 9).await.unwrap().records;
    assert_eq!((dead[0].state, dead[0].n_attempts), (DeliveryState::Dead, 1));
    assert!(dead[0].reason.contains("missing"), "{}", dead[0].reason);
}
