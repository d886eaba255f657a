//! The account of exposures: each one arrives once or is counted as lost once.

/// What became of the exposures of one acquisition. Exposures are numbered from 0 as the camera makes them.
#[derive(Debug, Default, Clone, Copy, PartialEq, Eq)]
pub struct Exposures {
    next: u64,
    given_up_before: u64,
    asked_for: u64,
}

/// What a frame that the driver delivered means for the account.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Delivered {
    /// It counts; that many before it are lost and were not counted yet.
    InTime {
        /// Lost before it.
        newly_lost: u64,
    },
    /// It was given up and counted as lost; it must not count again.
    TooLate,
}

impl Exposures {
    /// One exposure was asked for.
    pub fn ask(&mut self) {
        self.asked_for += 1;
    }

    /// Exposures asked for that neither arrived nor were given up.
    pub fn outstanding(&self) -> u64 {
        self.asked_for.saturating_sub(self.next.max(self.given_up_before))
    }

    /// Gives up what is outstanding; returns how many are lost by that.
    pub fn give_up(&mut self) -> u64 {
        let lost = self.outstanding();
        self.given_up_before = self.asked_for.max(self.given_up_before);
        lost
    }

    /// The driver delivered a frame before which `lost_before` did not arrive.
    pub fn deliver(&mut self, lost_before: u64) -> Delivered {
        let id = self.next + lost_before;
        let newly_lost = id.saturating_sub(self.next.max(self.given_up_before));
        self.next = id + 1;
        self.asked_for = self.asked_for.max(self.next);
        if id < self.given_up_before { Delivered::TooLate } else { Delivered::InTime { newly_lost } }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_gap_is_counted_once() {
        let mut exposures = Exposures::default();
        assert_eq!(exposures.deliver(0), Delivered::InTime { newly_lost: 0 });
        assert_eq!(exposures.deliver(3), Delivered::InTime { newly_lost: 3 });
        assert_eq!(exposures.deliver(0), Delivered::InTime { newly_lost: 0 });
    }

    #[test]
    fn an_exposure_given_up_is_not_counted_again_when_the_driver_reports_it_lost() {
        let mut exposures = Exposures::default();
        exposures.ask();
        assert_eq!(exposures.give_up(), 1);
        exposures.ask();
        assert_eq!(exposures.deliver(1), Delivered::InTime { newly_lost: 0 });
        assert_eq!(exposures.outstanding(), 0);
    }

    #[test]
    fn a_frame_that_comes_after_it_was_given_up_does_not_count() {
        let mut exposures = Exposures::default();
        exposures.ask();
        assert_eq!(exposures.give_up(), 1);
        exposures.ask();
        assert_eq!(exposures.deliver(0), Delivered::TooLate);
        assert_eq!(exposures.outstanding(), 1);
        assert_eq!(exposures.deliver(0), Delivered::InTime { newly_lost: 0 });
    }

    #[test]
    fn whatever_happens_arrived_and_lost_add_up_to_exposed() {
        for story in 0..4_u32.pow(6) {
            let (mut exposures, mut exposed, mut arrived, mut lost, mut on_the_way) =
                (Exposures::default(), 0_u64, 0_u64, 0_u64, 0_u64);
            for step in 0..6 {
                match (story / 4_u32.pow(step)) % 4 {
                    0 => {
                        exposures.ask();
                        (exposed, on_the_way) = (exposed + 1, on_the_way + 1);
                    }
                    1 => lost += exposures.give_up(),
                    deliver if on_the_way > 0 => {
                        let gap = if deliver == 2 { 0 } else { on_the_way - 1 };
                        match exposures.deliver(gap) {
                            Delivered::InTime { newly_lost } => (arrived, lost) = (arrived + 1, lost + newly_lost),
                            Delivered::TooLate => {}
                        }
                        on_the_way -= gap + 1;
                    }
                    _ => {}
                }
            }
            lost += exposures.give_up();
            assert_eq!(arrived + lost, exposed, "story {story}");
        }
    }
}
