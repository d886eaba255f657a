//! Counts of exposures: each arrives once or is counted as lost once.

/// Outcome of the exposures of one acquisition. Exposures are numbered from 0 in the order of the camera.
#[derive(Debug, Default, Clone, Copy, PartialEq, Eq)]
pub struct Exposures {
    next: u64,
    given_up_before: u64,
    requested: u64,
}

/// How a delivered frame is counted.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Delivered {
    /// It counts; the exposures lost before it are counted now.
    InTime {
        /// Exposures lost before it that were not counted yet.
        newly_lost: u64,
    },
    /// It was already counted as lost and must not count again.
    TooLate,
}

impl Exposures {
    /// Adds a requested exposure.
    pub fn request(&mut self) {
        self.requested += 1;
    }

    /// Requested exposures that neither arrived nor were given up.
    pub fn outstanding(&self) -> u64 {
        self.requested.saturating_sub(self.next.max(self.given_up_before))
    }

    /// Gives up the outstanding exposures; returns the number of newly lost ones.
    pub fn give_up(&mut self) -> u64 {
        let lost = self.outstanding();
        self.given_up_before = self.requested.max(self.given_up_before);
        lost
    }

    /// Adds a delivered frame before which `lost_before` exposures did not arrive.
    pub fn deliver(&mut self, lost_before: u64) -> Delivered {
        let id = self.next + lost_before;
        let newly_lost = id.saturating_sub(self.next.max(self.given_up_before));
        self.next = id + 1;
        self.requested = self.requested.max(self.next);
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
        exposures.request();
        assert_eq!(exposures.give_up(), 1);
        exposures.request();
        assert_eq!(exposures.deliver(1), Delivered::InTime { newly_lost: 0 });
        assert_eq!(exposures.outstanding(), 0);
    }

    #[test]
    fn a_frame_that_arrives_after_it_was_given_up_does_not_count() {
        let mut exposures = Exposures::default();
        exposures.request();
        assert_eq!(exposures.give_up(), 1);
        exposures.request();
        assert_eq!(exposures.deliver(0), Delivered::TooLate);
        assert_eq!(exposures.outstanding(), 1);
        assert_eq!(exposures.deliver(0), Delivered::InTime { newly_lost: 0 });
    }

    #[test]
    fn arrived_and_lost_add_up_to_exposed_in_any_sequence() {
        for sequence in 0..4_u32.pow(6) {
            let (mut exposures, mut exposed, mut arrived, mut lost, mut in_transfer) =
                (Exposures::default(), 0_u64, 0_u64, 0_u64, 0_u64);
            for step in 0..6 {
                match (sequence / 4_u32.pow(step)) % 4 {
                    0 => {
                        exposures.request();
                        (exposed, in_transfer) = (exposed + 1, in_transfer + 1);
                    }
                    1 => lost += exposures.give_up(),
                    deliver if in_transfer > 0 => {
                        let gap = if deliver == 2 { 0 } else { in_transfer - 1 };
                        match exposures.deliver(gap) {
                            Delivered::InTime { newly_lost } => (arrived, lost) = (arrived + 1, lost + newly_lost),
                            Delivered::TooLate => {}
                        }
                        in_transfer -= gap + 1;
                    }
                    _ => {}
                }
            }
            lost += exposures.give_up();
            assert_eq!(arrived + lost, exposed, "sequence {sequence}");
        }
    }
}
