//! Who watches what, so that nothing is computed for nobody.

use std::collections::BTreeMap;

use tokio::sync::watch;

/// What can be watched.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Sight {
    /// Pictures, made smaller by this factor.
    Image {
        /// 1, 2 or 4.
        scale: u8,
    },
    /// Profiles.
    Profile,
}

/// All wishes of this moment.
#[derive(Debug, Clone, Default)]
pub struct Wishes {
    by_number: BTreeMap<u64, (Sight, f64)>,
    next: u64,
}

impl Wishes {
    /// The highest rate at which somebody wants to see that; `None`: nobody does.
    pub fn rate_hz(&self, sight: Sight) -> Option<f64> {
        self.by_number.values().filter(|(wanted, _)| *wanted == sight).map(|(_, rate)| *rate).reduce(f64::max)
    }

    /// The highest rate at which anything is wanted.
    pub fn any_rate_hz(&self) -> Option<f64> {
        self.by_number.values().map(|(_, rate)| *rate).reduce(f64::max)
    }
}

/// Somebody's wish; it ends when this is dropped.
pub struct Wish {
    number: u64,
    all: watch::Sender<Wishes>,
}

impl Wish {
    /// Adds a wish to `all`.
    pub(super) fn new(all: &watch::Sender<Wishes>, sight: Sight, rate_hz: f64) -> Self {
        let mut number = 0;
        all.send_modify(|wishes| {
            number = wishes.next;
            wishes.next += 1;
            wishes.by_number.insert(number, (sight, rate_hz));
        });
        Self { number, all: all.clone() }
    }
}

impl Drop for Wish {
    fn drop(&mut self) {
        self.all.send_modify(|wishes| {
            wishes.by_number.remove(&self.number);
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_fastest_wish_counts_until_it_ends() {
        let all = watch::Sender::new(Wishes::default());
        let _slow = Wish::new(&all, Sight::Profile, 5.0);
        let fast = Wish::new(&all, Sight::Profile, 60.0);
        assert_eq!(all.borrow().rate_hz(Sight::Profile), Some(60.0));
        drop(fast);
        assert_eq!(all.borrow().rate_hz(Sight::Profile), Some(5.0));
        assert_eq!(all.borrow().rate_hz(Sight::Image { scale: 1 }), None);
    }
}
