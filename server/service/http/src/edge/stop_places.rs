//! Slots reserved for Stop when all other connections are taken. A new connection always gets one: it evicts the oldest
//! connection of the address that holds the most slots, so that one busy address cannot keep a Stop from another out.

use parking_lot::{Mutex, MutexGuard};
use std::collections::{HashMap, VecDeque};
use std::net::IpAddr;
use std::sync::Arc;

use tokio::sync::oneshot;

/// The slots.
#[derive(Clone)]
pub struct StopPlaces {
    limit: usize,
    held: Arc<Mutex<Held>>,
}

#[derive(Default)]
struct Held {
    next: u64,
    /// Oldest first.
    places: VecDeque<Occupied>,
}

struct Occupied {
    number: u64,
    address: IpAddr,
    _evict: oneshot::Sender<()>,
}

/// One slot.
pub struct Place {
    number: u64,
    evicted: oneshot::Receiver<()>,
    places: StopPlaces,
}

impl StopPlaces {
    /// `n` slots.
    pub fn new(limit: usize) -> Self {
        Self { limit, held: Arc::default() }
    }

    /// A slot for a connection from `address`.
    pub fn take(&self, address: IpAddr) -> Place {
        let (evict, evicted) = oneshot::channel();
        let mut held = self.held();
        if held.places.len() >= self.limit {
            held.evict_one();
        }
        let number = held.next;
        held.next += 1;
        held.places.push_back(Occupied { number, address, _evict: evict });
        Place { number, evicted, places: self.clone() }
    }

    fn held(&self) -> MutexGuard<'_, Held> {
        self.held.lock()
    }
}

impl Held {
    /// Drops the sender of the oldest connection of the address with the most slots, which closes that connection.
    fn evict_one(&mut self) {
        let mut counts: HashMap<IpAddr, usize> = HashMap::new();
        for place in &self.places {
            *counts.entry(place.address).or_default() += 1;
        }
        let most = counts.values().copied().max().unwrap_or(0);
        let oldest = self.places.iter().position(|place| counts[&place.address] == most);
        if let Some(idx) = oldest {
            drop(self.places.remove(idx));
        }
    }
}

impl Place {
    /// Runs the connection until it ends or is evicted.
    pub async fn hold(mut self, connection: impl Future<Output = ()>) {
        tokio::select! {
            () = connection => {}
            _ = &mut self.evicted => {}
        }
    }
}

impl Drop for Place {
    fn drop(&mut self) {
        self.places.held().places.retain(|place| place.number != self.number);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[tokio::test]
    async fn many_connections_from_one_address_evict_each_other_and_not_one_from_another() {
        let places = StopPlaces::new(3);
        let (crowd, other) = ("10.0.0.1".parse().unwrap(), "10.0.0.2".parse().unwrap());
        let first = places.take(crowd);
        let mut single = places.take(other);
        let mut second = places.take(crowd);
        let mut third = places.take(crowd);
        for place in [&mut single, &mut second, &mut third] {
            assert_eq!(place.evicted.try_recv(), Err(oneshot::error::TryRecvError::Empty));
        }
        // The oldest of the many is evicted; if it were kept, this would never return.
        first.hold(std::future::pending()).await;
        assert_eq!(places.held().places.len(), 3);
    }
}
