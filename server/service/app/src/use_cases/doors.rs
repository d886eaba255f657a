//! Dead letters: resend, delete.

use store::{Change, DeliveryRecord, DeliveryState};

use crate::App;
use crate::access::principal::Principal;
use crate::error::AppError;
use crate::events::{DeliveriesChanged, Event, event};

/// Most deliveries resent by one request.
const RESENT_AT_ONCE: u32 = 1000;

/// What to resend.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Resend {
    /// This delivery that was set aside, dead or waiting.
    One(i64),
    /// All dead letters of the door, oldest first, at most a thousand.
    AllDead,
}

/// Tries deliveries again at once, with as many attempts as new ones; returns the numbers of their events.
///
/// # Errors
/// The door is not configured, the delivery does not exist, or the store cannot be used.
pub async fn resend(app: &App, by: &Principal, door: &str, which: Resend) -> Result<Vec<i64>, AppError> {
    let records = match which {
        Resend::One(seq) => {
            app.doors.get(door).await?;
            vec![app.catalogue.read().delivery(door, seq).await?]
        }
        Resend::AllDead => {
            app.doors.deliveries(door, Some(DeliveryState::Dead), 0, RESENT_AT_ONCE).await?.whole()?
        }
    };
    let seqs: Vec<_> = records.iter().map(|record| record.event.seq).collect();
    if seqs.is_empty() {
        return Ok(seqs);
    }
    let again = |record: DeliveryRecord| {
        let waiting = DeliveryRecord { state: DeliveryState::Waiting, n_attempts: 0, next_at_ms: 0, ..record };
        Change::PutDelivery(waiting)
    };
    let mut changes: Vec<_> = records.into_iter().map(again).collect();
    let resent = DeliveriesChanged { initiator: by.initiator(), seqs: seqs.clone() };
    changes.push(event(door, Event::DeliveryResent(resent)));
    app.doors.change(door, changes).await?;
    Ok(seqs)
}

/// Deletes a delivery that was set aside: it is never made.
///
/// # Errors
/// The door is not configured, the delivery does not exist, or the store cannot be written.
pub async fn delete_delivery(app: &App, by: &Principal, door: &str, seq: i64) -> Result<(), AppError> {
    let deleted = DeliveriesChanged { initiator: by.initiator(), seqs: vec![seq] };
    let changes =
        vec![Change::DeleteDelivery { door: door.to_owned(), seq }, event(door, Event::DeliveryDeleted(deleted))];
    app.doors.change(door, changes).await
}
