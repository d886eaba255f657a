//! Which reported positions are accepted: reports have no checksum, and a flipped bit turns one digit into another.
//!
//! At rest a position is accepted when it is reported twice. In motion it is accepted if it is where the move should be
//! by then, or else if the next report, which is requested at once, agrees with it. The remaining error is less than
//! the distance travelled between query and answer.

use std::time::{Duration, Instant};

use super::{Activity, LastReport, Link, MotionPath, Session};
use crate::params::GRBL_REPORT_AGE;

impl MotionPath {
    /// Distance from one position to the next along the direction of travel, mm, and the distance travelled at full
    /// speed in `time`.
    fn step_mm(&self, from_mm: f64, to_mm: f64) -> f64 {
        (to_mm - from_mm) * (self.to_mm - self.from_mm).signum()
    }

    fn at_full_speed_mm(&self, time: Duration) -> f64 {
        self.speed_mm_s * time.as_secs_f64()
    }

    /// Whether the move can have reached it by then at full speed since the last accepted position, up to the target.
    fn leads_to(&self, latest: &LastReport, last_report: &LastReport, rounding_mm: f64) -> bool {
        let step_mm = self.step_mm(last_report.machine_mm, latest.machine_mm);
        let left_mm = self.step_mm(last_report.machine_mm, self.to_mm).max(0.0);
        let (received_at, queried_at) =
            (last_report.received_at.max(self.since), last_report.queried_at.max(self.since));
        let shortest = latest.queried_at.saturating_duration_since(received_at + GRBL_REPORT_AGE);
        let longest = latest.received_at.saturating_duration_since(queried_at) + GRBL_REPORT_AGE;
        let least_mm = self.at_full_speed_mm(shortest).min(left_mm);
        let most_mm = self.at_full_speed_mm(longest).min(left_mm);
        (least_mm - rounding_mm..=most_mm + rounding_mm).contains(&step_mm)
    }

    /// Whether both can belong to one motion along the path, at any speed.
    fn agrees(&self, latest: &LastReport, before: &LastReport, rounding_mm: f64) -> bool {
        let step_mm = self.step_mm(before.machine_mm, latest.machine_mm);
        let longest = latest.received_at.saturating_duration_since(before.queried_at) + GRBL_REPORT_AGE;
        (-rounding_mm..=self.at_full_speed_mm(longest) + rounding_mm).contains(&step_mm)
    }
}

impl Session {
    /// Accepts a report, or keeps it as unconfirmed and queries again at once. An unconfirmed report that is not
    /// repeated counts as garbage.
    pub(super) fn accept(&mut self, latest: LastReport, now: Instant) -> bool {
        let unconfirmed = self.unconfirmed.take();
        let is_confirmed_by_repeat = unconfirmed.is_some_and(|unconfirmed| self.agree(&latest, &unconfirmed));
        if let Some(unconfirmed) = unconfirmed.filter(|_| !is_confirmed_by_repeat) {
            self.garbage(format!("a position of {} mm", unconfirmed.machine_mm), now);
            if !matches!(self.link, Link::Up) {
                return false;
            }
        }
        let is_accepted = is_confirmed_by_repeat || self.is_expected(&latest);
        if is_accepted {
            self.take(latest);
        } else {
            self.unconfirmed = Some(latest);
            self.query(now);
        }
        is_accepted
    }

    fn is_expected(&self, latest: &LastReport) -> bool {
        let Some(last_report) = &self.last_report else { return true };
        match (self.activity, &self.path) {
            (Activity::Rest, _) => !self.is_confirmed || last_report.machine_mm == latest.machine_mm,
            (Activity::Travel(_) | Activity::Stopping(_), Some(path)) => {
                path.leads_to(latest, last_report, self.rounding_mm())
            }
            // During these no position is reported before the end; and none stops without having moved.
            (Activity::Homing { .. } | Activity::Travel(_) | Activity::Stopping(_), _) => true,
        }
    }

    /// Whether two reports can belong to the same rest or motion.
    fn agree(&self, latest: &LastReport, before: &LastReport) -> bool {
        match (self.activity, &self.path) {
            (Activity::Rest, _) | (_, None) => latest.machine_mm == before.machine_mm,
            (_, Some(path)) => path.agrees(latest, before, self.rounding_mm()),
        }
    }

    fn take(&mut self, latest: LastReport) {
        let is_at_rest = self.activity == Activity::Rest && !latest.state.in_motion();
        let is_repeated = self.last_report.is_some_and(|last_report| {
            last_report.machine_mm == latest.machine_mm && !last_report.state.in_motion()
        });
        self.is_confirmed = is_at_rest && (self.is_confirmed || is_repeated);
        self.last_report = Some(latest);
    }

    /// Tolerance of a reported position: a step and a half, and half of the last decimal.
    pub(super) fn rounding_mm(&self) -> f64 {
        let resolution_mm = self.machine.as_ref().map_or(0.0, |machine| machine.capabilities.resolution_mm);
        1.5 * resolution_mm + 0.0005
    }
}
