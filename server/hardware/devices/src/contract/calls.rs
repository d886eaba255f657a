//! Time limits of calls, and waiting for a state.

use std::time::Duration;

use super::stopwatch::Stopwatch;
use crate::CALL_LIMIT;

/// Time that the operating system may add to a call on an idle machine.
pub const SCHEDULING_SLACK: Duration = Duration::from_millis(80);

/// Polling interval while waiting for a state; a station polls at this rate or slower.
const POLL_PERIOD: Duration = Duration::from_millis(2);

/// Calls `act`, which must return within [`CALL_LIMIT`].
pub fn short<T>(name: &str, act: impl FnOnce() -> T) -> T {
    within(CALL_LIMIT, name, act)
}

/// Calls `act`, which must return within `limit` plus the scheduling slack.
pub fn within<T>(limit: Duration, name: &str, act: impl FnOnce() -> T) -> T {
    let watch = Stopwatch::start();
    let result = act();
    let took = watch.own_time();
    assert!(took <= limit + SCHEDULING_SLACK, "`{name}` blocked its caller for {took:?}; the limit is {limit:?}");
    result
}

/// Polls until `condition` returns a value; panics with `what` after `limit`.
pub fn wait_for<T>(limit: Duration, what: &str, mut condition: impl FnMut() -> Option<T>) -> T {
    let watch = Stopwatch::start();
    loop {
        if let Some(value) = condition() {
            return value;
        }
        assert!(watch.own_time() < limit, "{what}: not within {limit:?}");
        crate::time::sleep(POLL_PERIOD);
    }
}
