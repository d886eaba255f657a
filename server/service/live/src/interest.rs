//! Demands of the viewers, so that nothing is computed without a viewer.

use std::collections::BTreeMap;

use tokio::sync::watch;

/// What can be viewed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum StreamKind {
    /// Images, downscaled by this factor.
    Image {
        /// 1, 2 or 4.
        scale: u8,
    },
    /// Profiles.
    Profile,
}

/// All current subscriptions.
#[derive(Debug, Clone, Default)]
pub struct Demands {
    by_number: BTreeMap<u64, (StreamKind, f64)>,
    next: u64,
}

impl Demands {
    /// The highest demanded rate of this kind; `None` without demand.
    pub fn rate_hz(&self, kind: StreamKind) -> Option<f64> {
        self.by_number.values().filter(|(wanted, _)| *wanted == kind).map(|(_, rate)| *rate).reduce(f64::max)
    }

    /// The highest demanded rate of any kind.
    pub fn any_rate_hz(&self) -> Option<f64> {
        self.by_number.values().map(|(_, rate)| *rate).reduce(f64::max)
    }
}

/// A demand; it ends when this is dropped.
pub struct Demand {
    number: u64,
    all: watch::Sender<Demands>,
}

impl Demand {
    /// Adds a demand to `all`.
    pub(super) fn new(all: &watch::Sender<Demands>, kind: StreamKind, rate_hz: f64) -> Self {
        let mut number = 0;
        all.send_modify(|demands| {
            number = demands.next;
            demands.next += 1;
            demands.by_number.insert(number, (kind, rate_hz));
        });
        Self { number, all: all.clone() }
    }
}

impl Drop for Demand {
    fn drop(&mut self) {
        self.all.send_modify(|demands| {
            demands.by_number.remove(&self.number);
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_fastest_demand_counts_until_it_ends() {
        let all = watch::Sender::new(Demands::default());
        let _slow = Demand::new(&all, StreamKind::Profile, 5.0);
        let fast = Demand::new(&all, StreamKind::Profile, 60.0);
        assert_eq!(all.borrow().rate_hz(StreamKind::Profile), Some(60.0));
        drop(fast);
        assert_eq!(all.borrow().rate_hz(StreamKind::Profile), Some(5.0));
        assert_eq!(all.borrow().rate_hz(StreamKind::Image { scale: 1 }), None);
    }
}
