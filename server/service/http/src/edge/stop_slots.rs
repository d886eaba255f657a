//! Slots reserved for Stop when all other connections are taken. A new connection always gets one: it evicts the oldest
//! connection of the address that holds the most slots, so that one busy address cannot keep a Stop from another out.

use parking_lot::{Mutex, MutexGuard};
use std::collections::{HashMap, VecDeque};
use std::net::IpAddr;
use std::sync::Arc;

use tokio::sync::oneshot;

/// The slots.
#[derive(Clone)]
pub struct StopSlots {
    limit: usize,
    held: Arc<Mutex<Held>>,
}

#[derive(Default)]
struct Held {
    next: u64,
    /// Oldest first.
    slots: VecDeque<Occupied>,
}

struct Occupied {
    number: u64,
    address: IpAddr,
    _evict: oneshot::Sender<()>,
}

/// One slot.
pub struct Slot {
    number: u64,
    evicted: oneshot::Receiver<()>,
    slots: StopSlots,
}

impl StopSlots {
    /// `n` slots.
    pub fn new(limit: usize) -> Self {
        Self { limit, held: Arc::default() }
    }

    /// A slot for a connection from `address`.
    pub fn take(&self, address: IpAddr) -> Slot {
        let (evict, evicted) = oneshot::channel();
        let mut held = self.held();
        if held.slots.len() >= self.limit {
            held.evict_one();
        }
        let number = held.next;
        held.next += 1;
        held.slots.push_back(Occupied { number, address, _evict: evict });
        Slot { number, evicted, slots: self.clone() }
    }

    fn held(&self) -> MutexGuard<'_, Held> {
        self.held.lock()
    }
}

impl Held {
    /// Drops the sender of the oldest connection of the address with the most slots, which closes that connection.
    fn evict_one(&mut self) {
        let mut counts: HashMap<IpAddr, usize> = HashMap::new();
        for slot in &self.slots {
            *counts.entry(slot.address).or_default() += 1;
        }
        let most = counts.values().copied().max().unwrap_or(0);
        let oldest = self.slots.iter().position(|slot| counts[&slot.address] == most);
        if let Some(idx) = oldest {
            drop(self.slots.remove(idx));
        }
    }
}

impl Slot {
    /// Runs the connection until it ends or is evicted.
    pub async fn hold(mut self, connection: impl Future<Output = ()>) {
        tokio::select! {
            () = connection => {}
            _ = &mut self.evicted => {}
        }
    }
}

impl Drop for Slot {
    fn drop(&mut self) {
        self.slots.held().slots.retain(|slot| slot.number != self.number);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[tokio::test]
    async fn many_connections_from_one_address_evict_each_other_and_not_one_from_another() {
        let slots = StopSlots::new(3);
        let (crowd, other) = ("10.0.0.1".parse().unwrap(), "10.0.0.2".parse().unwrap());
        let first = slots.take(crowd);
        let mut single = slots.take(other);
        let mut second = slots.take(crowd);
        let mut third = slots.take(crowd);
        for slot in [&mut single, &mut second, &mut third] {
            assert_eq!(slot.evicted.try_recv(), Err(oneshot::error::TryRecvError::Empty));
        }
        // The oldest of the many is evicted; if it were kept, this would never return.
        first.hold(std::future::pending()).await;
        assert_eq!(slots.held().slots.len(), 3);
    }
}
